// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells_async: as voxelize_cells into a framebuffer, without waits and allocations, as a CUDA graph needs it;
// a captured graph of it has run on the emulated device alone (records/h200). It works in the caller's memory, in
// arrays whose room is given; a call that does not fit leaves every target as it was, and read_cells_status says what
// was needed.

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/surfaces/passes/bounded.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

// Room of a call with cut cells.
struct cell_limits {
    // Pairs of a triangle and a voxel that meet, below 2^32 - 1: cell_counters::cell_records of the same call.
    std::uint64_t records = 0;
};

// The caller's memory, as workspace_view.
struct cell_workspace_view {
    void* memory = nullptr; // on the device, aligned to 256 bytes
    std::size_t bytes = 0;  // at least cell_workspace_bytes(...)
    cell_limits limits;     // that `bytes` was computed for
};

namespace device {

// At the start of the workspace.
struct cell_state {
    pipeline_state call; // its index_error stops what follows
    std::uint64_t counts[core::index_of(core::cell_count::size)];
    cell_list_state list;  // how many records there are
    std::uint64_t records; // that passes work on; 0 if not all fit
    std::uint64_t triangles_in;
    std::uint64_t counts_voxels; // 0 or 1
    std::uint64_t listed_voxels; // those that a call into bricks lists, whether or not they fit
};

struct note_cells {
    std::uint64_t triangles_in;
    bool counts_voxels;
    cell_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        state->triangles_in = triangles_in;
        state->counts_voxels = counts_voxels ? 1 : 0;
    }
};
// Whether the records fit.
struct bound_cell_records {
    std::uint64_t room;
    cell_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const std::uint64_t total = state->list.num_terms;
        if (state->counts[core::index_of(core::cell_count::bad_index)] != 0) state->call.index_error |= bad_index;
        if (total > room) state->call.index_error |= stopped;
        state->records = state->call.index_error == 0 ? total : 0;
    }
};
struct stop_large_windings {
    cell_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (state->counts[core::index_of(core::cell_count::too_large)] != 0) state->call.index_error |= stopped;
    }
};
// Keys behind the records stand for no voxel, and are sorted to the end.
struct fill_cell_keys {
    const std::uint64_t* records;
    std::uint64_t none;
    std::uint64_t* keys;
    std::uint32_t* order;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < *records) return;
        keys[i] = none;
        order[i] = 0;
    }
};
template <class F>
struct unless_stopped {
    F f;
    const unsigned int* error;
    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (*error == 0) f(i);
    }
};

// The memory of a call's records, in the order of its arrays, and the launches that list and sort them.
template <class Draw>
class async_cells {
    using vertex_shader = std::remove_cvref_t<decltype(std::declval<Draw>().vertex_shader)>;
    using mesh_type = std::remove_cvref_t<decltype(std::declval<Draw>().mesh)>;

public:
    using cell_shader = std::remove_cvref_t<decltype(std::declval<Draw>().fragment_shader)>;
    using walk_type = core::passes::cell_walk<cell_shader>;
    using terms_type = typename walk_type::terms_type;
    using cursor = typename walk_type::cursor;

    // fits(): false if vertices, edges, rows or records cannot be numbered; then there is no memory.
    async_cells(std::span<const Draw> draws, const grid& g, const cell_options& options, std::uint64_t room,
                arena& memory)
        : draws_(draws), grid_(g), options_(options), room_(room), extent_(core::turn(g.extent, options.axis)) {
        for (const Draw& d : draws) {
            begins_.push_back({vertices_, triangles_});
            vertices_ += d.mesh.positions.size() * d.mesh.copies.count;
            triangles_ += d.mesh.triangles.size() * d.mesh.copies.count;
        }
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        rows_ = wide(extent_.y) * wide(extent_.z);
        keys_of_ = {wide(extent_.x) + 2, wide(extent_.y),
                    options.bodies == bodies::call ? 1 : std::uint64_t{draws.size()}};
        num_keys_ = static_cast<uint128>(rows_) * keys_of_.bodies * keys_of_.slots;
        if (!fits()) return;
        const std::uint64_t sorted = std::max({room, num_named(), num_edges()});
        state_ = memory.take<cell_state>(1);
        positions_ = memory.take<core::snapped_position>(vertices_ + 1);
        indices_ = memory.take<glm::uvec3>(triangles_);
        first_triangle_ = memory.take<std::uint64_t>(draws.size());
        shaders_ = memory.take<cell_shader>(draws.size());
        num_pixels_ = memory.take<std::uint32_t>(triangles_ + 1);
        first_pixel_ = memory.take<unsigned long long>(triangles_ + 1);
        scan_bytes_ = cell_scan_bytes(static_cast<std::uint32_t>(triangles_ + 1));
        scan_ = memory.take<std::uint8_t>(scan_bytes_);
        for (int i = 0; i < 2; ++i) {
            keys_[i] = memory.take<std::uint64_t>(sorted);
            order_[i] = memory.take<std::uint32_t>(sorted);
        }
        sort_bytes_ =
            std::max({sort_bytes_of(room, key_bits()), sort_bytes_of(num_named(), core::passes::place_key_bits),
                      sort_bytes_of(num_edges(), 2 * name_bits())});
        sort_ = memory.take<std::uint8_t>(sort_bytes_);
        terms_ = memory.take<terms_type>(room);
        names_ = memory.take<std::uint32_t>(num_named() + 1); // one, of vertex 0, for bad indices
    }
    [[nodiscard]] bool fits() const {
        return vertices_ < core::max_numbered && triangles_ < core::max_numbered && num_edges() < core::max_numbered &&
               room_ < core::max_numbered && num_keys_ >> 63 == 0;
    }

    [[nodiscard]] cell_state* state() const { return state_; }
    [[nodiscard]] std::uint64_t num_rows() const { return rows_; } // of the grid
    [[nodiscard]] std::uint64_t num_bodies() const { return keys_of_.bodies; }
    // The cursors of a walk along `rows` rows at a time; null with one body.
    [[nodiscard]] cursor* take_cursors(std::uint64_t rows, arena& memory) const {
        return keys_of_.bodies == 1 ? nullptr : memory.take<cursor>(rows * keys_of_.bodies);
    }

    // The sorted records, and behind the first state()->records those of no voxel. If they do not fit, that is 0.
    [[nodiscard]] core::passes::record_list<terms_type> list(cudaStream_t stream) const {
        using namespace core::passes;
        std::uint64_t* const counts = state_->counts;
        const unsigned int* const error = &state_->call.index_error;
        check(cudaMemsetAsync(state_, 0, sizeof(cell_state), stream));
        check_subsets(draws_, &state_->call.index_error, stream);
        run(1, note_cells{triangles_, options_.count_voxels, state_}, stream);
        upload(
            first_triangle_, draws_.size(), [&](std::size_t d) { return begins_[d].triangle; }, stream);
        upload(
            shaders_, draws_.size(), [&](std::size_t d) { return draws_[d].fragment_shader; }, stream);
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            const auto& mesh = draws_[d].mesh;
            const snap_vertices_of_cells<mesh_type, vertex_shader> snap{mesh,
                                                                        draws_[d].vertex_shader,
                                                                        static_cast<std::uint32_t>(d),
                                                                        core::make_snap_transform(grid_),
                                                                        options_.axis,
                                                                        positions_ + begins_[d].vertex};
            run(mesh.positions.size() * mesh.copies.count, unless_stopped<decltype(snap)>{snap, error}, stream);
            const join_triangles join{core::elements_of<mesh_type>::indices(mesh),
                                      static_cast<std::uint32_t>(begins_[d].vertex), indices_ + begins_[d].triangle,
                                      counts};
            run(mesh.triangles.size() * mesh.copies.count, join, stream);
        }
        const cell_mesh mesh = joined();
        if (options_.count_open_edges) find_open_edges(stream); // in the arrays that take the records
        run(triangles_ + 1, count_cell_pixels<terms_type>{mesh, num_pixels_, counts, &state_->list}, stream);
        sum_counts(num_pixels_, first_pixel_, static_cast<std::uint32_t>(triangles_ + 1), scan_, scan_bytes_,
                   stage::coarse_raster, stream);
        const list_cell_pixels<terms_type> list{
            mesh,      keys_of_, reinterpret_cast<const std::uint64_t*>(first_pixel_), &state_->list, room_, keys_[0],
            order_[0], terms_};
        list_cells(list, room_, error, stream);
        run(1, bound_cell_records{room_, state_}, stream);
        run(room_, fill_cell_keys{&state_->records, static_cast<std::uint64_t>(num_keys_), keys_[0], order_[0]},
            stream);
        const int at = sort(room_, key_bits(), stream);
        return {keys_of_, keys_[at], order_[at], terms_, room_};
    }
    // What looks at the sums of the rows of the grid.
    [[nodiscard]] core::passes::measure_rows<terms_type>
    measure(const core::passes::record_list<terms_type>& records) const {
        constexpr std::uint64_t safe = std::uint64_t{1} << 19; // triangles whose covers cannot wrap
        return {records, triangles_ >= safe, state_->counts};
    }
    [[nodiscard]] walk_type walk(const core::passes::record_list<terms_type>& records, cursor* cursors) const {
        return {records, joined(), shaders_, cursors, grid_.offset, options_.axis, extent_.x};
    }
    // All of a call into a framebuffer.
    template <class... Targets>
    void draw_into(const framebuffer_view<Targets...>& fb, cursor* cursors, cudaStream_t stream) const {
        const auto records = list(stream);
        measure_cell_rows(measure(records), rows_ * keys_of_.bodies, stream);
        run(1, stop_large_windings{state_}, stream);
        clear_framebuffer(fb, &state_->call, stream);
        shade_cell_rows(core::passes::shade_cells<cell_shader, Targets...>{walk(records, cursors), fb, state_->counts},
                        rows_, &state_->call.index_error, stream);
    }

private:
    struct begin {
        std::uint64_t vertex, triangle;
    };
    [[nodiscard]] std::uint64_t num_edges() const { return options_.count_open_edges ? 3 * triangles_ : 0; }
    // Vertices whose places get names, and the bits of a name.
    [[nodiscard]] std::uint64_t num_named() const { return options_.count_open_edges ? vertices_ : 0; }
    [[nodiscard]] int name_bits() const { return static_cast<int>(std::bit_width(vertices_)); }
    // As core::cell_scene::count_open_edges, in the arrays that the records are sorted in later.
    void find_open_edges(cudaStream_t stream) const {
        using namespace core::passes;
        const std::uint64_t edges = num_edges();
        run(vertices_, hash_places{positions_, keys_[0], order_[0]}, stream);
        int at = sort(vertices_, place_key_bits, stream);
        run(vertices_, name_places{positions_, keys_[at], order_[at], vertices_, names_}, stream);
        const body_triangles all{{indices_, static_cast<std::uint32_t>(triangles_), 0},
                                 static_cast<std::uint32_t>(triangles_),
                                 static_cast<std::uint32_t>(vertices_)};
        run(edges, key_edges{all, names_, name_bits(), keys_[0], order_[0]}, stream);
        at = sort(edges, 2 * name_bits(), stream);
        run(edges, count_unmatched_edges{{keys_[at], order_[at], edges, name_bits()}, state_->counts}, stream);
    }
    [[nodiscard]] int key_bits() const {
        return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(num_keys_)));
    }
    [[nodiscard]] static std::size_t sort_bytes_of(std::uint64_t count, int bits) {
        return count < 2 ? 0 : sort_bytes<std::uint64_t>(count, bits);
    }
    // Returns which of the two pairs of arrays holds the result.
    [[nodiscard]] int sort(std::uint64_t count, int bits, cudaStream_t stream) const {
        return count < 2 ? 0
                         : sort_by_cell<std::uint64_t>(keys_, order_, count, bits, sort_, sort_bytes_, stage::tile_sort,
                                                       stream);
    }
    [[nodiscard]] core::passes::cell_mesh joined() const {
        return {positions_,
                indices_,
                first_triangle_,
                static_cast<std::uint32_t>(draws_.size()),
                static_cast<std::uint32_t>(draws_.size()),
                static_cast<std::uint32_t>(triangles_),
                static_cast<std::uint32_t>(triangles_),
                grid_.fraction(),
                extent_,
                core::areas_of(grid_, options_.axis)};
    }
    template <class F>
    static void run(std::uint64_t count, const F& f, cudaStream_t stream) {
        for_each(count, f, stage::coarse_raster, stream);
    }

    std::span<const Draw> draws_;
    const grid& grid_;
    const cell_options& options_;
    std::uint64_t room_, vertices_ = 0, triangles_ = 0, rows_ = 0;
    glm::ivec3 extent_; // turned
    std::vector<begin> begins_;
    core::passes::cell_keys keys_of_{};
    uint128 num_keys_ = 0;
    cell_state* state_ = nullptr;
    core::snapped_position* positions_ = nullptr;
    glm::uvec3* indices_ = nullptr;
    std::uint64_t* first_triangle_ = nullptr;
    cell_shader* shaders_ = nullptr;
    std::uint32_t* num_pixels_ = nullptr;
    unsigned long long* first_pixel_ = nullptr;
    std::uint32_t* names_ = nullptr; // of the vertices' places
    std::uint8_t *scan_ = nullptr, *sort_ = nullptr;
    std::size_t scan_bytes_ = 0, sort_bytes_ = 0;
    std::uint64_t* keys_[2] = {nullptr, nullptr};
    std::uint32_t* order_[2] = {nullptr, nullptr};
    terms_type* terms_ = nullptr;
};

[[nodiscard]] inline status validate_async(const cell_options& options, const grid& g) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    return options.repair == repair::none ? status{} : core::failure(status_code::strategy_unavailable);
}

} // namespace device

// Bytes that voxelize_cells_async needs for such a call on the current device; 0 if the arguments are invalid, or the
// call closes holes, which takes waits.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] std::size_t cell_workspace_bytes(std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                               const grid& g, const framebuffer_view<Targets...>&,
                                               const cell_options& options, const cell_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !device::validate_async(options, g).ok()) return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::cell_state);
    return device::bytes_or_none([&]() -> std::size_t {
        device::arena plan;
        const device::async_cells<draw<Mesh, VertexShader, CellShader>> call(draws, g, options, limits.records, plan);
        if (!call.fits()) return 0;
        (void)call.take_cursors(call.num_rows(), plan);
        return plan.used();
    });
}

// Puts the call on the backend's stream and returns. A status other than ok means that nothing was launched, or that a
// launch failed; read_cells_status reports what the device finds out. strategy_unavailable: the call closes holes.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status voxelize_cells_async(cuda_backend& backend,
                                          std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
                                          const framebuffer_view<Targets...>& fb, const cell_options& options,
                                          const cell_workspace_view& workspace) {
    if constexpr (core::cell_fits_targets<Mesh, VertexShader, CellShader, Targets...>()) {
        if (const status s = device::validate_async(options, g); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        return device::with_cuda_status([&]() -> status {
            const std::size_t need = cell_workspace_bytes(draws, g, fb, options, workspace.limits);
            if (need == 0) return core::failure(status_code::size_overflow);
            if (workspace.memory == nullptr || workspace.bytes < need) {
                status small = core::failure(status_code::capacity_exceeded);
                small.required.bytes = need;
                return small;
            }
            if (s.counts.triangles_in == 0) {
                auto* const state = static_cast<device::cell_state*>(workspace.memory);
                device::launch_until(stage::fine_raster, [&] {
                    device::check(cudaMemsetAsync(state, 0, sizeof(device::cell_state), backend.stream));
                    device::clear_framebuffer(fb, &state->call, backend.stream);
                });
                return {};
            }
            device::arena memory(workspace.memory);
            const device::async_cells<draw<Mesh, VertexShader, CellShader>> call(draws, g, options,
                                                                                 workspace.limits.records, memory);
            auto* const cursors = call.take_cursors(call.num_rows(), memory);
            device::launch_until(stage::coarse_raster, [&] { call.draw_into(fb, cursors, backend.stream); });
            return {};
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

namespace device {

// Waits. The status of a call in this memory, and its state: ok too where something did not fit.
[[nodiscard]] inline status read_cells(cuda_backend& backend, const void* memory, cell_state& state) {
    if (const status s = read_start(memory, state, backend.stream); !s.ok()) return s;
    if ((state.call.index_error & bad_numbers) != 0) return core::failure(status_code::bad_subset);
    cell_options options;
    options.count_voxels = state.counts_voxels != 0;
    const std::vector<std::uint64_t> counts(std::begin(state.counts), std::end(state.counts));
    return core::make_cell_status(counts, options, state.triangles_in, std::uint64_t{state.list.num_terms});
}

} // namespace device

// Waits for the stream and returns the status of the last call in this workspace, that of voxelize_cells. `need` may be
// null. Where the records did not fit (capacity_exceeded), *need receives limits that suffice for the same call.
[[nodiscard]] inline status read_cells_status(cuda_backend& backend, const cell_workspace_view& workspace,
                                              cell_limits* need = nullptr) {
    device::cell_state state{};
    const status s = device::read_cells(backend, workspace.memory, state);
    if (!s.ok() || (state.call.index_error & device::stopped) == 0) return s;
    if (need != nullptr) need->records = std::max(workspace.limits.records, std::uint64_t{state.list.num_terms});
    status failed = core::failure(status_code::capacity_exceeded, stage::coarse_raster);
    failed.counts.triangles_in = state.triangles_in;
    return failed;
}

} // namespace voxelpipe
