// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr_level_arrays.hpp"

#include "dense_stream.hpp"
#include "zarr_levels.hpp"

#include "model/resolve.hpp"
#include "model/srgb.hpp"
#include "model/targets.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/levels/dense_levels.hpp>

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
namespace reduce = voxelpipe::reduce;

constexpr int block_side = level_block_side;

// ---- what becomes of a target's values: `stored` in the arrays, load()ed for the reducer, whose results are store()d

template <class T, class Reducer>
struct plain_rule {
    using stored = T;
    using reducer = Reducer;
    [[nodiscard]] static T load(const T& value) { return value; }
    [[nodiscard]] static T store(const T& value) { return value; }
};
struct normal_rule { // the unit vector of the sum
    using stored = glm::vec3;
    using reducer = reduce::sum;
    [[nodiscard]] static glm::vec3 load(const glm::vec3& value) { return value; }
    [[nodiscard]] static glm::vec3 store(const glm::vec3& sum) { return unit_normal{&sum}(0); }
};
struct color_rule { // the mean in linear light, by alpha; of alpha the plain mean
    using stored = glm::u8vec4;
    using reducer = reduce::mean_of_voxels;
    static constexpr double one = 0xffffff; // full light: 24 bits, and 8 of alpha

    [[nodiscard]] static const color_tables& tables() {
        static const color_tables made = make_color_tables();
        return made;
    }
    [[nodiscard]] static glm::u32vec4 load(const stored& color) {
        glm::u32vec4 light(0, 0, 0, color.a);
        for (int c = 0; c < 3; ++c)
            light[c] = static_cast<std::uint32_t>(std::lround(double{tables().linear[color[c]]} * one)) * color.a;
        return light;
    }
    [[nodiscard]] static stored store(const glm::dvec4& mean) {
        if (mean.a == 0) return stored(0);
        stored color;
        for (int c = 0; c < 3; ++c) color[c] = encode_srgb(tables(), static_cast<float>(mean[c] / mean.a / one));
        color.a = static_cast<std::uint8_t>(std::lround(mean.a));
        return color;
    }
};

// Calls f with the rule of a channel.
template <class F>
void with_rule(const channel& c, const F& f) {
    const std::optional<target> id = target_named(c.name);
    if (!id || info_of(*id).type != c.type || info_of(*id).components != c.components)
        throw write_error(c.name, "no levels are known for the values of this channel");
    switch (*id) {
    case target::occupancy:
        return f(plain_rule<std::uint8_t, reduce::bit_or>{});
    case target::count:
        return f(plain_rule<std::uint32_t, reduce::max>{});
    case target::color:
    case target::color_replace:
    case target::color_outer:
        return f(color_rule{});
    case target::color_max:
        return f(plain_rule<glm::u8vec4, reduce::max>{});
    case target::normal:
        return f(normal_rule{});
    case target::material:
        return f(plain_rule<std::int32_t, reduce::majority>{});
    case target::triangle:
        return f(plain_rule<std::int32_t, reduce::max>{});
    case target::depth:
        return f(plain_rule<float, reduce::min>{});
    case target::distance: // --levels does not go with it
    case target::nearest:
        throw write_error(c.name, "distances have no levels");
    case target::fraction: // nor with these
    case target::area_vector:
    case target::area:
    case target::centroid:
    case target::links:
    case target::link_triangle:
    case target::link_material:
    case target::aperture_x:
    case target::aperture_y:
    case target::aperture_z:
        throw write_error(c.name, "cut cells have no levels");
    }
}

// ---- blocks

// The voxels of a block for reduce_levels. A voxel exists if its value is not that of an empty one.
template <class Rule>
struct block_voxels {
    using stored = typename Rule::stored;
    const std::byte* values;
    const std::byte* empty;

    [[nodiscard]] auto operator()(const glm::ivec3& v) const {
        using loaded = decltype(Rule::load(stored{}));
        const std::byte* const at =
            values + static_cast<std::size_t>((v.z * block_side + v.y) * block_side + v.x) * sizeof(stored);
        const bool exists = std::memcmp(at, empty, sizeof(stored)) != 0;
        stored value;
        std::memcpy(&value, at, sizeof(stored));
        return voxelpipe::level_voxel<loaded>{exists, exists ? Rule::load(value) : loaded{}, 1};
    }
};

// The bytes of a block; voxels beyond the grid are empty.
std::vector<std::byte> read_block(const volume& v, const channel& c, const array_values& values, const zyx& block) {
    const std::size_t each = values.voxel_bytes();
    std::vector<std::byte> bytes(static_cast<std::size_t>(block_side) * block_side * block_side * each), room;
    values.clear(bytes);
    const auto count = [&](std::size_t a) { // along z, y, x
        return std::min<std::int64_t>(block_side, v.extent[2 - a] - block[a] * block_side);
    };
    for (std::int64_t z = 0; z < count(0); ++z)
        for (std::int64_t y = 0; y < count(1); ++y) {
            const auto voxel = static_cast<std::uint64_t>(
                v.index(block[2] * block_side, block[1] * block_side + y, block[0] * block_side + z));
            const auto row =
                streamed_piece(v, c, half_floats::keep, voxel * each, static_cast<std::size_t>(count(2)) * each, room);
            std::memcpy(bytes.data() + static_cast<std::size_t>(z * block_side + y) * block_side * each, row.data(),
                        row.size());
        }
    return bytes;
}

// The values of a block in each level from 1 on, as stored; nothing if the block is empty.
template <class Rule>
std::vector<std::vector<std::byte>> reduced(const std::vector<std::byte>& block, const array_values& values,
                                            int levels) {
    using stored = typename Rule::stored;
    if (values.are_empty(block)) return {};
    stored empty;
    values.clear(std::as_writable_bytes(std::span(&empty, 1)));
    voxelpipe::cpu_backend backend(1); // blocks are shared among the threads
    const block_voxels<Rule> voxels{block.data(), reinterpret_cast<const std::byte*>(&empty)};
    const auto made = voxelpipe::reduce_levels(backend, glm::ivec3(block_side), voxels, typename Rule::reducer{});
    std::vector<std::vector<std::byte>> all;
    for (int l = 0; l < levels; ++l) {
        const auto at = static_cast<std::size_t>(l);
        const std::size_t count = made.values[at].size();
        std::vector<std::byte> bytes(count * sizeof(stored));
        for (std::size_t i = 0; i < count; ++i) {
            const stored value = made.exists[at].data()[i] != 0 ? Rule::store(made.values[at].data()[i]) : empty;
            std::memcpy(bytes.data() + i * sizeof(stored), &value, sizeof(stored));
        }
        all.push_back(std::move(bytes));
    }
    return all;
}

} // namespace

// ---- arrays

// An array of a level, filled block by block in the order of blocks_of().
class level_writer {
public:
    level_writer(int level, const volume& v, const array_values& values, const fs::path& folder,
                 const write_options& options)
        : side_(block_side >> level), file_(layout_of(level, v), values, folder, options),
          chunk_(static_cast<std::size_t>(chunk_side * chunk_side * chunk_side) * values.voxel_bytes()) {
        values.clear(chunk_);
    }
    [[nodiscard]] const array_file& file() const { return file_; }

    // A whole chunk, packed.
    void add_chunk(const zyx& block, std::span<const std::byte> packed) {
        go_to(block);
        file_.add(shard_, within_, packed);
    }
    // A part of a chunk.
    void add_part(const zyx& block, std::span<const std::byte> bytes) {
        go_to(block);
        const std::size_t each = file_.values().voxel_bytes(), row = static_cast<std::size_t>(side_) * each;
        const auto begin = [&](std::size_t a) { return block[a] * side_ % chunk_side; };
        for (std::int64_t z = 0; z < side_; ++z)
            for (std::int64_t y = 0; y < side_; ++y) {
                const std::int64_t at = ((begin(0) + z) * chunk_side + begin(1) + y) * chunk_side + begin(2);
                std::memcpy(chunk_.data() + static_cast<std::size_t>(at) * each,
                            bytes.data() + static_cast<std::size_t>(z * side_ + y) * row, row);
            }
        has_part_ = true;
    }
    void finish() {
        end_chunk();
        file_.end_shard();
        file_.finish();
    }

private:
    static array_layout layout_of(int level, const volume& v) {
        zyx extent{};
        for (std::size_t a = 0; a < 3; ++a) extent[a] = ((v.extent[2 - a] - 1) >> level) + 1;
        return array_layout(extent);
    }
    // Ends the chunk and the shard before, where the block lies in others.
    void go_to(const zyx& block) {
        const array_layout& layout = file_.layout();
        zyx shard{}, within{};
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t chunk = block[a] * side_ / chunk_side;
            shard[a] = chunk / layout.per_shard[a];
            within[a] = chunk % layout.per_shard[a];
        }
        const std::int64_t s = array_layout::number(shard, layout.shards),
                           w = array_layout::number(within, layout.per_shard);
        if (s == shard_ && w == within_) return;
        end_chunk();
        if (s != shard_) file_.end_shard();
        shard_ = s;
        within_ = w;
    }
    void end_chunk() {
        if (!has_part_) return;
        file_.add(shard_, within_, file_.pack(chunk_));
        file_.values().clear(chunk_);
        has_part_ = false;
    }

    std::int64_t side_; // of a block
    array_file file_;
    std::vector<std::byte> chunk_;
    bool has_part_ = false;
    std::int64_t shard_ = -1, within_ = -1;
};

level_arrays::level_arrays(const volume& v, const channel& c, const fs::path& folder, const write_options& options) {
    const array_values values(c, true);
    for (int l = 1; l <= num_zarr_levels(v); ++l)
        writers_.push_back(std::make_unique<level_writer>(l, v, values, folder / std::to_string(l), options));
}

level_arrays::~level_arrays() = default;

block_levels level_arrays::make(const volume& v, const channel& c, const zyx& block) const {
    const array_values& values = writers_[0]->file().values();
    block_levels made;
    with_rule(c, [&]<class Rule>(Rule) {
        made = reduced<Rule>(read_block(v, c, values, block), values, static_cast<int>(size()));
    });
    if (!made.empty()) made[0] = writers_[0]->file().pack(std::move(made[0]));
    return made;
}

void level_arrays::add(const zyx& block, const block_levels& made) {
    for (std::size_t l = 0; l < made.size(); ++l) {
        if (l == 0)
            writers_[l]->add_chunk(block, made[l]);
        else
            writers_[l]->add_part(block, made[l]);
    }
}

void level_arrays::finish() {
    for (const auto& writer : writers_) writer->finish();
}

int num_zarr_levels(const volume& v) {
    const std::int64_t longest = *std::max_element(v.extent.begin(), v.extent.end());
    int levels = 0;
    while (levels < most_levels && ((longest - 1) >> levels) + 1 > chunk_side) ++levels;
    return levels;
}

zyx num_level_blocks_along(const volume& v) {
    zyx count{};
    for (std::size_t a = 0; a < 3; ++a) count[a] = (v.extent[2 - a] + block_side - 1) / block_side;
    return count;
}

std::vector<zyx> level_blocks(const volume& v, std::int64_t first, std::int64_t last) {
    std::vector<std::pair<std::uint64_t, zyx>> keyed;
    const zyx count = num_level_blocks_along(v);
    for (std::int64_t z = first; z < last; ++z)
        for (std::int64_t y = 0; y < count[1]; ++y)
            for (std::int64_t x = 0; x < count[2]; ++x)
                keyed.push_back(
                    {voxelpipe::core::morton_key(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)),
                     {z, y, x}});
    std::sort(keyed.begin(), keyed.end());
    std::vector<zyx> blocks;
    blocks.reserve(keyed.size());
    for (const auto& [key, block] : keyed) blocks.push_back(block);
    return blocks;
}

} // namespace voxelize
