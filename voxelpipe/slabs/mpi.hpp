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
        : comm_(comm), backend_(backend), grid_(g), shader_(shader), options_(std::move(options)),
          memory_(options_.memory / 4, 1, options_.folder), mine_(1) {
        if (const status s = validate(g); !s.ok()) throw std::invalid_argument("voxelpipe::slabs: " + s.message());
        repairs_.emplace(g, options_.repair, options_.memory / 8, options_.folder, 1);
        options_.num_slabs = 1;
        counts_of_layers_ = histogram(g.extent);
        MPI_Comm_rank(comm_, &rank_);
        MPI_Comm_size(comm_, &num_ranks_);
    }

    // Adds triangles of host memory. In the whole mesh, those of a lower rank come first, and each rank's in the order
    // in which it adds them. As stream::add; draw() fails on every rank if it failed on one.
    [[nodiscard]] status add(const Mesh& chunk) {
        counters added;
        const chunk_records<varyings, Mesh> records(chunk, shader_, grid_, options_.binning(), num_triangles_);
        status s = records.valid();
        if (s.ok() && repairs_->needs_triangles())
            records.visit_snapped([&](const auto& a, const auto& b, const auto& c) { repairs_->add(a, b, c); });
        if (s.ok())
            s = records.visit(0, chunk.triangles.size(), added, [&](const record_type& r, const auto& reach) {
                counts_of_layers_.add(reach);
                memory_.push(mine_, 0, r);
            });
        core::add_triangles(counts_, added);
        if (s.ok())
            num_triangles_ += chunk.part.whole != 0 ? chunk.part.whole : chunk.triangles.size();
        else if (failed_.ok())
            failed_ = s;
        return s;
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

    // After draw(): the slabs, by rank.
    [[nodiscard]] const plan& slabs() const { return plan_; }
    // Where the lists of a rank begin among those of all.
    struct list_offset {
        std::uint64_t voxels = 0, fragments = 0; // of the ranks below
    };
    // After draw(): of this rank.
    [[nodiscard]] list_offset lists_before() const { return before_; }

private:
    // solid: its options, or null.
    template <class Draw>
    [[nodiscard]] status draw_with(bool may_turn, const solid_options* solid, const Draw& draw) {
        status own = failed_;
        std::exception_ptr thrown;
        // Runs work() on this rank; whatever goes wrong is kept until all ranks know.
        const auto attempt = [&](const auto& work) {
            if (!own.ok() || thrown) return;
            try {
                work();
            } catch (const std::bad_alloc&) {
                own = core::failure(status_code::out_of_memory);
            } catch (...) {
                thrown = std::current_exception();
            }
        };
        const auto all_ok = [&] { return agree(own, thrown); };

        std::uint64_t base = 0, total = 0;
        MPI_Exscan(&num_triangles_, &base, 1, MPI_UINT64_T, MPI_SUM, comm_);
        if (rank_ == 0) base = 0; // MPI leaves it undefined
        MPI_Allreduce(&num_triangles_, &total, 1, MPI_UINT64_T, MPI_SUM, comm_);
        if (own.ok() && total > std::numeric_limits<std::uint32_t>::max())
            own = core::failure(status_code::too_many_triangles);
        if (!all_ok()) return finish(own, thrown);

        MPI_Allreduce(MPI_IN_PLACE, counts_of_layers_.words().data(),
                      static_cast<int>(counts_of_layers_.words().size()), MPI_UINT64_T, MPI_SUM, comm_);
        plan_options how;
        how.align = options_.align;
        how.may_turn = may_turn;
        plan_ = split(counts_of_layers_, num_ranks_, how);

        // One bin for each rank that sends, so that numbers ascend when they are joined.
        std::vector<bin<record_type>> received(static_cast<std::size_t>(num_ranks_));
        exchange(static_cast<std::uint32_t>(base), received, attempt);
        if (!all_ok()) return finish(own, thrown);
        core::hole_cones cones;
        if (solid != nullptr && repairs_->holes()) join_holes(cones, solid->max_hole_edges, own, attempt);
        if (solid != nullptr && repairs_->columns()) join_columns(received, attempt, all_ok);
        if (!all_ok()) return finish(own, thrown);

        const bool floods = solid != nullptr && solid->repair == repair::exterior;
        std::optional<record_stream<Backend, varyings>> stream; // none if there is no layer
        attempt([&] {
            if (plan_.slabs[static_cast<std::size_t>(rank_)].size() == 0) return;
            stream.emplace(backend_, plan_.crop(grid_, static_cast<std::size_t>(rank_)), options_);
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
            if (floods) own = stream->find_walls(*solid);
        });
        if (!all_ok()) return finish(own, thrown);
        if (floods) {
            slab_exterior* const part = stream ? &*stream->repairs().exterior() : nullptr;
            detail::rank_flood(comm_, grid_.extent, solid->closing, plan_).run(part, attempt, all_ok);
            if (!all_ok()) return finish(own, thrown);
        }
        status drawn;
        attempt([&] {
            if (stream) drawn = draw(*stream);
            if (!drawn.ok()) own = drawn;
        });
        if (!all_ok()) return finish(own, thrown);
        return add_up(drawn);
    }

    // Sends each record to the ranks whose slabs it reaches, a block at a time.
    template <class Attempt>
    void exchange(std::uint32_t base, std::vector<bin<record_type>>& received, const Attempt& attempt) {
        const auto n = static_cast<std::size_t>(num_ranks_);
        std::vector<std::uint32_t> rank_of(static_cast<std::size_t>(grid_.extent[plan_.axis]));
        for (std::size_t r = 0; r < n; ++r)
            std::fill_n(rank_of.begin() + plan_.slabs[r].begin, plan_.slabs[r].size(), static_cast<std::uint32_t>(r));
        bin_memory<record_type> memory(options_.memory / 4, n, options_.folder);
        MPI_Datatype type;
        MPI_Type_contiguous(static_cast<int>(sizeof(record_type)), MPI_BYTE, &type);
        MPI_Type_commit(&type);
        std::vector<std::vector<record_type>> outgoing(n);
        std::uint64_t waiting = 0;
        const std::uint64_t most = std::clamp<std::uint64_t>(options_.memory / 8 / sizeof(record_type), 64, 1u << 22);

        // A round sends what waits. It goes on until no rank has anything left.
        const auto round = [&](bool last) {
            std::vector<record_type> out, in;
            std::vector<int> sent(n), coming(n), out_at(n), in_at(n);
            for (std::size_t r = 0; r < n; ++r) {
                out_at[r] = static_cast<int>(out.size());
                sent[r] = static_cast<int>(outgoing[r].size());
                out.insert(out.end(), outgoing[r].begin(), outgoing[r].end());
                outgoing[r].clear();
            }
            waiting = 0;
            MPI_Alltoall(sent.data(), 1, MPI_INT, coming.data(), 1, MPI_INT, comm_);
            std::size_t arrive = 0;
            for (std::size_t r = 0; r < n; ++r) {
                in_at[r] = static_cast<int>(arrive);
                arrive += static_cast<std::size_t>(coming[r]);
            }
            // No rank sends unless all have room.
            attempt([&] { in.resize(arrive); });
            if (!have_all(in.size() == arrive)) return false;
            MPI_Alltoallv(out.data(), sent.data(), out_at.data(), type, in.data(), coming.data(), in_at.data(), type,
                          comm_);
            attempt([&] {
                for (std::size_t r = 0; r < n; ++r)
                    for (int i = 0; i < coming[r]; ++i)
                        memory.push(received, r, in[static_cast<std::size_t>(in_at[r]) + static_cast<std::size_t>(i)]);
            });
            int left = last ? 0 : 1;
            MPI_Allreduce(MPI_IN_PLACE, &left, 1, MPI_INT, MPI_MAX, comm_);
            return left != 0;
        };
        const core::snap_transform snap = core::make_snap_transform(grid_);
        bool goes_on = true;
        attempt([&] {
            mine_[0].for_each_block([&](std::span<const record_type> block) {
                for (record_type r : block) {
                    if (!goes_on) return;
                    const core::voxel_box reach = reach_of(snap, grid_.extent, r);
                    const std::uint32_t first = rank_of[static_cast<std::size_t>(reach.lo[plan_.axis])],
                                        last = rank_of[static_cast<std::size_t>(reach.hi[plan_.axis])];
                    r.number += base;
                    for (std::uint32_t to = first; to <= last; ++to) outgoing[to].push_back(r);
                    waiting += last - first + 1;
                    if (waiting >= most) goes_on = round(false);
                }
            });
        });
        while (goes_on) goes_on = round(true);
        mine_[0] = {};
        MPI_Type_free(&type);
    }

    // The cones of the whole mesh, in the grid's numbers, from the edges that are left on each rank. Every rank.
    template <class Attempt>
    void join_holes(core::hole_cones& cones, std::uint64_t max_hole_edges, status& own, const Attempt& attempt) {
        using edge = hole_finder::edge;
        const auto n = static_cast<std::size_t>(num_ranks_);
        std::vector<edge> mine, all;
        attempt([&] { mine = repairs_->holes()->take_edges(); });
        repairs_->holes().reset();
        std::vector<std::uint64_t> sizes(n);
        const std::uint64_t size = mine.size();
        MPI_Allgather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, comm_);
        std::vector<int> counts(n), firsts(n);
        std::uint64_t sum = 0;
        for (std::size_t r = 0; r < n; ++r) {
            firsts[r] = static_cast<int>(sum);
            counts[r] = static_cast<int>(sizes[r]);
            sum += sizes[r];
        }
        attempt([&] {
            if (sum > std::numeric_limits<int>::max()) throw std::bad_alloc(); // MPI counts by int
            all.resize(static_cast<std::size_t>(sum));
        });
        if (!have_all(all.size() == sum)) return;
        MPI_Datatype type;
        MPI_Type_contiguous(static_cast<int>(sizeof(edge)), MPI_BYTE, &type);
        MPI_Type_commit(&type);
        MPI_Allgatherv(mine.data(), static_cast<int>(size), type, all.data(), counts.data(), firsts.data(), type,
                       comm_);
        MPI_Type_free(&type);
        mine = {};
        attempt([&] {
            hole_finder::cancel(all);
            try {
                cones = hole_finder::close(all, max_hole_edges);
            } catch (const std::length_error&) {
                own = core::failure(status_code::too_many_triangles, stage::coarse_raster);
            }
        });
    }

    // The columns of this rank's slab: those of all triangles, less what crosses them in the slabs of the ranks below.
    // Every rank.
    template <class Attempt, class AllOk>
    void join_columns(const std::vector<bin<record_type>>& received, const Attempt& attempt, const AllOk& all_ok) {
        std::optional<column_sweep> mine; // of the slab alone
        attempt([&] {
            mine.emplace(grid_);
            mine->begin(plan_.slabs[static_cast<std::size_t>(rank_)]);
            for (const bin<record_type>& from : received)
                detail::for_each_snapped(from, grid_,
                                         [&](const auto& a, const auto& b, const auto& c) { mine->pass(a, b, c); });
            mine->end();
        });
        if (!all_ok()) return;
        column_sweep& all = *repairs_->columns();
        const std::span<std::uint64_t> slab = mine->below(), below = all.below();
        for_each_part(all.open(), [&](std::uint64_t* words, int count) {
            MPI_Allreduce(MPI_IN_PLACE, words, count, MPI_UINT64_T, MPI_BXOR, comm_);
        });
        for_each_part(below, [&](std::uint64_t* words, int count) {
            MPI_Allreduce(MPI_IN_PLACE, words, count, MPI_UINT64_T, MPI_BXOR, comm_);
        });
        for_each_part(slab, [&](std::uint64_t* words, int count) {
            MPI_Exscan(MPI_IN_PLACE, words, count, MPI_UINT64_T, MPI_BXOR, comm_);
        });
        if (rank_ != 0) // where MPI leaves it undefined
            for (std::size_t i = 0; i < below.size(); ++i) below[i] ^= slab[i];
    }
    template <class F>
    static void for_each_part(std::span<std::uint64_t> words, const F& f) {
        constexpr std::size_t most = std::size_t{1} << 30; // MPI counts by int
        for (std::size_t first = 0; first < words.size(); first += most)
            f(words.data() + first, static_cast<int>(std::min(most, words.size() - first)));
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
        return options_.binning()(snap, extent, r.positions).reach;
    }

    // True if it is true on every rank. Every rank.
    [[nodiscard]] bool have_all(bool has) const {
        int all = has ? 1 : 0;
        MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, comm_);
        return all != 0;
    }
    // True if no rank has failed. Every rank.
    [[nodiscard]] bool agree(const status& own, const std::exception_ptr& thrown) const {
        return have_all(own.ok() && !thrown);
    }
    [[nodiscard]] static status finish(const status& own, const std::exception_ptr& thrown) {
        if (thrown) std::rethrow_exception(thrown);
        return own.ok() ? core::failure(status_code::other_rank_failed) : own;
    }

    // The counts of all ranks, and those of the ranks below. Every rank.
    [[nodiscard]] status add_up(const status& drawn) {
        const std::array<std::uint64_t, 2> own{drawn.counts.voxels, drawn.counts.fragments};
        std::array<std::uint64_t, 2> below{};
        MPI_Exscan(own.data(), below.data(), 2, MPI_UINT64_T, MPI_SUM, comm_);
        if (rank_ == 0) below = {};
        before_ = {below[0], below[1]};
        std::array<std::uint64_t, 11> sums{counts_.triangles_in,      counts_.triangles_nonfinite,
                                           counts_.triangles_too_far, counts_.triangles_zero_area,
                                           counts_.triangles_outside, counts_.triangles_drawn,
                                           drawn.counts.fragments,    drawn.counts.fragments_discarded,
                                           drawn.counts.voxels,       drawn.solid.open_rows,
                                           drawn.solid.crossings};
        MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_UINT64_T, MPI_SUM, comm_);
        status all;
        all.counts = {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], sums[7], sums[8]};
        all.solid.open_rows = sums[9];
        all.solid.crossings = sums[10];
        // Holes are those of the whole mesh on every rank that has a slab.
        std::array<std::uint64_t, 4> most{drawn.solid.max_winding, drawn.solid.hole_edges, drawn.solid.holes,
                                          drawn.solid.cones};
        MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(most.size()), MPI_UINT64_T, MPI_MAX, comm_);
        all.solid.max_winding = most[0];
        all.solid.hole_edges = most[1];
        all.solid.holes = most[2];
        all.solid.cones = most[3];
        return all;
    }
    MPI_Comm comm_;
    Backend& backend_;
    grid grid_;
    VertexShader shader_;
    stream_options options_;
    bin_memory<record_type> memory_;
    std::vector<bin<record_type>> mine_; // one
    histogram counts_of_layers_;
    std::optional<solid_repairs> repairs_; // of this rank's triangles, until they are drawn
    counters counts_;
    status failed_;
    std::uint64_t num_triangles_ = 0;
    int rank_ = 0, num_ranks_ = 1;
    plan plan_;
    list_offset before_;
};

} // namespace voxelpipe::slabs
