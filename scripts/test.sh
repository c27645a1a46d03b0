#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# test.sh [PRESET [ctest option...]]: builds everything of a preset (default test: no nvcc, no GPU) and runs its tests. Installs
# what the tests need, including the Python readers of tests/tool/formats, and says first how long it will take.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

preset="${1:-test}"
shift || true

# Processor minutes of the preset `test` from an empty build folder without a compiler cache, rounded up.
cpu_minutes=30
minutes=$(((cpu_minutes + jobs - 1) / jobs))
if [[ $preset != test ]]; then
    say "builds and tests the preset $preset"
elif [[ -e build/test/tests/api/api_test ]]; then
    say "make test: at most $minutes minutes with $jobs jobs; only what has changed since the last run is built again"
else
    say "make test: about $minutes minutes with $jobs jobs to build everything and run all tests"
fi

need_packages "${build_packages[@]}" "${test_packages[@]}"
scripts/python_env.sh || printf 'note: without these Python modules the tests formats.read_back.* do not run\n'

say "configuring and building the library's tests, the tool and the samples (build/$preset)"
configure "$preset" ${VOXELPIPE_CONFIGURE_OPTIONS:-}
cmake --build "build/$preset" -j "$jobs"

# Every header by itself takes a minute; clang++ does it in CI's stage clang, g++ in `.ci/run long`. That also has what is slow:
# the oracle with large meshes, of which scenes_small_test has the small ones, and sweeps of which every twentieth file is here.
say "running the tests"
ctest --preset "$preset" -j "$jobs" -LE 'headers|slow|needs' "$@"
