#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Tests the source archive and the recipes of packaging/ as far as they can be without their servers: Conan's by conan create, vcpkg's and
# Spack's with their commands replaced, conda's parsed and rendered, Homebrew's options and test program. All of them take the archive that scripts/dist.sh has just made.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

need_packages python3 python3-venv
scripts/version.py --check
scripts/dist.sh --test
scripts/release.sh --draft notes >/dev/null
folder=$root/build/packaging
archive=$(echo build/dist/voxelpipe-*.tar.gz)
if ! cmp -s packaging/requirements-test.txt "$folder/venv/requirements.txt"; then
    python3 -m venv "$folder/venv"
    "$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check -r packaging/requirements-test.txt
    cp packaging/requirements-test.txt "$folder/venv/requirements.txt"
fi

say "files that a forge reads"
"$folder/venv/bin/check-jsonschema" --builtin-schema vendor.github-workflows .github/workflows/*.yml
"$folder/venv/bin/cffconvert" --validate -i CITATION.cff

say "filling in the recipes"
rm -rf "$folder/recipes"
packaging/fill.py --archive "$archive" --repository https://example.invalid/voxelpipe --url "file://$root/$archive" --out "$folder/recipes"
if grep -rn 'ARCHIVE_URL\|ARCHIVE_SHA\|REPOSITORY_URL' "$folder/recipes"; then
    die "placeholders are left"
fi
launcher=$(command -v ccache || true)

say "vcpkg"
cmake -DPORT_DIR="$folder/recipes/vcpkg/voxelpipe" -DWORK_DIR="$folder/vcpkg" -DLAUNCHER="$launcher" -P packaging/tests/vcpkg.cmake

say "Conan"
export CONAN_HOME=$folder/conan PATH=$folder/venv/bin:$PATH
rm -rf "$CONAN_HOME"
conan profile detect >/dev/null 2>&1
# GLM is the system's, for there is no server to ask.
cat >>"$CONAN_HOME/profiles/default" <<PROFILE
[platform_requires]
glm/1.0.1
[conf]
tools.cmake.cmaketoolchain:generator=Ninja
tools.cmake.cmaketoolchain:extra_variables={"CMAKE_CXX_COMPILER_LAUNCHER": "$launcher"}
PROFILE
sed -i 's/^compiler.cppstd=.*/compiler.cppstd=20/' "$CONAN_HOME/profiles/default"
conan remote disable '*' >/dev/null 2>&1
conan create "$folder/recipes/conan" --version "$(scripts/version.py)" >"$folder/conan.log" 2>&1 || { cat "$folder/conan.log"; die "conan create failed"; }
grep -E 'test_package|Package .* created' "$folder/conan.log" | tail -n 2

say "Spack, conda and Homebrew"
python3 packaging/tests/spack.py "$folder/recipes/spack/package.py" CMakeLists.txt
"$folder/venv/bin/python" packaging/tests/conda.py "$folder/recipes/conda/recipe.yaml"
packaging/tests/homebrew.py "$folder/recipes/homebrew/voxelpipe.rb" CMakeLists.txt capi/include/voxelpipe.h
