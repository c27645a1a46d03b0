# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from . import _core, _device
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import MeshLike, as_mesh
from ._surface import take_counts


class OpenMeshWarning(UserWarning):
    """The mesh is not closed: part of what lies behind its holes is in doubt, or was lost to a flood."""


def _diagnose(m: Any, grid: Grid, bodies: str, closing: int, threads: int) -> dict[str, int]:
    """What the flood of repair="exterior" does. Raises ValueError for a grid that lies within the mesh."""
    if isinstance(m, DeviceMesh):
        return _device.diagnose_repair(m, grid, bodies, closing)
    positions, where = m.positions(grid)
    return _core.diagnose_repair(
        positions, m.triangles, list(m.first_triangles), where, bodies, closing, threads
    )


def _entry(flood: dict[str, int]) -> str:
    """Where the flood came in."""
    entries = []
    if flood["entered_holes"]:
        holes = "hole" if flood["entered_holes"] == 1 else "holes"
        entries.append(f'by {flood["entered_holes"]} {holes} of the mesh, of up to {flood["hole_width"]} voxels')
    if flood["face_voxels"]:
        entries.append(f'where the mesh leaves the grid ({flood["face_voxels"]} voxels: take a grid that holds it)')
    return " and ".join(entries) or "where no hole was found"


def _keeping(flood: dict[str, int]) -> list[str]:
    """The repairs that were tried on the mesh, and keep what the flood took."""
    tried = ['repair="close_holes"'] if flood["tried_close_holes"] else []
    if flood["tried_closing"]:
        tried.append(f'closing={flood["tried_closing"]}')
    return tried


def _advice(draw: Any, m: Any, grid: Grid, repair: str, bodies: str, threads: int) -> str:
    """Names the repairs of an open mesh that help, each of which is tried. draw(repair): the counters of that call."""
    helps = []
    try:
        if draw("close_holes")["open_rows"] == 0:
            without = " without max_hole_edges" if repair == "close_holes" else ""
            helps.append(f'repair="close_holes"{without} leaves no such row')
        flood = _diagnose(m, grid, bodies, 0, threads)
        if flood["lost_voxels"]:
            flood = dict(flood, enclosed_voxels=flood["tried_closing"])
        if flood["enclosed_voxels"]:
            closing = f', closing={flood["tried_closing"]}' if flood["tried_closing"] else ""
            helps.append(f'repair="exterior"{closing} keeps what its other rows have inside')
    except (MemoryError, ValueError):  # too large, or the grid lies within the mesh
        pass
    return "; tried on it: " + ", and ".join(helps) if helps else "; no repair that was tried helps"


def solid(
    mesh: MeshLike,
    grid: Grid,
    fill: str = "nonzero",
    *,
    extent: str = "outer",
    repair: str = "none",
    bodies: str = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    threads: int = 0,
    diagnose: bool = True,
    status: dict[str, int] | None = None,
) -> Any:
    """The inside of closed meshes, exactly: bool, (nz, ny, nx).

    fill: what the winding number w of a point says. "nonzero": inside where w != 0, so overlapping parts stay solid and
        inverted shells are cavities. "even_odd": inside where w is odd. "positive": inside where w > 0.
    extent: "outer", the voxels whose centre is inside, and those that a triangle touches; "centre", the former alone;
        "inner", those whose centre is inside and that no triangle touches.
    repair: "none"; "close_holes" puts a cone over each hole's boundary; "exterior" takes for inside what a flood from
        outside does not reach (fills cavities, no crops); "vote" takes the majority of rows along x, y and z. The last
        two have an inside of their own: another fill or extent than the default is a ValueError.
    bodies: "all", the meshes of a list together; "each", every mesh of a list by itself.
    max_hole_edges: for close_holes, holes with more edges stay open.
    closing: for exterior, gaps of up to about twice as many voxels are closed, 0 to 64.
    diagnose: whether an open mesh is examined, which takes some twenty bits a voxel and several times as long. For
        exterior: what its flood took. Otherwise, where rows prove that the mesh is open: which repairs help. Only those
        that were tried on this mesh and grid are named.
    status: a dict that is filled with the call's counters, among them open_rows, crossings and holes. For exterior also
        lost_voxels, which closed rows along x, y and z have inside and the flood took; enclosed_voxels, which it left and
        no triangle touches; where voxels are lost face_voxels, which it would not take in a grid that holds the mesh,
        entered_holes, by which it came in, the hole_width of the widest of
        them in voxels, the least tried_closing that keeps the voxels (0: none), and tried_close_holes, 1 if that
        does.

    Warns with OpenMeshWarning where rows of voxels prove that the mesh is not closed, and where a flood took voxels of the
    inside. With exterior, a mesh that leaves the grid is flooded there, and a grid that lies within the mesh is a
    ValueError: the set would not be the crop of the whole's.
    """
    m = as_mesh(mesh)

    def draw(repair: str, max_hole_edges: int | None = None) -> tuple[Any, dict[str, int]]:
        options = (fill, extent, repair, bodies, max_hole_edges, closing)
        if isinstance(m, DeviceMesh):
            return _device.solid(m, grid, options)
        positions, where = m.positions(grid)
        out = np.empty(grid.shape, np.uint8)
        counts = _core.solid_mask(
            positions, m.triangles, list(m.first_triangles), where, *options, out, threads
        )
        return m.to_caller(out.view(np.bool_)), counts

    result, counts = draw(repair, max_hole_edges)
    flood = {}
    if diagnose and repair == "exterior":
        try:
            flood = _diagnose(m, grid, bodies, closing, threads)
        except MemoryError:  # the solid is there, and nothing is known of it
            pass
    take_counts({**counts, **flood}, status)
    if flood.get("lost_voxels"):
        keeping = _keeping(flood)
        warnings.warn(
            f'the flood of repair="exterior" took {flood["lost_voxels"]} voxels that other rows of voxels have inside. '
            f"It came in {_entry(flood)}; "
            + ("tried on it: " + " or ".join(keeping) + " keeps them" if keeping else "no repair that was tried keeps them"),
            OpenMeshWarning,
            stacklevel=2,
        )
    if counts["open_rows"] and repair in ("none", "close_holes"):
        rows = grid.shape[0] * grid.shape[1]
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} of {rows} rows of voxels do not balance, and what lies "
            "behind a hole is in doubt"
            + (_advice(lambda r: draw(r)[1], m, grid, repair, bodies, threads) if diagnose else ""),
            OpenMeshWarning,
            stacklevel=2,
        )
    return result
