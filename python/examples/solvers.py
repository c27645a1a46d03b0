# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What solvers read: flags and lengths of links of a lattice, densities of materials that share voxels. Code of docs/solvers.md."""

import numpy as np
import voxelpipe as vp


def ball(centre, radius, rings=40):
    """A sphere of quads, cut into triangles; its vertices lie on it."""
    polar, around = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    points = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    points[0], points[-1] = (0, 0, 1), (0, 0, -1)  # the poles, exactly
    here = np.arange(points.size // 3).reshape(rings + 1, 2 * rings)
    right = np.roll(here, -1, axis=1)
    halves = (here[:-1], here[1:], right[1:]), (here[:-1], right[1:], right[:-1])
    vertices = np.array(centre) + radius * points.reshape(-1, 3)
    return vertices, np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in halves])


body = ball((0.1, 0.2, -0.1), 3.0)
grid = vp.Grid(origin=(-4, -4, -4), voxel_size=(0.25, 0.25, 0.25), shape=(32, 32, 32))

# snippet: lattice
is_wall = vp.solid(body, grid, extent="centre")  # at the nodes, the voxels' centres
walls = vp.links(body, grid, 18)  # a row for each node that has a crossed link; -1 where a link is not crossed
row, link = (walls.q > 0).nonzero()  # the crossed links of all these nodes
node, beyond = walls.voxels[row], walls.voxels[row] + walls.directions[link]  # x, y, z of their ends
in_fluid = ~is_wall[grid.zyx(node)]
q = walls.q[row, link][in_fluid]  # how much of the link lies in the fluid, above 0 to 1
opposite = link[in_fluid] ^ 1  # the link that what is bounced back leaves by
# end snippet

# All links out of the fluid into the wall are listed, and cross where the ball does but for the polyhedron's depth.
directions = walls.directions
assert np.array_equal(directions[opposite], -directions[link[in_fluid]])
inside = np.pad(is_wall, 1)
expected = sum((~is_wall & inside[1 + z : 33 + z, 1 + y : 33 + y, 1 + x : 33 + x]).sum() for x, y, z in directions)
ends_in_wall = is_wall[grid.zyx(np.asarray(beyond)[in_fluid])]
assert ends_in_wall.sum() == expected and len(q) - expected < 0.05 * expected  # others graze it
steep = np.flatnonzero(ends_in_wall)
c, d = grid.to_xyz(node[in_fluid][steep]) - (0.1, 0.2, -0.1), 0.25 * directions[link[in_fluid][steep]]
a, b = (d * d).sum(axis=1), (c * d).sum(axis=1)
true = (-b - np.sqrt(np.maximum(b * b - a * ((c * c).sum(axis=1) - 9), 0))) / a
error = np.abs(q[steep] - true)
assert len(error) > 10000 and error.mean() < 0.02 and np.quantile(error, 0.99) < 0.1, np.quantile(error, 0.99)

# snippet: outside
labels = vp.label(~is_wall)  # what walls part has other names
is_outside = labels == labels[0, 0, 0]  # without cavities in the body, which no flow reaches
# end snippet

assert np.array_equal(is_outside, ~is_wall)  # this body has none

# snippet: boundaries
cells = vp.fractions(body, grid, of=("fraction", "aperture_x", "aperture_y", "aperture_z", "area_vector"))
fluid_volume = 1 - cells["fraction"]  # float32, (nz, ny, nx)
fluid_faces = 1 - cells["aperture_x"]  # float64, (nz, ny, nx + 1): the lower face of voxel i, and the last one's upper
wall = cells["area_vector"]  # float64, (nz, ny, nx, 3), in world units; out of the body, into the fluid
# end snippet

assert np.abs(wall.sum(axis=(0, 1, 2))).max() < 1e-9 and 0 <= fluid_faces.min() and fluid_faces.max() <= 1
assert np.array_equal(np.diff(fluid_faces, axis=2) * 0.25**2, wall[..., 0])  # to the last bit
area = np.linalg.norm(wall, axis=-1).sum()
assert abs(area / (4 * np.pi * 9) - 1) < 0.01 and abs(fluid_volume.sum() / (32**3 - 36 * np.pi * 64) - 1) < 1e-3

# snippet: listed
cells = vp.sparse_fractions(body, vp.fit(body, 512), of=("fraction", "area", "area_centroid"))
is_cut = cells.values["area"] > 0
where, share = cells.voxels[is_cut], cells.values["fraction"][is_cut]  # x, y, z and how much is inside
# end snippet

inside = cells.values["fraction"].sum(dtype=np.float64)
inside += (cells.cube_values["fraction"] * cells.cubes[:, 3].astype(np.float64) ** 3).sum()
assert abs(inside * (6 / 512) ** 3 / (36 * np.pi) - 1) < 4e-3 and 0 < len(where) < len(cells.voxels)
assert share.min() >= 0 and share.max() <= 1 and abs(cells.values["area"].sum() / (36 * np.pi) - 1) < 4e-3

# snippet: densities
materials = {"lead": 11.35, "polyethylene": 0.94}  # g/cm³
bodies = [ball((-1.5, 0, 0), 1.2), ball((1.25, 0, 0), 1.55)]
parts = vp.fractions(bodies, grid, bodies="each")  # (2, nz, ny, nx)
air = 1 - parts.sum(axis=0)
density = np.tensordot(list(materials.values()), parts, axes=1) + 0.0012 * air
mass = density.sum(dtype=np.float64) * np.prod(grid.voxel_size)
# end snippet

spheres = [4 / 3 * np.pi * r**3 for r in (1.2, 1.55)]
exact = sum(rho * v for rho, v in zip(materials.values(), spheres)) + 0.0012 * (8.0**3 - sum(spheres))
assert abs(mass / exact - 1) < 4e-3, mass / exact  # the polyhedra are a little smaller than the balls
assert air.min() > -1e-6 and density.max() < 11.36
vp.save("density.vti", {"density": density.astype(np.float32)}, grid)
