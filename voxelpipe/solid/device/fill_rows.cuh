// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep into render targets: the bodies of a voxel are shaded and folded in draw order in a lane's registers, and
// each voxel is stored once. The 32 voxels of a warp are a word of a target of bits, which no other warp writes.

#include <voxelpipe/device/targets/target_traits.cuh>
#include <voxelpipe/solid/device/sweep_rows.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// The solid's shader of each body: one, or an array by draw.
template <class SolidShader>
struct body_shaders {
    SolidShader one;
    const SolidShader* many;
    [[nodiscard]] __device__ VOXELPIPE_INLINE const SolidShader& of(std::uint32_t body) const {
        return many != nullptr ? many[body] : one;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE auto shade(const body_at_voxel& at, const glm::ivec3& voxel) const {
        return of(at.body)(solid_fragment{voxel, at.body, at.winding});
    }
};

template <class Framebuffer>
struct voxel_fold;
// The values of one voxel in each target, as far as its fragments are folded.
template <class... Targets>
struct voxel_fold<framebuffer_view<Targets...>> {
    template <std::size_t K>
    using target = typename core::pack_element<K, Targets...>::type;
    using accumulators = core::pack<typename Targets::traits::accumulator...>;

    // From what the voxel holds. It lies in the extent where `is_valid`; all targets that are cleared have been.
    template <class Target>
    [[nodiscard]] __device__ VOXELPIPE_INLINE static typename Target::traits::accumulator
    begin(const target_view<Target>& t, bool is_valid, int x, int y, int z) {
        return Target::traits::begin(t.load == load_operation::load && is_valid ? t(x, y, z) : t.clear_value);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static accumulators begin(const framebuffer_view<Targets...>& fb,
                                                                        bool is_valid, int x, int y, int z) {
        return [&]<std::size_t... K>(std::index_sequence<K...>) VOXELPIPE_INLINE_LAMBDA {
            return core::make_pack(begin(voxelpipe::get<K>(fb.targets), is_valid, x, y, z)...);
        }
        (std::index_sequence_for<Targets...>{});
    }
    template <class Values>
    __device__ VOXELPIPE_INLINE static void apply(accumulators& a, const Values& values) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            target<K>::traits::apply(voxelpipe::get<K>(a), voxelpipe::get<K>(values));
        });
    }
    // Writes the voxels of the lanes that have fragments. x0 is the voxel of lane 0; all lanes take part.
    __device__ VOXELPIPE_INLINE static void store(const framebuffer_view<Targets...>& fb, const accumulators& a,
                                                  bool has_any, int x0, int y, int z) {
        const int x = x0 + static_cast<int>(threadIdx.x % 32);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (t.load == load_operation::off) return;
            if constexpr (target<K>::map::is_bit) {
                const unsigned touched = __ballot_sync(0xffffffffu, has_any);
                const unsigned bits = __ballot_sync(
                    0xffffffffu, has_any && static_cast<bool>(target<K>::traits::end(voxelpipe::get<K>(a))));
                if (x == x0 && touched != 0) {
                    word* const w = t.elements + target<K>::map::cell(t.extent, x0, y, z);
                    *w = (*w & ~touched) | bits;
                }
            } else if (has_any) {
                t.store(x, y, z, target<K>::traits::end(voxelpipe::get<K>(a)));
            }
        });
        __syncwarp();
    }
};

template <class SolidShader, class Framebuffer>
__global__ __launch_bounds__(threads_per_block) void fill_rows_kernel(
    const __grid_constant__ crossing_list list, const __grid_constant__ sweep_rules rules,
    const __grid_constant__ body_shaders<SolidShader> shaders, const __grid_constant__ Framebuffer fb,
    pipeline_state* state, capacities limits) {
    using fold = voxel_fold<Framebuffer>;
    __shared__ sweep_memory memory[threads_per_block / 32];
    await_stream();
    if (has_failed(*state, limits)) return;
    const int lane = static_cast<int>(threadIdx.x % 32);
    sweep_totals totals;
    for_each_row(list, rules, memory[warp_in_block()], state->list_fragments, [&](const row_sweep& sweep) {
        const auto y = static_cast<int>(sweep.row % static_cast<std::uint64_t>(rules.grid.extent.y)),
                   z = static_cast<int>(sweep.row / static_cast<std::uint64_t>(rules.grid.extent.y));
        const auto reach = sweep.find_reach();
        if (lane == 0) totals.open_rows += reach.num_open;
        for (int x0 = reach.begin / 32 * 32; x0 < reach.end; x0 += 32) {
            const int x = x0 + lane;
            const bool is_valid = x < rules.grid.extent.x;
            auto a = fold::begin(fb, is_valid, x, y, z);
            bool has_any = false;
            sweep.for_each_body_at(x0, [&](const body_at_voxel& at) {
                if (is_valid) totals.see(at.winding);
                if (at.is_inside) {
                    const auto out = shaders.shade(at, rules.offset + glm::ivec3(x, y, z));
                    ++(out.keep ? totals.fragments : totals.discarded);
                    if (out.keep) fold::apply(a, out.values);
                    has_any = has_any || out.keep;
                }
                __syncwarp();
            });
            totals.voxels += static_cast<unsigned>(has_any);
            if (__any_sync(0xffffffffu, static_cast<int>(has_any)) != 0) fold::store(fb, a, has_any, x0, y, z);
        }
    });
    totals.add_up(rules, state);
}

// The entries are sorted by sort_crossings; targets that are cleared hold their clear values already.
template <class SolidShader, class Framebuffer>
void fill_rows(const crossing_list& list, const sweep_rules& rules, const body_shaders<SolidShader>& shaders,
               const Framebuffer& fb, pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(fill_rows_kernel<SolidShader, Framebuffer>, fill_device(limits.fragments), threads_per_block, stream,
                  stage::tile_resolve, list, rules, shaders, fb, state, limits);
}

} // namespace voxelpipe::device
