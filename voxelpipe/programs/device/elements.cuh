// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Points and lines of constant shaders straight into targets that are blended or counted where they lie, as the
// immediate strategy draws triangles: one kernel that shades, snaps and blends, without lists and without a sort.
// Compiled by programs that draw points or lines with such a shader into such targets.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/call/immediate_plan.cuh>
#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/device/targets/global_target.cuh>
#include <voxelpipe/programs/element_call.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

namespace voxelpipe {
namespace device {

// Counts of one thread.
struct element_tally {
    unsigned nonfinite = 0, too_far = 0, outside = 0;
    unsigned long long fragments = 0, touched = 0;
};

// The elements of one draw, and the targets that they are drawn into.
template <coverage Rule, class View, class VertexShader, class Framebuffer, class Values>
struct direct_elements {
    using elements = core::elements_of<View>;
    static constexpr int size = elements::size;
    // Elements that a thread loads before it draws them: their loads are in flight together.
    static constexpr int batch = size == 1 ? 4 : 2;

    typename elements::vertices_type vertices;
    VertexShader shader;
    std::uint32_t draw;
    core::element_indices<size> in;
    std::uint64_t count;
    core::snap_transform snap;
    core::voxel_box whole;
    Framebuffer fb;
    Values values;
    immediate_modes<targets_of<Framebuffer>::count> modes;

    struct loaded {
        glm::vec3 p[size];
    };
    [[nodiscard]] __device__ loaded load(std::uint64_t i) const {
        const auto e = in.locate(static_cast<std::uint32_t>(i));
        loaded l;
        for (int k = 0; k < size; ++k) {
            const auto result =
                shader(core::fetch_vertex(vertices, e.index[k] - e.instance * in.vertices_each, draw, e.instance));
            l.p[k] = core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
        }
        return l;
    }
    __device__ void blend(int x, int y, int z, element_tally& tally) const {
        ++tally.fragments;
        core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (modes.of[K] != immediate_mode::off)
                tally.touched += blend_row(t, x, y, z, 1u, voxelpipe::get<K>(values), modes.of[K]);
        });
    }
    __device__ void draw_one(const loaded& l, element_tally& tally) const {
        const core::snapped_position a = core::snap(snap, l.p[0].x, l.p[0].y, l.p[0].z),
                                     b = core::snap(snap, l.p[size - 1].x, l.p[size - 1].y, l.p[size - 1].z);
        core::voxel_box reach{};
        switch (core::classify<Rule>(a, b, b, snap.fraction, whole, reach)) {
        case core::triangle_class::nonfinite:
            ++tally.nonfinite;
            return;
        case core::triangle_class::too_far:
            ++tally.too_far;
            return;
        case core::triangle_class::outside:
            ++tally.outside;
            return;
        default:
            break;
        }
        if constexpr (size == 1) {
            if constexpr (Rule == coverage::thin) {
                const std::int64_t x = a.x >> snap.fraction, y = a.y >> snap.fraction, z = a.z >> snap.fraction;
                if (x >= 0 && x <= whole.hi[0] && y >= 0 && y <= whole.hi[1] && z >= 0 && z <= whole.hi[2])
                    blend(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z), tally);
                return;
            }
        }
        core::passes::for_each_element_voxel<Rule>(
            a, b, snap.fraction, whole,
            [&](const auto&, const auto& p, std::int64_t) { blend(p[0], p[1], p[2], tally); });
    }
};

template <class Call>
__global__ __launch_bounds__(threads_per_block) void draw_elements_kernel(const __grid_constant__ Call call,
                                                                          pipeline_state* state) {
    await_stream();
    if (state->index_error != 0) return;
    element_tally tally;
    const std::uint64_t step = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < call.count;
         i += Call::batch * step) {
        typename Call::loaded l[Call::batch];
        for (int k = 0; k < Call::batch; ++k)
            if (const std::uint64_t at = i + static_cast<unsigned>(k) * step; at < call.count) l[k] = call.load(at);
        for (int k = 0; k < Call::batch; ++k)
            if (i + static_cast<unsigned>(k) * step < call.count) call.draw_one(l[k], tally);
    }
    const auto add = [](unsigned long long one, unsigned long long* total) {
        const unsigned long long sum = block_sum(one);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
    };
    add(tally.nonfinite, &state->nonfinite);
    add(tally.too_far, &state->too_far);
    add(tally.outside, &state->outside);
    add(tally.fragments, &state->fragments);
    if (call.modes.counts_first) add(tally.touched, &state->voxels);
}

// Finds indices that name no vertex.
template <int K>
struct check_elements {
    core::element_indices<K> in;
    pipeline_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (!in.locate(static_cast<std::uint32_t>(i)).ok) state->index_error = bad_index;
    }
};

// A call's launches. possible(): its targets can be drawn into like this.
template <class View, class VertexShader, class FragmentShader, class... Targets>
struct direct_element_call {
    using draw_type = draw<View, VertexShader, FragmentShader>;
    using framebuffer_type = framebuffer_view<Targets...>;
    using elements = core::elements_of<View>;
    using values_type = std::remove_cvref_t<decltype(std::declval<const FragmentShader&>().values)>;

    std::span<const draw_type> draws;
    grid g;
    framebuffer_type fb;
    std::uint64_t num_elements = 0;
    immediate_plan<sizeof...(Targets)> plan;

    direct_element_call(std::span<const draw_type> draws_, const grid& g_, const framebuffer_type& fb_,
                        bool count_voxels)
        : draws(draws_), g(g_), fb(fb_) {
        for (const draw_type& d : draws) num_elements += elements::count(d.mesh) * d.mesh.copies.count;
        if (!draws.empty()) plan_immediate(draws, fb, num_elements, count_voxels, plan);
    }
    [[nodiscard]] bool is_possible() const { return !draws.empty() && num_elements != 0 && plan.possible; }
    // `state` is zero.
    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) const {
        for (const draw_type& d : draws)
            if (const auto in = elements::indices(d.mesh); in.indices != nullptr)
                for_each(in.each, check_elements<elements::size>{in, state}, stage::coarse_raster, stream);
        if (fb.changes != nullptr) // the log does not describe the targets any longer
            check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(word), stream),
                  stage::fine_raster);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
            auto t = voxelpipe::get<K>(fb.targets);
            if (plan.counts(K)) t.clear_value = {}; // the number of fragments
            if (t.load == load_operation::clear) clear_target(t, state, {}, stream);
        });
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const View& view = draws[d].mesh;
            const direct_elements<Rule, View, VertexShader, framebuffer_type, values_type> call{
                elements::vertices(view),
                draws[d].vertex_shader,
                static_cast<std::uint32_t>(d),
                elements::indices(view),
                elements::count(view) * view.copies.count,
                core::make_snap_transform(g),
                {{{0, 0, 0}}, {{g.extent.x - 1, g.extent.y - 1, g.extent.z - 1}}},
                fb,
                draws[d].fragment_shader.values,
                plan.modes};
            static_assert(sizeof(call) <= 3900,
                          "voxelpipe: a shader has too much data by value; let it hold a pointer");
            if (call.count != 0)
                launch_behind(draw_elements_kernel<std::remove_const_t<decltype(call)>>, fill_device(call.count),
                              threads_per_block, stream, stage::fine_raster, call, state);
        }
        if (plan.has_last_pass())
            finalize_counts(plan, fb, draws[0].fragment_shader.values, chunk_marks{}, state, {}, stream);
    }
    [[nodiscard]] status status_of(const pipeline_state& state) const {
        status s;
        if (state.index_error != 0) {
            s = core::failure(status_code::index_out_of_range, stage::coarse_raster);
        } else {
            s = to_status(state);
            s.counts.triangles_drawn = num_elements - s.counts.triangles_dropped() - s.counts.triangles_outside;
        }
        s.counts.triangles_in = num_elements;
        return s;
    }
};

} // namespace device

namespace core {

// Implements voxelize of points and lines where lists are not needed; otherwise returns nothing. Arguments are
// validated.
template <coverage Rule, class View, class VertexShader, class FragmentShader, class... Targets>
std::optional<status> run_module(elements_tag<Rule>, cuda_backend& backend,
                                 std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                 const framebuffer_view<Targets...>& fb, bool count_voxels) {
    if constexpr (is_constant<FragmentShader> && (device::is_immediate<Targets>() && ...)) {
        const device::direct_element_call<View, VertexShader, FragmentShader, Targets...> call(draws, g, fb,
                                                                                               count_voxels);
        if (!call.is_possible()) return std::nullopt;
        try {
            const device_block memory(sizeof(device::pipeline_state), backend.resource, backend.stream);
            auto* const state = static_cast<device::pipeline_state*>(memory.data());
            device::check(cudaMemsetAsync(state, 0, sizeof(*state), backend.stream));
            call.template launch<Rule>(state, backend.stream);
            device::pipeline_state found{};
            device::check(cudaMemcpyAsync(&found, state, sizeof(found), cudaMemcpyDeviceToHost, backend.stream));
            device::check(cudaStreamSynchronize(backend.stream));
            return call.status_of(found);
        } catch (const device::cuda_failure& e) {
            return device::to_status(e);
        }
    } else {
        return std::nullopt;
    }
}

} // namespace core

} // namespace voxelpipe
