// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of a solid's call through the targets of a framebuffer: what memory it takes (plan_memory) and its launches
// on one stream without a wait (launch).

#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>
#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/solid/device/fill_bit_rows.cuh>
#include <voxelpipe/solid/device/parity_rows.cuh>
#include <voxelpipe/solid/device/solid_entries.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Draw, class Framebuffer>
struct solid_call;
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
struct solid_call<draw<Mesh, VertexShader, SolidShader>, framebuffer_view<Targets...>> {
    using draw_type = draw<Mesh, VertexShader, SolidShader>;
    using framebuffer_type = framebuffer_view<Targets...>;

    solid_entries<draw_type> entries;
    framebuffer_type fb;

    static constexpr bool has_bytes =
        std::is_trivially_copyable_v<draw_type> && std::is_trivially_copyable_v<framebuffer_type>;
    [[nodiscard]] call_bytes bytes(const void* workspace, const void* page) const {
        call_bytes b = bytes_of_call<solid_call>(workspace, page);
        b.add(entries.plan);
        b.add(fb);
        for (const draw_type& d : entries.draws) b.add(d);
        return b;
    }

    using parity = parity_target<SolidShader, framebuffer_type>;
    // True if crossings change bits of the target where they lie. Then no capacity can be too small, and nothing fails
    // once indices are known to be right.
    [[nodiscard]] bool is_parity() const {
        if constexpr (parity::is_possible)
            return entries.plan.options.rule == fill_rule::even_odd && !entries.is_split() && !entries.has_cover() &&
                   parity::suits(entries.draws[0].fragment_shader, fb);
        return false;
    }

    // True if the crossings are grouped by row.
    [[nodiscard]] bool is_grouped() const {
        return fills_bit_rows<SolidShader, framebuffer_type> && !entries.is_split() && !is_parity() &&
               entries.rows().num_rows() <= 0xffffffffu;
    }

    [[nodiscard]] std::size_t plan_memory() const {
        arena memory;
        take_zeroed(memory);
        (void)entries.take(memory, crossing_use());
        return memory.used();
    }
    // Bytes at the start of the workspace that must be zero on entry. A finished call leaves them zero, but for the
    // state.
    [[nodiscard]] std::size_t zeroed_bytes() const {
        arena memory;
        take_zeroed(memory);
        return memory.used();
    }
    void launch(arena& memory, cudaStream_t stream) const {
        auto* const state = memory.take<pipeline_state>(1);
        if (fb.changes != nullptr) // what the log says of the targets will not hold
            check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(word), stream));
        if constexpr (parity::is_possible) {
            if (is_parity()) {
                launch_parity(memory, state, stream);
                return;
            }
        }
        if constexpr (fills_bit_rows<SolidShader, framebuffer_type>) {
            if (is_grouped()) {
                launch_groups(memory, state, stream);
                return;
            }
        }
        const auto m = entries.take(memory);
        const auto& limits = entries.plan.limits;
        const auto shaders = entries.shaders(m, stream);
        const crossing_list sorted = entries.launch(m, state, stream);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (t.load == load_operation::clear) clear_target(t, state, limits, stream);
        });
        end_stage(entries.clock, &stage_times::clear);
        fill_rows(sorted, entries.rules(), shaders, fb, state, limits, stream);
        end_stage(entries.clock, &stage_times::tile_resolve);
    }

private:
    using uses = typename solid_entries<draw_type>::crossing_use;
    [[nodiscard]] uses crossing_use() const {
        return is_parity() ? uses::toggles : is_grouped() ? uses::groups : uses::sorts;
    }
    // Takes the memory that zeroed_bytes() counts.
    void take_zeroed(arena& memory) const {
        (void)memory.take<pipeline_state>(1);
        if (is_parity()) (void)row_marks::take(memory, entries.rows());
        if (is_grouped()) (void)memory.take<std::uint32_t>(entries.rows().num_rows());
    }
    void launch_groups(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        auto* const counts = memory.take<std::uint32_t>(entries.rows().num_rows());
        const auto m = entries.take(memory, uses::groups, counts);
        entries.launch_groups(m, state, stream);
        fill_bit_rows(m.by_row, m.cover.mask, entries.rules(), entries.draws[0].fragment_shader, fb, state,
                      entries.plan.limits, stream);
        end_stage(entries.clock, &stage_times::tile_resolve);
    }
    void launch_parity(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        const row_grid rows = entries.rows();
        const row_marks marks = row_marks::take(memory, rows);
        const auto m = entries.take(memory, uses::toggles);
        for (const draw_type& d : entries.draws)
            if (!d.mesh.has_checked_indices() && d.mesh.triangles.size() != 0)
                check_indices(d.mesh.triangles.data(), d.mesh.triangles.size(), d.mesh.positions.size(), state, stream);
        word* const bits = parity::bits(fb);
        const auto words_x = static_cast<std::uint32_t>((rows.extent.x + 31) / 32);
        const std::uint64_t words = rows.num_rows() * words_x;
        zeroed_memory zeros;
        // By the first kernel, if that does not wait for anything.
        if (entries.shades_on_the_spot() && words % 4 == 0 && reinterpret_cast<std::uintptr_t>(bits) % 16 == 0)
            zeros = {reinterpret_cast<uint4*>(bits), words / 4};
        else
            clear_target(voxelpipe::get<0>(fb.targets), state, entries.plan.limits, stream);
        entries.emit(m, crossing_toggler{bits, marks.marked, marks.odd_behind, words_x}, zeros, state, stream);
        end_parities(bits, marks, rows, entries.plan.options.count_voxels, state, stream);
        end_stage(entries.clock, &stage_times::tile_resolve);
    }
};

} // namespace voxelpipe::device
