// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vox.hpp"

#include "model/parallel.hpp"
#include "palette.hpp"
#include "progress.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

using int3 = std::array<std::int64_t, 3>;

constexpr std::int64_t max_side = 256;
constexpr std::int64_t scene_low = -1000, scene_high = 999; // coordinates of MagicaVoxel's scene
constexpr std::size_t palette_entries = 255;                // index 0 means empty

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

// One model: voxels [low, low + size) of the volume, and its bricks, which are neighbours in Morton order.
struct block {
    int3 low{};
    int3 size{};
    std::size_t first = 0, last = 0; // bricks
    std::uint64_t count = 0;         // voxels
};

// Blocks of 256 with something in them, z slowest; the first one if all are empty, since a file has at least one model.
std::vector<block> split(const voxel_shape& v) {
    constexpr int log2_bricks = 3 * 5; // 32 along each axis
    static_assert(max_side == std::int64_t{8} << log2_bricks / 3);
    const auto block_at = [&](const int3& low) {
        block b{low};
        for (std::size_t a = 0; a < 3; ++a) b.size[a] = std::min(max_side, v.extent[a] - low[a]);
        return b;
    };
    std::vector<block> blocks;
    for (std::size_t first = 0, last = 0; first < v.num_bricks(); first = last) {
        const std::uint64_t key = v.key(first) >> log2_bricks;
        while (last < v.num_bricks() && v.key(last) >> log2_bricks == key) ++last;
        const glm::ivec3 at = voxelpipe::core::morton_position(key);
        block& b = blocks.emplace_back(block_at({at.x * max_side, at.y * max_side, at.z * max_side}));
        b.first = first;
        b.last = last;
        b.count = v.first_rank(last) - v.first_rank(first);
    }
    if (blocks.empty()) blocks.push_back(block_at({0, 0, 0}));
    std::sort(blocks.begin(), blocks.end(), [](const block& a, const block& b) {
        return std::tie(a.low[2], a.low[1], a.low[0]) < std::tie(b.low[2], b.low[1], b.low[0]);
    });
    return blocks;
}

// From the volume's axes to MagicaVoxel's.
class axes {
public:
    axes(const voxel_shape& v, up_axis up) : extent_(v.extent), turn_(up == up_axis::y) {}

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
    palette colors_used;
    std::vector<std::uint8_t> index_of; // empty: every voxel has index 1

    [[nodiscard]] std::uint8_t index(std::uint32_t rgb) const {
        return index_of.empty() ? std::uint8_t{1} : index_of[rgb];
    }
};

coloring make_coloring(const voxel_shape& v, int threads) {
    coloring result;
    if (!v.colored()) {
        result.colors_used.entries = {clay};
        return result;
    }
    std::vector<std::uint32_t> histogram(std::size_t{1} << 24); // a file has fewer than 2^29 voxels
    constexpr std::size_t bricks_at_once = 256;
    parallel_for((v.num_bricks() + bricks_at_once - 1) / bricks_at_once, threads, [&](std::size_t part) {
        const std::size_t first = part * bricks_at_once, last = std::min(v.num_bricks(), first + bricks_at_once);
        for (std::size_t b = first; b < last; ++b)
            v.for_each_color(
                b, [&](std::uint32_t rgb) { std::atomic_ref(histogram[rgb]).fetch_add(1, std::memory_order_relaxed); });
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

void write_model(output_file& out, const voxel_shape& v, const block& b, const axes& to_file, const coloring& colors,
                 int threads) {
    chunk_bytes size;
    for (const std::int64_t s : to_file.size(b.size)) size.integer(s);
    write_chunk(out, "SIZE", size);
    write_chunk_head(out, "XYZI", 4 + 4 * b.count, 0);
    out.write_value(static_cast<std::int32_t>(b.count));
    const int3 low = to_file.low(b.low, b.size);
    const brick_order order(v, 2, b.first, b.last);
    ordered_for(
        order.num_layers(), threads,
        [&](std::size_t n) {
            std::vector<std::byte> layer;
            for (unsigned k = 0; k < 8; ++k)
                order.for_each_voxel(order.layer(n), k, [&](std::size_t brick, const glm::ivec3& voxel) {
                    const int3 at = to_file.low({voxel.x, voxel.y, voxel.z}, {1, 1, 1});
                    for (std::size_t a = 0; a < 3; ++a) layer.push_back(static_cast<std::byte>(at[a] - low[a]));
                    layer.push_back(static_cast<std::byte>(colors.index(v.rgb(brick, voxel))));
                });
            return layer;
        },
        [&](std::size_t, const std::vector<std::byte>& layer) { out.write(layer); });
}

// The coordinate of the file that stands on the scene's origin: the middle of the grid, and its lowest layer.
int3 scene_origin(const voxel_shape& v, const axes& to_file) {
    const int3 whole = to_file.size(v.extent);
    return {whole[0] / 2, whole[1] / 2, 0};
}

// Says where models that the scene graph places lie beyond MagicaVoxel's scene; empty where none does.
std::string beyond_scene(const voxel_shape& v, const std::vector<block>& blocks, const axes& to_file) {
    const int3 origin = scene_origin(v, to_file);
    int3 low{}, high{};
    std::size_t beyond = 0;
    for (std::size_t n = 0; n < blocks.size(); ++n) {
        const int3 corner = to_file.low(blocks[n].low, blocks[n].size), size = to_file.size(blocks[n].size);
        bool is_within = true;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t first = corner[a] - origin[a], last = first + size[a] - 1;
            low[a] = n == 0 ? first : std::min(low[a], first);
            high[a] = n == 0 ? last : std::max(high[a], last);
            is_within = is_within && first >= scene_low && last <= scene_high;
        }
        beyond += is_within ? 0 : 1;
    }
    if (beyond == 0) return "";
    const auto point = [](const int3& p) {
        return '(' + std::to_string(p[0]) + ", " + std::to_string(p[1]) + ", " + std::to_string(p[2]) + ')';
    };
    return std::to_string(beyond) + " of " + std::to_string(blocks.size()) +
           " models lie in part or whole beyond MagicaVoxel's scene, which has the coordinates " +
           std::to_string(scene_low) + " to " + std::to_string(scene_high) + ": they reach from " + point(low) +
           " to " + point(high) + "; take fewer voxels";
}

// Root transform 0 -> group 1 -> for model n: transform 2 + 2n -> shape 3 + 2n. A transform carries the model's centre,
// floor(size / 2), to its position.
std::vector<std::pair<std::string_view, chunk_bytes>>
scene_graph(const voxel_shape& v, const std::vector<block>& blocks, const axes& to_file) {
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

    const int3 origin = scene_origin(v, to_file);
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

std::vector<std::filesystem::path> write_vox(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    const int threads = thread_count(options.threads);
    const std::vector<block> blocks = split(v);
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

    const coloring colors = make_coloring(v, threads);
    progress_meter meter(options.progress, blocks.size());
    output_file out(path);
    out.write("VOX ");
    out.write_value<std::int32_t>(single ? 150 : 200);
    write_chunk_head(out, "MAIN", 0, children);
    for (const block& b : blocks) {
        write_model(out, v, b, to_file, colors, threads);
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
    if (!single && options.warn)
        if (const std::string warning = beyond_scene(v, blocks, to_file); !warning.empty())
            options.warn("'" + path.string() + "': " + warning);
    return {path};
}

} // namespace voxelize
