// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The slabs of a stream that are to be drawn, with their triangles: one after the other, each read while the one before
// is drawn, and cut again where it is too large.

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/slabs/slab_arrays.hpp>
#include <voxelpipe/slabs/stream_options.hpp>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs::detail {

// Bytes of a slab, and how many one may have.
struct slab_costs {
    double triangle, voxel, limit;
    [[nodiscard]] double of(const glm::ivec3& extent, std::uint64_t num_triangles) const {
        return triangle * static_cast<double>(num_triangles) +
               voxel * static_cast<double>(extent.x) * extent.y * extent.z;
    }
};
// voxel_bytes: what targets take. share: of the memory.
template <class Varyings>
[[nodiscard]] slab_costs costs_of(const stream_options& options, double voxel_bytes, double share) {
    // Twice a mesh of positions, varyings, indices and number, since the next slab's is read meanwhile, and a copy of
    // both for backends with a memory of their own.
    constexpr double mesh =
        3 * sizeof(glm::vec3) + sizeof(glm::uvec3) + 4 + (std::is_empty_v<Varyings> ? 0.0 : 3.0 * sizeof(Varyings));
    // Snapped positions, varyings and tile pairs of cpu_backend.
    constexpr double work = 3 * 24 + (std::is_empty_v<Varyings> ? 0.0 : 3.0 * sizeof(Varyings)) + 48;
    return {2 * sizeof(record<Varyings>) + 2 * mesh + (options.triangle_bytes > 0 ? options.triangle_bytes : work),
            options.voxel_bytes > 0 ? options.voxel_bytes : voxel_bytes, share * static_cast<double>(options.memory)};
}

template <class Varyings>
class slab_queue {
public:
    using record_type = record<Varyings>;
    using arrays = slab_arrays<Varyings>;
    struct entry {
        grid where;
        bin<record_type> triangles;
        bool is_cut = false;         // a part of a slab that was too large, whose triangles have memory of their own
        std::future<arrays> loading; // begun while another slab is drawn
    };

    // Refers to the options. last_axis: slabs are cut along `axis` first, then along z, y, x, no further than this one.
    void start(const stream_options& options, unsigned threads, int axis, int last_axis) {
        options_ = &options;
        threads_ = threads;
        axis_ = axis;
        last_axis_ = last_axis;
    }
    void push_back(const grid& where, bin<record_type>&& triangles) {
        slabs_.push_back({where, std::move(triangles), false, {}});
    }

    // Calls work(entry, its triangles) for each slab, in order, which returns a status. One that exceeds the costs, or
    // runs out of memory, is cut. keeps: slabs stay, for another time. Returns the first other failure.
    template <class Work>
    [[nodiscard]] status for_each(const slab_costs& cost, bool keeps, const Work& work) {
        std::deque<entry> done;
        while (!slabs_.empty()) {
            entry& next = slabs_.front();
            const double bytes = cost.of(next.where.extent, next.triangles.size());
            if (bytes > cost.limit && cut_front(cost, cost.limit)) continue;
            status result;
            try {
                arrays triangles = next.loading.valid() ? next.loading.get() : arrays(next.triangles, threads_);
                begin_loading(cost);
                result = work(std::as_const(next), std::move(triangles));
            } catch (const std::bad_alloc&) {
                result = core::failure(status_code::out_of_memory);
            }
            if (result.code == status_code::out_of_memory && cut_front(cost, bytes / 2)) continue;
            if (!result.ok()) return result;
            if (keeps) {
                if (next.is_cut && next.triangles.in_memory() != 0) {
                    if (kept_ == nullptr) kept_ = std::make_shared<scratch_file>(options_->folder);
                    next.triangles.spill(kept_).write();
                }
                done.push_back(std::move(next));
            }
            slabs_.pop_front();
        }
        slabs_ = std::move(done);
        return {};
    }

private:
    // Reads the slab behind the first one from its file, if it will be drawn as it is.
    void begin_loading(const slab_costs& cost) {
        if (slabs_.size() < 2) return;
        entry& next = slabs_[1];
        if (next.loading.valid() || next.triangles.in_file() == 0 ||
            cost.of(next.where.extent, next.triangles.size()) > cost.limit)
            return;
        next.loading = std::async(
            std::launch::async, [&next, threads = std::min(4u, threads_)] { return arrays(next.triangles, threads); });
    }

    // Replaces the first slab by parts whose costs are at most `limit`, two at least. False if it cannot be cut.
    [[nodiscard]] bool cut_front(const slab_costs& cost, double limit) {
        const stream_options& options = *options_;
        entry whole = std::move(slabs_.front());
        const int step = std::max(1, options.align);
        int axis = axis_;
        for (const int a : {axis_, 2, 1, 0}) {
            if (a < last_axis_) break;
            axis = a;
            if (whole.where.extent[a] > step) break;
        }
        if (whole.where.extent[axis] <= step) {
            slabs_.front() = std::move(whole);
            return false;
        }
        const glm::ivec3 extent = whole.where.extent;
        const core::snap_transform snap = core::make_snap_transform(whole.where);
        const auto reach_of = [&, how = options.binning(whole.where)](const record_type& r) {
            return how(snap, extent, r.positions).reach;
        };
        histogram counts(extent);
        whole.triangles.for_each_block([&](std::span<const record_type> block) {
            for (const record_type& r : block)
                if (const core::voxel_box reach = reach_of(r); !reach.empty()) counts.add(reach);
        });
        plan_options how;
        how.align = step;
        const double layer = static_cast<double>(extent.x) * extent.y * extent.z / extent[axis] * cost.voxel;
        how.triangle_cost = static_cast<std::uint64_t>(cost.triangle);
        how.layer_cost = static_cast<std::uint64_t>(layer);
        plan parts = cover(counts, axis, static_cast<std::uint64_t>(std::max(1.0, limit)), how);
        if (parts.slabs.size() < 2) parts = equal_layers(whole.where, axis, 2, step);
        // Triangles that reach most of the slab would be in most of the parts, which makes nothing smaller.
        if (parts.triangles_cut > parts.triangles) parts = equal_layers(whole.where, axis, 2, step);

        std::vector<bin<record_type>> bins(parts.slabs.size());
        bin_memory<record_type> memory(options.memory / 8, bins.size(), options.folder);
        whole.triangles.for_each_block([&](std::span<const record_type> block) {
            for (const record_type& r : block) {
                const core::voxel_box reach = reach_of(r);
                if (reach.empty()) continue;
                for (std::size_t i = 0; i < bins.size(); ++i)
                    if (reach.lo[axis] < parts.slabs[i].end && reach.hi[axis] >= parts.slabs[i].begin)
                        memory.push(bins, i, r);
            }
        });
        slabs_.pop_front();
        for (std::size_t i = bins.size(); i-- > 0;)
            slabs_.push_front({parts.crop(whole.where, i), std::move(bins[i]), true, {}});
        return true;
    }

    const stream_options* options_ = nullptr;
    unsigned threads_ = 1;
    int axis_ = 2, last_axis_ = 0;
    std::deque<entry> slabs_;
    std::shared_ptr<scratch_file> kept_; // for parts of slabs that were cut and stay; none yet
};

} // namespace voxelpipe::slabs::detail
