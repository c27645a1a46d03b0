# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
#
# Sourced by the other scripts: messages, packages, configure and build. Leaves the working directory at the project's root.

set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"

say() { printf '\n==> %s\n' "$*"; }
die() {
    printf '\nerror: %s\n' "$*" >&2
    exit 1
}

# Folders where headers are looked for: the staged prefix (scripts/stage_deps.sh) first, then the system's.
prefixes() {
    printf '%s\n' "$root/.deps"
    tr ':' '\n' <<<"${CMAKE_PREFIX_PATH:-}"
    printf '%s\n' /usr/local /usr
}

# The first header of this name, with its folder.
find_header() {
    local prefix
    while read -r prefix; do
        [[ -z $prefix || ! -e $prefix/include/$1 ]] || { printf '%s\n' "$prefix/include/$1"; return 0; }
    done < <(prefixes)
    return 1
}
has_header() { find_header "$1" >/dev/null; }

# present PACKAGE: is what we need of this package (the names are the same on Debian 12 and Ubuntu 24.04) here already,
# whoever installed it?
present() {
    case $1 in
        g++) command -v "${CXX:-g++}" >/dev/null ;;
        cmake) command -v cmake >/dev/null && printf '3.24\n%s\n' "$(cmake --version | sed -n '1s/[^0-9]*\([0-9.]*\).*/\1/p')" | sort -CV ;;
        ninja-build) command -v ninja >/dev/null ;;
        clang) command -v clang++ >/dev/null ;;
        python3 | ccache | clang-format-14 | clang-tidy-14) command -v "$1" >/dev/null ;;
        libglm-dev) has_header glm/glm.hpp ;;
        libtinygltf-dev) has_header tiny_gltf.h ;;
        nlohmann-json3-dev) has_header nlohmann/json.hpp ;;
        libstb-dev) has_header stb/stb_image.h || has_header stb_image.h ;;
        libcli11-dev) has_header CLI/CLI.hpp ;;
        zlib1g-dev) has_header zlib.h ;;
        libminizip-dev) has_header minizip/zip.h ;;
        libassimp-dev) has_header assimp/Importer.hpp ;;
        libdeflate-dev) has_header libdeflate.h ;;
        libzstd-dev) has_header zstd.h ;;
        libwebp-dev) has_header webp/decode.h ;;
        libdraco-dev) has_header draco/compression/decode.h ;;
        libmeshoptimizer-dev) has_header meshoptimizer.h ;;
        libgtest-dev) has_header gtest/gtest.h ;;
        libnanovdb-dev) has_header nanovdb/NanoVDB.h ;;
        chromium) { command -v chromium || command -v chromium-browser || command -v google-chrome; } >/dev/null ;;
        libnanovdb-tools) command -v nanovdb_validate >/dev/null ;;
        libbenchmark-dev) has_header benchmark/benchmark.h ;;
        python3-venv) python3 -c 'import ensurepip, venv' 2>/dev/null ;;
        python3-dev) python3 -c 'import os, sys, sysconfig; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' ;;
        *) [[ $(dpkg-query -W -f='${Status}' "$1" 2>/dev/null) == "install ok installed" ]] ;;
    esac
}

# need_packages PACKAGE...: installs with apt what is missing, as root or through passwordless sudo; otherwise names it
# and stops.
need_packages() {
    local missing=() package
    for package in "$@"; do
        present "$package" || missing+=("$package")
    done
    [[ ${#missing[@]} -eq 0 ]] && return 0
    local sudo=()
    if [[ $(id -u) -ne 0 ]]; then
        if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
            sudo=(sudo -n)
        else
            die "these packages are missing: ${missing[*]}
Install them and run the same command again; on Debian or Ubuntu:
    sudo apt-get install ${missing[*]}"
        fi
    fi
    command -v apt-get >/dev/null ||
        die "these packages (Debian's names) are missing and there is no apt-get here: ${missing[*]}"
    say "installing with apt-get: ${missing[*]}"
    local apt=("${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0)
    # Lists of a fresh container are empty, those of an old machine may be out of date.
    "${apt[@]}" update || printf 'apt-get update failed for some source; trying the install all the same\n'
    "${apt[@]}" install -y --no-install-recommends "${missing[@]}" >/dev/null
    hash -r
    for package in "${missing[@]}"; do
        present "$package" || die "package $package was installed, but what it should bring is still missing"
    done
}

# Packages to build the library, the tool and the samples with.
build_packages=(g++ cmake ninja-build libglm-dev libtinygltf-dev nlohmann-json3-dev libstb-dev libcli11-dev zlib1g-dev
    libminizip-dev libdeflate-dev libwebp-dev libassimp-dev libdraco-dev libmeshoptimizer-dev libzstd-dev)

# Packages that the tests need beside them: readers of NanoVDB files that are not ours, MPI for the slabs of several machines, and a
# browser.
test_packages=(libgtest-dev libnanovdb-dev libnanovdb-tools libmpich-dev mpich)
# Ubuntu's package asks for a snap; without a browser the test of the page is left out there.
grep -q '^ID=ubuntu' /etc/os-release 2>/dev/null || test_packages+=(chromium)

# With which the Python package's tensors are tested; not in every distribution.
torch_packages=()
grep -q '^ID=debian' /etc/os-release 2>/dev/null && torch_packages=(python3-torch)

# Packages to make the site with.
docs_packages=(doxygen python3-sphinx python3-breathe python3-myst-parser furo python3-numpy python3-pil)

# configure PRESET [cmake option...]: quiet unless it fails. Uses ccache where there is one, and the staged prefix.
configure() {
    local preset=$1 log
    shift
    local options=("$@")
    command -v ccache >/dev/null && options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_CUDA_COMPILER_LAUNCHER=ccache)
    [[ -f .venv/requirements.txt ]] && options+=("-DVOXELPIPE_PYTHON=$root/.venv/bin/python")
    [[ -d .deps ]] && options+=("-DCMAKE_PREFIX_PATH=$root/.deps${CMAKE_PREFIX_PATH:+;${CMAKE_PREFIX_PATH//:/;}}")
    mkdir -p build
    log=build/configure-$preset.log
    cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 || {
        cat "$log" >&2
        die "cmake could not configure the preset $preset"
    }
}

# wine64: Debian's package of that name alone has no command on PATH.
wine64_path() { command -v wine64 || printf '%s\n' /usr/lib/wine/wine64; }

# fetch_sources FOLDER PACKAGE...: the sources of this machine's distribution, with its patches, unpacked in FOLDER/src. Needs no root.
fetch_sources() {
    local folder=$1 apt
    shift
    [[ ! -e $folder/src/complete ]] || return 0
    mkdir -p "$folder"/{src,apt/lists/partial,apt/parts}
    # The machine's own list, of sources in place of packages.
    sed 's/^Types: deb$/Types: deb-src/' /etc/apt/sources.list.d/*.sources >"$folder/apt/parts/src.sources" 2>/dev/null || true
    sed -n 's/^deb /deb-src /p' /etc/apt/sources.list >"$folder/apt/parts/src.list" 2>/dev/null || true
    apt=(apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$folder/apt/parts" -o Dir::State::lists="$folder/apt/lists")
    "${apt[@]}" update
    (cd "$folder/src" && "${apt[@]}" source "$@" >"$folder/source.log" 2>&1) || { cat "$folder/source.log"; die "no sources"; }
    touch "$folder/src/complete"
}

jobs="${VOXELPIPE_JOBS:-$(nproc)}"
