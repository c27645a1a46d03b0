// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vti.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "progress.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>

namespace voxelize {
namespace {

// Uncompressed bytes of one zlib block; VTK decodes a block at a time.
constexpr std::size_t block_bytes = std::size_t{1} << 20;

std::string_view vtk_type(scalar type) {
    constexpr std::array<std::string_view, 10> names{"UInt8", "UInt8", "UInt16",  "UInt32",  "UInt64",
                                                     "Int32", "Int64", "Float32", "Float32", "Float64"};
    return names[static_cast<std::size_t>(type)];
}

// Twenty digits hold any 64-bit offset, so the header keeps its length when the true offsets are filled in.
std::string padded(std::uint64_t value) {
    std::string digits = std::to_string(value);
    return std::string(20 - digits.size(), '0') + digits;
}

std::string header_of(const volume& v, std::span<const std::uint64_t> offsets, bool compress) {
    const auto triple = [](const std::array<double, 3>& a) {
        return number(a[0]) + " " + number(a[1]) + " " + number(a[2]);
    };
    std::string whole;
    for (const std::int64_t n : v.extent) whole += (whole.empty() ? "0 " : " 0 ") + std::to_string(n);
    std::string text = "<?xml version=\"1.0\"?>\n"
                       "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";
    if (compress) text += " compressor=\"vtkZLibDataCompressor\"";
    text += ">\n  <ImageData WholeExtent=\"" + whole + "\" Origin=\"" + triple(v.origin) + "\" Spacing=\"" +
            triple(v.voxel_size) + "\" Direction=\"1 0 0 0 1 0 0 0 1\">\n";
    text += "    <Piece Extent=\"" + whole + "\">\n      <PointData/>\n      <CellData";
    if (!v.channels.empty()) text += " Scalars=\"" + v.channels.front().name + "\"";
    text += ">\n";
    for (std::size_t i = 0; i < v.channels.size(); ++i) {
        const channel& c = v.channels[i];
        text += "        <DataArray type=\"" + std::string(vtk_type(c.type)) + "\" Name=\"" + c.name +
                "\" NumberOfComponents=\"" + std::to_string(c.components) + "\" format=\"appended\" offset=\"" +
                padded(offsets[i]) + "\"/>\n";
    }
    text += "      </CellData>\n    </Piece>\n  </ImageData>\n  <AppendedData encoding=\"raw\">\n   _";
    return text;
}

// One array without compression: its length in bytes, then the bytes.
void write_raw(output_file& out, const volume& v, const channel& c, progress_meter& meter) {
    out.write_value<std::uint64_t>(streamed_bytes(v, c, half_floats::widen));
    stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) {
        out.write(piece);
        meter.advance(piece.size());
    });
}

// One array in zlib blocks: number of blocks, bytes of a block, bytes of the last one where it is shorter (else 0), the
// compressed bytes of each; then the blocks. The sizes are filled in at the end.
void write_compressed(output_file& out, const volume& v, const channel& c, const write_options& options,
                      progress_meter& meter) {
    const std::uint64_t total = streamed_bytes(v, c, half_floats::widen);
    const std::uint64_t num_blocks = (total + block_bytes - 1) / block_bytes;
    std::vector<std::uint64_t> table(3 + num_blocks);
    table[0] = num_blocks;
    table[1] = block_bytes;
    table[2] = total % block_bytes;
    const std::uint64_t table_at = out.tell();
    out.write(std::as_bytes(std::span{table}));

    std::size_t next = 3;
    piece_compressor compressor(piece_compressor::form::zlib, options.compression);
    compress_channel(v, c, half_floats::widen, {}, block_bytes, options.threads, compressor,
                     [&](const compressed_piece& piece) {
                         out.write(piece.bytes);
                         table[next++] = piece.bytes.size();
                         meter.advance(piece.source_size);
                     });

    const std::uint64_t end = out.tell();
    out.seek(table_at);
    out.write(std::as_bytes(std::span{table}));
    out.seek(end);
}

} // namespace

std::vector<std::filesystem::path> write_vti(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    std::uint64_t total = 0;
    for (const channel& c : v.channels) total += streamed_bytes(v, c, half_floats::widen);
    progress_meter meter(options.progress, total);
    const bool compress = options.compression > 0;

    output_file out(path);
    std::vector<std::uint64_t> offsets(v.channels.size(), 0);
    out.write(header_of(v, offsets, compress));
    const std::uint64_t data_at = out.tell();
    for (std::size_t i = 0; i < v.channels.size(); ++i) {
        offsets[i] = out.tell() - data_at;
        if (compress)
            write_compressed(out, v, v.channels[i], options, meter);
        else
            write_raw(out, v, v.channels[i], meter);
    }
    out.write("\n  </AppendedData>\n</VTKFile>\n");
    out.seek(0);
    out.write(header_of(v, offsets, compress));
    out.commit();
    return {path};
}

} // namespace voxelize
