// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Writes sparse grids as NanoVDB files (.nvdb), brick by brick: memory is in proportion to the nodes above the leaves.
// The same grids give the same bytes. Indices in the file are voxels of the whole grid, and the map puts an index at
// the centre of its voxel. Nodes carry their boxes and, for numbers, least, greatest, mean and deviation (of the
// squared length, for vectors and colours, as NanoVDB has it). The checksum is of grid, tree and root; nothing is
// compressed.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/host_sparse.hpp>
#include <voxelpipe/io/nanovdb_layout.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <ostream>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelpipe::io {

// Takes the bytes of a file, in order; throws where they cannot be kept.
using byte_sink = std::function<void(const void* bytes, std::size_t count)>;

namespace nanovdb {

static_assert(std::endian::native == std::endian::little,
              "voxelpipe: files of NanoVDB are written on such machines only");

// ---- statistics
// -------------------------------------------------------------------------------------------------------

// Number, sum and sum of squares of what a node holds, and its extremes; in the order of the leaves, so the same bits
// everywhere.
template <class T>
struct statistics {
    using stored = typename value_type<T>::stored;
    std::uint64_t count = 0;
    double sum = 0, squares = 0, low = 0, high = 0;
    stored minimum{}, maximum{};
    box voxels{{INT32_MAX, INT32_MAX, INT32_MAX}, {INT32_MIN, INT32_MIN, INT32_MIN}};

    // A value as one number: itself, or a squared length.
    [[nodiscard]] static double size_of(const stored& v) {
        if constexpr (std::is_same_v<stored, rgba8>) {
            double squared = 0;
            for (int c = 0; c < 3; ++c) {
                const double level = (v.packed >> (8 * c) & 255u) / 255.0;
                squared = exact::fma(level, level, squared);
            }
            return squared;
        } else if constexpr (std::is_arithmetic_v<stored>) {
            return static_cast<double>(v);
        } else {
            double squared = 0;
            for (glm::length_t c = 0; c < stored::length(); ++c)
                squared = exact::fma(double{v[c]}, double{v[c]}, squared);
            return squared;
        }
    }
    void add(const stored& v) {
        if constexpr (value_type<T>::has_statistics) {
            const double size = size_of(v);
            if (count == 0 || size < low) {
                low = size;
                minimum = v;
            }
            if (count == 0 || size > high) {
                high = size;
                maximum = v;
            }
            sum += size;
            squares = exact::fma(size, size, squares);
        }
        ++count;
    }
    void add(const statistics& other) {
        if (other.count == 0) return;
        if (count == 0 || other.low < low) {
            low = other.low;
            minimum = other.minimum;
        }
        if (count == 0 || other.high > high) {
            high = other.high;
            maximum = other.maximum;
        }
        sum += other.sum;
        squares += other.squares;
        count += other.count;
        for (int a = 0; a < 3; ++a) {
            voxels.low[a] = std::min(voxels.low[a], other.voxels.low[a]);
            voxels.high[a] = std::max(voxels.high[a], other.voxels.high[a]);
        }
    }
    template <class Node>
    void write_to(Node& node) const {
        if constexpr (value_type<T>::has_statistics) {
            if (count == 0) return;
            using statistic = typename value_type<T>::statistic;
            const double mean = sum / static_cast<double>(count);
            const double variance = exact::fma(-mean, mean, squares / static_cast<double>(count));
            node.minimum = minimum;
            node.maximum = maximum;
            node.average = static_cast<statistic>(mean);
            node.deviation = static_cast<statistic>(std::sqrt(std::max(variance, 0.0)));
        }
    }
};

// ---- leaves
// -----------------------------------------------------------------------------------------------------------

// The place in a leaf, (x * 8 + y) * 8 + z, of each voxel of a brick in Morton order.
inline constexpr auto leaf_places = [] {
    std::array<std::uint16_t, 512> p{};
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            for (int z = 0; z < 8; ++z) p[core::morton_key(x, y, z)] = static_cast<std::uint16_t>((x * 8 + y) * 8 + z);
    return p;
}();

// The box of a brick's voxels, in the whole grid.
[[nodiscard]] inline box box_of(const brick_mask& mask, const glm::ivec3& origin) {
    box b{{7, 7, 7}, {0, 0, 0}};
    for (unsigned w = 0; w < 8; ++w) {
        for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1) {
            const glm::ivec3 p = core::morton_position(64 * w + static_cast<unsigned>(std::countr_zero(word)));
            for (int a = 0; a < 3; ++a) {
                b.low[a] = std::min(b.low[a], p[a]);
                b.high[a] = std::max(b.high[a], p[a]);
            }
        }
    }
    for (int a = 0; a < 3; ++a) {
        b.low[a] += origin[a];
        b.high[a] += origin[a];
    }
    return b;
}

template <class T>
using stored_value = typename value_type<T>::stored;

// A grid to write. value(rank) is asked for voxels that exist; a mask has no values.
template <class T>
struct source {
    std::string name; // at most 255 bytes
    brick_table table;
    grid where;
    stored_value<T> background{}; // what absent voxels read as
    std::function<stored_value<T>(std::uint64_t rank)> value;
};

template <class T>
[[nodiscard]] statistics<T> leaf_statistics(const source<T>& from, std::uint64_t brick) {
    statistics<T> s;
    if constexpr (value_type<T>::has_statistics) {
        for (std::uint64_t r = from.table.offsets[brick]; r < from.table.offsets[brick + 1]; ++r) s.add(from.value(r));
    } else {
        s.count = from.table.offsets[brick + 1] - from.table.offsets[brick];
    }
    s.voxels = box_of(from.table.masks[brick], core::morton_position(from.table.keys[brick]) * core::sparse_brick_size);
    return s;
}

template <class T>
void fill_leaf(const source<T>& from, std::uint64_t brick, leaf_node<T>& leaf) {
    std::memset(static_cast<void*>(&leaf), 0, sizeof(leaf));
    const statistics<T> s = leaf_statistics(from, brick);
    const glm::ivec3 origin = core::morton_position(from.table.keys[brick]) * core::sparse_brick_size;
    for (int a = 0; a < 3; ++a) {
        // The origin is found by rounding down to multiples of eight.
        leaf.head.low[a] = s.voxels.low[a];
        leaf.head.size[a] = static_cast<std::uint8_t>(s.voxels.high[a] - s.voxels.low[a]);
        VOXELPIPE_ASSERT((s.voxels.low[a] & ~7) == origin[a]);
    }
    static_cast<void>(origin);
    leaf.head.flags = 2; // has a box
    const brick_mask& mask = from.table.masks[brick];
    std::uint64_t rank = from.table.offsets[brick];
    if constexpr (!std::is_same_v<T, bool> && !std::is_same_v<T, mask_value>) {
        s.write_to(leaf);
        std::fill(std::begin(leaf.values), std::end(leaf.values), from.background);
    }
    for (unsigned w = 0; w < 8; ++w) {
        for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1, ++rank) {
            const unsigned place = leaf_places[64 * w + static_cast<unsigned>(std::countr_zero(word))];
            leaf.head.mask[place / 64] |= std::uint64_t{1} << (place % 64);
            if constexpr (std::is_same_v<T, bool>)
                leaf.values[place / 64] |= std::uint64_t{from.value(rank)} << (place % 64);
            else if constexpr (!std::is_same_v<T, mask_value>)
                leaf.values[place] = from.value(rank);
        }
    }
}

// ---- the nodes above
// --------------------------------------------------------------------------------------------------

// Nodes of one level: their Morton keys, and the first child of each among the level below, and one more.
struct level {
    std::vector<std::uint64_t> keys, first;
};
[[nodiscard]] inline level parents_of(const std::uint64_t* keys, std::uint64_t count, int shift) {
    level l;
    for (std::uint64_t i = 0; i < count; ++i) {
        if (!l.keys.empty() && l.keys.back() == keys[i] >> shift) continue;
        l.keys.push_back(keys[i] >> shift);
        l.first.push_back(i);
    }
    l.first.push_back(count);
    return l;
}

// Offsets of the parts of a grid, in bytes from its start.
template <class T>
struct grid_plan {
    using lower_node = internal_node<T, 4>;
    using upper_node = internal_node<T, 5>;
    level lower, upper;
    std::vector<std::uint64_t> root_order; // upper nodes by the keys of root tiles
    std::uint64_t root, first_upper, first_lower, first_leaf, size;

    explicit grid_plan(const brick_table& table)
        : lower(parents_of(table.keys, table.count, 12)), upper(parents_of(lower.keys.data(), lower.keys.size(), 15)) {
        root = sizeof(grid_data) + sizeof(tree_data);
        first_upper = root + sizeof(root_data<T>) + upper.keys.size() * sizeof(typename root_data<T>::tile);
        first_lower = first_upper + upper.keys.size() * sizeof(upper_node);
        first_leaf = first_lower + lower.keys.size() * sizeof(lower_node);
        size = first_leaf + table.count * sizeof(leaf_node<T>);
        for (std::uint64_t i = 0; i < upper.keys.size(); ++i) root_order.push_back(i);
        std::sort(root_order.begin(), root_order.end(),
                  [&](std::uint64_t a, std::uint64_t b) { return tile_key(upper.keys[a]) < tile_key(upper.keys[b]); });
    }
    [[nodiscard]] static std::uint64_t tile_key(std::uint64_t key) {
        const glm::ivec3 p = core::morton_position(key);
        return static_cast<std::uint64_t>(p.x) << 42 | static_cast<std::uint64_t>(p.y) << 21 |
               static_cast<std::uint64_t>(p.z);
    }
};

// A node whose children are [first, last) of the level below, child i at `child(i)` bytes from the node.
template <int Log2Size, class T, class Child>
void fill_internal(const statistics<T>& s, const stored_value<T>& background, const std::uint64_t* keys,
                   std::uint64_t first, std::uint64_t last, const Child& child, internal_node<T, Log2Size>& node) {
    std::memset(static_cast<void*>(&node), 0, sizeof(node));
    node.voxels = s.voxels;
    node.flags = 2; // has voxels
    s.write_to(node);
    for (auto& e : node.table) e.value = background;
    for (std::uint64_t i = first; i < last; ++i) {
        const glm::ivec3 p = core::morton_position(keys[i] & (internal_node<T, Log2Size>::num_children - 1));
        const auto n = static_cast<std::size_t>((p.x << (2 * Log2Size)) | (p.y << Log2Size) | p.z);
        node.child_mask[n / 64] |= std::uint64_t{1} << (n % 64);
        node.table[n].child = child(i);
    }
}

[[nodiscard]] inline std::uint32_t crc32(const void* bytes, std::size_t count) {
    static constexpr auto table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t n = 0; n < 256; ++n) {
            std::uint32_t c = n;
            for (int i = 0; i < 8; ++i) c = (c >> 1) ^ ((c & 1u) != 0 ? 0xedb88320u : 0);
            t[n] = c;
        }
        return t;
    }();
    std::uint32_t c = ~0u;
    for (std::size_t i = 0; i < count; ++i)
        c = table[(c ^ static_cast<const unsigned char*>(bytes)[i]) & 255u] ^ (c >> 8);
    return ~c;
}

[[nodiscard]] inline std::uint64_t hash_of(const std::string& name) {
    std::uint64_t hash = 0;
    for (const char c : name) {
        const std::uint64_t overflow = hash >> 56;
        hash = hash * 67 + static_cast<unsigned char>(c) + overflow;
    }
    return hash;
}

[[nodiscard]] inline affine_map map_of(const grid& g) {
    affine_map m{};
    for (int a = 0; a < 3; ++a) {
        const std::size_t diagonal = 4 * static_cast<std::size_t>(a);
        m.matrix[diagonal] = g.voxel_size[a];
        m.inverse[diagonal] = 1.0 / g.voxel_size[a];
        m.translation[a] = exact::fma(0.5, g.voxel_size[a], g.origin[a]);
        m.matrix_f[diagonal] = static_cast<float>(m.matrix[diagonal]);
        m.inverse_f[diagonal] = static_cast<float>(m.inverse[diagonal]);
        m.translation_f[a] = static_cast<float>(m.translation[a]);
    }
    m.taper = 1.0;
    m.taper_f = 1.0f;
    return m;
}

// From the mapped index of the lowest voxel to that past the highest, as NanoVDB's own tools write it.
[[nodiscard]] inline world_box world_box_of(const affine_map& m, const box& voxels, bool empty) {
    world_box b{};
    for (int a = 0; a < 3; ++a) {
        const double scale = m.matrix[4 * static_cast<std::size_t>(a)];
        b.low[a] =
            empty ? std::numeric_limits<double>::max() : exact::fma(double(voxels.low[a]), scale, m.translation[a]);
        b.high[a] = empty ? std::numeric_limits<double>::lowest()
                          : exact::fma(double(voxels.high[a]) + 1.0, scale, m.translation[a]);
    }
    return b;
}

} // namespace nanovdb

// A file of one or more grids: add() each, then write() once. What the grids refer to has to stay until then.
class nanovdb_file {
public:
    // Throws std::invalid_argument for a name of more than 255 bytes, std::length_error beyond 2^32 - 1 bricks.
    template <class T>
    void add(nanovdb::source<T> from) {
        if (from.name.size() > 255) throw std::invalid_argument("voxelpipe: a grid's name has more than 255 bytes");
        if (from.table.count > std::numeric_limits<std::uint32_t>::max())
            throw std::length_error("voxelpipe: a NanoVDB grid has at most 2^32 - 1 leaves");
        grids_.push_back(std::make_unique<typed_grid<T>>(std::move(from)));
    }
    // A target of a sparse framebuffer: bits become a grid of booleans, half floats floats, small integers 32-bit ones,
    // glm::u8vec4 colours. `host` has to stay until write().
    template <std::size_t I, class... Targets>
    void add_target(const std::string& name, const host_sparse<Targets...>& host) {
        using target = typename core::pack_element<I, Targets...>::type;
        using type = file_type<typename target::value_type>;
        const auto convert = [](const typename target::value_type& v) { return convert_value<type>(v); };
        add<type>({name, host.table(), host.where, convert(get<I>(host.clear_values)),
                   [&host, convert](std::uint64_t rank) { return convert(get<I>(host)[rank]); }});
    }
    // The voxels that exist, without values.
    template <class... Targets>
    void add_mask(const std::string& name, const host_sparse<Targets...>& host) {
        add<nanovdb::mask_value>({name, host.table(), host.where, false, {}});
    }

    // Bytes of the file.
    [[nodiscard]] std::uint64_t size() const {
        std::uint64_t bytes = sizeof(nanovdb::file_header);
        for (const auto& g : grids_) bytes += sizeof(nanovdb::file_entry) + g->name().size() + 1 + g->size();
        return bytes;
    }

    // Hands all bytes to `sink`, in order.
    void write(const byte_sink& sink) const {
        nanovdb::file_header header{nanovdb::magic, nanovdb::version, static_cast<std::uint16_t>(grids_.size()), 0};
        sink(&header, sizeof(header));
        for (const auto& g : grids_) {
            const nanovdb::file_entry entry = g->prepare();
            sink(&entry, sizeof(entry));
            sink(g->name().c_str(), g->name().size() + 1);
        }
        for (const auto& g : grids_) g->write(sink);
    }
    // Throws std::runtime_error where the stream fails.
    void write(std::ostream& out) const {
        write([&](const void* bytes, std::size_t count) {
            if (!out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count)))
                throw std::runtime_error("voxelpipe: a NanoVDB file could not be written");
        });
    }

    // The type that a value has in a file.
    template <class V>
    static constexpr auto file_type_of() {
        if constexpr (std::is_same_v<V, half>)
            return float{};
        else if constexpr (std::is_same_v<V, glm::u8vec4>)
            return nanovdb::rgba8{};
        else if constexpr (std::is_same_v<V, std::uint8_t> || std::is_same_v<V, std::uint16_t>)
            return std::uint32_t{};
        else if constexpr (std::is_same_v<V, std::int8_t>)
            return std::int32_t{};
        else
            return V{};
    }
    template <class V>
    using file_type = decltype(file_type_of<V>());

private:
    struct any_grid {
        virtual ~any_grid() = default;
        [[nodiscard]] virtual const std::string& name() const = 0;
        [[nodiscard]] virtual std::uint64_t size() const = 0;
        virtual nanovdb::file_entry prepare() = 0; // before write()
        virtual void write(const byte_sink& sink) const = 0;
    };
    template <class T>
    class typed_grid final : public any_grid {
    public:
        explicit typed_grid(nanovdb::source<T> from) : from_(std::move(from)), plan_(from_.table) {}
        [[nodiscard]] const std::string& name() const override { return from_.name; }
        [[nodiscard]] std::uint64_t size() const override { return plan_.size; }
        nanovdb::file_entry prepare() override;
        void write(const byte_sink& sink) const override;

    private:
        [[nodiscard]] std::vector<std::byte> head() const; // grid, tree and root

        nanovdb::source<T> from_;
        nanovdb::grid_plan<T> plan_;
        std::vector<nanovdb::statistics<T>> lower_, upper_;
        nanovdb::statistics<T> all_;
    };

    template <class To, class V>
    static nanovdb::stored_value<To> convert_value(const V& v) {
        if constexpr (std::is_same_v<To, nanovdb::rgba8>)
            return {std::uint32_t{v.r} | std::uint32_t{v.g} << 8 | std::uint32_t{v.b} << 16 | std::uint32_t{v.a} << 24};
        else
            return static_cast<nanovdb::stored_value<To>>(v);
    }

    std::vector<std::unique_ptr<any_grid>> grids_;
};

template <class T>
nanovdb::file_entry nanovdb_file::typed_grid<T>::prepare() {
    lower_.assign(plan_.lower.keys.size(), {});
    upper_.assign(plan_.upper.keys.size(), {});
    all_ = {};
    for (std::size_t u = 0; u < upper_.size(); ++u) {
        for (std::uint64_t l = plan_.upper.first[u]; l < plan_.upper.first[u + 1]; ++l) {
            for (std::uint64_t b = plan_.lower.first[l]; b < plan_.lower.first[l + 1]; ++b)
                lower_[l].add(nanovdb::leaf_statistics(from_, b));
            upper_[u].add(lower_[l]);
        }
        all_.add(upper_[u]);
    }
    nanovdb::file_entry e{};
    e.grid_size = e.file_size = plan_.size;
    e.name_hash = nanovdb::hash_of(from_.name);
    e.num_voxels = from_.table.num_voxels();
    e.type = nanovdb::value_type<T>::type;
    e.meaning = nanovdb::value_type<T>::meaning;
    e.world = nanovdb::world_box_of(nanovdb::map_of(from_.where), all_.voxels, all_.count == 0);
    e.voxels = all_.voxels;
    for (int a = 0; a < 3; ++a) e.voxel_size[a] = from_.where.voxel_size[a];
    e.name_size = static_cast<std::uint32_t>(from_.name.size() + 1);
    e.node_count[0] = static_cast<std::uint32_t>(from_.table.count);
    e.node_count[1] = static_cast<std::uint32_t>(lower_.size());
    e.node_count[2] = static_cast<std::uint32_t>(upper_.size());
    e.node_count[3] = 1;
    e.version = nanovdb::version;
    return e;
}

template <class T>
std::vector<std::byte> nanovdb_file::typed_grid<T>::head() const {
    using namespace nanovdb;
    using root_type = root_data<T>;
    std::vector<std::byte> bytes(plan_.first_upper);
    grid_data g{};
    g.magic = magic;
    g.version = version;
    g.flags = is_breadth_first;
    if (all_.count != 0) g.flags |= has_bounding_box;
    if (value_type<T>::has_statistics) g.flags |= has_extrema | has_average | has_deviation;
    g.grid_count = 1;
    g.grid_size = plan_.size;
    std::memcpy(g.name, from_.name.data(), from_.name.size());
    g.map = map_of(from_.where);
    g.world = world_box_of(g.map, all_.voxels, all_.count == 0);
    for (int a = 0; a < 3; ++a) g.voxel_size[a] = from_.where.voxel_size[a];
    g.meaning = value_type<T>::meaning;
    g.type = value_type<T>::type;
    tree_data t{};
    if (from_.table.count != 0) {
        t.node_offset[0] = plan_.first_leaf - sizeof(grid_data);
        t.node_offset[1] = plan_.first_lower - sizeof(grid_data);
        t.node_offset[2] = plan_.first_upper - sizeof(grid_data);
    }
    t.node_offset[3] = plan_.root - sizeof(grid_data);
    t.node_count[0] = static_cast<std::uint32_t>(from_.table.count);
    t.node_count[1] = static_cast<std::uint32_t>(lower_.size());
    t.node_count[2] = static_cast<std::uint32_t>(upper_.size());
    t.num_voxels = from_.table.num_voxels();
    root_type root;
    std::memset(static_cast<void*>(&root), 0, sizeof(root)); // padding too
    root.voxels = all_.voxels;
    root.table_size = static_cast<std::uint32_t>(upper_.size());
    root.background = from_.background;
    all_.write_to(root);
    std::memcpy(bytes.data() + sizeof(g), &t, sizeof(t));
    std::memcpy(bytes.data() + plan_.root, &root, sizeof(root));
    for (std::size_t i = 0; i < upper_.size(); ++i) {
        typename root_type::tile tile;
        std::memset(static_cast<void*>(&tile), 0, sizeof(tile));
        const std::uint64_t u = plan_.root_order[i];
        tile.key = grid_plan<T>::tile_key(plan_.upper.keys[u]);
        tile.child = static_cast<std::int64_t>(plan_.first_upper + u * sizeof(internal_node<T, 5>) - plan_.root);
        tile.value = from_.background;
        std::memcpy(bytes.data() + plan_.root + sizeof(root) + i * sizeof(tile), &tile, sizeof(tile));
    }
    std::memcpy(bytes.data(), &g, sizeof(g));
    constexpr std::size_t unchecked = 16; // the magic number, and the checksum: one of the head, and none of the nodes
    const std::uint64_t checksum =
        crc32(bytes.data() + unchecked, bytes.size() - unchecked) | std::uint64_t{0xffffffffu} << 32;
    std::memcpy(bytes.data() + 8, &checksum, sizeof(checksum));
    return bytes;
}

template <class T>
void nanovdb_file::typed_grid<T>::write(const byte_sink& sink) const {
    using namespace nanovdb;
    using lower_node = internal_node<T, 4>;
    using upper_node = internal_node<T, 5>;
    const std::vector<std::byte> start = head();
    sink(start.data(), start.size());
    const auto from_to = [](std::uint64_t from, std::uint64_t to) { return static_cast<std::int64_t>(to - from); };
    {
        const auto node = std::make_unique<upper_node>();
        for (std::size_t u = 0; u < upper_.size(); ++u) {
            const std::uint64_t here = plan_.first_upper + u * sizeof(upper_node);
            fill_internal<5>(
                upper_[u], from_.background, plan_.lower.keys.data(), plan_.upper.first[u], plan_.upper.first[u + 1],
                [&](std::uint64_t l) { return from_to(here, plan_.first_lower + l * sizeof(lower_node)); }, *node);
            sink(node.get(), sizeof(upper_node));
        }
    }
    {
        const auto node = std::make_unique<lower_node>();
        for (std::size_t l = 0; l < lower_.size(); ++l) {
            const std::uint64_t here = plan_.first_lower + l * sizeof(lower_node);
            fill_internal<4>(
                lower_[l], from_.background, from_.table.keys, plan_.lower.first[l], plan_.lower.first[l + 1],
                [&](std::uint64_t b) { return from_to(here, plan_.first_leaf + b * sizeof(leaf_node<T>)); }, *node);
            sink(node.get(), sizeof(lower_node));
        }
    }
    constexpr std::size_t batch = 256;
    const auto leaves = std::make_unique<leaf_node<T>[]>(batch);
    for (std::uint64_t b = 0; b < from_.table.count; b += batch) {
        const std::size_t n = std::min<std::uint64_t>(batch, from_.table.count - b);
        for (std::size_t i = 0; i < n; ++i) fill_leaf(from_, b + i, leaves[i]);
        sink(leaves.get(), n * sizeof(leaf_node<T>));
    }
}

} // namespace voxelpipe::io
