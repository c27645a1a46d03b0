#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Tests the Python package as a user gets it: makes the source archive, builds a wheel from what the archive holds, installs it
# into a fresh environment, runs its tests and examples, and type-checks a program against its stubs. Everything is in build/python.
#
#   scripts/python_package.sh [OPTION...]      further options of `pip wheel`, such as
#                                              --config-settings=cmake.define.VOXELPIPE_PYTHON_OPTIONS=-O1
# The stage `python` of .ci/run optimises nothing, which is a third of the time to compile.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages "${build_packages[@]}" python3 python3-venv python3-dev
folder=$root/build/python
python=$folder/venv/bin/python
mkdir -p "$folder"

if [[ ! -x $python ]]; then
    say "making an environment for the Python package"
    python3 -m venv "$folder/venv"
fi
"$python" -m pip install --quiet --disable-pip-version-check build -r python/requirements-test.txt

say "making the source archive"
rm -rf "$folder/dist" "$folder/source"
"$python" -m build --no-isolation --sdist --outdir "$folder/dist" . >/dev/null
mkdir "$folder/source"
tar -xf "$folder"/dist/voxelpipe-*.tar.gz -C "$folder/source" --strip-components=1

say "building the wheel"
command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache
export CMAKE_BUILD_PARALLEL_LEVEL=$jobs
(cd "$folder/source" && "$python" -m pip wheel --quiet --disable-pip-version-check --no-build-isolation --no-deps \
    --wheel-dir "$folder/dist" "$@" .)
wheel=$(echo "$folder"/dist/*.whl)
# STABLE_ABI is dropped without a word where CMake does not learn of it; then the name is that of one version of Python.
tag=$("$python" -c 'import sys; v = sys.version_info; print(f"cp3{v.minor}-cp3{v.minor}" if v < (3, 12) else "cp312-abi3")')
[[ $wheel == *-"$tag"-* ]] || die "the wheel is called $(basename "$wheel"), not ...-$tag-..."
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheel"

say "testing it"
cd "$folder" # away from the folder that holds headers of the package's name
# What is baked of models is compared with the tool that the wheel brings.
VOXELPIPE_TOOL=$("$python" -c 'import pathlib, voxelpipe; print(pathlib.Path(voxelpipe.__file__).parent / "bin/voxelize")')
export VOXELPIPE_TOOL
[[ -x $VOXELPIPE_TOOL ]] || die "the wheel has no tool"
"$python" -m pytest -q "$root/python/tests"
# Tensors, where the distribution's Python has torch (Debian's python3-torch is a download of 47 MB; wheels of PyPI bring CUDA).
system=/usr/bin/python3
same_version='import sys; print(sys.version_info[:2])'
if "$system" -c 'import torch' 2>/dev/null && [[ $("$system" -c "$same_version") == "$("$python" -c "$same_version")" ]]; then
    "$system" -m venv --clear --system-site-packages "$folder/venv-torch"
    "$folder/venv-torch/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps "$wheel" pytest iniconfig pluggy packaging
    "$folder/venv-torch/bin/python" -m pytest -q "$root"/python/tests/test_{interoperation,axes,distance}.py -k torch
else
    printf 'not run: tests with torch (no torch for this version of Python)\n'
fi
for example in "$root"/python/examples/*.py; do
    "$python" "$example"
done
"$python" -m mypy --strict "$root/python/tests/typed_program.py"
