#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# fuzz.sh [SECONDS]: runs every libFuzzer target of build/fuzz, all at once, for SECONDS (default 30), each from its corpus:
# tests/robustness/fuzz/corpus/NAME where there is one and, for the glTF targets, the glTF files beside the project where they are.
# New inputs go to build/fuzz/corpus/NAME, a failing one to build/fuzz/failures/.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

seconds="${1:-30}"
gltf="$(sed -n 's/^VOXELPIPE_GLTF_DIR:PATH=//p' build/fuzz/CMakeCache.txt)"
mkdir -p build/fuzz/failures
# fuzz NAME PROGRAM: one target.
fuzz() {
    local name=$1 program=$2
    local corpus="build/fuzz/corpus/$name" seeds=()
    mkdir -p "$corpus"
    [[ -d tests/robustness/fuzz/corpus/$name ]] && seeds+=("tests/robustness/fuzz/corpus/$name")
    if [[ $name == fuzz_gltf* && -n $gltf && -d $gltf ]]; then
        # Small files only: a seed is mutated as a whole, and a large one makes every run slow.
        mkdir -p "build/fuzz/seeds/$name"
        find "$gltf" -type f \( -name '*.glb' -o -name '*.gltf' \) -size -64k -exec cp --backup=numbered -t "build/fuzz/seeds/$name" {} +
        seeds+=("build/fuzz/seeds/$name")
    fi
    say "$name for $seconds s, seeds: ${seeds[*]:-none}"
    "$program" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=4096 -max_len=65536 -print_final_stats=1 \
        -artifact_prefix=build/fuzz/failures/ "$corpus" "${seeds[@]}" 2>&1 | tail -n 60
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
