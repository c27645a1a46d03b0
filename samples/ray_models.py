#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Voxelizes many models with Ray Data (PyPI: "ray[data]"), on one machine or on a cluster whose nodes share the folders.

    ray_models.py models.txt out -- -r 256 -t occupancy,color

A task a model runs the tool on one core; Ray does the rest: workers, retries, machines. Prints a JSON line a model, in the order
of the list. One bad model stops nothing; the exit status is 2 if there was one. $VOXELIZE names the tool, $RAY_CPUS how many
models are drawn at a time on a machine without a cluster.
"""
import json
import os
import pathlib
import subprocess
import sys

import ray


def voxelize(row):
    command = [row["tool"], row["model"], "-o", row["output"], "-j", "1", "-q", "--stats=json", *json.loads(row["options"])]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    stats = json.loads(done.stdout) if done.returncode == 0 else {}
    return {"number": row["number"], "model": row["model"], "output": row["output"], "exit_code": done.returncode,
            "voxels": stats.get("voxels", 0), "error": done.stderr.strip()}


def main():
    models = [line for line in pathlib.Path(sys.argv[1]).read_text().splitlines() if line and not line.startswith("#")]
    out = pathlib.Path(sys.argv[2]).resolve()
    options = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    out.mkdir(parents=True, exist_ok=True)
    cpus = os.environ.get("RAY_CPUS")
    ray.init(num_cpus=int(cpus) if cpus else None, include_dashboard=False, log_to_driver=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    rows = [{"number": i, "model": str(pathlib.Path(model).resolve()), "output": str(out / f"{i:06}_{pathlib.Path(model).stem}.npz"),
             "tool": os.environ.get("VOXELIZE", "voxelize"), "options": json.dumps(options)} for i, model in enumerate(models)]
    results = ray.data.from_items(rows).map(voxelize, num_cpus=1).take_all()
    for result in sorted(results, key=lambda r: r["number"]):
        print(json.dumps(result))
    sys.exit(2 if any(r["exit_code"] != 0 for r in results) else 0)


if __name__ == "__main__":
    main()
