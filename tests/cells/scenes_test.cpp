// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The theorems of cut cells on the benchmark scenes that are present (docs/design.md, "Cut cells").

#include "../solids/scenes.hpp"
#include "cell_support.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace cells {
namespace {

struct scene {
    mesh of;
    vp::grid g;
};

// Nothing, and the test is to be skipped, where the scene is not present.
std::optional<scene> scene_of(const char* name, std::string& why) {
    std::optional<mesh> m = solids::load_scene(name, why);
    if (!m) return std::nullopt;
    const vp::grid g = vp::fit(m->positions, glm::ivec3(96));
    return scene{std::move(*m), g};
}

// A sixth of the sum of the snapped triangles' determinants, in voxels: the volume of a closed mesh.
long double exact_volume(const scene& s) {
    const auto snap = vp::core::make_snap_transform(s.g);
    vp::int128 sum = 0; // products of 24 bits, of fewer than 2^23 triangles
    for (const glm::uvec3& t : s.of.triangles) {
        vp::core::snapped_position p[3];
        for (int i = 0; i < 3; ++i) {
            const glm::vec3& at = s.of.positions[t[i]];
            p[i] = vp::core::snap(snap, at.x, at.y, at.z);
        }
        const auto cross = [&](const auto& a, const auto& b) {
            return static_cast<vp::int128>(a.x) * b.y - static_cast<vp::int128>(a.y) * b.x;
        };
        sum += cross(p[0], p[1]) * p[2].z + cross(p[1], p[2]) * p[0].z + cross(p[2], p[0]) * p[1].z;
    }
    return std::ldexp(static_cast<long double>(sum), -3 * s.g.fraction()) / 6.0L;
}

class CellScenes : public testing::TestWithParam<const char*> {};

TEST_P(CellScenes, TheTheoremsHold) {
    std::string why;
    const std::optional<scene> s = scene_of(GetParam(), why);
    if (!s) GTEST_SKIP() << why;
    const int n = s->g.extent.x;
    cell_values by_axis[3];
    for (int axis = 0; axis < 3; ++axis) by_axis[axis] = library_cells(s->of, s->g, {.axis = axis});
    const cell_values& whole = by_axis[0];
    const bool is_closed = whole.status.cells.open_edges == 0;
    EXPECT_GT(whole.status.cells.cut_voxels, 1000u);

    // 1: voxels that nothing touches are whole; by all axes they are the same, and others within the bound.
    std::uint64_t broken = 0, apart = 0;
    for (std::size_t v = 0; is_closed && v < whole.units.size(); ++v)
        for (const cell_values& c : by_axis) {
            const bool is_cut = whole.cut[v] != 0 || c.cut[v] != 0;
            broken += c.cut[v] == 0 && c.units[v] % whole_cell != 0 ? 1 : 0;
            apart += std::abs(c.units[v] - whole.units[v]) > (is_cut ? std::int64_t{2} << 18 : 0) ? 1 : 0; // 2^-26 each
        }
    EXPECT_EQ(broken, 0u);
    EXPECT_EQ(apart, 0u);

    // 2: neither the order, first vertices nor threads matter, the sign follows the mesh, and the sum is the volume.
    mesh turned = s->of;
    std::reverse(turned.triangles.begin(), turned.triangles.end());
    for (glm::uvec3& t : turned.triangles) t = glm::uvec3(t.y, t.z, t.x);
    const cell_values other = library_cells(turned, s->g, {}, 1);
    EXPECT_EQ(other.units, whole.units);
    EXPECT_EQ(other.apertures, whole.apertures);
    EXPECT_EQ(other.status.cells, whole.status.cells);
    const cell_values inverted = library_cells(s->of.inside_out(), s->g);
    std::uint64_t unequal = 0;
    for (std::size_t v = 0; v < whole.units.size(); ++v) unequal += inverted.units[v] != -whole.units[v] ? 1 : 0;
    EXPECT_EQ(unequal, 0u);
    const auto volume_in_voxels = [](const vp::status& of) {
        return std::ldexp(static_cast<long double>(of.cells.volume_high), 20) +
               std::ldexp(static_cast<long double>(of.cells.volume_low), -44);
    };
    if (is_closed) {
        const auto records = static_cast<double>(whole.status.cells.cell_records);
        const long double exact = exact_volume(*s);
        for (const cell_values& c : by_axis)
            EXPECT_LE(std::abs(static_cast<double>(volume_in_voxels(c.status) - exact)), 2.5 * records * 0x1p-44);
    }

    // 3 and 4: crops, slabs along the rows too, have the cells of the whole; upper apertures are the neighbours' lower.
    for (int axis = 0; axis < 3; ++axis) {
        const cell_values& c = by_axis[axis];
        std::uint64_t open = 0;
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) {
                    glm::ivec3 beyond(x, y, z);
                    if (++beyond[axis] == n) continue;
                    open += c.next[c.index(x, y, z)] != c.apertures[c.index(beyond.x, beyond.y, beyond.z)] ? 1 : 0;
                }
        EXPECT_EQ(open, 0u);
        glm::ivec3 begin(0), size(n);
        begin[axis] = n / 2 - 3;
        size[axis] = 11;
        for (const auto& [from, extent] :
             {std::pair{begin, size}, {glm::ivec3(n / 3), glm::ivec3(n / 2, n / 4, n / 3)}}) {
            const cell_values part = library_cells(s->of, s->g.crop(from, extent), {.axis = axis});
            std::uint64_t others = 0;
            for (int z = 0; z < extent.z; ++z)
                for (int y = 0; y < extent.y; ++y)
                    for (int x = 0; x < extent.x; ++x) {
                        const std::size_t at = c.index(from.x + x, from.y + y, from.z + z), here = part.index(x, y, z);
                        others += part.units[here] != c.units[at] || part.apertures[here] != c.apertures[at] ||
                                          part.next[here] != c.next[at] || part.cut[here] != c.cut[at]
                                      ? 1
                                      : 0;
                    }
            EXPECT_EQ(others, 0u);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, CellScenes, testing::Values("conference", "dragon", "blade", "hairball", "asiandragon"));

} // namespace
} // namespace cells
