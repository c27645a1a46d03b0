// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "solid_support.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace solids {

mesh& mesh::add(const mesh& other) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), other.positions.begin(), other.positions.end());
    for (const glm::uvec3& t : other.triangles) triangles.push_back(t + first);
    return *this;
}
mesh mesh::inside_out() const {
    mesh m = *this;
    for (glm::uvec3& t : m.triangles) std::swap(t.y, t.z);
    return m;
}
mesh mesh::moved(glm::vec3 by) const {
    mesh m = *this;
    for (glm::vec3& p : m.positions) p += by;
    return m;
}

mesh box(glm::vec3 low, glm::vec3 high) {
    mesh m;
    for (int corner = 0; corner < 8; ++corner)
        m.positions.emplace_back((corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                                 (corner & 4) != 0 ? high.z : low.z);
    m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return m;
}

mesh octahedron(glm::vec3 c, float r) {
    mesh m;
    m.positions = {c + glm::vec3(r, 0, 0), c - glm::vec3(r, 0, 0), c + glm::vec3(0, r, 0),
                   c - glm::vec3(0, r, 0), c + glm::vec3(0, 0, r), c - glm::vec3(0, 0, r)};
    m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return m;
}

mesh tube(glm::vec3 low, glm::vec3 high, float wall) {
    const glm::vec3 in(wall, wall, 0.0f);
    mesh m = box(low, high);
    m.add(box(low + in, high - in).inside_out());
    // The caps, triangles 0 to 3 of either box, become rings.
    m.triangles.erase(m.triangles.begin() + 12, m.triangles.begin() + 16);
    m.triangles.erase(m.triangles.begin(), m.triangles.begin() + 4);
    const std::uint32_t ring[4] = {0, 1, 3, 2};
    for (int i = 0; i < 4; ++i) {
        const std::uint32_t a = ring[i], b = ring[(i + 1) % 4];
        m.triangles.push_back({a, 8 + a, 8 + b}); // below
        m.triangles.push_back({a, 8 + b, b});
        m.triangles.push_back({4 + a, 4 + b, 12 + b}); // above
        m.triangles.push_back({4 + a, 12 + b, 12 + a});
    }
    return m;
}

mesh sphere(glm::vec3 center, float radius, int subdivisions) {
    mesh m = octahedron(glm::vec3(0.0f), 1.0f);
    for (int level = 0; level < subdivisions; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, added] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(m.positions.size()));
            if (added) m.positions.push_back(m.positions[a] + m.positions[b]);
            return found->second;
        };
        std::vector<glm::uvec3> finer;
        for (const glm::uvec3& t : m.triangles) {
            const std::uint32_t ab = middle(t.x, t.y), bc = middle(t.y, t.z), ca = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {ab, t.y, bc}, {ca, bc, t.z}, {ab, bc, ca}});
        }
        m.triangles = std::move(finer);
        for (glm::vec3& p : m.positions) p = p / std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    }
    for (glm::vec3& p : m.positions) p = p * radius + center;
    return m;
}

mesh random_cycle(splitmix64& random, int points, int low, int high, int per_voxel) {
    mesh m;
    const auto coordinate = [&] {
        return static_cast<float>(random.between(std::int64_t{low} * per_voxel, std::int64_t{high} * per_voxel)) /
               static_cast<float>(per_voxel);
    };
    for (int i = 0; i < points + 2; ++i) {
        const float x = coordinate(), y = coordinate(), z = coordinate();
        m.positions.emplace_back(x, y, z);
    }
    const auto n = static_cast<std::uint32_t>(points);
    for (std::uint32_t i = 0; i < n; ++i) {
        m.triangles.push_back({n, i, (i + 1) % n});
        m.triangles.push_back({n + 1, (i + 1) % n, i});
    }
    return m;
}

mesh random_bodies(splitmix64& random, int extent, int count) {
    mesh all;
    const auto half = [&](int low, int high) { // a multiple of a half
        return static_cast<float>(random.between(2 * low, 2 * high)) / 2.0f;
    };
    for (int i = 0; i < count; ++i) {
        const glm::vec3 p(half(-1, extent), half(-1, extent), half(-1, extent));
        mesh m;
        if (random.one_in(3))
            m = box(p, p + glm::vec3(half(1, extent / 2), half(1, extent / 2), half(1, extent / 2)));
        else if (random.one_in(2))
            m = octahedron(p, half(1, extent / 2));
        else
            m = random_cycle(random, 3 + static_cast<int>(random.below(5)), -1, extent + 1, 2);
        all.add(random.one_in(2) ? m : m.inside_out());
    }
    return all;
}

mesh split_at_lattice_points(const mesh& m) {
    mesh out;
    out.positions = m.positions;
    const auto on_lattice = [](const glm::vec3& p) {
        for (int a = 0; a < 3; ++a)
            if (p[a] * 256.0f != std::floor(p[a] * 256.0f)) return false;
        return true;
    };
    for (const glm::uvec3& t : m.triangles) {
        const glm::vec3 a = m.positions[t.x], b = m.positions[t.y], c = m.positions[t.z];
        const glm::vec3 inside = a + (b - a) * 0.25f + (c - a) * 0.5f;
        const auto v = static_cast<std::uint32_t>(out.positions.size());
        if (on_lattice(inside)) {
            out.positions.push_back(inside);
            out.triangles.insert(out.triangles.end(), {{t.x, t.y, v}, {t.y, t.z, v}, {t.z, t.x, v}});
        } else {
            out.triangles.push_back(t);
        }
    }
    return out;
}

mesh without_triangles(mesh m, std::vector<std::size_t> which) {
    std::sort(which.rbegin(), which.rend());
    for (const std::size_t i : which) m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(i));
    return m;
}
mesh with_holes(splitmix64& random, mesh m, std::size_t count) {
    for (std::size_t i = 0; i < count && m.triangles.size() > 1; ++i)
        m = without_triangles(m, {static_cast<std::size_t>(random.below(m.triangles.size()))});
    return m;
}

vp::grid unit_grid(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

std::size_t count(const voxel_set& s) {
    return static_cast<std::size_t>(std::count_if(s.begin(), s.end(), [](std::uint8_t v) { return v != 0; }));
}
voxel_set united(voxel_set a, const voxel_set& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] |= b[i];
    return a;
}
voxel_set without(voxel_set a, const voxel_set& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = a[i] != 0 && b[i] == 0 ? 1 : 0;
    return a;
}
voxel_set exclusive(voxel_set a, const voxel_set& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] ^= b[i];
    return a;
}

namespace {
using bit_target = vp::target<vp::bit, vp::blend::bit_or>;

voxel_set unpack(vp::cpu_backend& backend, const vp::framebuffer<vp::cpu_backend, bit_target>& fb) {
    const auto host = vp::get<0>(fb).to_host_target(backend);
    const glm::ivec3 e = fb.extent();
    voxel_set s(index(e, 0, 0, e.z));
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y)
            for (int x = 0; x < e.x; ++x) s[index(e, x, y, z)] = host(x, y, z) ? 1 : 0;
    return s;
}
} // namespace

solid library_solid(const std::vector<mesh>& draws, const vp::grid& g, const vp::solid_options& options,
                    unsigned threads) {
    vp::cpu_backend backend{threads};
    vp::framebuffer<vp::cpu_backend, bit_target> fb{backend, g.extent};
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    std::vector<draw> list;
    for (const mesh& m : draws) list.push_back({m.view(), {}, vp::constant(true)});
    solid r{{}, vp::voxelize_solid(backend, list, g, fb, options)};
    EXPECT_TRUE(r.status.ok()) << r.status.message();
    r.voxels = unpack(backend, fb);
    EXPECT_EQ(r.status.counts.voxels, count(r.voxels));
    return r;
}

vp::status status_of_bits(const mesh& m, int n, const vp::solid_options& options) {
    vp::cpu_backend backend{2};
    const vp::grid g = vp::fit(m.positions, glm::ivec3(n));
    vp::framebuffer<vp::cpu_backend, bit_target> fb{backend, g.extent};
    return vp::voxelize_solid(backend, m.view(), g, vp::passthrough{}, vp::constant(true), fb, options);
}

voxel_set library_cover(const mesh& m, const vp::grid& g) {
    vp::cpu_backend backend{2};
    vp::framebuffer<vp::cpu_backend, bit_target> fb{backend, g.extent};
    const vp::status s = vp::voxelize(backend, m.view(), g, vp::passthrough{}, vp::constant(true), fb);
    EXPECT_TRUE(s.ok()) << s.message();
    return unpack(backend, fb);
}

namespace {
oracle::grid as_oracle(const vp::grid& g) {
    oracle::grid o{};
    for (int a = 0; a < 3; ++a) {
        o.origin[a] = g.origin[a];
        o.voxel_size[a] = g.voxel_size[a];
        o.extent[a] = g.extent[a];
    }
    return o;
}
} // namespace

std::vector<oracle::snapped_triangle> snap(const mesh& m, const vp::grid& g) {
    const oracle::grid o = as_oracle(g);
    std::vector<oracle::snapped_triangle> all;
    for (const glm::uvec3& t : m.triangles) {
        float v[3][3];
        for (int n = 0; n < 3; ++n)
            for (int a = 0; a < 3; ++a) v[n][a] = m.positions[t[n]][a];
        all.push_back(oracle::snap(o, v));
    }
    return all;
}

std::vector<std::int64_t> oracle_windings(const mesh& m, const vp::grid& g, const std::array<int, 3>& direction,
                                          const std::array<int, 3>& order) {
    const oracle::winding_oracle oracle(oracle::fraction_bits(as_oracle(g)), snap(m, g), direction, order);
    std::vector<std::int64_t> all(index(g.extent, 0, 0, g.extent.z));
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) all[index(g.extent, x, y, z)] = oracle.winding({x, y, z});
    return all;
}

voxel_set accepted(const std::vector<std::int64_t>& windings, vp::fill_rule rule) {
    voxel_set s;
    for (const std::int64_t w : windings) {
        const bool in = rule == vp::fill_rule::even_odd ? w % 2 != 0 : rule == vp::fill_rule::nonzero ? w != 0 : w > 0;
        s.push_back(in ? 1 : 0);
    }
    return s;
}

} // namespace solids
