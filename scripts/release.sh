#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes everything that a release holds, of the commit that is checked out, in build/release:
#   voxelpipe-VERSION.tar.gz                       the source archive (scripts/dist.sh --test)
#   *.whl, wheels-ARCH.txt                         wheels and what their tests said (scripts/wheels.sh)
#   voxelize-VERSION-linux-ARCH.tar.gz             the tool, as those wheels bring it, with its licences
#   voxelize-VERSION-windows-x86_64.zip            the tool for Windows, with its licences (scripts/windows.sh --check)
#   voxelpipe-VERSION-c-windows-x86_64.zip         the C API for Windows: header, DLL, its functions, MinGW's import library
#   voxelize-VERSION.html                          the page that converts models in the browser (scripts/page.sh --check)
#   voxelpipe-blender-VERSION.zip                  the Blender add-on with these wheels (scripts/blender.sh)
#   voxelpipe-VERSION-site.tar.gz                  the site (scripts/docs.sh --check)
#   recipes.tar.gz                                 vcpkg, Conan, Spack and conda, with the archive's hashes (packaging/fill.py)
#   NOTES.md                                       the changelog's section of this version
#   SHA256SUMS                                     of all of them
# docs/release.md says what a person then does with them.
#
#   scripts/release.sh [--repository URL] [--draft] [PART...]
#       --repository: where the archive will lie, for recipes and the site's links; without it there are no recipes
#       --draft: of files that differ from the commit, or of a version without a tag
#       PART: archive, wheels, arm, tool, windows, page, blender, site, recipes or notes; all by default, those before left as they are
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

all=(archive wheels arm tool windows page blender site recipes notes)
repository='' draft=0 parts=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --repository) repository=${2:?--repository needs a URL}; shift ;;
        --draft) draft=1 ;;
        -*) die "unknown option $1" ;;
        *)
            [[ " ${all[*]} " == *" $1 "* ]] || die "no part is called $1; there are ${all[*]}"
            parts+=("$1")
            ;;
    esac
    shift
done
[[ ${#parts[@]} -gt 0 ]] || parts=("${all[@]}")
need_packages git python3 zip unzip
version=$(scripts/version.py)
name=voxelpipe-$version
folder=$root/build/release
scripts/version.py --check
if [[ $draft -eq 0 ]]; then
    [[ -z $(git status --porcelain) ]] || die "files differ from the commit: commit them, or take --draft"
    [[ $(git describe --exact-match --tags HEAD 2>/dev/null) == "v$version" ]] || die "HEAD has no tag v$version: docs/release.md, or take --draft"
fi
mkdir -p "$folder"

wheel_of() { find "$folder" -maxdepth 1 -name "$name-*$1.whl" | sort | sed -n 1p; }
take_wheels() {
    rm -f "$folder/$name"-*"$1.whl"
    cp build/wheels/dist/"$name"-*"$1.whl" "$folder/"
    cp "build/wheels/dist/$1.txt" "$folder/wheels-$1.txt"
}

make_archive() {
    scripts/dist.sh --test
    cp "build/dist/$name.tar.gz" "$folder/"
}
make_wheels() {
    scripts/wheels.sh
    take_wheels x86_64
}
make_arm() {
    scripts/wheels.sh --arch aarch64
    take_wheels aarch64
}
make_tool() {
    local arch wheel packed made=0
    for arch in x86_64 aarch64; do
        wheel=$(wheel_of $arch)
        [[ -n $wheel ]] || continue
        packed=voxelize-$version-linux-$arch
        rm -rf "$folder/work"
        mkdir -p "$folder/work/$packed"
        unzip -q -j "$wheel" voxelpipe/bin/voxelize "*.dist-info/licenses/*" -d "$folder/work/$packed"
        chmod 755 "$folder/work/$packed/voxelize"
        cp docs/tool.md "$folder/work/$packed/"
        tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="$(git show -s --format=@%ct HEAD)" -C "$folder/work" -cf - "$packed" |
            gzip -9n >"$folder/$packed.tar.gz"
        [[ $arch != "$(uname -m)" ]] || "$folder/work/$packed/voxelize" --version
        made=1
    done
    rm -rf "$folder/work"
    [[ $made -eq 1 ]] || die "no wheel to take the tool from: scripts/release.sh wheels"
}
make_windows() {
    local packed=voxelize-$version-windows-x86_64 licenses file
    scripts/windows.sh --check --release
    rm -rf "$folder/work"
    licenses=$folder/work/$packed/licenses
    mkdir -p "$licenses"
    cp build/windows/tool/voxelize.exe docs/tool.md LICENSE "$folder/work/$packed/"
    # Of all that is linked into it, and of the compiler's own libraries.
    for file in build/windows_libraries/src/*/debian/copyright; do
        cp "$file" "$licenses/$(basename "${file%/debian/copyright}").txt"
    done
    for file in libglm-dev libtinygltf-dev nlohmann-json3-dev libstb-dev libcli11-dev mingw-w64-x86-64-dev gcc-mingw-w64-x86-64-posix-runtime; do
        cp -L "/usr/share/doc/$file/copyright" "$licenses/$file.txt"
    done
    x86_64-w64-mingw32-strip -p "$folder/work/$packed/voxelize.exe"
    zip_folder "$packed"

    packed=$name-c-windows-x86_64
    licenses=$folder/work/$packed/licenses
    mkdir -p "$licenses"
    cp capi/include/voxelpipe.h build/windows/capi/{voxelpipe.dll,voxelpipe.def,libvoxelpipe.dll.a} docs/c_api.md LICENSE "$folder/work/$packed/"
    for file in libglm-dev mingw-w64-x86-64-dev gcc-mingw-w64-x86-64-posix-runtime; do
        cp -L "/usr/share/doc/$file/copyright" "$licenses/$file.txt"
    done
    x86_64-w64-mingw32-strip -p "$folder/work/$packed/voxelpipe.dll"
    zip_folder "$packed"
}
# zip_folder NAME: packs the folder that a part has filled under this name, and removes it; the same files give the same archive.
zip_folder() {
    rm -f "$folder/$1.zip"
    find "$folder/work/$1" -exec touch -h -d "@$(git show -s --format=%ct HEAD)" {} +
    (cd "$folder/work" && find "$1" -type f | LC_ALL=C sort | TZ=UTC zip -q -X "$folder/$1.zip" -@)
    rm -rf "$folder/work"
}
make_page() {
    scripts/page.sh --check
    cp build/page/voxelize.html "$folder/voxelize-$version.html"
}
make_blender() {
    local wheels
    mapfile -t wheels < <(find "$folder" -maxdepth 1 -name "$name-*.whl" | sort)
    [[ ${#wheels[@]} -gt 0 ]] || die "no wheel for the add-on: scripts/release.sh wheels"
    scripts/blender.sh "${wheels[@]}"
    cp "build/blender/voxelpipe-blender-$version.zip" "$folder/"
}
make_site() {
    scripts/docs.sh --check ${repository:+--repository "$repository"}
    tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="$(git show -s --format=@%ct HEAD)" -C build/docs/html -cf - . | gzip -9n >"$folder/$name-site.tar.gz"
}
make_recipes() {
    if [[ -z $repository ]]; then
        printf 'not made: recipes, for want of --repository\n'
        return 0
    fi
    [[ -e $folder/$name.tar.gz ]] || die "no archive for the recipes: scripts/release.sh archive"
    rm -rf "$folder/recipes"
    packaging/fill.py --archive "$folder/$name.tar.gz" --repository "$repository" --out "$folder/recipes"
    tar --sort=name --owner=0 --group=0 --numeric-owner -C "$folder" -cf - recipes | gzip -9n >"$folder/recipes.tar.gz"
    rm -rf "$folder/recipes"
}
make_notes() {
    # Of the changelog, what stands between this version's heading and the next one.
    awk -v version="$version" '/^## / { on = $2 == version; next } on' CHANGELOG.md | sed -e '/./,$!d' >"$folder/NOTES.md"
    [[ -s $folder/NOTES.md ]] || die "CHANGELOG.md has no section of $version"
}

for part in "${parts[@]}"; do
    say "release: $part"
    "make_$part"
done
(cd "$folder" && rm -f SHA256SUMS && find . -maxdepth 1 -type f ! -name SHA256SUMS -printf '%f\n' | LC_ALL=C sort | xargs -d '\n' sha256sum >SHA256SUMS)
say "build/release"
cat "$folder/SHA256SUMS"
