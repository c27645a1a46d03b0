// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragments of a call that makes its triangles in chunks, or of points and lines, in bounded memory. All fragments of a
// voxel are listed before any of them is blended. If those of the whole grid are too many at once, the grid is drawn in
// parts, one after the other, and the chunks are made again for each: the voxels of a part are exactly those of the
// whole.

#include <voxelpipe/programs/passes/fragment_pool.hpp>
#include <voxelpipe/sparse/sparse.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/triangle_counts.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// ---- where the lists of parts go ------------------------------------------------------------------------------------

// The lists of parts that follow each other, joined.
template <class Backend, class Payload>
class joined_parts {
    using stored = payload_storage<Payload>;
    using lists_type = abuffer<Backend, Payload>;

public:
    void add(lists_type&& lists) {
        voxels_ += lists.num_voxels();
        fragments_ += lists.num_fragments();
        if (lists.num_voxels() != 0) parts_.push_back(std::move(lists));
    }
    [[nodiscard]] lists_type take(Backend& backend, const glm::ivec3& extent) {
        lists_type all(backend);
        if (parts_.size() == 1) {
            all = std::move(parts_[0]);
        } else if (voxels_ != 0) {
            all.voxels = typename Backend::template buffer<std::uint64_t>(backend, voxels_);
            all.offsets = typename Backend::template buffer<std::uint64_t>(backend, voxels_ + 1);
            all.primitives = typename Backend::template buffer<std::uint32_t>(backend, fragments_);
            all.payloads = typename Backend::template buffer<stored>(backend, std::is_void_v<Payload> ? 0 : fragments_);
            std::uint64_t voxel = 0, fragment = 0;
            for (lists_type& p : parts_) {
                backend.for_each(std::max(p.num_voxels() + 1, p.num_fragments()),
                                 pool::append<stored>{p.voxels.data(), p.offsets.data(), p.num_voxels(),
                                                      p.num_fragments(), p.primitives.data(), p.payloads.data(), voxel,
                                                      fragment, all.voxels.data(), all.offsets.data(),
                                                      all.primitives.data(), all.payloads.data()});
                voxel += p.num_voxels();
                fragment += p.num_fragments();
                p = lists_type(backend);
            }
        }
        parts_.clear();
        all.extent = extent;
        return all;
    }

private:
    std::vector<lists_type> parts_;
    std::uint64_t voxels_ = 0, fragments_ = 0;
};

// The output of a call. store() takes the lists of each part, in the order of their voxels; finish() comes last, and
// returns `s` with the counts of fragments. has_written(): something of the output has been written.
//
// Lists are those of all parts, joined.
template <class Backend, class Payload, class Output>
class part_store {
public:
    part_store(Backend&, Output& out) : out_(out) {}
    [[nodiscard]] static bool has_written() { return false; }
    [[nodiscard]] status store(Backend&, abuffer<Backend, Payload>&& lists) {
        parts_.add(std::move(lists));
        return {};
    }
    [[nodiscard]] status finish(Backend& backend, const grid& g, bool count_voxels, const status& s) {
        return store_pooled(backend, g, parts_.take(backend, g.extent), out_, count_voxels, s);
    }

private:
    Output& out_;
    joined_parts<Backend, Payload> parts_;
};
// Targets are folded into part by part.
template <class Backend, class Payload, class... Targets>
class part_store<Backend, Payload, framebuffer_view<Targets...>> {
public:
    part_store(Backend&, const framebuffer_view<Targets...>& fb) : fb_(fb) {}
    [[nodiscard]] bool has_written() const { return has_written_; }
    [[nodiscard]] status store(Backend& backend, abuffer<Backend, Payload>&& lists) {
        if (const status s = begin(backend); !s.ok()) return s;
        fold_lists(backend, lists, fb_);
        voxels_ += lists.num_voxels();
        fragments_ += lists.num_fragments();
        return {};
    }
    [[nodiscard]] status finish(Backend& backend, const grid&, bool count_voxels, status s) {
        if (const status cleared = begin(backend); !cleared.ok()) return cleared;
        s.counts.fragments = fragments_;
        s.counts.voxels = count_voxels ? voxels_ : 0;
        return s;
    }

private:
    [[nodiscard]] status begin(Backend& backend) {
        return std::exchange(has_written_, true) ? status{} : begin_fold(backend, fb_);
    }
    const framebuffer_view<Targets...>& fb_;
    bool has_written_ = false;
    std::uint64_t voxels_ = 0, fragments_ = 0;
};
// ---- the parts ------------------------------------------------------------------------------------------------------

// Draws a grid, in parts if need be. Store: part_store. List: calls list(grid, most, take), which gives the lists of
// each chunk to take(lists, first primitive, counters, fragments) and returns a status. Lists may be empty if there are
// more than `most` fragments.
template <class Backend, class Payload, class Store, class List>
class part_drawing {
    using pool_type = fragment_pool<Backend, Payload>;

public:
    // most: fragments that may be listed at once. More are listed for a single voxel only.
    part_drawing(Backend& backend, const grid& whole, Store& store, const List& list, std::uint64_t most)
        : backend_(backend), whole_(whole), store_(store), list_(list),
          most_(std::clamp<std::uint64_t>(most, 1, pool_type::max_fragments)) {}

    // `counts` receives what the call counts of its triangles.
    [[nodiscard]] status draw(counters& counts) {
        const box all{glm::ivec3(0), whole_.extent};
        tried t = attempt(all, true);
        if (t.s.code == status_code::out_of_memory) t = attempt(all, false); // the lists may have taken the memory
        if (!t.s.ok()) return t.s;
        counts = t.counts;
        const status s = t.is_listed ? store(std::move(t)) : draw_parts(all, t.fragments);
        counts.fragments_discarded = discarded_;
        return s;
    }

private:
    struct box {
        glm::ivec3 begin, size;
    };
    struct tried {
        status s;
        counters counts;
        std::uint64_t fragments = 0;
        bool is_listed = false;
        abuffer<Backend, Payload> lists;
    };

    // Lists a part, or only counts its fragments.
    [[nodiscard]] tried attempt(const box& b, bool keeps) {
        const bool is_whole = b.size == whole_.extent;
        const std::uint64_t most = b.size == glm::ivec3(1) ? pool_type::max_fragments : most_;
        tried t{{}, {}, 0, false, abuffer<Backend, Payload>(backend_)};
        pool_type pool;
        try {
            t.s = list_(is_whole ? whole_ : whole_.crop(b.begin, b.size), keeps ? most : 0,
                        [&](abuffer<Backend, Payload>&& lists, std::uint32_t first_primitive, const counters& c,
                            std::uint64_t fragments) {
                            t.fragments += fragments;
                            add_triangles(t.counts, c);
                            t.counts.fragments_discarded += c.fragments_discarded;
                            keeps = keeps && t.fragments <= most;
                            if (keeps)
                                pool.add(std::move(lists), first_primitive, b.begin);
                            else
                                pool = pool_type();
                        });
            t.is_listed = t.s.ok() && keeps;
            if (t.is_listed) t.lists = pool.join(backend_, whole_.extent);
        } catch (const std::bad_alloc&) {
            t.s = failure(status_code::out_of_memory, stage::abuffer_emit);
        }
        return t;
    }
    [[nodiscard]] status store(tried&& t) {
        discarded_ += t.counts.fragments_discarded;
        return store_.store(backend_, std::move(t.lists));
    }
    // Draws a part whose lists do not fit, in smaller ones. Their voxels follow each other in the lists' order: a part
    // is divided along y only if it has one layer, along x only if it has one row.
    [[nodiscard]] status draw_parts(const box& b, std::uint64_t fragments) {
        const int axis = b.size.z > 1 ? 2 : b.size.y > 1 ? 1 : 0;
        const int length = b.size[axis];
        const std::uint64_t wanted = fragments / most_ + 1;
        const int parts = wanted < 2                                    ? 2
                          : wanted < static_cast<std::uint64_t>(length) ? static_cast<int>(wanted)
                                                                        : length;
        for (int i = 0; i < parts; ++i) {
            const auto at = [&](int k) { return static_cast<int>(std::int64_t{length} * k / parts); };
            box part = b;
            part.begin[axis] += at(i);
            part.size[axis] = at(i + 1) - at(i);
            if (const status s = draw_part(part); !s.ok()) return s;
        }
        return {};
    }
    [[nodiscard]] status draw_part(const box& b) {
        tried t = attempt(b, true);
        if (t.is_listed && t.s.ok()) return store(std::move(t));
        const bool is_full = t.s.ok() || t.s.code == status_code::out_of_memory;
        return is_full && b.size != glm::ivec3(1) ? draw_parts(b, t.fragments) : t.s;
    }

    Backend& backend_;
    grid whole_;
    Store& store_;
    const List& list_;
    std::uint64_t most_, discarded_ = 0;
};

} // namespace voxelpipe::core
