// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "nrrd.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "npy.hpp"
#include "progress.hpp"
#include "text.hpp"

#include <array>
#include <memory>

namespace voxelize {
namespace {

std::string_view nrrd_type(scalar type) {
    constexpr std::array<std::string_view, 10> names{"uint8", "uint8", "uint16", "uint32", "uint64",
                                                     "int32", "int64", "float",  "float",  "double"};
    return names[static_cast<std::size_t>(type)];
}

// NRRD's word for what the component axis means.
std::string_view component_kind(const channel& c) {
    const bool colour = c.name == "color";
    if (c.components == 2) return "2-vector";
    if (c.components == 3) return colour ? "RGB-color" : "3-vector";
    return colour ? "RGBA-color" : "4-vector";
}

std::string header_of(const volume& v, const channel& c, bool compress) {
    const auto& s = v.voxel_size;
    const bool vector = c.components > 1;
    std::string text = "NRRD0004\n";
    text += "# complete specification: teem.sourceforge.net/nrrd/format.html\n";
    text += "content: " + c.name + "\n";
    text += "type: " + std::string(nrrd_type(c.type)) + "\n";
    text += std::string("dimension: ") + (vector ? "4" : "3") + "\n";
    text += "space dimension: 3\n";
    text += "sizes:";
    if (vector) text.append(" ").append(std::to_string(c.components));
    for (const std::int64_t n : v.extent) text.append(" ").append(std::to_string(n));
    text += "\nspace directions:";
    if (vector) text += " none";
    text += " (" + number(s[0]) + ",0,0) (0," + number(s[1]) + ",0) (0,0," + number(s[2]) + ")";
    text += "\ncenterings:";
    if (vector) text += " none";
    text += " cell cell cell\nkinds:";
    if (vector) text.append(" ").append(component_kind(c));
    text += " domain domain domain\n";
    if (size_of(streamed_type(c.type, half_floats::widen)) > 1) text += "endian: little\n";
    text += std::string("encoding: ") + (compress ? "gzip" : "raw") + "\n";
    text += "space origin: (" + number(v.origin[0] + s[0] / 2) + "," + number(v.origin[1] + s[1] / 2) + "," +
            number(v.origin[2] + s[2] / 2) + ")\n\n";
    return text;
}

// A gzip stream with an empty name and no time, so that equal input gives equal bytes.
void write_gzip(output_file& out, const volume& v, const channel& c, const write_options& options,
                progress_meter& meter) {
    constexpr std::array<std::uint8_t, 10> head{0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255};
    out.write(std::as_bytes(std::span{head}));
    piece_compressor compressor(piece_compressor::form::stream_part, options.compression);
    running_crc whole;
    compress_channel(v, c, half_floats::widen, {}, compressed_piece_bytes, options.threads, compressor,
                     [&](const compressed_piece& piece) {
                         out.write(piece.bytes);
                         whole.add(piece);
                         meter.advance(piece.source_size);
                     });
    out.write(deflate_end);
    out.write_value(whole.crc);
    out.write_value(static_cast<std::uint32_t>(whole.size)); // modulo 2^32, as gzip has it
}

} // namespace

std::vector<std::filesystem::path> write_nrrd(const volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    std::uint64_t total = 0;
    for (const channel& c : v.channels) total += streamed_bytes(v, c, half_floats::widen);
    progress_meter meter(options.progress, total);
    const bool compress = options.compression > 0;
    std::vector<std::unique_ptr<output_file>> files;
    for (const channel& c : v.channels) {
        files.push_back(std::make_unique<output_file>(channel_path(path, v, c)));
        output_file& out = *files.back();
        out.write(header_of(v, c, compress));
        if (compress) {
            write_gzip(out, v, c, options, meter);
        } else {
            stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) {
                out.write(piece);
                meter.advance(piece.size());
            });
        }
    }
    return commit_all(files);
}

} // namespace voxelize
