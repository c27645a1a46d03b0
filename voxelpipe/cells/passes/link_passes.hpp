// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_links on any backend: list the crossings of all triangles by voxel and link, sort them, and take the first
// one of each link. Functors for Backend::for_each, the same on every backend.

#include <voxelpipe/cells/links.hpp>
#include <voxelpipe/cells/passes/cell_passes.hpp>

#include <bit>
#include <cstdint>
#include <span>
#include <utility>

namespace voxelpipe::core {
namespace passes {

// The key of a crossing: its voxel's number, then its link.
struct link_keys {
    glm::ivec3 extent;
    std::uint64_t neighbours;
    [[nodiscard]] VOXELPIPE_HD std::uint64_t key(const glm::ivec3& v, int link) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        const std::uint64_t number = (static_cast<std::uint64_t>(v.z) * ny + static_cast<std::uint64_t>(v.y)) * nx +
                                     static_cast<std::uint64_t>(v.x);
        return number * neighbours + static_cast<std::uint64_t>(link);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t voxel(std::uint64_t key) const { return key / neighbours; }
    [[nodiscard]] VOXELPIPE_HD int link(std::uint64_t key) const { return static_cast<int>(key % neighbours); }
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 place(std::uint64_t voxel) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        return {static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny), static_cast<int>(voxel / nx / ny)};
    }
    [[nodiscard]] VOXELPIPE_HD bool contains(const glm::ivec3& v) const {
        return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < extent.x && v.y < extent.y && v.z < extent.z;
    }
};

// Counts the crossings of triangle i with links of the grid's voxels, or lists them.
struct list_links {
    cell_mesh mesh;
    link_keys keys_of;
    std::uint32_t* num_crossings; // null: list. 0 behind the last triangle, for the sums
    const std::uint64_t* first;   // null: count
    std::uint64_t* keys;
    std::uint32_t* triangles;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint32_t n = 0;
        if (i < mesh.num_triangles) n = list(i);
        if (num_crossings != nullptr) num_crossings[i] = n;
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t list(std::uint64_t i) const {
        const snapped_position a = mesh.corner(i, 0), b = mesh.corner(i, 1), c = mesh.corner(i, 2);
        triangle_class kind = classify_positions(a, b, c);
        if (kind == triangle_class::drawn && !meets_links(a, b, c)) kind = triangle_class::outside;
        if (first == nullptr) {
            if (kind == triangle_class::nonfinite) add_count(counts, cell_count::nonfinite, 1);
            if (kind == triangle_class::too_far) add_count(counts, cell_count::too_far, 1);
            if (kind == triangle_class::outside) add_count(counts, cell_count::outside, 1);
        }
        if (kind != triangle_class::drawn) return 0;
        if (fits_narrow(a, b, c, mesh.fraction)) return list_of(i, link_triangle<std::int64_t>(a, b, c, mesh.fraction));
        return list_of(i, link_triangle<int128>(a, b, c, mesh.fraction));
    }
    // Links of the grid's voxels end at most half a voxel beyond the grid.
    [[nodiscard]] VOXELPIPE_HD bool meets_links(const snapped_position& a, const snapped_position& b,
                                                const snapped_position& c) const {
        const std::int64_t half = std::int64_t{1} << (mesh.fraction - 1);
        const auto meets = [&](std::int64_t low, std::int64_t high, int extent) {
            return high >= -half && low <= (static_cast<std::int64_t>(extent) << mesh.fraction) + half;
        };
        return meets(min3(a.x, b.x, c.x), max3(a.x, b.x, c.x), mesh.extent.x) &&
               meets(min3(a.y, b.y, c.y), max3(a.y, b.y, c.y), mesh.extent.y) &&
               meets(min3(a.z, b.z, c.z), max3(a.z, b.z, c.z), mesh.extent.z);
    }
    template <class Int>
    [[nodiscard]] VOXELPIPE_HD std::uint32_t list_of(std::uint64_t i, const link_triangle<Int>& t) const {
        std::uint32_t n = 0;
        const std::uint64_t at = first != nullptr ? first[i] : 0;
        const auto add = [&](const glm::ivec3& v, int link) {
            if (!keys_of.contains(v)) return;
            if (first != nullptr) {
                keys[at + n] = keys_of.key(v, link);
                triangles[at + n] = static_cast<std::uint32_t>(i);
            }
            n += static_cast<std::uint32_t>(n != ~0u);
        };
        for (int link = 0; link < static_cast<int>(keys_of.neighbours); link += 2) {
            const glm::ivec3 d = link_direction(link);
            for_each_link(t, d, mesh.extent, [&](const glm::ivec3& v) {
                add(v, link);
                add(v + d, link + 1);
            });
        }
        return n;
    }
};

// Crossings by voxel and link.
struct link_crossings {
    link_keys keys_of;
    const std::uint64_t* keys;
    const std::uint32_t* triangles;
    std::uint64_t count;
    [[nodiscard]] VOXELPIPE_HD bool begins_voxel(std::uint64_t i) const {
        return i == 0 || keys_of.voxel(keys[i]) != keys_of.voxel(keys[i - 1]);
    }
};

// 1 for the first crossing of each voxel; 0 behind the last crossing, for the sums. Also counts the links.
struct mark_link_voxels {
    link_crossings all;
    std::uint32_t* marks;
    std::uint64_t* counts;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        marks[i] = 0;
        if (i == all.count) return;
        marks[i] = all.begins_voxel(i) ? 1 : 0;
        if (i == 0 || all.keys[i] != all.keys[i - 1]) add_count(counts, cell_count::fragments, 1);
    }
};

// The record of the voxel whose first crossing is i. The order of crossings of a link does not matter: the least
// position counts, of equal ones the lowest primitive.
struct write_links {
    cell_mesh mesh;
    link_crossings all;
    const std::uint32_t* of_triangles; // primitives
    const std::uint64_t* records;      // before each crossing
    glm::ivec3* voxels;
    float* q;
    std::uint32_t* primitives;
    std::uint32_t* draws;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (!all.begins_voxel(i)) return;
        const std::uint64_t record = records[i], voxel = all.keys_of.voxel(all.keys[i]), n = all.keys_of.neighbours,
                            to = record * n;
        const glm::ivec3 p = all.keys_of.place(voxel);
        voxels[record] = p;
        for (std::uint64_t k = 0; k < n; ++k) {
            q[to + k] = -1.0f;
            primitives[to + k] = draws[to + k] = no_crossing;
        }
        for (std::uint64_t at = i; at < all.count && all.keys_of.voxel(all.keys[at]) == voxel;) {
            const std::uint64_t key = all.keys[at];
            const int link = all.keys_of.link(key);
            crossing best = crossing_of(at, p, link);
            for (++at; at < all.count && all.keys[at] == key; ++at) {
                const crossing other = crossing_of(at, p, link);
                const int order = compare(other.position, best.position);
                if (order < 0 || (order == 0 && best.primitive > other.primitive)) best = other;
            }
            const std::uint64_t element = to + static_cast<std::uint64_t>(link);
            q[element] = to_link_fraction(best.position);
            primitives[element] = best.primitive;
            draws[element] = mesh.draw_of(best.triangle);
        }
    }

private:
    struct crossing {
        edge_position position;
        std::uint32_t triangle, primitive;
    };
    [[nodiscard]] VOXELPIPE_HD crossing crossing_of(std::uint64_t at, const glm::ivec3& p, int link) const {
        const std::uint32_t t = all.triangles[at];
        const snapped_position a = mesh.corner(t, 0);
        const std::int64_t half = std::int64_t{1} << (mesh.fraction - 1);
        const auto centre = [&](int v) { return (static_cast<std::int64_t>(v) << mesh.fraction) + half; };
        const exact_normal n = normal_of(a, mesh.corner(t, 1), mesh.corner(t, 2));
        return {position_on_link(n, a, {centre(p.x), centre(p.y), centre(p.z)}, link_direction(link), mesh.fraction), t,
                of_triangles[t]};
    }
};

} // namespace passes

// Implements voxelize_links on any backend. Arguments are validated. Throws what the backend's buffers throw.
template <class Backend, class Mesh, class VertexShader, class Shader>
[[nodiscard]] status run_links(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                               link_list<Backend>& out, const link_options& options, std::uint64_t triangles_in) {
    constexpr std::uint64_t most = std::uint64_t{1} << 32;
    const auto fail = [&](status_code code) {
        status s = failure(code, stage::coarse_raster);
        s.counts.triangles_in = triangles_in;
        return s;
    };
    // Vertices are numbered in 32 bits.
    if (cell_scene<Backend>::num_vertices(draws) >= most) return fail(status_code::out_of_memory);
    const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
    const passes::link_keys keys_of{g.extent, wide(options.neighbours)};
    const uint128 num_keys =
        static_cast<uint128>(wide(g.extent.x)) * wide(g.extent.y) * wide(g.extent.z) * keys_of.neighbours;
    if ((num_keys >> 63) != 0) return fail(status_code::size_overflow);

    using words = typename Backend::template buffer<std::uint32_t>;
    using numbers = typename Backend::template buffer<std::uint64_t>;
    cell_scene<Backend> scene(backend, draws, g, 0);
    if (scene.num_vertices() == 0) return make_cell_status(scene.read_counts(), {}, triangles_in, 0); // bad indices
    passes::list_links list{scene.mesh(), keys_of, nullptr, nullptr, nullptr, nullptr, scene.counts()};
    numbers first(backend, triangles_in + 1);
    std::uint64_t count = 0;
    {
        words num_crossings(backend, triangles_in + 1);
        list.num_crossings = num_crossings.data();
        backend.for_each(triangles_in + 1, list);
        count = backend.sum(num_crossings, first);
    }
    status s = make_cell_status(scene.read_counts(), {}, triangles_in, 0);
    if (!s.ok()) return s;
    if (count >= most) return fail(status_code::out_of_memory);

    numbers keys(backend, count);
    words triangles(backend, count);
    list.num_crossings = nullptr;
    list.first = first.data();
    list.keys = keys.data();
    list.triangles = triangles.data();
    backend.for_each(triangles_in, list);
    backend.sort_by_key(keys, triangles, static_cast<int>(std::bit_width(static_cast<std::uint64_t>(num_keys))));

    const passes::link_crossings all{keys_of, keys.data(), triangles.data(), count};
    numbers records(backend, count + 1);
    std::uint64_t num_records = 0;
    {
        words marks(backend, count + 1);
        backend.for_each(count + 1, passes::mark_link_voxels{all, marks.data(), scene.counts()});
        num_records = backend.sum(marks, records);
    }
    words of_triangles(backend, triangles_in);
    std::uint64_t first_triangle = 0;
    std::uint32_t first_primitive = 0;
    for (const auto& d : draws) {
        const auto& m = d.mesh;
        const bool is_part = m.part.whole != 0;
        const auto each = static_cast<std::uint32_t>(m.triangles.size());
        const auto whole = is_part ? static_cast<std::uint32_t>(m.part.whole) : each;
        backend.for_each(m.num_triangles(),
                         passes::name_primitives{is_part ? m.part.numbers.data() : nullptr, each, whole,
                                                 first_primitive, of_triangles.data() + first_triangle});
        first_triangle += m.num_triangles();
        first_primitive += static_cast<std::uint32_t>(m.num_primitives());
    }
    link_list<Backend> made(backend);
    made.neighbours = options.neighbours;
    made.voxels = typename Backend::template buffer<glm::ivec3>(backend, num_records);
    made.q = typename Backend::template buffer<float>(backend, num_records * keys_of.neighbours);
    made.primitives = words(backend, num_records * keys_of.neighbours);
    made.draws = words(backend, num_records * keys_of.neighbours);
    backend.for_each(count,
                     passes::write_links{scene.mesh(), all, of_triangles.data(), records.data(), made.voxels.data(),
                                         made.q.data(), made.primitives.data(), made.draws.data()});
    s.counts.fragments = scene.read_counts()[index_of(cell_count::fragments)]; // waits for the records, too
    s.counts.voxels = num_records;
    out = std::move(made);
    return s;
}

} // namespace voxelpipe::core
