// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The passes over points and lines in memory of a fixed size, which programs/device/element_async.cuh launches: voxels
// are counted, listed, shaded and sorted. Nothing here waits; what is counted stays on the device.

#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/programs/element_call.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::device {

// Numbers that the passes count, beside the state of the call.
struct element_totals {
    std::uint64_t counts[core::index_of(core::element_count::size)];
    std::uint64_t listed; // fragments, as far as they fit
    std::uint64_t kept;   // those that the shader keeps
    list_counts lists;
};
// Places the fragments of a draw behind those of the one before.
struct place_draw {
    const unsigned long long* num_fragments;
    core::passes::element_room* room;
    pipeline_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        room->first = state->list_fragments;
        state->list_fragments += *num_fragments;
    }
};
// Decides whether the call can go on, once all draws have a place.
struct open_rooms {
    core::passes::element_room* rooms;
    std::uint32_t num_rooms;
    std::uint64_t capacity;
    element_totals* totals;
    pipeline_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (totals->counts[core::index_of(core::element_count::bad_index)] != 0) state->index_error = bad_index;
        const bool fits = state->index_error == 0 && state->list_fragments <= capacity;
        for (std::uint32_t d = 0; d < num_rooms; ++d) rooms[d].fits = fits ? 1 : 0;
        totals->listed = fits ? state->list_fragments : 0;
    }
};
// Keys behind the fragments stand for no voxel, and are sorted to the end.
struct fill_keys {
    const element_totals* totals;
    std::uint64_t none;
    std::uint64_t* keys;
    std::uint32_t* order;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < totals->listed) return;
        keys[i] = none;
        order[i] = 0;
    }
};
struct count_kept {
    element_totals* totals;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        totals->kept = totals->listed - totals->counts[core::index_of(core::element_count::discarded)];
    }
};
// The counters of the call's status.
struct note_elements {
    element_totals* totals;
    pipeline_state* state;
    const unsigned long long* num_voxels;
    std::uint64_t num_elements;
    bool counts_voxels;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const auto of = [&](core::element_count c) { return totals->counts[core::index_of(c)]; };
        state->nonfinite = of(core::element_count::nonfinite);
        state->too_far = of(core::element_count::too_far);
        state->outside = of(core::element_count::outside);
        state->drawn = num_elements - state->nonfinite - state->too_far - state->outside;
        state->discarded = of(core::element_count::discarded);
        state->fragments = totals->kept;
        state->voxels = counts_voxels ? *num_voxels : 0;
        totals->lists = {*num_voxels, totals->kept};
    }
};

// A call's memory and launches. Payload: of the lists that the output is made of.
template <class View, class VertexShader, class FragmentShader, class Payload>
class async_elements {
    using draw_type = draw<View, VertexShader, FragmentShader>;
    using elements = core::elements_of<View>;
    using V = typename core::shaded<View, VertexShader>::varyings;
    using stored = payload_storage<Payload>;
    static constexpr int size = elements::size;

    struct shaded_draw {
        std::uint64_t num_elements, num_vertices;
        vertex_output<V>* vertices;
        std::uint32_t* num_voxels;
        unsigned long long* offsets;
    };

public:
    async_elements(arena& memory, std::span<const draw_type> draws, const grid& g, std::uint64_t capacity)
        : draws_(draws), grid_(g), capacity_(capacity), state_(memory.take<pipeline_state>(1)),
          totals_(memory.take<element_totals>(1)), rooms_(memory.take<core::passes::element_room>(draws.size())) {
        std::uint64_t largest = capacity + 1;
        for (const draw_type& d : draws) {
            const std::uint64_t n = elements::count(d.mesh) * d.mesh.copies.count,
                                num_vertices = d.mesh.positions.size() * d.mesh.copies.count;
            shaded_.push_back({n, num_vertices, memory.take<vertex_output<V>>(num_vertices),
                               memory.take<std::uint32_t>(n + 1), memory.take<unsigned long long>(n + 1)});
            largest = largest > n + 1 ? largest : n + 1;
        }
        scan_bytes_ = cell_scan_bytes(static_cast<std::uint32_t>(largest));
        scan_ = memory.take<std::uint8_t>(scan_bytes_);
        sort_bytes_ = capacity == 0 ? 0 : sort_bytes<std::uint64_t>(capacity, key_bits());
        sort_ = memory.take<std::uint8_t>(sort_bytes_);
        for (int i = 0; i < 2; ++i) {
            keys_[i] = memory.take<std::uint64_t>(capacity);
            order_[i] = memory.take<std::uint32_t>(capacity);
        }
        listed_primitives_ = memory.take<std::uint32_t>(capacity);
        listed_payloads_ = memory.take<stored>(std::is_void_v<Payload> ? 0 : capacity);
        is_first_ = memory.take<std::uint32_t>(capacity + 1);
        rank_ = memory.take<unsigned long long>(capacity + 1);
        voxels_ = memory.take<std::uint64_t>(capacity);
        offsets_ = memory.take<std::uint64_t>(capacity + 1);
        primitives_ = memory.take<std::uint32_t>(capacity);
        payloads_ = std::is_void_v<Payload> ? nullptr : memory.take<stored>(capacity);
    }

    // Makes the lists of all fragments.
    template <coverage Rule>
    void launch(bool counts_voxels, cudaStream_t stream) const {
        check(cudaMemsetAsync(state_, 0, sizeof(pipeline_state), stream));
        check(cudaMemsetAsync(totals_, 0, sizeof(element_totals), stream));
        const std::uint64_t num_elements = count<Rule>(stream);
        run(1, open_rooms{rooms_, static_cast<std::uint32_t>(draws_.size()), capacity_, totals_, state_}, stream);
        run(capacity_, fill_keys{totals_, core::num_grid_voxels(grid_.extent), keys_[0], order_[0]}, stream);
        list<Rule>(stream);
        run(1, count_kept{totals_}, stream);
        const int at = capacity_ < 2 ? 0
                                     : sort_by_cell<std::uint64_t>(keys_, order_, capacity_, key_bits(), sort_,
                                                                   sort_bytes_, stage::tile_sort, stream);
        const core::pool::length kept(&totals_->kept);
        run(capacity_,
            core::pool::gather<stored>{order_[at], listed_primitives_, listed_payloads_, primitives_, payloads_, kept},
            stream);
        run(capacity_ + 1, core::pool::mark_first{keys_[at], kept, is_first_}, stream);
        sum(is_first_, rank_, capacity_ + 1, stream);
        run(capacity_ + 1,
            core::pool::store_voxels{keys_[at], reinterpret_cast<const std::uint64_t*>(rank_), is_first_, kept, voxels_,
                                     offsets_},
            stream);
        run(1, note_elements{totals_, state_, rank_ + capacity_, num_elements, counts_voxels}, stream);
    }

    [[nodiscard]] pipeline_state* state() const { return state_; }
    [[nodiscard]] abuffer_view<Payload> lists() const {
        return {&totals_->lists, voxels_, offsets_, primitives_, payloads_, grid_.extent};
    }
    // Folds them into targets, which get their clear values first.
    template <class... Targets>
    void fold(const framebuffer_view<Targets...>& fb, cudaStream_t stream) const {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const auto& t = voxelpipe::get<I>(fb.targets);
            if (t.load == load_operation::clear) clear_target(t, state_, {0, 0, capacity_, 0}, stream);
        });
        if (fb.changes != nullptr) // the log does not describe the targets any longer
            check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(std::uint32_t), stream),
                  stage::fine_raster);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            const auto& t = voxelpipe::get<I>(fb.targets);
            if (t.load == load_operation::off) return;
            run(capacity_,
                core::pool::fold<I, target, Payload>{t, voxels_, offsets_, payloads_,
                                                     core::pool::length(&totals_->lists.voxels)},
                stream);
        });
    }

private:
    template <class F>
    static void run(std::uint64_t count, const F& f, cudaStream_t stream) {
        for_each(count, f, stage::fine_raster, stream);
    }
    [[nodiscard]] int key_bits() const { return static_cast<int>(std::bit_width(core::num_grid_voxels(grid_.extent))); }
    void sum(const std::uint32_t* counts, unsigned long long* sums, std::uint64_t n, cudaStream_t stream) const {
        sum_counts(counts, sums, static_cast<std::uint32_t>(n), scan_, scan_bytes_, stage::fine_raster, stream);
    }
    [[nodiscard]] auto snapped(std::size_t d) const {
        const View& view = draws_[d].mesh;
        return core::passes::snapped_elements<size, V>{
            shaded_[d].vertices,
            elements::indices(view),
            shaded_[d].num_elements,
            core::make_snap_transform(grid_),
            {{{0, 0, 0}}, {{grid_.extent.x - 1, grid_.extent.y - 1, grid_.extent.z - 1}}}};
    }
    template <coverage Rule>
    [[nodiscard]] std::uint64_t count(cudaStream_t stream) const {
        std::uint64_t num_elements = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            const shaded_draw& s = shaded_[d];
            run(s.num_vertices,
                core::shade_elements<typename elements::vertices_type, VertexShader, V>{
                    elements::vertices(draws_[d].mesh), draws_[d].vertex_shader, static_cast<std::uint32_t>(d),
                    s.vertices},
                stream);
            run(s.num_elements + 1,
                core::passes::count_voxels<Rule, size, V>{snapped(d), s.num_voxels, totals_->counts}, stream);
            sum(s.num_voxels, s.offsets, s.num_elements + 1, stream);
            run(1, place_draw{s.offsets + s.num_elements, rooms_ + d, state_}, stream);
            num_elements += s.num_elements;
        }
        return num_elements;
    }
    template <coverage Rule>
    void list(cudaStream_t stream) const {
        std::uint32_t first_primitive = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            const shaded_draw& s = shaded_[d];
            run(s.num_elements,
                core::passes::list_voxels<Rule, size, V, FragmentShader, stored>{
                    snapped(d), draws_[d].fragment_shader, static_cast<std::uint32_t>(d), first_primitive, grid_.extent,
                    grid_.offset, reinterpret_cast<const std::uint64_t*>(s.offsets), 0, rooms_ + d, keys_[0], order_[0],
                    listed_primitives_, listed_payloads_, totals_->counts},
                stream);
            first_primitive += static_cast<std::uint32_t>(s.num_elements);
        }
    }

    std::span<const draw_type> draws_;
    grid grid_;
    std::uint64_t capacity_;
    pipeline_state* state_; // first, where read_status looks for it
    element_totals* totals_;
    core::passes::element_room* rooms_;
    std::vector<shaded_draw> shaded_;
    std::size_t scan_bytes_ = 0, sort_bytes_ = 0;
    std::uint8_t *scan_ = nullptr, *sort_ = nullptr;
    std::uint64_t* keys_[2]{};
    std::uint32_t* order_[2]{};
    std::uint32_t *listed_primitives_ = nullptr, *primitives_ = nullptr, *is_first_ = nullptr;
    stored *listed_payloads_ = nullptr, *payloads_ = nullptr;
    unsigned long long* rank_ = nullptr;
    std::uint64_t *voxels_ = nullptr, *offsets_ = nullptr;
};

} // namespace voxelpipe::device
