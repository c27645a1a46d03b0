#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# windows_test.sh VOXELIZE.EXE [RUNNER...]: what is different on Windows. Names in UTF-16, lines that end in CRLF, backslashes,
# names of one file in two cases, standard output, processes of a list, files that are locked, limits of memory. RUNNER is
# wine64 by default.
set -euo pipefail
tool=$(realpath "$1")
shift
runner=("$@")
[[ ${#runner[@]} -gt 0 ]] || runner=(wine64)
folder=$(mktemp -d "${TMPDIR:-/tmp}/voxelpipe-windows-test.XXXXXX")
trap 'rm -rf "$folder"' EXIT
cd "$folder"
export WINEDEBUG=-all

failures=0
# run CODE WORDS...: the tool ends with CODE. Its streams are in out.txt and err.txt.
run() {
    local code=$1 status=0
    shift
    "${runner[@]}" "$tool" "$@" >out.txt 2>err.txt </dev/null || status=$?
    [[ $status -ne $code ]] || return 0
    printf 'voxelize %s: %s, not %s:\n' "$*" "$status" "$code"
    cat out.txt err.txt
    failures=$((failures + 1))
}
# says FILE TEXT: a file has the text.
says() {
    ! grep -qF -- "$2" "$1" || return 0
    printf 'no "%s" in %s:\n' "$2" "$1"
    sed -n 1,20p "$1"
    failures=$((failures + 1))
}
# holds COMMAND...: it ends with 0.
holds() {
    "$@" && return
    printf 'failed: %s\n' "$*"
    failures=$((failures + 1))
}
nothing_left() { ! compgen -G '*.part*' >/dev/null && ! compgen -G '*.slabs' >/dev/null && ! compgen -G 'voxelpipe-*' >/dev/null; }

# A tetrahedron of two colours, whose material has a blank in its name.
cat >model.obj <<'OBJ'
mtllib model.mtl
v 0 0 0
v 2 0 0
v 0 2 0
v 0 0 2
usemtl deep red
f 1 3 2
f 1 2 4
usemtl green
f 1 4 3
f 2 3 4
OBJ
printf 'newmtl deep red\nKd 0.5 0 0\nnewmtl green\nKd 0 1 0\n' >model.mtl
mkdir crlf
for file in model.obj model.mtl; do sed 's/$/\r/' $file >crlf/$file; done
colors=(-r 16 -t "occupancy,color")

run 0 model.obj -o plain.npz "${colors[@]}"
says out.txt "wrote plain.npz"
holds test -s plain.npz

# Lines that end in CRLF, in the model and in its materials: the same bytes, and no warning of an unknown material.
run 0 crlf/model.obj -o crlf.npz "${colors[@]}"
holds cmp plain.npz crlf.npz
holds test ! -s err.txt

# Names that no code page has together, one of them beyond 16 bits, in folders and files, inputs and outputs.
name='Würfel €Ж語😀'
mkdir "$name"
cp model.mtl "$name/"
cp model.obj "$name/$name.obj"
run 0 "$name/$name.obj" -o "$name/$name.npz" "${colors[@]}"
holds cmp plain.npz "$name/$name.npz"
says out.txt "wrote $name/$name.npz"

# Backslashes and a drive in inputs, outputs and names that have a place for a layer.
mkdir -p deep/er
run 0 'crlf\model.obj' -o 'deep\er\out.npz' "${colors[@]}"
holds cmp plain.npz deep/er/out.npz
run 0 model.obj -o 'deep\layer{z}.png' -r 4
for layer in 0000 0001 0002 0003; do holds test -s "deep/layer$layer.png"; done
if [[ ${runner[*]} == *wine* ]]; then # whose drive Z is the machine's root
    run 0 "Z:${folder//\//\\}\\model.obj" -o "z:${folder//\//\\}\\drive.npz" "${colors[@]}"
    holds cmp plain.npz drive.npz
fi

# An output over the model, also by another spelling of its name: Windows takes both for one. Nothing is written.
cp model.obj before.obj
for output in model.obj MODEL.OBJ '.\Model.obj' 'deep\..\model.OBJ'; do
    run 1 model.obj -o "$output" -r 8
    says err.txt "is the model"
done
run 1 model.obj -o new.npy -o NEW.npy -r 8
says err.txt "is the same file as"
holds cmp model.obj before.obj
holds test ! -e new.npy

# A file that is there is replaced, and one that another run was killed over leaves nothing.
printf 'left' >plain.npz.part0
run 0 model.obj -o plain.npz "${colors[@]}"
holds cmp plain.npz crlf.npz
holds nothing_left

# Standard output: bytes as they are, messages on the other stream.
run 0 model.obj -o plain.npy -r 16
run 0 model.obj -o npy:- -r 16
holds cmp out.txt plain.npy
says err.txt "voxels are covered"
run 0 model.obj -o plain.npy -r 16 --stats json
holds python3 -c 'import json, sys; sys.exit(json.load(open("out.txt"))["voxels"] == 0)'

# Models in other formats, and those of libraries that this tool is built without.
run 0 model.obj -o again.stl -r 16
run 0 again.stl -o stl.npy -r 8
run 0 model.obj -o again.glb -r 16
run 0 again.glb -o glb.npy -r 8
holds cmp stl.npy glb.npy
printf '<COLLADA/>' >scene.dae
run 2 scene.dae -o out.npy -r 8
says err.txt "assimp"
run 1 model.obj -o out.vdb -r 8
says err.txt "OpenVDB"

# What is not there, and what cannot be written.
run 2 missing.obj -o out.npy -r 8
says err.txt "missing.obj"
says err.txt "no such file"
run 4 model.obj -o no/such/folder/out.npy -r 8
says err.txt "no/such/folder"
printf '{"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"/Windows/x.bin"}]}' >outside.gltf
run 2 outside.gltf -o out.npy -r 8
says err.txt "not a relative path"

# Limits of memory.
run 3 model.obj -o out.npy -r 1200 --dense -t count --max-memory 200
says err.txt "200 MiB are allowed by --max-memory"
holds test ! -e out.npy
run 0 model.obj -o out.npy -r 32 --stats json
holds python3 -c 'import json, sys; sys.exit(not 1e6 < json.load(open("out.txt"))["peak_memory_bytes"] < 1e9)'

# A folder that takes the place of one that is there.
run 0 model.obj -o volume.zarr -r 40 --compression 0
cp -r volume.zarr first.zarr
run 0 model.obj -o volume.zarr -r 40 --compression 0
holds diff -r volume.zarr first.zarr
holds nothing_left

# Slabs, with temporary files of a flood; twice, and by two processes, of which the second makes the output.
outside=(-r 300 --solid exterior --compression 0)
run 0 model.obj -o whole.zarr "${outside[@]}"
for time in first second; do
    run 0 model.obj -o slabs.zarr "${outside[@]}" --resume
    holds diff -r whole.zarr slabs.zarr
done
run 0 model.obj -o ranks.zarr "${outside[@]}" --world-size 2 --rank 1
holds test ! -e ranks.zarr
run 0 model.obj -o ranks.zarr "${outside[@]}" --world-size 2 --rank 0
holds diff -r whole.zarr ranks.zarr
holds nothing_left

# A list: a process for each model, one that fails, a second run that finds all done.
printf '%s\r\n' "$name\\$name.obj" 'crlf\model.obj' missing.obj >list.txt
run 2 --list list.txt -o 'all\{name}.npz' "${colors[@]}" --jobs 2
holds cmp plain.npz "all/$name.npz"
holds cmp plain.npz all/model.npz
says out.txt "2 done, 0 were finished, 1 failed"
says err.txt "bad_model"
run 2 --list list.txt -o 'all\{name}.npz' "${colors[@]}" --jobs 2
says out.txt "0 done, 2 were finished, 1 failed"
printf 'model.obj\n' | "${runner[@]}" "$tool" --list - -o 'all\{name}.ply' -r 8 >out.txt 2>err.txt
says out.txt "1 done"

# A path of more than 260 characters, which Windows takes from programs whose manifest says that they know such.
holds grep -q '<longPathAware .*>true</longPathAware>' "$tool"
deep=$(printf 'a folder of thirty characters.%d/' {0..9})
mkdir -p "$deep"
cp model.mtl "$deep"
cp model.obj "$deep/model.obj"
run 0 "$deep/model.obj" -o "$deep/model.npz" "${colors[@]}"
holds cmp plain.npz "$deep/model.npz"

[[ $failures -eq 0 ]] || { printf '%d failures\n' "$failures"; exit 1; }
printf 'the tool for Windows: all passed\n'
