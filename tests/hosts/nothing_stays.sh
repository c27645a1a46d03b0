#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# scripts/run_hosts.sh leaves no process, interface or mount behind: when it ends, when its command fails, and when it is
# killed, by SIGTERM and by SIGKILL.
set -euo pipefail
run="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/scripts/run_hosts.sh"
sleep_seconds=$((100000 + $$)) # tells its processes from others

state() {
    tail -n +3 /proc/net/dev | sed 's/:.*//'
    wc -l </proc/self/mountinfo
    hostname
    pgrep -cf "^sleep $sleep_seconds" || true
    ls /run
}
before=$(state)
expect_nothing() {
    local i
    for ((i = 0; i < 50; ++i)); do
        [[ $(state) != "$before" ]] || return 0
        sleep 0.1
    done
    printf 'failed: after %s something stays\nbefore:\n%s\nafter:\n%s\n' "$1" "$before" "$(state)"
    exit 1
}

"$run" 2 true 2>/dev/null
expect_nothing "its end"
status=0
"$run" 2 bash -c 'exit 7' 2>/dev/null || status=$?
[[ $status -eq 7 ]] || { echo "failed: the status is $status"; exit 1; }
expect_nothing "a failure"
for signal in TERM KILL; do
    "$run" 3 on_host host2 sleep $sleep_seconds 2>/dev/null &
    child=$!
    for ((i = 0; i < 50; ++i)); do
        if pgrep -f "^sleep $sleep_seconds" >/dev/null; then break; fi
        sleep 0.1
    done
    pgrep -f "^sleep $sleep_seconds" >/dev/null || { echo "failed: the command has not begun"; exit 1; }
    kill -$signal $child
    wait $child 2>/dev/null || true
    expect_nothing "SIG$signal"
done
echo ok
