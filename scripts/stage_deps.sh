#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# stage_deps.sh [PREFIX]: copies what the build needs of third-party libraries from this machine's packages into PREFIX
# (default .deps/ in the project, which the other scripts look at by themselves), for a machine without packages and
# network. Headers, the GoogleTest sources, the static C libraries zlib, minizip and libdeflate, so that the other machine may
# have another distribution of the same architecture, and Google Benchmark as the shared library that Debian has (it needs a
# libstdc++ at least as new as this machine's):
#   cmake --preset cpu -DCMAKE_PREFIX_PATH=PREFIX
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

prefix="$(realpath -m "${1:-.deps}")"
gtest_source=/usr/src/googletest/googletest

need_packages libglm-dev libtinygltf-dev nlohmann-json3-dev libstb-dev libcli11-dev libgtest-dev zlib1g-dev libminizip-dev \
    libdeflate-dev libbenchmark-dev
[[ -e $gtest_source/src/gtest-all.cc ]] || need_packages googletest

# system_header NAME: the folder that holds it, not counting what was staged before.
system_include() {
    local folder
    for folder in /usr/local/include /usr/include; do
        [[ -e $folder/$1 ]] && { printf '%s' "$folder"; return 0; }
    done
    die "no $1 under /usr/local/include or /usr/include"
}

say "staging into $prefix"
rm -rf "$prefix"/{include,lib,share/cmake,src/googletest}
mkdir -p "$prefix"/{include/stb,lib,share/cmake,src}
cp -rL "$(system_include glm/glm.hpp)/glm" "$(system_include CLI/CLI.hpp)/CLI" \
    "$(system_include nlohmann/json.hpp)/nlohmann" "$(system_include gtest/gtest.h)/gtest" "$prefix/include/"
cp -L "$(system_include tiny_gltf.h)/tiny_gltf.h" "$prefix/include/"
cp -L "$(system_include stb/stb_image.h)"/stb/stb_image*.h "$prefix/include/stb/"
cp -rL "$(system_include minizip/zip.h)/minizip" "$prefix/include/"
cp -L "$(system_include zlib.h)/zlib.h" "$(system_include libdeflate.h)/libdeflate.h" "$prefix/include/"
cp -rL "$(system_include benchmark/benchmark.h)/benchmark" "$prefix/include/"
# Beside zlib.h or in the architecture's folder; other packages bring one of their own, of another version.
zconf=$(find /usr/local/include /usr/include /usr/include/*-linux-gnu -maxdepth 1 -name zconf.h 2>/dev/null | head -n 1) || true
cp -L "${zconf:?no zconf.h beside zlib.h}" "$prefix/include/"
for library in libz.a libminizip.a libdeflate.a; do
    archive=$(find /usr/lib /usr/local/lib -name "$library" 2>/dev/null | head -n 1)
    cp -L "${archive:?no $library under /usr/lib}" "$prefix/lib/"
done
benchmark=$(find /usr/lib /usr/local/lib -name libbenchmark.so 2>/dev/null | head -n 1)
benchmark=$(realpath "${benchmark:?no libbenchmark.so under /usr/lib}")
# Programs look for the library under the name that it calls itself.
soname=$(readelf -d "$benchmark" | sed -n 's/.*SONAME.*\[\(.*\)\].*/\1/p')
cp "$benchmark" "$prefix/lib/${soname:?libbenchmark.so has no name of its own}"
mkdir -p "$prefix/src/googletest"
cp -rL "$gtest_source/src" "$prefix/src/googletest/"

# config PACKAGE TARGET: a config file that gives an INTERFACE target with the staged headers.
config() {
    mkdir -p "$prefix/share/cmake/$1"
    cat >"$prefix/share/cmake/$1/$1Config.cmake" <<CMAKE
# Written by scripts/stage_deps.sh
if(NOT TARGET $2)
  get_filename_component(staged_prefix "\${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
  add_library($2 INTERFACE IMPORTED)
  set_target_properties($2 PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "\${staged_prefix}/include")
endif()
CMAKE
}
config glm glm::glm
config CLI11 CLI11::CLI11
config nlohmann_json nlohmann_json::nlohmann_json

mkdir -p "$prefix/share/cmake/benchmark"
cat >"$prefix/share/cmake/benchmark/benchmarkConfig.cmake" <<CMAKE
# Written by scripts/stage_deps.sh
if(NOT TARGET benchmark::benchmark)
  get_filename_component(staged_prefix "\${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
  find_package(Threads REQUIRED)
  add_library(benchmark::benchmark SHARED IMPORTED)
  set_target_properties(
    benchmark::benchmark
    PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "\${staged_prefix}/include"
               INTERFACE_LINK_LIBRARIES Threads::Threads
               IMPORTED_LOCATION "\${staged_prefix}/lib/$soname"
               IMPORTED_SONAME "$soname")
endif()
CMAKE

mkdir -p "$prefix/share/cmake/GTest"
cat >"$prefix/share/cmake/GTest/GTestConfig.cmake" <<'CMAKE'
# Written by scripts/stage_deps.sh: GoogleTest is compiled by the project that uses it.
if(NOT TARGET GTest::gtest)
  get_filename_component(staged_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
  find_package(Threads REQUIRED)
  add_library(staged_gtest STATIC EXCLUDE_FROM_ALL "${staged_prefix}/src/googletest/src/gtest-all.cc")
  target_include_directories(staged_gtest SYSTEM PUBLIC "${staged_prefix}/include" PRIVATE "${staged_prefix}/src/googletest")
  target_compile_features(staged_gtest PUBLIC cxx_std_14)
  target_link_libraries(staged_gtest PUBLIC Threads::Threads)
  add_library(staged_gtest_main STATIC EXCLUDE_FROM_ALL "${staged_prefix}/src/googletest/src/gtest_main.cc")
  target_link_libraries(staged_gtest_main PUBLIC staged_gtest)
  add_library(GTest::gtest ALIAS staged_gtest)
  add_library(GTest::gtest_main ALIAS staged_gtest_main)
endif()
CMAKE

du -sh "$prefix"
