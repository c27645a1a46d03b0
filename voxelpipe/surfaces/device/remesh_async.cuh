// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// remesh_async: as remesh, without waits and allocations, so that a CUDA graph can capture it and replay it with moved
// vertices; a captured graph of it has run on the emulated device alone. It works in the caller's memory, in arrays
// whose room is given; a surface that does not fit is empty, and read_remesh_status says what was needed. The solid
// comes first, into bits of the workspace; then the crossings of the mesh are sorted axis by axis, in arrays of fixed
// length whose unused ends hold keys that come last.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/solid/device/solid_async.cuh>
#include <voxelpipe/surfaces/device/extract_async.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace voxelpipe {

// Room of a remesh.
struct remesh_limits {
    surface_limits surface; // before parts are left out
    // Crossings of triangles with rows of samples along one axis, those before the grid included; below 2^32 - 1.
    std::uint64_t crossings = 0;
};

// The caller's memory, as workspace_view.
struct remesh_workspace_view {
    void* memory = nullptr; // on the device, aligned to 256 bytes
    std::size_t bytes = 0;  // at least remesh_workspace_bytes(...)
    remesh_limits limits;   // that `bytes` was computed for
};

namespace device {

// What a call keeps at the beginning of its workspace.
struct remesh_state {
    pipeline_state call;                   // of the solid
    core::passes::bounded_surface surface; // at the end of the call
    std::uint64_t edges[static_cast<int>(core::passes::edge_count::count)];
    std::uint64_t all_crossings; // along the axis that has most, as far as axes were looked at
};

// Takes what the solid has counted, beside the errors that are known.
struct take_solid_state {
    const pipeline_state* solid;
    remesh_state* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const unsigned int error = state->call.index_error;
        state->call = *solid;
        state->call.index_error |= error;
        state->call.deferred = {};
    }
};
// Leaves nothing to do if the solid has failed.
struct stop_without_solid {
    capacities room;
    const remesh_state* state;
    core::passes::bounded_surface* surface;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (has_failed(state->call, room)) surface->words = surface->cells = surface->vertices = surface->quads = 0;
    }
};
// Leaves nothing to do if the crossings do not fit.
struct bound_mesh_crossings {
    const unsigned long long* total;
    std::uint64_t room;
    remesh_state* state;
    core::passes::bounded_surface* surface;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (surface->cells == 0) return; // they have not been counted
        if (*total > state->all_crossings) state->all_crossings = *total;
        if (*total > room) surface->words = surface->cells = surface->vertices = surface->quads = 0;
    }
};
// Counts zeros where the call has failed, since indices may name no vertex then.
template <int Axis>
struct list_unless_stopped {
    core::passes::list_mesh_crossings<Axis> list;
    const std::uint64_t* cells;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (*cells != 0)
            list(i);
        else
            list.counts[i] = 0;
    }
};
// Keys behind the crossings, which are sorted to the end.
struct fill_crossing_keys {
    const unsigned long long* total;
    const std::uint64_t* cells;
    std::uint64_t none;
    std::uint64_t* keys;
    std::uint32_t* triangles;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (*cells != 0 && i < *total) return;
        keys[i] = none;
        triangles[i] = 0;
    }
};
// Joins the counts of crossings, and leaves all where read_remesh_status finds it.
struct count_crossed {
    remesh_state* state;
    core::passes::bounded_surface* surface;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (surface->cells != 0)
            surface->counts.made_crossings = state->edges[static_cast<int>(core::passes::edge_count::made)];
        state->surface = *surface;
    }
};

// The memory of a call, in the order of its arrays, and its launches.
template <class Draw>
class remesh_call;
template <class Mesh, class VertexShader, class Shader>
class remesh_call<draw<Mesh, VertexShader, Shader>> {
public:
    using draw_type = draw<Mesh, VertexShader, Shader>;

    // fits(): false if vertices, triangles or crossings cannot be numbered; then there is no memory.
    remesh_call(std::span<const draw_type> draws, const grid& samples, const remesh_options& options,
                const remesh_limits& limits, arena& memory)
        : draws_(draws), samples_(samples), options_(options), room_(limits.crossings) {
        for (const draw_type& d : draws) {
            begins_.push_back({vertices_, triangles_, primitives_});
            vertices_ += d.mesh.num_vertices();
            triangles_ += d.mesh.num_triangles();
            primitives_ += d.mesh.num_primitives();
            solids_.push_back({d.mesh, d.vertex_shader, constant(true)});
        }
        const bool is_numbered = vertices_ < core::max_numbered && triangles_ < core::max_numbered &&
                                 primitives_ < core::max_numbered && room_ < core::max_numbered;
        fits_ = is_numbered && (triangles_ == 0 || solid(nullptr).entries.fits());
        if (!fits_) return;
        state_ = memory.take<remesh_state>(1);
        bits_ = memory.take<word>(bits_target::map::elements(samples.extent));
        of_solid_ = memory.take<std::byte>(triangles_ == 0 ? 0 : solid(nullptr).plan_memory());
        positions_ = memory.take<core::snapped_position>(vertices_);
        indices_ = memory.take<glm::uvec3>(triangles_);
        names_ = memory.take<std::uint32_t>(triangles_);
        first_ = memory.take<std::uint64_t>(draws.size());
        body_ = memory.take<std::uint32_t>(draws.size());
        counts_ = memory.take<std::uint32_t>(triangles_ + 1);
        places_ = memory.take<unsigned long long>(triangles_ + 1);
        scan_bytes_ = cell_scan_bytes(static_cast<std::uint32_t>(triangles_ + 1));
        scan_ = memory.take<std::uint8_t>(scan_bytes_);
        for (int i = 0; i < 2; ++i) {
            keys_[i] = memory.take<std::uint64_t>(room_);
            found_[i] = memory.take<std::uint32_t>(room_);
        }
        ranges_ =
            memory.take<core::passes::row_range>(std::max({rows<0>().rows(), rows<1>().rows(), rows<2>().rows()}));
        sort_bytes_ = std::max({sort_bytes_of<0>(), sort_bytes_of<1>(), sort_bytes_of<2>()});
        sort_ = memory.take<std::uint8_t>(sort_bytes_);
        const target_view<bits_target> bits{bits_, samples.extent};
        extract_.emplace(bits, core::extract_options_of(options), limits.surface, memory, true);
    }
    [[nodiscard]] bool fits() const { return fits_; }
    [[nodiscard]] surface_result result() const { return extract_->result(samples_); }

    void launch(cudaStream_t stream) const {
        using namespace core::passes;
        check(cudaMemsetAsync(state_, 0, sizeof(remesh_state), stream));
        // A solid that fails leaves its target as it was, which is nothing.
        check(cudaMemsetAsync(bits_, 0, sizeof(word) * bits_target::map::elements(samples_.extent), stream));
        if (triangles_ != 0) {
            check_subsets(draws_, &state_->call.index_error, stream);
            const auto call = solid(bits_);
            zero_memory(of_solid_, call.zeroed_bytes(), stream);
            arena of_solid(of_solid_);
            call.launch(of_solid, stream);
            run(1, take_solid_state{reinterpret_cast<const pipeline_state*>(of_solid_), state_}, stream);
            gather(stream);
        }
        extract_->launch(stream, crossing_finder{*this, names_});
        run(1, count_crossed{state_, extract_->state()}, stream);
    }

private:
    struct begin {
        std::uint64_t vertex, triangle, primitive;
    };
    using bits_target = target<bit, blend::replace>;
    using bits_view = framebuffer_view<bits_target>;
    using solid_draw = draw<Mesh, VertexShader, constant_output<bool>>;
    // What extract_call calls when the cells are known.
    struct crossing_finder {
        const remesh_call& call;
        const std::uint32_t* primitives;
        void operator()(const surface_words& words, core::edge_crossing* crossings,
                        core::passes::bounded_surface* surface, cudaStream_t stream) const {
            call.run(1, stop_without_solid{{0, 0, call.room_, 0}, call.state_, surface}, stream);
            call.template cross<0>(words, crossings, surface, stream);
            call.template cross<1>(words, crossings, surface, stream);
            call.template cross<2>(words, crossings, surface, stream);
        }
    };
    template <class F>
    static void run(std::uint64_t count, const F& f, cudaStream_t stream) {
        for_each(count, f, stage::coarse_raster, stream);
    }
    template <int Axis>
    [[nodiscard]] auto rows() const {
        return core::passes::row_keys<Axis>(samples_.extent);
    }
    template <int Axis>
    [[nodiscard]] std::size_t sort_bytes_of() const {
        return room_ < 2 ? 0 : sort_bytes<std::uint64_t>(room_, rows<Axis>().key_bits() + 1);
    }
    // bits: null for the size of its memory.
    [[nodiscard]] auto solid(word* bits) const {
        bits_view view = bits_view::on(samples_.extent, bits);
        voxelpipe::get<0>(view.targets).load = load_operation::clear;
        workspace_limits limits;
        limits.fragments = room_;
        return make_solid_call(std::span<const solid_draw>(solids_), samples_, view, core::sign_options(options_),
                               triangles_, limits);
    }
    [[nodiscard]] core::passes::mesh_triangles mesh() const {
        return {positions_, indices_, names_, triangles_,
                triangles_, first_,   body_,  static_cast<std::uint32_t>(draws_.size())};
    }

    // The snapped triangles of all draws, as gathered_mesh has them.
    void gather(cudaStream_t stream) const {
        using namespace core::passes;
        const bool each = options_.bodies == bodies::draw;
        upload(
            first_, draws_.size(), [&](std::size_t d) { return begins_[d].triangle; }, stream);
        upload(
            body_, draws_.size(), [&](std::size_t d) { return each ? static_cast<std::uint32_t>(d) : 0; }, stream);
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            const Mesh& m = draws_[d].mesh;
            const begin& at = begins_[d];
            run(m.num_vertices(),
                snap_vertices<Mesh, VertexShader>{m, draws_[d].vertex_shader, static_cast<std::uint32_t>(d),
                                                  core::make_snap_transform(samples_), positions_ + at.vertex},
                stream);
            run(m.num_triangles(),
                copy_triangles{core::triangles_of(m), static_cast<std::uint32_t>(at.vertex), indices_ + at.triangle},
                stream);
            const bool is_part = m.part.whole != 0;
            const auto count = static_cast<std::uint32_t>(m.triangles.size()),
                       whole = is_part ? static_cast<std::uint32_t>(m.part.whole) : count;
            run(m.num_triangles(),
                name_primitives{is_part ? m.part.numbers.data() : nullptr, count, whole,
                                static_cast<std::uint32_t>(at.primitive), names_ + at.triangle},
                stream);
        }
    }

    // The crossings with the edges along an axis, unless the call has failed.
    template <int Axis>
    void cross(const surface_words& words, core::edge_crossing* crossings, core::passes::bounded_surface* surface,
               cudaStream_t stream) const {
        using namespace core::passes;
        if (triangles_ == 0) return;
        const row_keys<Axis> keys = rows<Axis>();
        const std::uint64_t* const any = &surface->cells;
        const unsigned long long* const total = places_ + triangles_;
        core::voxel_box whole{};
        for (int a = 0; a < 3; ++a) whole.hi[a] = samples_.extent[a] - 1;
        list_mesh_crossings<Axis> list{mesh(), keys, whole, samples_.fraction(), counts_, nullptr, nullptr, nullptr};
        run(triangles_ + 1, list_unless_stopped<Axis>{list, any}, stream);
        sum_counts(counts_, places_, static_cast<std::uint32_t>(triangles_ + 1), scan_, scan_bytes_,
                   stage::coarse_raster, stream);
        run(1, bound_mesh_crossings{total, room_, state_, surface}, stream);
        run(room_, fill_crossing_keys{total, any, keys.rows() << keys.bits, keys_[0], found_[0]}, stream);
        list.counts = nullptr;
        list.places = reinterpret_cast<const std::uint64_t*>(places_);
        list.keys = keys_[0];
        list.triangles = found_[0];
        run(triangles_, if_any<list_mesh_crossings<Axis>>{list, any}, stream);
        const int at = room_ < 2 ? 0
                                 : sort_by_cell<std::uint64_t>(keys_, found_, room_, keys.key_bits() + 1, sort_,
                                                               sort_bytes_, stage::tile_sort, stream);
        run(keys.rows(), clear_rows{ranges_}, stream);
        run(room_, find_rows{keys_[at], room_, keys.rows(), keys.bits, ranges_}, stream);
        for_word_edges<Axis>(words, word_blocks(extract_->room().cells),
                             cross_mesh<Axis>{mesh(), keys, ranges_, keys_[at], room_, found_[at],
                                              core::crossing_rule(options_), options_.bodies == bodies::draw,
                                              samples_.fraction(), crossings, state_->edges},
                             stream);
    }

    std::span<const draw_type> draws_;
    grid samples_;
    remesh_options options_;
    std::uint64_t room_, vertices_ = 0, triangles_ = 0, primitives_ = 0;
    std::vector<begin> begins_;
    std::vector<solid_draw> solids_;
    bool fits_ = false;
    remesh_state* state_ = nullptr;
    word* bits_ = nullptr;
    std::byte* of_solid_ = nullptr;
    core::snapped_position* positions_ = nullptr;
    glm::uvec3* indices_ = nullptr;
    std::uint32_t *names_ = nullptr, *body_ = nullptr, *counts_ = nullptr;
    std::uint64_t* first_ = nullptr;
    core::passes::row_range* ranges_ = nullptr;
    unsigned long long* places_ = nullptr;
    std::uint8_t *scan_ = nullptr, *sort_ = nullptr;
    std::size_t scan_bytes_ = 0, sort_bytes_ = 0;
    std::uint64_t* keys_[2] = {nullptr, nullptr};
    std::uint32_t* found_[2] = {nullptr, nullptr};
    std::optional<extract_call<bit, blend::replace, layout::linear>> extract_;
};

[[nodiscard]] inline status validate_async(const remesh_options& options, const grid& g, const remesh_limits& limits) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate(options, g); !s.ok()) return s;
    if (options.repair != repair::none || options.level != 0.0) return core::failure(status_code::strategy_unavailable);
    return validate_async(core::extract_options_of(options), true, core::sample_grid(g, options.sample),
                          limits.surface);
}

} // namespace device

// Bytes that remesh_async needs for such a call on the current device; 0 if the arguments are invalid, or the call is
// one that remesh_async refuses.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] std::size_t remesh_workspace_bytes(std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                                                 const remesh_options& options, const remesh_limits& limits) {
    if (!core::validate_draws(draws).ok() || !device::validate_async(options, g, limits).ok()) return 0;
    return device::bytes_or_none([&]() -> std::size_t {
        device::arena plan;
        const device::remesh_call<draw<Mesh, VertexShader, Shader>> call(draws, core::sample_grid(g, options.sample),
                                                                         options, limits, plan);
        return call.fits() ? plan.used() : 0;
    });
}

// Puts the call on the backend's stream and returns. `out` is set at once, with the arrays of surface<cuda_backend>,
// sources included; what it points to is there when the stream has passed the call. A status other than ok means that
// nothing was launched, or that a launch failed; read_remesh_status reports what the device finds out. Fragment shaders
// are ignored: there are no values of vertices. strategy_unavailable: a repair, and options.embedded, which take waits,
// and a level, of which voxelize_distance_async and extract_async make the surface.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] status remesh_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                  const grid& g, surface_result& out, const remesh_options& options,
                                  const remesh_workspace_view& workspace) {
    if constexpr (core::check_vertex_shader<Mesh, VertexShader>()) {
        if (const status s = device::validate_async(options, g, workspace.limits); !s.ok()) return s;
        if (const status s = core::validate_draws(draws); !s.ok()) return s;
        return device::with_cuda_status([&]() -> status {
            const std::size_t need = remesh_workspace_bytes(draws, g, options, workspace.limits);
            if (need == 0) return core::failure(status_code::size_overflow);
            if (workspace.memory == nullptr || workspace.bytes < need) {
                status s = core::failure(status_code::capacity_exceeded);
                s.required.bytes = need;
                return s;
            }
            device::arena memory(workspace.memory);
            const device::remesh_call<draw<Mesh, VertexShader, Shader>> call(
                draws, core::sample_grid(g, options.sample), options, workspace.limits, memory);
            device::launch_until(stage::tile_sort, [&] { call.launch(backend.stream); });
            out = call.result();
            return {};
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// Waits for the stream and returns the status of the last call in this workspace, with the counts of remesh. `need` may
// be null. Where something did not fit (capacity_exceeded), *need receives larger limits; what comes after it was not
// counted, so that the same call may fail with these again, three times at most.
[[nodiscard]] inline status read_remesh_status(cuda_backend& backend, const remesh_workspace_view& workspace,
                                               remesh_limits* need = nullptr) {
    device::remesh_state state{};
    if (const status s = device::read_start(workspace.memory, state, backend.stream); !s.ok()) return s;
    workspace_limits of_solid;
    of_solid.fragments = workspace.limits.crossings;
    workspace_limits larger = of_solid;
    status s = read_status(backend, {workspace.memory, workspace.bytes, of_solid, nullptr}, &larger);
    remesh_limits wanted = workspace.limits;
    wanted.crossings = std::max<std::uint64_t>({wanted.crossings, larger.fragments, state.all_crossings});
    const status of_surface = device::surface_status(state.surface, workspace.limits.surface, &wanted.surface);
    const bool lacks_crossings = state.all_crossings > workspace.limits.crossings;
    if (s.ok() && lacks_crossings) s = core::failure(status_code::capacity_exceeded, stage::coarse_raster);
    if (s.ok() && !of_surface.ok()) s = of_surface;
    if (need != nullptr && s.code == status_code::capacity_exceeded) *need = wanted;
    if (!s.ok()) return s;
    s.surface = of_surface.surface;
    return s;
}

} // namespace voxelpipe
