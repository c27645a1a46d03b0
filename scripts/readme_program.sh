#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# readme_program.sh [--update]: the program in README.md is the sample that is built and tested, line for line (without its
# licence lines). Fails where they differ; --update writes the sample into the README.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

sample=samples/01_first_voxels.cpp
mkdir -p build
updated=build/README.md
awk -v marker="<!-- $sample -->" -v sample="$sample" '
    $0 == marker { print; getline; print
                   while ((getline line < sample) > 0) if (line !~ /^\/\/ SPDX-/) print line
                   inside = 1; next }
    inside && $0 == "```" { inside = 0 }
    !inside' README.md >"$updated"
if [[ ${1:-} == --update ]]; then
    cp "$updated" README.md
elif ! diff -u README.md "$updated"; then
    die "the program in README.md is not $sample; scripts/readme_program.sh --update writes it"
fi
