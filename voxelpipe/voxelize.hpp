// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The one entry point: voxelize draws into a framebuffer or an A-buffer, on the backend whose tag is passed. Arguments
// are checked here, on the host, before anything runs; a call that fails has written nothing.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/mesh.hpp>
#include <voxelpipe/shader.hpp>
#include <voxelpipe/status.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

// Options of voxelize, as {.rule = coverage::thin, .count_voxels = false}. A coverage alone may be given instead.
struct voxelize_options {
    coverage rule = coverage::conservative; // which voxels a triangle covers
    bool count_voxels = true; // fills counters::voxels; costs one bit per voxel of a tile, or reading a target once
};

namespace core {

// Coverage known at compile time, as in voxelize<coverage::thin>(...). Empty: the call's options decide, and thin and
// conservative are compiled. Crosshair and diagonal take the code of conservative coverage, which leaves voxels out
// then.
template <coverage... Known>
struct known_coverage {
    static_assert(sizeof...(Known) <= 1, "voxelpipe: a call has one coverage");
    // Calls f.operator()<Rule>().
    template <class F>
    static decltype(auto) dispatch(coverage rule, F&& f) {
        constexpr coverage known = ((Known == coverage::thin) || ...) ? coverage::thin : coverage::conservative;
        if constexpr (sizeof...(Known) != 0)
            return f.template operator()<known>();
        else if (rule == coverage::thin)
            return f.template operator()<coverage::thin>();
        else
            return f.template operator()<coverage::conservative>();
    }
    static void set(voxelize_options& options) { ((options.rule = Known), ...); }
};

// Checks of shaders against what they draw into. Each stops at its first mistake, and nothing that depends on it is
// instantiated, so that a mistake is one line of the compiler's output.
template <class Output>
struct output_check;
template <class... Ts>
struct output_check<output<Ts...>> {
    template <class T, class Target>
    static constexpr bool matches() {
        constexpr bool same = std::is_same_v<T, typename Target::value_type>;
        constexpr bool counts = std::is_same_v<typename Target::blend_type, blend::count>;
        constexpr bool means = std::is_same_v<typename Target::blend_type, blend::mean> &&
                               std::is_same_v<T, typename wide_value<typename Target::value_type>::type>;
        static_assert(same || counts || means,
                      "voxelpipe: a fragment shader output has another type than its render target "
                      "(bool for bit; no conversion is made: write the type that you mean)");
        return same || counts || means;
    }
    template <class... Targets>
    static constexpr bool fits_targets() {
        constexpr bool one_each = sizeof...(Ts) == sizeof...(Targets);
        static_assert(one_each,
                      "voxelpipe: the fragment shader must return one value per render target of the framebuffer");
        if constexpr (one_each) return (matches<Ts, Targets>() && ...);
        return false;
    }
    // If the payload is void, values are ignored; discarding still works.
    template <class Payload>
    static constexpr bool fits_payload() {
        if constexpr (std::is_void_v<Payload>) {
            return true;
        } else {
            constexpr bool one = sizeof...(Ts) == 1;
            static_assert(one, "voxelpipe: a fragment shader for an A-buffer must return one value, its payload");
            if constexpr (one) {
                constexpr bool same = (std::is_same_v<Ts, Payload> && ...);
                static_assert(same,
                              "voxelpipe: the fragment shader's output has another type than the A-buffer's payload");
                return same;
            }
            return false;
        }
    }
};

template <class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] constexpr bool shaders_fit_targets() {
    if constexpr (check_shaders<Mesh, VertexShader, FragmentShader>())
        return output_check<shader_output<Mesh, VertexShader, FragmentShader>>::template fits_targets<Targets...>();
    return false;
}

template <class Mesh, class VertexShader, class FragmentShader, class Payload>
[[nodiscard]] constexpr bool shaders_fit_payload() {
    if constexpr (check_shaders<Mesh, VertexShader, FragmentShader>())
        return output_check<shader_output<Mesh, VertexShader, FragmentShader>>::template fits_payload<Payload>();
    return false;
}

[[nodiscard]] inline status failure(status_code code, stage where = stage::validate) {
    status s;
    s.code = code;
    s.where = where;
    return s;
}

// Checks everything about the draws that needs no access to their arrays. Fills counts.triangles_in.
template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] status validate_draws(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws) {
    std::uint64_t triangles = 0, primitives = 0;
    for (const auto& d : draws) {
        const Mesh& m = d.mesh;
        if ((m.positions.data() == nullptr && m.positions.size() != 0) ||
            (m.triangles.data() == nullptr && m.triangles.size() != 0))
            return failure(status_code::null_view);
        constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
        if (m.positions.size() > most) return failure(status_code::size_overflow);
        status_code attributes = status_code::ok;
        for_each_index<Mesh::num_attributes>([&]<std::size_t I>() {
            const auto& a = voxelpipe::get<I>(m.attributes);
            if (a.size() != m.positions.size())
                attributes = status_code::attribute_mismatch;
            else if (a.data() == nullptr && a.size() != 0)
                attributes = status_code::null_view;
        });
        if (attributes != status_code::ok) return failure(attributes);
        if (m.part.whole != 0 && (m.part.numbers.size() != m.triangles.size() || m.part.whole < m.triangles.size()))
            return failure(status_code::bad_subset);
        // Triangles and vertices of all instances are numbered with 32 bits.
        const std::uint64_t each = m.part.whole != 0 ? m.part.whole : m.triangles.size();
        if (each > most || (each != 0 && m.copies.count > (most - primitives) / each)) {
            status s = failure(status_code::too_many_triangles);
            const auto all = static_cast<uint128>(each) * m.copies.count + primitives;
            s.counts.triangles_in = all > ~std::uint64_t{0} ? ~std::uint64_t{0} : static_cast<std::uint64_t>(all);
            return s;
        }
        if (m.positions.size() != 0 && m.copies.count > most / m.positions.size())
            return failure(status_code::size_overflow);
        if constexpr (std::is_same_v<VertexShader, transform>) {
            const glm::mat4& t = d.vertex_shader.matrix;
            if (t[0][3] != 0.0f || t[1][3] != 0.0f || t[2][3] != 0.0f || t[3][3] != 1.0f)
                return failure(status_code::not_affine);
        }
        triangles += m.num_triangles();
        primitives += m.num_primitives();
    }
    status s;
    s.counts.triangles_in = triangles;
    return s;
}

template <class... Targets>
[[nodiscard]] status validate_framebuffer(const framebuffer_view<Targets...>& fb, const grid& g) {
    if (fb.extent != g.extent) return failure(status_code::extent_mismatch);
    status_code code = status_code::ok;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto& t = voxelpipe::get<I>(fb.targets);
        using target_type = typename pack_element<I, Targets...>::type;
        if (t.load == load_operation::off || code != status_code::ok) return;
        if (!fits_memory<target_type>(g.extent))
            code = status_code::size_overflow;
        else if (t.extent != g.extent)
            code = status_code::extent_mismatch;
        else if (t.elements == nullptr)
            code = status_code::null_view;
    });
    return code == status_code::ok ? status{} : failure(code);
}

// Adds the first triangle with an index out of range to the status of a call that met one; reads the indices again.
// Adds nothing if they cannot be read.
template <class Backend, class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] status name_bad_triangle(Backend& backend,
                                       std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, status s) {
    if (s.code != status_code::index_out_of_range) return s;
    try {
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const auto vertices = draws[d].mesh.positions.size();
            const std::vector<glm::uvec3> triangles = backend.read(draws[d].mesh.triangles);
            for (std::size_t i = 0; i < triangles.size(); ++i) {
                const glm::uvec3& t = triangles[i];
                if (t.x < vertices && t.y < vertices && t.z < vertices) continue;
                s.draw = static_cast<std::uint32_t>(d);
                s.triangle = static_cast<std::uint32_t>(i);
                return s;
            }
        }
    } catch (const std::exception&) {
    }
    return s;
}

// A contiguous range of draws, other than the span that voxelize takes.
template <class Range>
using draw_of = std::remove_cvref_t<decltype(*std::data(std::declval<const Range&>()))>;
template <class T>
inline constexpr bool is_draw = false;
template <class Mesh, class VertexShader, class FragmentShader>
inline constexpr bool is_draw<draw<Mesh, VertexShader, FragmentShader>> = true;
template <class Range>
concept draw_range = requires(const Range& r) {
    requires is_draw<draw_of<Range>>;
    std::size(r);
}
&&!std::is_same_v<Range, std::span<const draw_of<Range>>>;

} // namespace core

// Clears the targets whose load operation is clear to their clear values, like a call that draws nothing; targets that
// load keep their contents. Returns after the work is done.
template <class Backend, class... Targets>
[[nodiscard]] status clear(Backend& backend, const framebuffer_view<Targets...>& fb) {
    grid g;
    g.extent = fb.extent;
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
    return backend.clear(fb);
}
template <class Backend, class... Targets>
[[nodiscard]] status clear(Backend& backend, framebuffer<Backend, Targets...>& fb) {
    return clear(backend, fb.view());
}

// Draws meshes into render targets. The draws share one type of mesh, vertex shader and fragment shader; their data
// differ. Draw i's triangles come before draw i + 1's, which is the order of blend::replace. Returns after the work is
// done; on a GPU backend that is one wait. Without any triangles it clears, like vp::clear, and succeeds. A coverage
// between angle brackets, as in voxelize<coverage::thin>(...), overrides the options, and the other coverage is not
// compiled.
template <coverage... Known, class Backend, core::triangle_mesh Mesh, class VertexShader, class FragmentShader,
          class... Targets>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                              const grid& g, const framebuffer_view<Targets...>& fb, voxelize_options options = {}) {
    if constexpr (core::shaders_fit_targets<Mesh, VertexShader, FragmentShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return backend.clear(fb);
        core::known_coverage<Known...>::set(options);
        return core::name_bad_triangle(
            backend, draws,
            backend.run(draws, g, fb, options, s.counts.triangles_in, core::known_coverage<Known...>{}));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

template <coverage... Known, class Backend, core::triangle_mesh Mesh, class VertexShader, class FragmentShader,
          class... Targets>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                              const grid& g, framebuffer<Backend, Targets...>& fb, voxelize_options options = {}) {
    return voxelize<Known...>(backend, draws, g, fb.view(), options);
}

// Draws meshes into an A-buffer. The fragment shader's one output is the payload; it is ignored if the payload is void.
template <coverage... Known, class Backend, core::triangle_mesh Mesh, class VertexShader, class FragmentShader,
          class Payload>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                              const grid& g, abuffer<Backend, Payload>& lists, voxelize_options options = {}) {
    if constexpr (core::shaders_fit_payload<Mesh, VertexShader, FragmentShader, Payload>()) {
        if (const status s = validate(g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) {
            lists = abuffer<Backend, Payload>(backend);
            lists.extent = g.extent;
            return s;
        }
        core::known_coverage<Known...>::set(options);
        return core::name_bad_triangle(
            backend, draws,
            backend.run(draws, g, lists, options, s.counts.triangles_in, core::known_coverage<Known...>{}));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh, into a framebuffer, a framebuffer_view or an A-buffer.
template <coverage... Known, class Backend, class... Attributes, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status voxelize(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                              const VertexShader& vertex_shader, const FragmentShader& fragment_shader, Output&& out,
                              voxelize_options options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, FragmentShader>;
    const draw_type d{mesh, vertex_shader, fragment_shader};
    return voxelize<Known...>(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

template <coverage... Known, class Backend, class... Attributes, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status voxelize(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                              const VertexShader& vertex_shader, const FragmentShader& fragment_shader, Output&& out,
                              voxelize_options options = {}) {
    return voxelize<Known...>(backend, m.view(), g, vertex_shader, fragment_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <coverage... Known, class Backend, core::draw_range Draws, class Output>
[[nodiscard]] status voxelize(Backend& backend, const Draws& draws, const grid& g, Output&& out,
                              voxelize_options options = {}) {
    return voxelize<Known...>(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g,
                              out, options);
}

// A coverage in place of options.
template <coverage... Known, class Backend, class Draws, class Output, std::same_as<coverage> Rule>
[[nodiscard]] status voxelize(Backend& backend, const Draws& draws, const grid& g, Output&& out, Rule rule) {
    return voxelize<Known...>(backend, draws, g, out, voxelize_options{rule, true});
}
template <coverage... Known, class Backend, class Mesh, class VertexShader, class FragmentShader, class Output,
          std::same_as<coverage> Rule>
[[nodiscard]] status voxelize(Backend& backend, const Mesh& mesh, const grid& g, const VertexShader& vertex_shader,
                              const FragmentShader& fragment_shader, Output&& out, Rule rule) {
    return voxelize<Known...>(backend, mesh, g, vertex_shader, fragment_shader, out, voxelize_options{rule, true});
}

} // namespace voxelpipe
