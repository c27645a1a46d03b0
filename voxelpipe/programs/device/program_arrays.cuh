// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The programs of a draw in memory of a fixed size: what programs/device/program_async.cuh and
// programs/device/patches.cuh launch. Nothing here waits; what is counted stays on the device.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/fragments/store_lists.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/programs/passes/types.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe {

// Capacities of a call with programs: those of a call that draws the triangles that they make, and room for these.
struct program_limits : workspace_limits {
    // Room of each draw for triangles that its programs make, with those that a tessellation leaves out. The whole room
    // is drawn, and its unused part lies outside of the grid. A room that is much too large takes time.
    std::uint64_t triangles = 0;
    // Points of the patches of each draw with a tessellation, (n + 1)(n + 2) / 2 of one with n^2 triangles. Three a
    // triangle are always enough.
    std::uint64_t lattice_points = 0;
    // Triangles between the two programs of each draw that has both.
    std::uint64_t lattice_triangles = 0;

    // Room for `n` triangles before and behind a geometry program, and a start for the rest.
    [[nodiscard]] static program_limits for_triangles(std::uint64_t n) {
        program_limits l;
        static_cast<workspace_limits&>(l) = workspace_limits::for_triangles(n);
        l.triangles = l.lattice_triangles = n;
        l.lattice_points = 3 * n;
        return l;
    }
};

namespace device {

// ---- what the device finds out --------------------------------------------------------------------------------------

struct lattice_size {
    std::uint64_t triangles, points;
};
// At the start of the workspace.
struct program_state {
    std::uint64_t counts[core::index_of(core::program_count::size)];
    std::uint64_t triangles;         // of all draws
    std::uint64_t capacity;          // the same, as far as there is room
    std::uint64_t largest;           // of a draw
    lattice_size largest_lattice;    // of a draw
    std::uint64_t bytes_before_call; // where the memory of the call that draws begins
    unsigned int stop;               // workspace_view::stop
    unsigned int has_left_out;       // 1 if the triangles hold those that a tessellation leaves out
};
// The triangles and points that are emitted of a draw.
struct program_room {
    std::uint64_t triangles;   // 0 if not all can be
    lattice_size lattice;      // zeros if not all can be
    std::uint32_t moved;       // origin_shader::moved
    std::uint32_t is_unused_1; // so that there is no padding
};

// Decides whether a tessellation fits, once it is counted.
struct make_lattice_room {
    const unsigned long long *triangles, *points; // how many there are
    lattice_size capacity;
    program_state* state;
    program_room* room;

    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const lattice_size size{*triangles, *points};
        lattice_size& most = state->largest_lattice;
        most.triangles = most.triangles > size.triangles ? most.triangles : size.triangles;
        most.points = most.points > size.points ? most.points : size.points;
        const bool fits = size.triangles <= capacity.triangles && size.points <= capacity.points &&
                          state->counts[core::index_of(core::program_count::bad_index)] == 0 &&
                          state->counts[core::index_of(core::program_count::bad_level)] == 0;
        room->lattice = fits ? size : lattice_size{0, 0};
        if (!fits) state->stop = stopped;
    }
};
// Decides whether the triangles of draw number `draw` fit, which come last.
struct make_room {
    const unsigned long long* triangles;
    std::uint64_t capacity;
    std::uint32_t draw;
    program_state* state;
    program_room* room;

    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const std::uint64_t size = *triangles;
        room->moved = static_cast<std::uint32_t>(state->triangles - draw * capacity);
        state->triangles += size;
        state->capacity += capacity;
        state->largest = state->largest > size ? state->largest : size;
        const bool fits = size <= capacity && state->triangles <= core::max_numbered &&
                          state->counts[core::index_of(core::program_count::bad_index)] == 0 &&
                          state->counts[core::index_of(core::program_count::bad_count)] == 0;
        room->triangles = fits ? size : 0;
        if (!fits) state->stop = stopped;
    }
};
// The rest of a geometry program's mesh.
struct leave_out_rest {
    const program_room* room;
    std::uint64_t capacity;
    glm::vec3 outside;
    glm::vec3* positions;
    glm::uvec3* triangles;
    std::uint32_t* origins; // may be null

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == capacity) {
            positions[3 * capacity] = outside;
        } else if (i >= room->triangles) {
            triangles[i] = glm::uvec3(static_cast<std::uint32_t>(3 * capacity));
            if (origins != nullptr) origins[i] = 0;
        }
    }
};
struct note_call {
    program_state* state;
    std::uint64_t bytes_before_call;
    unsigned int has_left_out;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        state->bytes_before_call = bytes_before_call;
        state->has_left_out = has_left_out;
    }
};
// Lists number the triangles of each draw as they were emitted.
struct renumber_primitives {
    const list_counts* counts;
    const program_room* rooms;
    std::uint64_t capacity; // of each draw
    std::uint32_t* primitives;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < counts->fragments) primitives[i] += rooms[primitives[i] / capacity].moved;
    }
};

// ---- the arrays of one draw -----------------------------------------------------------------------------------------

template <class F>
void run_pass(std::uint64_t count, const F& f, cudaStream_t stream) {
    for_each(count, f, stage::vertex_shade, stream);
}

// Counts whose last is 0, and the sums before each.
struct async_sum {
    std::uint32_t n;
    std::uint32_t* counts;
    unsigned long long* sums;
    std::size_t bytes;
    std::uint8_t* storage;

    async_sum(arena& memory, std::uint64_t count)
        : n(static_cast<std::uint32_t>(count)), counts(memory.take<std::uint32_t>(count)),
          sums(memory.take<unsigned long long>(count)), bytes(cell_scan_bytes(n)),
          storage(memory.take<std::uint8_t>(bytes)) {}
    void run(cudaStream_t stream) const { sum_counts(counts, sums, n, storage, bytes, stage::vertex_shade, stream); }
    [[nodiscard]] const std::uint64_t* offsets() const { return reinterpret_cast<const std::uint64_t*>(sums); }
    [[nodiscard]] const unsigned long long* total() const { return sums + n - 1; }
};

// A mesh of a fixed size that programs emit. Its indices are not said to be checked, so that the call looks at the flag
// for bad ones, where `stop` arrives.
template <class Stored>
struct async_mesh {
    std::uint64_t num_vertices, num_triangles;
    glm::vec3* positions;
    Stored* varyings;
    glm::uvec3* triangles;
    std::uint32_t* origins;

    async_mesh(arena& memory, std::uint64_t vertices, std::uint64_t num_triangles_, bool has_origins)
        : num_vertices(vertices), num_triangles(num_triangles_), positions(memory.take<glm::vec3>(vertices)),
          varyings(memory.take<Stored>(std::is_empty_v<Stored> ? 0 : vertices)),
          triangles(memory.take<glm::uvec3>(num_triangles)),
          origins(has_origins ? memory.take<std::uint32_t>(num_triangles) : nullptr) {}
    [[nodiscard]] core::passes::mesh_vertices<Stored> sink() const { return {positions, varyings}; }
    [[nodiscard]] auto view() const {
        const backend_view<const glm::vec3> p{positions, num_vertices};
        const backend_view<const glm::uvec3> t{triangles, num_triangles};
        if constexpr (std::is_empty_v<Stored>) {
            return mesh_view<>{p, t};
        } else {
            return mesh_view<Stored>{p, t, core::make_pack(array_view<const Stored>(varyings, num_vertices))};
        }
    }
};

// The patches of a draw, and the points and triangles that `Sink` takes.
template <class Program, class V>
struct async_lattice {
    using W = core::tessellated<Program, V>;
    Program program;
    const vertex_output<V>* vertices;
    core::element_indices<3> in;
    std::uint64_t num_patches;
    std::uint32_t* levels;
    async_sum triangles, points;

    async_lattice(arena& memory, const Program& p, const vertex_output<V>* v, const core::element_indices<3>& in_,
                  std::uint64_t num)
        : program(p), vertices(v), in(in_), num_patches(num), levels(memory.take<std::uint32_t>(num)),
          triangles(memory, num + 1), points(memory, num + 1) {}
    void count(program_state* state, const lattice_size& capacity, program_room* room, cudaStream_t stream) const {
        run_pass(num_patches + 1,
                 core::passes::find_levels<Program, V>{program, vertices, in, num_patches, levels, triangles.counts,
                                                       points.counts, state->counts},
                 stream);
        triangles.run(stream);
        points.run(stream);
        run_pass(1, make_lattice_room{triangles.total(), points.total(), capacity, state, room}, stream);
    }
    [[nodiscard]] core::passes::patches<V> patches() const {
        return {vertices, in, static_cast<std::uint32_t>(num_patches), levels, triangles.offsets(), points.offsets()};
    }
    template <class Sink>
    void emit(const lattice_size& capacity, const program_room* room, const glm::vec3& outside, const Sink& sink,
              std::uint32_t left_out, glm::uvec3* to, std::uint32_t* origins, cudaStream_t stream) const {
        const core::passes::patches<V> all = patches();
        run_pass(capacity.points + 1,
                 core::passes::emit_points<Program, V, W, Sink>{program, all, 0, capacity.points, outside, sink,
                                                                &room->lattice.points},
                 stream);
        run_pass(capacity.triangles,
                 core::passes::emit_triangles<V>{all, 0, 0, left_out, to, origins, &room->lattice.triangles}, stream);
    }
};

// The inputs of a geometry program.
template <class Program, int K, template <class> class Input, class V, class Stored>
struct async_geometry {
    using run_type = core::passes::run_geometry<Program, K, Input, V, core::passes::mesh_vertices<Stored>>;
    Program program;
    core::passes::geometry_inputs<K, Input, V> inputs;
    async_sum triangles;

    async_geometry(arena& memory, const Program& p, const core::passes::geometry_inputs<K, Input, V>& in)
        : program(p), inputs(in), triangles(memory, in.count + 1) {}
    void count(program_state* state, cudaStream_t stream) const {
        run_pass(inputs.count + 1,
                 run_type{program,
                          inputs,
                          triangles.counts,
                          nullptr,
                          0,
                          0,
                          0,
                          {nullptr, nullptr},
                          nullptr,
                          nullptr,
                          state->counts},
                 stream);
        triangles.run(stream);
    }
    void emit(program_state* state, const program_room* room, const glm::vec3& outside, const async_mesh<Stored>& to,
              cudaStream_t stream) const {
        run_pass(inputs.count,
                 run_type{program, inputs, nullptr, triangles.offsets(), 0, to.num_triangles, 0, to.sink(),
                          to.triangles, to.origins, state->counts, &room->triangles},
                 stream);
        run_pass(to.num_triangles + 1,
                 leave_out_rest{room, to.num_triangles, outside, to.positions, to.triangles, to.origins}, stream);
    }
};

// ---- one draw -------------------------------------------------------------------------------------------------------

// Has room for all that a draw's programs need; launch() runs them, and `mesh` is what they make.
template <class Mesh, class VertexShader, class Stored>
struct async_draw_base {
    using V = typename core::shaded<Mesh, VertexShader>::varyings;
    using elements = core::elements_of<Mesh>;
    using vertices_type = std::remove_const_t<decltype(elements::vertices(std::declval<const Mesh&>()))>;
    Mesh input;
    VertexShader shader;
    std::uint32_t draw;
    core::element_indices<elements::size> in;
    std::uint64_t num_inputs, num_vertices;
    vertex_output<V>* vertices;

    async_draw_base(arena& memory, const Mesh& m, const VertexShader& s, std::uint32_t d)
        : input(m), shader(s), draw(d), in(elements::indices(m)), num_inputs(elements::count(m) * m.copies.count),
          num_vertices(m.positions.size() * m.copies.count), vertices(memory.take<vertex_output<V>>(num_vertices)) {}
    void shade(cudaStream_t stream) const {
        run_pass(
            num_vertices,
            core::shade_elements<vertices_type, VertexShader, V>{elements::vertices(input), shader, draw, vertices},
            stream);
    }
};

template <class Mesh, class VertexShader, class Amplify, class Stored>
struct async_draw;
template <class Mesh, class VertexShader, class Program, class Stored>
struct async_draw<Mesh, VertexShader, tessellate<Program>, Stored> : async_draw_base<Mesh, VertexShader, Stored> {
    using base = async_draw_base<Mesh, VertexShader, Stored>;
    async_lattice<Program, typename base::V> lattice;
    lattice_size capacity;
    async_mesh<Stored> mesh;

    async_draw(arena& memory, const Mesh& m, const VertexShader& s, const tessellate<Program>& amplify, std::uint32_t d,
               const program_limits& limits, bool has_origins)
        : base(memory, m, s, d),
          lattice(memory, amplify.program, this->vertices, this->in, this->num_inputs), capacity{limits.triangles,
                                                                                                 limits.lattice_points},
          mesh(memory, capacity.points + 1, capacity.triangles, has_origins) {}
    void launch(program_state* state, program_room* room, const glm::vec3& outside, cudaStream_t stream) const {
        this->shade(stream);
        lattice.count(state, capacity, room, stream);
        run_pass(1, make_room{lattice.triangles.total(), capacity.triangles, this->draw, state, room}, stream);
        lattice.emit(capacity, room, outside, mesh.sink(), static_cast<std::uint32_t>(capacity.points), mesh.triangles,
                     mesh.origins, stream);
    }
};
template <class Mesh, class VertexShader, class Program, class Stored>
struct async_draw<Mesh, VertexShader, voxelpipe::geometry<Program>, Stored>
    : async_draw_base<Mesh, VertexShader, Stored> {
    using base = async_draw_base<Mesh, VertexShader, Stored>;
    using types = core::program_types<Mesh, VertexShader, voxelpipe::geometry<Program>>;
    async_geometry<Program, types::size, types::template input, typename base::V, Stored> made;
    async_mesh<Stored> mesh;

    async_draw(arena& memory, const Mesh& m, const VertexShader& s, const voxelpipe::geometry<Program>& amplify,
               std::uint32_t d, const program_limits& limits, bool has_origins)
        : base(memory, m, s, d),
          made(memory, amplify.program, {this->vertices, this->in, this->num_inputs, nullptr, 0, d}),
          mesh(memory, 3 * limits.triangles + 1, limits.triangles, has_origins) {}
    void launch(program_state* state, program_room* room, const glm::vec3& outside, cudaStream_t stream) const {
        this->shade(stream);
        made.count(state, stream);
        run_pass(1, make_room{made.triangles.total(), mesh.num_triangles, this->draw, state, room}, stream);
        made.emit(state, room, outside, mesh, stream);
    }
};
template <class Mesh, class VertexShader, class T, class G, class Stored>
struct async_draw<Mesh, VertexShader, tessellate_then_geometry<T, G>, Stored>
    : async_draw_base<Mesh, VertexShader, Stored> {
    using base = async_draw_base<Mesh, VertexShader, Stored>;
    using W = core::tessellated<T, typename base::V>;
    async_lattice<T, typename base::V> lattice;
    lattice_size capacity;
    vertex_output<W>* points;
    glm::uvec3* triangles;
    std::uint32_t* origins;
    async_geometry<G, 3, voxelpipe::triangle, W, Stored> made;
    async_mesh<Stored> mesh;

    async_draw(arena& memory, const Mesh& m, const VertexShader& s, const tessellate_then_geometry<T, G>& amplify,
               std::uint32_t d, const program_limits& limits, bool has_origins)
        : base(memory, m, s, d), lattice(memory, amplify.first.program, this->vertices, this->in, this->num_inputs),
          capacity{limits.lattice_triangles, limits.lattice_points},
          points(memory.take<vertex_output<W>>(capacity.points + 1)),
          triangles(memory.take<glm::uvec3>(capacity.triangles)),
          origins(memory.take<std::uint32_t>(capacity.triangles)),
          made(memory, amplify.second.program,
               {points,
                {reinterpret_cast<const std::uint32_t*>(triangles), 3 * capacity.triangles, 3,
                 static_cast<std::uint32_t>(capacity.triangles), static_cast<std::uint32_t>(capacity.points)},
                capacity.triangles,
                origins,
                this->in.each,
                d}),
          mesh(memory, 3 * limits.triangles + 1, limits.triangles, has_origins) {}
    void launch(program_state* state, program_room* room, const glm::vec3& outside, cudaStream_t stream) const {
        this->shade(stream);
        lattice.count(state, capacity, room, stream);
        lattice.emit(capacity, room, glm::vec3(0.0f), core::passes::joined_vertices<W>{points}, ~std::uint32_t{0},
                     triangles, origins, stream);
        made.count(state, stream);
        run_pass(1, make_room{made.triangles.total(), mesh.num_triangles, this->draw, state, room}, stream);
        made.emit(state, room, outside, mesh, stream);
    }
};

} // namespace device
} // namespace voxelpipe
