// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Framebuffers that depend only on which voxels are touched: one constant in all draws, and blends for which its second
// fragment in a voxel changes nothing, as bits, replace, min and max. The touched voxels are set in bits of the call's
// own memory, whatever the targets are, and last passes give every target its values, each element once, count the
// voxels and leave zeros for the next call. Nothing of a target is written before all triangles have been seen, so that
// no index need be checked before that: to read them all once more took a fifth of the time of a mesh of 7 million
// triangles.

#include <voxelpipe/device/clear_target.cuh>
#include <voxelpipe/device/direct_raster.cuh>
#include <voxelpipe/device/touched_values.cuh>
#include <voxelpipe/device/tracked_clear.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// Of the touched voxels' bits, which the last passes go through.
inline constexpr std::uint64_t most_touched_bytes = std::uint64_t{512} << 20;
// Where targets can be drawn into as they lie (direct_raster.cuh): what is in L2 then. Without voxels to count, nor
// values to clear, those passes take longer than a clear, from more bytes than these on: 16 MB and the 871,000
// triangles of the dragon 0.0976 instead of 0.0935 ms, 2.9 million the same, 7.2 million 0.173 instead of 0.193.
inline constexpr std::uint64_t most_touched_bytes_of_direct = std::uint64_t{32} << 20;
inline constexpr std::uint64_t least_touched_bytes = std::uint64_t{1} << 20, touched_bytes_per_triangle = 6;

using touched_target = target<bit, blend::bit_or>;

// A framebuffer of one target that is laid out as they are, and takes true as they do.
template <class Framebuffer>
inline constexpr bool is_touched_itself = false;
template <class Target>
inline constexpr bool is_touched_itself<framebuffer_view<Target>> =
    std::is_same_v<typename Target::blend_type, blend::bit_or> && !Target::map::bricks && Target::map::is_bit;

// ---- raster ---------------------------------------------------------------------------------------------------------

template <class Call>
struct touching_sink : blending_sink<Call> {
    using blending_sink<Call>::blending_sink;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        return this->call.out.checked || this->call.out.check(index);
    }
};

struct touched_output : framebuffer_output<framebuffer_view<touched_target>, core::pack<bool>> {
    template <class Call>
    using sink = touching_sink<Call>;
    template <class Call>
    using rest_sink = sink<Call>;
    static constexpr bool only_sets = true;

    std::uint32_t num_vertices;
    pipeline_state* state;
    bool checked; // whether check_indices has run

    touched_output(word* words, const glm::ivec3& extent, std::uint32_t num_vertices_, pipeline_state* state_,
                   bool checked_)
        : framebuffer_output{{extent, {}}, core::make_pack(true), {}, {}}, num_vertices(num_vertices_), state(state_),
          checked(checked_) {
        auto& t = voxelpipe::get<0>(fb.targets);
        t.elements = words;
        t.extent = extent;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_checked() const { return checked; }
    // Whether all three are vertices; says so where they are not.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        const bool ok = index.x < num_vertices && index.y < num_vertices && index.z < num_vertices;
        if (!ok) atomicOr(&state->index_error, 1u);
        return ok;
    }
};

// ---- the last passes ------------------------------------------------------------------------------------------------

// Whether the second fragment of one value changes nothing.
template <class Target>
inline constexpr bool is_blended_once = std::is_same_v<typename Target::blend_type, blend::replace> ||
                                        (Target::map::is_bit ? bit_blend<typename Target::blend_type>::sets ||
                                                                   bit_blend<typename Target::blend_type>::clears
                                                             : core::is_repeated_once<typename Target::blend_type>);
template <class Framebuffer>
inline constexpr bool depends_on_touched = false;
template <class... Targets>
inline constexpr bool depends_on_touched<framebuffer_view<Targets...>> = (is_blended_once<Targets> && ...);

// Whether some target is written from end to end anyway.
template <class... Targets>
[[nodiscard]] bool clears_values(const framebuffer_view<Targets...>& fb) {
    bool any = false;
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        any = any || (!core::pack_element<K, Targets...>::type::map::is_bit &&
                      voxelpipe::get<K>(fb.targets).load == load_operation::clear);
    });
    return any;
}

// What a word of a target becomes, of which these bits are touched by fragments of this value.
template <class Target>
__device__ VOXELPIPE_INLINE word end_word(word old, word touched, bool value) {
    using blend_type = bit_blend<typename Target::blend_type>;
    if (value) return blend_type::clears ? old : old | touched;
    return blend_type::sets ? old : old & ~touched;
}

// The words of a target of bits at words `first` to first + 3 of the grid's, of which there are `num`.
template <class Target>
__device__ VOXELPIPE_INLINE void end_words(const target_view<Target>& t, std::uint64_t first, std::uint64_t num,
                                           const uint4& touched, bool value) {
    using map = typename Target::map;
    const word bits[4] = {touched.x, touched.y, touched.z, touched.w};
    const bool is_cleared = t.load == load_operation::clear && !map::bricks; // those of bricks have been
    if (!is_cleared && (touched.x | touched.y | touched.z | touched.w) == 0) return;
    if constexpr (!map::bricks) {
        if (is_cleared && !t.clear_value && first + 4 <= num &&
            reinterpret_cast<std::uintptr_t>(t.elements) % 16 == 0) {
            uint4 made;
            made.x = end_word<Target>(0, bits[0], value);
            made.y = end_word<Target>(0, bits[1], value);
            made.z = end_word<Target>(0, bits[2], value);
            made.w = end_word<Target>(0, bits[3], value);
            *reinterpret_cast<uint4*>(t.elements + first) = made;
            return;
        }
    }
    const auto words_x = static_cast<std::uint32_t>((t.extent.x + 31) / 32);
    for (unsigned k = 0; k < 4 && first + k < num; ++k) {
        if (!is_cleared && bits[k] == 0) continue;
        const auto row = static_cast<std::uint32_t>((first + k) / words_x);
        const int x = static_cast<int>(static_cast<std::uint32_t>(first + k) - row * words_x) * 32;
        std::size_t at = first + k;
        if constexpr (map::bricks) {
            const auto ny = static_cast<std::uint32_t>(t.extent.y);
            at = map::cell(t.extent, x, static_cast<int>(row % ny), static_cast<int>(row / ny));
        }
        const int left = t.extent.x - x;
        const word cleared = !t.clear_value ? 0 : left >= 32 ? ~0u : (1u << left) - 1;
        t.elements[at] = end_word<Target>(is_cleared ? cleared : t.elements[at], bits[k], value);
    }
}

template <class Framebuffer, class Values>
__global__ __launch_bounds__(threads_per_block) void end_touched_kernel(uint4* touched, std::uint64_t num_words,
                                                                        const __grid_constant__ Framebuffer fb,
                                                                        const __grid_constant__ Values values,
                                                                        bool count_voxels, pipeline_state* state,
                                                                        capacities limits) {
    constexpr unsigned batch = 4; // loads that go out together
    await_stream();
    const bool failed = state->index_error != 0 || misses_triangles(*state, limits);
    const std::uint64_t num = (num_words + 3) / 4, threads = std::uint64_t{gridDim.x} * blockDim.x;
    unsigned found = 0;
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; first < num;
         first += batch * threads) {
        uint4 loaded[batch];
        for (unsigned b = 0; b < batch; ++b)
            loaded[b] = first + b * threads < num ? touched[first + b * threads] : uint4{0, 0, 0, 0};
        for (unsigned b = 0; b < batch; ++b) {
            const std::uint64_t i = first + b * threads;
            const uint4& t = loaded[b];
            if (i >= num) break;
            if ((t.x | t.y | t.z | t.w) != 0) {
                touched[i] = uint4{0, 0, 0, 0};
                found += static_cast<unsigned>(__popc(t.x) + __popc(t.y) + __popc(t.z) + __popc(t.w));
            }
            if (failed) continue;
            core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
                if constexpr (targets_of<Framebuffer>::template at<K>::map::is_bit) {
                    const auto& target = voxelpipe::get<K>(fb.targets);
                    if (target.load != load_operation::off)
                        end_words(target, 4 * i, num_words, t, voxelpipe::get<K>(values));
                }
            });
        }
    }
    if (!count_voxels) return;
    const unsigned long long sum = block_sum(found);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
}

// Ends a call: touched voxels become values of the targets, and zeros.
template <class... Targets, class Values>
void end_touched(word* touched, const framebuffer_view<Targets...>& fb,
                 const change_tracking<framebuffer_view<Targets...>>& tracking, const Values& values, bool count_voxels,
                 pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        using map = typename target::map;
        const auto& t = voxelpipe::get<K>(fb.targets);
        if constexpr (map::bricks) // whose padding has no places in rows
            if (t.load == load_operation::clear) clear_target(t, state, limits, stream);
        if constexpr (!map::is_bit) {
            const auto value = static_cast<typename target::value_type>(voxelpipe::get<K>(values));
            if constexpr (!map::bricks)
                if (tracking.by_chunks[K]) end_chunks<K>(touched, t, value, tracking, state, limits, stream);
            if (t.load != load_operation::off && !tracking.by_chunks[K])
                end_values(touched, t, value, tracking, state, limits, stream);
        }
    });
    note_clears(tracking, false, state, limits, stream);
    const std::uint64_t num = touched_target::map::elements(fb.extent);
    launch_behind(end_touched_kernel<framebuffer_view<Targets...>, Values>, fill_device(num / 16 + 1),
                  threads_per_block, stream, stage::tile_resolve, reinterpret_cast<uint4*>(touched), num, fb, values,
                  count_voxels, state, limits);
}

} // namespace voxelpipe::device
