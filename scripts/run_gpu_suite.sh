#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# run_gpu_suite.sh [part...]: the CUDA tests on this machine's GPU, with a record under build/gpu_results/ (or where
# VOXELPIPE_RESULTS says). A run of all parts replaces records/MACHINE/suite.txt at its end, passed or failed; MACHINE is the
# second word of the device's name (h200). Fails without a device, and where a part cannot run. Parts, all by default:
#   default     the equality suite and the golden hashes, scenes included where VOXELPIPE_SCENES_DIR has them
#   fast_math   the suite without the scenes, built with -use_fast_math
#   no_fmad     the same with --fmad=false
#   plain_constexpr  part of it, built without --expt-relaxed-constexpr
#   tool        the files that voxelize writes on the GPU against those that it writes on the CPU, and against golden hashes
#   capi        the C API on the GPU: known results, errors, and all calls against the CPU's bytes
#   sanitizer   compute-sanitizer memcheck, racecheck, initcheck and synccheck over a reduced suite, sparse framebuffers, solids
#               and slabs among it; of a program that fails, the record says how often each kernel was reported
# VOXELPIPE_CUDA_FLAGS: further options for nvcc, which the record names; --Ofast-compile=mid halves the time to build.
# VOXELPIPE_STEP: build, or run, for a machine that has no device but time, and one that has a device for a short time only.
#   build compiles the parts for VOXELPIPE_ARCHITECTURE (90 where that is not set) and needs no device; run takes the programs
#   that lie in build/ of the same folder, whichever there are, and the record says so.
# VOXELPIPE_PROGRAMS: a regular expression; only programs whose name in the record matches it are run. The record names it.
# VOXELPIPE_AT_ONCE: how many programs run at a time, 1 by default; for a device that many processes share well, or several.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

parts=("$@")
[[ ${#parts[@]} -gt 0 ]] || parts=(default fast_math no_fmad plain_constexpr tool capi sanitizer)
step="${VOXELPIPE_STEP:-all}"
at_once="${VOXELPIPE_AT_ONCE:-1}"
[[ $step == all || $step == build || $step == run ]] || die "VOXELPIPE_STEP is build or run"
[[ $step == run ]] || command -v nvcc >/dev/null || die "no nvcc on PATH"

record=/dev/null
architecture="${VOXELPIPE_ARCHITECTURE:-90}"
if [[ $step != build ]]; then
    results="${VOXELPIPE_RESULTS:-build/gpu_results}"
    mkdir -p "$results"
    device="$(nvidia-smi --query-gpu=name --format=csv,noheader 2>/dev/null | sed -n 1p)" || true
    [[ -n $device ]] || die "no CUDA device: the suite was not run"
    driver="$(nvidia-smi --query-gpu=driver_version --format=csv,noheader | sed -n 1p)"
    clocks="$(nvidia-smi --query-gpu=clocks.sm,clocks.mem --format=csv,noheader | sed -n 1p)"
    toolkit="$(nvcc --version 2>/dev/null | sed -n 's/.*release \([0-9.]*\).*/\1/p')" || true
    commit="${VOXELPIPE_COMMIT:-$(git rev-parse --short HEAD 2>/dev/null || echo unknown)}"
    architecture="$(nvidia-smi --query-gpu=compute_cap --format=csv,noheader | sed -n 1p | tr -d .)"
    record="$results/$(date -u +%Y-%m-%dT%H%M%SZ).txt"
    {
        printf 'device: %s\ndriver: %s\nCUDA: %s\nclocks (SM, memory): %s\ncommit: %s\n' \
            "$device" "$driver" "${toolkit:-unknown}" "$clocks" "$commit"
        [[ $step != run ]] || printf 'built: before, by this script with VOXELPIPE_STEP=build\n'
        [[ -z ${VOXELPIPE_CUDA_FLAGS:-} ]] || printf 'nvcc with: %s\n' "$VOXELPIPE_CUDA_FLAGS"
        [[ -z ${VOXELPIPE_PROGRAMS:-} ]] || printf 'only: %s\n' "$VOXELPIPE_PROGRAMS"
        [[ $at_once -eq 1 ]] || printf 'programs at a time: %d\n' "$at_once"
        printf '\n'
        printf '%-15s %-28s %8s %8s %8s %8s\n' part program passed failed 'not run' seconds
    } >"$record"
fi

# Scenes are decoded beside the build, never inside the project.
scenes="${VOXELPIPE_SCENES_DIR:-$root/../shared/scenes}"
decode_scenes() {
    [[ $step != build ]] || return 0
    [[ -e $scenes/vpmesh.py ]] || { printf 'note: no scenes at %s; generated meshes stand in\n' "$scenes" | tee -a "$record"; return 0; }
    export VOXELPIPE_VPM_DIR="${TMPDIR:-/tmp}/voxelpipe-scenes"
    mkdir -p "$VOXELPIPE_VPM_DIR"
    local archive name part decoders=()
    for archive in "$scenes"/*.vpz; do
        name="$(basename "$archive" .vpz)"
        part="$VOXELPIPE_VPM_DIR/$name.part"
        [[ -e $VOXELPIPE_VPM_DIR/$name.vpm ]] && continue
        { python3 "$scenes/vpmesh.py" decode "$archive" "$part" >/dev/null && mv "$part" "${part%.part}.vpm"; } &
        decoders+=($!)
    done
    local decoder
    for decoder in "${decoders[@]}"; do wait "$decoder" || die "a scene of $scenes could not be decoded"; done
}

failures=0 # beside those of programs, which the record has
# run_program PART LABEL COMMAND...: counts what the program's tests say, and a crash or no end in time as a failure. A test
# that is skipped, for want of memory or scenes, was not run: it is neither passed nor failed; nor is a program that was
# not built where VOXELPIPE_STEP is run.
run_program() {
    [[ $step != build ]] || return 0
    [[ -z ${VOXELPIPE_PROGRAMS:-} || $2 =~ $VOXELPIPE_PROGRAMS ]] || return 0
    if [[ $at_once -eq 1 ]]; then
        run_one "$@"
    else
        while [[ $(jobs -pr | wc -l) -ge $at_once ]]; do wait -n || true; done
        run_one "$@" &
    fi
}
run_one() {
    local part=$1 name=$2 start=$SECONDS log passed failed skipped status=0 program
    shift 2
    for program in "$@"; do
        if [[ $step == run && $program == build/* && ! -x $program ]]; then
            printf '%-15s %-28s not built\n' "$part" "$name" | tee -a "$record"
            return 0
        fi
    done
    log="build/gpu-$part-${name//[ ,]/-}.log"
    timeout "${VOXELPIPE_PROGRAM_SECONDS:-900}" "$@" >"$log" 2>&1 || status=$?
    passed="$(grep -cE '^\[       OK \]' "$log" || true)"
    failed="$(grep -E '^\[  FAILED  \]' "$log" | grep -cE 'ms\)$' || true)"
    skipped="$(grep -E '^\[  SKIPPED \]' "$log" | grep -cE 'ms\)$' || true)"
    [[ $status -eq 0 || $failed -gt 0 ]] || failed=1
    [[ $passed -gt 0 || $failed -gt 0 || $skipped -gt 0 ]] || failed=1
    printf '%-15s %-28s %8d %8d %8d %8d\n' "$part" "$name" "$passed" "$failed" "$skipped" $((SECONDS - start)) |
        tee -a "$record"
    [[ $failed -gt 0 ]] || return 0
    if [[ $part == sanitizer ]]; then
        reported_kernels "$log" | tee -a "$record"
    fi
    grep -vE '^(\[ (RUN|      OK)|=========)' "$log" | sed -n 1,40p # no `head`: see .ci/run
}
# reported_kernels LOG: how often compute-sanitizer reports what, and where: kernel, and file and line where the program has them.
reported_kernels() {
    awk '
        function kernel(text) { return match(text, /[A-Za-z_0-9]*_kernel/) ? substr(text, RSTART, RLENGTH) : substr(text, 1, 80) }
        function source(text) { return match(text, / in [^ ]*:[0-9]+/) ? substr(text, RSTART, RLENGTH) : "" }
        /^========= (Uninitialized|Host API|Invalid|Error|Warning|Barrier|Program hit)/ {
            sub(/^========= /, "")
            gsub(/0x[0-9a-f]+/, "")
            if (/^Host API/) { ++count[$0]; next }
            if (/Race reported/) { ++count["race: " kernel($0) source($0)]; next }
            what = $0
            next
        }
        what != "" && /^========= +at / {
            sub(/^========= +at /, "")
            ++count[what ": " kernel($0) source($0)]
            what = ""
        }
        END { for (c in count) printf "    %8d  %s\n", count[c], c }' "$1" | sort -rn | sed -n 1,80p
}
# run_plain PART LABEL COMMAND...: a test that is not GoogleTest's counts as one: 0 has passed, 77 was not run.
run_plain() {
    [[ $step != build ]] || return 0
    [[ -z ${VOXELPIPE_PROGRAMS:-} || $2 =~ $VOXELPIPE_PROGRAMS ]] || return 0
    local part=$1 name=$2 start=$SECONDS status=0 log
    shift 2
    log="build/gpu-$part-$name.log"
    timeout "${VOXELPIPE_PROGRAM_SECONDS:-900}" "$@" >"$log" 2>&1 || status=$?
    printf '%-15s %-28s %8d %8d %8d %8d\n' "$part" "$name" $((status == 0)) $((status != 0 && status != 77)) $((status == 77)) \
        $((SECONDS - start)) | tee -a "$record"
    [[ $status -eq 0 || $status -eq 77 ]] || sed -n 1,40p "$log"
}
# end_programs: waits for what VOXELPIPE_AT_ONCE has started.
end_programs() { while [[ -n $(jobs -pr) ]]; do wait -n || true; done; }

# build_suite FOLDER FLAG... (with target="..." those instead of the device tests, samples="ON" with the tool, capi="ON" with the C API)
build_suite() {
    local folder=$1
    shift
    [[ $step != run ]] || return 0
    cmake -S . -B "build/$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DVOXELPIPE_ENABLE_CUDA=ON -DVOXELPIPE_BUILD_TESTS=ON \
        -DVOXELPIPE_BUILD_SAMPLES="${samples:-OFF}" -DVOXELPIPE_BUILD_CAPI="${capi:-OFF}" -DVOXELPIPE_BUILD_BENCH=OFF -DCMAKE_CUDA_ARCHITECTURES="$architecture" \
        -DCMAKE_CUDA_FLAGS="$* ${VOXELPIPE_CUDA_FLAGS:-}" ${CMAKE_PREFIX_PATH:+-DCMAKE_PREFIX_PATH="$CMAKE_PREFIX_PATH"} \
        $([[ -d .deps ]] && printf -- '-DCMAKE_PREFIX_PATH=%s/.deps' "$root") >"build/configure-$folder.log" 2>&1 ||
        { tail -n 40 "build/configure-$folder.log"; die "cmake could not configure $folder"; }
    # shellcheck disable=SC2086 # one target or more
    cmake --build "build/$folder" -j "$jobs" --target ${target:-device_tests} -- -k 0 >"build/make-$folder.log" 2>&1 || {
        grep -E 'error|FAILED' "build/make-$folder.log" | head -n 20
        printf 'note: %s did not build completely\n' "$folder" | tee -a "$record"
        failures=$((failures + 1))
    }
}

# The golden hashes of the library on this GPU, and those of the tool's files where the tool was built: cases that are equal
# have passed, names that the program leaves out were not run.
run_golden() {
    local part=$1 folder=$2 start=$SECONDS log passed failed skipped status=0 options=()
    [[ $step != build ]] || return 0
    [[ -z ${VOXELPIPE_PROGRAMS:-} || golden_hashes_cuda =~ $VOXELPIPE_PROGRAMS ]] || return 0
    if [[ $step == run && ! -x build/$folder/tests/golden/golden_hashes_cuda ]]; then
        printf '%-15s %-28s not built\n' "$part" golden_hashes_cuda | tee -a "$record"
        return 0
    fi
    [[ -x build/$folder/tool/voxelize ]] || options=(--library)
    log="build/gpu-$part-golden_hashes_cuda.log"
    timeout "${VOXELPIPE_PROGRAM_SECONDS:-900}" scripts/golden.sh --build "build/$folder" --backend cuda "${options[@]}" \
        >"$log" 2>&1 || status=$?
    read -r passed failed skipped < <(sed -nE 's/^golden hashes: ([0-9]+) equal, ([0-9]+) problems, ([0-9]+) not run$/\1 \2 \3/p' "$log") || true
    passed=${passed:-0} failed=${failed:-0} skipped=${skipped:-0}
    [[ $status -eq 0 || $failed -gt 0 ]] || failed=1
    [[ $passed -gt 0 || $failed -gt 0 ]] || failed=1
    printf '%-15s %-28s %8d %8d %8d %8d\n' "$part" golden_hashes_cuda "$passed" "$failed" "$skipped" $((SECONDS - start)) |
        tee -a "$record"
    if [[ $failed -gt 0 ]]; then grep -vE '^[a-zA-Z0-9_.-]+ [0-9a-f]{16}$' "$log" | sed -n 1,40p; fi
}

run_suite() {
    local part=$1 folder=$2 source program
    for source in tests/{stages,strategies,robustness}/*_test.cu api_test.cu; do
        case $source in # these are in a program that has another file's name
        */solid_calls_test.cu | */device_repairs_test.cu | */surfaces_async_test.cu | */cut_cells_*async_test.cu | */distance_async_test.cu | */programs_*_test.cu | */sparse_*_test.cu | */several_draws_test.cu | \
            */workspace_test.cu) continue ;;
        esac
        program="build/$folder/tests/strategies/device_$(basename "$source" .cu)"
        [[ $part != default && $program == *scenes_test ]] && continue
        run_program "$part" "$(basename "$program")" "$program"
    done
}

mkdir -p build
for part in "${parts[@]}"; do
    case $part in
    default)
        decode_scenes
        build_suite gpu
        run_suite default gpu
        run_golden default gpu
        ;;
    fast_math)
        build_suite gpu-fast-math -use_fast_math
        run_suite fast_math gpu-fast-math
        run_golden fast_math gpu-fast-math
        ;;
    no_fmad)
        build_suite gpu-no-fmad --fmad=false
        run_suite no_fmad gpu-no-fmad
        run_golden no_fmad gpu-no-fmad
        ;;
    plain_constexpr)
        target=plain_constexpr_test build_suite gpu-plain-constexpr
        run_program plain_constexpr plain_constexpr_test build/gpu-plain-constexpr/tests/strategies/plain_constexpr_test
        ;;
    tool)
        samples=ON target=voxelize_gpu_files_test build_suite gpu-tool
        run_program tool voxelize_gpu_files_test build/gpu-tool/tests/tool/voxelize_gpu_files_test
        samples=ON target="golden_hashes_cuda voxelize" build_suite gpu-tool
        run_golden tool gpu-tool
        samples=ON target=gi_gpu_test build_suite gpu-tool
        run_program tool gi_gpu_test build/gpu-tool/tests/gi/gi_gpu_test
        ;;
    capi)
        capi=ON target="voxelpipe_c capi_test backends_test" build_suite gpu-capi
        run_plain capi capi_test build/gpu-capi/tests/capi/capi_test cuda
        run_plain capi backends_test build/gpu-capi/tests/capi/backends_test
        run_plain capi capi_test.py python3 tests/capi/capi_test.py build/gpu-capi/capi/libvoxelpipe.so capi/include/voxelpipe.h cuda
        ;;
    sanitizer)
        [[ $step == build ]] || command -v compute-sanitizer >/dev/null || die "compute-sanitizer is not on PATH: nothing was checked"
        # Built again, so that they are this commit's. Tests that are quick enough: of sparse, solids and devices those that
        # reach other kernels than the rest.
        sanitized_sparse='DeviceSparse.*:DeviceSparseSolids.TilesAreTheCpus:DeviceSparseSolids.InMemoryOfTheCaller'
        sanitized_sparse+=':DeviceSparseMasks.NodesWithout*:DeviceSparseMasks.LargeTriangles*:DeviceSparseAsync.*'
        sanitized_sparse+=':DeviceSparseGoesOn.ConstantsHave*:DeviceSparseMerge.SlabsOfSeveralGpus*-*InPartsOfLargeGrids'
        sanitized_solids='Solids.EveryRuleBodyAndExtentIntoBits:Solids.RowsOfManyCrossings:Solids.Async:Solids.ExteriorAndVote'
        sanitized_solids+=':Solids.VotesOf*:Solids.SlabsOfA*:Solids.ClosedHoles:DeviceRepairs.HolesAndVotes:DeviceRepairs.ListsAndSparseResults'
        sanitized_distance='DeviceDistance.WholeFields:DeviceDistance.LongLists*:DeviceDistance.Sparse*:DeviceDistance.Points*:*WithoutTriangles'
        sanitized=(small_loads small_lists counting_sort fragment_order fragment_sort immediate immediate_bits kept_graphs tracked_changes
            sparse solids distance surfaces cut_cells label devices)
        target="$(printf 'device_%s_test ' "${sanitized[@]}")" build_suite gpu
        end_programs
        for tool in memcheck racecheck initcheck synccheck; do
            options=(--tool "$tool" --error-exitcode 9)
            # Of all reads, so that the record says which kernels they are of.
            [[ $tool != initcheck ]] || options+=(--show-backtrace no --print-limit 100000)
            for program in "${sanitized[@]}"; do
                filter='*'
                [[ $program != fragment_order ]] || filter='*AtTheLimits*:*OrdersDenseVoxels:*IfTheCallHasFailed'
                [[ $program != fragment_sort ]] || filter='*ForEqualAndAlternatingKeys:*IfTheCallHasFailed'
                [[ $program != counting_sort ]] || filter='*EveryLength:*BeyondTheCapacity*:*NotExpected:*IfTheCallHasFailed'
                [[ $program != immediate ]] || filter='*LargeTrianglesWithManyWorkItems*'
                [[ $program != immediate_bits ]] || filter='*ManyTrianglesOfMediumSize*:*CloseTriangles*'
                [[ $program != tracked_changes ]] || filter='*SequencesByOccupancyMaskLeave*:*Clears*'
                [[ $program != kept_graphs ]] || filter='*AFewLargerTriangles*'
                [[ $program != solids ]] || filter="$sanitized_solids"
                [[ $program != distance ]] || filter="$sanitized_distance"
                [[ $program != sparse ]] || filter="$sanitized_sparse"
                # Arrays of fragments are copied as wholes, with what lies between the members of a fragment's outputs.
                [[ $program != sparse || $tool != initcheck ]] || filter+=':*VoxelsOfVeryManyFragments*:*LimitsChangeNothing'
                run_program sanitizer "$tool, $program" compute-sanitizer "${options[@]}" \
                    "build/gpu/tests/strategies/device_${program}_test" --gtest_filter="$filter"
            done
        done
        ;;
    *) die "no part is called $part" ;;
    esac
    end_programs
done

if [[ $step != build ]]; then
    # Rows end with passed, failed, not run and seconds, or "not built".
    read -r passed failed not_run < <(awk '/ [0-9]+ +[0-9]+ +[0-9]+ +[0-9]+$/ { p += $(NF - 3); f += $(NF - 2); n += $(NF - 1) }
        / not built$/ { ++n } END { print p + 0, f + 0, n + 0 }' "$record")
    failures=$((failures + failed))
    printf '\npassed: %d\nfailures: %d\nnot run: %d\n' "$passed" "$failures" "$not_run" | tee -a "$record"
    printf 'record: %s\n' "$record"
    if [[ $# -eq 0 && -z ${VOXELPIPE_PROGRAMS:-} ]]; then
        machine="$(cut -d ' ' -f 2 <<<"$device" | tr '[:upper:]' '[:lower:]')"
        mkdir -p "records/$machine"
        cp "$record" "records/$machine/suite.txt"
        printf 'record: records/%s/suite.txt\n' "$machine"
    fi
fi
[[ $failures -eq 0 ]]
