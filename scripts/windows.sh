#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes build/windows/tool/voxelize.exe, the voxelize tool for Windows on x86-64, and build/windows/capi/voxelpipe.dll, the C API
# with its list of functions (voxelpipe.def) and MinGW's import library: each one file without another DLL beside it.
#
#   scripts/windows.sh [--check] [--release]
#       --check: runs them under wine, too: the tests of both, and the golden hashes of the library and of the tool's files
#       --release: optimised as those of a release are, which takes longer to compile
#
# The compiler is MinGW-w64. Libraries are built from the sources of the machine's distribution, as for wheels. Needs apt-get, and a
# network at the first time. Models that assimp reads, Draco's meshes, zstd's chunks and .vdb are refused by name.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

check=0 tool_options=-O1
for word in "$@"; do
    case $word in
        --check) check=1 ;;
        --release) tool_options=-O2 ;;
        *) die "windows.sh has no option $word" ;;
    esac
done
need_packages cmake ninja-build dpkg-dev g++-mingw-w64-x86-64-posix binutils-mingw-w64-x86-64
folder=$root/build/windows_libraries
prefix=$folder/prefix
unset LDFLAGS # which names a linker of this machine

launcher=$(command -v ccache || true)
cmake_options=(-G Ninja -DVOXELPIPE_WERROR=ON ${launcher:+-DCMAKE_C_COMPILER_LAUNCHER="$launcher" -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher"})
if [[ ! -e $prefix/complete ]]; then
    say "building the libraries of the tool"
    fetch_sources "$folder" zlib libdeflate libwebp meshoptimizer
    # Headers, and the sources of GoogleTest. The libraries beside them are of this machine.
    scripts/stage_deps.sh "$prefix" >/dev/null
    rm -rf "${prefix:?}/lib" "$prefix/share/cmake/benchmark"
    log=$folder/libraries.log
    { cmake -S packaging/wheels -B "$folder/build" -DCMAKE_BUILD_TYPE=Release -DSOURCES="$folder/src" -DWITH_DRACO=OFF -DWITH_ZSTD=OFF \
        -DCMAKE_TOOLCHAIN_FILE="$root/cmake/toolchains/x86_64-w64-mingw32.cmake" -DCMAKE_INSTALL_PREFIX="$prefix" \
        "${cmake_options[@]}" &&
        cmake --build "$folder/build" -j "$jobs" && cmake --install "$folder/build"; } >"$log" 2>&1 ||
        { grep -E 'error|FAILED' "$log" >&2 || tail -n 50 "$log" >&2; die "the libraries could not be built: $log"; }
    touch "$prefix/complete"
fi

say "building the tool and the C API"
mkdir -p build
log=build/configure-windows.log
cmake --preset windows "${cmake_options[@]}" -DVOXELPIPE_TOOL_OPTIONS=$tool_options >"$log" 2>&1 || { cat "$log" >&2; die "cmake could not configure the preset windows"; }
cmake --build build/windows --target voxelize voxelpipe_c -j "$jobs"
tool=build/windows/tool/voxelize.exe library=build/windows/capi/voxelpipe.dll
for file in "$tool" "$library"; do
    # Any other DLL would have to lie beside it.
    foreign=$(x86_64-w64-mingw32-objdump -p "$file" | sed -n 's/.*DLL Name: //p' | grep -viE '^(kernel32|msvcrt|shell32)\.dll$' || true)
    [[ -z $foreign ]] || die "$file needs $foreign"
done
if ! diff <(grep -oP 'VP_API [\w* ]*?\Kvp_\w+(?=\()' capi/include/voxelpipe.h | LC_ALL=C sort) \
    <(grep -oE 'vp_\w+' "${library%.dll}.def" | LC_ALL=C sort); then
    die "$library exports other functions than voxelpipe.h declares"
fi
[[ $(grep -c @ "${library%.dll}.def") -eq $(grep -c 'vp_.*@' "${library%.dll}.def") ]] || die "$library exports more than the C API"
say "$tool, $library"
[[ $check -eq 1 ]] || exit 0

need_packages "${build_packages[@]}" libgtest-dev wine64 python3
cmake --build build/windows --target golden_hashes capi_test first_solid -j "$jobs"
wine=$(wine64_path)
export WINEDEBUG=-all
say "running their tests under wine"
tests/tool/windows_test.sh "$tool" "$wine"
for program in capi_test first_solid; do
    (cd "${library%/*}" && "$wine" "../tests/capi/$program.exe") # which finds the DLL in the folder it runs in
done
say "comparing golden hashes"
scripts/golden.sh --build build/windows "$wine" >build/windows/hashes.txt
