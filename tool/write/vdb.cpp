// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "vdb.hpp"

#include "model/srgb.hpp"
#include "write/formats/output_file.hpp"
#include "write/formats/progress.hpp"
#include "write/sparse_formats.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <ostream>
#include <streambuf>
#include <string>

namespace voxelize {
namespace {

// A file's header ends with 36 characters that tell files apart; OpenVDB draws them by lot.
constexpr std::uint64_t id_at = 21;
constexpr std::size_t id_length = 36;

// Hands an ostream's bytes to the file, and hashes all but the id.
class hashed_output : public std::streambuf {
public:
    explicit hashed_output(output_file& file) : file_(file) {}

    // 36 characters that follow from the bytes, in the form of a UUID.
    [[nodiscard]] std::string id() const {
        constexpr char digits[] = "0123456789abcdef";
        std::string text = "00000000-0000-4000-8000-000000000000";
        std::array<std::uint64_t, 2> left = hash_;
        std::size_t digit = 0;
        for (std::size_t i = 0; i < text.size(); ++i) {
            if (text[i] == '-' || i == 14 || i == 19) continue; // version and variant
            std::uint64_t& from = left[digit++ / 15];
            text[i] = digits[from & 15];
            from >>= 4;
        }
        return text;
    }

protected:
    std::streamsize xsputn(const char* text, std::streamsize count) override {
        const auto size = static_cast<std::size_t>(count);
        for (std::size_t i = 0; i < size; ++i) {
            const std::uint64_t at = written_ + i;
            if (at >= id_at && at < id_at + id_length) continue;
            // FNV-1a, from two offsets
            for (std::uint64_t& h : hash_) h = (h ^ static_cast<unsigned char>(text[i])) * 0x100000001B3;
        }
        file_.write(std::as_bytes(std::span{text, size}));
        written_ += size;
        return count;
    }
    int_type overflow(int_type c) override {
        const char one = traits_type::to_char_type(c);
        xsputn(&one, 1);
        return c;
    }
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
        return offset == 0 && from == std::ios_base::cur ? pos_type(static_cast<off_type>(written_))
                                                         : pos_type(off_type(-1));
    }

private:
    output_file& file_;
    std::uint64_t written_ = 0;
    std::array<std::uint64_t, 2> hash_{0xCBF29CE484222325, 0x9AE16A3B2F90404F};
};

// A grid of GRID's type whose voxels are those of V, with VALUE(rank).
template <class Grid, class Value>
openvdb::GridBase::Ptr make_grid(const sparse_volume& v, const std::string& name,
                                 const typename Grid::ValueType& background, const Value& value) {
    const typename Grid::Ptr grid = Grid::create(background);
    auto accessor = grid->getAccessor();
    const voxelpipe::brick_table table = v.table();
    for (std::uint64_t b = 0; b < table.count; ++b) {
        typename Grid::TreeType::LeafNodeType* leaf = nullptr; // a brick is one
        voxelpipe::for_each_voxel_in(table, b, [&](const glm::ivec3& p, std::uint64_t rank) {
            const openvdb::Coord at(p.x, p.y, p.z);
            if (leaf == nullptr) leaf = accessor.touchLeaf(at);
            leaf->setValueOn(leaf->coordToOffset(at), value(rank));
        });
    }
    for (std::uint64_t t = 0; t < table.num_tiles; ++t) {
        const glm::ivec3 low = table.tiles[t].origin(), high = low + (table.tiles[t].side() - 1);
        grid->tree().sparseFill(openvdb::CoordBBox(low.x, low.y, low.z, high.x, high.y, high.z),
                                value(table.num_in_bricks() + t), true);
    }
    const auto& [x, y, z] = v.shape.voxel_size;
    const auto& [ox, oy, oz] = v.shape.origin;
    const auto transform = openvdb::math::Transform::createLinearTransform();
    transform->postScale(openvdb::Vec3d(x, y, z));
    transform->postTranslate(openvdb::Vec3d(ox + x / 2, oy + y / 2, oz + z / 2));
    grid->setTransform(transform);
    grid->setName(name);
    grid->setCreator("voxelize");
    return grid;
}

template <class T>
auto values_of(const channel& c) {
    return [data = c.data.data()](std::uint64_t rank) {
        T value;
        std::memcpy(&value, data + rank * sizeof(T), sizeof(T));
        return value;
    };
}

void add_color(openvdb::GridPtrVec& grids, const sparse_volume& v, const channel& c) {
    static const color_tables tables = make_color_tables();
    using rgba = std::array<std::uint8_t, 4>;
    const auto bytes = values_of<rgba>(c);
    grids.push_back(make_grid<openvdb::Vec3SGrid>(v, c.name, openvdb::Vec3s(0.0F), [&](std::uint64_t rank) {
        const rgba t = bytes(rank);
        return openvdb::Vec3s(tables.linear[t[0]], tables.linear[t[1]], tables.linear[t[2]]);
    }));
    bool is_opaque = true;
    for (std::size_t i = 3; i < c.data.size(); i += 4) is_opaque = is_opaque && c.data[i] == std::byte{255};
    if (is_opaque) return;
    grids.push_back(make_grid<openvdb::FloatGrid>(v, c.name + ".alpha", 0.0F,
                                                  [&](std::uint64_t rank) { return tables.fraction[bytes(rank)[3]]; }));
}

void add_count(openvdb::GridPtrVec& grids, const sparse_volume& v, const channel& c) {
    const auto counts = values_of<std::uint32_t>(c);
    bool fits = true;
    for (std::uint64_t rank = 0; rank < c.data.size() / sizeof(std::uint32_t); ++rank)
        fits = fits && counts(rank) <= std::uint32_t{std::numeric_limits<std::int32_t>::max()};
    if (fits)
        grids.push_back(make_grid<openvdb::Int32Grid>(
            v, c.name, 0, [&](std::uint64_t rank) { return static_cast<std::int32_t>(counts(rank)); }));
    else
        grids.push_back(make_grid<openvdb::Int64Grid>(
            v, c.name, 0, [&](std::uint64_t rank) { return static_cast<std::int64_t>(counts(rank)); }));
}

// The distances of a field: beyond its band plus or minus the background, not active.
openvdb::GridBase::Ptr distance_grid(const band_bricks& b, const channel& c) {
    openvdb::GridBase::Ptr made = make_grid<openvdb::FloatGrid>(b.band, c.name, b.background, values_of<float>(c));
    if (!b.is_level_set) return made;
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(made);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto accessor = grid->getAccessor();
    for (std::size_t n = 0; n < b.inside.size(); ++n) {
        const glm::ivec3 origin = voxelpipe::core::morton_position(b.band.keys[n]) * 8;
        for (unsigned bit = 0; bit < 512; ++bit) {
            if (!b.inside[n].has(bit)) continue;
            const glm::ivec3 p = origin + voxelpipe::core::morton_position(bit);
            accessor.setValueOff(openvdb::Coord(p.x, p.y, p.z), -b.background);
        }
    }
    for (const voxelpipe::brick_tile& tile : b.in_inside) {
        const glm::ivec3 low = tile.origin(), high = low + (tile.side() - 1);
        grid->tree().sparseFill(openvdb::CoordBBox(low.x, low.y, low.z, high.x, high.y, high.z), -b.background, false);
    }
    return grid;
}

openvdb::GridPtrVec grids_of(const sparse_volume& v, const std::filesystem::path& path, progress_meter& meter,
                             const band_bricks* field) {
    openvdb::GridPtrVec grids;
    for (const channel& c : v.channels) {
        if (field != nullptr && c.name == "distance") {
            grids.push_back(distance_grid(*field, c));
            meter.advance(1);
            continue;
        }
        const std::uint32_t empty = empty_value(c);
        if (c.type == scalar::bit) {
            grids.push_back(make_grid<openvdb::MaskGrid>(v, c.name, false, [](std::uint64_t) { return true; }));
        } else if (c.type == scalar::u8 && c.components == 4) {
            add_color(grids, v, c);
        } else if (c.type == scalar::u32 && c.components == 1) {
            add_count(grids, v, c);
        } else if (c.type == scalar::i32 && c.components == 1) {
            grids.push_back(
                make_grid<openvdb::Int32Grid>(v, c.name, static_cast<std::int32_t>(empty), values_of<std::int32_t>(c)));
        } else if (c.type == scalar::i64 && c.components == 1) {
            grids.push_back(make_grid<openvdb::Int64Grid>(v, c.name, -1, values_of<std::int64_t>(c)));
        } else if (c.type == scalar::f32 && c.components == 1) {
            grids.push_back(
                make_grid<openvdb::FloatGrid>(v, c.name, voxelpipe::core::bit_cast<float>(empty), values_of<float>(c)));
            if (is_fog(c)) grids.back()->setGridClass(openvdb::GRID_FOG_VOLUME);
        } else if (c.type == scalar::f32 && c.components == 3) {
            grids.push_back(
                make_grid<openvdb::Vec3SGrid>(v, c.name, openvdb::Vec3s(0.0F), values_of<openvdb::Vec3s>(c)));
        } else {
            throw write_error(path, ".vdb has no type for the values of channel " + c.name);
        }
        meter.advance(1);
    }
    return grids;
}

std::vector<std::filesystem::path> write_grids(const sparse_volume& v, const std::filesystem::path& path,
                                               const write_options& options, const band_bricks* field) {
    openvdb::initialize();
    progress_meter meter(options.progress, v.channels.size() + 1);
    output_file out(path);
    hashed_output buffer(out);
    {
        std::ostream stream(&buffer);
        stream.exceptions(std::ios_base::badbit); // what the file throws passes through
        openvdb::io::Stream(stream).write(grids_of(v, path, meter, field));
    }
    out.seek(id_at);
    out.write(buffer.id());
    out.commit();
    meter.advance(1);
    return {path};
}

} // namespace

std::vector<std::filesystem::path> write_vdb(const sparse_volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    return write_grids(v, path, options, nullptr);
}

std::vector<std::filesystem::path> write_vdb(const band_bricks& field, const std::filesystem::path& path,
                                             const write_options& options) {
    return write_grids(field.band, path, options, &field);
}

} // namespace voxelize
