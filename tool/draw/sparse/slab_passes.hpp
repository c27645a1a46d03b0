// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What follows from the whole grid, for slabs that are drawn one by one: the flood of --solid exterior, what the sides
// of the grid see along z for color-outer, and the mean colours that fill a solid. Each takes a pass over all slabs
// before the first is drawn. What a slab gives a pass are bricks, or sums of integers, so no order shows; processes
// that draw slabs of one model share it through files (pass_files.hpp).

#include "draw/outside.hpp"
#include "draw/pass_files.hpp"
#include "draw/solid.hpp"
#include "draw/voxelizer.hpp"
#include "model/sparse_volume.hpp"
#include "sparse_voxelizer.hpp"

#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/repairs.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

// In their order: the mean of color-outer needs what is seen.
enum class slab_pass : std::uint8_t { walls, columns, means };

// Members throw memory_error, std::bad_alloc, write_error, and std::system_error of files.
class slab_passes {
public:
    // request: of the whole grid, with its padding. with_means: the mean of colours is needed. slabs: layers that
    // ascend and make it up. drawn: those that will be. room: bytes that the run may take. folder: for temporary files.
    // kept: null if no other run shares the slabs.
    slab_passes(const voxelize_request& request, bool with_means, std::span<const voxelpipe::slabs::layer_range> slabs,
                std::span<const std::size_t> drawn, double room, std::filesystem::path folder, const pass_files* kept);

    // True if each slab's inside is known without a triangle of it.
    [[nodiscard]] bool floods() const { return floods_; }
    // Passes that a slab has to be drawn for.
    [[nodiscard]] int left_of(std::size_t slab) const;

    // Does what is left. draw(pass, slab) calls add() with the slab, or with all its parts. Adds times and counts.
    void run(const std::function<void(slab_pass, std::size_t)>& draw, voxelize_stats& stats);
    // What a slab gives a pass, drawn from a model. The request of walls has the padding, which may be walls too.
    [[nodiscard]] sparse_volume draw(slab_pass pass, sparse_drawer& model, voxelize_request part);
    void add(slab_pass pass, const sparse_volume& drawn);

    // Once all is done: for the request of a slab or of a part of it, which refers to this, the flood until the next
    // one's. Slabs come in order.
    void give_to(voxelize_request& part);

private:
    using bytes = std::vector<std::byte>;
    [[nodiscard]] std::optional<bytes> kept(const std::string& what, std::size_t slab) const;
    void keep(const std::string& what, std::size_t slab, std::span<const std::byte> found) const;
    // Adds what has been kept of a slab; false if there is nothing.
    [[nodiscard]] bool take(slab_pass pass, std::size_t slab);
    void add_bricks(slab_pass pass, const sparse_volume& bricks);
    void give_colors(voxelize_request& part);

    // ---- the flood ----
    // The layers that are flooded for a slab by itself: those whose outside its closing needs.
    [[nodiscard]] voxelpipe::slabs::layer_range flooded_for(std::size_t slab) const;
    // The slabs whose walls these layers need.
    [[nodiscard]] std::pair<std::size_t, std::size_t> walls_for(std::size_t slab) const;
    void begin_flood(const voxelpipe::slabs::layer_range& layers);
    // What is outside beside each slab's layers, from the flood of the whole.
    void keep_borders();
    // True if a slab can be flooded by itself, from what has been kept.
    [[nodiscard]] bool has_borders(std::size_t slab) const;
    void flood_slab(std::size_t slab);

    [[noreturn]] void lose() const;

    const voxelize_request& request_;
    std::vector<voxelpipe::slabs::layer_range> slabs_;
    double room_;
    std::filesystem::path folder_;
    const pass_files* kept_;
    bool floods_, sees_, fills_;
    std::vector<slab_pass> left_;            // passes to do
    std::array<std::vector<bool>, 3> known_; // by pass and slab
    bytes found_;                            // of the slab that is drawn

    std::optional<voxelpipe::slabs::solid_repairs> flood_; // of the whole grid, or of one slab
    bool is_whole_ = true;
    std::size_t flooded_ = ~std::size_t{0}; // the slab
    column_table seen_;                     // along z alone
    color_mean mean_;
    std::array<color_mean::sums, target_count> sums_{};
    fill_means means_{};
};

} // namespace voxelize
