# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from spack.package import *


class Voxelpipe(CMakePackage, CudaPackage):
    """Exact triangle voxelization on CPUs and GPUs: shaders, blending, A-buffers, solids, sparse grids.

    Headers; with +cuda also the library of kernels, which spares programs their compilation."""

    homepage = "REPOSITORY_URL"
    url = "ARCHIVE_URL"

    license("Apache-2.0")

    version("0.1.0", sha256="ARCHIVE_SHA256")

    depends_on("cxx", type="build")
    depends_on("cmake@3.24:", type="build")
    depends_on("glm@0.9.9.8:", type=("build", "link", "run"))
    depends_on("cuda@13:", when="+cuda")

    requires("%gcc@12:", "%clang@14:", "%apple-clang@15:", policy="any_of", msg="C++20 and __int128")

    def cmake_args(self):
        cuda = self.spec.satisfies("+cuda")
        args = [
            self.define("VOXELPIPE_BUILD_TESTS", self.run_tests),
            self.define("VOXELPIPE_BUILD_SAMPLES", False),
            self.define("VOXELPIPE_BUILD_BENCH", False),
            self.define("VOXELPIPE_INSTALL", True),
            self.define("VOXELPIPE_BUILD_CUDA_KERNELS", cuda),
            self.define("VOXELPIPE_ENABLE_CUDA", "ON" if cuda else "OFF"),
        ]
        architectures = self.spec.variants["cuda_arch"].value if cuda else ()
        if architectures and architectures[0] != "none":
            args.append(self.define("CMAKE_CUDA_ARCHITECTURES", list(architectures)))
        return args
