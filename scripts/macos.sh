#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Compiles and links, for macOS on both of its processors, the program of the golden hashes and the C API. The compiler is
# zig's clang, which brings macOS' headers. Nothing of it runs here: build/macos/golden_hashes-ARCH prints the hashes on a Mac,
# and scripts/golden.sh --program compares them.
#
#   scripts/macos.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages python3 python3-venv libglm-dev file
folder=$root/build/macos
mkdir -p "$folder/include"
ln -sfn "$(dirname "$(find_header glm/glm.hpp)")" "$folder/include/glm"
unset LDFLAGS # which names this machine's linker
[[ -x $folder/tools/bin/python ]] || python3 -m venv "$folder/tools"
"$folder/tools/bin/python" -m pip install --quiet --disable-pip-version-check "$(grep '^ziglang=' python/requirements-wheels.txt)"
zig=$("$folder/tools/bin/python" -c 'import os, ziglang; print(os.path.dirname(ziglang.__file__))')/zig
export ZIG_GLOBAL_CACHE_DIR=$folder/zig_cache ZIG_LOCAL_CACHE_DIR=$folder/zig_cache

options=(-std=c++20 -O1 -DVOXELPIPE_INLINE=inline -DVOXELPIPE_INLINE_LAMBDA= -Wall -Wextra -I. -Icapi/include -isystem "$folder/include")
compile() { # ARCH NAME OPTION...
    local arch=$1 name=$2
    shift 2
    "$zig" c++ -target "$arch-macos.13.3" "${options[@]}" "$@" -o "$folder/$name"
    file "$folder/$name"
}
for arch in aarch64 x86_64; do
    say "macOS, $arch"
    compile $arch "golden_hashes-$arch" tests/golden/hashes/*.cpp
    compile $arch "libvoxelpipe-$arch.dylib" -shared -fvisibility=hidden -DVP_BUILDS_LIBRARY \
        capi/src/{arrays,context,cpu_calls,distance,fractions,links,mesh,solid,surface,values}.cpp
done
