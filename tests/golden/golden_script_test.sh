#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# golden_script_test.sh: what scripts/golden.sh has to refuse, with 1 and by name, and what it prints. In place of
# golden_hashes and of the tool it is given programs of a few lines.
set -euo pipefail
script="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/scripts/golden.sh"
folder=$(mktemp -d "${TMPDIR:-/tmp}/voxelpipe-golden-test.XXXXXX")
trap 'rm -rf "$folder"' EXIT
cd "$folder"

mkdir -p build/tests/golden build/tool
cat >build/tests/golden/golden_hashes <<'PROGRAM'
#!/usr/bin/env bash
case $1 in
--list) printf '%s\n' b.one a.two c.three ;;
--write-model) ;;
--file) printf '%s %016d\n' "$2" "$(cat "$3"/* | wc -c)" ;;
*)
    shift 2 # --threads N
    for name in b.one a.two c.three; do
        [[ $# -ne 0 && " $* " != *" $name "* ]] || printf '%s %s\n' "$name" "00000000000000${#name}${name:0:1}"
    done
    ;;
esac
PROGRAM
# Writes as many bytes as it has arguments, so that options count.
cat >build/tool/voxelize <<'PROGRAM'
#!/usr/bin/env bash
printf '%*s' $# '' >"$3"
PROGRAM
printf '#!/usr/bin/env bash\necho "$1" >>%q/started.txt\nexec "$@"\n' "$folder" >runner
chmod +x build/tests/golden/golden_hashes build/tool/voxelize runner

failures=0
# expect CODE TEXT WORDS...: golden.sh WORDS ends with CODE, and its output has TEXT.
# Without the tool's files, which are many, unless `with=` is set.
expect() {
    local code=$1 text=$2 status=0
    shift 2
    "$script" --build build --hashes hashes.txt ${with---library} "$@" >output.txt 2>&1 || status=$?
    if [[ $status -ne $code ]] || ! grep -qF -- "$text" output.txt; then
        printf 'golden.sh %s: %s, not %s with "%s":\n' "$*" "$status" "$code" "$text"
        sed -n 1,20p output.txt
        failures=$((failures + 1))
    fi
}

# also TEXT: that output has TEXT too.
also() {
    grep -qF -- "$1" output.txt && return
    printf 'the output above has no "%s"\n' "$1"
    failures=$((failures + 1))
}
# holds COMMAND...: it ends with 0.
holds() {
    "$@" && return
    printf 'failed: %s\n' "$*"
    failures=$((failures + 1))
}

expect 1 'hashes.txt is missing'
with= expect 0 'hashes written' --update
cp hashes.txt right.txt
expect 0 'a.two 000000000000005a'
# Sorted, name and hash, one a line, and nothing else on standard output.
grep -v '^#' hashes.txt >lines.txt
"$script" --build build --hashes hashes.txt --library 2>messages.txt >library.txt
holds cmp library.txt <(grep -E '^[abc]\.' lines.txt)
holds env LC_ALL=C sort -c lines.txt
holds test "$(grep -cvE '^[a-zA-Z0-9_.-]+ [0-9a-f]{16}$' lines.txt)" -eq 0

# A hash that differs, of the library and of a file; one that is missing; and one of no case.
sed 's/^b\.one .*/b.one 0123456789abcdef/; s/^file\.npz .*/file.npz 0123456789abcdef/; /^c\.three/d' right.txt >hashes.txt
echo 'z.gone 0123456789abcdef' >>hashes.txt
with= expect 1 'b.one: 000000000000005b differs from 0123456789abcdef'
also 'file.npz: '
also 'c.three: '
also 'z.gone: '
also ' 4 problems'
cp right.txt hashes.txt
: >hashes_empty.txt
expect 1 'a.two: ' --hashes hashes_empty.txt
expect 1 'no-such-file.txt is missing' --hashes no-such-file.txt

expect 1 'the runner no-such-runner is not there' no-such-runner
expect 1 'the runner ./hashes.txt is not there' ./hashes.txt
with= expect 0 ' 0 problems' --every 20 ./runner
# Every program goes through the runner.
for program in golden_hashes voxelize; do
    grep -q "/$program\$" started.txt || {
        printf 'the runner was not given %s\n' "$program"
        failures=$((failures + 1))
    }
done
expect 1 'no-such-build/tests/golden/golden_hashes is not there' --build no-such-build
expect 1 'golden.sh has no option --fast' --fast
expect 1 'takes a number' --every none
with= expect 1 'does not go with' --update --every 3

# A share of the cases: every tenth one, from the first.
"$script" --build build --hashes hashes.txt --every 10 2>messages.txt >share.txt || cat messages.txt
holds cmp share.txt <(awk 'NR % 10 == 1' lines.txt)

# A program that fails, whatever it has printed, is a failure with its name.
printf 'exit 3\n' >>build/tests/golden/golden_hashes
expect 1 'golden_hashes has failed'
sed -i '$d' build/tests/golden/golden_hashes
printf 'echo "no memory"\nexit 3\n' >>build/tool/voxelize
with= expect 1 ': the tool has failed: no memory' --every 20

[[ $failures -eq 0 ]]
