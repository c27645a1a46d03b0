#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# fuzz.sh [SECONDS [INPUTS]]: runs every libFuzzer target of build/fuzz, all at once, each for at least SECONDS (default 30) and,
# but for fuzz_assimp, with at least INPUTS inputs (default VOXELPIPE_FUZZ_INPUTS, or 0), from its corpus:
# tests/robustness/fuzz/corpus/NAME where there is one and, for the glTF targets, the glTF files beside the project where they
# are. New inputs go to build/fuzz/corpus/NAME, a failing one to build/fuzz/failures/. A note for each target says how many
# inputs it ran.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

seconds="${1:-30}"
inputs="${2:-${VOXELPIPE_FUZZ_INPUTS:-0}}"
gltf="$(sed -n 's/^VOXELPIPE_GLTF_DIR:PATH=//p' build/fuzz/CMakeCache.txt)"
mkdir -p build/fuzz/failures
# fuzz NAME PROGRAM: one target.
fuzz() {
    local name=$1 program=$2
    local corpus="build/fuzz/corpus/$name" seeds=() inputs=$inputs
    # A process for each input, of which about 20 a second run.
    [[ $name != fuzz_assimp ]] || inputs=0
    mkdir -p "$corpus"
    [[ -d tests/robustness/fuzz/corpus/$name ]] && seeds+=("tests/robustness/fuzz/corpus/$name")
    if [[ $name == fuzz_gltf* && -n $gltf && -d $gltf ]]; then
        # Small files only: a seed is mutated as a whole, and a large one makes every run slow.
        mkdir -p "build/fuzz/seeds/$name"
        find "$gltf" -type f \( -name '*.glb' -o -name '*.gltf' \) -size -64k -exec cp --backup=numbered -t "build/fuzz/seeds/$name" {} +
        seeds+=("build/fuzz/seeds/$name")
    fi
    say "$name for $seconds s and $inputs inputs, seeds: ${seeds[*]:-none}"
    # libFuzzer ends at the first of its bounds, so each has a run of its own.
    local start=$SECONDS ran=0
    if [[ $inputs -gt 0 ]]; then run_fuzzer -runs="$inputs"; fi
    local left=$((seconds - (SECONDS - start)))
    if [[ $left -gt 0 ]]; then run_fuzzer -max_total_time="$left"; fi
    [[ $ran -ge $inputs ]] || die "$name ran $ran inputs of $inputs"
    printf 'note: %s ran %d inputs in %d s\n' "$name" "$ran" $((SECONDS - start))
}
# run_fuzzer BOUND: one run within fuzz(), whose inputs are added to `ran`. Its last lines are shown.
run_fuzzer() {
    local log="build/fuzz/$name.run" status=0
    "$program" "$1" -timeout=20 -rss_limit_mb=4096 -max_len=65536 -print_final_stats=1 \
        -artifact_prefix=build/fuzz/failures/ "$corpus" "${seeds[@]}" >"$log" 2>&1 || status=$?
    tail -n 60 "$log"
    [[ $status -eq 0 ]] || return "$status"
    ran=$((ran + $(sed -n 's/^stat::number_of_executed_units: *//p' "$log")))
}

names=()
running=()
while read -r program; do
    name="$(basename "$program")"
    fuzz "$name" "$program" >"build/fuzz/$name.log" &
    names+=("$name")
    running+=($!)
done < <(find build/fuzz -type f -perm -u+x -name 'fuzz_*' | sort)
[[ ${#names[@]} -gt 0 ]] || die "no fuzz target was built"
failed=()
for i in "${!names[@]}"; do
    wait "${running[i]}" || failed+=("${names[i]}")
    cat "build/fuzz/${names[i]}.log"
done
[[ ${#failed[@]} -eq 0 ]] || die "failed: ${failed[*]}; inputs in build/fuzz/failures/"
printf 'note: %d fuzz targets ran clean\n' "${#names[@]}"
