// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sink of the occupancy mask: sets one bit for each voxel that has a fragment, whatever the targets are.

#include <voxelpipe/device/raster/blend_sink.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Call>
struct mask_sink : blending_sink<Call> {
    using blending_sink<Call>::blending_sink;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        return this->call.out.checked || this->call.out.check(index);
    }
};

struct mask_output : framebuffer_output<framebuffer_view<mask_target>, core::pack<bool>> {
    template <class Call>
    using sink = mask_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    static constexpr bool may_draw_few = true;
    static constexpr bool only_sets = true;

    std::uint32_t num_vertices;
    pipeline_state* state;
    bool checked; // check_indices has run

    mask_output(word* words, const glm::ivec3& extent, std::uint32_t num_vertices_, pipeline_state* state_,
                bool checked_)
        : framebuffer_output{{extent, {}}, core::make_pack(true), {}, {}}, num_vertices(num_vertices_), state(state_),
          checked(checked_) {
        auto& t = voxelpipe::get<0>(fb.targets);
        t.elements = words;
        t.extent = extent;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_checked() const { return checked; }
    // True if all three indices name vertices; otherwise notes the error.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        const bool ok = index.x < num_vertices && index.y < num_vertices && index.z < num_vertices;
        if (!ok) atomicOr(&state->index_error, bad_index);
        return ok;
    }
};

// A single target with the mask's own layout and blend: the mask is the target.
template <class Framebuffer>
inline constexpr bool is_mask_itself = false;
template <class Target>
inline constexpr bool is_mask_itself<framebuffer_view<Target>> =
    std::is_same_v<typename Target::blend_type, blend::bit_or> && !Target::map::bricks && Target::map::is_bit;

} // namespace voxelpipe::device
