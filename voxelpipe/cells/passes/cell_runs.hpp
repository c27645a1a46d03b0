// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Rows of shaded cells for sparse framebuffers as runs of voxels that have the same values in all targets. Functors for
// Backend::for_each, the same on every backend.

#include <voxelpipe/cells/passes/cell_walk.hpp>
#include <voxelpipe/core/morton.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core::passes {

// Morton keys of rows in the whole grid, whose cells' keys have x along the rows.
struct key_cell_rows {
    const std::uint64_t* rows;
    std::uint64_t rows_y;
    glm::ivec3 offset; // of the part, turned
    std::uint64_t* keys;
    std::uint32_t* order;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        keys[i] =
            morton_key(0, static_cast<int>(rows[i] % rows_y) + offset.y, static_cast<int>(rows[i] / rows_y) + offset.z);
        order[i] = static_cast<std::uint32_t>(i);
    }
};

// ---- runs -----------------------------------------------------------------------------------------------------------

// True if all values have the same bits. Their types have no padding.
template <class... Ts>
[[nodiscard]] VOXELPIPE_HD bool are_same_bits(const pack<Ts...>& a, const pack<Ts...>& b) {
    bool same = true;
    for_each_index<sizeof...(Ts)>([&]<std::size_t I>() {
        const auto& x = voxelpipe::get<I>(a);
        const auto* p = reinterpret_cast<const unsigned char*>(&x);
        const auto* q = reinterpret_cast<const unsigned char*>(&voxelpipe::get<I>(b));
        for (std::size_t k = 0; k < sizeof(x); ++k) same = same && p[k] == q[k];
    });
    return same;
}

// What the voxels of a call start from, and which targets take fragments.
template <class... Targets>
struct cell_start {
    pack<typename Targets::value_type...> background;
    bool is_drawn[sizeof...(Targets)];
};

// Rows as the longest runs of one value, with bounds in the whole grid. Counted where `num_bounds` is not null, with a
// 0 behind the last row.
template <class CellShader, class... Targets>
struct run_shaded_cells {
    using values_type = pack<typename Targets::value_type...>;

    cell_walk<CellShader> walk;
    const std::uint64_t* rows;
    const std::uint32_t* order; // of the rows, by key
    std::uint64_t num_rows;
    int begin; // of the part along the rows
    cell_start<Targets...> start;
    std::uint64_t* counts; // of the call; null where runs are written
    std::uint32_t* num_bounds;
    const std::uint64_t* first; // bound of each row
    std::uint32_t* bounds;
    values_type* values; // of each run

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        cell_tally tally;
        run_of_voxels run{*this, num_bounds != nullptr ? 0 : first[i] / 2, 0, 0, {}, {}};
        if (i < num_rows) walk.template go<false>(rows[order[i]], i, tally, run);
        run.flush();
        if (num_bounds == nullptr) return;
        num_bounds[i] = static_cast<std::uint32_t>(2 * run.number);
        tally.add_to(counts);
    }

private:
    struct run_of_voxels {
        const run_shaded_cells& of;
        std::uint64_t number; // of the run
        int from, to;         // empty: no run is open
        values_type value;    // of the open run
        pack<decltype(Targets::traits::begin(typename Targets::value_type{}))...> sums;

        VOXELPIPE_HD void begin(const glm::ivec3&) {
            for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using traits = typename pack_element<I, Targets...>::type::traits;
                voxelpipe::get<I>(sums) = traits::begin(voxelpipe::get<I>(of.start.background));
            });
        }
        template <class Values>
        VOXELPIPE_HD void add(std::uint32_t, const Values& fragment) {
            for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                pack_element<I, Targets...>::type::traits::apply(voxelpipe::get<I>(sums), voxelpipe::get<I>(fragment));
            });
        }
        VOXELPIPE_HD void end(const glm::ivec3&, int w, int behind) {
            values_type blended{};
            for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using target = typename pack_element<I, Targets...>::type;
                if (of.start.is_drawn[I])
                    voxelpipe::get<I>(blended) =
                        typename target::value_type(target::traits::end(voxelpipe::get<I>(sums)));
                else
                    voxelpipe::get<I>(blended) = voxelpipe::get<I>(of.start.background);
            });
            if (from == to || to != w || !are_same_bits(value, blended)) {
                flush();
                from = w;
                value = blended;
            }
            to = behind;
        }
        VOXELPIPE_HD void flush() {
            if (from == to) return;
            if (of.num_bounds == nullptr) {
                of.bounds[2 * number] = static_cast<std::uint32_t>(of.begin + from);
                of.bounds[2 * number + 1] = static_cast<std::uint32_t>(of.begin + to);
                of.values[number] = value;
            }
            ++number;
            from = to;
        }
    };
};

} // namespace voxelpipe::core::passes
