# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""ParaView opens what in_pyvista.py wrote to a folder: a .vti, and the same in pieces. Code of docs/tool.md.

pvpython in_paraview.py FOLDER, or python3 where it finds ParaView's modules.
"""

import pathlib
import sys

from paraview.simple import OpenDataFile, Threshold, servermanager

folder = pathlib.Path(sys.argv[1])

# snippet: paraview
image = OpenDataFile(str(folder / "doughnut.vti"))
body = Threshold(Input=image, Scalars=["CELLS", "fraction"])  # the voxels that are at least half inside
body.ThresholdMethod, body.UpperThreshold = "Above Upper Threshold", 0.5
# end snippet


def cells(source):
    source.UpdatePipeline()
    return source.GetDataInformation().GetNumberOfCells()


pieces = OpenDataFile(str(folder / "pieces.pvti"))
assert cells(image) == cells(pieces) > cells(body) > 10_000
for source in (image, pieces):
    assert source.CellData.GetArray("fraction").GetRange() == (0, 1)
version = f"{servermanager.vtkSMProxyManager.GetVersionMajor()}.{servermanager.vtkSMProxyManager.GetVersionMinor()}"
print(f"ParaView {version}: {cells(image)} cells, in pieces as many, {cells(body)} at least half inside")
