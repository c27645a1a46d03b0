#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds and runs the CPU benchmarks; arguments go to the program (see bench/).
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages "${build_packages[@]}" libbenchmark-dev

say "building the benchmarks (build/bench)"
configure bench
cmake --build build/bench -j "$jobs"

for program in build/bench/bench/bench_*; do
    [[ -f $program && -x $program ]] || continue
    say "running $program"
    "$program" "$@"
done
