# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The voxelize tool that the package brings: ``python -m voxelpipe model.glb -o model.vox``, and the command ``voxelize``."""

import os
import subprocess
import sys
from pathlib import Path


def main() -> None:
    """Becomes the tool, with the arguments of this program. Its output and its exit code are the tool's."""
    tool = Path(__file__).parent / "bin" / ("voxelize.exe" if os.name == "nt" else "voxelize")
    if not tool.is_file():
        sys.exit(f"voxelpipe was installed without the voxelize tool: there is no {tool}")
    sys.stdout.flush()
    if os.name == "nt":  # where exec returns to the shell before the program has ended
        sys.exit(subprocess.call([tool, *sys.argv[1:]]))
    os.execv(tool, ["voxelize", *sys.argv[1:]])


if __name__ == "__main__":
    main()
