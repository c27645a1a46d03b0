// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The passes of a tessellation: levels of patches, points and triangles of their lattices. The functors run by
// Backend::for_each, the same on every backend. The program is evaluated by one functor only, so that no two copies of
// its code can round differently.

#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/programs/elements.hpp>
#include <voxelpipe/programs/program.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

// What passes count and find wrong: elements of an array of 64-bit words.
enum class program_count : std::uint8_t { left_out, bad_index, bad_level, bad_count, size };
[[nodiscard]] VOXELPIPE_HD constexpr std::size_t index_of(program_count c) { return static_cast<std::size_t>(c); }

namespace passes {

VOXELPIPE_HD inline void add(std::uint64_t* counts, program_count what, std::uint64_t n) {
    if (n != 0) add_shared(counts[index_of(what)], n);
}

// The level of an edge, asked in canonical order.
VOXELPIPE_ANY_CALLABLE
template <class Program, class V>
[[nodiscard]] VOXELPIPE_HD int edge_level(const Program& program, const vertex_output<V>& a,
                                          const vertex_output<V>& b) {
    if (same_position(a.position, b.position)) return 1;
    return comes_before(b.position, a.position) ? program.edge_level(b, a) : program.edge_level(a, b);
}

// Levels of all patches. Element `num_patches` of the counts is 0, for the sums.
template <class Program, class V>
struct find_levels {
    Program program;
    const vertex_output<V>* vertices;
    element_indices<3> in;
    std::uint64_t num_patches;
    std::uint32_t *levels, *num_triangles, *num_points;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == num_patches) {
            num_triangles[i] = num_points[i] = 0;
            return;
        }
        const auto e = in.locate(static_cast<std::uint32_t>(i));
        int level[3] = {1, 1, 1};
        bool is_bad = false;
        for (int k = 0; k < 3 && e.ok; ++k) {
            const int l = edge_level(program, vertices[e.index[k]], vertices[e.index[(k + 1) % 3]]);
            is_bad = is_bad || l < 1 || l > Program::max_level;
            level[k] = l < 1 || l > Program::max_level ? 1 : l;
        }
        const lattice patch(level[0], level[1], level[2]);
        levels[i] = patch.packed();
        num_triangles[i] = patch.num_triangles();
        num_points[i] = patch.num_points();
        add(counts, program_count::left_out, patch.num_left_out());
        add(counts, program_count::bad_index, e.ok ? 0 : 1);
        add(counts, program_count::bad_level, is_bad ? 1 : 0);
    }
};

// Patches in device or host memory.
template <class V>
struct patches {
    const vertex_output<V>* vertices;
    element_indices<3> in;
    std::uint32_t count;
    const std::uint32_t* levels;
    const std::uint64_t *first_triangle, *first_point;
};

// The patch of the first of 32 consecutive numbers, of triangles or of points.
struct patch_batch {
    std::uint32_t patch;
    std::uint32_t local; // number within the patch
    std::uint32_t point; // the patch's first
    std::uint32_t levels;

    static constexpr std::uint32_t size = 32, is_mixed = std::uint32_t{1} << 31; // a flag of levels: not all are its
};
// Finds the patch that each batch begins in.
struct find_batches {
    const std::uint64_t *first, *first_point; // of triangles or points; of points
    const std::uint32_t* levels;
    std::uint32_t count; // of patches
    patch_batch* to;

    VOXELPIPE_HD void operator()(std::uint64_t batch) const {
        const std::uint64_t i = batch * patch_batch::size;
        const std::uint32_t patch = find_owner(first, count, i);
        to[batch] = {patch, static_cast<std::uint32_t>(i - first[patch]),
                     static_cast<std::uint32_t>(first_point[patch]),
                     levels[patch] | (i + patch_batch::size > first[patch + 1] ? patch_batch::is_mixed : 0)};
    }
};
// The patch that has number i, of a batch that begins in `patch`.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t find_owner_near(const std::uint64_t* first, std::uint32_t patch,
                                                                std::uint32_t count, std::uint64_t i) {
    for (int k = 0; k < 4; ++k) {
        if (first[patch + 1] > i) return patch;
        ++patch;
    }
    const std::uint32_t rest = count - patch; // each patch has a number at least
    return patch + find_owner(first + patch, rest < patch_batch::size ? rest : patch_batch::size, i);
}

// The points that triangles [begin, end) use: [to[0], to[1]).
template <class V>
struct find_points {
    patches<V> all;
    std::uint64_t begin, end;
    std::uint64_t* to;

    [[nodiscard]] VOXELPIPE_HD std::uint64_t first_of_row(std::uint64_t triangle, int rows_below) const {
        const std::uint32_t patch = find_owner(all.first_triangle, all.count, triangle);
        const auto t = lattice_triangle_of(static_cast<std::uint32_t>(triangle - all.first_triangle[patch]));
        int row = t.p[0].row; // its first point lies in its upper row
        return all.first_point[patch] + lattice_index{row + rows_below, 0}.number();
    }
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        to[0] = first_of_row(begin, 0);
        to[1] = first_of_row(end - 1, 2);
    }
};

// Where vertices go: positions and varyings apart, as a mesh has them, or together, for a geometry program.
template <class V>
struct mesh_vertices {
    glm::vec3* positions;
    V* varyings;
    VOXELPIPE_HD void store(std::uint64_t i, const vertex_output<V>& v) const {
        positions[i] = v.position;
        if constexpr (!std::is_empty_v<V>) varyings[i] = v.varyings;
    }
};
template <>
struct mesh_vertices<no_varyings> {
    glm::vec3* positions;
    no_varyings* varyings;
    template <class W>
    VOXELPIPE_HD void store(std::uint64_t i, const vertex_output<W>& v) const {
        positions[i] = v.position;
    }
};
template <class V>
struct joined_vertices {
    vertex_output<V>* vertices;
    VOXELPIPE_HD void store(std::uint64_t i, const vertex_output<V>& v) const { vertices[i] = v; }
};

// Points [first, first + count), and behind them a vertex outside of the grid.
template <class Program, class V, class W, class Sink>
struct emit_points {
    Program program;
    patches<V> all;
    std::uint64_t first, count;
    glm::vec3 outside;
    Sink sink;
    const std::uint64_t* bound = nullptr; // of points that are emitted, in the backend's memory; null: all
    const patch_batch* batches = nullptr; // of points; null: each is searched for

    VOXELPIPE_ANY_CALLABLE
    template <class Index>
    VOXELPIPE_HD void operator()(Index i) const {
        if (i == count) {
            sink.store(i, vertex_output<W>{outside, W{}});
            return;
        }
        if (bound != nullptr && i >= *bound) return;
        std::uint32_t number = 0, local = 0, level = 0;
        if (batches != nullptr) {
            const patch_batch b = batches[(first + i) / patch_batch::size];
            number = b.patch;
            local = b.local + static_cast<std::uint32_t>((first + i) % patch_batch::size);
            level = b.levels;
            if ((level & patch_batch::is_mixed) != 0)
                number = find_owner_near(all.first_point, number, all.count, first + i);
        } else {
            number = find_owner(all.first_point, all.count, first + i);
        }
        if (batches == nullptr || (level & patch_batch::is_mixed) != 0) {
            local = static_cast<std::uint32_t>(first + i - all.first_point[number]);
            level = all.levels[number];
        }
        const lattice patch = lattice::unpack(level);
        const lattice_point at = patch.point(lattice_index::of(local));
        const auto e = all.in.locate(number);
        const vertex_output<V> v[3] = {all.vertices[e.index[0]], all.vertices[e.index[1]], all.vertices[e.index[2]]};
        int a = 0, b = 1, c = 2;
        float t1 = 0.0f, t2 = 0.0f;
        if (at.kind == lattice_point::corner) {
            a = b = c = at.which;
        } else if (at.kind == lattice_point::edge) {
            a = at.which;
            b = a == 2 ? 0 : a + 1;
            int k = at.a;
            if (comes_before(v[b].position, v[a].position)) {
                const int swapped = a;
                a = b;
                b = swapped;
                k = at.b - k;
            }
            c = a; // t2 is 0: exact
            t1 = exact::div(static_cast<float>(k), static_cast<float>(at.b));
        } else {
            const auto n = static_cast<float>(patch.size());
            t1 = exact::div(static_cast<float>(at.a), n);
            t2 = exact::div(static_cast<float>(at.b), n);
        }
        const auto result = program(patch_point<V>(v[a], v[b], v[c], t1, t2, at.kind == lattice_point::corner));
        sink.store(i, vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result));
    }
};

// Triangles [begin, begin + ...). One that is left out has the vertex `left_out` three times.
template <class V>
struct emit_triangles {
    patches<V> all;
    std::uint64_t begin, first_point;
    std::uint32_t left_out;
    glm::uvec3* triangles;
    std::uint32_t* origins;               // may be null
    const std::uint64_t* bound = nullptr; // others are left out; in the backend's memory; null: none

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (bound != nullptr && i >= *bound) {
            triangles[i] = glm::uvec3(left_out);
            if (origins != nullptr) origins[i] = 0;
            return;
        }
        const std::uint32_t number = find_owner(all.first_triangle, all.count, begin + i);
        const auto t = lattice_triangle_of(static_cast<std::uint32_t>(begin + i - all.first_triangle[number]));
        const auto index = [&](const lattice_index& p) {
            return static_cast<std::uint32_t>(all.first_point[number] + p.number() - first_point);
        };
        triangles[i] = lattice::unpack(all.levels[number]).is_left_out(t)
                           ? glm::uvec3(left_out)
                           : glm::uvec3(index(t.p[0]), index(t.p[1]), index(t.p[2]));
        if (origins != nullptr) origins[i] = number;
    }
};

} // namespace passes
} // namespace voxelpipe::core
