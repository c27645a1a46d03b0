// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// label on CPU threads: run_module of core::label_tag. The array of labels is the array of the union-find: the lowest
// voxel of each segment holds a lower one of its component. Threads join blocks of rows by themselves, then across
// blocks, then write the roots.

#include <cpu_ref/cpu_backend.hpp>
#include <voxelpipe/label/core/row_contacts.hpp>
#include <voxelpipe/label/label.hpp>
#include <voxelpipe/label/passes/component_list.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe::cpu {

// Parts of components that a thread has found and not added to the list yet: by the lowest bits of their numbers.
class component_cache {
public:
    explicit component_cache(const core::component_list& list) : list_(list) {}
    void add(std::uint64_t number, const core::component_part& part) {
        slot& s = slots_[number % slots_.size()];
        if (s.number != number) flush(s);
        s.number = number;
        s.part.add(part);
    }
    void flush() {
        for (slot& s : slots_) flush(s);
    }

private:
    struct slot {
        std::uint64_t number = 0;
        core::component_part part;
    };
    void flush(slot& s) const {
        if (s.part.voxels != 0) list_.add(s.number, s.part);
        s.part = {};
    }
    core::component_list list_;
    std::array<slot, 64> slots_{};
};

template <class Label>
class labeller {
    using word = std::uint64_t;
    using number = std::make_unsigned_t<Label>;
    static constexpr int bits = core::bits_of_word<word>;
    static constexpr number step = core::bits_of_word<word>;
    using window = core::word_window<word>;

public:
    labeller(const std::uint32_t* words, const glm::ivec3& extent, int connectivity, Label* labels)
        : rows_{words, extent}, connectivity_(connectivity),
          labels_(reinterpret_cast<number*>(labels)), sets_{labels_} {}

    [[nodiscard]] std::uint64_t rows() const { return rows_.rows(); }

    // Starts the segments of rows [first, last), and joins those of them that touch. Threads may have other rows.
    void join_within(std::uint64_t first, std::uint64_t last) const {
        for (std::uint64_t r = first; r < last; ++r) {
            join_row<true>(r, [&](std::uint64_t other) { return other >= first; });
        }
    }
    // Joins the segments of rows [first, last) with those of rows before that touch them.
    void join_across(std::uint64_t first, std::uint64_t last) const {
        const std::uint64_t reach = static_cast<std::uint64_t>(rows_.extent.y) + 1;
        for (std::uint64_t r = first; r < std::min(last, first + reach); ++r)
            join_row<false>(r, [&](std::uint64_t other) { return other < first; });
    }
    // Makes roots the parents of all segments of a row, and returns how many of them are roots. marks: null, or where
    // roots are marked.
    std::uint64_t flatten(std::uint64_t row, std::uint32_t* marks) const {
        std::uint64_t count = 0;
        const row_place at = place(row);
        const int y = at.y, z = at.z;
        const core::bit_row<word> of = rows_.row(y, z);
        number first = rows_.first_voxel(y, z), root = 0;
        word before = 0;
        for (int i = 0; i < rows_.row_words(); ++i, first += step) {
            const word now = of(i);
            word left = core::segment_starts(now);
            if ((before >> (bits - 1) & now & 1) != 0) { // goes on from the word before
                sets_.set_root(first, root);
                left &= left - 1;
            }
            for (; left != 0; left &= left - 1) {
                const number v = first + static_cast<number>(exact::lowest_one(left));
                root = sets_.find(v);
                if (root != v) {
                    sets_.set_root(v, root);
                    continue;
                }
                ++count;
                if (marks != nullptr) core::store_shared(marks[v / 32], std::uint32_t{1} << (v % 32), true);
            }
            before = now;
        }
        return count;
    }
    // Writes the labels of a row whose segments are flat. on_segment(root, lowest voxel, number of voxels): of each
    // segment.
    template <class OnSegment>
    void write(std::uint64_t row, const OnSegment& on_segment) const {
        const row_place at = place(row);
        const int y = at.y, z = at.z;
        const core::bit_row<word> of = rows_.row(y, z);
        number* to = labels_ + rows_.first_voxel(y, z);
        for (int i = 0; i < rows_.row_words(); ++i, to += bits) {
            const int count = std::min(bits, rows_.extent.x - i * bits);
            write_word(of(i), to, count, [&](number root, int x, int length) {
                on_segment(root, glm::ivec3(i * bits + x, y, z), length);
            });
        }
    }

private:
    struct row_place {
        int y, z;
    };
    [[nodiscard]] row_place place(std::uint64_t row) const {
        const auto ny = static_cast<std::uint64_t>(rows_.extent.y);
        return {static_cast<int>(row % ny), static_cast<int>(row / ny)};
    }

    // A window that moves along a row.
    struct moving_window : window {
        core::bit_row<word> row;
        explicit moving_window(const core::bit_row<word>& of) : window{0, of(0), of(1)}, row(of) {}
        void move_to(int i) {
            this->before = this->now;
            this->now = this->after;
            this->after = row(i + 1);
        }
    };

    // Alone: starts the segments, and no other thread has the sets of the rows that are wanted.
    template <bool Alone, class IsWanted>
    void join_row(std::uint64_t row, const IsWanted& is_wanted) const {
        const row_place at = place(row);
        const int y = at.y, z = at.z;
        const std::uint64_t ny = static_cast<std::uint64_t>(rows_.extent.y);
        const bool has_edges = connectivity_ >= 18;
        const core::near_rows wanted{y > 0 && is_wanted(row - 1), z > 0 && is_wanted(row - ny),
                                     has_edges && z > 0 && y > 0 && is_wanted(row - ny - 1),
                                     has_edges && z > 0 && y + 1 < rows_.extent.y && is_wanted(row - ny + 1)};
        if (!Alone && !wanted.front && !wanted.below && !wanted.below_front && !wanted.below_back) return;
        moving_window here(rows_.row(y, z)), front(rows_.row(y - 1, z)), below(rows_.row(y, z - 1)),
            below_front(rows_.row(y - 1, z - 1)), below_back(rows_.row(y + 1, z - 1));
        core::near_numbers<number> first{rows_.first_voxel(y, z), rows_.first_voxel(y - 1, z),
                                         rows_.first_voxel(y, z - 1), rows_.first_voxel(y - 1, z - 1),
                                         rows_.first_voxel(y + 1, z - 1)};
        number run = 0; // the run that the last segment belongs to
        for (int i = 0;;) {
            if (here.now != 0) {
                if constexpr (Alone) run = start_segments(here, first.here, run);
                core::join_word<Alone>(sets_, core::near_words<word>{here, front, below, below_front, below_back},
                                       first, connectivity_, wanted);
            }
            if (++i >= rows_.row_words()) return;
            for (moving_window* w : {&here, &front, &below, &below_front, &below_back}) w->move_to(i);
            for (number* n : {&first.here, &first.front, &first.below, &first.below_front, &first.below_back})
                *n += step;
        }
    }
    // The first voxel of the last run.
    [[nodiscard]] number start_segments(const window& w, number first, number run) const {
        word left = core::segment_starts(w.now);
        if ((w.before >> (bits - 1) & w.now & 1) != 0) {
            labels_[first] = run;
            left &= left - 1;
        }
        for (; left != 0; left &= left - 1) {
            run = first + static_cast<number>(exact::lowest_one(left));
            labels_[run] = run;
        }
        return run;
    }

    // Values are written four at a time, and those too many are overwritten by what follows: runs and gaps of up to
    // four voxels take no branch. In an array of its own, because the words behind still hold parents.
    template <class OnSegment>
    static void write_word(word now, number* to, int count, const OnSegment& on_segment) {
        constexpr auto none = static_cast<number>(no_label);
        std::array<number, static_cast<std::size_t>(bits) + 4> out;
        const auto fill = [&](int first, int end, number value) {
            for (auto i = static_cast<unsigned>(first); i < static_cast<unsigned>(end); i += 4)
                out[i] = out[i + 1] = out[i + 2] = out[i + 3] = value;
        };
        int end = 0; // of the last segment
        for (word left = now; left != 0;) {
            const int x = exact::lowest_one(left);
            const word gaps = ~(now >> x);
            const int length = gaps == 0 ? bits : exact::lowest_one(gaps);
            fill(end, x, none);
            end = x + length;
            fill(x, end, to[x]);
            on_segment(to[x], x, length);
            left = end == bits ? 0 : left >> end << end;
        }
        fill(end, count, none);
        std::copy_n(out.data(), count, to);
    }

    core::bit_rows_of<word, number> rows_;
    int connectivity_;
    number* labels_; // as numbers; no_label is the highest
    core::disjoint_sets<number> sets_;
};

} // namespace voxelpipe::cpu

namespace voxelpipe::core {

// Implements label. Arguments are validated.
template <class Label>
[[nodiscard]] status run_module(label_tag, cpu_backend& backend, const std::uint32_t* bits, const glm::ivec3& extent,
                                int connectivity, Label* labels, cpu_backend::buffer<voxel_component>* components) {
    const cpu::execution how = backend.execution();
    const cpu::labeller<Label> of(bits, extent, connectivity, labels);
    const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
    // Blocks are small enough for all threads to have work, and cost more than to hand them out. Results do not depend
    // on them.
    const std::uint64_t row_words = (wide(extent.x) + 63) / 64, least = 64 / row_words + 1;
    const std::uint64_t block =
        how.threads == 1 ? of.rows() : std::max(least, (of.rows() - 1) / (4 * std::uint64_t{how.threads}) + 1);
    const auto blocks = static_cast<std::size_t>((of.rows() - 1) / block + 1);
    const auto for_blocks = [&](const auto& work) {
        cpu::parallel_for(how.threads, blocks,
                          [&](unsigned, std::size_t b) { work(b * block, std::min(of.rows(), (b + 1) * block)); });
    };
    const auto write_rows = [&](std::uint64_t first, std::uint64_t last) {
        for (std::uint64_t r = first; r < last; ++r) of.write(r, [](auto, const glm::ivec3&, int) {});
    };

    status s;
    for_blocks([&](std::uint64_t first, std::uint64_t last) { of.join_within(first, last); });
    if (blocks > 1) for_blocks([&](std::uint64_t first, std::uint64_t last) { of.join_across(first, last); });
    if (components == nullptr && blocks == 1) {
        for (std::uint64_t r = 0; r < of.rows(); ++r) {
            s.label.components += of.flatten(r, nullptr);
            write_rows(r, r + 1);
        }
        return s;
    }
    const auto flatten_rows = [&](std::uint32_t* marks) {
        std::atomic<std::uint64_t> count{0};
        for_blocks([&](std::uint64_t first, std::uint64_t last) {
            std::uint64_t of_block = 0;
            for (std::uint64_t r = first; r < last; ++r) of_block += of.flatten(r, marks);
            count.fetch_add(of_block, std::memory_order_relaxed);
        });
        return count.load();
    };
    if (components == nullptr) {
        s.label.components = flatten_rows(nullptr);
        for_blocks(write_rows);
        return s;
    }
    component_marks<cpu_backend> marks(backend, wide(extent.x) * wide(extent.y) * wide(extent.z));
    (void)flatten_rows(marks.data());
    s.label.components = marks.number(backend);
    cpu_backend::buffer<voxel_component> made(backend, s.label.components);
    const component_list list = marks.start(backend, made.data(), extent);
    for_blocks([&](std::uint64_t first, std::uint64_t last) {
        cpu::component_cache parts(list);
        for (std::uint64_t r = first; r < last; ++r)
            of.write(r, [&](auto root, const glm::ivec3& at, int length) {
                const glm::ivec3 end(at.x + length - 1, at.y, at.z);
                parts.add(list.number(root), {static_cast<std::uint64_t>(length), at, end});
            });
        parts.flush();
    });
    *components = std::move(made);
    return s;
}

} // namespace voxelpipe::core
