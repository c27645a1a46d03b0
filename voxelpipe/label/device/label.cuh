// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// label on a GPU: run_module of core::label_tag, with the bytes of cpu_backend. The array of labels is the array of the
// union-find. A thread has a word of 32 voxels: it starts the word's segments, joins them with those of the rows
// before, and makes the roots their parents; then a lane a voxel writes the labels. Threads join in any order and never
// wait for one another. Compiled by programs that call it, and by no other.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/label/core/row_contacts.hpp>
#include <voxelpipe/label/label.hpp>
#include <voxelpipe/label/passes/component_list.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe::device {

// The words of a grid, which threads take by their numbers.
template <class Number>
struct label_words {
    core::bit_rows_of<word, Number> rows;

    [[nodiscard]] VOXELPIPE_HD std::uint64_t count() const {
        return rows.rows() * static_cast<std::uint64_t>(rows.row_words());
    }
    struct place {
        int x, y, z;  // x in words
        Number first; // number of the voxel at bit 0
    };
    [[nodiscard]] VOXELPIPE_HD place at(std::uint64_t i) const {
        const auto row_words = static_cast<std::uint64_t>(rows.row_words()),
                   ny = static_cast<std::uint64_t>(rows.extent.y), row = i / row_words;
        place p{};
        p.x = static_cast<int>(i % row_words);
        p.y = static_cast<int>(row % ny);
        p.z = static_cast<int>(row / ny);
        p.first = rows.first_voxel(p.y, p.z) + 32 * static_cast<Number>(p.x);
        return p;
    }
    [[nodiscard]] VOXELPIPE_HD core::word_window<word> window(int x, int y, int z) const {
        const core::bit_row<word> row = rows.row(y, z);
        return {row(x - 1), row(x), row(x + 1)};
    }
};

// The parent of a segment is itself, or the segment that goes on into it from the word before.
template <class Number>
struct start_segments {
    label_words<Number> words;
    Number* parents;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto at = words.at(i);
        const core::bit_row<word> row = words.rows.row(at.y, at.z);
        const word now = row(at.x), before = row(at.x - 1);
        word left = core::segment_starts(now);
        if ((before >> 31 & now & 1) != 0) {
            parents[at.first] = at.first - 32 + static_cast<Number>(core::segment_start(before, 31));
            left &= left - 1;
        }
        for (; left != 0; left &= left - 1) {
            const Number v = at.first + static_cast<Number>(exact::lowest_one(left));
            parents[v] = v;
        }
    }
};

template <class Number>
struct join_segments {
    label_words<Number> words;
    int connectivity;
    core::disjoint_sets<Number> sets;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto at = words.at(i);
        core::near_words<word> near;
        near.here = words.window(at.x, at.y, at.z);
        if (near.here.now == 0) return;
        near.front = words.window(at.x, at.y - 1, at.z);
        near.below = words.window(at.x, at.y, at.z - 1);
        near.below_front = words.window(at.x, at.y - 1, at.z - 1);
        if (connectivity != 6) near.below_back = words.window(at.x, at.y + 1, at.z - 1);
        // Rows beyond the grid have no bits, and their numbers are not used.
        const auto row = static_cast<Number>(words.rows.extent.x),
                   slice = row * static_cast<Number>(words.rows.extent.y);
        const core::near_numbers<Number> first{at.first, at.first - row, at.first - slice, at.first - slice - row,
                                               at.first - slice + row};
        core::join_word<false>(sets, near, first, connectivity, core::near_rows{true, true, true, true});
    }
};

// Roots become parents, and are marked.
template <class Number>
struct flatten_segments {
    label_words<Number> words;
    core::disjoint_sets<Number> sets;
    word* marks;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto at = words.at(i);
        for (word left = core::segment_starts(words.rows.row(at.y, at.z)(at.x)); left != 0; left &= left - 1) {
            const Number v = at.first + static_cast<Number>(exact::lowest_one(left)), root = sets.find(v);
            if (root != v)
                sets.set_root(v, root);
            else
                core::store_shared(marks[v / 32], word{1} << (v % 32), true);
        }
    }
};

// A warp a word. Only voxels that begin no segment are written, and only the others are read.
template <class Number>
__global__
__launch_bounds__(threads_per_block) void write_labels_kernel(const __grid_constant__ label_words<Number> words,
                                                              Number* labels) {
    await_stream();
    const int lane = static_cast<int>(threadIdx.x % 32);
    const std::uint64_t count = words.count(), warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < count;
         i += warps) {
        const auto at = words.at(i);
        if (32 * at.x + lane >= words.rows.extent.x) continue;
        const word now = words.rows.row(at.y, at.z)(at.x);
        Number* const to = labels + at.first;
        if ((now >> lane & 1) == 0) {
            to[lane] = static_cast<Number>(no_label);
        } else if (const int start = core::segment_start(now, lane); start != lane) {
            to[lane] = to[start];
        }
    }
}

// Adds the parts that lanes have, those of one component as one: of the first lane's, which mostly is the largest. All
// lanes call it.
__device__ inline void add_parts(const core::component_list& list, bool has, std::uint64_t number,
                                 const core::component_part& part) {
    constexpr unsigned all = 0xffffffffu;
    const unsigned with_part = __ballot_sync(all, static_cast<int>(has));
    if (with_part == 0) return;
    const int first = __ffs(static_cast<int>(with_part)) - 1;
    const std::uint64_t common = __shfl_sync(all, number, first);
    const bool is_common = has && number == common;
    const auto least = [&](int n) {
        return static_cast<int>(__reduce_min_sync(all, is_common ? static_cast<unsigned>(n) : all));
    };
    const auto most = [&](int n) {
        return static_cast<int>(__reduce_max_sync(all, is_common ? static_cast<unsigned>(n) : 0u));
    };
    core::component_part sum;
    sum.voxels = __reduce_add_sync(all, is_common ? static_cast<unsigned>(part.voxels) : 0u);
    sum.min = {least(part.min.x), least(part.min.y), least(part.min.z)};
    sum.max = {most(part.max.x), most(part.max.y), most(part.max.z)};
    if (static_cast<int>(threadIdx.x % 32) == first)
        list.add(number, sum);
    else if (has && !is_common)
        list.add(number, part);
}

// A lane a word: adds its segments to their components, one after the other.
template <class Number>
__global__
__launch_bounds__(threads_per_block) void measure_components_kernel(const __grid_constant__ label_words<Number> words,
                                                                    const Number* labels,
                                                                    const __grid_constant__ core::component_list list) {
    await_stream();
    const std::uint64_t count = words.count(), threads = std::uint64_t{gridDim.x} * threads_per_block;
    for (std::uint64_t base = std::uint64_t{blockIdx.x} * threads_per_block + 32 * std::uint64_t{warp_in_block()};
         base < count; base += threads) {
        const std::uint64_t i = base + threadIdx.x % 32;
        const auto at = words.at(i < count ? i : base);
        const word now = i < count ? words.rows.row(at.y, at.z)(at.x) : 0;
        word left = core::segment_starts(now);
        while (__any_sync(0xffffffffu, static_cast<int>(left != 0)) != 0) {
            const bool has = left != 0;
            std::uint64_t number = 0;
            core::component_part part;
            if (has) {
                const int x = exact::lowest_one(left);
                left &= left - 1;
                const word gaps = ~(now >> x);
                const int length = gaps == 0 ? 32 : exact::lowest_one(gaps);
                number = list.number(labels[at.first + static_cast<Number>(x)]);
                part.voxels = static_cast<std::uint64_t>(length);
                part.min = {32 * at.x + x, at.y, at.z};
                part.max = {32 * at.x + x + length - 1, at.y, at.z};
            }
            add_parts(list, has, number, part);
        }
    }
}

} // namespace voxelpipe::device

namespace voxelpipe::core {

// Implements label. Arguments are validated; cuda_backend::guard runs it. Waits for the number of components, and once
// more for their list.
template <class Label>
[[nodiscard]] status run_module(label_tag, cuda_backend& backend, const std::uint32_t* bits, const glm::ivec3& extent,
                                int connectivity, Label* labels, cuda_backend::buffer<voxel_component>* components) {
    using number = std::make_unsigned_t<Label>;
    const device::label_words<number> words{{bits, extent}};
    number* const numbers = reinterpret_cast<number*>(labels);
    const disjoint_sets<number> sets{numbers};
    component_marks<cuda_backend> marks(backend, words.rows.rows() * static_cast<std::uint64_t>(extent.x));
    backend.for_each(words.count(), device::start_segments<number>{words, numbers});
    backend.for_each(words.count(), device::join_segments<number>{words, connectivity, sets});
    backend.for_each(words.count(), device::flatten_segments<number>{words, sets, marks.data()});
    device::with_runtime_errors([&] {
        device::launch_behind(device::write_labels_kernel<number>, device::fill_device(words.count() * 32),
                              device::threads_per_block, backend.stream, stage::fine_raster, words, numbers);
    });
    status s;
    s.label.components = marks.number(backend);
    if (components == nullptr) return s;
    cuda_backend::buffer<voxel_component> made(backend, s.label.components);
    const component_list list = marks.start(backend, made.data(), extent);
    device::with_runtime_errors([&] {
        device::launch_behind(device::measure_components_kernel<number>, device::fill_device(words.count()),
                              device::threads_per_block, backend.stream, stage::fine_raster, words,
                              static_cast<const number*>(numbers), list);
        device::check(cudaStreamSynchronize(backend.stream));
    });
    *components = std::move(made);
    return s;
}

} // namespace voxelpipe::core
