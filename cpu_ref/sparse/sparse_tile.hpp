// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One tile of a sparse framebuffer: a thread draws it densely, by the code that draws tiles of a dense framebuffer, and
// then packs the voxels that exist into bricks. A tile is 4^3 bricks, and the Morton order of its bricks and of the
// voxels in them is the Morton order of its voxels.

#include <cpu_ref/framebuffer_pass.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace voxelpipe::cpu {

inline constexpr int tile_bricks = 64;
inline constexpr int tile_words = static_cast<int>(tile_voxels / 64); // of 4^3 voxels each, in Morton order

// A bit for each voxel of a tile, in Morton order: eight words a brick.
using tile_mask = std::array<std::uint64_t, tile_words>;

// Sets the voxels of a row, x = 0 .. 31; y and z are from 0 to 31.
inline void set_row(tile_mask& mask, std::uint32_t row, int y, int z) {
    // Four voxels of x are bits 0, 1, 8 and 9 of a word.
    constexpr auto spread = [] {
        std::array<std::uint16_t, 16> s{};
        for (unsigned n = 0; n < 16; ++n) s[n] = static_cast<std::uint16_t>((n & 3u) | (n & 12u) << 6);
        return s;
    }();
    const auto within = static_cast<unsigned>(core::morton_key(0, y & 3, z & 3));
    const auto first = static_cast<std::size_t>(core::morton_key(0, y >> 2, z >> 2));
    for (int x = 0; row != 0; ++x, row >>= 4)
        if ((row & 15u) != 0) mask[first + core::morton_key(x, 0, 0)] |= std::uint64_t{spread[row & 15u]} << within;
}

// Bricks with their values as they are found, by one thread; or a finished stretch of them.
template <class... Targets>
struct brick_list {
    std::vector<std::uint64_t> keys;
    std::vector<brick_mask> masks;
    std::uint64_t num_voxels = 0;
    core::pack<std::vector<typename core::rank_map<Targets>::element>...> values;
    core::pack<std::vector<core::kept_sum<Targets>>...> sums;

    void clear() {
        keys.clear();
        masks.clear();
        num_voxels = 0;
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            get<I>(values).clear();
            get<I>(sums).clear();
        });
    }
};

// Data that is the same for all tiles of a call.
template <class... Targets>
struct sparse_plan {
    core::pack<sparse_target<Targets>...> targets;
    core::pack<typename Targets::value_type...> background; // where a voxel starts that did not exist
    bool keeps_voxels = false;
};

// Memory of one thread for the tile that it draws. Positions in it count from the tile's lowest voxel that is drawn.
template <class... Targets>
class sparse_scratch {
    template <class Target>
    using memory = std::unique_ptr<typename Target::element_type[]>;

public:
    explicit sparse_scratch(const sparse_plan<Targets...>& plan) : plan_(plan) {
        view.extent = glm::ivec3(tile_size);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const auto& t = get<I>(plan_.targets);
            auto& v = get<I>(view.targets);
            v.extent = view.extent;
            v.load = t.load;
            v.clear_value = start<I>();
            if (!t.enabled) return;
            const std::size_t n = target<I>::map::elements(view.extent);
            get<I>(memory_) = std::make_unique<typename target<I>::element_type[]>(n);
            v.elements = get<I>(memory_).get();
            for (std::size_t i = 0; i < tile_voxels; ++i) store<I>(i, start<I>());
        });
        reserve_sums(view, shaded);
        cells_.reserve(tile_voxels);
    }

    framebuffer_view<Targets...> view; // of a tile
    tile_scratch<Targets...> shaded;
    constant_scratch constant;
    brick_list<Targets...> found;

    // Begins a tile. `lead`: the position in the whole tile of the first voxel drawn.
    void begin(const glm::ivec3& lead) { lead_ = lead; }

    // Before anything is drawn: takes over bricks of this tile, [first, last) of earlier contents.
    template <class Contents>
    void take_over(const Contents& from, std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b) {
            const auto brick = static_cast<unsigned>(from.keys.data()[b] & (tile_bricks - 1));
            std::uint64_t rank = from.offsets.data()[b];
            for (unsigned w = 0; w < 8; ++w) {
                std::uint64_t word = from.masks.data()[b].words[w];
                existed_[8 * brick + w] |= word;
                for (; word != 0; word &= word - 1, ++rank) {
                    const std::size_t cell = cell_of(8 * brick + w, static_cast<unsigned>(std::countr_zero(word)));
                    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                        using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
                        const auto& t = get<I>(plan_.targets);
                        if (t.enabled && t.load != load_operation::clear)
                            store<I>(cell, map::load(get<I>(from.values).data(), rank));
                    });
                }
            }
        }
    }

    // Takes over the values of tiles of earlier contents that reach into this one.
    template <class Contents>
    void take_over_tiles(const Contents& from, std::uint64_t tile_key) {
        const std::uint64_t first = tile_key * tile_bricks;
        for (unsigned b = 0; b < tile_bricks; ++b) {
            const std::uint64_t tile = core::find_tile(from.tiles.data(), from.tiles.size(), first + b);
            if (tile == from.tiles.size()) continue;
            in_tile_ |= std::uint64_t{1} << b;
            for (unsigned w = 0; w < 8; ++w) existed_[8 * b + w] = ~std::uint64_t{0};
            for_each_cell(b, [&]<std::size_t I>(std::size_t cell) {
                using map = core::rank_map<target<I>>;
                if (get<I>(plan_.targets).load != load_operation::clear)
                    store<I>(cell, map::load(get<I>(from.values).data(), from.num_voxels + tile));
            });
        }
    }

    // Before a constant shader's fragments are counted a voxel.
    void count_repeats() {
        if (constant.repeats == nullptr) constant.repeats = std::make_unique<std::uint32_t[]>(tile_voxels);
    }
    // Makes what has been drawn the voxels' values: of `shaded`, or of `constant`.
    void end_shaded() {
        mark(shaded.touched.data());
        resolve_tile(glm::ivec3(0), view, shaded);
    }
    template <class Values>
    void end_constant(const Values& values) {
        mark(constant.touched.data());
        resolve_constant_tile(glm::ivec3(0), view, values, constant);
    }

    // Ends the tile: its bricks go to `found`, and the scratch is as before.
    void pack_bricks(std::uint64_t tile_key) {
        cells_.clear();
        for (unsigned b = 0; b < tile_bricks; ++b) {
            brick_mask mask;
            std::uint64_t any = 0, any_drawn = 0;
            for (unsigned w = 0; w < 8; ++w) {
                mask.words[w] = drawn_[8 * b + w] | existed_[8 * b + w];
                any |= mask.words[w];
                any_drawn |= drawn_[8 * b + w];
            }
            if (any == 0) continue;
            if (any_drawn == 0 && (in_tile_ >> b & 1u) != 0) { // stays in its tile
                for_each_cell(b, [&]<std::size_t I>(std::size_t cell) { store<I>(cell, start<I>()); });
                continue;
            }
            found.keys.push_back(tile_key * tile_bricks + b);
            found.masks.push_back(mask);
            for (unsigned w = 0; w < 8; ++w)
                for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1)
                    cells_.push_back(place_of(8 * b + w, static_cast<unsigned>(std::countr_zero(word))));
        }
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            if (get<I>(plan_.targets).enabled) pack_values<I>();
        });
        found.num_voxels += cells_.size();
        drawn_.fill(0);
        if (plan_.keeps_voxels) existed_.fill(0);
        in_tile_ = 0;
    }

private:
    template <std::size_t I>
    using target = typename core::pack_element<I, Targets...>::type;

    // Calls f.operator()<I>(cell) for the voxels of a brick and the targets that are enabled.
    template <class F>
    void for_each_cell(unsigned brick, const F& f) {
        for (unsigned i = 0; i < 512; ++i) {
            const std::size_t cell = cell_of(8 * brick + i / 64, i % 64);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                if (get<I>(plan_.targets).enabled) f.template operator()<I>(cell);
            });
        }
    }

    // Marks the voxels that keep a fragment: `touched` has tile_rows rows of bits.
    void mark(const std::uint32_t* touched) {
        for (std::size_t row = 0; row < tile_rows; ++row) {
            if (touched[row] == 0) continue;
            const int y = static_cast<int>(row) % tile_size, z = static_cast<int>(row) / tile_size;
            set_row(drawn_, touched[row] << lead_.x, y + lead_.y, z + lead_.z);
        }
    }

    // The value of a voxel before its first fragment. Sums that are kept do not begin with the clear value, which is
    // added at the end.
    template <std::size_t I>
    [[nodiscard]] typename target<I>::value_type start() const {
        return get<I>(plan_.targets).keeps_sums ? target<I>::traits::identity() : get<I>(plan_.background);
    }
    template <std::size_t I>
    void store(std::size_t cell, const typename target<I>::value_type& v) {
        target<I>::map::store(get<I>(memory_).get(), glm::ivec3(tile_size), static_cast<int>(cell % tile_size),
                              static_cast<int>(cell / tile_size % tile_size), static_cast<int>(cell / tile_rows), v);
    }
    template <std::size_t I>
    [[nodiscard]] typename target<I>::value_type load(std::size_t cell) const {
        return target<I>::map::load(get<I>(memory_).get(), glm::ivec3(tile_size), static_cast<int>(cell % tile_size),
                                    static_cast<int>(cell / tile_size % tile_size), static_cast<int>(cell / tile_rows));
    }
    // The place in the scratch, (z * 32 + y) * 32 + x, of a bit of a word of a tile_mask.
    [[nodiscard]] std::size_t cell_of(unsigned word, unsigned bit) const {
        static constexpr auto places = [] { // of the Morton number of a position among 8^3
            std::array<std::uint16_t, 512> p{};
            for (unsigned z = 0; z < 8; ++z)
                for (unsigned y = 0; y < 8; ++y)
                    for (unsigned x = 0; x < 8; ++x)
                        p[core::morton_key(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z))] =
                            static_cast<std::uint16_t>((z * tile_size + y) * tile_size + x);
            return p;
        }();
        const auto z = static_cast<std::size_t>(lead_.z), y = static_cast<std::size_t>(lead_.y);
        const std::size_t first = (z * tile_size + y) * tile_size + static_cast<std::size_t>(lead_.x);
        return std::size_t{places[word]} * 4 + places[bit] - first;
    }
    // cell_of, and which word and bit it is.
    struct place {
        std::uint16_t cell;
        std::uint16_t voxel; // 64 * word + bit
    };
    [[nodiscard]] place place_of(unsigned word, unsigned bit) const {
        return {static_cast<std::uint16_t>(cell_of(word, bit)), static_cast<std::uint16_t>(64 * word + bit)};
    }

    template <std::size_t I>
    void pack_values() {
        using map = core::rank_map<target<I>>;
        auto& to = get<I>(found.values);
        to.resize(map::elements(found.num_voxels + cells_.size()));
        std::uint64_t rank = found.num_voxels;
        const bool keeps_sums = get<I>(plan_.targets).keeps_sums;
        if (keeps_sums) {
            if constexpr (core::has_wide_sums<target<I>>) pack_sums<I>();
        } else {
            for (const place& p : cells_) map::store(to.data(), rank++, load<I>(p.cell));
        }
        const auto empty = start<I>();
        for (const place& p : cells_) store<I>(p.cell, empty);
    }
    template <std::size_t I>
    void pack_sums() {
        using map = core::rank_map<target<I>>;
        using traits = typename target<I>::traits;
        const auto& t = get<I>(plan_.targets);
        auto& to = get<I>(found.values);
        auto& sums = get<I>(found.sums);
        const auto cleared = traits::begin(get<I>(plan_.background));
        std::uint64_t rank = found.num_voxels;
        const auto is_in = [](const tile_mask& mask, unsigned voxel) {
            return (mask[voxel / 64] >> (voxel % 64) & 1u) != 0;
        };
        for (const place& p : cells_) {
            const bool loaded = t.load != load_operation::clear && is_in(existed_, p.voxel);
            auto sum = t.load != load_operation::off && is_in(drawn_, p.voxel)
                           ? get<I>(shaded.sums)[p.cell]
                           : traits::begin(loaded ? load<I>(p.cell) : traits::identity());
            sums.push_back(sum);
            if (!loaded) core::add_sums(sum, cleared);
            map::store(to.data(), rank++, traits::end(sum));
        }
    }

    const sparse_plan<Targets...>& plan_;
    core::pack<memory<Targets>...> memory_;
    glm::ivec3 lead_{0};
    tile_mask drawn_{}, existed_{}; // that keep a fragment of this call, and that did before
    std::uint64_t in_tile_ = 0;     // bricks that tiles have so far
    std::vector<place> cells_;      // of the voxels that exist, in Morton order
};

} // namespace voxelpipe::cpu
