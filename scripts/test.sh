#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# test.sh [PRESET [ctest option...]]: builds everything of a preset (default cpu: no nvcc, no GPU) and runs its tests. Sets
# up what the tests need, the Python readers of tests/formats among it, and says first how long it will take.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

preset="${1:-cpu}"
shift || true

# Processor time of the preset cpu from an empty build folder, without a compiler cache, and what one core does alone.
cpu_minutes=22
minutes=$(((cpu_minutes + jobs - 1) / jobs))
if [[ $preset != cpu ]]; then
    say "make test, preset $preset"
elif [[ -e build/cpu/tests/api/api_test ]]; then
    say "make test: at most $minutes minutes with $jobs jobs; what has not changed since the last run is not built again"
else
    say "make test: about $minutes minutes with $jobs jobs to build and run all tests; later runs build only what has changed"
fi

need_packages "${build_packages[@]}" libgtest-dev
scripts/python_env.sh || printf 'note: without these Python modules the tests formats.read_back.* do not run\n'

say "configuring and building the library's tests, the tool and the samples (build/$preset)"
configure "$preset" ${VOXELPIPE_CONFIGURE_OPTIONS:-}
cmake --build "build/$preset" -j "$jobs"

say "running the tests"
ctest --preset "$preset" -j "$jobs" "$@"
