// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize with a program between the vertex shader and the rasterizer. The triangles that the programs make are
// numbered by draw, instance, input primitive, and lattice or emission number. If all of them fit at once, they are
// drawn like any mesh. If not, they are made and listed a chunk at a time, and the fragments of all chunks are sorted
// and folded at the end: results are the same.

#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/fragment_pool.hpp>
#include <voxelpipe/program_parts.hpp>
#include <voxelpipe/program_passes.hpp>
#include <voxelpipe/sparse.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe {

// Options of calls with programs.
struct program_options : voxelize_options {
    // Most triangles of the programs that are in memory at once, at least 1 and at most 2^30. They take some 30 bytes
    // each, and what the vertices' varyings take. Results do not depend on it.
    std::uint64_t chunk_triangles = std::uint64_t{1} << 24;
    // Bytes, about, that the lists of a call in more than one chunk may take at once; 0: what there is. If there are
    // more fragments, the grid is drawn in parts, and the programs run again for each. Results do not depend on it.
    std::uint64_t list_bytes = 0;

    program_options() = default;
    // A coverage alone, or options of a call without programs, may be given in their place.
    program_options(const voxelize_options& o) : voxelize_options(o) {} // NOLINT(*-explicit-*)
    program_options(coverage rule_) : voxelize_options{rule_, true} {}  // NOLINT(*-explicit-*)
    program_options(coverage rule_, std::uint64_t chunk_triangles_, std::uint64_t list_bytes_ = 0)
        : voxelize_options{rule_, true}, chunk_triangles(chunk_triangles_), list_bytes(list_bytes_) {}
};

namespace core {

// The input of a geometry program for elements of a view.
template <int K>
struct input_of_size;
template <>
struct input_of_size<1> {
    template <class V>
    using type = point<V>;
};
template <>
struct input_of_size<2> {
    template <class V>
    using type = line<V>;
};
template <>
struct input_of_size<3> {
    template <class V>
    using type = triangle<V>;
};

template <class Mesh, class VertexShader, class Amplify>
struct program_types {
    static constexpr int size = elements_of<Mesh>::size;
    template <class V>
    using input = typename input_of_size<size>::template type<V>;
    using shaded_varyings = typename shaded<Mesh, VertexShader>::varyings;
    using result = amplified<Amplify, input, shaded_varyings>;
    using varyings = typename result::template varyings<>;
};

// Gives a fragment the numbers of the whole call. `origins`: input primitive of each triangle of the mesh that is
// drawn.
template <class FragmentShader>
struct origin_shader {
    FragmentShader shader;
    const std::uint32_t* origins;
    std::uint32_t each; // input primitives of an instance
    std::uint32_t draw, first_primitive;
    const std::uint32_t* moved = nullptr; // added to the primitives, in the backend's memory; null: nothing

    VOXELPIPE_ANY_CALLABLE
    template <class V>
    VOXELPIPE_HD auto operator()(const fragment<V>& drawn) const {
        fragment<V> f = drawn;
        const std::uint32_t origin = origins[drawn.triangle];
        f.triangle = origin % each;
        f.instance = origin / each;
        f.draw = draw;
        f.primitive = drawn.primitive + first_primitive + (moved != nullptr ? *moved : 0);
        return shader(f);
    }
};

// A draw's shader for its emitted meshes. Shaders that give constants, and solids' shaders, need neither varyings nor
// numbers, and are drawn by the code that draws other meshes.
template <class FragmentShader, class V, bool IsPlain>
struct emitted_shader {
    using type = origin_shader<FragmentShader>;
    using stored = V;
};
template <class FragmentShader, class V>
struct emitted_shader<FragmentShader, V, true> {
    using type = FragmentShader;
    using stored = no_varyings;
};

// A position whose voxels lie before the grid on every axis, for triangles that are left out.
[[nodiscard]] inline glm::vec3 position_outside(const grid& g) {
    glm::vec3 p(0.0f);
    for (int a = 0; a < 3; ++a) {
        double distance = 4.0 * g.voxel_size[a];
        do {
            p[a] = static_cast<float>(g.origin[a] - distance);
            distance *= 2.0;
        } while (static_cast<double>(p[a]) > g.origin[a] - 4.0 * g.voxel_size[a] &&
                 distance < std::numeric_limits<double>::max());
    }
    return p;
}

// ---- the triangles of one draw --------------------------------------------------------------------------------------

// Makes the triangles of a draw, any chunk at a time. Stored: varyings of its meshes.
template <class Backend, class Mesh, class VertexShader, class Stored>
class program_draw_base {
protected:
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using V = typename shaded<Mesh, VertexShader>::varyings;
    using elements = elements_of<Mesh>;

    // Runs the vertex shader.
    program_draw_base(Backend& backend, const Mesh& mesh, const VertexShader& shader, std::uint32_t draw)
        : backend_(backend), in_(elements::indices(mesh)), num_inputs_(elements::count(mesh) * mesh.copies.count),
          draw_(draw), vertices_(backend, mesh.positions.size() * mesh.copies.count) {
        const auto of_vertices = elements::vertices(mesh);
        backend.for_each(vertices_.size(), shade_elements<std::remove_const_t<decltype(of_vertices)>, VertexShader, V>{
                                               of_vertices, shader, draw, vertices_.data()});
    }

    Backend& backend_;
    element_indices<elements::size> in_;
    std::uint64_t num_inputs_;
    std::uint32_t draw_;
    buffer<vertex_output<V>> vertices_;
};

// total(): how many there are. is_one(most): they are one chunk. for_each_chunk(most, has_origins, visit) calls
// visit(first, mesh) for ranges of them.
template <class Backend, class Mesh, class VertexShader, class Amplify, class Stored>
class program_draw;

template <class Backend, class Mesh, class VertexShader, class Program, class Stored>
class program_draw<Backend, Mesh, VertexShader, tessellate<Program>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader, const tessellate<Program>& amplify,
                 std::uint32_t draw, std::uint64_t* counts, std::uint64_t)
        : base(backend, mesh, shader, draw),
          pass_(backend, amplify.program, this->vertices_.data(), this->in_, this->num_inputs_, counts) {}
    [[nodiscard]] std::uint64_t total() const { return pass_.total(); }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return total() <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3& outside, const Visit& visit) const {
        for (std::uint64_t first = 0; first < total(); first += most)
            visit(first, pass_.template emit<Stored>(first, std::min(total(), first + most), has_origins, outside));
    }

private:
    tessellation_pass<Backend, Program, typename base::V> pass_;
};

template <class Backend, class Mesh, class VertexShader, class Program, class Stored>
class program_draw<Backend, Mesh, VertexShader, geometry<Program>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;
    using types = program_types<Mesh, VertexShader, geometry<Program>>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader, const geometry<Program>& amplify,
                 std::uint32_t draw, std::uint64_t* counts, std::uint64_t)
        : base(backend, mesh, shader, draw),
          pass_(backend, amplify.program, {this->vertices_.data(), this->in_, this->num_inputs_, nullptr, 0, draw},
                counts) {}
    [[nodiscard]] std::uint64_t total() const { return pass_.total(); }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return total() <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3&, const Visit& visit) const {
        for (std::uint64_t first = 0; first < total(); first += most)
            visit(first, pass_.emit(first, std::min(total(), first + most), has_origins));
    }

private:
    geometry_pass<Backend, Program, types::size, types::template input, typename base::V, Stored> pass_;
};

// The tessellation is made in chunks as well; the geometry program runs on each.
template <class Backend, class Mesh, class VertexShader, class T, class G, class Stored>
class program_draw<Backend, Mesh, VertexShader, tessellate_then_geometry<T, G>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;
    using first_pass = tessellation_pass<Backend, T, typename base::V>;
    using W = tessellated<T, typename base::V>;
    using second_pass = geometry_pass<Backend, G, 3, triangle, W, Stored>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader,
                 const tessellate_then_geometry<T, G>& amplify, std::uint32_t draw, std::uint64_t* counts,
                 std::uint64_t most)
        : base(backend, mesh, shader, draw), program_(amplify.second.program), counts_(counts), most_(most),
          pass_(backend, amplify.first.program, this->vertices_.data(), this->in_, this->num_inputs_, counts) {
        for_each_part([&](std::uint64_t, const second_pass& pass) { total_ += pass.total(); });
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return pass_.total() <= most && total_ <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3&, const Visit& visit) const {
        for_each_part([&](std::uint64_t before, const second_pass& pass) {
            for (std::uint64_t first = 0; first < pass.total(); first += most)
                visit(before + first, pass.emit(first, std::min(pass.total(), first + most), has_origins));
        });
    }

private:
    // Calls visit(triangles before, pass) for the geometry pass of each chunk of the tessellation.
    template <class Visit>
    void for_each_part(const Visit& visit) const {
        std::uint64_t before = 0;
        for (std::uint64_t first = 0; first < pass_.total(); first += most_) {
            const std::uint64_t last = std::min(pass_.total(), first + most_);
            const auto joined = pass_.emit_joined(first, last);
            const auto count = static_cast<std::uint32_t>(last - first);
            const element_indices<3> in{reinterpret_cast<const std::uint32_t*>(joined.triangles.data()),
                                        std::uint64_t{3} * count, 3, count, joined.num_vertices};
            const second_pass pass(
                this->backend_, program_,
                {joined.vertices.data(), in, count, joined.origins.data(), this->in_.each, this->draw_}, counts_);
            visit(before, pass);
            before += pass.total();
        }
    }

    G program_;
    std::uint64_t* counts_;
    std::uint64_t most_, total_ = 0;
    first_pass pass_;
};

// ---- the call -------------------------------------------------------------------------------------------------------

template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] status validate_program_draws(std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws) {
    using elements = elements_of<Mesh>;
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    std::uint64_t inputs = 0;
    for (const auto& d : draws) {
        // Instances that are too many are refused below, as inputs.
        using plain = draw<typename elements::vertices_type, VertexShader, none>;
        const plain vertices{elements::vertices(d.mesh), d.vertex_shader, {}};
        if (const status s = validate_draws(std::span<const plain>(&vertices, 1)); !s.ok()) return s;
        if (!elements::has_memory(d.mesh)) return failure(status_code::null_view);
        if (vertices.mesh.part.whole != 0) return failure(status_code::bad_subset);
        const std::uint64_t each = elements::count(d.mesh);
        if (each > most || (each != 0 && d.mesh.copies.count > (most - inputs) / each)) {
            status s = failure(status_code::too_many_triangles);
            const auto all = static_cast<uint128>(each) * d.mesh.copies.count + inputs;
            s.counts.triangles_in = all > ~std::uint64_t{0} ? ~std::uint64_t{0} : static_cast<std::uint64_t>(all);
            return s;
        }
        inputs += each * d.mesh.copies.count;
    }
    return {};
}

// Names the bad triangle of a mesh; other elements have no name in a status.
template <class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] status
name_bad_input(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws, status s) {
    if constexpr (is_mesh_view<Mesh>) {
        std::vector<draw<Mesh, VertexShader, none>> plain;
        for (const auto& d : draws) plain.push_back({d.mesh, d.vertex_shader, {}});
        return name_bad_triangle(backend, std::span<const draw<Mesh, VertexShader, none>>(plain), s);
    } else {
        return s;
    }
}

// What was found wrong while the triangles were counted.
[[nodiscard]] inline status check_counts(const std::vector<std::uint64_t>& counts, std::uint64_t total) {
    const auto has = [&](program_count c) { return counts[index_of(c)] != 0; };
    status s;
    if (has(program_count::bad_index))
        s = failure(status_code::index_out_of_range, stage::vertex_shade);
    else if (has(program_count::bad_level))
        s = failure(status_code::bad_level, stage::vertex_shade);
    else if (has(program_count::bad_count))
        s = failure(status_code::bad_count, stage::vertex_shade);
    else if (total > std::numeric_limits<std::uint32_t>::max())
        s = failure(status_code::too_many_triangles, stage::vertex_shade);
    s.counts.triangles_in = total;
    return s;
}

// True if the emitted triangles hold those that a tessellation leaves out. They are no input of a geometry program.
template <class Amplify>
inline constexpr bool counts_left_out = true;
template <class Tessellation, class Geometry>
inline constexpr bool counts_left_out<tessellate_then_geometry<Tessellation, Geometry>> = false;

// Triangles that are left out lie outside of the grid, and are none of those that are counted there.
[[nodiscard]] inline status without_left_out(status s, std::uint64_t left_out) {
    s.counts.triangles_in -= std::min(s.counts.triangles_in, left_out);
    s.counts.triangles_outside -= std::min(s.counts.triangles_outside, left_out);
    return s;
}

// The emitted triangles of all draws. IsPlain: the shader needs no varyings and no numbers.
template <class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify, bool IsPlain>
class program_call {
    using draw_type = draw<Mesh, VertexShader, FragmentShader, Amplify>;
    using varyings = typename program_types<Mesh, VertexShader, Amplify>::varyings;
    using shader = emitted_shader<FragmentShader, varyings, IsPlain>;
    using stored = typename shader::stored;
    using mesh_type = emitted_mesh<Backend, stored>;
    using vertex_shader = emitted_vertex_shader<stored>;
    using view_type = decltype(std::declval<const mesh_type&>().view());
    using amplified_type = program_draw<Backend, Mesh, VertexShader, Amplify, stored>;

public:
    using emitted_draw = draw<view_type, vertex_shader, typename shader::type>;

    // Counts all triangles; state() tells whether the call can go on. Waits.
    program_call(Backend& backend, std::span<const draw_type> draws, const grid& g, std::uint64_t chunk_triangles)
        : backend_(backend), draws_(draws),
          most_(std::clamp<std::uint64_t>(chunk_triangles, 1, std::uint64_t{1} << 30)), outside_(position_outside(g)),
          counts_(backend, array_view<const std::uint64_t>(zeros.data(), zeros.size())) {
        std::uint64_t total = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            amplified_.push_back(std::make_unique<amplified_type>(backend, draws[d].mesh, draws[d].vertex_shader,
                                                                  draws[d].amplify, static_cast<std::uint32_t>(d),
                                                                  counts_.data(), most_));
            total += amplified_.back()->total();
        }
        const std::vector<std::uint64_t> counts = counts_.to_host(backend);
        if (counts_left_out<Amplify>) left_out_ = counts[index_of(program_count::left_out)];
        state_ = check_counts(counts, total);
    }
    [[nodiscard]] const status& state() const { return state_; }
    [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
    // True if each draw is one chunk, and all of them together are not more.
    [[nodiscard]] bool fits() const {
        return state_.counts.triangles_in <= most_ &&
               std::all_of(amplified_.begin(), amplified_.end(), [&](const auto& d) { return d->is_one(most_); });
    }

    // Calls run(draws) with all triangles, one mesh a draw.
    template <class Run>
    [[nodiscard]] status draw_at_once(const Run& run) const {
        std::vector<mesh_type> meshes;
        std::vector<emitted_draw> emitted;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            mesh_type none(backend_, 0, 0, false);
            meshes.push_back(std::move(none));
            amplified_[d]->for_each_chunk(most_, !IsPlain, outside_,
                                          [&](std::uint64_t, mesh_type&& m) { meshes.back() = std::move(m); });
        }
        for (std::size_t d = 0; d < draws_.size(); ++d) emitted.push_back(draw_of_mesh(meshes[d], d, 0));
        return without_left_out(run(std::span<const emitted_draw>(emitted)), left_out_);
    }
    // Calls run(draw, first primitive) for each chunk, until a status is not ok.
    template <class Run>
    [[nodiscard]] status draw_in_chunks(const Run& run) const {
        status s;
        std::uint64_t before = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            amplified_[d]->for_each_chunk(most_, !IsPlain, outside_, [&](std::uint64_t first, const mesh_type& m) {
                if (s.ok()) s = run(draw_of_mesh(m, d, before + first), static_cast<std::uint32_t>(before + first));
            });
            before += amplified_[d]->total();
        }
        return s;
    }

private:
    static constexpr std::array<std::uint64_t, index_of(program_count::size)> zeros{};

    [[nodiscard]] emitted_draw draw_of_mesh(const mesh_type& m, std::size_t d, std::uint64_t first) const {
        if constexpr (IsPlain) {
            return {m.view(), {}, draws_[d].fragment_shader};
        } else {
            const auto each = static_cast<std::uint32_t>(elements_of<Mesh>::count(draws_[d].mesh));
            return {m.view(),
                    {},
                    {draws_[d].fragment_shader, m.origins.data(), each, static_cast<std::uint32_t>(d),
                     static_cast<std::uint32_t>(first), nullptr}};
        }
    }

    Backend& backend_;
    std::span<const draw_type> draws_;
    std::uint64_t most_;
    glm::vec3 outside_;
    typename Backend::template buffer<std::uint64_t> counts_;
    std::vector<std::unique_ptr<amplified_type>> amplified_;
    std::uint64_t left_out_ = 0;
    status state_;
};

// Checks of a call, as check_shaders: one readable line for the first mistake.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] constexpr bool check_program() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        using types = program_types<Mesh, VertexShader, Amplify>;
        if constexpr (types::result::check()) {
            using fragment_type = fragment<typename types::varyings>;
            constexpr bool copyable = std::is_trivially_copyable_v<FragmentShader>;
            static_assert(copyable, "voxelpipe: a fragment shader must be trivially copyable");
            constexpr bool callable = std::is_invocable_v<const FragmentShader&, const fragment_type&>;
            static_assert(callable,
                          "voxelpipe: the fragment shader cannot be called with const fragment<Varyings>& (is its "
                          "operator() const, and does it take the varyings that the program makes?)");
            if constexpr (copyable && callable) {
                using result = std::remove_cvref_t<std::invoke_result_t<const FragmentShader&, const fragment_type&>>;
                static_assert(is_output<result>,
                              "voxelpipe: a fragment shader must return vp::outputs(...), one value per render target");
                return is_output<result>;
            }
        }
    }
    return false;
}
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
using program_output = std::remove_cvref_t<std::invoke_result_t<
    const FragmentShader&, const fragment<typename program_types<Mesh, VertexShader, Amplify>::varyings>&>>;

// What is checked of each kind of output before a call runs.
template <class Output>
struct output_kind {
    static constexpr bool is_known = false;
};
template <class... Targets>
struct output_kind<framebuffer_view<Targets...>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_targets<Targets...>();
    }
    [[nodiscard]] static status validate(const framebuffer_view<Targets...>& fb, const grid& g) {
        return validate_framebuffer(fb, g);
    }
};
template <class Backend, class Payload>
struct output_kind<abuffer<Backend, Payload>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_payload<Payload>();
    }
    [[nodiscard]] static status validate(const abuffer<Backend, Payload>&, const grid&) { return {}; }
};
template <class Backend, class... Targets>
struct output_kind<sparse_framebuffer<Backend, Targets...>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_targets<Targets...>();
    }
    [[nodiscard]] static status validate(const sparse_framebuffer<Backend, Targets...>& fb, const grid& g) {
        return validate_sparse(fb, g);
    }
};
template <class Backend, class... Targets, class ShaderOutput>
struct pooled<sparse_framebuffer<Backend, Targets...>, ShaderOutput> {
    using payload = typename outputs_payload<ShaderOutput>::type;
};
template <class Backend, class Payload, class... Targets>
[[nodiscard]] status store_pooled(Backend& backend, const grid& g, abuffer<Backend, Payload>&& lists,
                                  sparse_framebuffer<Backend, Targets...>& fb, bool count_voxels, status s) {
    s.counts.fragments = lists.num_fragments();
    s.counts.voxels = count_voxels ? lists.num_voxels() : 0;
    return backend.store_sparse(g, lists, fb, s);
}

// A framebuffer is drawn into through its view.
template <class Output>
[[nodiscard]] Output& drawn_output(Output& out) {
    return out;
}
template <class Backend, class... Targets>
[[nodiscard]] const framebuffer_view<Targets...>& drawn_output(framebuffer<Backend, Targets...>& fb) {
    return fb.view();
}

// What every call with programs, points or lines checks first.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify, class Output>
[[nodiscard]] status validate_call(std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws,
                                   const grid& g, const Output& out) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = output_kind<Output>::validate(out, g); !s.ok()) return s;
    return validate_program_draws(draws);
}

// The shader of lists for an output: the lists' payload is a shader's one output, or all of them.
template <class Output>
struct listing {
    template <class FragmentShader>
    using shader = payload_shader<FragmentShader>;
};
template <class Backend, class Payload>
struct listing<abuffer<Backend, Payload>> {
    template <class FragmentShader>
    using shader = FragmentShader;
};

// A call whose triangles are `chunk` at most at once. Sets `has_written` once a target has been written.
template <coverage... Known, class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify,
          class Output>
[[nodiscard]] status
run_in_chunks(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws, const grid& g,
              Output& out, const program_options& options, std::uint64_t chunk, bool& has_written) {
    using output_type = std::remove_const_t<Output>;
    using call_type = program_call<Backend, Mesh, VertexShader, FragmentShader, Amplify, is_constant<FragmentShader>>;
    using emitted_draw = typename call_type::emitted_draw;
    using payload = typename pooled<output_type, program_output<Mesh, VertexShader, FragmentShader, Amplify>>::payload;
    const voxelize_options& plain = options;
    if constexpr (requires { backend.template draw_patches<Known...>(draws, g, out, plain, chunk); }) {
        // Without their triangles in memory, if the backend knows how.
        const std::optional<status> s = backend.template draw_patches<Known...>(draws, g, out, plain, chunk);
        if (s) return s->ok() ? *s : name_bad_input(backend, draws, *s);
    }
    const call_type call(backend, draws, g, chunk);
    if (!call.state().ok()) return name_bad_input(backend, draws, call.state());
    if (call.fits())
        return call.draw_at_once(
            [&](std::span<const emitted_draw> emitted) { return voxelize<Known...>(backend, emitted, g, out, plain); });

    const auto list_chunks = [&]<class View, class Shader, class Emitted>(
                                 std::type_identity<draw<View, Shader, Emitted>>, const grid& part, const auto& take) {
        using listed = typename listing<output_type>::template shader<Emitted>;
        using listed_draw = draw<View, Shader, listed>;
        return call.draw_in_chunks([&](const emitted_draw& made, std::uint32_t first) {
            const listed_draw d{made.mesh, made.vertex_shader, listed{made.fragment_shader}};
            abuffer<Backend, payload> lists(backend);
            const status of_chunk =
                voxelize<Known...>(backend, std::span<const listed_draw>(&d, 1), part, lists, plain);
            if (of_chunk.ok()) take(std::move(lists), first, of_chunk.counts);
            return of_chunk;
        });
    };
    const auto list = [&](const grid& part, const auto& take) {
        return list_chunks(std::type_identity<emitted_draw>{}, part, take);
    };
    // Voxels, offsets, primitives and payloads of the lists, the same in one array of all, and two of keys and numbers
    // for the sort.
    constexpr std::uint64_t bytes_each = 48 + 2 * (4 + sizeof(payload_storage<payload>));
    const std::uint64_t most = options.list_bytes == 0 ? ~std::uint64_t{0} : options.list_bytes / bytes_each;
    part_store<Backend, payload, output_type> store(backend, out);
    status all;
    part_drawing<Backend, payload, decltype(store), decltype(list)> parts(backend, g, store, list, most);
    status s = parts.draw(all.counts);
    all.counts.triangles_in = call.state().counts.triangles_in;
    if (s.ok())
        s = store.finish(backend, g, plain.count_voxels, without_left_out(all, call.left_out()));
    else
        s.counts = {.triangles_in = all.counts.triangles_in - call.left_out()};
    has_written = store.has_written();
    return s;
}
template <coverage... Known, class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify,
          class Output>
[[nodiscard]] status run_program(Backend& backend,
                                 std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws,
                                 const grid& g, Output& out, const program_options& options) {
    // If there is no memory for a chunk, smaller ones may do.
    constexpr std::uint64_t least = 1024;
    for (std::uint64_t chunk = options.chunk_triangles;; chunk /= 16) {
        bool has_written = false;
        const bool is_last = chunk <= least;
        try {
            const status s = run_in_chunks<Known...>(backend, draws, g, out, options, chunk, has_written);
            if (s.code != status_code::out_of_memory || is_last || has_written) return s;
        } catch (const std::bad_alloc&) {
            if (is_last || has_written) throw;
        }
    }
}

template <class T>
inline constexpr bool is_program_draw = false;
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
inline constexpr bool is_program_draw<draw<Mesh, VertexShader, FragmentShader, Amplify>> = is_amplifier<Amplify>;
template <class Range>
concept program_draw_range = requires(const Range& r) {
    requires is_program_draw<draw_of<Range>>;
    std::size(r);
}
&&!std::is_same_v<Range, std::span<const draw_of<Range>>>;

// A view of a mesh, points or lines, of what owns or views them.
template <class View>
[[nodiscard]] const View& view_of(const View& v) {
    return v;
}
template <class Backend, class... Attributes>
[[nodiscard]] mesh_view<Attributes...> view_of(const mesh<Backend, Attributes...>& m) {
    return m.view();
}
template <class View>
using view_type_of = std::remove_cvref_t<decltype(view_of(std::declval<const View&>()))>;

} // namespace core

// Draws what programs make of meshes, lines or points, into a framebuffer, a framebuffer_view, an A-buffer or a sparse
// framebuffer. Fragments have the number of the input primitive (triangle), its instance and draw; `primitive` numbers
// the triangles that the programs make. counts.triangles_in counts those, without the ones that a tessellation leaves
// out. Beside the errors of voxelize: bad_level, bad_count, and too_many_triangles for more than 2^32 - 1 triangles,
// whose true number is in counts.triangles_in. A call that fails has written nothing, unless the memory runs out while
// parts of the grid are drawn. Waits.
template <coverage... Known, class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify,
          class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize(Backend& backend,
                              std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws, const grid& g,
                              Output&& output, program_options options = {}) {
    auto& out = core::drawn_output(output);
    using output_type = std::remove_cvref_t<decltype(out)>;
    if constexpr (core::check_program<Mesh, VertexShader, FragmentShader, Amplify>()) {
        using shader_output = core::program_output<Mesh, VertexShader, FragmentShader, Amplify>;
        if constexpr (core::output_kind<output_type>::template fits<shader_output>()) {
            if (const status s = core::validate_call(draws, g, out); !s.ok()) return s;
            core::known_coverage<Known...>::set(options);
            return backend.guard([&] { return core::run_program<Known...>(backend, draws, g, out, options); });
        }
    }
    return {}; // does not compile: a static_assert has said why
}
template <coverage... Known, class Backend, core::program_draw_range Draws, class Output>
[[nodiscard]] status voxelize(Backend& backend, const Draws& draws, const grid& g, Output&& out,
                              program_options options = {}) {
    return voxelize<Known...>(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g,
                              out, options);
}

// One mesh, or view of a mesh, points or lines.
template <coverage... Known, class Backend, class View, class VertexShader, class Amplify, class FragmentShader,
          class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize(Backend& backend, const View& view, const grid& g, const VertexShader& vertex_shader,
                              const Amplify& amplify, const FragmentShader& fragment_shader, Output&& out,
                              program_options options = {}) {
    using draw_type = draw<core::view_type_of<View>, VertexShader, FragmentShader, Amplify>;
    const draw_type d{core::view_of(view), vertex_shader, amplify, fragment_shader};
    return voxelize<Known...>(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

// Draws the inside of what programs make (solid.hpp). All their triangles are in memory at once.
template <class Backend, class Mesh, class VertexShader, class SolidShader, class Amplify, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_solid(Backend& backend,
                                    std::span<const draw<Mesh, VertexShader, SolidShader, Amplify>> draws,
                                    const grid& g, Output&& out, const solid_options& options = {}) {
    using types = core::program_types<Mesh, VertexShader, Amplify>;
    if constexpr (core::check_vertex_shader<Mesh, VertexShader>()) {
        if constexpr (types::result::check()) {
            if (const status s = validate(g); !s.ok()) return s;
            if (const status s = core::validate(options, g); !s.ok()) return s;
            if (const status s = core::validate_program_draws(draws); !s.ok()) return s;
            return backend.guard([&] {
                using call_type = core::program_call<Backend, Mesh, VertexShader, SolidShader, Amplify, true>;
                const call_type call(backend, draws, g, ~std::uint64_t{0});
                if (!call.state().ok()) return core::name_bad_input(backend, draws, call.state());
                if (!call.fits()) return core::failure(status_code::out_of_memory, stage::vertex_shade);
                return call.draw_at_once([&](std::span<const typename call_type::emitted_draw> emitted) {
                    return voxelize_solid(backend, emitted, g, out, options);
                });
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}
template <class Backend, class View, class VertexShader, class Amplify, class SolidShader, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_solid(Backend& backend, const View& view, const grid& g,
                                    const VertexShader& vertex_shader, const Amplify& amplify,
                                    const SolidShader& solid_shader, Output&& out, const solid_options& options = {}) {
    using draw_type = draw<core::view_type_of<View>, VertexShader, SolidShader, Amplify>;
    const draw_type d{core::view_of(view), vertex_shader, amplify, solid_shader};
    return voxelize_solid(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
