#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes the site in build/docs/html, from the documents, the headers by Doxygen, and the docstrings of the Python package. A warning is an
# error, and so is a public name without documentation. Takes a minute on two quiet cores.
#
#   scripts/docs.sh [--check] [--repository URL]      --check: opens every page in a browser without a window, as wide as a screen and as a
#                                                     telephone, and fails on an error in its console or a page that is not drawn.
#                                                     --repository: links to sources lead there
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

check=0 repository=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --check) check=1 ;;
        --repository) repository=(--repository "${2:?--repository needs a URL}"); shift ;;
        *) die "unknown option $1" ;;
    esac
    shift
done
need_packages "${docs_packages[@]}"
python=/usr/bin/python3 # Debian's and Ubuntu's, which has the packages
folder=$root/build/docs
rm -rf "$folder"/{doxygen,source,html,pictures}
mkdir -p "$folder"
version=$(scripts/version.py)

say "reading the headers"
{
    cat docs/site/Doxyfile
    printf 'PROJECT_NUMBER = %s\nOUTPUT_DIRECTORY = %s\nWARN_AS_ERROR = FAIL_ON_WARNINGS\n' "$version" "$folder/doxygen"
} | doxygen -
"$python" docs/site/check_documented.py "$folder/doxygen/xml"

say "writing the pages"
"$python" docs/site/prepare.py "$folder/source" --xml "$folder/doxygen/xml" "${repository[@]}"
VOXELPIPE_VERSION=$version VOXELPIPE_DOXYGEN_XML=$folder/doxygen/xml VOXELPIPE_PYTHON_SOURCE=$root/python \
    VOXELPIPE_SITE=$root/docs/site PYTHONDONTWRITEBYTECODE=1 \
    "$python" -m sphinx -q -W --keep-going -j auto -b html "$folder/source" "$folder/html"
printf '%s: %s pages\n' "$folder/html/index.html" "$(find "$folder/html" -name '*.html' | wc -l)"

[[ $check -eq 0 ]] || "$python" docs/site/check_pages.py "$folder/html" "$folder/pictures"
