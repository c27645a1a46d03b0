// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragments that come in parts, in the backend's memory: joined, sorted by voxel, and stored in lists or folded into
// targets. Nothing is blended before the last part is there, because a float sum is rounded once. The functors run by
// Backend::for_each, the same on every backend.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/sparse/passes/all_outputs.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe::core {

[[nodiscard]] inline std::uint64_t num_grid_voxels(const glm::ivec3& extent) {
    return static_cast<std::uint64_t>(extent.x) * static_cast<std::uint64_t>(extent.y) *
           static_cast<std::uint64_t>(extent.z);
}

namespace pool {

// A number that the host knows, or one in the backend's memory.
struct length {
    std::uint64_t value;
    const std::uint64_t* at = nullptr; // null: `value`

    VOXELPIPE_HD length(std::uint64_t n) : value(n) {} // NOLINT(*-explicit-*): most are plain numbers
    VOXELPIPE_HD explicit length(const std::uint64_t* in_memory) : value(0), at(in_memory) {}
    VOXELPIPE_HD operator std::uint64_t() const { return at != nullptr ? *at : value; } // NOLINT(*-explicit-*)
};

// A part of a grid, and its voxels' numbers in the whole.
struct grid_part {
    glm::ivec3 begin, size, whole;

    [[nodiscard]] VOXELPIPE_HD std::uint64_t number_in_whole(std::uint64_t voxel) const {
        if (size == whole) return voxel;
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        const std::uint64_t row = voxel / wide(size.x), layer = row / wide(size.y);
        const std::uint64_t x = voxel - row * wide(size.x) + wide(begin.x),
                            y = row - layer * wide(size.y) + wide(begin.y), z = layer + wide(begin.z);
        return (z * wide(whole.y) + y) * wide(whole.x) + x;
    }
};
// Fragment i of lists, from number `first` on.
template <class Payload>
struct take_lists {
    const std::uint64_t *voxels, *offsets;
    std::uint32_t num_voxels, first_primitive;
    grid_part part;
    const std::uint32_t* primitives;
    const Payload* payloads;
    std::uint64_t first;
    std::uint64_t* keys;
    std::uint32_t *order, *to_primitives;
    Payload* to_payloads;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        keys[first + i] = part.number_in_whole(voxels[find_owner(offsets, num_voxels, i)]);
        order[first + i] = static_cast<std::uint32_t>(first + i);
        to_primitives[first + i] = primitives[i] + first_primitive;
        if constexpr (!std::is_same_v<Payload, no_payload>) to_payloads[first + i] = payloads[i];
    }
};
template <class Payload>
struct gather {
    const std::uint32_t *order, *primitives;
    const Payload* payloads;
    std::uint32_t* to_primitives;
    Payload* to_payloads;
    length count; // others are left out

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i >= count) return;
        to_primitives[i] = primitives[order[i]];
        if constexpr (!std::is_same_v<Payload, no_payload>) to_payloads[i] = payloads[order[i]];
    }
};
// Lists behind others, of which there are first_voxel voxels and first_fragment fragments.
template <class Payload>
struct append {
    const std::uint64_t *voxels, *offsets;
    std::uint64_t num_voxels, num_fragments;
    const std::uint32_t* primitives;
    const Payload* payloads;
    std::uint64_t first_voxel, first_fragment;
    std::uint64_t *to_voxels, *to_offsets;
    std::uint32_t* to_primitives;
    Payload* to_payloads;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < num_voxels) to_voxels[first_voxel + i] = voxels[i];
        if (i <= num_voxels) to_offsets[first_voxel + i] = first_fragment + offsets[i];
        if (i >= num_fragments) return;
        to_primitives[first_fragment + i] = primitives[i];
        if constexpr (!std::is_same_v<Payload, no_payload>) to_payloads[first_fragment + i] = payloads[i];
    }
};
// 1 for the first fragment of a voxel; a last element of 0, so that the sums end with the total.
struct mark_first {
    const std::uint64_t* keys;
    length count;
    std::uint32_t* is_first;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        is_first[i] = i < count && (i == 0 || keys[i] != keys[i - 1]) ? 1 : 0;
    }
};
struct store_voxels {
    const std::uint64_t *keys, *rank;
    const std::uint32_t* is_first;
    length count;
    std::uint64_t *voxels, *offsets;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count)
            offsets[rank[i]] = i;
        else if (is_first[i] != 0) {
            voxels[rank[i]] = keys[i];
            offsets[rank[i]] = i;
        }
    }
};
// Folds a voxel's fragments into target I, which has its clear values.
template <std::size_t I, class Target, class Payload>
struct fold {
    target_view<Target> target;
    const std::uint64_t *voxels, *offsets;
    const Payload* payloads;
    length count; // of voxels

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i >= count) return;
        using map = typename Target::map;
        using traits = typename Target::traits;
        const auto nx = static_cast<std::uint64_t>(target.extent.x), ny = static_cast<std::uint64_t>(target.extent.y);
        const int x = static_cast<int>(voxels[i] % nx), y = static_cast<int>(voxels[i] / nx % ny),
                  z = static_cast<int>(voxels[i] / (nx * ny));
        if constexpr (map::is_bit) { // other threads change other bits of the word
            std::uint32_t& word = target.elements[map::cell(target.extent, x, y, z)];
            auto sum = traits::begin((load_shared(word) >> (x & 31) & 1u) != 0);
            for (std::uint64_t f = offsets[i]; f < offsets[i + 1]; ++f) traits::apply(sum, get<I>(payloads[f]));
            store_shared(word, 1u << (x & 31), traits::end(sum));
        } else {
            auto sum = traits::begin(map::load(target.elements, target.extent, x, y, z));
            for (std::uint64_t f = offsets[i]; f < offsets[i + 1]; ++f) traits::apply(sum, get<I>(payloads[f]));
            map::store(target.elements, target.extent, x, y, z, traits::end(sum));
        }
    }
};
struct zero_words {
    std::uint32_t* words;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { words[i] = 0; }
};

} // namespace pool

// Fragments of a call whose payloads are all of its outputs, or an A-buffer's payload.
template <class Backend, class Payload>
class fragment_pool {
    using stored = payload_storage<Payload>;
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    // Room for `count` fragments, to be written in any order: their voxel, or num_voxels without one; their number in
    // the part; primitive; payload. Parts come by ascending primitive. Within a part, fragments of a voxel stand by
    // ascending primitive.
    struct part {
        part(Backend& backend, std::uint64_t count)
            : keys(backend, count), order(backend, count), primitives(backend, count),
              payloads(backend, std::is_void_v<Payload> ? 0 : count) {}
        buffer<std::uint64_t> keys;
        buffer<std::uint32_t> order, primitives;
        buffer<stored> payloads;
    };

    // begin: of the lists' part of the grid.
    void add(abuffer<Backend, Payload>&& lists, std::uint32_t first_primitive, const glm::ivec3& begin) {
        total_ += lists.num_fragments();
        if (lists.num_fragments() != 0) lists_.push_back({std::move(lists), first_primitive, begin});
    }
    [[nodiscard]] std::uint64_t size() const { return total_; }

    // The lists of all parts. Throws std::length_error if fragments are too many to be numbered.
    [[nodiscard]] abuffer<Backend, Payload> join(Backend& backend, const glm::ivec3& extent) {
        if (total_ > max_fragments) throw std::length_error("voxelpipe: too many fragments");
        if (lists_.size() == 1 && lists_[0].first_primitive == 0 && lists_[0].lists.extent == extent) {
            abuffer<Backend, Payload> only = std::move(lists_[0].lists);
            lists_.clear();
            return only;
        }
        part all(backend, total_);
        std::uint64_t first = 0;
        for (entry& e : lists_) {
            const auto& l = e.lists;
            backend.for_each(l.num_fragments(), pool::take_lists<stored>{l.voxels.data(),
                                                                         l.offsets.data(),
                                                                         static_cast<std::uint32_t>(l.num_voxels()),
                                                                         e.first_primitive,
                                                                         {e.begin, l.extent, extent},
                                                                         l.primitives.data(),
                                                                         l.payloads.data(),
                                                                         first,
                                                                         all.keys.data(),
                                                                         all.order.data(),
                                                                         all.primitives.data(),
                                                                         all.payloads.data()});
            first += l.num_fragments();
            e.lists = abuffer<Backend, Payload>(backend);
        }
        lists_.clear();
        return sort(backend, extent, std::move(all), total_);
    }

    // The lists of one part, of whose fragments `kept` have a voxel.
    [[nodiscard]] static abuffer<Backend, Payload> sort(Backend& backend, const glm::ivec3& extent, part&& from,
                                                        std::uint64_t kept) {
        const std::uint64_t voxels = num_grid_voxels(extent);
        backend.sort_by_key(from.keys, from.order, static_cast<int>(std::bit_width(voxels)));
        abuffer<Backend, Payload> lists(backend);
        lists.extent = extent;
        if (kept == 0) return lists;
        lists.primitives = buffer<std::uint32_t>(backend, kept);
        lists.payloads = buffer<stored>(backend, std::is_void_v<Payload> ? 0 : kept);
        backend.for_each(kept, pool::gather<stored>{from.order.data(), from.primitives.data(), from.payloads.data(),
                                                    lists.primitives.data(), lists.payloads.data(), kept});
        from.primitives = buffer<std::uint32_t>(backend, 0);
        from.payloads = buffer<stored>(backend, 0);
        buffer<std::uint32_t> is_first(backend, kept + 1);
        buffer<std::uint64_t> rank(backend, kept + 1);
        backend.for_each(kept + 1, pool::mark_first{from.keys.data(), kept, is_first.data()});
        const std::uint64_t occupied = backend.sum(is_first, rank);
        lists.voxels = buffer<std::uint64_t>(backend, occupied);
        lists.offsets = buffer<std::uint64_t>(backend, occupied + 1);
        backend.for_each(kept + 1, pool::store_voxels{from.keys.data(), rank.data(), is_first.data(), kept,
                                                      lists.voxels.data(), lists.offsets.data()});
        return lists;
    }

    static constexpr std::uint64_t max_fragments = std::numeric_limits<std::uint32_t>::max() - 1;

private:
    struct entry {
        abuffer<Backend, Payload> lists;
        std::uint32_t first_primitive;
        glm::ivec3 begin;
    };
    std::vector<entry> lists_;
    std::uint64_t total_ = 0;
};

// Fragments whose lists take `bytes` while they are sorted: voxels, offsets, primitives and payloads, the same in one
// array of all, and two of keys and numbers for the sort. 0 bytes: there is no bound.
template <class Payload>
[[nodiscard]] constexpr std::uint64_t fragments_within(std::uint64_t bytes) {
    return bytes == 0 ? ~std::uint64_t{0} : bytes / (48 + 2 * (4 + sizeof(payload_storage<Payload>)));
}

// ---- outputs --------------------------------------------------------------------------------------------------------

// The payload of the lists that an output is made of.
template <class Output, class ShaderOutput>
struct pooled;
template <class... Targets, class ShaderOutput>
struct pooled<framebuffer_view<Targets...>, ShaderOutput> {
    using payload = typename outputs_payload<ShaderOutput>::type;
};
template <class Backend, class Payload, class ShaderOutput>
struct pooled<abuffer<Backend, Payload>, ShaderOutput> {
    using payload = Payload;
};

// Moves a call's lists into its output. `s` is the status of the call, whose counts of fragments it fills.
template <class Backend, class Payload>
[[nodiscard]] status store_pooled(Backend&, const grid&, abuffer<Backend, Payload>&& lists,
                                  abuffer<Backend, Payload>& out, bool, status s) {
    s.counts.fragments = lists.num_fragments();
    s.counts.voxels = lists.num_voxels();
    out = std::move(lists);
    return s;
}
// Clears the targets, before lists are folded into them.
template <class Backend, class... Targets>
[[nodiscard]] status begin_fold(Backend& backend, const framebuffer_view<Targets...>& fb) {
    if (const status cleared = backend.clear(fb); !cleared.ok()) return cleared;
    // The log does not describe the targets any longer.
    if (fb.changes != nullptr) backend.for_each(change_log::header_words, pool::zero_words{fb.changes});
    return {};
}
// Lists of each voxel are folded at once.
template <class Backend, class Payload, class... Targets>
void fold_lists(Backend& backend, const abuffer<Backend, Payload>& lists, const framebuffer_view<Targets...>& fb) {
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename pack_element<I, Targets...>::type;
        const auto& t = voxelpipe::get<I>(fb.targets);
        if (t.load == load_operation::off) return;
        backend.for_each(lists.num_voxels(),
                         pool::fold<I, target, Payload>{t, lists.voxels.data(), lists.offsets.data(),
                                                        lists.payloads.data(), lists.num_voxels()});
    });
}
template <class Backend, class Payload, class... Targets>
[[nodiscard]] status store_pooled(Backend& backend, const grid&, abuffer<Backend, Payload>&& lists,
                                  const framebuffer_view<Targets...>& fb, bool count_voxels, status s) {
    s.counts.fragments = lists.num_fragments();
    s.counts.voxels = count_voxels ? lists.num_voxels() : 0;
    if (const status begun = begin_fold(backend, fb); !begun.ok()) return begun;
    fold_lists(backend, lists, fb);
    return s;
}

} // namespace voxelpipe::core
