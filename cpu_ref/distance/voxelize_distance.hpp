// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance on CPU threads: the solid's bits give the sign, bricks of 8^3 samples find their nearest triangles,
// a thread a run of four bricks, whose rows are words of bits.

#include <cpu_ref/cpu_backend.hpp>
#include <cpu_ref/distance/nearest.hpp>
#include <cpu_ref/solid/voxelize_solid.hpp>
#include <voxelpipe/distance/distance.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::cpu {

// The samples that are inside: bits of a framebuffer, or none.
class inside_bits {
public:
    using target_type = target<bit, blend::replace>;
    using framebuffer_type = framebuffer<cpu_backend, target_type>;

    // Draws the solid, unless no sign is wanted. A status that is not ok says why there are no bits.
    template <class Mesh, class VertexShader, class Shader>
    [[nodiscard]] status draw(cpu_backend& backend, std::span<const voxelpipe::draw<Mesh, VertexShader, Shader>> draws,
                              const grid& samples, const distance_options& options, std::uint64_t triangles_in) {
        if (options.sign == distance_sign::none || triangles_in == 0) return {};
        using shader = constant_output<bool>;
        std::vector<voxelpipe::draw<Mesh, VertexShader, shader>> solids;
        for (const auto& d : draws) solids.push_back({d.mesh, d.vertex_shader, constant(true)});
        bits_.emplace(backend, samples.extent);
        return run_module(core::solid_tag{}, backend,
                          std::span<const voxelpipe::draw<Mesh, VertexShader, shader>>(solids), samples, bits_->view(),
                          core::sign_options(options), triangles_in);
    }
    // A bit a sample of the row from (x, y, z) on, up to the end of the word; x is a multiple of 32.
    [[nodiscard]] std::uint32_t row(int x, int y, int z) const {
        if (!bits_) return 0;
        const auto& t = get<0>(bits_->view().targets);
        return t.elements[target_type::map::cell(t.extent, x, y, z)];
    }

private:
    std::optional<framebuffer_type> bits_;
};

// A run of bricks: 32 x 8 x 8 samples.
inline constexpr int run_length = 32;
struct brick_runs {
    glm::ivec3 extent, runs;
    explicit brick_runs(const glm::ivec3& e)
        : extent(e), runs((e.x + run_length - 1) / run_length, (e.y + brick_size - 1) / brick_size,
                          (e.z + brick_size - 1) / brick_size) {}
    [[nodiscard]] std::size_t count() const {
        return static_cast<std::size_t>(runs.x) * static_cast<std::size_t>(runs.y) * static_cast<std::size_t>(runs.z);
    }
    [[nodiscard]] glm::ivec3 first(std::size_t i) const {
        const auto nx = static_cast<std::size_t>(runs.x), ny = static_cast<std::size_t>(runs.y);
        return {static_cast<int>(i % nx) * run_length, static_cast<int>(i / nx % ny) * brick_size,
                static_cast<int>(i / (nx * ny)) * brick_size};
    }
};

// Everything of a fragment but the distance and what lies in front of it.
template <class Scene, class Fragment>
VOXELPIPE_INLINE void fill_fragment(const Scene& s, const distance_scene& d, std::uint32_t id, const glm::ivec3& at,
                                    Fragment& f) {
    using varyings = typename Scene::varyings;
    const auto tri = s.find(id);
    const auto visible = s.numbers_of(tri, id);
    f.triangle = visible.triangle;
    f.draw = tri.draw;
    f.instance = tri.instance;
    f.primitive = visible.primitive;
    const snapped_triangle t = find_triangle(s, id);
    const core::seen_triangle seen = core::see_wide(t.a, t.b, t.c, sample_position(at, s.snap.fraction));
    const core::closest_region region = core::find_distance(seen, d.scale).region;
    const core::triple<double> weights = core::closest_weights(seen, d.scale, region);
    const core::triple<double> offset = core::to_closest(seen, d.scale, region);
    f.side = core::side_of(seen);
    f.barycentric = {exact::to_float(weights[0]), exact::to_float(weights[1]), exact::to_float(weights[2])};
    f.to_closest = {exact::to_float(offset[0]), exact::to_float(offset[1]), exact::to_float(offset[2])};
    f.normal = core::unit_normal(seen, s.normal_factors);
    static constexpr varyings none{};
    for (int i = 0; i < 3; ++i) {
        if constexpr (std::is_empty_v<varyings>)
            f.vertex_varyings[i] = &none;
        else
            f.vertex_varyings[i] = &s.vertices[tri.draw].varyings[tri.index[i]];
    }
    if constexpr (!std::is_empty_v<varyings>)
        f.varyings = core::mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2], f.barycentric.y,
                               f.barycentric.z);
}

// Calls visit(sample of the grid's part, shader's output, primitive or none) for the samples of a run: all, or those of
// the band. rest(first x, end of x, y, z, bits of those inside) may take a row beyond the band instead; it returns
// whether it has.
template <bool BandOnly, class Scene, class Visit, class Rest>
void shade_run(const Scene& s, const distance_scene& d, const inside_bits& inside, const glm::ivec3& first,
               brick_search& search, distance_counters& counts, const Visit& visit, const Rest& rest) {
    using shader = typename Scene::fragment_shader;
    using fragment = distance_fragment<typename Scene::varyings>;
    const glm::ivec3 extent = s.where.extent;
    const int x_end = std::min(first.x + run_length, extent.x), y_end = std::min(first.y + brick_size, extent.y),
              z_end = std::min(first.z + brick_size, extent.z);
    const bool is_near = !d.tree->empty() && search.is_near_run(first);
    if (BandOnly && !is_near) return;
    for (int x0 = first.x; x0 < x_end; x0 += is_near ? brick_size : run_length) {
        const bool found = is_near && search.find({x0, first.y, first.z});
        if (BandOnly && !found) continue;
        const int x1 = std::min(x0 + (is_near ? brick_size : run_length), x_end);
        for (int z = first.z; z < z_end; ++z) {
            for (int y = first.y; y < y_end; ++y) {
                const std::uint32_t row = inside.row(first.x, y, z);
                if (!found && rest(x0, x1, y, z, row >> (x0 - first.x))) continue;
                for (int x = x0; x < x1; ++x) {
                    const bool is_inside = (row >> (x - first.x) & 1u) != 0;
                    float length = d.band;
                    std::uint32_t id = fragment::none;
                    if (found) {
                        const nearest_triangle& n = search[brick_search::number_of(x - x0, y - first.y, z - first.z)];
                        const float own = core::distance_of(n.square);
                        if (n.primitive != fragment::none && own <= d.band) {
                            length = own;
                            id = n.primitive;
                        }
                    }
                    if (BandOnly && id == fragment::none) continue;
                    counts.band_samples += static_cast<std::uint64_t>(id != fragment::none);
                    fragment f{};
                    f.primitive = fragment::none;
                    f.in_band = id != fragment::none;
                    f.inside = is_inside;
                    f.voxel = s.where.offset + glm::ivec3(x, y, z);
                    f.distance = is_inside && length > 0.0f ? -length : length;
                    if constexpr (!std::is_same_v<shader, distance>)
                        if (f.in_band) fill_fragment(s, d, id, {x, y, z}, f);
                    visit(glm::ivec3(x, y, z), s.draws[f.draw].fragment_shader(f), id);
                }
            }
        }
    }
}

// True for the plain field: every sample of a linear target of floats is replaced, so rows beyond the band are filled
// and nothing need be cleared first.
template <class Shader, class... Targets>
inline constexpr bool is_plain_field = false;
template <>
inline constexpr bool is_plain_field<distance, target<float, blend::replace>> = true;

// The one fragment of a sample, into the targets.
template <class Values, class... Targets>
VOXELPIPE_INLINE void blend_once(const framebuffer_view<Targets...>& fb, const glm::ivec3& p, const Values& values) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target_type = typename core::pack_element<I, Targets...>::type;
        const auto& t = get<I>(fb.targets);
        if (t.load == load_operation::off) return;
        if constexpr (works_in_place<target_type>) {
            blend_in_place(t, p.x, p.y, p.z, get<I>(values));
        } else {
            auto sum = target_type::traits::begin(t.load == load_operation::clear ? t.clear_value : t(p.x, p.y, p.z));
            target_type::traits::apply(sum, get<I>(values));
            t.store(p.x, p.y, p.z, target_type::traits::end(sum));
        }
    });
}

// The voxels of triangles that may be nearest to a sample of the band.
[[nodiscard]] inline core::voxel_box reach_of(const distance_options& o, const grid& samples) {
    const glm::ivec3 halo = core::band_halo(o.band, samples);
    core::voxel_box box{};
    for (int i = 0; i < 3; ++i) {
        // Positions reach 2^40 units at most, so this is everything.
        const std::int64_t layers = o.band.is_whole ? std::int64_t{1} << 42 : halo[i];
        box.lo[i] = -layers;
        box.hi[i] = samples.extent[i] - 1 + layers;
    }
    return box;
}

// What a call needs besides its shaders.
template <class Scene>
struct distance_call {
    Scene shapes;
    std::unique_ptr<triangle_tree> tree;
    distance_scene scene;

    template <class Draws>
    distance_call(const execution& how, const Draws& draws, const grid& samples, const distance_options& options)
        : shapes(make_scene(how, draws, samples)) {
        const glm::dvec3 size = samples.voxel_size;
        const double largest = std::max({size.x, size.y, size.z});
        scene.voxel = {size.x / largest, size.y / largest, size.z / largest};
        const double unit = std::ldexp(1.0, -shapes.snap.fraction);
        core::triple<std::int64_t> most{};
        for (int i = 0; i < 3; ++i) most[i] = std::int64_t{samples.extent[i]} << shapes.snap.fraction;
        tree =
            std::make_unique<triangle_tree>(how, shapes, reach_of(options, samples), most,
                                            vector3{scene.voxel.x * unit, scene.voxel.y * unit, scene.voxel.z * unit});
        scene.shapes = &shapes;
        scene.tree = tree.get();
        scene.scale = core::make_distance_scale(size, shapes.snap.fraction);
        scene.band = core::band_distance(options.band, samples);
        scene.band_units = static_cast<float>(static_cast<double>(scene.band) / largest) * (1.0f + 0x1p-20f);
    }
    distance_call(const distance_call&) = delete; // scene points into it
    distance_call& operator=(const distance_call&) = delete;

    // A status of the call: what the solid counted of its rows, and the triangles of the tree.
    [[nodiscard]] status begin(const status& solid) const {
        status result;
        result.solid = solid.solid;
        result.counts = tree->counts();
        if (tree->code() != status_code::ok) {
            result = core::failure(tree->code(), stage::coarse_raster);
            result.counts.triangles_in = shapes.first_primitive.back();
        }
        return result;
    }
};

} // namespace voxelpipe::cpu

namespace voxelpipe::core {

// Implements voxelize_distance. Arguments are validated. Exceptions of a user's shader pass through.
template <class Mesh, class VertexShader, class Shader, class... Targets>
[[nodiscard]] status run_module(distance_tag, cpu_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& samples,
                                const framebuffer_view<Targets...>& fb, const distance_options& options,
                                std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        cpu::inside_bits inside;
        const status solid = inside.draw(backend, draws, samples, options, triangles_in);
        if (!solid.ok()) return solid;
        const cpu::distance_call<cpu::scene<Mesh, VertexShader, Shader>> call(how, draws, samples, options);
        status result = call.begin(solid);
        if (!result.ok()) return result;

        how.enter(stage::fine_raster);
        const cpu::brick_runs runs(samples.extent);
        struct scratch {
            cpu::brick_search search;
            counters counts{};
            distance_counters distance{};
        };
        const auto workers = std::max<std::size_t>(1, std::min<std::size_t>(how.threads, runs.count()));
        std::vector<std::unique_ptr<scratch>> own;
        for (std::size_t w = 0; w < workers; ++w)
            own.push_back(std::unique_ptr<scratch>(new scratch{cpu::brick_search(call.scene)}));
        if (fb.changes != nullptr) change_log::forget(fb.changes);
        constexpr bool is_plain = cpu::is_plain_field<Shader, Targets...>;
        if constexpr (!is_plain) cpu::clear_targets(how, fb);
        const float band = call.scene.band;
        const cpu::stopwatch watch(how.times, &stage_times::fine_raster);
        cpu::progress_meter meter(how, runs.count());
        cpu::parallel_for(how.threads, runs.count(), [&](unsigned worker, std::size_t i) {
            scratch& mine = *own[worker];
            cpu::shade_run<false>(
                call.shapes, call.scene, inside, runs.first(i), mine.search, mine.distance,
                [&](const glm::ivec3& p, const auto& out, std::uint32_t) {
                    if (!out.keep) {
                        ++mine.counts.fragments_discarded;
                        return;
                    }
                    ++mine.counts.fragments;
                    cpu::blend_once(fb, p, out.values);
                },
                [&](int x0, int x1, int y, int z, std::uint32_t bits) {
                    if constexpr (is_plain) {
                        const auto& t = get<0>(fb.targets);
                        const int n = x1 - x0;
                        mine.counts.fragments += static_cast<std::uint64_t>(n);
                        if (t.load == load_operation::off) return true;
                        float* const row = t.elements + target<float, blend::replace>::map::cell(t.extent, x0, y, z);
                        const std::uint32_t all = n == 32 ? ~0u : (1u << n) - 1;
                        if ((bits & all) == 0 || (bits & all) == all)
                            std::fill_n(row, n, (bits & all) == 0 ? band : -band);
                        else
                            for (int x = 0; x < n; ++x) row[x] = (bits >> x & 1u) != 0 ? -band : band;
                        return true;
                    }
                    return false;
                });
            meter.advance();
        });
        for (const auto& s : own) {
            result.counts.fragments += s->counts.fragments;
            result.counts.fragments_discarded += s->counts.fragments_discarded;
            result.distance.band_samples += s->distance.band_samples;
        }
        if (options.count_voxels) result.counts.voxels = result.counts.fragments;
        return result;
    });
}

} // namespace voxelpipe::core
