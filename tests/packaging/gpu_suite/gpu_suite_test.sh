#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# gpu_suite_test.sh SCRIPTS: the part `sanitizer` of run_gpu_suite.sh with stand-ins: every tool runs sparse, solids and slabs
# (devices) with tests named, a report fails the run and is in the record by kernel, and programs at a time lose no line.
set -u
scripts=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { printf 'FAILED: %s\n' "$1" >&2; exit 1; }

mkdir -p "$folder"/{bin,project/scripts,project/build/gpu/tests/strategies}
cp "$scripts"/{run_gpu_suite,common}.sh "$folder/project/scripts/"
cat >"$folder/bin/nvidia-smi" <<'STAND_IN'
#!/usr/bin/env bash
case $* in *name*) echo "NVIDIA TEST" ;; *compute_cap*) echo 9.0 ;; *) echo 1 ;; esac
STAND_IN
cat >"$folder/bin/compute-sanitizer" <<'STAND_IN'
#!/usr/bin/env bash
printf '%s\n' "$*" >>"$CALLS"
echo '[       OK ] Some.Test (1 ms)'
[[ $* == *initcheck*sparse* && -n ${REPORTS:-} ]] || exit 0
for i in 1 2; do
    echo '========= Uninitialized __global__ memory read of size 4 bytes'
    echo '=========     at void voxelpipe::device::some_kernel<int>(const int *)+0x10 in /folder/some.cuh:12'
    echo '========='
done
exit 9
STAND_IN
chmod +x "$folder"/bin/*
for program in small_loads small_lists counting_sort fragment_order fragment_sort immediate immediate_bits kept_graphs tracked_changes \
    sparse solids devices; do
    printf '#!/bin/sh\n' >"$folder/project/build/gpu/tests/strategies/device_${program}_test"
    chmod +x "$folder/project/build/gpu/tests/strategies/device_${program}_test"
done
cd "$folder/project" || exit 1
export PATH="$folder/bin:$PATH" CALLS="$folder/calls" VOXELPIPE_STEP=run VOXELPIPE_RESULTS="$folder/results"

VOXELPIPE_AT_ONCE=8 scripts/run_gpu_suite.sh sanitizer >"$folder/output" 2>&1 || fail "a run without a report: $(tail -n 5 "$folder/output")"
for tool in memcheck racecheck initcheck synccheck; do
    for program in sparse solids devices; do
        grep -qE -- "--tool $tool .*device_${program}_test --gtest_filter=.+" "$CALLS" || fail "$tool does not run $program"
    done
done
grep -q '^passed: 48$' "$folder/output" || fail "lines are lost: $(grep '^passed' "$folder/output")"
grep -q '^failures: 0$' "$folder/output" || fail "failures without a report"

status=0
REPORTS=1 VOXELPIPE_AT_ONCE=4 VOXELPIPE_PROGRAMS=sparse scripts/run_gpu_suite.sh sanitizer >"$folder/output" 2>&1 || status=$?
[[ $status -ne 0 ]] || fail "a report does not fail the run"
grep -q '^failures: 1$' "$folder/output" || fail "a report is not one failure: $(grep '^failures' "$folder/output")"
grep -qE '^ +2  Uninitialized __global__ memory read of size 4 bytes: some_kernel in /folder/some.cuh:12$' "$folder"/results/*.txt ||
    fail "the record does not name the kernel"
