// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The passes of tessellation and geometry programs: count, prefix sum, emit. What they emit are ordinary meshes in the
// backend's memory, any range of a draw's primitives at a time, so every strategy, list and solid draws them. The
// functors run by Backend::for_each, the same on every backend. Each program is evaluated by one functor only, so that
// no two copies of its code can round differently.

#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/elements.hpp>
#include <voxelpipe/program.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// What passes count and find wrong: elements of an array of 64-bit words.
enum class program_count : std::uint8_t { left_out, bad_index, bad_level, bad_count, size };
[[nodiscard]] VOXELPIPE_HD constexpr std::size_t index_of(program_count c) { return static_cast<std::size_t>(c); }

namespace passes {

VOXELPIPE_HD inline void add(std::uint64_t* counts, program_count what, std::uint64_t n) {
    if (n != 0) add_shared(counts[index_of(what)], n);
}

// ---- tessellation ---------------------------------------------------------------------------------------------------

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

// ---- geometry programs ----------------------------------------------------------------------------------------------

template <int K, template <class> class Input, class V>
struct geometry_inputs {
    const vertex_output<V>* vertices;
    element_indices<K> in;
    std::uint64_t count;
    // Of a tessellation: the patch of each triangle, and how many patches an instance has. Otherwise null and 0.
    const std::uint32_t* origins;
    std::uint32_t patches_each;
    std::uint32_t draw;
};

// Counts the triangles of all inputs (num_triangles), whose element `all.count` is 0, for the sums; or emits those with
// numbers in [begin, end), of inputs from `first_input` on.
template <class Program, int K, template <class> class Input, class V, class Sink>
struct run_geometry {
    Program program;
    geometry_inputs<K, Input, V> all;
    std::uint32_t* num_triangles; // null: emit
    const std::uint64_t* first_triangle;
    std::uint64_t begin, end, first_input;
    Sink sink;
    glm::uvec3* triangles;
    std::uint32_t* origins; // may be null
    std::uint64_t* counts;
    const std::uint64_t* bound = nullptr; // if it is 0, in the backend's memory, nothing is emitted; may be null

    VOXELPIPE_ANY_CALLABLE
    template <class Index>
    VOXELPIPE_HD void operator()(Index k) const {
        if (num_triangles == nullptr && bound != nullptr && *bound == 0) return;
        const std::uint64_t i = first_input + k;
        if (i == all.count) {
            num_triangles[i] = 0;
            return;
        }
        const auto e = all.in.locate(static_cast<std::uint32_t>(i));
        if (!e.ok) { // left out by a tessellation, or a bad index
            if (num_triangles != nullptr) num_triangles[i] = 0;
            if (all.origins == nullptr) add(counts, program_count::bad_index, 1);
            return;
        }
        Input<V> input{};
        for (int n = 0; n < K; ++n) input.vertices[n] = all.vertices[e.index[n]];
        const std::uint32_t origin = all.origins != nullptr ? all.origins[i] : static_cast<std::uint32_t>(i);
        input.number = all.origins != nullptr ? origin % all.patches_each : e.number;
        input.instance = all.origins != nullptr ? origin / all.patches_each : e.instance;
        input.draw = all.draw;
        const auto made = program(input);
        constexpr int capacity = decltype(made)::capacity;
        const bool is_bad = made.count < 0 || made.count > capacity;
        if (num_triangles != nullptr) {
            num_triangles[i] = is_bad ? 0 : static_cast<std::uint32_t>(made.count);
            add(counts, program_count::bad_count, is_bad ? 1 : 0);
            return;
        }
        for (int t = 0; t < made.count; ++t) {
            const std::uint64_t number = first_triangle[i] + static_cast<std::uint32_t>(t);
            if (number < begin || number >= end) continue;
            const std::uint64_t to = number - begin;
            for (int n = 0; n < 3; ++n) sink.store(3 * to + static_cast<std::uint32_t>(n), made.vertices[3 * t + n]);
            const auto v = static_cast<std::uint32_t>(3 * to);
            triangles[to] = glm::uvec3(v, v + 1, v + 2);
            if (origins != nullptr) origins[to] = origin;
        }
    }
};

// The inputs that triangles [begin, end) come from: [to[0], to[1]). Inputs without triangles share their number with
// the one behind them, which find_owner finds.
struct find_inputs {
    const std::uint64_t* first_triangle;
    std::uint64_t count, begin, end;
    std::uint64_t* to;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const auto n = static_cast<std::uint32_t>(count);
        to[0] = find_owner(first_triangle, n, begin);
        to[1] = std::uint64_t{find_owner(first_triangle, n, end - 1)} + 1;
    }
};

} // namespace passes

// ---- emitted meshes -------------------------------------------------------------------------------------------------

// Triangles of a program, as a mesh. Stored: their varyings, or no_varyings if the shader reads none.
template <class Backend, class Stored>
struct emitted_mesh {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    buffer<glm::vec3> positions;
    buffer<Stored> varyings;
    buffer<glm::uvec3> triangles;
    buffer<std::uint32_t> origins; // input primitive of each triangle, through all instances; empty if not wanted

    emitted_mesh(Backend& backend, std::uint64_t num_vertices, std::uint64_t num_triangles, bool has_origins)
        : positions(backend, num_vertices), varyings(backend, std::is_empty_v<Stored> ? 0 : num_vertices),
          triangles(backend, num_triangles), origins(backend, has_origins ? num_triangles : 0) {}

    [[nodiscard]] passes::mesh_vertices<Stored> sink() { return {positions.data(), varyings.data()}; }
    [[nodiscard]] auto view() const {
        const checked_indices checked{triangles.data(), triangles.size(), positions.size()};
        if constexpr (std::is_empty_v<Stored>) {
            return mesh_view<>{positions.view(), triangles.view(), {}, checked};
        } else {
            const array_view<const Stored> of_vertices = varyings.view();
            return mesh_view<Stored>{positions.view(), triangles.view(), make_pack(of_vertices), checked};
        }
    }
};

// The vertex shader for them.
template <class V>
struct emitted_vertex {
    VOXELPIPE_HD vertex_output<V> operator()(const vertex<V>& v) const { return {v.position, get<0>(v)}; }
};
template <class V>
using emitted_vertex_shader = std::conditional_t<std::is_empty_v<V>, passthrough, emitted_vertex<V>>;

// ---- tessellation of a draw's patches -------------------------------------------------------------------------------

template <class Backend, class Program, class V>
class tessellation_pass {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using W = tessellated<Program, V>;

public:
    // `vertices` and `counts` outlive the pass. Waits.
    tessellation_pass(Backend& backend, const Program& program, const vertex_output<V>* vertices,
                      const element_indices<3>& in, std::uint64_t num_patches, std::uint64_t* counts)
        : backend_(backend), program_(program), vertices_(vertices), in_(in), num_patches_(num_patches),
          levels_(backend, num_patches), first_triangle_(backend, num_patches + 1),
          first_point_(backend, num_patches + 1) {
        buffer<std::uint32_t> num_triangles(backend, num_patches + 1), num_points(backend, num_patches + 1);
        backend.for_each(num_patches + 1,
                         passes::find_levels<Program, V>{program, vertices, in, num_patches, levels_.data(),
                                                         num_triangles.data(), num_points.data(), counts});
        total_ = backend.sum(num_triangles, first_triangle_);
        backend.sum(num_points, first_point_);
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }

    // Triangles [begin, end) as a mesh.
    template <class Stored>
    [[nodiscard]] emitted_mesh<Backend, Stored> emit(std::uint64_t begin, std::uint64_t end, bool has_origins,
                                                     const glm::vec3& outside) const {
        if (begin == end) return {backend_, 0, 0, has_origins};
        const points_range points = points_of(begin, end);
        emitted_mesh<Backend, Stored> m(backend_, points.count + 1, end - begin, has_origins);
        emit_into(points, outside, m.sink(), begin, end, static_cast<std::uint32_t>(points.count), m.triangles.data(),
                  has_origins ? m.origins.data() : nullptr);
        return m;
    }
    // The same for a geometry program. Triangles that are left out have indices beyond all vertices.
    struct joined {
        buffer<vertex_output<W>> vertices;
        buffer<glm::uvec3> triangles;
        buffer<std::uint32_t> origins;
        std::uint32_t num_vertices;
    };
    [[nodiscard]] joined emit_joined(std::uint64_t begin, std::uint64_t end) const {
        if (begin == end) return {{backend_, 0}, {backend_, 0}, {backend_, 0}, 0};
        const points_range points = points_of(begin, end);
        joined j{{backend_, points.count + 1},
                 {backend_, end - begin},
                 {backend_, end - begin},
                 static_cast<std::uint32_t>(points.count)};
        emit_into(points, glm::vec3(0.0f), passes::joined_vertices<W>{j.vertices.data()}, begin, end, ~std::uint32_t{0},
                  j.triangles.data(), j.origins.data());
        return j;
    }

private:
    struct points_range {
        std::uint64_t first, count;
    };
    [[nodiscard]] passes::patches<V> all() const {
        return {
            vertices_,          in_, static_cast<std::uint32_t>(num_patches_), levels_.data(), first_triangle_.data(),
            first_point_.data()};
    }
    [[nodiscard]] points_range points_of(std::uint64_t begin, std::uint64_t end) const {
        buffer<std::uint64_t> range(backend_, 2);
        backend_.for_each(1, passes::find_points<V>{all(), begin, end, range.data()});
        const std::vector<std::uint64_t> host = range.to_host(backend_);
        return {host[0], host[1] - host[0]};
    }
    template <class Sink>
    void emit_into(const points_range& points, const glm::vec3& outside, const Sink& sink, std::uint64_t begin,
                   std::uint64_t end, std::uint32_t left_out, glm::uvec3* triangles, std::uint32_t* origins) const {
        backend_.for_each(points.count + 1, passes::emit_points<Program, V, W, Sink>{program_, all(), points.first,
                                                                                     points.count, outside, sink});
        backend_.for_each(end - begin,
                          passes::emit_triangles<V>{all(), begin, points.first, left_out, triangles, origins});
    }

    Backend& backend_;
    Program program_;
    const vertex_output<V>* vertices_;
    element_indices<3> in_;
    std::uint64_t num_patches_, total_ = 0;
    buffer<std::uint32_t> levels_;
    buffer<std::uint64_t> first_triangle_, first_point_;
};

// ---- a geometry program on a draw's elements ------------------------------------------------------------------------

template <class Backend, class Program, int K, template <class> class Input, class V, class Stored>
class geometry_pass {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using inputs_type = passes::geometry_inputs<K, Input, V>;
    using run_type = passes::run_geometry<Program, K, Input, V, passes::mesh_vertices<Stored>>;

public:
    // What `inputs` and `counts` refer to outlives the pass. Waits.
    geometry_pass(Backend& backend, const Program& program, const inputs_type& inputs, std::uint64_t* counts)
        : backend_(backend), program_(program), inputs_(inputs), counts_(counts),
          first_triangle_(backend, inputs.count + 1) {
        buffer<std::uint32_t> num_triangles(backend, inputs.count + 1);
        backend.for_each(
            inputs.count + 1,
            run_type{
                program, inputs, num_triangles.data(), nullptr, 0, 0, 0, {nullptr, nullptr}, nullptr, nullptr, counts});
        total_ = backend.sum(num_triangles, first_triangle_);
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }

    // Triangles [begin, end) as a mesh.
    [[nodiscard]] emitted_mesh<Backend, Stored> emit(std::uint64_t begin, std::uint64_t end, bool has_origins) const {
        emitted_mesh<Backend, Stored> m(backend_, 3 * (end - begin), end - begin, has_origins);
        if (begin == end) return m;
        buffer<std::uint64_t> range(backend_, 2);
        backend_.for_each(1, passes::find_inputs{first_triangle_.data(), inputs_.count, begin, end, range.data()});
        const std::vector<std::uint64_t> host = range.to_host(backend_);
        backend_.for_each(host[1] - host[0],
                          run_type{program_, inputs_, nullptr, first_triangle_.data(), begin, end, host[0], m.sink(),
                                   m.triangles.data(), has_origins ? m.origins.data() : nullptr, counts_});
        return m;
    }

private:
    Backend& backend_;
    Program program_;
    inputs_type inputs_;
    std::uint64_t* counts_;
    std::uint64_t total_ = 0;
    buffer<std::uint64_t> first_triangle_;
};

} // namespace voxelpipe::core
