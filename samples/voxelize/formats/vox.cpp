// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vox.hpp"

#include "../parallel.hpp"
#include "palette.hpp"
#include "progress.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

using int3 = std::array<std::int64_t, 3>;

constexpr std::int64_t max_side = 256;
constexpr std::size_t palette_entries = 255; // index 0 means empty

// Contents of the small chunks, collected in memory; integers are 32 bits, little end first.
class chunk_bytes {
public:
    void integer(std::int64_t value) {
        const auto narrow = static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
        for (unsigned shift = 0; shift < 32; shift += 8) byte(static_cast<std::uint8_t>(narrow >> shift));
    }
    void text(std::string_view s) {
        integer(static_cast<std::int64_t>(s.size()));
        bytes_.append(s);
    }
    void dictionary(std::initializer_list<std::pair<std::string_view, std::string_view>> pairs) {
        integer(static_cast<std::int64_t>(pairs.size()));
        for (const auto& [key, value] : pairs) {
            text(key);
            text(value);
        }
    }
    void byte(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

void write_chunk_head(output_file& out, std::string_view id, std::uint64_t content, std::uint64_t children) {
    out.write(id);
    out.write_value(static_cast<std::int32_t>(content));
    out.write_value(static_cast<std::int32_t>(children));
}

void write_chunk(output_file& out, std::string_view id, const chunk_bytes& content) {
    write_chunk_head(out, id, content.bytes().size(), 0);
    out.write(content.bytes());
}

// One model: voxels [low, low + size) of the volume, and how many of them are set.
struct block {
    int3 low{};
    int3 size{};
    std::uint64_t count = 0;
};

// Calls visit(i, j) for each set voxel of layer k of the block, in storage order.
template <class Visit>
void for_each_voxel(const volume& v, const channel& bits, const block& b, std::int64_t k, Visit visit) {
    const std::int64_t end = b.low[0] + b.size[0];
    for (std::int64_t j = b.low[1]; j < b.low[1] + b.size[1]; ++j)
        for (std::int64_t w = b.low[0] / 32; 32 * w < end; ++w)
            for (std::uint32_t word = v.word(bits, w, j, k); word != 0; word &= word - 1)
                visit(32 * w + std::countr_zero(word), j);
}

std::uint64_t count_voxels(const volume& v, const channel& bits, const block& b) {
    std::uint64_t count = 0;
    for (std::int64_t k = b.low[2]; k < b.low[2] + b.size[2]; ++k)
        for (std::int64_t j = b.low[1]; j < b.low[1] + b.size[1]; ++j)
            for (std::int64_t w = b.low[0] / 32; 32 * w < b.low[0] + b.size[0]; ++w)
                count += static_cast<std::uint64_t>(std::popcount(v.word(bits, w, j, k)));
    return count;
}

// Blocks of 256 with something in them; the first one if all are empty, since a file has at least one model.
std::vector<block> split(const volume& v, const channel& bits, int threads) {
    std::vector<block> blocks;
    for (std::int64_t k = 0; k < v.extent[2]; k += max_side)
        for (std::int64_t j = 0; j < v.extent[1]; j += max_side)
            for (std::int64_t i = 0; i < v.extent[0]; i += max_side) {
                block b{{i, j, k}, {}, 0};
                for (std::size_t a = 0; a < 3; ++a) b.size[a] = std::min(max_side, v.extent[a] - b.low[a]);
                blocks.push_back(b);
            }
    parallel_for(blocks.size(), threads, [&](std::size_t n) { blocks[n].count = count_voxels(v, bits, blocks[n]); });
    std::erase_if(blocks, [](const block& b) { return b.count == 0; });
    if (blocks.empty()) {
        block b{{0, 0, 0}, {}, 0};
        for (std::size_t a = 0; a < 3; ++a) b.size[a] = std::min(max_side, v.extent[a]);
        blocks.push_back(b);
    }
    return blocks;
}

// From the volume's axes to MagicaVoxel's.
class axes {
public:
    axes(const volume& v, up_axis up) : extent_(v.extent), turn_(up == up_axis::y) {}

    [[nodiscard]] int3 size(const int3& s) const { return turn_ ? int3{s[0], s[2], s[1]} : s; }
    // Low corner of a box; where an axis turns around, the box's high side becomes the low one.
    [[nodiscard]] int3 low(const int3& low, const int3& size) const {
        return turn_ ? int3{low[0], extent_[2] - low[2] - size[2], low[1]} : low;
    }

private:
    int3 extent_;
    bool turn_;
};

// Palette and, for each RGB value as a 24-bit number, the palette index 1..255 of the voxels that have it.
struct coloring {
    const channel* colors = nullptr; // null: every voxel has index 1
    palette colors_used;
    std::vector<std::uint8_t> index_of;

    [[nodiscard]] std::uint32_t rgb(const volume& v, std::int64_t i, std::int64_t j, std::int64_t k) const {
        const std::byte* at = colors->data.data() + v.index(i, j, k) * colors->components;
        return std::to_integer<std::uint32_t>(at[0]) | std::to_integer<std::uint32_t>(at[1]) << 8 |
               std::to_integer<std::uint32_t>(at[2]) << 16;
    }
    [[nodiscard]] std::uint8_t index(const volume& v, std::int64_t i, std::int64_t j, std::int64_t k) const {
        return colors == nullptr ? std::uint8_t{1} : index_of[rgb(v, i, j, k)];
    }
};

coloring make_coloring(const volume& v, const channel& bits, const std::vector<block>& blocks, int threads) {
    coloring result;
    result.colors = find_colors(v);
    if (result.colors == nullptr) {
        result.colors_used.entries = {clay};
        return result;
    }
    std::vector<std::uint32_t> histogram(std::size_t{1} << 24); // a file has fewer than 2^29 voxels
    for (const block& b : blocks)
        parallel_for(static_cast<std::size_t>(b.size[2]), threads, [&](std::size_t layer) {
            const std::int64_t k = b.low[2] + static_cast<std::int64_t>(layer);
            for_each_voxel(v, bits, b, k, [&](std::int64_t i, std::int64_t j) {
                std::atomic_ref(histogram[result.rgb(v, i, j, k)]).fetch_add(1, std::memory_order_relaxed);
            });
        });
    std::vector<counted_color> distinct;
    std::vector<std::uint32_t> values;
    for (std::uint32_t value = 0; value < histogram.size(); ++value) {
        if (histogram[value] == 0) continue;
        distinct.push_back({{static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
                             static_cast<std::uint8_t>(value >> 16)},
                            histogram[value]});
        values.push_back(value);
    }
    result.colors_used = make_palette(distinct, palette_entries);
    result.index_of.resize(histogram.size());
    for (std::size_t n = 0; n < values.size(); ++n)
        result.index_of[values[n]] = static_cast<std::uint8_t>(result.colors_used.entry_of[n] + 1);
    return result;
}

void write_model(output_file& out, const volume& v, const channel& bits, const block& b, const axes& to_file,
                 const coloring& colors, int threads) {
    chunk_bytes size;
    for (const std::int64_t s : to_file.size(b.size)) size.integer(s);
    write_chunk(out, "SIZE", size);
    write_chunk_head(out, "XYZI", 4 + 4 * b.count, 0);
    out.write_value(static_cast<std::int32_t>(b.count));
    const int3 low = to_file.low(b.low, b.size);
    ordered_for(
        static_cast<std::size_t>(b.size[2]), threads,
        [&](std::size_t n) {
            const std::int64_t k = b.low[2] + static_cast<std::int64_t>(n);
            std::vector<std::byte> layer;
            for_each_voxel(v, bits, b, k, [&](std::int64_t i, std::int64_t j) {
                const int3 at = to_file.low({i, j, k}, {1, 1, 1});
                for (std::size_t a = 0; a < 3; ++a) layer.push_back(static_cast<std::byte>(at[a] - low[a]));
                layer.push_back(static_cast<std::byte>(colors.index(v, i, j, k)));
            });
            return layer;
        },
        [&](std::size_t, const std::vector<std::byte>& layer) { out.write(layer); });
}

// Root transform 0 -> group 1 -> for model n: transform 2 + 2n -> shape 3 + 2n. A transform carries the model's centre,
// floor(size / 2), to its position.
std::vector<std::pair<std::string_view, chunk_bytes>> scene_graph(const volume& v, const std::vector<block>& blocks,
                                                                  const axes& to_file) {
    std::vector<std::pair<std::string_view, chunk_bytes>> chunks;
    const auto transform = [&](std::int64_t node, std::int64_t child, std::int64_t layer, const std::string* at) {
        chunk_bytes c;
        c.integer(node);
        c.dictionary({});
        c.integer(child);
        c.integer(-1); // reserved
        c.integer(layer);
        c.integer(1); // frames
        if (at != nullptr)
            c.dictionary({{"_t", *at}});
        else
            c.dictionary({});
        chunks.emplace_back("nTRN", std::move(c));
    };
    transform(0, 1, -1, nullptr);
    chunk_bytes group;
    group.integer(1);
    group.dictionary({});
    group.integer(static_cast<std::int64_t>(blocks.size()));
    for (std::size_t n = 0; n < blocks.size(); ++n) group.integer(static_cast<std::int64_t>(2 + 2 * n));
    chunks.emplace_back("nGRP", std::move(group));

    const int3 whole = to_file.size(v.extent);
    const int3 origin{whole[0] / 2, whole[1] / 2, 0};
    for (std::size_t n = 0; n < blocks.size(); ++n) {
        const auto node = static_cast<std::int64_t>(2 + 2 * n);
        const int3 low = to_file.low(blocks[n].low, blocks[n].size);
        const int3 size = to_file.size(blocks[n].size);
        std::string at;
        for (std::size_t a = 0; a < 3; ++a) {
            if (a != 0) at += ' ';
            at += std::to_string(low[a] + size[a] / 2 - origin[a]);
        }
        transform(node, node + 1, 0, &at);
        chunk_bytes shape;
        shape.integer(node + 1);
        shape.dictionary({});
        shape.integer(1); // models
        shape.integer(static_cast<std::int64_t>(n));
        shape.dictionary({});
        chunks.emplace_back("nSHP", std::move(shape));
    }
    return chunks;
}

} // namespace

std::vector<std::filesystem::path> write_vox(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    const channel& bits = *v.occupancy();
    const int threads = thread_count(options.threads);
    const std::vector<block> blocks = split(v, bits, threads);
    const axes to_file(v, options.up);
    const bool single = *std::max_element(v.extent.begin(), v.extent.end()) <= max_side;

    std::vector<std::pair<std::string_view, chunk_bytes>> graph;
    if (!single) graph = scene_graph(v, blocks, to_file);
    constexpr std::uint64_t head = 12;
    std::uint64_t children = head + 1024; // the palette
    for (const block& b : blocks) children += head + 12 + head + 4 + 4 * b.count;
    for (const auto& [id, content] : graph) children += head + content.bytes().size();
    if (children > static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()))
        throw write_error(path, "too large for .vox, whose chunks end at 2 GiB; use .npz, .vti or .nrrd");

    const coloring colors = make_coloring(v, bits, blocks, threads);
    progress_meter meter(options.progress, blocks.size());
    output_file out(path);
    out.write("VOX ");
    out.write_value<std::int32_t>(single ? 150 : 200);
    write_chunk_head(out, "MAIN", 0, children);
    for (const block& b : blocks) {
        write_model(out, v, bits, b, to_file, colors, threads);
        meter.advance(1);
    }
    for (const auto& [id, content] : graph) write_chunk(out, id, content);
    chunk_bytes rgba;
    for (std::size_t n = 0; n < 256; ++n) { // entry n is palette index n + 1; the last one is never used
        const bool used = n < colors.colors_used.entries.size();
        for (std::size_t a = 0; a < 3; ++a) rgba.byte(used ? colors.colors_used.entries[n][a] : std::uint8_t{0});
        rgba.byte(used ? std::uint8_t{255} : std::uint8_t{0});
    }
    write_chunk(out, "RGBA", rgba);
    out.commit();
    return {path};
}

} // namespace voxelize
