// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract_async: as extract, without waits and allocations, so that a CUDA graph can capture it and replay it with
// changed samples. It works in the caller's memory, in arrays whose room is given; a surface that does not fit is
// empty, and read_surface_status says what was needed.

#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/surfaces/device/surfaces.cuh>
#include <voxelpipe/surfaces/passes/bounded.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe {

// Room of a surface. Before parts are left out; each below 2^32 - 1.
struct surface_limits {
    std::uint64_t cells = 0;    // that the surface passes
    std::uint64_t vertices = 0; // at least as many; hardly more
    std::uint64_t quads = 0;    // of two triangles
};

// The caller's memory, as workspace_view.
struct surface_workspace_view {
    void* memory = nullptr; // on the device, aligned to 256 bytes
    std::size_t bytes = 0;  // at least extract_workspace_bytes(...)
    surface_limits limits;  // that `bytes` was computed for
};

// A surface in a workspace, with the arrays of surface<cuda_backend>. They stay valid as long as the workspace serves
// the same call, and may be read once the stream has passed it.
struct surface_result {
    grid samples;                             // of the call
    const surface_vertex* vertices = nullptr; // counts->vertices of them
    const glm::uvec3* triangles = nullptr;    // counts->faces of them; null with `quads`
    const glm::uvec4* quads = nullptr;        // counts->faces of them; null without
    const surface_counters* counts = nullptr; // on the device; zeros where something does not fit
    const std::uint32_t* sources = nullptr;   // of remesh_async, counts->vertices of them; null of extract_async
};

namespace device {

// What finds the crossings of bits: nothing does, they lie in the middle of their edges.
struct no_crossings {
    static constexpr const std::uint32_t* primitives = nullptr; // of the crossings' triangles
    void operator()(const surface_words&, core::edge_crossing*, core::passes::bounded_surface*, cudaStream_t) const {}
};

// The memory of a call, in the order of its arrays, and its launches.
template <class T, class Blend, class Layout>
class extract_call {
    using view_type = target_view<target<T, Blend, Layout>>;
    static constexpr bool is_bit = std::is_same_v<T, bit>;
    static constexpr std::size_t table_size = 512;
    static constexpr bool is_plain = is_bit && std::is_same_v<Layout, layout::linear>; // bits that passes read in place

public:
    // crosses_mesh: launch() is given what finds the crossings, and vertices have sources.
    extract_call(const view_type& from, const extract_options& options, const surface_limits& room, arena& memory,
                 bool crosses_mesh = false)
        : from_(from), options_(options), room_(room), grid_{{nullptr, from.extent.x, from.extent.y, from.extent.z}},
          crosses_mesh_(crosses_mesh) {
        const std::uint64_t groups = num_groups(), cells = room.cells + 1, vertices = room.vertices + 1,
                            quads = room.quads + 1; // a word has a cell
        const std::uint32_t blocks = word_blocks(room.cells);
        state_ = memory.take<core::passes::bounded_surface>(1);
        table_ = memory.take<core::cell_sheets>(table_size);
        words_ = memory.take<std::uint32_t>(num_words());
        masks_ = memory.take<std::uint32_t>(groups);
        first_of_group_ = memory.take<std::uint64_t>(groups + 1);
        counts_ = memory.take<std::uint32_t>(std::max({groups + 1, vertices, quads}));
        word_keys_ = memory.take<std::uint64_t>(cells);
        surface_words_ = memory.take<core::passes::surface_word>(cells);
        word_edges_ = memory.take<core::passes::word_edges>(cells);
        word_faces_ = memory.take<core::passes::word_faces>(cells);
        sums_ = memory.take<unsigned long long>(std::uint64_t{3} * blocks);
        states_ = memory.take<std::uint16_t>(cells);
        if (!has_crossings()) places_ = memory.take<core::cell_place>(num_placed_states);
        if (has_crossings()) crossings_ = memory.take<core::edge_crossing>(quads);
        vertices_ = memory.take<surface_vertex>(vertices);
        if (crosses_mesh) sources_ = memory.take<std::uint32_t>(vertices);
        if (leaves_out() || options.quads) quads_ = memory.take<glm::uvec4>(quads);
        parents_ = memory.take<std::uint32_t>(vertices);
        if (leaves_out()) {
            kept_quads_ = memory.take<std::uint32_t>(quads);
            sizes_ = memory.take<std::uint64_t>(vertices);
            vertex_places_ = memory.take<std::uint64_t>(vertices);
            quad_places_ = memory.take<std::uint64_t>(quads);
            left_vertices_ = memory.take<surface_vertex>(vertices);
            left_quads_ = memory.take<glm::uvec4>(quads);
            if (crosses_mesh) left_sources_ = memory.take<std::uint32_t>(vertices);
        }
        if (!options.quads) triangles_ = memory.take<glm::uvec3>(2 * quads);
        scan_bytes_ = 0;
        for (const std::uint64_t n : {groups + 1, vertices, quads})
            scan_bytes_ = std::max(scan_bytes_, cell_scan_bytes(static_cast<std::uint32_t>(n)));
        scan_ = memory.take<std::uint8_t>(scan_bytes_);
    }

    // find(words, crossings, state, stream) writes the crossings of state->cells cells, or stops the call by zeros
    // there.
    template <class Find = no_crossings>
    void launch(cudaStream_t stream, const Find& find = {}) const {
        using namespace core::passes;
        check(cudaMemsetAsync(state_, 0, sizeof(bounded_surface), stream));
        const std::array<core::cell_sheets, table_size>& table = core::cell_table();
        upload(
            table_, table.size(), [&](std::size_t i) { return table[i]; }, stream);
        cell_grid cells = grid_;
        cells.samples.words = words_;
        if constexpr (is_plain)
            cells.samples.words = from_.elements;
        else
            run(num_words(), read_samples<view_type>{from_, options_.level, words_, &state_->counts.nan_samples},
                stream);
        const word_groups where{cells, masks_, first_of_group_};
        mark_words(where, masks_, counts_, &state_->all_cells, stream);
        sum(counts_, first_of_group_, num_groups() + 1, stream);
        run(1, bound_cells{first_of_group_ + num_groups(), room_.cells, state_}, stream);
        list_words(where, &state_->words, word_keys_, stream);
        number_surface_words({cells, table_, &state_->words, word_keys_, surface_words_, word_edges_, word_faces_,
                              states_, sums_, word_blocks(room_.cells), state_->totals},
                             stream);
        run(1, bound_vertices{room_.vertices, room_.quads, state_}, stream);
        const surface_words words{where,          table_,      &state_->words, word_keys_,
                                  surface_words_, word_edges_, word_faces_,    states_};
        const std::uint32_t blocks = word_blocks(room_.cells);
        if (has_crossings()) {
            if constexpr (!is_bit)
                for_word_edges<all_axes>(
                    words, blocks,
                    cross_field<view_type>{from_, options_.level, crossings_, &state_->counts.made_crossings}, stream);
            find(words, crossings_, state_, stream);
            place_crossed(words, blocks, {options_.place, crossings_, find.primitives, vertices_, sources_}, stream);
        } else {
            run(num_placed_states, place_states{table_, options_.place, places_}, stream);
            place_words(words, blocks, places_, vertices_, stream);
        }
        const bool folds = options_.place == place::sharp;
        if (quads_ != nullptr)
            list_faces(words, blocks, {nullptr, false, nullptr, quads_}, stream);
        else
            list_faces(words, blocks, {vertices_, folds, triangles_, nullptr}, stream);
        if (leaves_out())
            choose_parts(stream);
        else
            count_components(words, blocks, parents_, &state_->parts[static_cast<int>(part_count::found)], stream);
        const std::uint64_t *vertices_left = nullptr, *quads_left = nullptr;
        if (leaves_out()) {
            vertices_left = vertex_places_ + room_.vertices;
            quads_left = quad_places_ + room_.quads;
        }
        run(1, count_surface{vertices_left, quads_left, options_.quads, state_}, stream);
        if (leaves_out() && !options_.quads)
            run(room_.quads, bounded<cut_quads>{{left_vertices_, left_quads_, folds, triangles_}, &state_->quads},
                stream);
    }
    [[nodiscard]] core::passes::bounded_surface* state() const { return state_; }
    [[nodiscard]] const surface_limits& room() const { return room_; }
    [[nodiscard]] surface_result result(const grid& samples) const {
        return {samples,         left_vertices(),
                triangles_,      options_.quads ? left_quads() : nullptr,
                &state_->counts, leaves_out() ? left_sources_ : sources_};
    }

private:
    [[nodiscard]] std::uint64_t num_groups() const {
        return core::passes::word_groups{grid_, nullptr, nullptr}.count();
    }
    [[nodiscard]] bool has_crossings() const { return !is_bit || crosses_mesh_; } // else they are in the middle
    // Words of the samples that are not read in place.
    [[nodiscard]] std::uint64_t num_words() const {
        return is_plain ? 0 : core::storage_map<bit, layout::linear>::cells(from_.extent);
    }
    [[nodiscard]] bool leaves_out() const { return core::leaves_parts_out(options_); }
    [[nodiscard]] const surface_vertex* left_vertices() const { return leaves_out() ? left_vertices_ : vertices_; }
    [[nodiscard]] const glm::uvec4* left_quads() const { return leaves_out() ? left_quads_ : quads_; }

    template <class F>
    static void run(std::uint64_t count, const F& f, cudaStream_t stream) {
        for_each(count, f, stage::vertex_shade, stream);
    }
    void sum(const std::uint32_t* counts, std::uint64_t* offsets, std::uint64_t n, cudaStream_t stream) const {
        sum_counts(counts, reinterpret_cast<unsigned long long*>(offsets), static_cast<std::uint32_t>(n), scan_,
                   scan_bytes_, stage::vertex_shade, stream);
    }
    void choose_parts(cudaStream_t stream) const {
        using namespace core::passes;
        const vertex_sets sets{parents_};
        const std::uint64_t *const vertices = &state_->vertices, *const quads = &state_->quads;
        const std::uint64_t least = options_.min_component;
        run(room_.vertices, bounded<start_vertices>{{parents_, counts_}, vertices}, stream);
        run(room_.vertices, bounded<clear_counts>{{sizes_}, vertices}, stream);
        run(room_.quads,
            bounded<join_quads>{
                {quads_, vertices_, from_.extent, options_.border == border::open, sets, counts_, kept_quads_}, quads},
            stream);
        run(room_.vertices, bounded<count_members>{{sets, counts_, sizes_}, vertices}, stream);
        run(room_.vertices, bounded<choose_components>{{sets, sizes_, least, state_->parts}, vertices}, stream);
        constexpr std::uint64_t all = ~std::uint64_t{0};
        run(room_.vertices + 1, drop_bounded<drop_vertices>{{sets, sizes_, least, all, counts_}, vertices}, stream);
        run(room_.quads + 1, drop_bounded<drop_quads>{{quads_, counts_, all, kept_quads_}, quads}, stream);
        sum(counts_, vertex_places_, room_.vertices + 1, stream);
        sum(kept_quads_, quad_places_, room_.quads + 1, stream);
        run(room_.vertices,
            bounded<move_vertices>{{counts_, vertex_places_, vertices_, sources_, left_vertices_, left_sources_},
                                   vertices},
            stream);
        run(room_.quads, bounded<move_quads>{{kept_quads_, quad_places_, vertex_places_, quads_, left_quads_}, quads},
            stream);
    }

    view_type from_;
    extract_options options_;
    surface_limits room_;
    core::passes::cell_grid grid_;
    bool crosses_mesh_;
    core::passes::bounded_surface* state_ = nullptr;
    core::cell_sheets* table_ = nullptr;
    core::cell_place* places_ = nullptr;
    core::passes::surface_word* surface_words_ = nullptr;
    core::passes::word_edges* word_edges_ = nullptr;
    core::passes::word_faces* word_faces_ = nullptr;
    unsigned long long* sums_ = nullptr;
    std::uint32_t *words_ = nullptr, *masks_ = nullptr, *counts_ = nullptr, *parents_ = nullptr, *kept_quads_ = nullptr,
                  *sources_ = nullptr, *left_sources_ = nullptr;
    std::uint64_t *first_of_group_ = nullptr, *word_keys_ = nullptr, *sizes_ = nullptr, *vertex_places_ = nullptr,
                  *quad_places_ = nullptr;
    std::uint16_t* states_ = nullptr;
    core::edge_crossing* crossings_ = nullptr;
    surface_vertex *vertices_ = nullptr, *left_vertices_ = nullptr;
    glm::uvec4 *quads_ = nullptr, *left_quads_ = nullptr;
    glm::uvec3* triangles_ = nullptr;
    std::uint8_t* scan_ = nullptr;
    std::size_t scan_bytes_ = 0;
};

[[nodiscard]] inline status validate_async(const extract_options& options, bool is_bit, const grid& samples,
                                           const surface_limits& room) {
    if (const status s = validate(samples); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (is_bit && options.level != 0.0) return core::failure(status_code::bad_surface_options);
    if (options.embedded) return core::failure(status_code::strategy_unavailable);
    const core::passes::cell_grid cells{{nullptr, samples.extent.x, samples.extent.y, samples.extent.z}};
    const std::uint64_t groups = core::passes::word_groups{cells, nullptr, nullptr}.count();
    for (const std::uint64_t n : {room.cells, room.vertices, room.quads, groups})
        if (n >= core::max_numbered) return core::failure(status_code::size_overflow);
    return {};
}

// What a call has found; see read_surface_status.
[[nodiscard]] inline status surface_status(const core::passes::bounded_surface& state, const surface_limits& room,
                                           surface_limits* need) {
    if (state.all_cells > room.cells || state.all_vertices > room.vertices || state.all_quads > room.quads) {
        if (need != nullptr)
            *need = {std::max(room.cells, state.all_cells),
                     std::max({room.vertices, state.all_vertices, state.all_cells}),
                     std::max({room.quads, state.all_quads, state.all_cells})};
        return core::failure(status_code::capacity_exceeded, stage::vertex_shade);
    }
    status s;
    s.surface = state.counts;
    return s;
}

} // namespace device

// Bytes that extract_async needs for such a call on the current device; 0 if the arguments are invalid.
template <class T, class Blend, class Layout>
[[nodiscard]] std::size_t extract_workspace_bytes(const target_view<target<T, Blend, Layout>>& from,
                                                  const grid& samples, const extract_options& options,
                                                  const surface_limits& limits) {
    if (!device::validate_async(options, std::is_same_v<T, bit>, samples, limits).ok()) return 0;
    if (from.extent != samples.extent) return 0;
    return device::bytes_or_none([&] {
        device::arena plan;
        (void)device::extract_call<T, Blend, Layout>(from, options, limits, plan);
        return plan.used();
    });
}

// Puts the call on the backend's stream and returns. `out` is set at once; what it points to is there when the stream
// has passed the call. A status other than ok means that nothing was launched, or that a launch failed;
// read_surface_status reports what the device finds out. strategy_unavailable: options.embedded takes rounds, and
// waits.
template <class T, class Blend, class Layout>
[[nodiscard]] status extract_async(cuda_backend& backend, const target_view<target<T, Blend, Layout>>& from,
                                   const grid& samples, surface_result& out, const extract_options& options,
                                   const surface_workspace_view& workspace) {
    constexpr bool is_bit = std::is_same_v<T, bit>;
    static_assert(is_bit || std::is_same_v<T, float>, "voxelpipe: a surface is made of a target of bit or float");
    if (const status s = device::validate_async(options, is_bit, samples, workspace.limits); !s.ok()) return s;
    if (from.extent != samples.extent) return core::failure(status_code::extent_mismatch);
    if (from.elements == nullptr) return core::failure(status_code::null_view);
    return device::with_cuda_status([&]() -> status {
        const std::size_t need = extract_workspace_bytes(from, samples, options, workspace.limits);
        if (workspace.memory == nullptr || workspace.bytes < need) {
            status s = core::failure(status_code::capacity_exceeded);
            s.required.bytes = need;
            return s;
        }
        device::arena memory(workspace.memory);
        const device::extract_call<T, Blend, Layout> call(from, options, workspace.limits, memory);
        device::launch_until(stage::vertex_shade, [&] { call.launch(backend.stream); });
        out = call.result(samples);
        return {};
    });
}

// Waits for the stream and returns the status of the last call in this workspace, with the counts of extract. `need`
// may be null. Where the surface did not fit (capacity_exceeded), *need receives larger limits; if the cells did not
// fit, they suffice for these, and the same call may fail with them for the others.
[[nodiscard]] inline status read_surface_status(cuda_backend& backend, const surface_workspace_view& workspace,
                                                surface_limits* need = nullptr) {
    core::passes::bounded_surface state{};
    if (const status s = device::read_start(workspace.memory, state, backend.stream); !s.ok()) return s;
    return device::surface_status(state, workspace.limits, need);
}

} // namespace voxelpipe
