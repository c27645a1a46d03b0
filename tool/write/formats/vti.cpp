// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vti.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "vtk_xml.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <system_error>

namespace voxelize {
namespace {

// Files that are written at a time, and so open.
constexpr std::int64_t most_pieces = 512;

// A name as the value of an XML attribute.
std::string attribute(const std::string& name) {
    std::string text;
    for (const char c : name) {
        if (c == '&')
            text += "&amp;";
        else if (c == '<')
            text += "&lt;";
        else if (c == '"')
            text += "&quot;";
        else
            text += c;
    }
    return text;
}

// Twenty digits hold any 64-bit offset, so the header keeps its length when the true offsets are filled in.
std::string padded(std::uint64_t value) {
    std::string digits = std::to_string(value);
    return std::string(20 - digits.size(), '0') + digits;
}

std::string triple(const std::array<double, 3>& a) { return number(a[0]) + " " + number(a[1]) + " " + number(a[2]); }

// The layers [first, last) of a grid.
std::string extent_of(const volume& v, std::int64_t first, std::int64_t last) {
    return "0 " + std::to_string(v.extent[0]) + " 0 " + std::to_string(v.extent[1]) + " " + std::to_string(first) +
           " " + std::to_string(last);
}

// The channels' elements in both kinds of file; `placed` has what an element says of its values beside their type.
std::string cell_data(const volume& v, const std::string& element,
                      const std::function<std::string(std::size_t)>& placed, const std::string& indent) {
    std::string text = v.channels.empty() ? "" : " Scalars=\"" + v.channels.front().name + "\"";
    text += ">\n";
    for (std::size_t i = 0; i < v.channels.size(); ++i) {
        const channel& c = v.channels[i];
        text.append(indent).append("<").append(element).append(" type=\"").append(vtk_type(c.type));
        text.append("\" Name=\"").append(c.name).append("\" NumberOfComponents=\"");
        text.append(std::to_string(c.components)).append("\"").append(placed(i)).append("/>\n");
    }
    return text;
}

// `v` holds the layers from `first_layer` on; its origin is that of the whole grid.
std::string header_of(const volume& v, std::int64_t first_layer, std::span<const std::uint64_t> offsets,
                      bool compress) {
    const std::string whole = extent_of(v, first_layer, first_layer + v.extent[2]);
    std::string text = "<?xml version=\"1.0\"?>\n"
                       "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";
    if (compress) text += " compressor=\"vtkZLibDataCompressor\"";
    text += ">\n  <ImageData WholeExtent=\"" + whole + "\" Origin=\"" + triple(v.origin) + "\" Spacing=\"" +
            triple(v.voxel_size) + "\" Direction=\"1 0 0 0 1 0 0 0 1\">\n";
    text +=
        "    <Piece Extent=\"" + whole + "\">\n      <PointData/>\n      <CellData" +
        cell_data(
            v, "DataArray", [&](std::size_t i) { return " format=\"appended\" offset=\"" + padded(offsets[i]) + "\""; },
            "        ");
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

// One array in zlib blocks.
void write_compressed(output_file& out, const volume& v, const channel& c, const write_options& options,
                      progress_meter& meter) {
    vtk_block_array blocks(out, streamed_bytes(v, c, half_floats::widen));
    piece_compressor compressor(piece_compressor::form::zlib, options.compression);
    compress_channel(v, c, half_floats::widen, {}, vtk_block_bytes, options.threads, compressor,
                     [&](const compressed_piece& piece) {
                         blocks.add(piece);
                         meter.advance(piece.source_size);
                     });
    blocks.finish();
}

void write_image(output_file& out, const volume& v, std::int64_t first_layer, const write_options& options,
                 progress_meter& meter) {
    const bool compress = options.compression > 0;
    std::vector<std::uint64_t> offsets(v.channels.size(), 0);
    out.write(header_of(v, first_layer, offsets, compress));
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
    out.write(header_of(v, first_layer, offsets, compress));
}

std::uint64_t bytes_of(const volume& v) {
    std::uint64_t total = 0;
    for (const channel& c : v.channels) total += streamed_bytes(v, c, half_floats::widen);
    return total;
}

// The images of a .vti with their files: that of the voxels has the path, those of faces have their channels' names in
// it, but for a single image.
std::vector<std::pair<const volume*, std::filesystem::path>> images_of(const volume& v,
                                                                       const std::filesystem::path& path) {
    std::vector<std::pair<const volume*, std::filesystem::path>> images;
    if (!v.channels.empty()) images.emplace_back(&v, path);
    for (const volume& f : v.faces)
        images.emplace_back(&f, v.num_channels() == 1 ? path : with_word(path, f.channels.front().name));
    return images;
}

// The layers [first, last) of the grid, whose channels read those of `v`.
volume layers_of(const volume& v, std::int64_t first, std::int64_t last) {
    volume part; // of v's channels none is copied
    part.extent = {v.extent[0], v.extent[1], last - first};
    part.origin = v.origin;
    part.voxel_size = v.voxel_size;
    for (const channel& c : v.channels) {
        const scalar type = c.type == scalar::f16 ? scalar::f32 : c.type;
        const std::uint64_t each =
            streamed_bytes(v, c, half_floats::widen) / static_cast<std::uint64_t>(v.num_voxels());
        const auto skipped = static_cast<std::uint64_t>(v.index(0, 0, first));
        part.channels.push_back({c.name, type, c.components, {}, [&v, &c, each, skipped](std::uint64_t at, auto to) {
                                     std::vector<std::byte> room;
                                     const auto from = streamed_piece(v, c, half_floats::widen, (skipped + at) * each,
                                                                      to.size(), room);
                                     std::copy(from.begin(), from.end(), to.begin());
                                 }});
    }
    return part;
}

// The number of pieces that a .pvti of this tool at the path names; 0 without one.
std::int64_t pieces_before(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return 0;
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::int64_t n = 0;
    while (n < most_pieces &&
           text.find("Source=\"" + attribute(pvti_piece_path(path, n).filename().string()) + '"') != std::string::npos)
        ++n;
    return n;
}

// The text of a .pvti.
std::string index_of(const volume& v, const std::filesystem::path& path, std::int64_t pieces) {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n  <PImageData WholeExtent=\"" +
        extent_of(v, 0, v.extent[2]) + "\" GhostLevel=\"0\" Origin=\"" + triple(v.origin) + "\" Spacing=\"" +
        triple(v.voxel_size) + "\" Direction=\"1 0 0 0 1 0 0 0 1\">\n    <PPointData/>\n    <PCellData" +
        cell_data(
            v, "PDataArray", [](std::size_t) { return ""; }, "      ") +
        "    </PCellData>\n";
    for (std::int64_t n = 0; n < pieces; ++n) {
        const auto [first, last] = pvti_piece_layers(v, n, pieces);
        text += "    <Piece Extent=\"" + extent_of(v, first, last) + "\" Source=\"" +
                attribute(pvti_piece_path(path, n).filename().string()) + "\"/>\n";
    }
    return text + "  </PImageData>\n</VTKFile>\n";
}

// Removes the pieces from `pieces` on of those that a file at this path named `before`.
void remove_old_pieces(const std::filesystem::path& path, std::int64_t pieces, std::int64_t before) {
    for (std::int64_t n = pieces; n < before; ++n) {
        std::error_code ignored;
        std::filesystem::remove(pvti_piece_path(path, n), ignored);
    }
}

} // namespace

written_names vti_names(const volume& shape, const std::filesystem::path& path, const write_options&, held_as) {
    written_names names;
    for (const auto& [image, file] : images_of(shape, path)) names.files.push_back(file);
    return names;
}

std::vector<std::filesystem::path> write_vti(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    progress_meter meter(options.progress, streamed_bytes(v, half_floats::widen));
    std::vector<std::unique_ptr<output_file>> files;
    for (const auto& [image, file] : images_of(v, path)) {
        files.push_back(std::make_unique<output_file>(file));
        write_image(*files.back(), *image, 0, options, meter);
    }
    return commit_all(files);
}

std::int64_t num_pvti_pieces(const volume& v, const write_options& options) {
    std::int64_t pieces = options.pieces;
    if (pieces == 0)
        pieces = static_cast<std::int64_t>((bytes_of(v) - 1) / std::max<std::uint64_t>(options.piece_bytes, 1)) + 1;
    return std::clamp<std::int64_t>(pieces, 1, std::min<std::int64_t>(v.extent[2], most_pieces));
}

written_names pvti_names(const volume& shape, const std::filesystem::path& path, const write_options& options,
                         held_as) {
    written_names names{{path}, {}};
    if (shape.num_voxels() == 0) {
        names.numbered.push_back({path.parent_path(), path.stem().string() + ".", ".vti", most_pieces});
        return names;
    }
    const std::int64_t pieces = std::max(num_pvti_pieces(shape, options), pieces_before(path));
    for (std::int64_t n = 0; n < pieces; ++n) names.files.push_back(pvti_piece_path(path, n));
    return names;
}

std::pair<std::int64_t, std::int64_t> pvti_piece_layers(const volume& v, std::int64_t piece, std::int64_t pieces) {
    return {piece * v.extent[2] / pieces, (piece + 1) * v.extent[2] / pieces};
}

std::filesystem::path pvti_piece_path(const std::filesystem::path& path, std::int64_t piece) {
    return path.parent_path() / (path.stem().string() + "." + std::to_string(piece + 1) + ".vti");
}

void write_pvti_piece(const volume& v, const std::filesystem::path& file, std::int64_t piece, std::int64_t pieces,
                      const write_options& options) {
    const auto [first, last] = pvti_piece_layers(v, piece, pieces);
    const volume part = layers_of(v, first, last);
    progress_meter meter(options.progress, bytes_of(part));
    output_file out(file);
    write_image(out, part, first, options, meter);
    out.commit();
}

void write_pvti_index(const volume& v, const std::filesystem::path& path, std::int64_t pieces) {
    const std::int64_t before = pieces_before(path);
    output_file out(path);
    out.write(index_of(v, path, pieces));
    out.commit();
    remove_old_pieces(path, pieces, before);
}

std::vector<std::filesystem::path> write_pvti(const volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    const std::int64_t pieces = num_pvti_pieces(v, options), before = pieces_before(path);
    progress_meter meter(options.progress, bytes_of(v));
    std::vector<std::unique_ptr<output_file>> files;
    for (std::int64_t n = 0; n < pieces; ++n) {
        const auto [first, last] = pvti_piece_layers(v, n, pieces);
        files.push_back(std::make_unique<output_file>(pvti_piece_path(path, n)));
        write_image(*files.back(), layers_of(v, first, last), first, options, meter);
    }
    files.push_back(std::make_unique<output_file>(path));
    files.back()->write(index_of(v, path, pieces));
    std::vector<std::filesystem::path> targets = commit_all(files);
    remove_old_pieces(path, pieces, before);
    return targets;
}

} // namespace voxelize
