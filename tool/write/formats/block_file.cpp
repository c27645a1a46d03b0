// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "block_file.hpp"

#include "deflate.hpp"
#include "model/parallel.hpp"
#include "output_file.hpp"
#include "progress.hpp"

#include <algorithm>
#include <bit>

namespace voxelize {
namespace {

// The blocks of voxels, with those of the last colours kept: voxels beside each other often have one.
class block_chooser {
public:
    block_chooser(const voxel_shape& v, const block_list& list) : v_(v), list_(list), known_(size) {}

    std::uint16_t of(std::size_t brick, const glm::ivec3& voxel) {
        if (v_.has_materials() && !list_.of_number.empty())
            if (const auto found = list_.of_number.find(v_.material(brick, voxel)); found != list_.of_number.end())
                return found->second;
        const std::uint32_t rgb = v_.rgb(brick, voxel);
        known& entry = known_[(rgb * 2654435761U >> 20U) % size];
        if (entry.block == 0 || entry.rgb != rgb) entry = {rgb, list_.nearest(rgb)};
        return entry.block;
    }

private:
    struct known {
        std::uint32_t rgb = 0;
        std::uint16_t block = 0; // 0: none is known
    };
    static constexpr std::size_t size = 4096;
    const voxel_shape& v_;
    const block_list& list_;
    std::vector<known> known_;
};

} // namespace

block_grid::block_grid(const voxel_shape& v, const write_options& options)
    : v_(v), order_(v, 2), list_(options.blocks ? options.blocks.get() : &default_blocks()), up_(options.up),
      size_(v.extent) {
    if (up_ == up_axis::z) std::swap(size_[1], size_[2]);
    rows_ = size_[1] * size_[2];
    constexpr std::int64_t piece_blocks = 1 << 19, longs = 64;
    piece_rows_ = std::max(longs, piece_blocks / size_[0] / longs * longs);
}

std::vector<std::uint16_t> block_grid::piece(std::size_t n) const {
    const std::int64_t from = static_cast<std::int64_t>(n) * piece_rows_, to = std::min(rows_, from + piece_rows_);
    std::vector<std::uint16_t> out(static_cast<std::size_t>((to - from) * size_[0]));
    block_chooser chooser(v_, *list_);
    std::uint16_t* row = out.data();
    for (std::int64_t r = from; r < to; ++r, row += size_[0]) {
        const std::int64_t y = r / size_[2], z = r % size_[2];
        const std::int64_t j = up_ == up_axis::y ? y : v_.extent[1] - 1 - z, k = up_ == up_axis::y ? z : y;
        const auto n_in = static_cast<unsigned>(k % 8), b_in = static_cast<unsigned>(j % 8);
        for (const brick_order::placed& p :
             brick_order::row_of(order_.layer_at(static_cast<int>(k / 8)), static_cast<int>(j / 8)))
            for (unsigned bits = brick_row(v_.mask(p.brick), 2, n_in, b_in); bits != 0; bits &= bits - 1) {
                const glm::ivec3 voxel = order_.voxel_at(p, n_in, static_cast<unsigned>(std::countr_zero(bits)), b_in);
                row[voxel.x] = chooser.of(p.brick, voxel);
            }
    }
    return out;
}

std::vector<std::filesystem::path>
write_block_file(const block_grid& grid, const nbt& head, const nbt& tail,
                 const std::function<std::vector<std::byte>(std::span<const std::uint16_t>)>& encode,
                 const std::filesystem::path& path, const write_options& options) {
    output_file out(path);
    progress_meter meter(options.progress, grid.num_pieces());
    constexpr std::array<std::uint8_t, 10> gzip_head{0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255}; // no name, time or system
    out.write(std::as_bytes(std::span{gzip_head}));
    piece_compressor compressor(piece_compressor::form::stream_part, std::max(1, options.compression));
    running_crc whole;
    const auto add = [&](const compressed_piece& piece) {
        out.write(piece.bytes);
        whole.add(piece);
    };
    add(*compressor.compress(head.bytes(), head.bytes().size()));
    ordered_for(
        grid.num_pieces(), thread_count(options.threads),
        [&](std::size_t n) { return compressor.compress(encode(grid.piece(n)), 1); },
        [&](std::size_t, const std::shared_ptr<const compressed_piece>& piece) {
            add(*piece);
            meter.advance(1);
        });
    add(*compressor.compress(tail.bytes(), tail.bytes().size()));
    out.write(deflate_end);
    out.write_value(whole.crc);
    out.write_value(static_cast<std::uint32_t>(whole.size)); // modulo 2^32, as gzip has it
    out.commit();
    return {path};
}

} // namespace voxelize
