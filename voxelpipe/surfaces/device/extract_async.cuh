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
    void operator()(const core::passes::cell_list&, core::edge_crossing*, core::passes::bounded_surface*,
                    cudaStream_t) const {}
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
        : from_(from), options_(options), room_(room), grid_{{nullptr, from.extent.x, from.extent.y, from.extent.z}} {
        const std::uint64_t rows = grid_.rows(), cells = room.cells + 1, vertices = room.vertices + 1,
                            quads = room.quads + 1;
        state_ = memory.take<core::passes::bounded_surface>(1);
        table_ = memory.take<core::cell_sheets>(table_size);
        words_ = memory.take<std::uint32_t>(num_words());
        first_of_row_ = memory.take<std::uint64_t>(rows + 1);
        first_of_word_ = memory.take<std::uint32_t>(rows * static_cast<std::uint64_t>(grid_.row_words()));
        counts_ = memory.take<std::uint32_t>(std::max({rows + 1, cells, vertices, quads}));
        keys_ = memory.take<std::uint64_t>(cells);
        states_ = memory.take<std::uint16_t>(cells);
        edges_ = memory.take<std::uint32_t>(cells);
        first_vertices_ = memory.take<std::uint64_t>(cells);
        first_edges_ = memory.take<std::uint64_t>(cells);
        if (!is_bit || crosses_mesh) crossings_ = memory.take<core::edge_crossing>(quads);
        vertices_ = memory.take<surface_vertex>(vertices);
        if (crosses_mesh) sources_ = memory.take<std::uint32_t>(vertices);
        quads_ = memory.take<glm::uvec4>(quads);
        parents_ = memory.take<std::uint32_t>(vertices);
        kept_quads_ = memory.take<std::uint32_t>(quads);
        sizes_ = memory.take<std::uint64_t>(vertices);
        if (leaves_out()) {
            places_ = memory.take<std::uint64_t>(vertices);
            quad_places_ = memory.take<std::uint64_t>(quads);
            left_vertices_ = memory.take<surface_vertex>(vertices);
            left_quads_ = memory.take<glm::uvec4>(quads);
            if (crosses_mesh) left_sources_ = memory.take<std::uint32_t>(vertices);
        }
        if (!options.quads) triangles_ = memory.take<glm::uvec3>(2 * quads);
        scan_bytes_ = 0;
        for (const std::uint64_t n : {rows + 1, cells, vertices, quads})
            scan_bytes_ = std::max(scan_bytes_, cell_scan_bytes(static_cast<std::uint32_t>(n)));
        scan_ = memory.take<std::uint8_t>(scan_bytes_);
    }

    // find(cells, crossings, state, stream) writes the crossings of state->cells cells, or stops the call by zeros
    // there.
    template <class Find = no_crossings>
    void launch(cudaStream_t stream, const Find& find = {}) const {
        using namespace core::passes;
        check(cudaMemsetAsync(state_, 0, sizeof(bounded_surface), stream));
        static const std::array<core::cell_sheets, table_size> table = core::make_cell_table();
        upload(
            table_, table.size(), [&](std::size_t i) { return table[i]; }, stream);
        cell_grid cells = grid_;
        cells.samples.words = words_;
        if constexpr (is_plain)
            cells.samples.words = from_.elements;
        else
            run(num_words(), read_samples<view_type>{from_, options_.level, words_, &state_->counts.nan_samples},
                stream);
        const std::uint64_t rows = cells.rows();
        device::count_active_cells(core::passes::count_active_cells{cells, counts_}, rows + 1, stream);
        sum(counts_, first_of_row_, rows + 1, stream);
        run(1, bound_cells{first_of_row_ + rows, room_.cells, state_}, stream);
        device::list_active_cells(core::passes::list_active_cells{cells, first_of_row_, first_of_word_, keys_, states_},
                                  rows, &state_->cells, stream);
        run(room_.cells + 1,
            flip_bounded_cells{{cells.samples, table_, keys_, ~std::uint64_t{0}, states_, counts_, edges_},
                               &state_->cells},
            stream);
        sum(counts_, first_vertices_, room_.cells + 1, stream);
        sum(edges_, first_edges_, room_.cells + 1, stream);
        run(1,
            bound_vertices{first_vertices_ + room_.cells, first_edges_ + room_.cells, room_.vertices, room_.quads,
                           state_},
            stream);
        const cell_list list{{cells, first_of_word_}, table_, keys_, states_, first_vertices_, first_edges_};
        if constexpr (!is_bit)
            run(room_.cells,
                bounded<cross_field<cell_list, view_type>>{
                    {list, from_, options_.level, crossings_, &state_->counts.made_crossings}, &state_->cells},
                stream);
        find(list, crossings_, state_, stream);
        run(room_.cells,
            bounded<place_vertices<cell_list>>{{list, options_.place, crossings_, vertices_, find.primitives, sources_},
                                               &state_->cells},
            stream);
        run(room_.cells, bounded<list_quads<cell_list>>{{list, quads_}, &state_->cells}, stream);
        choose_parts(stream);
        if (options_.quads) return;
        run(room_.quads,
            bounded<cut_quads>{{left_vertices(), left_quads(), options_.place == place::sharp, triangles_},
                               &state_->quads},
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
    [[nodiscard]] std::uint64_t num_words() const {
        return is_plain ? 0 : core::storage_map<bit, layout::linear>::cells(from_.extent);
    }
    [[nodiscard]] bool leaves_out() const { return options_.border == border::open || options_.min_component != 0; }
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
        const std::uint64_t *vertices_left = nullptr, *quads_left = nullptr;
        if (leaves_out()) {
            constexpr std::uint64_t all = ~std::uint64_t{0};
            run(room_.vertices + 1, drop_bounded<drop_vertices>{{sets, sizes_, least, all, counts_}, vertices}, stream);
            run(room_.quads + 1, drop_bounded<drop_quads>{{quads_, counts_, all, kept_quads_}, quads}, stream);
            sum(counts_, places_, room_.vertices + 1, stream);
            sum(kept_quads_, quad_places_, room_.quads + 1, stream);
            run(room_.vertices,
                bounded<move_vertices>{{counts_, places_, vertices_, sources_, left_vertices_, left_sources_},
                                       vertices},
                stream);
            run(room_.quads, bounded<move_quads>{{kept_quads_, quad_places_, places_, quads_, left_quads_}, quads},
                stream);
            vertices_left = places_ + room_.vertices;
            quads_left = quad_places_ + room_.quads;
        }
        run(1, count_surface{vertices_left, quads_left, options_.quads, state_}, stream);
    }

    view_type from_;
    extract_options options_;
    surface_limits room_;
    core::passes::cell_grid grid_;
    core::passes::bounded_surface* state_ = nullptr;
    core::cell_sheets* table_ = nullptr;
    std::uint32_t *words_ = nullptr, *first_of_word_ = nullptr, *counts_ = nullptr, *edges_ = nullptr,
                  *parents_ = nullptr, *kept_quads_ = nullptr, *sources_ = nullptr, *left_sources_ = nullptr;
    std::uint64_t *first_of_row_ = nullptr, *keys_ = nullptr, *first_vertices_ = nullptr, *first_edges_ = nullptr,
                  *sizes_ = nullptr, *places_ = nullptr, *quad_places_ = nullptr;
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
    const std::uint64_t rows =
        static_cast<std::uint64_t>(samples.extent.y + 1) * static_cast<std::uint64_t>(samples.extent.z + 1);
    for (const std::uint64_t n : {room.cells, room.vertices, room.quads, rows})
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
