# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""VoxelPipe for Conan 2: headers, and optionally the library of CUDA kernels."""
import os

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir

required_conan_version = ">=2.0.9"


class VoxelPipe(ConanFile):
    name = "voxelpipe"
    description = "Exact triangle voxelization on CPUs and GPUs: shaders, blending, A-buffers, solids, sparse grids"
    license = "Apache-2.0"
    homepage = "REPOSITORY_URL"
    topics = ("voxelization", "geometry", "graphics", "cuda", "header-only")
    settings = "os", "arch", "compiler", "build_type"
    options = {"cuda_kernels": [True, False]}
    default_options = {"cuda_kernels": False}

    def configure(self):
        self.package_type = "static-library" if self.options.cuda_kernels else "header-library"

    def layout(self):
        cmake_layout(self, src_folder="src")

    def requirements(self):
        self.requires("glm/[>=0.9.9.8 <2]", transitive_headers=True)

    def package_id(self):
        if not self.info.options.cuda_kernels:
            self.info.clear()

    def validate(self):
        check_min_cppstd(self, 20)
        if self.settings.compiler == "msvc":
            raise ConanInvalidConfiguration("No version of VoxelPipe was compiled with MSVC yet")
        if self.settings.arch not in ("x86_64", "armv8"):
            raise ConanInvalidConfiguration("VoxelPipe needs a 64-bit target")

    def source(self):
        get(self, **self.conan_data["sources"][self.version], strip_root=True)

    def generate(self):
        # Nothing is looked for: GLM is what the archive brings, and programs get Conan's.
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["CMAKE_DISABLE_FIND_PACKAGE_glm"] = True
        for part in ("TESTS", "SAMPLES", "BENCH"):
            toolchain.cache_variables[f"VOXELPIPE_BUILD_{part}"] = False
        toolchain.cache_variables["VOXELPIPE_INSTALL"] = True
        toolchain.cache_variables["VOXELPIPE_BUILD_CUDA_KERNELS"] = bool(self.options.cuda_kernels)
        toolchain.cache_variables["VOXELPIPE_ENABLE_CUDA"] = "ON" if self.options.cuda_kernels else "OFF"
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", src=self.source_folder, dst=os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        if not self.options.cuda_kernels:
            rmdir(self, os.path.join(self.package_folder, "lib"))

    def package_info(self):
        # The package's own config file, so that targets and components are those of an installation by hand.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("share", "cmake", "voxelpipe")]
        self.cpp_info.includedirs = [os.path.join("include", "voxelpipe")]
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = ["lib"] if self.options.cuda_kernels else []
