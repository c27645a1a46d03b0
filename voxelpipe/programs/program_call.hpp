// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// voxelize with a program between the vertex shader and the rasterizer. The triangles that the programs make are
// numbered by draw, instance, input primitive, and lattice or emission number. If all of them fit at once, they are
// drawn like any mesh. If not, they are made and listed a chunk at a time, and the fragments of all chunks are sorted
// and folded at the end: results are the same.

#include <voxelpipe/programs/passes/draws.hpp>
#include <voxelpipe/programs/passes/fragment_pool.hpp>
#include <voxelpipe/programs/passes/outputs.hpp>
#include <voxelpipe/programs/passes/parts.hpp>
#include <voxelpipe/programs/program_options.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

namespace voxelpipe {
namespace core {

// Names the calls that a backend may implement by run_module(patches_tag<Known...>, backend, draws, grid, output,
// options, most triangles), which returns no status where it leaves the call to the passes below.
template <coverage... Known>
struct patches_tag {};

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
    if constexpr (requires { run_module(patches_tag<Known...>{}, backend, draws, g, out, plain, chunk); }) {
        // Without their triangles in memory, if the backend knows how.
        const std::optional<status> s = run_module(patches_tag<Known...>{}, backend, draws, g, out, plain, chunk);
        if (s) return s->ok() ? *s : name_bad_input(backend, draws, *s);
    }
    const call_type call(backend, draws, position_outside(g), chunk);
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
            const std::uint64_t fragments = lists.num_fragments();
            if (of_chunk.ok()) take(std::move(lists), first, of_chunk.counts, fragments);
            return of_chunk;
        });
    };
    const auto list = [&](const grid& part, std::uint64_t, const auto& take) {
        return list_chunks(std::type_identity<emitted_draw>{}, part, take);
    };
    const std::uint64_t most = fragments_within<payload>(options.list_bytes);
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

// run(draws) with the triangles that the programs make, all of them at once, one mesh a draw. IsPlain, outside: as
// program_call's.
template <bool IsPlain, class Backend, class Mesh, class VertexShader, class Shader, class Amplify, class Run>
[[nodiscard]] status run_at_once(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader, Amplify>> draws,
                                 const glm::vec3& outside, const Run& run) {
    using call_type = program_call<Backend, Mesh, VertexShader, Shader, Amplify, IsPlain>;
    return backend.guard([&] {
        const call_type call(backend, draws, outside, ~std::uint64_t{0});
        if (!call.state().ok()) return name_bad_input(backend, draws, call.state());
        if (!call.fits()) return failure(status_code::out_of_memory, stage::vertex_shade);
        return call.draw_at_once(run);
    });
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
            return core::run_at_once<true>(backend, draws, core::position_outside(g), [&](const auto& emitted) {
                return voxelize_solid(backend, emitted, g, out, options);
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
