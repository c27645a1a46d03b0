#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds and runs the benchmarks. What follows the first word goes to the program (see --help there).
#
#   scripts/bench.sh [OPTION...]             the CPU table
#   scripts/bench.sh --gpu [OPTION...]       the GPU table (needs nvcc and a GPU)
#   scripts/bench.sh --scaling [OPTION...]   the GPU's scaling curves, and plots of what is in build/bench-gpu/bench/results
#   scripts/bench.sh --solids [OPTION...]    solids into bits on the GPU
#   scripts/bench.sh --surfaces [OPTION...]  meshes of bits and of triangles on the GPU
#   scripts/bench.sh --programs [OPTION...]  programs, instances, points and lines on the GPU
#   scripts/bench.sh --sparse [OPTION...]    sparse framebuffers on the GPU
#   scripts/bench.sh --computed [OPTION...]  shaders that compute, by strategy, on the GPU
#   scripts/bench.sh --tune [OPTION...]      sweeps the fine raster's policies on the GPU
#   scripts/bench.sh --plot [FILE|FOLDER]    plots of that in build/plots, e.g. of records/h200; by default those of --scaling
#   scripts/bench.sh --nvbench [OPTION...]   the table's cells under NVBench (its options; caches are flushed between calls)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

gpu_folder=build/bench-gpu
results=$gpu_folder/bench/results

# build_gpu TARGET...: for the GPU of this machine where there is one, otherwise for the presets' architectures.
build_gpu() {
    command -v nvcc >/dev/null || [[ -n ${CUDACXX:-} ]] || die "the GPU benchmarks need nvcc on PATH (or CUDACXX)"
    need_packages "${build_packages[@]}" libbenchmark-dev
    local options=(-B "$gpu_folder" -DVOXELPIPE_ENABLE_CUDA=ON)
    nvidia-smi -L >/dev/null 2>&1 && options+=(-DCMAKE_CUDA_ARCHITECTURES=native)
    say "building $* ($gpu_folder)"
    configure bench "${options[@]}"
    cmake --build "$gpu_folder" -j "$jobs" --target "$@"
}

# python_modules FILE: what bench/FILE names, in .venv.
python_modules() {
    cmp -s "bench/$1" ".venv/bench-$1" && return 0
    need_packages python3 python3-venv
    say "installing what bench/$1 names into .venv"
    [[ -x .venv/bin/python ]] || python3 -m venv .venv
    .venv/bin/python -m pip install --quiet --disable-pip-version-check -r "bench/$1"
    cp "bench/$1" ".venv/bench-$1"
}

# plot FILE_OR_FOLDER OUT_FOLDER
plot() {
    [[ -e $1 ]] || die "there is nothing to plot in $1"
    python_modules requirements.txt
    .venv/bin/python bench/plot.py --out "$2" "$1"
}

case ${1:-} in
    --gpu)
        build_gpu bench_gpu_table
        "$gpu_folder/bench/gpu/bench_gpu_table" "${@:2}"
        ;;
    --scaling)
        build_gpu bench_gpu_scaling
        "$gpu_folder/bench/gpu/bench_gpu_scaling" "${@:2}"
        plot "$results" "$results"
        ;;
    --solids | --surfaces | --programs | --sparse | --computed)
        build_gpu "bench_gpu_${1#--}"
        "$gpu_folder/bench/gpu/bench_gpu_${1#--}" --out "$results" "${@:2}"
        ;;
    --tune)
        build_gpu bench_gpu_tune
        "$gpu_folder/bench/tune/bench_gpu_tune" "${@:2}"
        ;;
    --plot) if [[ $# -gt 1 ]]; then plot "$2" build/plots; else plot "$results" "$results"; fi ;;
    --nvbench)
        python_modules requirements-nvbench.txt
        build_gpu bench_gpu_nvbench
        "$gpu_folder/bench/gpu/bench_gpu_nvbench" "${@:2}"
        ;;
    *)
        need_packages "${build_packages[@]}" libbenchmark-dev
        say "building the benchmarks (build/bench)"
        configure bench
        cmake --build build/bench -j "$jobs" --target bench_cpu_table core_bench
        say "running bench_cpu_table"
        build/bench/bench/bench_cpu_table "$@"
        ;;
esac
