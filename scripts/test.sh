#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# test.sh [PRESET [ctest option...]]: builds everything of a preset (default cpu: no nvcc, no GPU) and runs its tests.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

preset="${1:-cpu}"
shift || true

need_packages "${build_packages[@]}" libgtest-dev

say "configuring and building the library's tests, the tool and the samples (build/$preset)"
configure "$preset" ${VOXELPIPE_CONFIGURE_OPTIONS:-}
cmake --build "build/$preset" -j "$jobs"

say "running the tests"
ctest --preset "$preset" -j "$jobs" "$@"
