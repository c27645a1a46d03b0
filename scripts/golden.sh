#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# golden.sh [OPTION...] [RUNNER [ARGUMENT...]]: prints the name and the hash of every golden case, one a line, sorted, and
# compares them with tests/golden/hashes.txt: what the library computes (tests/golden/hashes), and the files that the tool
# writes from generated models, at --compression 0 or by their decoded content. Ends with 1 and the names where a hash
# differs, is missing, or is of no case; where RUNNER or a program is not there; and where hashes.txt is missing.
#
# RUNNER starts the programs of another machine, such as qemu-aarch64-static or wine64: --build names a build for that.
#
#   --build FOLDER   with tests/golden/golden_hashes and tool/voxelize, or .exe or .wasm; by default
#                    $VOXELPIPE_GOLDEN_BUILD, else build/test
#   --program FILE   instead of FOLDER/tests/golden/golden_hashes
#   --tool FILE      instead of FOLDER/tool/voxelize
#   --library        without the tool's files
#   --backend NAME   cpu, or cuda: golden_hashes_cuda and the tool on a GPU. Cases that a GPU cannot have are named;
#                    77 where there is none
#   --threads N      of the CPU, 1 by default; results do not depend on it
#   --every N        the first of the sorted cases and every Nth one after it
#   --hashes FILE    instead of tests/golden/hashes.txt
#   --update         writes the hashes to the file instead, to be reviewed like code
called_from=$PWD
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
export LC_ALL=C

build=${VOXELPIPE_GOLDEN_BUILD:-build/test}
program=
tool=
with_tool=1
backend=cpu
threads=1
every=1
hashes=tests/golden/hashes.txt
update=0
value_of() { [[ $# -ge 2 && -n $2 ]] || die "$1 needs a value"; }
# Paths are meant from where the script was called.
from_caller() { if [[ $1 == /* ]]; then printf '%s' "$1"; else printf '%s/%s' "$called_from" "$1"; fi; }
count_of() { [[ $2 =~ ^[1-9][0-9]*$ ]] || die "$1 takes a number from 1 on, not \"$2\""; }
while [[ $# -gt 0 ]]; do
    case $1 in
    --build | --program | --tool | --hashes | --backend | --threads | --every) value_of "$@" ;;&
    --build) build=$(from_caller "$2") ;;
    --program) program=$(from_caller "$2") ;;
    --tool) tool=$(from_caller "$2") ;;
    --hashes) hashes=$(from_caller "$2") ;;
    --backend)
        [[ $2 == cpu || $2 == cuda ]] || die "--backend takes cpu or cuda, not \"$2\""
        backend=$2
        ;;
    --threads)
        count_of "$@"
        threads=$2
        ;;
    --every)
        count_of "$@"
        every=$2
        ;;
    --library)
        with_tool=0
        shift
        continue
        ;;
    --update)
        update=1
        shift
        continue
        ;;
    -*) die "golden.sh has no option $1" ;;
    *) break ;;
    esac
    shift 2
done

runner=()
if [[ $# -gt 0 ]]; then
    path=$(cd "$called_from" && command -v -- "$1") || die "the runner $1 is not there, or cannot be executed"
    [[ $path == /* ]] || path=$(from_caller "$path")
    runner=("$path" "${@:2}")
fi
[[ $update -eq 1 || -r $hashes ]] || die "$hashes is missing; --update writes it"
[[ $update -eq 0 || $every -eq 1 && $with_tool -eq 1 && $backend == cpu ]] ||
    die "--update writes all hashes, those of the CPU: it does not go with --every, --library or --backend cuda"

# A program of the build, with the suffix that it has there.
find_program() {
    local file
    for file in "$1" "$1.exe" "$1.wasm"; do
        [[ -f $file ]] || continue
        printf '%s' "$file"
        return 0
    done
    die "$1 is not there: build the targets golden_hashes and voxelize, or name another build with --build"
}
[[ $build == /* ]] || build=$root/$build
suffix=
[[ $backend == cpu ]] || suffix=_cuda
program=$(find_program "${program:-$build/tests/golden/golden_hashes$suffix}")
[[ $with_tool -eq 0 ]] || tool=$(find_program "${tool:-$build/tool/voxelize}")

# The tool's cases: name, model, output, options.
tool_cases() {
    local format coverage target solid fill
    # Every format, of colours where it shows them; and of several values where it holds them.
    for format in npy npz vox schem litematic binvox vti nrrd nii zarr glb obj ply stl 3mf xyz html nvdb vtu inp msh; do
        printf 'file.%s model.glb out.%s -r 40\n' "$format" "$format"
    done
    for format in npy npz vti nrrd nii zarr html nvdb vtu; do
        printf 'file.%s.values model.glb out.%s -r 28 -t occupancy,count,color,normal,material,depth\n' "$format" "$format"
    done
    printf 'file.pvti model.glb out.pvti -r 40 --pieces 3 -t count,normal\n'
    printf 'file.nvdb.pieces model.glb out.nvdb -r 40 --pieces 2 -t occupancy\n'
    printf 'file.zarr.levels model.glb out.zarr -r 36 --levels -t occupancy,color\n'
    printf 'file.npz.sparse model.glb out.npz -r 40 --sparse -t color,triangle\n'
    printf 'file.npy.sparse model.glb out.npy -r 40 --sparse\n'
    for format in inp msh; do
        printf 'file.%s.materials model.glb out.%s -r 28 --solid nonzero -t material\n' "$format" "$format"
    done
    printf 'file.vtu.threshold model.glb out.vtu -r 28 -t fraction --threshold 0.5\n'
    printf 'file.ply.points model.glb out.ply -r 40 --points\n'
    for format in glb obj ply stl 3mf; do printf 'file.%s.merge model.glb out.%s -r 40 --merge\n' "$format" "$format"; done
    for format in glb obj ply stl 3mf npz; do
        printf 'file.%s.remesh model.glb out.%s -r 28 --remesh\n' "$format" "$format"
    done
    printf 'remesh.tool.quads open.stl out.ply -r 32 --remesh --close-holes --quads --place mean\n'
    printf 'remesh.tool.level model.glb out.npz -r 28 --remesh --iso 0.3 --padding 2 --place corner\n'
    # Without an angle, so that the picture takes no sine, which differs between machines.
    printf 'file.png model.glb out.png -r 24 --image-size 96x72 --azimuth 0 --elevation 0 --fov 0\n'
    for target in occupancy count color color-max color-replace color-outer normal material triangle depth; do
        printf 'target.tool.%s model.glb out.npy -r 32 -t %s\n' "$target" "$target"
    done
    printf 'cells.tool.fraction model.glb out.npz -r 32 -t fraction,occupancy --solid nonzero\n'
    printf 'cells.tool.faces model.glb out.vti -r 32 -t fraction,aperture_x,aperture_y,aperture_z\n'
    printf 'cells.tool.outside model.glb out.npz -r 32 -t fraction,aperture_z --outside\n'
    for coverage in conservative thin crosshair diagonal; do
        printf 'coverage.tool.%s model.glb out.npz -r 40x28x33 --coverage %s -t occupancy,count\n' "$coverage" "$coverage"
    done
    for solid in nonzero even_odd positive each_draw exterior; do
        printf 'solid.tool.%s model.glb out.npz -r 36 --solid %s -t occupancy,color,count\n' "$solid" "$solid"
    done
    for fill in body mean nearest; do
        printf 'solid.tool.fill_%s model.glb out.npz -r 28 --solid nonzero --fill %s -t color,material\n' "$fill" "$fill"
    done
    printf 'solid.tool.inner model.glb out.npy -r 36 --solid nonzero --solid-extent inner\n'
    printf 'solid.tool.close_holes open.stl out.npy -r 36 --solid even_odd --close-holes\n'
    printf 'solid.tool.vote open.stl out.npy -r 36 --solid even_odd --vote\n'
    printf 'solid.tool.closing open.stl out.npy -r 36 --solid exterior --closing 2\n'
    for format in obj stl ply; do printf 'model.%s model.%s out.npz -r 40 -t occupancy,color,normal\n' "$format" "$format"; done
    printf 'model.voxel_size model.stl out.npy -s 0.375 --padding 2\n'
    printf 'model.exact_grid model.glb out.npy -s 0.5 --origin -4,-6,-3 --extent 17,20,11\n'
    printf 'model.alpha.ignore model.glb out.npy -r 32 -t color --alpha ignore\n'
    printf 'model.alpha.cutoff model.glb out.npy -r 32 -t color --alpha cutoff\n'
}

scratch=$(mktemp -d "${TMPDIR:-/tmp}/voxelpipe-golden.XXXXXX")
trap 'rm -rf "$scratch"' EXIT

declare -A line_of expected got broken
names=()
library=()
while read -r name; do library+=("$name"); done < <("${runner[@]}" "$program" --list | tr -d '\r')
[[ ${#library[@]} -gt 0 ]] || die "${runner[*]} $program --list names no case"
if [[ $with_tool -eq 1 ]]; then
    while read -r name rest; do line_of[$name]=$rest; done < <(tool_cases)
fi
while read -r name; do names+=("$name"); done < <(printf '%s\n' "${library[@]}" "${!line_of[@]}" | sort)
chosen=()
for ((i = 0; i < ${#names[@]}; i += every)); do chosen+=("${names[i]}"); done

failed=0
problem() {
    printf '%s\n' "$*" >&2
    failed=$((failed + 1))
}
take() {
    local name hash
    while read -r name hash; do
        [[ -z ${got[$name]:-} ]] || problem "$name: two cases have this name"
        got[$name]=$hash
    done < <(tr -d '\r' <"$1")
}

of_library=()
for name in "${chosen[@]}"; do [[ -n ${line_of[$name]:-} ]] || of_library+=("$name"); done
if [[ ${#of_library[@]} -gt 0 ]]; then
    [[ $every -gt 1 ]] || of_library=()
    status=0
    "${runner[@]}" "$program" --threads "$threads" "${of_library[@]}" >"$scratch/library.txt" || status=$?
    [[ $status -ne 77 || $backend != cuda ]] || exit 77 # no device, as its message says
    [[ $status -eq 0 ]] || problem "$program has failed"
    take "$scratch/library.txt"
fi

# The tool runs in the folder of the models, with plain names, which mean the same on every system.
run_tool() {
    local name=$1 model=$2 output=$3
    shift 3
    rm -rf "$scratch/out"
    mkdir "$scratch/out"
    (cd "$scratch" && "${runner[@]}" "$tool" "$model" -o "out/$output" "$@" --compression 0 --quiet --backend "$backend" \
        --threads "$threads") >"$scratch/log.txt" 2>&1 </dev/null || {
        problem "$name: the tool has failed: $(sed -n 1p "$scratch/log.txt")"
        broken[$name]=1
        return 0
    }
    (cd "$scratch" && "${runner[@]}" "$hasher" --file "$name" out) >"$scratch/line.txt" || {
        problem "$name: its files have no hash"
        broken[$name]=1
        return 0
    }
    take "$scratch/line.txt"
}
if [[ $with_tool -eq 1 ]]; then
    # golden_hashes_cuda has the same options.
    hasher=$program
    "${runner[@]}" "$hasher" --write-model "$scratch" || die "$program --write-model has failed"
    for name in "${chosen[@]}"; do
        [[ -n ${line_of[$name]:-} ]] || continue
        read -ra words <<<"${line_of[$name]}"
        run_tool "$name" "${words[@]}"
    done
fi

for name in "${chosen[@]}"; do [[ -z ${got[$name]:-} ]] || printf '%s %s\n' "$name" "${got[$name]}"; done
if [[ $update -eq 1 ]]; then
    [[ $failed -eq 0 ]] || die "nothing was written: $failed cases failed"
    {
        printf '# SPDX-FileCopyrightText: 2026 The VoxelPipe authors\n# SPDX-License-Identifier: Apache-2.0\n#\n'
        printf '# case, FNV-1a hash of its bytes (tests/golden/digest.hpp); written by scripts/golden.sh --update\n'
        for name in "${names[@]}"; do printf '%s %s\n' "$name" "${got[$name]}"; done
    } >"$scratch/hashes.txt"
    cp "$scratch/hashes.txt" "$hashes"
    printf '%d hashes written to %s\n' "${#names[@]}" "$hashes" >&2
    exit 0
fi

while read -r name hash; do [[ -z $name || $name == '#'* ]] || expected[$name]=$hash; done <"$hashes"
equal=0
for name in "${chosen[@]}"; do
    [[ -z ${broken[$name]:-} ]] || continue # named above
    if [[ -z ${got[$name]:-} ]]; then
        problem "$name: no hash was printed"
    elif [[ -z ${expected[$name]:-} ]]; then
        problem "$name: $hashes has no hash of it"
    elif [[ ${got[$name]} != "${expected[$name]}" ]]; then
        problem "$name: ${got[$name]} differs from ${expected[$name]} of $hashes"
    else
        equal=$((equal + 1))
    fi
done
# A recorded hash whose case is gone would never be compared again.
left_out=0
if [[ $backend == cuda ]]; then
    while read -r name reason; do
        unset "expected[$name]"
        left_out=$((left_out + 1))
        printf 'not run: %s (%s)\n' "$name" "$reason" >&2
    done < <("${runner[@]}" "$program" --left-out)
fi
if [[ $with_tool -eq 1 ]]; then
    for name in "${names[@]}"; do unset "expected[$name]"; done
    for name in "${!expected[@]}"; do problem "$name: $hashes has a hash of it, but no case has that name"; done
fi
printf 'golden hashes: %d equal, %d problems, %d not run\n' "$equal" "$failed" "$left_out" >&2
[[ $failed -eq 0 ]]
