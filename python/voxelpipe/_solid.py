# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from . import _core, _device
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import Mesh, as_mesh
from ._surface import listed_for, take_counts, words_for
from ._types import (
    Bodies,
    Extent,
    Fill,
    MeshLike,
    Repair,
    TensorMesh,
    check_call,
    check_choice,
    check_solid_numbers,
)


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


def refuse_grid_within(m: Any, grid: Grid, repair: str, bodies: str, closing: int, threads: int) -> None:
    """For results that have nothing inside: raises ValueError, as solid() does, where repair="exterior" flooded a grid that
    lies within the mesh."""
    if repair != "exterior":
        return
    try:
        _diagnose(m, grid, bodies, closing, threads)
    except MemoryError:  # nothing is known
        pass


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


def check_options(fill: Any, extent: Any, repair: Any, bodies: Any, max_hole_edges: Any, closing: Any) -> None:
    """Raises ValueError or TypeError that names the argument."""
    check_choice("fill", fill, Fill)
    check_choice("extent", extent, Extent)
    check_choice("repair", repair, Repair)
    check_choice("bodies", bodies, Bodies)
    check_solid_numbers(max_hole_edges, closing)


def solid_voxels(m: Any, grid: Grid, options: Any, as_tiles: bool,
                 threads: int) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:  # fmt: skip
    """Voxels, tiles (see tiles()) and counters of a solid. options: fill, extent, repair, bodies, max_hole_edges, closing."""
    if isinstance(m, DeviceMesh):
        raise TypeError("solids as lists are drawn on the CPU: copy the mesh to the host, as with .cpu() or .get()")
    check_options(*options)
    positions, where = m.positions(grid)
    voxels, tiles, counts = _core.solid_list(
        positions, m.triangles, list(m.first_triangles), where, *options, as_tiles, threads
    )
    if len(voxels) == 0 and len(tiles) == 0:
        refuse_grid_within(m, grid, options[2], options[3], options[5], threads)
    if counts["open_rows"] and options[2] in ("none", "close_holes", "winding"):
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} rows of voxels do not balance, and what lies behind a hole is in "
            "doubt; solid() tells which repairs help",
            OpenMeshWarning,
            stacklevel=3,
        )
    return voxels, tiles, counts


@overload
def solid(
    mesh: TensorMesh,
    grid: Grid,
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    packed: bool = False,
    threads: int = 0,
    diagnose: bool = True,
    status: dict[str, int] | None = None,
) -> Any: ...


@overload
def solid(
    mesh: MeshLike,
    grid: Grid,
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    packed: Literal[False] = False,
    threads: int = 0,
    diagnose: bool = True,
    status: dict[str, int] | None = None,
) -> npt.NDArray[np.bool_]: ...


@overload
def solid(
    mesh: MeshLike,
    grid: Grid,
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    packed: Literal[True],
    threads: int = 0,
    diagnose: bool = True,
    status: dict[str, int] | None = None,
) -> npt.NDArray[np.uint32]: ...


def solid(
    mesh: MeshLike,
    grid: Grid,
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    packed: bool = False,
    threads: int = 0,
    diagnose: bool = True,
    status: dict[str, int] | None = None,
) -> Any:
    """The inside of closed meshes, exactly: bool, (nz, ny, nx).

    The default extent is "outer", as in the voxelize tool: the inside and all that the surface touches, which is half a
    voxel too much all around. For a volume take extent="centre", which is the default of the C++ library.

    Args:
        mesh: what voxelize() takes. The meshes of a list, and the parts of a model, are bodies.
        grid: the Grid.
        fill: what the winding number w of a point says. "nonzero": inside where w != 0, so overlapping parts stay solid
            and inverted shells are cavities. "even_odd": inside where w is odd. "positive": inside where w > 0.
        extent: "outer", the voxels whose centre is inside, and those that a triangle touches; "centre" (or "center"), the
            former alone; "inner", those whose centre is inside and that no triangle touches.
        repair: "none"; "close_holes" puts a cone over each hole's boundary; "exterior" takes for inside what a flood from
            outside does not reach (fills cavities, no crops); "vote" takes the majority of rows along x, y and z. These two
            have an inside of their own: another fill or extent than the default is a ValueError. "winding" takes for
            inside where the generalized winding number, the solid angles of all triangles over 4 pi, is at least 1/2, with
            fill="nonzero" its magnitude: holes close smoothly. fill="even_odd" with it is a ValueError.
        bodies: "all", the meshes of a list together; "each", every one by itself.
        max_hole_edges: for close_holes and winding, holes with more edges stay open.
        closing: for exterior, gaps of up to about twice as many voxels are closed, 0 to 64.
        packed: uint32 (nz, ny, ceil(nx / 32)) in place of bool, a bit for each voxel, lowest bit first: an eighth of the
            memory. int32 for torch, the same bits. On the CPU only.
        threads: 0 takes all cores. The result is the same for any number.
        diagnose: whether an open mesh is examined, which takes some twenty bits a voxel and several times as long. For
            exterior: what its flood took. Otherwise, where rows prove that the mesh is open: which repairs help. Only
            those that were tried on this mesh and grid are named.
        status: a dict that is filled with the call's counters, among them open_rows, crossings and holes. For exterior
            also lost_voxels, which closed rows along x, y and z have inside and the flood took; enclosed_voxels, which it
            left and no triangle touches; where voxels are lost face_voxels, which it would not take in a grid that holds
            the mesh, entered_holes, by which it came in, the hole_width of the widest of them in voxels, the least
            tried_closing that keeps the voxels (0: none), and tried_close_holes, 1 if that does.

    Returns:
        An array, indexed [z, y, x]; of a mesh of torch's tensors a tensor. sparse(mesh, grid, solid="nonzero") is a list
        in its place.

    Warns with OpenMeshWarning where rows of voxels prove that the mesh is not closed, and where a flood took voxels of the
    inside. With exterior, a mesh that leaves the grid is flooded there, and a grid that lies within the mesh is a
    ValueError: the set would not be the crop of the whole's.

    Example:
        >>> inside = vp.solid(mesh, grid, extent="centre")
        >>> volume = inside.sum() * np.prod(grid.voxel_size)
    """
    check_call("solid", grid, "conservative", threads, status)
    check_options(fill, extent, repair, bodies, max_hole_edges, closing)
    m = as_mesh(mesh)
    if packed and isinstance(m, DeviceMesh):
        raise TypeError("packed solids are drawn on the CPU: copy the mesh to the host, as with .cpu() or .get()")

    def draw(repair: str, max_hole_edges: int | None = None) -> tuple[Any, dict[str, int]]:
        options = (fill, extent, repair, bodies, max_hole_edges, closing)
        if isinstance(m, DeviceMesh):
            return _device.solid(m, grid, options)
        positions, where = m.positions(grid)
        nz, ny, nx = grid.shape
        words = np.empty((nz, ny, (nx + 31) // 32), np.uint32) if packed else None
        mask = None if packed else np.empty(grid.shape, np.uint8)
        counts = _core.solid_dense(
            positions, m.triangles, list(m.first_triangles), where, *options, mask, words, threads
        )
        return words_for(m, words) if words is not None else m.to_caller(mask.view(np.bool_)), counts

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
    if counts["open_rows"] and repair in ("none", "close_holes", "winding"):
        rows = grid.shape[0] * grid.shape[1]
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} of {rows} rows of voxels do not balance, and what lies "
            "behind a hole is in doubt"
            + (_advice(lambda r: draw(r)[1], m, grid, repair, bodies, threads) if diagnose else ""),
            OpenMeshWarning,
            stacklevel=2,
        )
    return result


def tiles(
    mesh: MeshLike,
    grid: Grid,
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """The inside of closed meshes as voxels and cubes of voxels: memory in proportion to the surface, where a list has all
    voxels of the inside.

    Args:
        mesh, grid, fill, extent, repair, bodies, max_hole_edges, closing, threads, status: as in solid().

    Returns:
        Voxels and cubes. The voxels are a VoxelList (n, 3) int32, columns x, y, z. The cubes are (m, 4) int32, the first
        voxel of each (x, y, z) and its side, 8, 16, 32 and so on; all of its voxels are inside, and none is in the list.

    Example:
        >>> voxels, cubes = vp.tiles(mesh, vp.fit(mesh, 4096))
        >>> number = len(voxels) + (cubes[:, 3].astype(np.int64) ** 3).sum()
    """
    check_call("tiles", grid, "conservative", threads, status)
    m = as_mesh(mesh)
    options = (fill, extent, repair, bodies, max_hole_edges, closing)
    voxels, cubes, counts = solid_voxels(m, grid, options, True, threads)
    take_counts(counts, status)
    assert isinstance(m, Mesh)
    return listed_for(m, voxels), m.to_caller(cubes)
