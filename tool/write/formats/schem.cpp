// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "schem.hpp"

#include "deflate.hpp"
#include "model/parallel.hpp"
#include "progress.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string>

namespace voxelize {
namespace {

constexpr std::array<block_color, 49> blocks{{
    {"white_concrete", {207, 213, 214}},
    {"orange_concrete", {224, 97, 1}},
    {"magenta_concrete", {169, 48, 159}},
    {"light_blue_concrete", {36, 137, 199}},
    {"yellow_concrete", {241, 175, 21}},
    {"lime_concrete", {94, 169, 25}},
    {"pink_concrete", {214, 101, 143}},
    {"gray_concrete", {55, 58, 62}},
    {"light_gray_concrete", {125, 125, 115}},
    {"cyan_concrete", {21, 119, 136}},
    {"purple_concrete", {100, 32, 156}},
    {"blue_concrete", {45, 47, 143}},
    {"brown_concrete", {96, 60, 32}},
    {"green_concrete", {73, 91, 36}},
    {"red_concrete", {142, 33, 33}},
    {"black_concrete", {8, 10, 15}},
    {"white_wool", {234, 236, 237}},
    {"orange_wool", {241, 118, 20}},
    {"magenta_wool", {190, 69, 180}},
    {"light_blue_wool", {58, 175, 217}},
    {"yellow_wool", {249, 198, 40}},
    {"lime_wool", {112, 185, 26}},
    {"pink_wool", {238, 141, 172}},
    {"gray_wool", {63, 68, 72}},
    {"light_gray_wool", {142, 142, 135}},
    {"cyan_wool", {21, 138, 145}},
    {"purple_wool", {122, 42, 173}},
    {"blue_wool", {53, 57, 157}},
    {"brown_wool", {114, 72, 41}},
    {"green_wool", {85, 110, 28}},
    {"red_wool", {161, 39, 35}},
    {"black_wool", {21, 21, 26}},
    {"terracotta", {152, 94, 68}},
    {"white_terracotta", {210, 178, 161}},
    {"orange_terracotta", {162, 84, 38}},
    {"magenta_terracotta", {150, 88, 109}},
    {"light_blue_terracotta", {113, 109, 138}},
    {"yellow_terracotta", {186, 133, 35}},
    {"lime_terracotta", {104, 118, 53}},
    {"pink_terracotta", {162, 78, 79}},
    {"gray_terracotta", {58, 42, 36}},
    {"light_gray_terracotta", {135, 107, 98}},
    {"cyan_terracotta", {87, 91, 91}},
    {"purple_terracotta", {118, 70, 86}},
    {"blue_terracotta", {74, 60, 91}},
    {"brown_terracotta", {77, 51, 36}},
    {"green_terracotta", {76, 83, 42}},
    {"red_terracotta", {143, 61, 47}},
    {"black_terracotta", {37, 23, 16}},
}};
static_assert(blocks.size() < 128, "a block's number takes one byte");

// The number in the file of the block nearest to a colour, the lowest of equals.
std::byte nearest_block(std::uint32_t rgb) {
    std::size_t best = 0;
    int least = std::numeric_limits<int>::max();
    for (std::size_t n = 0; n < blocks.size(); ++n) {
        int distance = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const int d = blocks[n].color[a] - static_cast<int>(rgb >> 8 * a & 0xffU);
            distance += d * d;
        }
        if (distance < least) {
            least = distance;
            best = n;
        }
    }
    return static_cast<std::byte>(best + 1);
}

// A tree of named tags; numbers lie big end first.
class nbt {
public:
    enum tag : std::uint8_t {
        end = 0,
        short_int = 2,
        int32 = 3,
        byte_array = 7,
        list = 9,
        compound = 10,
        int_array = 11
    };

    void begin(tag kind, std::string_view name) {
        number(kind, 1);
        number(static_cast<std::int64_t>(name.size()), 2);
        bytes_.append(name);
    }
    void number(std::int64_t value, int bytes) {
        while (bytes-- > 0) bytes_.push_back(static_cast<char>(value >> (8 * bytes)));
    }
    void named(std::string_view name, std::int64_t value, tag kind = int32) {
        begin(kind, name);
        number(value, kind == short_int ? 2 : 4);
    }
    [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span{bytes_}); }

private:
    std::string bytes_;
};

// All up to the blocks themselves.
nbt head_of(const std::array<std::int64_t, 3>& size) {
    nbt head;
    head.begin(nbt::compound, "Schematic");
    head.named("Version", 2);
    constexpr int minecraft_1_13 = 1519; // the first that has these names; later ones load what earlier ones saved
    head.named("DataVersion", minecraft_1_13);
    head.named("Width", size[0], nbt::short_int);
    head.named("Height", size[1], nbt::short_int);
    head.named("Length", size[2], nbt::short_int);
    head.begin(nbt::int_array, "Offset");
    head.number(3, 4);
    for (int axis = 0; axis < 3; ++axis) head.number(0, 4);
    head.begin(nbt::compound, "Metadata");
    for (const char* name : {"WEOffsetX", "WEOffsetY", "WEOffsetZ"}) head.named(name, 0);
    head.number(nbt::end, 1);
    head.named("PaletteMax", static_cast<std::int64_t>(blocks.size()) + 1);
    head.begin(nbt::compound, "Palette");
    head.named("minecraft:air", 0);
    for (std::size_t n = 0; n < blocks.size(); ++n)
        head.named("minecraft:" + std::string(blocks[n].name), static_cast<std::int64_t>(n) + 1);
    head.number(nbt::end, 1);
    head.begin(nbt::byte_array, "BlockData");
    head.number(size[0] * size[1] * size[2], 4);
    return head;
}

nbt tail() {
    nbt after;
    after.begin(nbt::list, "BlockEntities");
    after.number(nbt::compound, 1);
    after.number(0, 4);
    after.number(nbt::end, 1);
    return after;
}

// Rows [from, to) of the file's blocks: x fastest, then the file's z, then its y.
std::vector<std::byte> block_rows(const voxel_shape& v, const brick_order& order, up_axis up, std::int64_t from,
                                  std::int64_t to) {
    const std::int64_t length = up == up_axis::y ? v.extent[2] : v.extent[1];
    std::vector<std::byte> out(static_cast<std::size_t>((to - from) * v.extent[0]));
    std::byte* row = out.data();
    std::uint32_t last_color = ~std::uint32_t{0}; // no colour
    std::byte last{};
    for (std::int64_t r = from; r < to; ++r, row += v.extent[0]) {
        const std::int64_t y = r / length, z = r % length;
        const std::int64_t j = up == up_axis::y ? y : v.extent[1] - 1 - z, k = up == up_axis::y ? z : y;
        const auto bricks = brick_order::row_of(order.layer_at(static_cast<int>(k / 8)), static_cast<int>(j / 8));
        for (const brick_order::placed& p : bricks) {
            const auto n = static_cast<unsigned>(k % 8), b = static_cast<unsigned>(j % 8);
            for (unsigned bits = brick_row(v.mask(p.brick), 2, n, b); bits != 0; bits &= bits - 1) {
                const glm::ivec3 voxel = order.voxel_at(p, n, static_cast<unsigned>(std::countr_zero(bits)), b);
                const std::uint32_t color = v.rgb(p.brick, voxel);
                if (color != last_color) last = nearest_block(last_color = color);
                row[voxel.x] = last;
            }
        }
    }
    return out;
}

} // namespace

std::span<const block_color> schem_blocks() { return blocks; }

std::vector<std::filesystem::path> write_schem(const voxel_shape& v, const std::filesystem::path& path,
                                               const write_options& options) {
    constexpr std::int64_t most_side = std::numeric_limits<std::int16_t>::max();
    constexpr std::int64_t most_blocks = std::numeric_limits<std::int32_t>::max();
    if (*std::max_element(v.extent.begin(), v.extent.end()) > most_side ||
        v.extent[0] * v.extent[1] * v.extent[2] > most_blocks)
        throw write_error(path, "too large for .schem, which ends at 32767 blocks a side and 2^31 in all; use .npz, "
                                ".vti or .nrrd");
    std::array<std::int64_t, 3> size = v.extent;
    if (options.up == up_axis::z) std::swap(size[1], size[2]);
    const std::int64_t rows = size[1] * size[2];
    const std::int64_t piece_rows = std::max<std::int64_t>(1, (std::int64_t{1} << 20) / size[0]);
    const auto pieces = static_cast<std::size_t>((rows + piece_rows - 1) / piece_rows);
    const brick_order order(v, 2);

    output_file out(path);
    progress_meter meter(options.progress, pieces);
    constexpr std::array<std::uint8_t, 10> gzip_head{0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255}; // no name, time or system
    out.write(std::as_bytes(std::span{gzip_head}));
    piece_compressor compressor(piece_compressor::form::stream_part, std::max(1, options.compression));
    running_crc whole;
    const auto add = [&](const compressed_piece& piece) {
        out.write(piece.bytes);
        whole.add(piece);
    };
    const nbt head = head_of(size), after = tail();
    add(*compressor.compress(head.bytes(), head.bytes().size()));
    ordered_for(
        pieces, thread_count(options.threads),
        [&](std::size_t n) {
            const std::int64_t from = static_cast<std::int64_t>(n) * piece_rows;
            const std::vector<std::byte> bytes =
                block_rows(v, order, options.up, from, std::min(rows, from + piece_rows));
            return compressor.compress(bytes, 1);
        },
        [&](std::size_t, const std::shared_ptr<const compressed_piece>& piece) {
            add(*piece);
            meter.advance(1);
        });
    add(*compressor.compress(after.bytes(), after.bytes().size()));
    out.write(deflate_end);
    out.write_value(whole.crc);
    out.write_value(static_cast<std::uint32_t>(whole.size)); // modulo 2^32, as gzip has it
    out.commit();
    return {path};
}

} // namespace voxelize
