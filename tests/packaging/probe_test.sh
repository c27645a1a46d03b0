#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# A further module touches few files: applies probe.patch, which adds the module `probe` (the recipe in
# docs/extending.md), to a copy of the tree, counts the files outside its folders, and builds and runs its tests on the
# CPU and in emulation.
#
#   probe_test.sh FOLDER [CMake option...]      FOLDER is made anew
#
# When a change of the tree makes the patch fail: apply it with `git apply --3way`, mend it, and write the staged
# difference back with `git diff --cached`.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
patch="$root/tests/packaging/probe.patch"
folder=${1:?"probe_test.sh needs a folder"}
shift
most=12

rm -rf "$folder"
mkdir -p "$folder/tree"
cd "$root"
# The working tree, and not the last commit: what is about to be committed is tested.
git ls-files -z --cached --others --exclude-standard | while IFS= read -r -d '' file; do
    [[ ! -f $file ]] || printf '%s\0' "$file"
done | tar --null -T - -cf - | tar -xf - -C "$folder/tree"
cd "$folder/tree"
git init -q .
git apply "$patch"
git add -A

touched=$(sed -n 's|^+++ b/||p' "$patch" | grep -vE '^(voxelpipe|cpu_ref|tests)/probe/' || true)
number=$(grep -c . <<<"$touched" || true)
printf 'the module probe touches %d files outside its folders, at most %d:\n%s\n' "$number" "$most" "$touched"
[[ $number -ge 1 && $number -le $most ]]

scripts/check_includes.py
scripts/check_documents.py
cmake -S . -B "../build" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DVOXELPIPE_EMULATE_DEVICE=ON \
    -DVOXELPIPE_ENABLE_CUDA=OFF -DVOXELPIPE_ENABLE_MPI=OFF -DVOXELPIPE_BUILD_TESTS=ON -DVOXELPIPE_TEST_PCH=OFF \
    -DVOXELPIPE_WERROR=ON "$@"
cmake --build ../build --target probe_test emulated_probe -j "${VOXELPIPE_JOBS:-$(nproc)}"
ctest --test-dir ../build --no-tests=error --output-on-failure -R '^(probe_test\.|emulated\.probe$)' | tee ../ctest.log
# Both have run: one test each.
grep -q '^100% tests passed, 0 tests failed out of 2$' ../ctest.log
