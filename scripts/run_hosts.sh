#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs a command beside 2 to 4 hosts that this machine makes of namespaces. A host has a network interface, a host name,
# processes, System V memory and message queues, /dev/shm, /tmp, /var/tmp and /run of its own. Hosts see the machine's
# other files, as a folder that all of them mount. Only TCP joins them. They share the machine's processors and memory.
# Needs root, and iproute2 and util-linux.
#
#   scripts/run_hosts.sh 3 mpiexec -n 6 PROGRAM              MPICH's mpiexec starts two ranks on each host
#   scripts/run_hosts.sh 2 --rate 100mbit mpiexec -n 2 PROGRAM   each host sends and receives 100 Mbit/s at most (tc tbf)
#   scripts/run_hosts.sh 2 bash -c 'on_host host2 hostname'  on_host HOST COMMAND... runs a command on one host
#   scripts/run_hosts.sh --check                             exit status 0 if the system allows all this
#
# The command itself runs on none of the hosts, but where it reaches them and sees their processes (/run/hosts/HOST.pid:
# the first one, without which the host is gone) and interfaces (/proc/net/dev: host1, host2, ..., seen from the other
# end). Its exit status is that of the script. At the end the script prints to standard error how many bytes each host
# has sent and received, frames included.
#
# Nothing stays behind, however the script ends: all is made within namespaces that are gone with their processes, and
# these are killed when the script ends or is killed.
set -euo pipefail

usage() {
    sed -n '/^# *scripts/s/^# *//p' "${BASH_SOURCE[0]}" >&2
    exit 2
}
# The new namespaces of a host, and of what is around all hosts; the first process in them, and with it all others, ends
# with unshare.
namespaces=(--net --uts --ipc --mount --pid --fork --mount-proc --kill-child)

case ${1:-} in
    --check)
        [[ $(id -u) -eq 0 ]] && command -v ip unshare nsenter setpriv tc >/dev/null || exit 1
        exec unshare "${namespaces[@]}" bash -c 'mount -t tmpfs none /run && ip link add name bridge0 type bridge &&
            ip link add name a type veth peer name b' >/dev/null 2>&1
        ;;
    --around) ;; # called by itself, below
    *)
        [[ ${1:-} =~ ^[2-4]$ && $# -ge 2 ]] || usage
        [[ $2 != --rate || $# -ge 4 ]] || usage
        [[ $(id -u) -eq 0 ]] || { echo "run_hosts.sh: only root may make hosts" >&2; exit 1; }
        # A signal ends this script, and with it the process below, of which nobody else knows.
        setpriv --pdeathsig KILL unshare "${namespaces[@]}" "${BASH_SOURCE[0]}" --around "$@" &
        child=$!
        trap 'kill -KILL $child 2>/dev/null; exit 143' INT TERM HUP
        wait $child
        exit
        ;;
esac

hosts=$2 rate=""
shift 2
if [[ $1 == --rate ]]; then
    rate=$2
    shift 2
fi
mount -t tmpfs none /run
mkdir /run/hosts
echo 127.0.0.1 localhost >/run/hosts/hosts
for ((h = 0; h <= hosts; ++h)); do echo "10.77.0.$((h + 1)) host$h" >>/run/hosts/hosts; done
mount --bind /run/hosts/hosts /etc/hosts
mount --make-rprivate /
mount -t sysfs none /sys # which shows the interfaces of who mounts it

# As host0, on the bridge that joins all.
hostname host0
ip link set lo up
ip link add name bridge0 type bridge
ip address add 10.77.0.1/24 dev bridge0
ip link set bridge0 up

# limit DEVICE COMMAND...: what the device sends; COMMAND runs tc where it lies. The queue holds 20 ms.
limit() {
    local device=$1
    shift
    [[ -z $rate ]] || "$@" tc qdisc add dev "$device" root tbf rate "$rate" burst 256kb latency 20ms
}
cat >/run/hosts/on_host <<'END'
#!/bin/sh
# on_host HOST COMMAND...; as the launcher of mpiexec, in place of ssh: on_host -x HOST TEXT...
if [ "$1" = -x ]; then shift; name=$1; shift; set -- "$name" sh -c "$*"; fi
name=$1
shift
exec nsenter --target "$(cat "/run/hosts/$name.pid")" --all --wd="$PWD" "$@"
END
chmod +x /run/hosts/on_host
for ((h = 1; h <= hosts; ++h)); do
    # shellcheck disable=SC2016
    unshare "${namespaces[@]}" sh -c 'hostname "$0"
        mount -t sysfs none /sys
        for folder in /dev/shm /run /tmp /var/tmp; do mount -t tmpfs none $folder; done
        exec sleep infinity' host$h 2>/dev/null &
    for ((i = 0; i < 500; ++i)); do
        pid=$(cat /proc/$!/task/$!/children)
        if [[ -n $pid && $(cat "/proc/${pid% }/comm") == sleep ]]; then break; fi
        sleep 0.01
    done
    echo "${pid% }" >/run/hosts/host$h.pid
    ip link add name host$h type veth peer name eth0 netns "${pid% }"
    ip link set host$h master bridge0 up
    for command in "address add 10.77.0.$((h + 1))/24 dev eth0" "link set eth0 up" "link set lo up"; do
        # shellcheck disable=SC2086
        /run/hosts/on_host host$h ip $command
    done
    limit host$h env
    limit eth0 /run/hosts/on_host host$h
    echo host$h >>/run/hosts/names
done

export PATH=/run/hosts:$PATH HYDRA_LAUNCHER=ssh HYDRA_LAUNCHER_EXEC=/run/hosts/on_host HYDRA_HOST_FILE=/run/hosts/names
status=0
"$@" || status=$?
while read -r name received _ _ _ _ _ _ _ sent _; do
    [[ $name != host* ]] || echo "$name sent $received bytes, received $sent" >&2
done < <(sort /proc/net/dev)
exit $status
