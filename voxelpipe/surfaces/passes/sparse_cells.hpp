// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells that a surface passes between samples of sparse framebuffers. Memory is in proportion to the bricks that
// exist and the cells; no array has the size of the grid.

#include <voxelpipe/surfaces/passes/brick_cells.hpp>
#include <voxelpipe/surfaces/passes/build.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// The cells of samples in bricks. A surface of theirs has the bytes of one of surface_cells.
template <class Backend>
class sparse_cells : public numbered_cells<Backend> {
    using base = numbered_cells<Backend>;
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using list_type = passes::indexed_cells<passes::brick_index>; // what passes take
    static constexpr bool is_sparse = true;

    // The samples are read here and not kept. Throws std::length_error for more bricks than 32 bits number. Waits.
    sparse_cells(Backend& backend, const passes::sample_bricks& samples)
        : base(backend), brick_keys_(backend, 0), bricks_(backend, 0), first_of_row_(backend, 0), slots_(backend, 0),
          offset_(samples.offset()) {
        list_bricks(backend, samples);
        const std::uint64_t n = brick_keys_.size();
        check_number(64 * n);
        bricks_ = buffer<passes::cell_brick>(backend, n);
        first_of_row_ = buffer<std::uint64_t>(backend, 64 * n + 1);
        std::uint64_t count = 0;
        {
            buffer<std::uint32_t> counts(backend, 64 * n + 1);
            backend.for_each(n + 1,
                             passes::make_cell_bricks{samples, brick_keys_.data(), n, bricks_.data(), counts.data()});
            count = backend.sum(counts, first_of_row_);
        }
        log2_slots_ = brick_lookup::log2_slots_for(n);
        slots_ = buffer<std::uint32_t>(backend, std::size_t{1} << log2_slots_);
        brick_table table;
        table.keys = brick_keys_.data();
        table.count = n;
        run_module(brick_slots_tag{}, backend, table, slots_.data(), log2_slots_);
        if (!base::make_room(backend, count)) return;
        backend.for_each(n, passes::list_brick_cells{samples, brick_keys_.data(), bricks_.data(), first_of_row_.data(),
                                                     base::keys_.data(), base::states_.data()});
        base::number(backend, samples);
    }

    // Refers to the object.
    [[nodiscard]] list_type list() const {
        return base::list_by(passes::brick_index{brick_keys_.data(), brick_keys_.size(),
                                                 brick_lookup{slots_.data(), log2_slots_}, bricks_.data(),
                                                 first_of_row_.data(), offset_});
    }
    [[nodiscard]] std::uint64_t num_bricks() const { return brick_keys_.size(); } // that have a cell

private:
    static void check_number(std::uint64_t n) {
        if (n >= base::most) throw std::length_error("voxelpipe: more bricks than 32 bits number");
    }
    // The bricks of cells that the surface passes, in order.
    void list_bricks(Backend& backend, const passes::sample_bricks& samples) {
        const brick_table& bits = samples.bits.table;
        const std::uint64_t tiles = bits.num_tiles;
        check_number(tiles);
        buffer<std::uint64_t> first_of_tile(backend, tiles + 1);
        std::uint64_t all = 8 * samples.num_bricks();
        {
            buffer<std::uint32_t> counts(backend, tiles + 1);
            backend.for_each(tiles + 1, passes::count_tile_candidates{bits.tiles, tiles, counts.data()});
            all += backend.sum(counts, first_of_tile);
        }
        check_number(all);
        const passes::brick_candidates candidates{samples, first_of_tile.data()};
        buffer<std::uint32_t> chosen(backend, all + 1);
        buffer<std::uint64_t> places(backend, all + 1);
        backend.for_each(all + 1, passes::choose_candidates{candidates, all, chosen.data()});
        const std::uint64_t n = backend.sum(chosen, places);
        brick_keys_ = buffer<std::uint64_t>(backend, n);
        buffer<std::uint32_t> numbers(backend, n);
        backend.for_each(all, passes::list_cell_bricks{candidates, chosen.data(), places.data(), brick_keys_.data(),
                                                       numbers.data()});
        constexpr int bits_of_xy = 2 * passes::cell_brick_key::axis_bits;
        const auto layers = static_cast<unsigned>((bits.extent.z + bits.offset.z) / sparse_brick_size + 1);
        backend.sort_by_key(brick_keys_, numbers, bits_of_xy + static_cast<int>(std::bit_width(layers)));
    }

    buffer<std::uint64_t> brick_keys_;
    buffer<passes::cell_brick> bricks_;
    buffer<std::uint64_t> first_of_row_;
    buffer<std::uint32_t> slots_;
    int log2_slots_ = 0;
    glm::ivec3 offset_;
};

// The samples of sparse framebuffers as sparse_cells reads them; they outlive it.
template <class Backend>
class sparse_samples {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    // Reads bits alone.
    template <class Bits>
    sparse_samples(Backend& backend, const Bits& bits)
        : bit_slots_(backend, bits), bit_layers_(backend, bits.num_bricks()), field_layers_(backend, 0) {
        const auto view = bits.view();
        view_.values = get<0>(view.values);
        view_.bits = {view.table, bit_slots_.lookup(), bit_layers_.data()};
        view_.field.table.extent = view.table.extent;
        backend.for_each(bits.num_bricks(), passes::read_bit_bricks{view.table, view_.values, bit_layers_.data()});
    }
    // A field besides: its bricks, read by `lookup`, take the place of those of the bits. NaN samples are counted.
    template <class Field>
    void add(Backend& backend, const Field& field, const brick_lookup& lookup, double level,
             std::uint64_t* nan_samples) {
        const auto view = field.view();
        field_layers_ = buffer<passes::brick_layers>(backend, field.num_bricks());
        backend.for_each(field.num_bricks(), passes::read_field_bricks{view.table, get<0>(view.values), level, view_,
                                                                       field_layers_.data(), nan_samples});
        view_.field = {view.table, lookup, field_layers_.data()};
    }
    // Refers to the object.
    [[nodiscard]] const passes::sample_bricks& view() const { return view_; }

private:
    brick_slots<Backend> bit_slots_;
    buffer<passes::brick_layers> bit_layers_, field_layers_;
    passes::sample_bricks view_;
};

} // namespace voxelpipe::core
