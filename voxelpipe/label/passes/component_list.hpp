// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The components of labels in ascending order: a bit for each voxel that names one, and sums of these bits, give a
// component its number. Passes for every backend.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/label/voxel_component.hpp>

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace voxelpipe::core {

// Lowers or raises a number that many threads change.
VOXELPIPE_HD inline void lower_shared(int& to, int n) {
#if defined(__CUDA_ARCH__)
    if (n < *const_cast<const volatile int*>(&to)) atomicMin(&to, n);
#else
    const std::atomic_ref number(to);
    int was = number.load(std::memory_order_relaxed);
    while (n < was && !number.compare_exchange_weak(was, n, std::memory_order_relaxed)) continue;
#endif
}
VOXELPIPE_HD inline void raise_shared(int& to, int n) {
#if defined(__CUDA_ARCH__)
    if (n > *const_cast<const volatile int*>(&to)) atomicMax(&to, n);
#else
    const std::atomic_ref number(to);
    int was = number.load(std::memory_order_relaxed);
    while (n > was && !number.compare_exchange_weak(was, n, std::memory_order_relaxed)) continue;
#endif
}

// Voxels of one component.
struct component_part {
    std::uint64_t voxels = 0;
    glm::ivec3 min{0}, max{0};

    void add(const component_part& o) {
        if (voxels == 0) {
            *this = o;
            return;
        }
        voxels += o.voxels;
        for (int a = 0; a < 3; ++a) {
            min[a] = std::min(min[a], o.min[a]);
            max[a] = std::max(max[a], o.max[a]);
        }
    }
};

struct component_list {
    const std::uint32_t* marks;  // bit v % 32 of word v / 32: voxel v names a component
    const std::uint64_t* before; // for each word, the components that earlier words name
    voxel_component* components;

    // Number of the component that voxel v names.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t number(std::uint64_t v) const {
        const std::uint32_t lower = marks[v / 32] & ((std::uint32_t{1} << (v % 32)) - 1);
        return before[v / 32] + static_cast<std::uint64_t>(exact::count_ones(lower));
    }
    // Threads may add parts at the same time.
    VOXELPIPE_HD void add(std::uint64_t number, const component_part& part) const {
        voxel_component& c = components[number];
        add_shared(c.voxels, part.voxels);
        lower_shared(c.min.x, part.min.x);
        lower_shared(c.min.y, part.min.y);
        lower_shared(c.min.z, part.min.z);
        raise_shared(c.max.x, part.max.x);
        raise_shared(c.max.y, part.max.y);
        raise_shared(c.max.z, part.max.z);
    }
};

namespace passes {

struct clear_marks {
    std::uint32_t* marks;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { marks[i] = 0; }
};
// Number of components that word i names; 0 after the last word, for a sum.
struct count_marks {
    const std::uint32_t* marks;
    std::uint64_t words;
    std::uint32_t* counts;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        counts[i] = i < words ? static_cast<std::uint32_t>(exact::count_ones(marks[i])) : 0;
    }
};
// The components that word i names, without voxels.
struct start_components {
    component_list list;
    glm::ivec3 extent;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        voxel_component* to = list.components + list.before[i];
        for (std::uint32_t left = list.marks[i]; left != 0; left &= left - 1)
            *to++ = {static_cast<std::int64_t>(32 * i) + exact::lowest_one(left), 0, extent, glm::ivec3(-1)};
    }
};

} // namespace passes

// Marks of components, and their numbers, in a backend's memory.
template <class Backend>
class component_marks {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    // voxels: number of voxels of the grid. Nothing is marked.
    component_marks(Backend& backend, std::uint64_t voxels)
        : words_((voxels + 31) / 32), marks_(backend, words_), before_(backend, words_ + 1) {
        backend.for_each(words_, passes::clear_marks{marks_.data()});
    }
    [[nodiscard]] std::uint32_t* data() { return marks_.data(); }
    // Numbers what has been marked, and returns the number of components. Waits.
    [[nodiscard]] std::uint64_t number(Backend& backend) {
        buffer<std::uint32_t> counts(backend, words_ + 1);
        backend.for_each(words_ + 1, passes::count_marks{marks_.data(), words_, counts.data()});
        return backend.sum(counts, before_);
    }
    // A list of components without voxels, in memory for as many as number() has returned.
    [[nodiscard]] component_list start(Backend& backend, voxel_component* components, const glm::ivec3& extent) {
        const component_list list{marks_.data(), before_.data(), components};
        backend.for_each(words_, passes::start_components{list, extent});
        return list;
    }

private:
    std::uint64_t words_;
    buffer<std::uint32_t> marks_;
    buffer<std::uint64_t> before_;
};

} // namespace voxelpipe::core
