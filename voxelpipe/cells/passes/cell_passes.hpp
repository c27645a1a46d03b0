// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells on any backend: list the terms of all triangles, sort them by row and voxel, sum and shade the rows.

#include <voxelpipe/cells/passes/cell_scene.hpp>
#include <voxelpipe/cells/passes/cell_walk.hpp>
#include <voxelpipe/core/row_passes.hpp>
#include <voxelpipe/programs/passes/fragment_pool.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// The status of a call that has succeeded, or what failed.
[[nodiscard]] inline status make_cell_status(const std::vector<std::uint64_t>& counts, const cell_options& options,
                                             std::uint64_t triangles_in, std::uint64_t records) {
    const auto of = [&](cell_count c) { return counts[index_of(c)]; };
    status s;
    if (of(cell_count::bad_index) != 0)
        s = failure(status_code::index_out_of_range, stage::coarse_raster);
    else if (of(cell_count::too_large) != 0)
        s = failure(status_code::winding_too_large, stage::fine_raster);
    s.counts.triangles_in = triangles_in;
    if (!s.ok()) return s;
    s.counts.triangles_nonfinite = of(cell_count::nonfinite);
    s.counts.triangles_too_far = of(cell_count::too_far);
    s.counts.triangles_outside = of(cell_count::outside);
    s.counts.triangles_drawn = triangles_in - s.counts.triangles_dropped() - s.counts.triangles_outside;
    s.counts.fragments = of(cell_count::fragments);
    s.counts.fragments_discarded = of(cell_count::discarded);
    s.counts.voxels = options.count_voxels ? of(cell_count::voxels) : 0;
    s.cells.open_rows = of(cell_count::open_rows);
    s.cells.open_edges = of(cell_count::open_edges);
    s.cells.cut_voxels = of(cell_count::cut_voxels);
    s.cells.below_zero = of(cell_count::below_zero);
    s.cells.above_one = of(cell_count::above_one);
    s.cells.cell_records = records;
    s.cells.lost_centroids = of(cell_count::lost_centroids);
    uint128 volume = static_cast<uint128>(of(cell_count::volume_high)) << 64;
    volume += static_cast<uint128>(of(cell_count::volume_middle)) << 32;
    volume += of(cell_count::volume_low);
    s.cells.volume_low = static_cast<std::uint64_t>(volume);
    s.cells.volume_high = static_cast<std::int64_t>(volume >> 64);
    return s;
}

// True of a backend that lists terms by list_terms_by_pixel(backend, mesh of the scene, keys, counts, term_room). The
// threads of another keep terms before their number is known, by Backend::collect and Backend::take.
template <class Backend>
inline constexpr bool lists_by_pixel = false;

// The arrays of a call's terms, which are as long as they have to be, or longer.
template <class Backend, class Terms>
struct term_room {
    typename Backend::template buffer<std::uint64_t>& keys;
    typename Backend::template buffer<std::uint32_t>& order;
    typename Backend::template buffer<Terms>& terms;
};

// The terms of a call's triangles by row and voxel, and what shades them.
template <class Backend, class CellShader>
class listed_cells {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using walk_type = passes::cell_walk<CellShader>;
    using terms_type = typename walk_type::terms_type;

    // Runs the vertex shaders, unless list() is to fail for want of numbers.
    template <class Draw>
    listed_cells(Backend& backend, std::span<const Draw> draws, const grid& g, const cell_options& options,
                 std::uint64_t triangles_in)
        : backend_(backend), options_(options), triangles_in_(triangles_in), num_draws_(draws.size()),
          offset_(g.offset), scene_(backend, draws, g, options.axis), keys_(backend, 0), order_(backend, 0),
          sizes_(backend, 0), terms_(backend, 0), shaders_(backend, 0), cursors_(backend, 0) {
        std::vector<CellShader> shaders;
        for (const auto& d : draws) shaders.push_back(d.fragment_shader);
        shaders_ = buffer<CellShader>(backend, array_view<const CellShader>(shaders.data(), shaders.size()));
    }

    // Closes holes, then lists and sorts. Throws what the backend's buffers throw.
    [[nodiscard]] status list() {
        if (scene_.num_vertices() == 0) return result(); // bad indices, of which none is a vertex's
        if (options_.repair == repair::close_holes) {
            if (options_.cones != nullptr)
                scene_.close_holes(options_.cones, options_.bodies == bodies::call ? 1 : num_draws_, holes_);
            else
                scene_.close_holes(options_.bodies, options_.max_hole_edges, holes_);
        }
        const std::uint64_t triangles = scene_.num_triangles();
        const bool finds_edges = options_.count_open_edges;
        if (finds_edges && 3 * triangles >= most) return fail(status_code::out_of_memory);
        const glm::ivec3 extent = scene_.extent();
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        keys_of_ = {wide(extent.x) + 2, wide(extent.y), options_.bodies == bodies::call ? 1 : num_draws_};
        const uint128 num_keys = static_cast<uint128>(num_rows()) * keys_of_.bodies * keys_of_.slots;
        if ((num_keys >> 63) != 0) return fail(status_code::size_overflow);

        if (finds_edges) scene_.count_open_edges();
        if (!list_terms(triangles)) return fail(status_code::out_of_memory);
        const int bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(num_keys)));
        if constexpr (lists_by_pixel<Backend>)
            backend_.sort_by_key(keys_, order_, bits, num_records_);
        else
            backend_.sort_by_key(keys_, order_, bits);
        return {};
    }
    // Looks at the sums of the rows of the grid, or of `count` listed ones.
    [[nodiscard]] status measure(std::uint64_t count, const std::uint64_t* rows = nullptr) {
        for_each_row(backend_, count * keys_of_.bodies,
                     passes::measure_rows<terms_type>{terms(), checks_size(), counts(), rows,
                                                      sizes_.size() == 0 ? nullptr : sizes_.data()});
        return result();
    }
    // What goes along rows, of which there are `places` at a time.
    [[nodiscard]] walk_type walk(std::uint64_t places) {
        using cursor = typename walk_type::cursor;
        if (keys_of_.bodies != 1) cursors_ = buffer<cursor>(backend_, places * keys_of_.bodies);
        return {terms(), scene_.mesh(), shaders_.data(),  keys_of_.bodies == 1 ? nullptr : cursors_.data(),
                offset_, options_.axis, scene_.extent().x};
    }

    // The status so far: of a call that has succeeded, or what failed.
    [[nodiscard]] status result() const {
        status s = make_cell_status(scene_.read_counts(), options_, triangles_in_, num_records_);
        s.cells.hole_edges = s.ok() ? holes_.hole_edges : 0;
        s.cells.holes = s.ok() ? holes_.holes : 0;
        s.cells.cones = s.ok() ? holes_.cones : 0;
        return s;
    }
    [[nodiscard]] std::uint64_t num_rows() const {
        return static_cast<std::uint64_t>(scene_.extent().y) * static_cast<std::uint64_t>(scene_.extent().z);
    }
    [[nodiscard]] std::uint64_t* counts() { return scene_.counts(); }
    [[nodiscard]] passes::record_list<terms_type> terms() {
        return {keys_of_, keys_.data(), order_.data(), terms_.data(),
                lists_by_pixel<Backend> ? num_records_ : terms_.size()};
    }
    [[nodiscard]] status fail(status_code code) const {
        status s = failure(code, stage::coarse_raster);
        s.counts.triangles_in = triangles_in_;
        return s;
    }

    static constexpr std::uint64_t most = std::uint64_t{1} << 32; // vertices, edges and terms are numbered in 32 bits

private:
    // Lists the terms of all triangles. False if they cannot be numbered.
    [[nodiscard]] bool list_terms(std::uint64_t triangles) {
        if constexpr (lists_by_pixel<Backend>) {
            num_records_ = list_terms_by_pixel(backend_, scene_.mesh(), keys_of_, scene_.counts(),
                                               term_room<Backend, terms_type>{keys_, order_, terms_});
            return num_records_ < most;
        } else {
            using record = passes::cell_record<terms_type>;
            auto records = backend_.template collect<record>(
                triangles, passes::collect_cells<terms_type>{scene_.mesh(), keys_of_, scene_.counts()});
            if (!make_room(records.size())) return false;
            if (checks_size()) sizes_ = buffer<std::uint32_t>(backend_, records.size());
            num_records_ = records.num_added();
            backend_.take(std::move(records),
                          passes::store_record<terms_type>{keys_.data(), order_.data(),
                                                           checks_size() ? sizes_.data() : nullptr, terms_.data()});
            return true;
        }
    }
    [[nodiscard]] bool checks_size() const {
        constexpr std::uint64_t safe = std::uint64_t{1} << 19; // triangles whose covers cannot wrap
        return scene_.num_triangles() >= safe;
    }
    [[nodiscard]] bool make_room(std::uint64_t count) {
        if (count >= most) return false;
        num_records_ = count;
        keys_ = buffer<std::uint64_t>(backend_, count);
        order_ = buffer<std::uint32_t>(backend_, count);
        terms_ = buffer<terms_type>(backend_, count);
        return true;
    }

    Backend& backend_;
    cell_options options_;
    std::uint64_t triangles_in_, num_draws_;
    glm::ivec3 offset_;
    cell_scene<Backend> scene_;
    cell_counters holes_;
    passes::cell_keys keys_of_{};
    buffer<std::uint64_t> keys_;
    buffer<std::uint32_t> order_, sizes_; // sizes: of terms that stand for several
    buffer<terms_type> terms_;
    std::uint64_t num_records_ = 0; // pairs of a triangle and a voxel
    buffer<CellShader> shaders_;    // of the bodies
    buffer<typename walk_type::cursor> cursors_;
};

// True if vertices are too many to be numbered; `failed` says so then.
template <class Backend, class Draw>
[[nodiscard]] bool has_too_many_vertices(std::span<const Draw> draws, std::uint64_t triangles_in, status& failed) {
    if (cell_scene<Backend>::num_vertices(draws) >> 32 == 0) return false;
    failed = failure(status_code::out_of_memory, stage::coarse_raster);
    failed.counts.triangles_in = triangles_in;
    return true;
}

// Implements voxelize_cells on any backend. Arguments are validated. Throws what the backend's buffers throw.
template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status run_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                               const grid& g, const framebuffer_view<Targets...>& fb, const cell_options& options,
                               std::uint64_t triangles_in) {
    status failed;
    if (has_too_many_vertices<Backend>(draws, triangles_in, failed)) return failed;
    listed_cells<Backend, CellShader> cells(backend, draws, g, options, triangles_in);
    if (const status s = cells.list(); !s.ok()) return s;
    if (const status s = cells.measure(cells.num_rows()); !s.ok()) return s;
    if (const status begun = begin_fold(backend, fb); !begun.ok()) return begun;
    for_each_row(backend, cells.num_rows(),
                 passes::shade_cells<CellShader, Targets...>{cells.walk(cells.num_rows()), fb, cells.counts()});
    return cells.result();
}

} // namespace voxelpipe::core
