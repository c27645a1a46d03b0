#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes .venv with the Python readers of tests/tool/formats/requirements.txt (NumPy, VTK, ...), with which the tests open the
# files that the tool writes. Once it is there, make test finds it; without it those tests are left out.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

requirements=tests/tool/formats/requirements.txt
need_packages python3 python3-venv
stamp=.venv/requirements.txt
if [[ -x .venv/bin/python ]] && cmp -s "$requirements" "$stamp"; then
    exit 0
fi
say "installing Python modules for the tests into .venv"
python3 -m venv .venv
.venv/bin/python -m pip install --quiet --disable-pip-version-check -r "$requirements"
cp "$requirements" "$stamp"
