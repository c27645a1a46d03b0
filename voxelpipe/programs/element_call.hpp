// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize for points and lines, by a path of their own: each element's voxels are counted, summed and listed with
// their shaded values (core/segment.hpp), and the fragments of all elements are sorted by voxel and stored or folded,
// in parts of the grid if they are too many at once. The functors run by Backend::for_each, the same on every backend.

#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/core/segment.hpp>
#include <voxelpipe/programs/elements.hpp>
#include <voxelpipe/programs/passes/fragment_pool.hpp>
#include <voxelpipe/programs/passes/outputs.hpp>
#include <voxelpipe/programs/passes/parts.hpp>
#include <voxelpipe/programs/program_options.hpp>

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
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

// The elements of a call, whose vertices are shaded once. Payload: of the lists.
template <coverage Rule, class Backend, class View, class VertexShader, class FragmentShader, class Payload>
class element_lists {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using draw_type = draw<View, VertexShader, FragmentShader>;
    using elements = elements_of<View>;
    using V = typename shaded<View, VertexShader>::varyings;
    using pool_type = fragment_pool<Backend, Payload>;
    static constexpr int size = elements::size;

public:
    element_lists(Backend& backend, std::span<const draw_type> draws) : backend_(backend), draws_(draws) {
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const View& view = draws[d].mesh;
            const std::uint64_t n = elements::count(view) * view.copies.count;
            shaded_draw s{n, {backend, view.positions.size() * view.copies.count}, {backend, n + 1}};
            backend.for_each(s.vertices.size(), shade_elements<typename elements::vertices_type, VertexShader, V>{
                                                    elements::vertices(view), draws[d].vertex_shader,
                                                    static_cast<std::uint32_t>(d), s.vertices.data()});
            num_elements_ += n;
            shaded_.push_back(std::move(s));
        }
    }
    [[nodiscard]] std::uint64_t num_elements() const { return num_elements_; }

    // As part_drawing wants it: the lists of a part of the grid. More than `most` fragments are only counted.
    template <class Take>
    [[nodiscard]] status list(const grid& g, std::uint64_t most, const Take& take) {
        const std::array<std::uint64_t, index_of(element_count::size)> zeros{};
        buffer<std::uint64_t> counts(backend_, array_view<const std::uint64_t>(zeros.data(), zeros.size()));
        std::vector<std::uint64_t> of_draw;
        std::uint64_t fragments = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            shaded_draw& s = shaded_[d];
            buffer<std::uint32_t> num_voxels(backend_, s.count + 1);
            backend_.for_each(s.count + 1,
                              passes::count_voxels<Rule, size, V>{snapped(d, g), num_voxels.data(), counts.data()});
            of_draw.push_back(backend_.sum(num_voxels, s.first_of_element));
            fragments += of_draw.back();
        }
        counters c = read(counts);
        if (has_bad_index_) return failure(status_code::index_out_of_range, stage::coarse_raster);
        if (fragments > most) {
            take(abuffer<Backend, Payload>(backend_), 0, c, fragments);
            return {};
        }
        typename pool_type::part part(backend_, fragments);
        std::uint64_t first = 0;
        std::uint32_t first_primitive = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            const shaded_draw& s = shaded_[d];
            backend_.for_each(s.count, passes::list_voxels<Rule, size, V, FragmentShader, payload_storage<Payload>>{
                                           snapped(d, g), draws_[d].fragment_shader, static_cast<std::uint32_t>(d),
                                           first_primitive, g.extent, g.offset, s.first_of_element.data(), first,
                                           nullptr, part.keys.data(), part.order.data(), part.primitives.data(),
                                           part.payloads.data(), counts.data()});
            first += of_draw[d];
            first_primitive += static_cast<std::uint32_t>(s.count);
        }
        c = read(counts);
        take(pool_type::sort(backend_, g.extent, std::move(part), fragments - c.fragments_discarded), 0, c, fragments);
        return {};
    }

private:
    struct shaded_draw {
        std::uint64_t count;
        buffer<vertex_output<V>> vertices;
        buffer<std::uint64_t> first_of_element;
    };
    [[nodiscard]] passes::snapped_elements<size, V> snapped(std::size_t d, const grid& g) const {
        return {shaded_[d].vertices.data(),
                elements::indices(draws_[d].mesh),
                shaded_[d].count,
                make_snap_transform(g),
                {{{0, 0, 0}}, {{g.extent.x - 1, g.extent.y - 1, g.extent.z - 1}}}};
    }
    [[nodiscard]] counters read(const buffer<std::uint64_t>& counts) {
        const std::vector<std::uint64_t> found = counts.to_host(backend_);
        const auto of = [&](element_count what) { return found[index_of(what)]; };
        has_bad_index_ = of(element_count::bad_index) != 0;
        counters c;
        c.triangles_nonfinite = of(element_count::nonfinite);
        c.triangles_too_far = of(element_count::too_far);
        c.triangles_outside = of(element_count::outside);
        c.triangles_drawn = num_elements_ - c.triangles_dropped() - c.triangles_outside;
        c.fragments_discarded = of(element_count::discarded);
        return c;
    }

    Backend& backend_;
    std::span<const draw_type> draws_;
    std::vector<shaded_draw> shaded_;
    std::uint64_t num_elements_ = 0;
    bool has_bad_index_ = false;
};

// Names the calls that a backend may implement by run_module(elements_tag<Rule>, backend, draws, grid, output,
// count_voxels), which returns no status where it leaves the call to the lists below.
template <coverage Rule>
struct elements_tag {};

template <coverage Rule, class Backend, class View, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status run_elements(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                  const grid& g, Output& out, const program_options& options) {
    const bool count_voxels = options.count_voxels;
    if constexpr (requires { run_module(elements_tag<Rule>{}, backend, draws, g, out, count_voxels); }) {
        // Without lists, if the backend knows how.
        if (const std::optional<status> s = run_module(elements_tag<Rule>{}, backend, draws, g, out, count_voxels))
            return *s;
    }
    using output_type = std::remove_const_t<Output>;
    using payload = typename pooled<output_type, shader_output<View, VertexShader, FragmentShader>>::payload;
    element_lists<Rule, Backend, View, VertexShader, FragmentShader, payload> all(backend, draws);
    const auto list = [&](const grid& part, std::uint64_t most, const auto& take) {
        return all.list(part, most, take);
    };
    part_store<Backend, payload, output_type> store(backend, out);
    part_drawing<Backend, payload, decltype(store), decltype(list)> parts(
        backend, g, store, list, fragments_within<payload>(options.list_bytes));
    status drawn;
    status s = parts.draw(drawn.counts);
    drawn.counts.triangles_in = all.num_elements();
    if (s.ok()) return store.finish(backend, g, count_voxels, drawn);
    s.counts = {.triangles_in = all.num_elements()};
    return s;
}

template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status draw_elements(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                   const grid& g, Output& out, program_options options) {
    using output_type = std::remove_const_t<Output>;
    if constexpr (check_shaders<View, VertexShader, FragmentShader>()) {
        if constexpr (output_kind<output_type>::template fits<shader_output<View, VertexShader, FragmentShader>>()) {
            if (const status s = validate_call(draws, g, out); !s.ok()) return s;
            known_coverage<Known...>::set(options);
            return backend.guard([&] {
                return known_coverage<Known...>::dispatch(
                    options.rule, [&]<coverage Rule>() { return run_elements<Rule>(backend, draws, g, out, options); });
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}

} // namespace core

// Draws points or line segments, into a framebuffer, a framebuffer_view, an A-buffer or a sparse framebuffer. Exact
// (docs/design.md, "Points and segments"): conservative is every voxel that the closed point or segment touches, thin
// one voxel in each layer along a segment's dominant axis, or the voxel of the point. Fragments have the element's
// number as `triangle`, barycentrics (1 - t, t, 0), those of a point (1, 0, 0), and no normal; counts of triangles
// count elements. A call that fails has written nothing, unless the memory runs out while parts of the grid are drawn
// (program_options::list_bytes). Waits.
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                              const grid& g, Output&& output, voxelize_options options = {}) {
    return core::draw_elements<Known...>(backend, draws, g, core::drawn_output(output), program_options(options));
}
// The same, with bounds for the lists of fragments.
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output,
          std::same_as<program_options> Options>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<View, VertexShader, FragmentShader>> draws,
                              const grid& g, Output&& output, const Options& options) {
    return core::draw_elements<Known...>(backend, draws, g, core::drawn_output(output), options);
}

// One view.
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, const View& view, const grid& g, const VertexShader& vertex_shader,
                              const FragmentShader& fragment_shader, Output&& out, voxelize_options options = {}) {
    return voxelize<Known...>(backend, view, g, vertex_shader, fragment_shader, out, program_options(options));
}
template <coverage... Known, class Backend, class View, class VertexShader, class FragmentShader, class Output,
          std::same_as<program_options> Options>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize(Backend& backend, const View& view, const grid& g, const VertexShader& vertex_shader,
                              const FragmentShader& fragment_shader, Output&& out, const Options& options) {
    using draw_type = draw<View, VertexShader, FragmentShader>;
    const draw_type d{view, vertex_shader, fragment_shader};
    return voxelize<Known...>(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
