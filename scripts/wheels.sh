#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes wheels of the Python package that need no compiler and no library of the machine: manylinux_2_28, with the voxelize tool
# in them, for CPython 3.11 and, as abi3, for 3.12 and later. Each is installed into an empty environment and tested there. They lie
# in build/wheels/dist; sizes, seconds and results in build/wheels/dist/ARCH.txt.
#
#   scripts/wheels.sh [--arch aarch64] [PYTHON...]     interpreters with headers; by default python3.11 and python3.12, as found
#
# --arch aarch64 compiles for 64-bit ARM, after the wheels of x86_64 were made, whose stubs it takes. A Python of Debian for that
# machine then runs the tests of the wheel of its version under qemu; the other wheel is not run.
# The compiler is zig's clang, which has the headers of old glibcs. Libraries are built from the sources of the machine's distribution
# (packaging/wheels), with its security patches. Needs apt-get with a network; no root.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages cmake ninja-build libglm-dev libtinygltf-dev nlohmann-json3-dev libstb-dev libcli11-dev dpkg-dev python3-venv
arch=x86_64
if [[ ${1:-} == --arch ]]; then
    arch=$2
    shift 2
fi
[[ $arch == x86_64 || $arch == aarch64 ]] || die "--arch is x86_64 or aarch64, not $arch"
[[ $arch == x86_64 ]] || need_packages binutils-aarch64-linux-gnu qemu-user-static
platform=manylinux_2_28_$arch
max_bytes=12000000
max_seconds=10
shared=$root/build/wheels
folder=$shared/$arch
dist=$shared/dist
mkdir -p "$folder/bin" "$dist"

pythons=("$@")
if [[ ${#pythons[@]} -eq 0 ]]; then
    for name in python3.11 python3.12; do
        # A shim of pyenv names versions that are not there.
        if command -v "$name" >/dev/null && "$name" -c 'import venv' 2>/dev/null; then
            pythons+=("$name")
        elif [[ -d ${PYENV_ROOT:-$HOME/.pyenv}/versions ]]; then
            while read -r path; do pythons+=("$path"); done < <(find "${PYENV_ROOT:-$HOME/.pyenv}/versions" -path "*/bin/$name" | sort -V | tail -n 1)
        fi
    done
fi
[[ ${#pythons[@]} -gt 0 ]] || die "no Python 3.11 or 3.12 was found: name one"

say "making the environment of tools"
[[ -x $shared/tools/bin/python ]] || "${pythons[0]}" -m venv "$shared/tools"
"$shared/tools/bin/python" -m pip install --quiet --disable-pip-version-check -r python/requirements-wheels.txt

# The compilers. Their names tell ccache what they are.
export ZIG_GLOBAL_CACHE_DIR=$shared/zig_cache ZIG_LOCAL_CACHE_DIR=$shared/zig_cache
for name in clang:cc clang++:c++; do
    printf '#!/bin/sh\nexec "%s" -m ziglang %s -target %s-linux-gnu.2.28 "$@"\n' "$shared/tools/bin/python" "${name#*:}" "$arch" >"$folder/bin/${name%:*}"
done
for name in ar ranlib; do
    printf '#!/bin/sh\nexec "%s" -m ziglang %s "$@"\n' "$shared/tools/bin/python" "$name" >"$folder/bin/$name"
done
chmod +x "$folder"/bin/*
launcher=$(command -v ccache || true)
strip=strip
[[ $arch == x86_64 ]] || strip=$arch-linux-gnu-strip
# Nothing of the machine's own is found but what the prefix holds.
cmake_options=(-DCMAKE_C_COMPILER="$folder/bin/clang" -DCMAKE_CXX_COMPILER="$folder/bin/clang++" -DCMAKE_AR="$folder/bin/ar"
    -DCMAKE_RANLIB="$folder/bin/ranlib" -DCMAKE_STRIP="$(command -v "$strip")" -DCMAKE_MAKE_PROGRAM="$(command -v ninja)" -DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF -DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF
    ${launcher:+-DCMAKE_C_COMPILER_LAUNCHER="$launcher" -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher"})
[[ $arch == x86_64 ]] || cmake_options+=(-DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR="$arch")
unset LDFLAGS # which names a linker of this machine

prefix=$folder/prefix
sources=(zlib libdeflate libzstd libwebp draco meshoptimizer)
if [[ ! -e $prefix/complete ]]; then
    say "building the libraries that wheels have within: ${sources[*]}"
    fetch_sources "$shared" "${sources[@]}"
    cmake -G Ninja -S packaging/wheels -B "$folder/libraries" -DSOURCES="$shared/src" -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_INSTALL_PREFIX="$prefix" "${cmake_options[@]}" >"$folder/libraries.log" 2>&1 || { cat "$folder/libraries.log"; die "libraries"; }
    cmake --build "$folder/libraries" -j "$jobs" >>"$folder/libraries.log" 2>&1 || { tail -n 50 "$folder/libraries.log"; die "libraries"; }
    cmake --install "$folder/libraries" >/dev/null
    # Headers alone, in a folder without those of the machine's glibc.
    scripts/stage_deps.sh "$shared/staged" >/dev/null
    mkdir -p "$prefix/share/cmake"
    cp -r "$shared"/staged/include/{glm,nlohmann,CLI,stb,tiny_gltf.h} "$prefix/include/"
    cp -r "$shared"/staged/share/cmake/{glm,CLI11,nlohmann_json} "$prefix/share/cmake/"
    touch "$prefix/complete"
fi

# test_under_qemu WHEEL VERSION BYTES: by a Python of Debian's for that machine, which lies in a folder of its own.
test_under_qemu() {
    local wheel=$1 version=$2 bytes=$3 root_of=$folder/root site=$folder/site-$2 line
    line=$(printf '%-60s %9d bytes' "$(basename "$wheel")" "$bytes")
    if [[ ! -e $root_of/complete ]]; then
        say "unpacking a Python for $arch"
        mkdir -p "$folder"/{apt/lists/partial,packages}
        local apt=(apt-get -qq -o APT::Architecture=arm64 -o APT::Architectures::=arm64 -o Dir::State::lists="$folder/apt/lists" -o Dir::State::status=/dev/null)
        "${apt[@]}" update
        (cd "$folder/packages" && "${apt[@]}" download libc6 libgcc-s1 libstdc++6 zlib1g libexpat1 libssl3 libffi8 libbz2-1.0 liblzma5 libuuid1 libsqlite3-0 \
            libcrypt1 libtirpc3 libnsl2 libdb5.3 python3.11-minimal libpython3.11-minimal libpython3.11-stdlib)
        for package in "$folder"/packages/*.deb; do dpkg-deb -x "$package" "$root_of"; done
        touch "$root_of/complete"
    fi
    if [[ ! -x $root_of/usr/bin/python$version ]]; then
        printf '%s, not run: no Python %s for %s\n' "$line" "$version" "$arch" | tee -a "$dist/$arch.txt"
        return 0
    fi
    say "testing it under qemu"
    rm -rf "$site"
    "$shared/tools/bin/python" -m pip install --quiet --disable-pip-version-check --only-binary :all: --platform "$platform" --platform manylinux2014_$arch \
        --platform manylinux_2_27_$arch --python-version "$version" --implementation cp --target "$site" "$wheel" pytest trimesh pillow
    local emulator=(qemu-$arch-static -L "$root_of")
    "${emulator[@]}" "$site/voxelpipe/bin/voxelize" --version
    # Programs that tests start are of the other machine: those tests are left out.
    (cd "$folder" && PYTHONPATH=$site "${emulator[@]}" "$root_of/usr/bin/python$version" -m pytest -q -x -p no:cacheprovider \
        "$root"/python/tests/test_{surface,solid,grid,distance,fractions,label,models,own_colors}.py) | tee "$folder/test.log"
    printf '%s, under qemu: %s\n' "$line" "$(tail -n 1 "$folder/test.log")" | tee -a "$dist/$arch.txt"
}

rm -f "$dist"/*"$arch".whl "$dist/$arch.txt"
export CMAKE_PREFIX_PATH=$prefix CMAKE_BUILD_PARALLEL_LEVEL=$jobs
settings=()
for option in "${cmake_options[@]}" -DVOXELPIPE_TOOL_OPTIONS=-O2; do settings+=("--config-settings=cmake.define.${option#-D}"); done
for python in "${pythons[@]}"; do
    version=$("$python" -c 'import sys; print("{}.{}".format(*sys.version_info))')
    say "building the wheel of Python $version"
    build=$folder/python$version
    [[ -x $build/venv/bin/python ]] || "$python" -m venv "$build/venv"
    "$build/venv/bin/python" -m pip install --quiet --disable-pip-version-check $(grep -E '^(nanobind|scikit-build-core)=' python/requirements-wheels.txt)
    rm -rf "$build/wheel"
    cross=()
    if [[ $arch != x86_64 ]]; then
        stub=$(find "$shared/x86_64/python$version/build" "$shared/x86_64/python$version/unpacked" -name _core.pyi 2>/dev/null | head -n 1)
        [[ -n $stub ]] || die "no stub of Python $version: make the wheels of x86_64 first"
        suffix=.cpython-${version//./}-$arch-linux-gnu.so
        cross=(env "_PYTHON_HOST_PLATFORM=linux-$arch" "SETUPTOOLS_EXT_SUFFIX=$suffix")
        cross+=("SKBUILD_CMAKE_DEFINE=VOXELPIPE_PYTHON_STUB=$stub")
    fi
    CC=$folder/bin/clang CXX=$folder/bin/clang++ "${cross[@]}" "$build/venv/bin/python" -m pip wheel --quiet --disable-pip-version-check --no-build-isolation \
        --no-deps --wheel-dir "$build/wheel" "--config-settings=build-dir=$build/build" "${settings[@]}" .
    PATH=$shared/tools/bin:$PATH "$shared/tools/bin/auditwheel" repair --plat "$([[ $arch == x86_64 ]] && printf '%s' "$platform" || printf auto)" --only-plat --wheel-dir "$build/repaired" "$build"/wheel/*.whl
    wheel=$(echo "$build"/repaired/*.whl)
    cp "$wheel" "$dist/"
    bytes=$(stat -c %s "$wheel")
    [[ $bytes -le $max_bytes ]] || die "$(basename "$wheel") has $bytes bytes, more than $max_bytes"
    "$python" -m zipfile -e "$wheel" "$build/unpacked"
    # All that it has from the machine is glibc, and none that is newer.
    # Of another machine auditwheel finds the oldest glibc by itself, and has its name in the wheel's.
    if [[ $arch == x86_64 ]]; then
        [[ $("$shared/tools/bin/auditwheel" show "$wheel") == *$platform* ]] || die "$(basename "$wheel") is not $platform"
    else
        [[ $wheel =~ manylinux_2_(1[0-9]|2[0-8])_$arch ]] || die "$(basename "$wheel") needs more than glibc 2.28"
    fi

    if [[ $arch != x86_64 ]]; then
        test_under_qemu "$wheel" "$version" "$bytes"
        continue
    fi
    say "installing it where there is no compiler, and testing it"
    rm -rf "$build/test" && "$python" -m venv "$build/test"
    start=$(date +%s%N)
    env -i HOME="$HOME" PATH="$build/test/bin" ${PIP_INDEX_URL:+PIP_INDEX_URL="$PIP_INDEX_URL"} \
        "$build/test/bin/python" -m pip install --quiet --disable-pip-version-check --only-binary :all: "$wheel"
    seconds=$((($(date +%s%N) - start) / 1000000))
    ((seconds <= max_seconds * 1000)) || die "installing it took $seconds ms, more than $max_seconds s"
    "$build/test/bin/python" -m pip install --quiet --disable-pip-version-check pytest trimesh pillow
    cd "$folder"
    export VOXELPIPE_TOOL=$build/test/lib/python$version/site-packages/voxelpipe/bin/voxelize
    PATH=$build/test/bin:/usr/bin:/bin "$build/test/bin/python" -m pytest -q -p no:cacheprovider "$root/python/tests" | tee "$build/test.log"
    cd "$root"
    printf '%-60s %9d bytes, installed with its dependencies in %d ms, tests: %s\n' "$(basename "$wheel")" "$bytes" "$seconds" \
        "$(tail -n 1 "$build/test.log")" | tee -a "$dist/$arch.txt"
done
