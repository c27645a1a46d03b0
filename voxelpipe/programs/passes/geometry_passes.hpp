// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The passes of a geometry program, as programs/passes/patch_passes.hpp: one functor counts the triangles of an input
// and emits them.

#include <voxelpipe/programs/passes/patch_passes.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

template <int K, template <class> class Input, class V>
struct geometry_inputs {
    const vertex_output<V>* vertices;
    element_indices<K> in;
    std::uint64_t count;
    // After a tessellation, the patch of each triangle and the number of patches of an instance. Otherwise null and 0.
    const std::uint32_t* origins;
    std::uint32_t patches_each;
    std::uint32_t draw;
};

// Counts the triangles of all inputs (num_triangles), whose element `all.count` is 0, for the sums; or emits those with
// numbers in [begin, end), of inputs from `first_input` on.
template <class Program, int K, template <class> class Input, class V, class Sink>
struct run_geometry {
    Program program;
    geometry_inputs<K, Input, V> all;
    std::uint32_t* num_triangles; // null: emit
    const std::uint64_t* first_triangle;
    std::uint64_t begin, end, first_input;
    Sink sink;
    glm::uvec3* triangles;
    std::uint32_t* origins; // may be null
    std::uint64_t* counts;
    const std::uint64_t* bound = nullptr; // if it is 0, in the backend's memory, nothing is emitted; may be null

    VOXELPIPE_ANY_CALLABLE
    template <class Index>
    VOXELPIPE_HD void operator()(Index k) const {
        if (num_triangles == nullptr && bound != nullptr && *bound == 0) return;
        const std::uint64_t i = first_input + k;
        if (i == all.count) {
            num_triangles[i] = 0;
            return;
        }
        const auto e = all.in.locate(static_cast<std::uint32_t>(i));
        if (!e.ok) { // left out by a tessellation, or a bad index
            if (num_triangles != nullptr) num_triangles[i] = 0;
            if (all.origins == nullptr) add(counts, program_count::bad_index, 1);
            return;
        }
        Input<V> input{};
        for (int n = 0; n < K; ++n) input.vertices[n] = all.vertices[e.index[n]];
        const std::uint32_t origin = all.origins != nullptr ? all.origins[i] : static_cast<std::uint32_t>(i);
        input.number = all.origins != nullptr ? origin % all.patches_each : e.number;
        input.instance = all.origins != nullptr ? origin / all.patches_each : e.instance;
        input.draw = all.draw;
        const auto made = program(input);
        constexpr int capacity = decltype(made)::capacity;
        const bool is_bad = made.count < 0 || made.count > capacity;
        if (num_triangles != nullptr) {
            num_triangles[i] = is_bad ? 0 : static_cast<std::uint32_t>(made.count);
            add(counts, program_count::bad_count, is_bad ? 1 : 0);
            return;
        }
        for (int t = 0; t < made.count; ++t) {
            const std::uint64_t number = first_triangle[i] + static_cast<std::uint32_t>(t);
            if (number < begin || number >= end) continue;
            const std::uint64_t to = number - begin;
            for (int n = 0; n < 3; ++n) sink.store(3 * to + static_cast<std::uint32_t>(n), made.vertices[3 * t + n]);
            const auto v = static_cast<std::uint32_t>(3 * to);
            triangles[to] = glm::uvec3(v, v + 1, v + 2);
            if (origins != nullptr) origins[to] = origin;
        }
    }
};

// The inputs that triangles [begin, end) come from: [to[0], to[1]). Inputs without triangles share their number with
// the one behind them, which find_owner finds.
struct find_inputs {
    const std::uint64_t* first_triangle;
    std::uint64_t count, begin, end;
    std::uint64_t* to;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const auto n = static_cast<std::uint32_t>(count);
        to[0] = find_owner(first_triangle, n, begin);
        to[1] = std::uint64_t{find_owner(first_triangle, n, end - 1)} + 1;
    }
};

} // namespace voxelpipe::core::passes
