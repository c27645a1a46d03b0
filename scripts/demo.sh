#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# demo.sh [RESOLUTION [MODEL]]: builds the tool, voxelizes MODEL (or a small textured model that it makes) in colour, and
# leaves the files and a picture in demo/. What is up to date is not done again.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

resolution="${1:-256}"
model="${2:-}"
[[ $resolution =~ ^[1-9][0-9]*$ ]] || die "RESOLUTION is a whole number of voxels, not '$resolution'"
[[ -z $model || -f $model ]] || die "there is no file MODEL=$model"

need_packages "${build_packages[@]}"

say "building the tool (build/demo; the first time about 4 minutes on two cores)"
[[ -f build/demo/build.ninja ]] || configure demo
cmake --build build/demo --target voxelize demo_model -j "$jobs"

mkdir -p demo
if [[ -z $model ]]; then
    model=demo/lighthouse.glb
    say "making a small textured model: $model"
    build/demo/samples/demo_model/demo_model "$model"
fi
name="$(basename "$model")"
name="${name%.*}"

say "voxelizing $model: ${resolution} voxels along its longest side, with colour"
build/demo/tool/voxelize "$model" --resolution "$resolution" --target occupancy --target color \
    -o "demo/$name.npz" -o "demo/$name.vox" -o "demo/$name.vti" -o demo/preview.png --stats

say "done; the files are in $root/demo"
ls -l "demo/preview.png" "demo/$name".*
cat <<TEXT

  preview.png   a shaded picture of the voxels
  $name.vox   for MagicaVoxel and other voxel editors
  $name.npz   for NumPy: numpy.load(...)["color"] has the shape (nz, ny, nx, 4)
  $name.vti   for ParaView

Another model: make demo MODEL=file.glb (glTF 2.0, .gltf or .glb; also .obj, .stl, .ply, .off and more). The tool: build/demo/tool/voxelize --help
TEXT
