// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the parts of slabs/mpi.hpp share: the ranks of a communicator, work that fails on all of them if it fails on
// one, and an exchange of elements between all. A rank that fails takes part in every call of MPI until all of them
// know, so none waits for it. MPI counts by int; as_count and for_each_part keep counts below that.

#ifndef MPICH_SKIP_MPICXX
#define MPICH_SKIP_MPICXX 1
#endif
#ifndef OMPI_SKIP_MPICXX
#define OMPI_SKIP_MPICXX 1
#endif
#include <mpi.h>

#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs::detail {

// A count for MPI. Throws std::bad_alloc for one that is too large.
[[nodiscard]] inline int as_count(std::uint64_t n) {
    if (n > static_cast<std::uint64_t>(std::numeric_limits<int>::max())) throw std::bad_alloc();
    return static_cast<int>(n);
}

// Calls f(first word, count) for parts of the words, in order.
template <class Word, class F>
void for_each_part(std::span<Word> words, const F& f) {
    constexpr std::size_t most = std::size_t{1} << 30;
    for (std::size_t first = 0; first < words.size(); first += most)
        f(words.data() + first, static_cast<int>(std::min(most, words.size() - first)));
}

// The ranks of a communicator, which it refers to.
class ranks {
public:
    explicit ranks(MPI_Comm comm) : comm_(comm) {
        MPI_Comm_rank(comm, &me_);
        MPI_Comm_size(comm, &size_);
    }
    [[nodiscard]] MPI_Comm comm() const { return comm_; }
    [[nodiscard]] int me() const { return me_; }
    [[nodiscard]] std::size_t index() const { return static_cast<std::size_t>(me_); }
    [[nodiscard]] int count() const { return size_; }
    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(size_); }

    // True if it is true on some rank. Every rank.
    [[nodiscard]] bool any(bool mine) const {
        int all = mine ? 1 : 0;
        MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MAX, comm_);
        return all != 0;
    }

private:
    MPI_Comm comm_;
    int me_ = 0, size_ = 1;
};

// One rank's part of a call that fails on every rank if it fails on one.
class shared_work {
public:
    // own, thrown: a failure of this rank before the call, if there is one.
    shared_work(const ranks& all, const status& own, std::exception_ptr thrown)
        : all_(all), own_(own), thrown_(std::move(thrown)) {}

    // Runs work() unless this rank has failed. Keeps what it throws, and a failure if it returns a status.
    template <class Work>
    void operator()(const Work& work) {
        if (has_failed()) return;
        try {
            if constexpr (std::is_same_v<decltype(work()), status>) {
                own_ = work();
            } else {
                work();
            }
        } catch (const std::bad_alloc&) {
            own_ = core::failure(status_code::out_of_memory);
        } catch (...) {
            thrown_ = std::current_exception();
        }
    }
    // True if no rank has failed. Every rank.
    [[nodiscard]] bool all_ok() const { return !all_.any(has_failed()); }
    // After a failure on some rank: this one's own, or other_rank_failed. Throws what this rank has thrown.
    [[nodiscard]] status failure() const {
        if (thrown_) std::rethrow_exception(thrown_);
        return own_.ok() ? core::failure(status_code::other_rank_failed) : own_;
    }

private:
    [[nodiscard]] bool has_failed() const { return !own_.ok() || thrown_; }

    const ranks& all_;
    status own_;
    std::exception_ptr thrown_;
};

// What goes to each rank, or comes from it: units of several elements, `counts` units from `firsts` on.
template <class T>
struct parcels {
    std::vector<T> elements;
    std::vector<int> counts, firsts; // by rank
};

// Sends each rank its parcel; units have `unit` elements. The memory of `in` is used again. False if a rank has failed,
// then nothing was sent. Every rank.
template <class T>
[[nodiscard]] bool all_to_all(const ranks& all, std::size_t unit, const parcels<T>& out, parcels<T>& in,
                              shared_work& work) {
    static_assert(std::is_trivially_copyable_v<T>);
    int unit_count = 0;
    work([&] {
        unit_count = as_count(unit);
        in.counts.resize(all.size());
        in.firsts.resize(all.size());
    });
    if (!work.all_ok()) return false;
    MPI_Alltoall(out.counts.data(), 1, MPI_INT, in.counts.data(), 1, MPI_INT, all.comm());
    work([&] {
        std::uint64_t units = 0;
        for (std::size_t from = 0; from < all.size(); ++from) {
            in.firsts[from] = as_count(units);
            units += static_cast<std::uint64_t>(in.counts[from]);
        }
        in.elements.resize(static_cast<std::size_t>(as_count(units)) * unit);
    });
    if (!work.all_ok()) return false;
    MPI_Datatype element, type;
    MPI_Type_contiguous(static_cast<int>(sizeof(T)), MPI_BYTE, &element);
    MPI_Type_contiguous(unit_count, element, &type);
    MPI_Type_commit(&type);
    MPI_Alltoallv(out.elements.data(), out.counts.data(), out.firsts.data(), type, in.elements.data(), in.counts.data(),
                  in.firsts.data(), type, all.comm());
    MPI_Type_free(&type);
    MPI_Type_free(&element);
    return true;
}

} // namespace voxelpipe::slabs::detail
