// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize for points and lines, by a path of their own: each element's voxels are counted, summed and listed with
// their shaded values (core/segment.hpp), and the fragments of all elements are sorted by voxel and stored or folded.
// The functors run by Backend::for_each, the same on every backend.

#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/core/segment.hpp>
#include <voxelpipe/elements.hpp>
#include <voxelpipe/fragment_pool.hpp>
#include <voxelpipe/program_call.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe {
namespace core {

template <class View>
inline constexpr bool is_elements_view = false;
template <class... Attributes>
inline constexpr bool is_elements_view<points_view<Attributes...>> = true;
template <class... Attributes>
inline constexpr bool is_elements_view<lines_view<Attributes...>> = true;

// What the passes over elements count, in 64-bit words.
enum class element_count : std::uint8_t { nonfinite, too_far, outside, bad_index, discarded, size };
[[nodiscard]] VOXELPIPE_HD constexpr std::size_t index_of(element_count c) { return static_cast<std::size_t>(c); }

namespace passes {

// Calls visit(setup, voxel x y z, w) for each voxel of a drawable element within `whole`.
VOXELPIPE_ANY_CALLABLE
template <coverage Rule, class Visit>
VOXELPIPE_HD void for_each_element_voxel(const snapped_position& a, const snapped_position& b, int fraction,
                                         const voxel_box& whole, Visit&& visit) {
    const auto run = [&](const auto& t) {
        for_each_segment_voxel<Rule>(t, whole, [&](std::int64_t u, std::int64_t v, std::int64_t w) {
            visit(t, to_xyz(t.axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w)), w);
        });
    };
    if (is_narrow_segment(a, b))
        run(segment_setup<std::int64_t>(a, b, fraction));
    else
        run(segment_setup<int128>(a, b, fraction));
}

// The elements of one draw, after the vertex shader. K: 1 or 2 vertices each.
template <int K, class V>
struct snapped_elements {
    const vertex_output<V>* vertices;
    element_indices<K> in;
    std::uint64_t count;
    snap_transform snap;
    voxel_box whole;

    [[nodiscard]] VOXELPIPE_HD snapped_position position(std::uint32_t vertex) const {
        const glm::vec3& p = vertices[vertex].position;
        return core::snap(snap, p.x, p.y, p.z);
    }
    // Calls visit(setup, voxel x y z, w) for each voxel of a drawable element.
    VOXELPIPE_ANY_CALLABLE
    template <coverage Rule, class Visit>
    VOXELPIPE_HD void for_each_voxel(const snapped_position& a, const snapped_position& b, Visit&& visit) const {
        for_each_element_voxel<Rule>(a, b, snap.fraction, whole, visit);
    }
};

// The number of voxels of each element; 0 behind the last, for the sums.
template <coverage Rule, int K, class V>
struct count_voxels {
    snapped_elements<K, V> all;
    std::uint32_t* num_voxels;
    std::uint64_t* counts;

    template <class Index>
    VOXELPIPE_HD void operator()(Index i) const {
        num_voxels[i] = 0;
        if (i == all.count) return;
        const auto e = all.in.locate(static_cast<std::uint32_t>(i));
        const auto note = [&](element_count c) { add_shared(counts[index_of(c)], 1); };
        if (!e.ok) return note(element_count::bad_index);
        const snapped_position a = all.position(e.index[0]), b = all.position(e.index[K - 1]);
        voxel_box reach{};
        switch (classify<Rule>(a, b, b, all.snap.fraction, all.whole, reach)) {
        case triangle_class::nonfinite:
            return note(element_count::nonfinite);
        case triangle_class::too_far:
            return note(element_count::too_far);
        case triangle_class::outside:
            return note(element_count::outside);
        default:
            break;
        }
        std::uint32_t n = 0;
        all.template for_each_voxel<Rule>(a, b, [&](const auto&, const auto&, std::int64_t) { ++n; });
        num_voxels[i] = n;
    }
};

// The value that is listed of a fragment's outputs.
template <class Payload, class Output>
[[nodiscard]] VOXELPIPE_HD Payload payload_of(const Output& out) {
    if constexpr (std::is_same_v<Payload, no_payload>)
        return {};
    else if constexpr (std::is_same_v<Payload, std::remove_cvref_t<decltype(out.values)>>)
        return out.values;
    else
        return get<0>(out.values);
}

// Where the fragments of a draw are listed, in the backend's memory.
struct element_room {
    std::uint64_t first;
    std::uint64_t fits; // 0: there is no room, and nothing is listed
};

// Shades and lists the voxels of each element.
template <coverage Rule, int K, class V, class FragmentShader, class Payload>
struct list_voxels {
    snapped_elements<K, V> all;
    FragmentShader shader;
    std::uint32_t draw, first_primitive;
    glm::ivec3 extent, offset;
    const std::uint64_t* first_of_element;
    std::uint64_t first;      // of the draw, in the arrays
    const element_room* room; // in place of `first`; may be null
    std::uint64_t* keys;
    std::uint32_t *order, *primitives;
    Payload* payloads;
    std::uint64_t* counts;

    VOXELPIPE_ANY_CALLABLE
    template <class Index>
    VOXELPIPE_HD void operator()(Index i) const {
        if (first_of_element[i + 1] == first_of_element[i] || (room != nullptr && room->fits == 0)) return;
        const auto e = all.in.locate(static_cast<std::uint32_t>(i));
        const snapped_position a = all.position(e.index[0]), b = all.position(e.index[K - 1]);
        const V &of_a = all.vertices[e.index[0]].varyings, &of_b = all.vertices[e.index[K - 1]].varyings;
        fragment<V> f{};
        f.triangle = e.number;
        f.instance = e.instance;
        f.draw = draw;
        f.primitive = first_primitive + static_cast<std::uint32_t>(i);
        f.front_facing = true;
        f.normal = glm::vec3(0.0f);
        f.vertex_varyings[0] = f.vertex_varyings[2] = &of_a;
        f.vertex_varyings[1] = &of_b;
        std::uint64_t to = (room != nullptr ? room->first : first) + first_of_element[i];
        std::uint64_t discarded = 0;
        all.template for_each_voxel<Rule>(a, b, [&](const auto& t, const auto& p, std::int64_t w) {
            f.axis = t.is_point ? 0 : t.axis;
            f.voxel = glm::ivec3(offset.x + p[0], offset.y + p[1], offset.z + p[2]);
            f.barycentric = segment_weights(t, w);
            if (t.is_point)
                f.varyings = of_a;
            else
                f.varyings = mix(of_a, of_b, of_a, f.barycentric.y, 0.0f);
            const auto out = shader(f);
            const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
            // A discarded fragment gets the number behind the last voxel, and is sorted to the end.
            keys[to] = out.keep ? (wide(p[2]) * wide(extent.y) + wide(p[1])) * wide(extent.x) + wide(p[0])
                                : wide(extent.x) * wide(extent.y) * wide(extent.z);
            discarded += out.keep ? 0 : 1;
            order[to] = static_cast<std::uint32_t>(to);
            primitives[to] = f.primitive;
            if constexpr (!std::is_same_v<Payload, no_payload>) payloads[to] = payload_of<Payload>(out);
            ++to;
        });
        if (discarded != 0) add_shared(counts[index_of(element_count::discarded)], discarded);
    }
};

} // namespace passes

template <coverage Rule, class Backend, class View, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status run_elements(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                  const grid& g, Output& out, bool count_voxels) {
    if constexpr (requires { backend.template draw_elements<Rule>(draws, g, out, count_voxels); }) {
        // Without lists, if the backend knows how.
        if (const std::optional<status> s = backend.template draw_elements<Rule>(draws, g, out, count_voxels))
            return *s;
    }
    using elements = elements_of<View>;
    using V = typename shaded<View, VertexShader>::varyings;
    using output_type = std::remove_const_t<Output>;
    using payload = typename pooled<output_type, shader_output<View, VertexShader, FragmentShader>>::payload;
    using pool_type = fragment_pool<Backend, payload>;
    using vertices_type = typename elements::vertices_type;
    constexpr int size = elements::size;
    using snapped = passes::snapped_elements<size, V>;
    const std::array<std::uint64_t, index_of(element_count::size)> zeros{};
    typename Backend::template buffer<std::uint64_t> counts(
        backend, array_view<const std::uint64_t>(zeros.data(), zeros.size()));

    struct shaded_draw {
        typename Backend::template buffer<vertex_output<V>> vertices;
        typename Backend::template buffer<std::uint64_t> first_of_element;
        snapped all;
        std::uint64_t num_fragments;
    };
    std::vector<shaded_draw> shaded;
    std::uint64_t num_elements = 0, num_fragments = 0;
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const View& view = draws[d].mesh;
        const std::uint64_t n = elements::count(view) * view.copies.count;
        shaded_draw s{{backend, view.positions.size() * view.copies.count}, {backend, n + 1}, {}, 0};
        backend.for_each(s.vertices.size(), shade_elements<vertices_type, VertexShader, V>{
                                                elements::vertices(view), draws[d].vertex_shader,
                                                static_cast<std::uint32_t>(d), s.vertices.data()});
        s.all = {s.vertices.data(),
                 elements::indices(view),
                 n,
                 make_snap_transform(g),
                 {{{0, 0, 0}}, {{g.extent.x - 1, g.extent.y - 1, g.extent.z - 1}}}};
        typename Backend::template buffer<std::uint32_t> num_voxels(backend, n + 1);
        backend.for_each(n + 1, passes::count_voxels<Rule, size, V>{s.all, num_voxels.data(), counts.data()});
        s.num_fragments = backend.sum(num_voxels, s.first_of_element);
        num_elements += n;
        num_fragments += s.num_fragments;
        shaded.push_back(std::move(s));
    }
    const auto count_of = [](const std::vector<std::uint64_t>& c, element_count what) { return c[index_of(what)]; };
    std::vector<std::uint64_t> found = counts.to_host(backend);
    status s;
    s.counts.triangles_in = num_elements;
    if (count_of(found, element_count::bad_index) != 0 || num_fragments > pool_type::max_fragments) {
        status failed = count_of(found, element_count::bad_index) != 0
                            ? failure(status_code::index_out_of_range, stage::coarse_raster)
                            : failure(status_code::out_of_memory, stage::abuffer_emit);
        failed.counts = s.counts;
        return failed;
    }
    typename pool_type::part part(backend, num_fragments);
    std::uint64_t first = 0;
    std::uint32_t first_primitive = 0;
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const shaded_draw& of = shaded[d];
        backend.for_each(of.all.count,
                         passes::list_voxels<Rule, size, V, FragmentShader, payload_storage<payload>>{
                             of.all, draws[d].fragment_shader, static_cast<std::uint32_t>(d), first_primitive, g.extent,
                             g.offset, of.first_of_element.data(), first, nullptr, part.keys.data(), part.order.data(),
                             part.primitives.data(), part.payloads.data(), counts.data()});
        first += of.num_fragments;
        first_primitive += static_cast<std::uint32_t>(of.all.count);
    }
    found = counts.to_host(backend);
    shaded.clear();
    s.counts.triangles_nonfinite = count_of(found, element_count::nonfinite);
    s.counts.triangles_too_far = count_of(found, element_count::too_far);
    s.counts.triangles_outside = count_of(found, element_count::outside);
    s.counts.triangles_drawn = num_elements - s.counts.triangles_dropped() - s.counts.triangles_outside;
    s.counts.fragments_discarded = count_of(found, element_count::discarded);
    return store_pooled(
        backend, g, pool_type::sort(backend, g.extent, std::move(part), num_fragments - s.counts.fragments_discarded),
        out, count_voxels, s);
}

} // namespace core

// Draws points or line segments, into a framebuffer, a framebuffer_view, an A-buffer or a sparse framebuffer. Exact
// (docs/design.md, "Points and segments"): conservative is every voxel that the closed point or segment touches, thin
// one voxel in each layer along a segment's dominant axis, or the voxel of the point. Fragments have the element's
// number as `triangle`, barycentrics (1 - t, t, 0), those of a point (1, 0, 0), and no normal; counts of triangles
// count elements. A call that fails has written nothing. Waits.
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                              const grid& g, Output&& output, voxelize_options options = {}) {
    auto& out = core::drawn_output(output);
    using output_type = std::remove_cvref_t<decltype(out)>;
    if constexpr (core::check_shaders<View, VertexShader, FragmentShader>()) {
        using shader_output = core::shader_output<View, VertexShader, FragmentShader>;
        if constexpr (core::output_kind<output_type>::template fits<shader_output>()) {
            if (const status s = core::validate_call(draws, g, out); !s.ok()) return s;
            core::known_coverage<Known...>::set(options);
            return backend.guard([&] {
                return core::known_coverage<Known...>::dispatch(options.rule, [&]<coverage Rule>() {
                    return core::run_elements<Rule>(backend, draws, g, out, options.count_voxels);
                });
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}

// One view.
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, const View& view, const grid& g, const VertexShader& vertex_shader,
                              const FragmentShader& fragment_shader, Output&& out, voxelize_options options = {}) {
    using draw_type = draw<View, VertexShader, FragmentShader>;
    const draw_type d{view, vertex_shader, fragment_shader};
    return voxelize<Known...>(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
