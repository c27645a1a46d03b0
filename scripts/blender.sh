#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Packs the Blender add-on with wheels of voxelpipe, as an extension that Blender 4.2 and later install from a file:
# build/blender/voxelpipe-blender-VERSION.zip. Then tests what it packed in Blender as a Python module (bpy, a download of 330 MB
# from the package index, for Python 3.11), and renders build/blender/picture.png.
#
#   scripts/blender.sh [--no-test] [WHEEL...]      by default all wheels of build/wheels/dist (make wheels)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

bpy=5.0.1
with_tests=1
if [[ ${1:-} == --no-test ]]; then
    with_tests=0
    shift
fi
need_packages python3 python3-venv zip unzip
folder=$root/build/blender
wheels=("$@")
[[ ${#wheels[@]} -gt 0 ]] || mapfile -t wheels < <(find build/wheels/dist -name 'voxelpipe-*.whl' 2>/dev/null | sort)
[[ ${#wheels[@]} -gt 0 ]] || die "no wheels: make wheels, or name them"
version=$(scripts/version.py)

rm -rf "$folder/addon"
mkdir -p "$folder"
cp -r packaging/blender/voxelpipe_addon "$folder/addon"
find "$folder/addon" -name __pycache__ -prune -exec rm -r {} +
mkdir "$folder/addon/wheels"
names=
for wheel in "${wheels[@]}"; do
    [[ $(basename "$wheel") == voxelpipe-"$version"-*.whl ]] || die "$wheel is no wheel of voxelpipe $version"
    cp "$wheel" "$folder/addon/wheels/"
    names+="${names:+, }\"./wheels/$(basename "$wheel")\""
done
sed -i "s|\"VERSION\"|\"$version\"|; s|\[WHEELS\]|[$names]|" "$folder/addon/blender_manifest.toml"
archive=$folder/voxelpipe-blender-$version.zip
rm -f "$archive"
(cd "$folder/addon" && zip -q -r -X "$archive" .)
say "the add-on is $archive"
[[ $with_tests -eq 1 ]] || exit 0

python=$folder/venv/bin/python
interpreter=
for name in python3.11 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.11*/bin/python3.11; do
    if "$name" -c 'import venv' 2>/dev/null; then interpreter=$name; fi
done
[[ -n $interpreter ]] || die "bpy $bpy needs Python 3.11"
[[ -x $python ]] || "$interpreter" -m venv "$folder/venv"
"$python" -m pip install --quiet --disable-pip-version-check "bpy==$bpy" pytest
# The wheel for this Python, of those packed; the folder is named as Blender's own installation names it.
rm -rf "$folder/installed"
mkdir -p "$folder/installed"
unzip -q "$archive" -d "$folder/installed/voxelpipe_addon"
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --no-index --force-reinstall --find-links \
    "$folder/installed/voxelpipe_addon/wheels" voxelpipe
# Blender has the module of OpenVDB, its form as a Python module has not: Debian's takes its place where it fits.
module=$(find /usr/lib/python3/dist-packages -maxdepth 1 -name 'pyopenvdb*-311-*.so' 2>/dev/null | sed -n 1p)
if [[ -n $module ]]; then
    mkdir -p "$folder/modules"
    cp "$module" "$folder/modules/"
    export PYTHONPATH=$folder/modules
fi
"$python" -c 'import sys, tomllib; tomllib.load(open(sys.argv[1], "rb"))' "$folder/installed/voxelpipe_addon/blender_manifest.toml"
cd "$folder"
PICTURE=$folder/picture.png VOXELPIPE_ADDON=$folder/installed "$python" -m pytest -q -p no:cacheprovider -rs \
    "$root/packaging/blender/test_addon.py"
say "what it made of Blender's monkey: $folder/picture.png"
