#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What runs over hosts joined by nothing but TCP and a folder: scripts/run_hosts.sh N hosts_test.py TEST FOLDER PROGRAM..."""

import filecmp
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

HOSTS = pathlib.Path("/run/hosts/names").read_text().split()
WITHOUT_HOSTS = {k: v for k, v in os.environ.items() if not k.startswith("HYDRA")}


def sent():
    """Bytes that each host has sent so far."""
    lines = pathlib.Path("/proc/net/dev").read_text().splitlines()
    counters = {line.split(":")[0].strip(): line.split(":")[1].split() for line in lines if ":" in line}
    return [int(counters[host][0]) for host in HOSTS]


def run(*command, check=True, **how):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=240, **how)
    if check and done.returncode != 0:
        sys.exit(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def run_ranks(program, last_line, **how):
    """A program of MPI, a rank on each host. It has done its work when it has printed its last line; MPICH 4.0.2 may wait
    for ever in MPI_Finalize after that, over UCX and TCP (github.com/pmodels/mpich, pull request 6596)."""
    with open(how["cwd"] / "output", "w+") as output:
        job = subprocess.Popen(["mpiexec", "-n", str(len(HOSTS)), str(program)], stdin=subprocess.DEVNULL, stdout=output,
                               stderr=subprocess.STDOUT, **how)
        end = time.monotonic() + 240
        patience = None
        while job.poll() is None and time.monotonic() < (patience or end):
            time.sleep(0.05)
            if patience is None and last_line in pathlib.Path(output.name).read_text():
                patience = time.monotonic() + 5
        text = pathlib.Path(output.name).read_text()
        expect(last_line in text, f"{program} ends with {last_line}:\n{text}")
        if job.poll() is None:
            print("note: MPI_Finalize of this MPICH did not return")
            job.kill()
            for processes in processes_of(program).values():
                for number, _ in processes:
                    os.kill(number, signal.SIGKILL)
            job.wait()
        else:
            expect(job.returncode == 0, f"{program}: {job.returncode}\n{text}")


def expect(holds, what):
    if not holds:
        sys.exit("failed: " + what)


def processes_of(program):
    """Numbers of the processes that run a program, by host: as seen from here, and as the host's processes see them."""
    found = {}
    spaces = {os.stat(f"/proc/{pathlib.Path(f'/run/hosts/{h}.pid').read_text().strip()}/ns/pid").st_ino: h for h in HOSTS
              if os.path.exists(f"/proc/{pathlib.Path(f'/run/hosts/{h}.pid').read_text().strip()}")}
    for entry in pathlib.Path("/proc").iterdir():
        try:
            if not entry.name.isdigit() or os.readlink(entry / "exe") != str(program):
                continue
            host = spaces.get(os.stat(entry / "ns/pid").st_ino)
            own = re.search(r"NSpid:.*\s(\d+)\n", (entry / "status").read_text()).group(1)
            found.setdefault(host, []).append((int(entry.name), int(own)))
        except (FileNotFoundError, ProcessLookupError):
            pass  # it has ended
    return found


def same_folders(a, b):
    files = {p.relative_to(a) for p in a.rglob("*") if p.is_file()}
    expect(files == {p.relative_to(b) for p in b.rglob("*") if p.is_file()}, f"{a} and {b} have the same files")
    expect(len(files) > 4, f"{a} has files")
    for f in files:
        expect(filecmp.cmp(a / f, b / f, shallow=False), f"{f} is the same in {a} and {b}")


def test_apart(folder):
    """Nothing but the network and files joins the hosts."""
    names = [run("on_host", h, "hostname").stdout.strip() for h in HOSTS]
    expect(names == HOSTS, f"host names {names}")
    for place in "/tmp", "/var/tmp", "/dev/shm", "/run":
        run("on_host", HOSTS[0], "touch", f"{place}/mine")
        for other in HOSTS[1:]:
            expect(run("on_host", other, "test", "-e", f"{place}/mine", check=False).returncode == 1, f"{place} of {other}")
    for kind in "net", "uts", "ipc", "mnt", "pid":
        spaces = {run("on_host", h, "readlink", f"/proc/self/ns/{kind}").stdout for h in HOSTS}
        expect(len(spaces) == len(HOSTS), f"namespaces {kind}")
    folder.joinpath("shared").write_text("all")
    expect(run("on_host", HOSTS[1], "cat", folder / "shared").stdout == "all", "the folder that all see")


def test_sample(folder, sample):
    """15_ranks: the file of one rank, and its triangles go over the network."""
    run("mpiexec", "-n", 1, sample, cwd=folder, env=WITHOUT_HOSTS)
    folder.joinpath("spheres.raw").rename(folder / "one.raw")
    before = sent()
    run_ranks(sample, "ok: 1600000 triangles", cwd=folder)
    bytes_sent = [b - a for a, b in zip(before, sent())]
    expect(filecmp.cmp(folder / "spheres.raw", folder / "one.raw", shallow=False), "spheres.raw is that of one rank")
    # 1.6 million triangles of 40 bytes; an arc of the ring may stay with the rank that made it.
    print("bytes sent:", *bytes_sent)
    expect(sum(bytes_sent) > 0.3 * 40 * 1.6e6, f"triangles go over the network: {bytes_sent}")


def test_mpi(folder, program):
    """slabs_mpi_test with a rank on each host."""
    before = sent()
    run_ranks(program, "all ranks passed", cwd=folder)
    bytes_sent = [b - a for a, b in zip(before, sent())]
    print("bytes sent:", *bytes_sent)
    expect(min(bytes_sent) > 300_000, f"ranks send what they share over the network: {bytes_sent}")


def write_tower(path, floors):
    """A tower of triangles along z that turns as it rises."""
    lines = ["solid tower"]
    corner = lambda f, s: (50 + 50 * math.cos(math.tau * s / 8 + 0.05 * f), 50 + 50 * math.sin(math.tau * s / 8 + 0.05 * f), 10 * f)
    for f in range(floors):
        for s in range(8):
            a, b, c, d = corner(f, s), corner(f, s + 1), corner(f + 1, s), corner(f + 1, s + 1)
            for t in (a, b, c), (b, d, c):
                lines.append("facet normal 0 0 0\nouter loop\n" + "\n".join("vertex %g %g %g" % v for v in t) + "\nendloop\nendfacet")
    path.write_text("\n".join(lines + ["endsolid tower\n"]))


def test_tool(folder, voxelize):
    """One model by processes of several hosts: as one process draws it; killed and resumed, a process or a whole host."""
    write_tower(folder / "m.stl", 1024)  # 40 slabs
    draw = [voxelize, folder / "m.stl", "-r", "10240", "-t", "occupancy,count", "--sparse", "-j", "1", "-o"]
    run(*draw, folder / "whole.zarr", env=WITHOUT_HOSTS)
    run("mpiexec", "-n", len(HOSTS), *draw, folder / "ranks.zarr")
    same_folders(folder / "whole.zarr", folder / "ranks.zarr")
    expect(not list(folder.glob("*.slabs")), "no folder of slabs is left")

    out = folder / "killed.zarr"
    marks = lambda: len(list(folder.glob("killed.zarr.*.slabs/done.*[0-9]")))
    equal_numbers = False
    for least, whole_host in (1, False), (8, True):
        job = subprocess.Popen([str(c) for c in ["mpiexec", "-n", len(HOSTS), *draw, out, "--resume"]],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + 60
        while marks() < least and time.monotonic() < end:
            pass
        running = processes_of(voxelize)
        expect(HOSTS[1] in running, f"it did not end before: {running}")
        equal_numbers |= len({own for processes in running.values() for _, own in processes}) < sum(map(len, running.values()))
        number = running[HOSTS[1]][0][0]
        if whole_host:
            number = int(pathlib.Path(f"/run/hosts/{HOSTS[1]}.pid").read_text())
        os.kill(number, signal.SIGKILL)
        job.wait(60) if not whole_host else time.sleep(1)
        if whole_host:
            # mpiexec sees that a host is gone only when it hears from it; the others have drawn their shares.
            expect(not processes_of(voxelize), "the other hosts' processes have ended")
            job.kill()
            job.wait(60)
        done = marks()
        expect(least <= done < 40 and not out.exists(), f"{done} slabs are done, and there is no output")
    expect(equal_numbers, "processes of two hosts had equal numbers")
    left = ",".join([HOSTS[0]] + HOSTS[2:])
    rest = run("mpiexec", "-hosts", left, "-n", len(HOSTS) - 1, *draw, out, "--resume", env=dict(os.environ, HYDRA_HOST_FILE=""))
    drawn = sum(int(n) for n in re.findall(r"drew (\d+) of 40 slabs", rest.stderr))
    expect(drawn == 40 - done, f"drew {drawn} of the {40 - done} slabs that were left\n{rest.stderr}")
    same_folders(folder / "whole.zarr", out)
    expect(not list(folder.glob("*.slabs")), "no folder of slabs is left")


def test_list(folder, voxelize):
    """A list of models, shared by hosts, with one that cannot be read."""
    for n in range(7):
        write_tower(folder / f"m{n}.stl", 3 + n)
    folder.joinpath("bad.stl").write_text("solid of nothing")
    folder.joinpath("list").write_text("".join(f"{folder}/{n}.stl\n" for n in [*(f"m{n}" for n in range(7)), "bad"]))
    draw = [voxelize, "--list", folder / "list", "-r", "64", "-o"]
    run(*draw, folder / "one/{name}.npy", env=WITHOUT_HOSTS, check=False)
    for _ in "first", "again":
        done = run("mpiexec", "-n", len(HOSTS), *draw, folder / "ranks/{name}.npy", check=False)
        expect(done.returncode != 0 and "bad.stl" in done.stderr, f"a model that cannot be read: {done}")
    expect(sum(map(int, re.findall(r"(\d+) were finished", done.stdout))) == 7, f"finished models are left out: {done.stdout}")
    for n in range(7):
        expect(filecmp.cmp(folder / f"one/m{n}.npy", folder / f"ranks/m{n}.npy", shallow=False), f"m{n}.npy")
    expect(len(list(folder.glob("ranks/manifest.*.jsonl"))) == len(HOSTS), "a manifest for each rank")


if __name__ == "__main__":
    work = pathlib.Path(sys.argv[2])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    globals()["test_" + sys.argv[1]](work, *(pathlib.Path(p).resolve() for p in sys.argv[3:]))
    shutil.rmtree(work)
    print("ok")
