// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vtu.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "hexahedra.hpp"
#include "mesh_parts.hpp"
#include "model/parallel.hpp"
#include "vtk_xml.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

constexpr std::uint64_t most_of_int32 = 0x7fff'ffff;
constexpr std::byte vtk_hexahedron{12};

// One array: its element without the offset, its bytes, and those of a part of the mesh.
struct vtu_array {
    std::string element;
    std::uint64_t bytes;
    std::size_t value_bytes; // of a value, which may repeat
    std::function<channel_bytes(std::size_t part)> make;
};

template <class T>
std::byte* stored(std::byte* at, T value) {
    std::memcpy(at, &value, sizeof(T));
    return at + sizeof(T);
}

std::string data_array(std::string_view type, const std::string& name, int components) {
    std::string text = "<DataArray type=\"";
    text.append(type).append("\" Name=\"").append(name).append("\"");
    if (components != 0) text += " NumberOfComponents=\"" + std::to_string(components) + "\"";
    return text + " format=\"appended\"";
}

// Values of a channel at the cells.
vtu_array cell_array(const hexahedra& mesh, const channel& c) {
    const scalar type = streamed_type(c.type, half_floats::widen);
    const std::size_t each = size_of(type) * static_cast<std::size_t>(c.components);
    const auto make = [&mesh, &c, each](std::size_t part) {
        channel_bytes bytes(mesh.cells_of(part) * each);
        std::byte* at = bytes.data();
        mesh.for_each_voxel(part, [&](std::uint64_t, std::size_t brick, const glm::ivec3& voxel) {
            if (c.type == scalar::bit) {
                *at++ = static_cast<std::byte>(mesh.shape().bit_of(c, voxel));
                return;
            }
            const std::uint64_t value = mesh.shape().value_of(brick, voxel);
            if (c.type != scalar::f16) {
                std::memcpy(at, c.data.data() + value * each, each);
                at += each;
                return;
            }
            for (std::uint64_t n = 0; n < static_cast<std::uint64_t>(c.components); ++n) {
                std::uint16_t half;
                std::memcpy(&half, c.data.data() + 2 * (value * static_cast<std::uint64_t>(c.components) + n), 2);
                at = stored(at, widened_half(half));
            }
        });
        return bytes;
    };
    return {data_array(vtk_type(c.type), c.name, c.components), mesh.num_cells() * each, each, make};
}

vtu_array point_array(const hexahedra& mesh) {
    std::array<std::vector<double>, 3> places;
    for (std::size_t a = 0; a < 3; ++a)
        for (std::int64_t n = 0; n <= mesh.shape().extent[a]; ++n)
            places[a].push_back(world(mesh.shape(), a, static_cast<double>(n)));
    const auto make = [&mesh, places = std::move(places)](std::size_t part) {
        channel_bytes bytes(mesh.nodes_of(part) * 24);
        std::byte* at = bytes.data();
        mesh.for_each_node(part, [&](std::size_t x, std::size_t y, std::size_t z) {
            at = stored(stored(stored(at, places[0][x]), places[1][y]), places[2][z]);
        });
        return bytes;
    };
    return {data_array("Float64", "Points", 3), mesh.num_nodes() * 24, 24, make};
}

template <class T>
vtu_array corner_array(const hexahedra& mesh) {
    const auto make = [&mesh](std::size_t part) {
        channel_bytes bytes(mesh.cells_of(part) * 8 * sizeof(T));
        std::byte* at = bytes.data();
        mesh.for_each_cell(part, [&](std::uint64_t, const std::array<std::uint64_t, 8>& corners) {
            for (const std::uint64_t corner : corners) at = stored(at, static_cast<T>(corner));
        });
        return bytes;
    };
    return {data_array(sizeof(T) == 4 ? "Int32" : "Int64", "connectivity", 0), mesh.num_cells() * 8 * sizeof(T),
            sizeof(T), make};
}

// The end of each cell's corners.
template <class T>
vtu_array end_array(const hexahedra& mesh) {
    const auto make = [&mesh](std::size_t part) {
        channel_bytes bytes(mesh.cells_of(part) * sizeof(T));
        std::byte* at = bytes.data();
        const std::uint64_t first = mesh.first_cell(part);
        for (std::uint64_t n = 0; n < mesh.cells_of(part); ++n) at = stored(at, static_cast<T>(8 * (first + n + 1)));
        return bytes;
    };
    return {data_array(sizeof(T) == 4 ? "Int32" : "Int64", "offsets", 0), mesh.num_cells() * sizeof(T), sizeof(T),
            make};
}

vtu_array type_array(const hexahedra& mesh) {
    const auto make = [&mesh](std::size_t part) { return channel_bytes(mesh.cells_of(part), vtk_hexahedron); };
    return {data_array("UInt8", "types", 0), mesh.num_cells(), 1, make};
}

// The offset of each array, followed by spaces, so that the header keeps its length when true offsets are filled in.
// Readers compare the digits, which are not padded.
std::string vtu_header(const hexahedra& mesh, std::span<const vtu_array> arrays, std::span<const std::uint64_t> offsets,
                       bool compress) {
    std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                       "byte_order=\"LittleEndian\" header_type=\"UInt64\"";
    if (compress) text += " compressor=\"vtkZLibDataCompressor\"";
    text += ">\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"" + std::to_string(mesh.num_nodes()) +
            "\" NumberOfCells=\"" + std::to_string(mesh.num_cells()) + "\">\n      <PointData/>\n";
    const auto add = [&](std::size_t n) {
        const std::string digits = std::to_string(offsets[n]);
        text.append("        ").append(arrays[n].element).append(" offset=\"").append(digits).append("\"");
        text.append(20 - digits.size(), ' ').append("/>\n");
    };
    const std::size_t channels = arrays.size() - 4;
    text += "      <CellData";
    if (channels != 0) text += " Scalars=\"" + mesh.shape().channels().front().name + "\"";
    text += ">\n";
    for (std::size_t n = 0; n < channels; ++n) add(n);
    text += "      </CellData>\n      <Points>\n";
    add(channels);
    text += "      </Points>\n      <Cells>\n";
    for (std::size_t n = channels + 1; n < arrays.size(); ++n) add(n);
    return text + "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _";
}

// Its length in bytes, then the bytes.
void write_plain_array(output_file& out, const hexahedra& mesh, const vtu_array& array, const write_options& options,
                       progress_meter& meter) {
    out.write_value(array.bytes);
    ordered_for(mesh.num_parts(), thread_count(options.threads), array.make,
                [&](std::size_t, const channel_bytes& bytes) {
                    out.write(bytes);
                    meter.advance(bytes.size());
                });
}

// Blocks do not follow the parts of the mesh: what parts make is gathered until there is a block for every thread.
void write_packed_array(output_file& out, const hexahedra& mesh, const vtu_array& array, const write_options& options,
                        progress_meter& meter) {
    const int workers = thread_count(options.threads);
    vtk_block_array blocks(out, array.bytes);
    piece_compressor compressor(piece_compressor::form::zlib, options.compression);
    channel_bytes waiting;
    const auto flush = [&](std::size_t size) {
        ordered_for((size + vtk_block_bytes - 1) / vtk_block_bytes, workers,
                    [&](std::size_t n) {
                        const std::size_t begin = n * vtk_block_bytes;
                        return compressor.compress(
                            std::span{waiting}.subspan(begin, std::min(vtk_block_bytes, size - begin)),
                            array.value_bytes);
                    },
                    [&](std::size_t, const std::shared_ptr<const compressed_piece>& block) { blocks.add(*block); });
        waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(size));
        meter.advance(size);
    };
    ordered_for(mesh.num_parts(), workers, array.make, [&](std::size_t, const channel_bytes& bytes) {
        waiting.insert(waiting.end(), bytes.begin(), bytes.end());
        if (waiting.size() >= static_cast<std::size_t>(workers) * vtk_block_bytes)
            flush(waiting.size() / vtk_block_bytes * vtk_block_bytes);
    });
    flush(waiting.size());
    blocks.finish();
}

} // namespace

std::vector<std::filesystem::path> write_vtu(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    output_file out(path);
    const hexahedra mesh(v, options.threads);
    const std::uint64_t most = options.highest_number != 0 ? options.highest_number : most_of_int32;
    std::vector<vtu_array> arrays;
    for (const channel& c : v.channels()) arrays.push_back(cell_array(mesh, c));
    arrays.push_back(point_array(mesh));
    const bool is_wide = 8 * mesh.num_cells() > most;
    arrays.push_back(is_wide ? corner_array<std::int64_t>(mesh) : corner_array<std::int32_t>(mesh));
    arrays.push_back(is_wide ? end_array<std::int64_t>(mesh) : end_array<std::int32_t>(mesh));
    arrays.push_back(type_array(mesh));

    std::uint64_t total = 0;
    for (const vtu_array& array : arrays) total += array.bytes;
    progress_meter meter(options.progress, total);
    const bool compress = options.compression > 0;
    std::vector<std::uint64_t> offsets(arrays.size(), 0);
    out.write(vtu_header(mesh, arrays, offsets, compress));
    const std::uint64_t data_at = out.tell();
    for (std::size_t n = 0; n < arrays.size(); ++n) {
        offsets[n] = out.tell() - data_at;
        if (compress)
            write_packed_array(out, mesh, arrays[n], options, meter);
        else
            write_plain_array(out, mesh, arrays[n], options, meter);
    }
    out.write("\n  </AppendedData>\n</VTKFile>\n");
    out.seek(0);
    out.write(vtu_header(mesh, arrays, offsets, compress));
    out.commit();
    return {path};
}

} // namespace voxelize
