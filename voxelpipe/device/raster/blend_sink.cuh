// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sink of the immediate strategy: blends fragments straight into the render targets.

#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/raster/mark_boxes.cuh>
#include <voxelpipe/device/raster/sink.cuh>
#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/targets/dirty_chunks.cuh>
#include <voxelpipe/device/targets/global_target.cuh>
#include <voxelpipe/device/targets/target_traits.cuh>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

template <class Call>
struct blending_sink : sink_base<Call> {
    static constexpr bool stages_in_shared = false;
    static constexpr bool merges_equal_voxels = !Call::output::defers; // only then is one() called
    static constexpr bool splits_long_rows = merges_equal_voxels;
    struct memory {};

    // Counts of one thread's fragments and first touches. They fit 32 bits: the largest list ends before a thread has
    // written 2^32.
    struct totals {
        unsigned fragments = 0, touched = 0;
    };
    totals mine;

    __device__ VOXELPIPE_INLINE blending_sink(const Call& call, unsigned* dropped, memory&)
        : sink_base<Call>{call, dropped} {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool check(const glm::uvec3&) { return true; }
    __device__ VOXELPIPE_INLINE static void begin(std::uint32_t) {}
    // If the output has marks: marks the chunks that a triangle may touch, or, of a split triangle, those that it does
    // touch.
    __device__ VOXELPIPE_INLINE void mark_boxes(bool wanted, const int32_triangle& r) const {
        if constexpr (!Call::output::only_blends)
            if (this->call.out.marks.words != nullptr) device::mark_boxes<Call::rule>(this->call.out.marks, wanted, r);
    }
    __device__ VOXELPIPE_INLINE void mark_row(int x0, int x1, int y, int z) const {
        if constexpr (merges_equal_voxels && !Call::output::only_blends)
            if (this->call.out.marks.words != nullptr) this->call.out.marks.mark_row(x0, x1, y, z);
    }
    __device__ VOXELPIPE_INLINE void mark_brick(const std::int32_t (&corner)[3], unsigned lane) const {
        if constexpr (merges_equal_voxels && !Call::output::only_blends)
            if (this->call.out.marks.words != nullptr) this->call.out.marks.mark_brick(corner, lane);
    }
    // Blends the voxels x0 + i of a row, for the bits i of the mask.
    __device__ VOXELPIPE_INLINE void row(int x0, int y, int z, word mask) {
        if (mask == 0) return;
        add_or_blend(
            mask, [=](const auto& t, const auto& value) VOXELPIPE_INLINE_LAMBDA { add_row(t, x0, y, z, mask, value); },
            [=](const auto& t, const auto& value, immediate_mode mode)
                VOXELPIPE_INLINE_LAMBDA { return blend_row(t, x0, y, z, mask, value, mode); });
    }
    __device__ VOXELPIPE_INLINE void row_by_all(unsigned, int x0, int y, int z, word mask) {
        const word own = mask & bits_of_lane();
        mine.fragments += static_cast<unsigned>(__popc(own));
        each_target([&]<std::size_t K>(const auto& t, immediate_mode mode)
                        VOXELPIPE_INLINE_LAMBDA { mine.touched += blend_row(t, x0, y, z, own, value_of<K>(), mode); });
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE auto position(int x, int y, int z) const {
        if constexpr (Call::output::only_sets)
            return word_position_of(voxelpipe::get<0>(this->call.out.fb.targets), glm::ivec3(x, y, z));
        else
            return glm::ivec3(x, y, z);
    }
    __device__ VOXELPIPE_INLINE void emit(const glm::ivec3& at, bool wanted) {
        if (wanted) row(at.x, at.y, at.z, 1u);
    }
    __device__ VOXELPIPE_INLINE void emit(const word_position& at, bool wanted) {
        if (!wanted) return;
        ++mine.fragments;
        reduce_or(voxelpipe::get<0>(this->call.out.fb.targets).elements + at.number(), at.bit());
    }
    __device__ VOXELPIPE_INLINE void emit_line(word_position first, const word_position& step, unsigned count) {
        mine.fragments += count;
        // Loaded once: the compiler reloads after each reduction whatever is not in a register.
        word* const words = voxelpipe::get<0>(this->call.out.fb.targets).elements;
        for (; count != 0; --count, first = first + step) reduce_or(words + first.number(), first.bit());
    }
    // Voxels as in blend_cube.
    __device__ VOXELPIPE_INLINE void cube(int x, int y, int z, word voxels) {
        add_or_blend(
            voxels,
            [=](const auto& t, const auto& value) VOXELPIPE_INLINE_LAMBDA { add_cube(t, x, y, z, voxels, value); },
            [=](const auto& t, const auto& value, immediate_mode mode)
                VOXELPIPE_INLINE_LAMBDA { return blend_cube(t, x, y, z, voxels, value, mode); });
    }
    // Counts voxels that are drawn by other means.
    __device__ VOXELPIPE_INLINE void count(word voxels) { mine.fragments += static_cast<unsigned>(__popc(voxels)); }
    // Rows as in blend_slim.
    __device__ VOXELPIPE_INLINE void slim(int x, int y, int z, const core::slim_rows& rows) {
        mine.fragments += static_cast<unsigned>(__popc(rows.bits));
        each_target([&]<std::size_t K>(const auto& t, immediate_mode mode)
                        VOXELPIPE_INLINE_LAMBDA { mine.touched += blend_slim(t, x, y, z, rows, value_of<K>(), mode); });
    }
    // One voxel. Lanes that call this together may have the same one.
    __device__ VOXELPIPE_INLINE void one(int x, int y, int z) {
        ++mine.fragments;
        each_target([&]<std::size_t K>(const auto& t, immediate_mode mode) VOXELPIPE_INLINE_LAMBDA {
            const auto& value = value_of<K>();
            if constexpr (std::remove_cvref_t<decltype(t)>::map::is_bit)
                mine.touched += blend_row(t, x, y, z, 1u, value, mode);
            else
                mine.touched += blend_shared(t, x, y, z, value, mode);
        });
    }
    // The voxels position_of(i) for the bits i of a mask of four.
    template <class Position>
    __device__ VOXELPIPE_INLINE void voxels(word bits, const Position& position_of) {
        mine.fragments += static_cast<unsigned>(__popc(bits));
        each_target([&]<std::size_t K>(const auto& t, immediate_mode mode) VOXELPIPE_INLINE_LAMBDA {
            mine.touched += blend_voxels(t, bits, position_of, value_of<K>(), mode);
        });
    }
    // Moves counts from one sink of a thread to another.
    [[nodiscard]] __device__ VOXELPIPE_INLINE totals end() const { return mine; }
    __device__ VOXELPIPE_INLINE void take_over(const totals& other) {
        mine.fragments += other.fragments;
        mine.touched += other.touched;
    }
    // Adds the block's counts to the state. All threads of the block call it.
    __device__ void finish(pipeline_state* state) const {
        const auto add = [](unsigned one, unsigned long long* total) {
            const unsigned long long sum = block_sum(one);
            if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
        };
        add(mine.fragments, &state->fragments);
        if (this->call.out.modes.counts_first) add(mine.touched, &state->voxels);
    }

private:
    template <std::size_t K>
    [[nodiscard]] __device__ VOXELPIPE_INLINE decltype(auto) value_of() const {
        if constexpr (Call::output::only_sets)
            return true;
        else
            return (voxelpipe::get<K>(this->call.out.values));
    }
    // Counts the fragments of `bits`, and gives them to each target: to one whose values are added by rows, in the mode
    // `blend`, by add(target, value), to any other by blend(target, value, mode), which returns how many voxels are
    // new.
    template <class Add, class Blend>
    __device__ VOXELPIPE_INLINE void add_or_blend(word bits, const Add& add, const Blend& blend) {
        mine.fragments += static_cast<unsigned>(__popc(bits));
        each_target([&]<std::size_t K, class Target>(const target_view<Target>& t, immediate_mode mode)
                        VOXELPIPE_INLINE_LAMBDA {
                            if constexpr (has_value_rows<Target>)
                                if (mode == immediate_mode::blend) [[likely]]
                                    return add(t, value_of<K>());
                            mine.touched += blend(t, value_of<K>(), mode);
                        });
    }
    template <class F>
    __device__ VOXELPIPE_INLINE void each_target(F&& f) const {
        core::for_each_index<targets_of<decltype(this->call.out.fb)>::count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(this->call.out.fb.targets);
            if constexpr (Call::output::only_sets || Call::output::only_blends)
                f.template operator()<K>(t, immediate_mode::blend);
            else if (const immediate_mode mode = this->call.out.modes.of[K]; mode != immediate_mode::off)
                f.template operator()<K>(t, mode);
        });
    }
};

template <class Framebuffer>
inline constexpr bool has_only_bits = false;
template <class... Targets>
inline constexpr bool has_only_bits<framebuffer_view<Targets...>> = (Targets::map::is_bit && ...);

template <class Framebuffer, class Values>
struct framebuffer_output {
    template <class Call>
    using sink = blending_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    static constexpr bool defers = has_only_bits<Framebuffer>; // otherwise raster/block_pass.cuh draws
    static constexpr bool may_draw_few = false;                // compiles less; not timed
    // Facts for the compiler: all targets are in use, their mode is to blend, and there are no marks; or all values are
    // true instead of the last.
    static constexpr bool only_blends = false, only_sets = false;
    Framebuffer fb;
    Values values;
    immediate_modes<targets_of<Framebuffer>::count> modes;
    chunk_marks marks; // of targets that hold values; without words if no chunk is to be marked

    __device__ VOXELPIPE_INLINE static void prepare(std::uint64_t, std::uint64_t) {} // work for a later kernel
    // True if check_indices has run; otherwise the sink checks all indices.
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool is_checked() { return true; }
};

// For the first pass of calls that blend all of their targets, which hold values, and mark no chunks.
template <class Framebuffer, class Values>
struct blended_output : framebuffer_output<Framebuffer, Values> {
    template <class Call>
    using sink = blending_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    static constexpr bool only_blends = true;
};
template <class Framebuffer>
inline constexpr bool has_only_values = false;
template <class... Targets>
inline constexpr bool has_only_values<framebuffer_view<Targets...>> = (has_value_rows<Targets> && ...);

} // namespace voxelpipe::device
