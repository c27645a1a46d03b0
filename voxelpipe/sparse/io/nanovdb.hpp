// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Writes sparse grids as NanoVDB files (.nvdb), brick by brick: memory is in proportion to the nodes above the leaves.
// The same grids give the same bytes. Indices in the file are voxels of the whole grid, and the map puts an index at
// the centre of its voxel. Nodes carry their boxes and, for numbers, least, greatest, mean and deviation (of the
// squared length, for vectors and colours, as NanoVDB has it). The checksum is of grid, tree and root; nothing is
// compressed.

#include <voxelpipe/formats/normalized.hpp>
#include <voxelpipe/sparse/io/nanovdb_nodes.hpp>

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
    // glm::u8vec4 and unorm8x4 colours, other packed formats the floats that they hold. `host` has to stay until
    // write().
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
        if constexpr (std::is_same_v<V, half> || std::is_same_v<V, bfloat16>)
            return float{};
        else if constexpr (std::is_same_v<V, glm::u8vec4> || std::is_same_v<V, unorm8x4>)
            return nanovdb::rgba8{};
        else if constexpr (core::is_packed<V>)
            return typename V::wide_type{};
        else if constexpr (std::is_same_v<V, std::uint8_t> || std::is_same_v<V, std::uint16_t>)
            return std::uint32_t{};
        else if constexpr (std::is_same_v<V, std::int8_t>)
            return std::int32_t{};
        else
            return V{};
    }
    // The same as a type: rgba8, float, an integer of 32 bits or V.
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
        if constexpr (std::is_same_v<V, unorm8x4>)
            return {v.bits};
        else if constexpr (std::is_same_v<To, nanovdb::rgba8>)
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
    const auto add_tile = [this](nanovdb::statistics<T>& s, std::uint64_t tile) {
        if (!nanovdb::has_active_tiles(from_)) return;
        const brick_tile t = from_.table.tiles[tile];
        s.add_cube(nanovdb::tile_value(from_, tile), t.origin(), t.side());
    };
    const auto add_tiles = [&](nanovdb::statistics<T>& s, const nanovdb::level& nodes, std::uint64_t number) {
        for (std::uint64_t i = nodes.first_tile[number]; i < nodes.first_tile[number + 1]; ++i)
            add_tile(s, nodes.tiles[i]);
    };
    for (std::size_t u = 0; u < upper_.size(); ++u) {
        for (std::uint64_t l = plan_.upper.first[u]; l < plan_.upper.first[u + 1]; ++l) {
            for (std::uint64_t b = plan_.lower.first[l]; b < plan_.lower.first[l + 1]; ++b)
                lower_[l].add(nanovdb::leaf_statistics(from_, b));
            add_tiles(lower_[l], plan_.lower, l);
            upper_[u].add(lower_[l]);
        }
        add_tiles(upper_[u], plan_.upper, u);
        all_.add(upper_[u]);
    }
    for (std::uint64_t t = 0; t < from_.table.num_tiles; ++t)
        if (from_.table.tiles[t].level() >= nanovdb::root_tiles) add_tile(all_, t);
    nanovdb::file_entry e{};
    e.grid_size = e.file_size = plan_.size;
    e.name_hash = nanovdb::hash_of(from_.name);
    e.num_voxels = nanovdb::num_active(from_);
    e.type = nanovdb::value_type<T>::type;
    e.meaning = from_.meaning;
    e.world = nanovdb::world_box_of(nanovdb::map_of(from_.where), all_.voxels, all_.count == 0);
    e.voxels = all_.voxels;
    for (int a = 0; a < 3; ++a) e.voxel_size[a] = from_.where.voxel_size[a];
    e.name_size = static_cast<std::uint32_t>(from_.name.size() + 1);
    e.node_count[0] = static_cast<std::uint32_t>(from_.table.count);
    e.node_count[1] = static_cast<std::uint32_t>(lower_.size());
    e.node_count[2] = static_cast<std::uint32_t>(upper_.size());
    e.node_count[3] = 1;
    if (nanovdb::has_active_tiles(from_))
        for (int i = 0; i < 3; ++i) e.tile_count[i] = static_cast<std::uint32_t>(plan_.num_tiles[i]);
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
    g.meaning = from_.meaning;
    g.type = value_type<T>::type;
    tree_data t{};
    if (from_.table.count != 0) t.node_offset[0] = plan_.first_leaf - sizeof(grid_data);
    if (!lower_.empty()) t.node_offset[1] = plan_.first_lower - sizeof(grid_data);
    if (!upper_.empty()) t.node_offset[2] = plan_.first_upper - sizeof(grid_data);
    t.node_offset[3] = plan_.root - sizeof(grid_data);
    t.node_count[0] = static_cast<std::uint32_t>(from_.table.count);
    t.node_count[1] = static_cast<std::uint32_t>(lower_.size());
    t.node_count[2] = static_cast<std::uint32_t>(upper_.size());
    if (has_active_tiles(from_))
        for (int i = 0; i < 3; ++i) t.tile_count[i] = static_cast<std::uint32_t>(plan_.num_tiles[i]);
    t.num_voxels = num_active(from_);
    root_type root;
    std::memset(static_cast<void*>(&root), 0, sizeof(root)); // padding too
    root.voxels = all_.voxels;
    root.table_size = static_cast<std::uint32_t>(plan_.root_children.size());
    root.background = from_.background;
    all_.write_to(root);
    std::memcpy(bytes.data() + sizeof(g), &t, sizeof(t));
    std::memcpy(bytes.data() + plan_.root, &root, sizeof(root));
    for (std::size_t i = 0; i < plan_.root_children.size(); ++i) {
        typename root_type::tile tile;
        std::memset(static_cast<void*>(&tile), 0, sizeof(tile));
        const auto& child = plan_.root_children[i];
        tile.key = child.key;
        if (child.is_tile) {
            tile.state = has_active_tiles(from_) ? 1 : 0; // active
            tile.value = tile_value(from_, child.number);
        } else {
            tile.child =
                static_cast<std::int64_t>(plan_.first_upper + child.number * sizeof(internal_node<T, 5>) - plan_.root);
            tile.value = from_.background;
        }
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
                upper_[u], from_, plan_.upper, u, plan_.lower.keys.data(), upper_tiles,
                [&](std::uint64_t l) { return from_to(here, plan_.first_lower + l * sizeof(lower_node)); }, *node);
            sink(node.get(), sizeof(upper_node));
        }
    }
    {
        const auto node = std::make_unique<lower_node>();
        for (std::size_t l = 0; l < lower_.size(); ++l) {
            const std::uint64_t here = plan_.first_lower + l * sizeof(lower_node);
            fill_internal<4>(
                lower_[l], from_, plan_.lower, l, from_.table.keys, lower_tiles,
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
