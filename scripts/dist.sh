#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes the source archive of the commit that is checked out, build/dist/voxelpipe-VERSION.tar.gz, and prints its hashes. The same commit and
# the same GLM give the same bytes. It holds the tracked files less packaging/, whose recipes state the archive's hashes, and GLM's headers
# in third_party/, so that the library builds without a network.
#
#   scripts/dist.sh [--test]     --test: unpacks it, builds a program with it where there is neither network nor GLM, and runs that
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages g++ cmake ninja-build libglm-dev git
name=voxelpipe-$(scripts/version.py)
folder=$root/build/dist
archive=$folder/$name.tar.gz
rm -rf "$folder"
mkdir -p "$folder"

headers=$(find_header glm/glm.hpp) || die "no glm/glm.hpp"
headers=${headers%/glm/glm.hpp}
git archive --prefix="$name/" HEAD | tar -xf - -C "$folder" --exclude "$name/packaging"
mkdir -p "$folder/$name/third_party/glm"
(cd "$headers" && find glm \( -name '*.hpp' -o -name '*.inl' -o -name '*.h' \) -print0 | tar -cf - --null -T -) |
    tar -xf - -C "$folder/$name/third_party/glm"
cp third_party/glm/LICENSE "$folder/$name/third_party/glm/"
# --mtime takes the commit's, and nobody's name or rights are kept.
tar --sort=name --format=ustar --owner=0 --group=0 --numeric-owner --mode=u+rw,go+r-w --mtime="$(git show -s --format=@%ct HEAD)" \
    -C "$folder" -cf - "$name" | gzip -9n >"$archive"
rm -r "${folder:?}/$name"

printf '%s\n%d bytes, commit %s\nsha256 %s\nsha512 %s\n' "$archive" "$(stat -c %s "$archive")" "$(git rev-parse HEAD)" \
    "$(sha256sum "$archive" | cut -d ' ' -f 1)" "$(sha512sum "$archive" | cut -d ' ' -f 1)" | tee "$folder/$name.txt"
[[ ${1:-} == --test ]] || exit 0

say "building a program with it, without network and without an installed GLM"
work=$folder/test
mkdir "$work"
tar -xf "$archive" -C "$work"
cat >"$work/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.24)
project(offline LANGUAGES CXX)
add_subdirectory($name)
add_executable(shortest $name/samples/00_shortest.cpp)
target_link_libraries(shortest PRIVATE voxelpipe::cpu_ref)
CMAKE
# A network namespace of its own, where that is permitted; else at least no proxy that answers.
offline=(env http_proxy=http://127.0.0.1:9 https_proxy=http://127.0.0.1:9)
if unshare --net true 2>/dev/null; then
    offline=(unshare --net)
elif unshare --user --net true 2>/dev/null; then
    offline=(unshare --user --net)
fi
"${offline[@]}" cmake -G Ninja -S "$work" -B "$work/build" -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON -DCMAKE_BUILD_TYPE=Debug \
    ${CCACHE_BASEDIR:+-DCMAKE_CXX_COMPILER_LAUNCHER=ccache} >"$work/log" 2>&1 || { cat "$work/log"; die "the archive does not configure"; }
# The headers that the program reads are the archive's.
grep -q "$work/$name/third_party/glm" "$work/build/build.ninja" || die "the program does not use the archive's GLM"
"${offline[@]}" cmake --build "$work/build" >>"$work/log" 2>&1 || { cat "$work/log"; die "the archive does not build"; }
"$work/build/shortest"
! tar -tzf "$archive" | grep "^$name/packaging/" || die "the archive holds packaging/"
