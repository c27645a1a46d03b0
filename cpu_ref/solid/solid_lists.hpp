// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rows of a solid into an A-buffer: a fragment a body, whose number is its draw.

#include <cpu_ref/abuffer_pass.hpp>
#include <cpu_ref/solid/solid_targets.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace voxelpipe::cpu {

template <class Draw, class Payload>
class list_sink final : public row_sink, public list_part<Payload> {
public:
    list_sink(std::span<const Draw> draws, const grid& g, std::uint32_t worker)
        : draws_(draws), grid_(g), tiles_x_((static_cast<std::uint64_t>(g.extent.x) + 31) / 32), worker_(worker) {}

    void add(const row_of_body& r) override {
        const auto& shader = draws_[r.draw].fragment_shader;
        solid_fragment f{};
        f.voxel = grid_.offset + glm::ivec3(0, r.y, r.z);
        f.draw = r.draw;
        const std::size_t before = fragments_.size();
        for_each_voxel(r, [&](int x, std::int64_t winding) {
            f.voxel.x = grid_.offset.x + x;
            f.winding = winding;
            const auto out = shader(f);
            if (!out.keep) {
                ++this->counts.fragments_discarded;
                return;
            }
            if constexpr (has_payload)
                fragments_.push_back({static_cast<std::uint32_t>(x), r.draw, get<0>(out.values)});
            else
                fragments_.push_back({static_cast<std::uint32_t>(x), r.draw, {}});
        });
        if (before != 0 && before != fragments_.size()) several_ = true;
    }

    void end_row(int y, int z) override {
        if (several_) // the bodies came one after another, each by ascending x
            std::stable_sort(fragments_.begin(), fragments_.end(),
                             [](const emitted& a, const emitted& b) { return a.x < b.x; });
        auto& lists = this->store;
        const std::uint64_t row =
            static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(grid_.extent.y) + static_cast<std::uint64_t>(y);
        for (std::size_t i = 0; i < fragments_.size();) {
            row_segment segment{};
            segment.key = row * tiles_x_ + fragments_[i].x / tile_size;
            segment.worker = worker_;
            segment.voxel = lists.counts.size();
            segment.fragment = lists.primitives.size();
            for (std::size_t j = i;
                 j < fragments_.size() && fragments_[j].x / tile_size == fragments_[i].x / tile_size;) {
                std::uint32_t n = 0;
                const std::uint32_t x = fragments_[j].x;
                for (; j < fragments_.size() && fragments_[j].x == x; ++j, ++n) {
                    lists.primitives.push_back(fragments_[j].draw);
                    if constexpr (has_payload) lists.payloads.push_back(fragments_[j].payload);
                }
                lists.counts.push_back(n);
                lists.columns.push_back(static_cast<std::uint8_t>(x % tile_size));
                ++segment.num_voxels;
            }
            segment.num_fragments = lists.primitives.size() - segment.fragment;
            i += segment.num_fragments;
            this->segments.push_back(segment);
        }
        this->counts.fragments += fragments_.size();
        fragments_.clear();
        several_ = false;
    }

private:
    static constexpr bool has_payload = !std::is_same_v<Payload, no_payload>;
    struct emitted {
        std::uint32_t x, draw;
        [[no_unique_address]] Payload payload;
    };

    std::span<const Draw> draws_;
    const grid& grid_;
    std::uint64_t tiles_x_;
    std::uint32_t worker_;
    std::vector<emitted> fragments_; // of one row, as they come
    bool several_ = false;           // of several bodies
};

template <class Crossing, class Draw, class Backend, class Payload>
[[nodiscard]] status list_solid(const execution& how, Backend& backend, const solid_sweep<Crossing>& sweep,
                                std::span<const Draw> draws, const grid& g, abuffer<Backend, Payload>& lists,
                                status result) {
    how.enter(stage::fine_raster);
    const auto workers = std::max<std::size_t>(1, std::min<std::size_t>(how.threads, sweep.num_beams()));
    std::vector<std::unique_ptr<row_scratch>> scratch;
    using sink = list_sink<Draw, payload_storage<Payload>>;
    std::vector<std::unique_ptr<sink>> sinks;
    for (std::size_t w = 0; w < workers; ++w) {
        scratch.push_back(sweep.make_scratch());
        sinks.push_back(std::make_unique<sink>(draws, g, static_cast<std::uint32_t>(w)));
    }
    sweep_all(how, sweep, sinks, scratch, result);
    return emit_lists(how, backend, g.extent, sinks, result, lists);
}

} // namespace voxelpipe::cpu
