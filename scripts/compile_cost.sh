#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Measures the cost of compiling a call of voxelize: the five programs of tests/packaging/compile_cost, each from the headers alone
# and for voxelpipe::cuda_kernels (base/kernel_library.cuh), then the library itself. Prints kernels in the PTX, seconds of
# processor time of an optimised build for one architecture, and the object's size. Seconds are worth something on a machine
# with nothing else to do.
#
#   scripts/compile_cost.sh                    all of it; takes minutes
#   scripts/compile_cost.sh --check            also compares the kernels with tests/packaging/compile_cost/expected_kernels.txt:
#                                              the exit status is 1 where a program has more, or none is stated
#   scripts/compile_cost.sh --kernels --check  no seconds, no objects, no library: half a minute
#
# VOXELPIPE_ARCHITECTURE: the architecture, sm_90 by default. VOXELPIPE_NVCC_OPTIONS: further options of nvcc.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
command -v nvcc >/dev/null || die "no nvcc on PATH"

check="" seconds=1
for option in "$@"; do
    case $option in
        --check) check=1 ;;
        --kernels) seconds="" ;;
        *) die "unknown option $option" ;;
    esac
done
programs=tests/packaging/compile_cost
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
read -r -a options <<<"${VOXELPIPE_NVCC_OPTIONS:-}"
options+=(-std=c++20 --expt-relaxed-constexpr "-arch=${VOXELPIPE_ARCHITECTURE:-sm_90}" -diag-suppress 20012 -I "$root")
for prefix in "$root/.deps"; do
    [[ ! -d $prefix/include ]] || options+=(-isystem "$prefix/include")
done

# count_kernels FILE OPTION...: prints how many kernels the PTX has. The level of optimisation does not change that.
count_kernels() {
    local file=$1 quick=()
    shift
    [[ $(nvcc --help) != *--Ofast-compile* ]] || quick=(--Ofast-compile=max)
    nvcc "${options[@]}" "${quick[@]}" "$@" -ptx "$file" -o "$work/kernels.ptx"
    grep -c '\.entry ' "$work/kernels.ptx" || true
}

# compile FILE OPTION...: prints the seconds of processor time and the object's megabytes.
compile() {
    local file=$1 used
    shift
    used=$( { TIMEFORMAT='%U %S' && time nvcc "${options[@]}" "$@" -O3 -c "$file" -o "$work/object.o" 2>"$work/messages"; } 2>&1) ||
        { cat "$work/messages" >&2; die "nvcc does not compile $file"; }
    awk -v size="$(stat -c %s "$work/object.o")" '{ printf "%.1f %.1f\n", $1 + $2, size / 1e6 }' <<<"$used"
}

[[ -z $seconds ]] || printf '%-18s %-10s %8s %10s %8s\n' program kernels number seconds MB
status=0
for file in "$programs"/*.cu; do
    name=$(basename "$file" .cu)
    read -r _ headers_limit library_limit < <(grep "^$name " "$programs/expected_kernels.txt") || headers_limit=""
    for way in headers library; do
        define=() limit=$headers_limit
        if [[ $way == library ]]; then
            define=(-DVOXELPIPE_LINKS_CUDA_KERNELS) limit=$library_limit
        fi
        number=$(count_kernels "$file" "${define[@]}")
        cost=""
        [[ -z $seconds ]] || cost=$(compile "$file" "${define[@]}")
        # shellcheck disable=SC2086 # two numbers, or none
        printf '%-18s %-10s %8d %10s %8s\n' "$name" "$way" "$number" ${cost:-- -}
        [[ -n $check ]] || continue
        if [[ -z $headers_limit ]]; then
            printf '%s: expected_kernels.txt does not name it\n' "$name" >&2
            status=1
        elif [[ $number -gt $limit ]]; then
            printf '%s, %s: %d kernels, %d at most: see expected_kernels.txt\n' "$name" "$way" "$number" "$limit" >&2
            status=1
        fi
    done
done

if [[ -n $seconds ]]; then
    all_seconds=0 all_size=0
    for file in voxelpipe/cuda_kernels/*.cu; do
        read -r used size < <(compile "$file" -DVOXELPIPE_LINKS_CUDA_KERNELS)
        printf '%-29s %8s %10s %8s\n' "cuda_kernels/$(basename "$file" .cu)" - "$used" "$size"
        read -r all_seconds all_size < <(awk "BEGIN { print $all_seconds + $used, $all_size + $size }")
    done
    printf '%-29s %8s %10s %8s\n' "cuda_kernels, all" - "$all_seconds" "$all_size"
fi
exit $status
