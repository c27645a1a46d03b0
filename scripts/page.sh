#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes build/page/voxelize.html: one page with the voxelize tool in it as WebAssembly, which turns models into voxels in a browser and
# needs no network.
#
#   scripts/page.sh             the page
#   scripts/page.sh --check     then drives it in Chromium and compares its files with those of the tool of this machine, and the
#                               golden hashes as WebAssembly with tests/golden/hashes.txt: of the library in Chromium, of that and of the tool's files in node
#
# The compiler and the C library are zig's. The C++ library is built here from zig's sources, with exceptions, which zig's own lacks
# (packaging/page). Libraries are built from the sources of the machine's distribution, as for wheels. Needs apt-get and a package index
# of Python with a network.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

check=0
if [[ ${1:-} == --check ]]; then
    check=1
    shift
fi
[[ $# -eq 0 ]] || die "page.sh has no option $1"
need_packages cmake ninja-build libglm-dev libtinygltf-dev nlohmann-json3-dev libstb-dev libcli11-dev dpkg-dev python3-venv
folder=$root/build/page
mkdir -p "$folder/bin" "$folder/libc"
unset LDFLAGS # which names a linker of this machine

if [[ ! -x $folder/tools/bin/python ]]; then
    say "making the environment of the compiler"
    python3 -m venv "$folder/tools"
fi
"$folder/tools/bin/python" -m pip install --quiet --disable-pip-version-check "$(grep '^ziglang=' python/requirements-wheels.txt)"
zig=$("$folder/tools/bin/python" -c 'import os, ziglang; print(os.path.dirname(ziglang.__file__))')
lib=$zig/lib
export ZIG_GLOBAL_CACHE_DIR=$folder/zig_cache ZIG_LOCAL_CACHE_DIR=$folder/zig_cache

# zig's own commands cc and c++ switch exceptions and threads of the C++ library off: clang is called without them.
features=(-mcpu=lime1 -mbulk-memory)
c_options=(--target=wasm32-wasip1 "${features[@]}" -fwasm-exceptions -nostdinc)
c_headers=(-isystem "$root/packaging/page/posix" -isystem "$lib/include" -isystem "$lib/libc/include/wasm-wasi-musl"
    -isystem "$lib/libc/include/generic-musl" -D_WASI_EMULATED_{MMAN,SIGNAL,PROCESS_CLOCKS,GETPID})
cxx_headers=(-nostdinc++ -isystem "$lib/libcxx/include" -isystem "$lib/libcxxabi/include" -D_LIBCPP_{ABI_VERSION=1,ABI_NAMESPACE=__1}
    -D_LIBCPP_HAS_{THREADS,THREAD_API_PTHREAD,MONOTONIC_CLOCK,TERMINAL,MUSL_LIBC,FILESYSTEM,RANDOM_DEVICE,LOCALIZATION,UNICODE,WIDE_CHARACTERS}=1
    -D_LIBCPP_HAS_{THREAD_API_EXTERNAL,THREAD_API_WIN32,VENDOR_AVAILABILITY_ANNOTATIONS,TIME_ZONE_DATABASE}=0
    -D_LIBCPP_INSTRUMENTED_WITH_ASAN=0 -D_LIBCPP_HAS_NO_STD_MODULES -D_LIBCPP_PSTL_BACKEND_SERIAL
    -D_LIBCPP_HARDENING_MODE=_LIBCPP_HARDENING_MODE_NONE -D_LIBCPP_ASSERTION_SEMANTIC_DEFAULT=_LIBCPP_ASSERTION_SEMANTIC_IGNORE
    -D_LIBCPP_DISABLE_VISIBILITY_ANNOTATIONS -D_LIBCXXABI_DISABLE_VISIBILITY_ANNOTATIONS)
command_file() {
    local file=$folder/bin/$1
    shift
    printf '#!/bin/sh\nexec "%s/zig" %s "$@"\n' "$zig" "$*" >"$file.new"
    chmod +x "$file.new"
    # The same file stays, so that nothing is built anew.
    if cmp -s "$file.new" "$file"; then rm "$file.new"; else mv "$file.new" "$file"; fi
}
command_file clang clang "${c_options[@]}" "${c_headers[@]}"
command_file clang++ clang --driver-mode=g++ "${c_options[@]}" "${cxx_headers[@]}" "${c_headers[@]}" -B "$folder/bin"
for name in wasm-ld ar ranlib; do command_file "$name" "$name"; done

launcher=$(command -v ccache || true)
cmake_options=(-G Ninja -DCMAKE_BUILD_TYPE=Release -DVOXELPIPE_PAGE_TOOLS="$folder" -DCMAKE_TOOLCHAIN_FILE="$root/cmake/toolchains/wasm32-wasi.cmake"
    ${launcher:+-DCMAKE_C_COMPILER_LAUNCHER="$launcher" -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher"})
# build NAME FOLDER TARGET [cmake option...]: quiet unless it fails.
build() {
    local name=$1 source=$2 target=$3 log=$folder/$1.log
    shift 3
    { cmake -S "$source" -B "$folder/$name" "${cmake_options[@]}" "$@" && cmake --build "$folder/$name" --target "$target" -j "$jobs"; } >"$log" 2>&1 ||
        { grep -E 'error|FAILED' "$log" >&2 || tail -n 50 "$log" >&2; die "$name could not be built: $log"; }
}

if [[ ! -e $folder/libc/libc.a ]]; then
    say "building the C library"
    # zig builds it to link a program, and says where it lies.
    printf 'int main(void) { return 0; }\n' >"$folder/libc/main.c"
    "$zig/zig" cc -target wasm32-wasi -mcpu=lime1 -O2 -v "$folder/libc/main.c" -o "$folder/libc/main.wasm" 2>"$folder/libc.log" || { cat "$folder/libc.log"; die "no C library"; }
    for name in crt1-command.o libzigc.a libcompiler_rt.a libc.a; do
        file=$(grep -oE "[^ ]*/$name" "$folder/libc.log" | tail -n 1)
        cp "${file:?zig names no $name}" "$folder/libc/"
    done
fi

say "building the C++ library, and the libraries of the tool"
build runtime packaging/page page_runtime -DZIG_LIB="$lib"
prefix=$folder/prefix
if [[ ! -e $prefix/complete ]]; then
    fetch_sources "$folder" zlib libdeflate libwebp draco meshoptimizer
    build libraries packaging/wheels all -DSOURCES="$folder/src" -DWITH_ZSTD=OFF -DCMAKE_INSTALL_PREFIX="$prefix"
    cmake --install "$folder/libraries" >/dev/null
    # Headers alone, in a folder without those of the machine's C library.
    scripts/stage_deps.sh "$folder/staged" >/dev/null
    mkdir -p "$prefix/share/cmake"
    cp -r "$folder"/staged/include/{glm,nlohmann,CLI,stb,tiny_gltf.h} "$prefix/include/"
    cp -r "$folder"/staged/share/cmake/{glm,CLI11,nlohmann_json} "$prefix/share/cmake/"
    touch "$prefix/complete"
fi

say "building the tool"
build tool . voxelize -DCMAKE_PREFIX_PATH="$prefix" -DVOXELPIPE_ENABLE_CUDA=OFF -DVOXELPIPE_ENABLE_MPI=OFF -DVOXELPIPE_BUILD_TOOL=ON \
    -DVOXELPIPE_INSTALL=OFF -DVOXELPIPE_JOIN_FILES=ON -DVOXELPIPE_TOOL_OPTIONS=-O2 -DVOXELPIPE_PARSER_OPTIONS=-Os
# The licences of all that the page holds.
python3 packaging/page/make_page.py "$folder/tool/tool/voxelize.wasm" "$folder/voxelize.html" LICENSE "$folder"/src/*/debian/copyright \
    /usr/share/doc/{libglm-dev,libtinygltf-dev,nlohmann-json3-dev,libstb-dev,libcli11-dev}/copyright "$lib/libcxx/LICENSE.TXT" \
    "$lib"/libc/wasi/LICENSE* "$lib/libc/musl/COPYRIGHT" "$zig/LICENSE"
[[ $check -eq 1 ]] || exit 0

need_packages "${build_packages[@]}" libgtest-dev chromium nodejs
say "building the tool of this machine, and the golden cases"
configure test
cmake --build build/test --target voxelize golden_hashes -j "$jobs" >"$folder/native.log" 2>&1 || { tail -n 50 "$folder/native.log"; die "the tool of this machine"; }
cp -r "$folder/staged/include/gtest" "$prefix/include/"
mkdir -p "$prefix/src"
cp -r "$folder/staged/src/googletest" "$prefix/src/"
cp -r "$folder/staged/share/cmake/GTest" "$prefix/share/cmake/"
build tool . golden_hashes -DVOXELPIPE_BUILD_TESTS=ON

say "driving the page in Chromium"
scripts/python_env.sh >/dev/null
mkdir -p "$folder/models"
build/test/tests/golden/golden_hashes --write-model "$folder/models"
large=()
for file in ../shared/gltf/DamagedHelmet.glb; do [[ ! -e $file ]] || large+=("$file"); done
.venv/bin/python packaging/page/test_page.py "$(command -v chromium || command -v chromium-browser || command -v google-chrome)" \
    "$folder/voxelize.html" build/test/tool/voxelize "$folder/models" "$folder/test" \
    "$folder/tool/tests/golden/golden_hashes.wasm" tests/golden/hashes.txt "${large[@]}"

say "comparing golden hashes"
scripts/golden.sh --build "$folder/tool" node "$root/packaging/page/run.mjs" >"$folder/hashes.txt"
