// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Voxelizes over the ranks of an MPI communicator (CMake component mpi, target voxelpipe::mpi). Each rank adds the
// triangles that it has read, whichever they are. Then the ranks agree on slabs of about equal work, send each triangle
// to the ranks whose slabs it reaches, and each draws its slab, as a stream does. All slabs together are the result of
// one call, bit for bit; results stay where they are, only counters travel, and for solids what a repair needs.
//
//   slabs::mpi_stream stream(MPI_COMM_WORLD, backend, grid, vertex_shader, options);
//   stream.add(my_part_of_the_mesh).or_throw();
//   stream.draw(fragment_shader, make_framebuffer, sink).or_throw();   // every rank
//
// The program calls MPI_Init before and MPI_Finalize after. An MPI error ends the program, as MPI does by default.

#include <voxelpipe/slabs/mpi_exterior.hpp>
#include <voxelpipe/slabs/mpi_ranks.hpp>
#include <voxelpipe/slabs/mpi_records.hpp>
#include <voxelpipe/slabs/mpi_repairs.hpp>
#include <voxelpipe/slabs/stream.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// Members marked "every rank" are collective: all ranks of the communicator call them in the same order. Options and
// grid are the same on all of them.
template <class Backend, class VertexShader, class Mesh = mesh_view<>>
class mpi_stream {
    using varyings = detail::varyings_of<Mesh, VertexShader>;
    using record_type = record<varyings>;

public:
    // Refers to the communicator and the backend. stream_options::num_slabs is ignored; align holds for the borders
    // between ranks too. Throws std::invalid_argument for a grid that is not valid.
    mpi_stream(MPI_Comm comm, Backend& backend, const grid& g, const VertexShader& shader, stream_options options = {})
        : all_(comm), backend_(backend), grid_(g), shader_(shader), options_(std::move(options)),
          memory_(options_.memory / 4, 1, options_.folder), mine_(1) {
        if (const status s = validate(g); !s.ok()) throw std::invalid_argument("voxelpipe::slabs: " + s.message());
        repairs_.emplace(g, options_.repair, options_.memory / 8, options_.folder, 1);
        options_.num_slabs = 1;
        counts_of_layers_ = histogram(g.extent);
    }

    // Adds triangles of host memory. In the whole mesh, those of a lower rank come first, and each rank's in the order
    // in which it adds them. As stream::add; draw() fails on every rank if it failed on one, or threw.
    [[nodiscard]] status add(const Mesh& chunk) {
        try {
            const status s = add_records(chunk);
            if (!s.ok() && failed_.ok()) failed_ = s;
            return s;
        } catch (...) {
            if (!thrown_) thrown_ = std::current_exception();
            throw;
        }
    }

    // Every rank. As stream::draw, for the slab of this rank; a rank that has no layer calls neither make nor sink.
    // slab::voxels_before and fragments_before count from this rank's first slab; lists_before() has those of the ranks
    // below. Returns the counts of the whole grid on every rank, or a failure on every rank: its own, or
    // other_rank_failed.
    template <class FragmentShader, class Make, class Sink>
    [[nodiscard]] status draw(const FragmentShader& shader, const Make& make, const Sink& sink) {
        constexpr bool lists = detail::is_abuffer<std::remove_cvref_t<decltype(make(grid_.extent))>>;
        return draw_with(!lists, nullptr, [&](auto& stream) { return stream.draw(shader, make, sink); });
    }
    // Every rank. As stream::draw_solid, with every repair. On top of what that holds for a rank's slab:
    //   close_holes   the edges that the triangles of each rank leave open, 56 bytes each, on every rank: those of the
    //                 holes, and of the borders between what the ranks have read
    //   exterior      four layers of bits; with `closing` r the bits and walls of 2 r more layers, and as much again
    //                 while they are sent, more if other slabs are thinner than r
    template <class SolidShader, class Make, class Sink>
    [[nodiscard]] status draw_solid(const SolidShader& shader, const Make& make, const Sink& sink,
                                    const solid_options& how = {}) {
        if (how.repair == repair::exterior) {
            if (options_.repair != how.repair || how.slab != nullptr)
                return core::failure(status_code::bad_solid_options);
            if (const status s = core::validate(how, grid_); !s.ok()) return s;
        }
        return draw_with(false, &how, [&](auto& stream) { return stream.draw_solid(shader, make, sink, how); });
    }

    // Every rank. As stream::draw_cells: the fractions, and the counts but for open_edges, of one call. Holds what
    // draw_solid holds for close_holes.
    template <class CellShader, class Make, class Sink>
    [[nodiscard]] status draw_cells(const CellShader& shader, const Make& make, const Sink& sink,
                                    const cell_options& how = {}) {
        if (const status s = core::validate(how); !s.ok()) return s;
        if (!options_.is_solid || options_.band || how.repair != options_.repair || how.cones != nullptr ||
            how.axis != 0)
            return core::failure(status_code::bad_cell_options);
        solid_options holes;
        holes.repair = how.repair;
        holes.max_hole_edges = how.max_hole_edges;
        return draw_with(false, &holes, [&](auto& stream) { return stream.draw_cells(shader, make, sink, how); });
    }

    // Every rank. As stream::draw_distance: the distances and the counts of one call. Holds what draw_solid holds for
    // close_holes, and with band::whole all triangles on every rank.
    template <class DistanceShader, class Make, class Sink>
    [[nodiscard]] status draw_distance(const DistanceShader& shader, const Make& make, const Sink& sink,
                                       const distance_options& how = {}) {
        if (const status s = core::validate(how, grid_); !s.ok()) return s;
        if (options_.band != how.band || how.repair != options_.repair || repairs_->is_along_z() ||
            how.cones != nullptr || how.sample != sample::centre)
            return core::failure(status_code::bad_distance_options);
        const solid_options holes = core::sign_options(how);
        return draw_with(false, &holes, [&](auto& stream) { return stream.draw_distance(shader, make, sink, how); });
    }

    // After draw(): the slabs, by rank.
    [[nodiscard]] const plan& slabs() const { return plan_; }
    // Where the lists of a rank begin among those of all.
    struct list_offset {
        std::uint64_t voxels = 0, fragments = 0; // of the ranks below
    };
    // After draw(): of this rank.
    [[nodiscard]] list_offset lists_before() const { return before_; }

private:
    [[nodiscard]] status add_records(const Mesh& chunk) {
        counters added;
        const chunk_records<varyings, Mesh> records(chunk, shader_, grid_, options_.binning(grid_), num_triangles_);
        status s = records.valid();
        if (s.ok() && repairs_->needs_triangles())
            records.visit_snapped([&](const auto& a, const auto& b, const auto& c) { repairs_->add(a, b, c); });
        if (s.ok())
            s = records.visit(0, chunk.triangles.size(), added, [&](const record_type& r, const auto& reach) {
                counts_of_layers_.add(reach);
                memory_.push(mine_, 0, r);
            });
        core::add_triangles(counts_, added);
        if (s.ok()) num_triangles_ += chunk.part.whole != 0 ? chunk.part.whole : chunk.triangles.size();
        return s;
    }

    // solid: its options, or null.
    template <class Draw>
    [[nodiscard]] status draw_with(bool may_turn, const solid_options* solid, const Draw& draw) {
        detail::shared_work work(all_, failed_, thrown_);
        std::uint64_t base = 0, total = 0;
        MPI_Exscan(&num_triangles_, &base, 1, MPI_UINT64_T, MPI_SUM, all_.comm());
        if (all_.me() == 0) base = 0; // MPI leaves it undefined
        MPI_Allreduce(&num_triangles_, &total, 1, MPI_UINT64_T, MPI_SUM, all_.comm());
        work([&]() -> status {
            if (total > std::numeric_limits<std::uint32_t>::max())
                return core::failure(status_code::too_many_triangles);
            return {};
        });
        if (!work.all_ok()) return work.failure();

        detail::for_each_part(counts_of_layers_.words(), [&](std::uint64_t* first, int count) {
            MPI_Allreduce(MPI_IN_PLACE, first, count, MPI_UINT64_T, MPI_SUM, all_.comm());
        });
        work([&] {
            plan_options how;
            how.align = options_.align;
            how.may_turn = may_turn;
            plan_ = split(counts_of_layers_, all_.count(), how);
        });
        if (!work.all_ok()) return work.failure();

        std::vector<bin<record_type>> received; // by the rank that sends
        const core::snap_transform snap = core::make_snap_transform(grid_);
        detail::exchange_records(
            all_, plan_, static_cast<std::uint32_t>(base), mine_[0], received, options_.memory / 4, options_.folder,
            work, [&](const record_type& r) {
                const core::voxel_box reach = reach_of(snap, grid_.extent, r);
                return layer_range{static_cast<int>(reach.lo[plan_.axis]), static_cast<int>(reach.hi[plan_.axis]) + 1};
            });
        if (!work.all_ok()) return work.failure();
        core::hole_cones cones;
        if (solid != nullptr && repairs_->holes())
            cones = detail::join_holes(all_, repairs_->holes(), solid->max_hole_edges, work);
        if (solid != nullptr && repairs_->columns())
            detail::join_columns(all_, grid_, plan_.slabs[all_.index()], received, *repairs_->columns(), work);
        if (!work.all_ok()) return work.failure();

        const bool floods = solid != nullptr && solid->repair == repair::exterior;
        std::optional<record_stream<Backend, varyings>> stream; // none if there is no layer
        work([&]() -> status {
            if (plan_.slabs[all_.index()].size() == 0) return {};
            stream.emplace(backend_, plan_.crop(grid_, all_.index()), options_);
            if (plan_.axis != 2) stream->cut_into(equal_layers(stream->where(), plan_.axis, 1));
            feed(*stream, received);
            solid_repairs& repairs = stream->repairs();
            if (repairs.holes()) repairs.take(std::move(cones), grid_);
            if (repairs.columns()) {
                column_sweep &from = *repairs_->columns(), &to = *repairs.columns();
                std::copy(from.open().begin(), from.open().end(), to.open().begin());
                std::copy(from.below().begin(), from.below().end(), to.below().begin());
            }
            repairs_.reset();
            return floods ? stream->find_walls(*solid) : status{};
        });
        if (!work.all_ok()) return work.failure();
        if (floods) {
            detail::rank_flood(all_, grid_.extent, solid->closing)
                .run(plan_, stream ? &*stream->repairs().exterior() : nullptr, work);
            if (!work.all_ok()) return work.failure();
        }
        status drawn;
        work([&] {
            if (stream) drawn = draw(*stream);
            return drawn;
        });
        if (!work.all_ok()) return work.failure();
        return add_up(drawn);
    }

    template <class Stream>
    void feed(Stream& stream, std::vector<bin<record_type>>& received) const {
        const core::snap_transform snap = core::make_snap_transform(stream.where());
        for (bin<record_type>& from : received) {
            from.for_each_block([&](std::span<const record_type> block) {
                for (const record_type& r : block)
                    if (const auto reach = reach_of(snap, stream.where().extent, r); !reach.empty())
                        stream.push(r, reach);
            });
            from = {};
        }
    }

    [[nodiscard]] core::voxel_box reach_of(const core::snap_transform& snap, const glm::ivec3& extent,
                                           const record_type& r) const {
        return options_.binning(grid_)(snap, extent, r.positions).reach;
    }

    // The counts of all ranks, and those of the ranks below. Every rank.
    [[nodiscard]] status add_up(const status& drawn) {
        const std::array<std::uint64_t, 2> own{drawn.counts.voxels, drawn.counts.fragments};
        std::array<std::uint64_t, 2> below{};
        MPI_Exscan(own.data(), below.data(), 2, MPI_UINT64_T, MPI_SUM, all_.comm());
        if (all_.me() == 0) below = {};
        before_ = {below[0], below[1]};
        std::array<std::uint64_t, 12> sums{counts_.triangles_in,      counts_.triangles_nonfinite,
                                           counts_.triangles_too_far, counts_.triangles_zero_area,
                                           counts_.triangles_outside, counts_.triangles_drawn,
                                           drawn.counts.fragments,    drawn.counts.fragments_discarded,
                                           drawn.counts.voxels,       drawn.solid.open_rows,
                                           drawn.solid.crossings,     drawn.distance.band_samples};
        MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_UINT64_T, MPI_SUM, all_.comm());
        status all;
        all.counts = {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], sums[7], sums[8]};
        all.solid.open_rows = sums[9];
        all.solid.crossings = sums[10];
        all.distance.band_samples = sums[11];
        add_up_cells(drawn.cells, all.cells);
        // Holes are those of the whole mesh on every rank that has a slab.
        std::array<std::uint64_t, 7> most{drawn.solid.max_winding, drawn.solid.hole_edges, drawn.solid.holes,
                                          drawn.solid.cones,       drawn.cells.hole_edges, drawn.cells.holes,
                                          drawn.cells.cones};
        MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(most.size()), MPI_UINT64_T, MPI_MAX, all_.comm());
        all.solid.max_winding = most[0];
        all.solid.hole_edges = most[1];
        all.solid.holes = most[2];
        all.solid.cones = most[3];
        all.cells.hole_edges = most[4];
        all.cells.holes = most[5];
        all.cells.cones = most[6];
        return all;
    }
    // Every rank. The lower word of the volume goes in halves, so that the sum's carry is not lost.
    void add_up_cells(const cell_counters& drawn, cell_counters& all) const {
        std::array<std::uint64_t, 9> sums{drawn.volume_low & 0xffffffffu,
                                          drawn.volume_low >> 32,
                                          static_cast<std::uint64_t>(drawn.volume_high),
                                          drawn.cut_voxels,
                                          drawn.below_zero,
                                          drawn.above_one,
                                          drawn.open_rows,
                                          drawn.cell_records,
                                          drawn.lost_centroids};
        MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_UINT64_T, MPI_SUM, all_.comm());
        const std::uint64_t upper = sums[1] + (sums[0] >> 32);
        all.volume_low = upper << 32 | (sums[0] & 0xffffffffu);
        all.volume_high = static_cast<std::int64_t>(sums[2] + (upper >> 32));
        all.cut_voxels = sums[3];
        all.below_zero = sums[4];
        all.above_one = sums[5];
        all.open_rows = sums[6];
        all.cell_records = sums[7];
        all.lost_centroids = sums[8];
    }

    detail::ranks all_;
    Backend& backend_;
    grid grid_;
    VertexShader shader_;
    stream_options options_;
    bin_memory<record_type> memory_;
    std::vector<bin<record_type>> mine_; // one
    histogram counts_of_layers_;
    std::optional<solid_repairs> repairs_; // of this rank's triangles, until they are drawn
    counters counts_;
    status failed_; // what add() returned or threw first
    std::exception_ptr thrown_;
    std::uint64_t num_triangles_ = 0;
    plan plan_;
    list_offset before_;
};

} // namespace voxelpipe::slabs
