// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// One rank of several runs out of memory, or finds no folder for its files, wherever it has got to: the call fails on
// every rank, with this one's failure there. A rank that is left waiting for another ends the test by its time limit.

#include "../robustness/counted_allocations.hpp"
#include "broken_scene.hpp"
#include "rank_scene.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

namespace {

using namespace slab_scene;
using vp::status_code;
using stream_type = slabs::mpi_stream<backend_type, vp::passthrough>;

bool is_last() { return my_rank() == num_ranks() - 1; }

// Each phase of a call belongs to one of these: exchange, holes, columns, walls, rounds of a flood, layers of others.
const std::vector<vp::solid_options>& repairs() {
    static const std::vector<vp::solid_options> all{{},
                                                    {.repair = vp::repair::close_holes},
                                                    {.repair = vp::repair::vote},
                                                    {.repair = vp::repair::exterior},
                                                    {.repair = vp::repair::exterior, .closing = 2}};
    return all;
}

const glm::ivec3 small(21, 15, 22);

struct failing_call {
    unit::small_mesh mesh = broken_scene(small);
    backend_type backend = unit::make_backend(1);
    slabs::stream_options options;
    vp::solid_options how;

    explicit failing_call(const vp::solid_options& how_, std::uint64_t memory = std::uint64_t{1} << 30)
        : options(options_for(how_, 0, memory)), how(how_) {
        options.threads = 1;
    }
    vp::status draw(stream_type& stream) {
        return stream.draw_solid(
            winding{},
            [&](glm::ivec3 size) {
                return solid_targets{backend, size};
            },
            [](const slabs::slab&, const solid_targets&) {}, how);
    }
    // With as many allocations as the last rank is granted in draw(). Returns what it has used.
    std::int64_t draw_with(std::int64_t granted, vp::status& result) {
        stream_type stream(MPI_COMM_WORLD, backend, unit::unit_grid(small), {}, options);
        stream.add(share_of(mesh)).or_throw();
        if (is_last()) unit::allocations_left = granted;
        try {
            result = draw(stream);
        } catch (const std::bad_alloc&) {
            ADD_FAILURE() << "an allocation that the other ranks do not hear of";
        }
        return granted - unit::allocations_left.exchange(unit::no_end_of_allocations);
    }
};

// Allocations fail from one of those of a whole call on, each time from another. More ranks than cores take turns of
// milliseconds, so these try fewer.
TEST(RankFailures, MemoryThatRunsOutOnOneRankEndsTheCallOnAll) {
    const int tries = num_ranks() > 2 ? 7 : 40;
    for (const vp::solid_options& how : repairs()) {
        failing_call call(how);
        vp::status result;
        std::int64_t needed = call.draw_with(unit::no_end_of_allocations - 1, result);
        ASSERT_TRUE(result.ok()) << result.message();
        MPI_Bcast(&needed, 1, MPI_INT64_T, num_ranks() - 1, MPI_COMM_WORLD);
        EXPECT_GT(needed, 50);
        int failures = 0;
        for (std::int64_t granted = 0; granted < needed; granted += std::max<std::int64_t>(3, needed / tries)) {
            SCOPED_TRACE("repair " + std::to_string(static_cast<int>(how.repair)) + ", closing " +
                         std::to_string(how.closing) + ", allocation " + std::to_string(granted) + " of " +
                         std::to_string(needed));
            (void)call.draw_with(granted, result);
            const bool ended = !result.ok();
            EXPECT_EQ(sum_of_ranks(ended ? 1 : 0), ended ? static_cast<std::uint64_t>(num_ranks()) : 0u);
            if (!ended) continue; // it did without, such as by cutting a slab again
            ++failures;
            EXPECT_EQ(result.code, is_last() ? status_code::out_of_memory : status_code::other_rank_failed);
        }
        EXPECT_GT(failures, tries / 2);
    }
}

// Of little memory: what a rank receives, its walls and its slab's records go to files.
TEST(RankFailures, AFolderThatOneRankLacksEndsTheCallOnAll) {
    if (num_ranks() == 1) return; // it would fail in add()
    for (const vp::solid_options& how : repairs()) {
        failing_call call(how, 20'000);
        if (is_last()) call.options.folder = "/does/not/exist";
        stream_type stream(MPI_COMM_WORLD, call.backend, unit::unit_grid(small), {}, call.options);
        // The last one reads nothing, so that it fails in the call.
        if (my_rank() == 0) stream.add(call.mesh.view()).or_throw();
        if (is_last())
            EXPECT_THROW((void)call.draw(stream), std::system_error);
        else
            EXPECT_EQ(call.draw(stream).code, status_code::other_rank_failed);
    }
}

// add() throws on one rank, whose program goes on to draw(), for which there is memory again.
TEST(RankFailures, WhatAddThrowsEndsTheCallOnAll) {
    failing_call call({.repair = vp::repair::close_holes});
    stream_type stream(MPI_COMM_WORLD, call.backend, unit::unit_grid(small), {}, call.options);
    if (is_last()) {
        unit::allocations_left = 5;
        try {
            (void)stream.add(call.mesh.view());
        } catch (const std::bad_alloc&) {
        }
        EXPECT_LT(unit::allocations_left.exchange(unit::no_end_of_allocations), 0);
        EXPECT_THROW((void)call.draw(stream), std::bad_alloc);
    } else {
        EXPECT_EQ(call.draw(stream).code, status_code::other_rank_failed);
    }
}

// MPI counts by int: what arrives in a round of the exchange fits, however many ranks there are.
TEST(RankCounts, FitAnInt) {
    constexpr std::uint64_t most = std::numeric_limits<int>::max();
    EXPECT_EQ(slabs::detail::as_count(most), std::numeric_limits<int>::max());
    EXPECT_THROW((void)slabs::detail::as_count(most + 1), std::bad_alloc);
    for (const std::uint64_t memory : {std::uint64_t{0}, std::uint64_t{100'000}, std::uint64_t{1} << 50})
        for (const std::size_t ranks : {1u, 3u, 64u, 1'000u, 1'000'000u}) {
            const std::uint64_t each = slabs::detail::records_of_round(memory, 40, ranks);
            EXPECT_GE(each, 16u);
            EXPECT_LE(each * ranks, most);
            EXPECT_TRUE(each == 16 || each * ranks * 40 <= memory);
        }
    // Words beyond an int go in parts, in order. Nothing is read here.
    std::uint64_t word = 0, sum = 0;
    int parts = 0;
    slabs::detail::for_each_part(std::span<std::uint64_t>(&word, (std::size_t{1} << 32) + 5),
                                 [&](const std::uint64_t* first, int count) {
                                     EXPECT_EQ(static_cast<std::uint64_t>(first - &word), sum);
                                     sum += static_cast<std::uint64_t>(count);
                                     ++parts;
                                 });
    EXPECT_EQ(sum, (std::uint64_t{1} << 32) + 5);
    EXPECT_EQ(parts, 5);
}

} // namespace
