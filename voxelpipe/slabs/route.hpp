// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sends the triangles of a chunk to the bins of the slabs that they reach, by threads. Each thread classifies a share
// of the triangles and sorts it by slab; then each bin takes its parts of all shares in order. So a bin has the bytes
// that one thread would give it.

#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/triangle_counts.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::slabs::detail {

// The slab of each layer of an axis.
struct slab_table {
    int axis = 2;
    std::vector<std::uint32_t> of_layer;

    // First and last.
    [[nodiscard]] std::array<std::uint32_t, 2> operator()(const core::voxel_box& reach) const {
        return {of_layer[static_cast<std::size_t>(reach.lo[axis])], of_layer[static_cast<std::size_t>(reach.hi[axis])]};
    }
};

template <class Record>
class chunk_router {
    static constexpr std::size_t least = 8192, most = 65536; // triangles of a thread's share

public:
    // memory: bytes that shares may take; with less than two of them need, one thread does the work.
    chunk_router(unsigned threads, std::uint64_t memory)
        : num_shares_(static_cast<std::size_t>(
              std::clamp<std::uint64_t>(memory / (least * bytes_of_triangle), 1, std::max(1u, threads)))),
          share_(static_cast<std::size_t>(
              std::clamp<std::uint64_t>(memory / num_shares_ / bytes_of_triangle, least, most))) {}

    // All `count` triangles of the chunk, which are added to the counts. After a failure the triangles before the bad
    // one are in their bins.
    template <class Chunk>
    [[nodiscard]] status route(const Chunk& chunk, std::size_t count, const slab_table& slabs,
                               std::vector<bin<Record>>& bins, bin_memory<Record>& memory, counters& counts) {
        if (num_shares_ == 1 || count < 2 * least)
            return chunk.visit(0, count, counts, [&](const Record& r, const core::voxel_box& reach) {
                const auto [first, last] = slabs(reach);
                for (std::uint32_t s = first; s <= last; ++s) memory.push(bins, s, r);
            });
        shares_.resize(num_shares_);
        for (std::size_t first = 0; first < count;) {
            const std::size_t batch = std::min(count - first, num_shares_ * share_),
                              used = std::min(num_shares_, (batch + least - 1) / least),
                              each = (batch + used - 1) / used;
            core::parallel_for(static_cast<unsigned>(used), used, [&](unsigned, std::size_t i) {
                const std::size_t begin = first + std::min(batch, i * each),
                                  end = first + std::min(batch, (i + 1) * each);
                shares_[i].fill(chunk, begin, end, slabs, bins.size());
            });
            std::size_t good = 0; // shares up to the first failure
            while (good < used && shares_[good].result.ok()) ++good;
            const status result = good < used ? shares_[good].result : status{};
            good = std::min(used, good + 1);
            std::vector<std::uint64_t> taken(used);
            core::parallel_for(static_cast<unsigned>(used), bins.size(), [&](unsigned worker, std::size_t b) {
                for (std::size_t i = 0; i < good; ++i) taken[worker] += memory.append(bins[b], shares_[i].of(b));
            });
            std::uint64_t all = 0;
            for (const std::uint64_t t : taken) all += t;
            memory.settle(bins, all);
            for (std::size_t i = 0; i < good; ++i) core::add_triangles(counts, shares_[i].counts);
            if (!result.ok()) return result;
            first += batch;
        }
        return {};
    }

private:
    static constexpr std::uint64_t bytes_of_triangle = 2 * sizeof(Record) + sizeof(std::array<std::uint32_t, 2>);

    struct share {
        status result;
        counters counts;
        std::vector<Record> records, sorted;
        std::vector<std::array<std::uint32_t, 2>> reaches; // slabs, by record
        std::vector<std::size_t> ends;                     // in `sorted`, by slab

        template <class Chunk>
        void fill(const Chunk& chunk, std::size_t first, std::size_t last, const slab_table& slabs,
                  std::size_t num_slabs) {
            counts = {};
            records.clear();
            reaches.clear();
            ends.assign(num_slabs, 0);
            result = chunk.visit(first, last, counts, [&](const Record& r, const core::voxel_box& reach) {
                records.push_back(r);
                reaches.push_back(slabs(reach));
                for (std::uint32_t s = reaches.back()[0]; s <= reaches.back()[1]; ++s) ++ends[s];
            });
            std::size_t sum = 0;
            for (std::size_t& e : ends) sum += std::exchange(e, sum);
            sorted.resize(sum);
            for (std::size_t i = 0; i < records.size(); ++i)
                for (std::uint32_t s = reaches[i][0]; s <= reaches[i][1]; ++s) sorted[ends[s]++] = records[i];
        }
        // Those that reach a slab.
        [[nodiscard]] std::span<const Record> of(std::size_t slab) const {
            const std::size_t first = slab == 0 ? 0 : ends[slab - 1];
            return std::span<const Record>(sorted).subspan(first, ends[slab] - first);
        }
    };

    std::size_t num_shares_, share_;
    std::vector<share> shares_; // kept for their memory
};

} // namespace voxelpipe::slabs::detail
