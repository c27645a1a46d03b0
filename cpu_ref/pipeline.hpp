// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The CPU pipeline: vertex shade, coarse raster into (triangle, tile) pairs, tile sort, and fine raster tile by tile,
// with each tile's triangles in order. A tile belongs to one thread, so there are neither atomics nor races: every
// blend is a plain fold, and the result is the same for any number of threads. Needs neither nvcc nor a CUDA header.

#include <cpu_ref/execution.hpp>
#include <cpu_ref/parallel.hpp>
#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/triangle_counts.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::cpu {

inline constexpr int log2_tile_size = 5; // a row of a tile is one word of bits
inline constexpr int tile_size = 1 << log2_tile_size;
inline constexpr std::size_t tile_rows = std::size_t{tile_size} * tile_size;
inline constexpr std::size_t tile_voxels = tile_rows * tile_size;

// The lowest voxel of a box.
[[nodiscard]] inline glm::ivec3 lowest(const core::voxel_box& box) {
    return {static_cast<int>(box.lo[0]), static_cast<int>(box.lo[1]), static_cast<int>(box.lo[2])};
}

// Index of a voxel within its tile; a row is y + tile_size * z.
[[nodiscard]] constexpr std::size_t tile_voxel(int row, int x) {
    return static_cast<std::size_t>(row) * tile_size + static_cast<std::size_t>(x);
}

// ---- vertex shade ---------------------------------------------------------------------------------------------------

// The vertices of one draw after the vertex shader, snapped. varyings is null if there are none.
template <class Varyings>
struct shaded_vertices {
    std::unique_ptr<core::snapped_position[]> positions;
    std::unique_ptr<Varyings[]> varyings;
};

template <class Mesh, class VertexShader, class FragmentShader>
using draw_varyings = typename core::shaded<Mesh, VertexShader>::varyings;

// Varyings: the vertex shader's varyings, or no_varyings to omit them.
template <class Varyings, class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] auto shade_vertices(const execution& how, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                  const core::snap_transform& snap) {
    how.enter(stage::vertex_shade);
    const stopwatch watch(how.times, &stage_times::vertex_shade);
    std::vector<shaded_vertices<Varyings>> shaded(draws.size());
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const auto& in = draws[d];
        auto& out = shaded[d];
        const std::size_t each = in.mesh.positions.size(), n = in.mesh.num_vertices();
        out.positions = std::make_unique_for_overwrite<core::snapped_position[]>(n);
        if constexpr (!std::is_empty_v<Varyings>) out.varyings = std::make_unique_for_overwrite<Varyings[]>(n);
        constexpr std::size_t block = 16384;
        parallel_for(how.threads, (n + block - 1) / block, [&](unsigned, std::size_t b) {
            const std::size_t last = std::min(n, (b + 1) * block);
            std::size_t instance = b * block / each, index = b * block % each;
            for (std::size_t i = b * block; i < last; ++i) {
                const auto v = core::fetch_vertex(in.mesh, static_cast<std::uint32_t>(index),
                                                  static_cast<std::uint32_t>(d), static_cast<std::uint32_t>(instance));
                if (++index == each) {
                    index = 0;
                    ++instance;
                }
                const auto result = in.vertex_shader(v);
                using widen = core::vertex_result<std::remove_cvref_t<decltype(result)>>;
                const auto& o = widen::widen(result);
                out.positions[i] = core::snap(snap, o.position.x, o.position.y, o.position.z);
                if constexpr (!std::is_empty_v<Varyings>) out.varyings[i] = o.varyings;
            }
        });
    }
    return shaded;
}

template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] auto vertex_shade(const execution& how, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                const core::snap_transform& snap) {
    return shade_vertices<draw_varyings<Mesh, VertexShader, FragmentShader>>(how, draws, snap);
}

// ---- scene ----------------------------------------------------------------------------------------------------------

// The geometry, without shaders. Code that needs only this is compiled once instead of once per shader.
struct geometry {
    struct part { // one draw
        core::instanced_triangles triangles;
        const core::snapped_position* positions = nullptr; // of all instances; owned by the scene
        std::uint32_t num_triangles = 0, num_vertices = 0; // of all instances
    };
    std::vector<part> parts;
    std::vector<std::uint32_t> first_primitive; // by draw, then the total
    core::snap_transform snap{};
    grid where{};
    glm::ivec3 lead{0};                       // lowest voxel of `where` that is drawn
    core::arm_set arms = core::arm_set::none; // leave out the conservative voxels whose arms a triangle does not meet

    // The primitive numbers of each draw if some draw is a subset (mesh_view::part); otherwise empty.
    std::vector<core::numbering> numberings;

    struct primitive {
        std::uint32_t draw, triangle, instance;
        glm::uvec3 index;
    };
    [[nodiscard]] primitive find(std::uint32_t id) const {
        std::uint32_t d = 0;
        if (parts.size() > 1)
            d = static_cast<std::uint32_t>(std::upper_bound(first_primitive.begin(), first_primitive.end() - 1, id) -
                                           first_primitive.begin()) -
                1;
        const std::uint32_t t = id - first_primitive[d];
        const auto at = parts[d].triangles.find(t);
        return {d, at.triangle, at.instance, parts[d].triangles[t]};
    }
    // The numbers of a primitive that shaders and lists see. `id` counts what is drawn, in the same order.
    [[nodiscard]] core::visible_numbers numbers_of(const primitive& p, std::uint32_t id) const {
        if (numberings.empty()) return {p.triangle, id};
        return numberings[p.draw].of(p.triangle, p.instance);
    }
    [[nodiscard]] core::voxel_box whole_box() const {
        return {{{lead.x, lead.y, lead.z}}, {{where.extent.x - 1, where.extent.y - 1, where.extent.z - 1}}};
    }
};

template <class Mesh>
[[nodiscard]] geometry::part make_part(const Mesh& mesh, const core::snapped_position* positions) {
    return {core::triangles_of(mesh), positions, static_cast<std::uint32_t>(mesh.num_triangles()),
            static_cast<std::uint32_t>(mesh.num_vertices())};
}

template <class Mesh, class VertexShader, class FragmentShader>
struct scene : geometry {
    using varyings = draw_varyings<Mesh, VertexShader, FragmentShader>;
    using fragment_shader = FragmentShader;

    std::span<const draw<Mesh, VertexShader, FragmentShader>> draws;
    std::vector<shaded_vertices<varyings>> vertices; // by draw
    core::triple<double> normal_factors{};
};

template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] scene<Mesh, VertexShader, FragmentShader>
make_scene(const execution& how, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g) {
    scene<Mesh, VertexShader, FragmentShader> s;
    s.draws = draws;
    s.where = g;
    s.snap = core::make_snap_transform(g);
    s.normal_factors = core::normal_factors(g);
    s.vertices = vertex_shade(how, draws, s.snap);
    s.parts.reserve(draws.size());
    s.first_primitive.reserve(draws.size() + 1);
    std::uint32_t first = 0;
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const auto& mesh = draws[d].mesh;
        s.parts.push_back(make_part(mesh, s.vertices[d].positions.get()));
        s.first_primitive.push_back(first);
        first += s.parts.back().num_triangles;
    }
    s.first_primitive.push_back(first);
    s.numberings = core::make_numberings(draws);
    return s;
}

// True if the numbers of every subset ascend and are below the number of its whole mesh.
template <class Draw>
[[nodiscard]] bool are_numbered(std::span<const Draw> draws) {
    return std::all_of(draws.begin(), draws.end(), [](const Draw& d) {
        const auto& part = d.mesh.part;
        if (part.whole == 0 || part.checked != 0 || part.numbers.size() == 0) return true;
        return std::is_sorted(part.numbers.begin(), part.numbers.end(), std::less_equal<>{}) &&
               part.numbers[part.numbers.size() - 1] < part.whole;
    });
}

// ---- coarse raster --------------------------------------------------------------------------------------------------

template <class Key>
struct tile_pair {
    Key key; // tile number
    std::uint32_t primitive;
};

// The pairs of one block of triangles, in primitive order.
template <class Key>
class pair_list {
public:
    pair_list() = default;
    explicit pair_list(std::size_t capacity)
        : pairs_(std::make_unique_for_overwrite<tile_pair<Key>[]>(capacity)), capacity_(capacity) {}
    VOXELPIPE_INLINE void push(Key tile, std::uint32_t primitive) {
        if (size_ == capacity_) grow();
        pairs_[size_++] = {tile, primitive};
    }
    [[nodiscard]] const tile_pair<Key>* begin() const { return pairs_.get(); }
    [[nodiscard]] const tile_pair<Key>* end() const { return pairs_.get() + size_; }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    void grow() {
        auto larger = std::make_unique_for_overwrite<tile_pair<Key>[]>(2 * capacity_);
        std::copy(begin(), end(), larger.get());
        pairs_ = std::move(larger);
        capacity_ *= 2;
    }
    std::unique_ptr<tile_pair<Key>[]> pairs_;
    std::size_t size_ = 0, capacity_ = 0;
};

template <class Key>
struct coarse_result {
    status_code code = status_code::ok;
    counters counts{};
    raw_array<tile_pair<Key>> pairs; // by ascending primitive
};

template <coverage Rule, class Key>
[[nodiscard]] coarse_result<Key> coarse_raster(const execution& how, const geometry& s, const core::tile_grid& tiles) {
    how.enter(stage::coarse_raster);
    const stopwatch watch(how.times, &stage_times::coarse_raster);
    constexpr std::size_t block = 8192;
    const std::size_t n = s.first_primitive.back();
    const std::size_t blocks = (n + block - 1) / block;
    const core::voxel_box whole = s.whole_box();
    struct block_result {
        status_code code = status_code::ok;
        counters counts{};
        pair_list<Key> pairs;
    };
    std::vector<block_result> parts(blocks);
    parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
        block_result& part = parts[b];
        pair_list<Key> pairs(block + block / 4);
        counters counts{};
        const std::size_t last = std::min(n, (b + 1) * block);
        for (std::size_t i = b * block; i < last; ++i) {
            const auto id = static_cast<std::uint32_t>(i);
            const auto tri = s.find(id);
            const geometry::part& in = s.parts[tri.draw];
            const std::size_t num_vertices = in.num_vertices;
            if (tri.index.x >= num_vertices || tri.index.y >= num_vertices || tri.index.z >= num_vertices) {
                part.code = status_code::index_out_of_range;
                return;
            }
            const core::snapped_position* const p = in.positions;
            const auto &a = p[tri.index.x], &b_ = p[tri.index.y], &c = p[tri.index.z];
            core::voxel_box reach{};
            core::triangle_class kind = core::classify<Rule>(a, b_, c, s.snap.fraction, whole, reach);
            if ((Rule == coverage::thin || s.arms != core::arm_set::none) && kind == core::triangle_class::drawn &&
                core::has_zero_area(a, b_, c))
                kind = core::triangle_class::zero_area;
            core::count_class(counts, kind);
            if (kind == core::triangle_class::drawn)
                core::for_each_tile<Rule>(a, b_, c, s.snap.fraction, reach, tiles,
                                          [&](std::uint64_t tile) { pairs.push(static_cast<Key>(tile), id); });
        }
        part.pairs = std::move(pairs);
        part.counts = counts;
    });

    coarse_result<Key> all;
    std::vector<std::size_t> first(blocks + 1, 0);
    for (std::size_t b = 0; b < blocks; ++b) {
        const block_result& part = parts[b];
        if (part.code != status_code::ok) {
            all.code = part.code;
            return all;
        }
        core::add_triangles(all.counts, part.counts);
        first[b + 1] = first[b] + part.pairs.size();
    }
    all.counts.triangles_in = n;
    all.pairs = raw_array<tile_pair<Key>>(first[blocks]);
    parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
        std::copy(parts[b].pairs.begin(), parts[b].pairs.end(), all.pairs.begin() + first[b]);
        parts[b].pairs = {};
    });
    return all;
}

// ---- tile sort ------------------------------------------------------------------------------------------------------

// The sorted pairs of one tile: [first, last).
struct tile_range {
    std::uint64_t tile;
    std::size_t first, last;
};

template <class Key>
[[nodiscard]] std::vector<tile_range> tile_sort(const execution& how, raw_array<tile_pair<Key>>& pairs,
                                                std::uint64_t num_tiles) {
    how.enter(stage::tile_sort);
    const stopwatch watch(how.times, &stage_times::tile_sort);
    radix_sort(how.threads, pairs, static_cast<int>(std::bit_width(num_tiles - 1)));
    std::vector<tile_range> ranges;
    for (std::size_t i = 0; i < pairs.size();) {
        std::size_t j = i + 1;
        while (j < pairs.size() && pairs[j].key == pairs[i].key) ++j;
        ranges.push_back({pairs[i].key, i, j});
        i = j;
    }
    return ranges;
}

// ---- fragments ------------------------------------------------------------------------------------------------------

// Calls visit(x, y, z, fragment shader's output) for every fragment of one primitive within `box`, a box of voxels of
// the grid. Everything is force-inlined, so that fragment fields that a shader does not read cost nothing.
template <coverage Rule, class Scene, class Visit>
VOXELPIPE_INLINE void shade_fragments(const Scene& s, std::uint32_t id, const core::voxel_box& box, Visit&& visit) {
    using varyings = typename Scene::varyings;
    const auto tri = s.find(id);
    const auto& d = s.draws[tri.draw];
    const auto& vertices = s.vertices[tri.draw];
    const core::snapped_position &a = vertices.positions[tri.index.x], &b = vertices.positions[tri.index.y],
                                 &c = vertices.positions[tri.index.z];
    static constexpr varyings none{};
    fragment<varyings> f{};
    const auto visible = s.numbers_of(tri, id);
    f.triangle = visible.triangle;
    f.draw = tri.draw;
    f.instance = tri.instance;
    f.primitive = visible.primitive;
    for (int i = 0; i < 3; ++i) {
        if constexpr (std::is_empty_v<varyings>)
            f.vertex_varyings[i] = &none;
        else
            f.vertex_varyings[i] = &vertices.varyings[tri.index[i]];
    }
    const auto run = [&](const auto& t) VOXELPIPE_INLINE_LAMBDA {
        f.axis = t.zero_area ? 0 : t.axis;
        f.front_facing = t.normal[2] >= 0;
        f.normal = core::unit_normal(t, s.normal_factors);
        const auto column = [&](std::int64_t u, std::int64_t v, std::int64_t w0,
                                std::int64_t w1) VOXELPIPE_INLINE_LAMBDA {
            f.barycentric = core::barycentric(t, u, v);
            if constexpr (!std::is_empty_v<varyings>)
                f.varyings = core::mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2],
                                       f.barycentric.y, f.barycentric.z);
            for (std::int64_t w = w0; w <= w1; ++w) {
                const auto p = core::to_xyz(t.axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w));
                f.voxel = s.where.offset + glm::ivec3(p[0], p[1], p[2]);
                visit(p[0], p[1], p[2], d.fragment_shader(f));
            }
        };
        core::for_each_span<core::to_rule(Rule)>(t, box, column);
    };
    constexpr auto rule = core::to_rule(Rule);
    if (core::fits_narrow(a, b, c, s.snap.fraction))
        run(core::setup_triangle<rule, std::int64_t>(a, b, c, s.snap.fraction));
    else
        run(core::setup_triangle<rule, int128>(a, b, c, s.snap.fraction));
}

} // namespace voxelpipe::cpu
