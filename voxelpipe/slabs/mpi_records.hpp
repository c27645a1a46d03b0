// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sends triangles to the ranks of an MPI communicator whose slabs they reach, in rounds of limited memory.

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/mpi_ranks.hpp>
#include <voxelpipe/slabs/plan.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace voxelpipe::slabs::detail {

// Records that a rank sends to another one in a round. So many from all ranks fit `memory` bytes, or are 16 from each.
[[nodiscard]] inline std::uint64_t records_of_round(std::uint64_t memory, std::size_t record_bytes, std::size_t ranks) {
    return std::clamp<std::uint64_t>(memory / record_bytes / ranks, 16,
                                     std::max<std::uint64_t>(16, (std::uint64_t{1} << 22) / ranks));
}

// `mine`, which is empty afterwards, goes to the ranks whose slabs it reaches, with `base` added to the numbers. Comes
// to `received`, a bin for each rank that sends, so that numbers ascend when they are joined. reach_of(record): its
// layers along the plan's axis, as a layer_range. memory: bytes of what is received, and as much again of what is on
// its way. folder: for what is beyond. Returns early if a rank has failed. Every rank.
template <class Record, class Reach>
void exchange_records(const ranks& all, const plan& slabs, std::uint32_t base, bin<Record>& mine,
                      std::vector<bin<Record>>& received, std::uint64_t memory, const std::string& folder,
                      shared_work& work, const Reach& reach_of) {
    const std::uint64_t total = mine.size(), most = std::min(records_of_round(memory / 2, sizeof(Record), all.size()),
                                                             std::max<std::uint64_t>(1, total));
    constexpr std::uint64_t most_read = std::max<std::uint64_t>(1, (std::uint64_t{4} << 20) / sizeof(Record));
    std::optional<bin_memory<Record>> held;
    std::vector<std::uint32_t> rank_of; // by layer
    parcels<Record> out, in;
    work([&] {
        held.emplace(memory, all.size(), folder);
        for (std::size_t r = 0; r < all.size(); ++r)
            rank_of.insert(rank_of.end(), static_cast<std::size_t>(slabs.slabs[r].size()),
                           static_cast<std::uint32_t>(r));
        received.resize(all.size());
        out.counts.resize(all.size());
        out.elements.resize(static_cast<std::size_t>(most) * all.size());
        for (std::size_t r = 0; r < all.size(); ++r)
            out.firsts.push_back(as_count(static_cast<std::uint64_t>(r) * most));
    });
    std::vector<Record> read;
    std::uint64_t have_read = 0;
    std::size_t at = 0; // in `read`
    bool goes_on = true;
    while (goes_on) {
        bool is_full = false;
        work([&] {
            std::fill(out.counts.begin(), out.counts.end(), 0);
            while (!is_full) {
                if (at == read.size()) {
                    if (have_read == total) break;
                    read.resize(static_cast<std::size_t>(std::min(most_read, total - have_read)));
                    mine.copy(have_read, read);
                    have_read += read.size();
                    at = 0;
                }
                Record r = read[at++];
                r.number += base;
                const layer_range reach = reach_of(r);
                const std::uint32_t last = rank_of[static_cast<std::size_t>(reach.end - 1)];
                for (std::uint32_t to = rank_of[static_cast<std::size_t>(reach.begin)]; to <= last; ++to) {
                    out.elements[static_cast<std::size_t>(out.firsts[to]) +
                                 static_cast<std::size_t>(out.counts[to]++)] = r;
                    is_full |= static_cast<std::uint64_t>(out.counts[to]) == most;
                }
            }
        });
        if (!all_to_all(all, 1, out, in, work)) return;
        work([&] {
            for (std::size_t from = 0; from < all.size(); ++from)
                for (int i = 0; i < in.counts[from]; ++i)
                    held->push(received, from,
                               in.elements[static_cast<std::size_t>(in.firsts[from]) + static_cast<std::size_t>(i)]);
        });
        goes_on = all.any(at != read.size() || have_read != total);
    }
    mine = {};
}

} // namespace voxelpipe::slabs::detail
