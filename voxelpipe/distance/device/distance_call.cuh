// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of a distance's call: what memory it takes (take) and its launches on one stream without a wait (search),
// up to the nearest triangles of all samples.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/distance/device/list_samples.cuh>
#include <voxelpipe/distance/device/shade_samples.cuh>
#include <voxelpipe/distance/device/triangle_tree.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::device {

template <class Draw>
struct distance_call;
template <class Mesh, class VertexShader, class Shader>
struct distance_call<draw<Mesh, VertexShader, Shader>> {
    using draw_type = draw<Mesh, VertexShader, Shader>;
    using draws_type = distance_draws<Mesh, VertexShader, Shader>;
    using shading_type = typename draws_type::shading_type;

    std::span<const draw_type> draws;
    grid samples;
    distance_options options;
    std::uint32_t num_primitives;
    capacities limits;
    stage_clock* clock = nullptr;
    bool lists_rows = false; // the samples of the band become lists

    // Bricks, the places of listed triangles and the samples of a whole field are numbered.
    [[nodiscard]] bool fits() const {
        const distance_input in = make_distance_input(samples, options);
        std::uint64_t bricks = 1;
        for (int i = 0; i < 3; ++i) bricks *= static_cast<std::uint64_t>(in.bricks[i]);
        const std::uint64_t rows = static_cast<std::uint64_t>(in.extent.y) * static_cast<std::uint64_t>(in.extent.z);
        return bricks <= core::max_numbered && rows <= core::max_numbered && limits.tile_pairs <= core::max_numbered;
    }
    [[nodiscard]] bool is_whole() const { return options.band.is_whole; }

    struct memory {
        pipeline_state* state;
        draws_type of_draws;
        distance_input in;
        band_memory band;
        tree_memory tree;
        found_samples found;
        sample_rows rows;
    };
    [[nodiscard]] memory take(arena& a) const {
        auto* const state = a.take<pipeline_state>(1);
        memory m{state, draws_type(a, draws), make_distance_input(samples, options), {}, {}, {}, {}};
        m.in.num_counted = num_primitives;
        m.in.frames = a.take<triangle_frame>(num_primitives);
        m.in.triangles = a.take<kept_triangle>(num_primitives);
        const std::uint32_t bricks = m.in.num_bricks();
        std::uint64_t places = bricks;
        if (is_whole()) {
            m.tree = tree_memory::take(a, num_primitives);
        } else {
            m.band = band_memory::take(a, bricks, a.take<std::uint32_t>(bricks), limits);
            m.found.slots = m.band.slots;
            places = limits.fragment_records;
        }
        m.found.distances = a.take<float>(places * brick_samples);
        m.found.primitives = a.take<std::uint32_t>(places * brick_samples);
        if (lists_rows) m.rows = sample_rows::take(a, m.in.extent);
        return m;
    }
    [[nodiscard]] std::size_t plan_memory() const {
        arena a;
        (void)take(a);
        return a.used();
    }

    // The state is zero. Finds what all samples have, in `m`, and gives the shaders.
    [[nodiscard]] shading_type search(memory& m, cudaStream_t stream) const {
        shading_type shading{};
        m.of_draws.shade(draws, samples, m.in.geo, shading, stream);
        end_stage(clock, &stage_times::vertex_shade);
        if (is_whole()) {
            place_triangles<0>
                <<<num_blocks(num_primitives), threads_per_block, 0, stream>>>(m.in, band_memory{}, m.state, limits);
            check(cudaGetLastError(), stage::coarse_raster);
            end_stage(clock, &stage_times::coarse_raster);
            const distance_tree tree = make_tree<0>(m.in, m.tree, stream);
            end_stage(clock, &stage_times::tile_sort);
            search_whole<0>(m.in, tree, m.found, m.state, limits, stream);
        } else {
            check(cudaMemsetAsync(m.band.counts, 0, std::size_t{m.in.num_bricks()} * sizeof(std::uint32_t), stream));
            make_band_lists<0>(m.in, m.band, m.state, limits, stream);
            end_stage(clock, &stage_times::coarse_raster);
            search_bricks<0>(m.in, m.band, m.found, m.state, limits, stream);
        }
        end_stage(clock, &stage_times::fine_raster);
        return shading;
    }
};

// A shader that returns the distance of every sample writes all of a linear target of values: nothing is left to clear.
template <class Shader, class Target>
inline constexpr bool writes_all = std::is_same_v<Shader, distance> && !Target::map::is_bit && !Target::map::bricks;

// Clears what is to be cleared, and shades all samples into the targets.
template <class Call, class... Targets>
void shade_into(const Call& call, const typename Call::memory& m, const typename Call::shading_type& shading,
                const inside_rows& inside, const framebuffer_view<Targets...>& fb, cudaStream_t stream) {
    if (fb.changes != nullptr) // what the log says of the targets will not hold
        check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(word), stream));
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        const auto& t = voxelpipe::get<K>(fb.targets);
        if (!writes_all<typename Call::shading_type::shader_type, target> && t.load == load_operation::clear)
            clear_target(t, m.state, call.limits, stream);
    });
    end_stage(call.clock, &stage_times::clear);
    shade_samples(m.in, shading, m.found, inside, fb, call.options.count_voxels, m.state, call.limits, stream);
    end_stage(call.clock, &stage_times::tile_resolve);
}

} // namespace voxelpipe::device
