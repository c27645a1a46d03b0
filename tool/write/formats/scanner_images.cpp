// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "scanner_images.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "npy.hpp"
#include "progress.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

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

std::string header_of(const volume& v, const channel& c, patient_axes axes, bool compress) {
    const auto& s = v.voxel_size;
    const bool vector = c.components > 1;
    std::string text = "NRRD0004\n";
    text += "# complete specification: teem.sourceforge.net/nrrd/format.html\n";
    text += "content: " + c.name + "\n";
    text += "type: " + std::string(nrrd_type(c.type)) + "\n";
    text += std::string("dimension: ") + (vector ? "4" : "3") + "\n";
    text += std::string("space: ") + (axes == patient_axes::lps ? "left-posterior" : "right-anterior") + "-superior\n";
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

// A gzip stream of `head` and the channels of `v`, with an empty name and no time, so that equal input gives equal
// bytes.
void write_gzip_image(output_file& out, std::span<const std::byte> head, const volume& v,
                      std::span<const channel> channels, const write_options& options, progress_meter& meter) {
    constexpr std::array<std::uint8_t, 10> start{0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255};
    out.write(std::as_bytes(std::span{start}));
    piece_compressor compressor(piece_compressor::form::stream_part, std::max(options.compression, 1));
    running_crc whole;
    for (const channel& c : channels) {
        compress_channel(v, c, half_floats::widen, head, compressed_piece_bytes, options.threads, compressor,
                         [&](const compressed_piece& piece) {
                             out.write(piece.bytes);
                             whole.add(piece);
                             meter.advance(piece.source_size);
                         });
        head = {};
    }
    out.write(deflate_end);
    out.write_value(whole.crc);
    out.write_value(static_cast<std::uint32_t>(whole.size)); // modulo 2^32, as gzip has it
}

void write_plain(output_file& out, const volume& v, const channel& c, progress_meter& meter) {
    stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) {
        out.write(piece);
        meter.advance(piece.size());
    });
}

// ---- NIfTI

// NIfTI's number of a type of voxels.
struct nifti_type {
    std::int16_t code, bits;
};
nifti_type nifti_type_of(const channel& c) {
    constexpr std::array<nifti_type, 10> types{
        {{2, 8}, {2, 8}, {512, 16}, {768, 32}, {1280, 64}, {8, 32}, {1024, 64}, {16, 32}, {16, 32}, {64, 64}}};
    if (c.type == scalar::u8 && c.components == 3) return {128, 24};
    if (c.type == scalar::u8 && c.components == 4) return {2304, 32};
    return types[static_cast<std::size_t>(c.type)];
}

// True if the components of a voxel do not lie together.
bool has_planes(const channel& c) { return c.components == 2 || (c.components > 2 && c.type != scalar::u8); }

// How far the single precision of the header moves the farthest voxel along an axis, in voxels.
double moved_by_floats(const volume& v, std::size_t axis) {
    const auto lost = [](double value) { return std::abs(static_cast<double>(static_cast<float>(value)) - value); };
    const double size = v.voxel_size[axis], first = v.origin[axis] + size / 2;
    return (lost(first) + lost(size) * static_cast<double>(v.extent[axis] - 1)) / size;
}

// The header and the four bytes that say that no extension follows.
std::vector<std::byte> nifti_header(const volume& v, const channel& c, patient_axes axes) {
    constexpr std::size_t values_at = 352;
    std::vector<std::byte> header(values_at, std::byte{0});
    const auto put = [&header](std::size_t at, const auto& value) { std::memcpy(&header[at], &value, sizeof(value)); };
    put(0, std::int32_t{348});
    std::array<std::int16_t, 8> dim{3, 1, 1, 1, 1, 1, 1, 1};
    std::array<float, 8> step{1, 1, 1, 1, 1, 1, 1, 1};
    for (std::size_t a = 0; a < 3; ++a) {
        dim[a + 1] = static_cast<std::int16_t>(v.extent[a]);
        step[a + 1] = static_cast<float>(v.voxel_size[a]);
    }
    constexpr std::int16_t vectors = 1007, aligned = 2;
    if (has_planes(c)) {
        dim[0] = 5;
        dim[5] = static_cast<std::int16_t>(c.components);
        put(68, vectors);
    }
    put(40, dim);
    put(70, nifti_type_of(c).code);
    put(72, nifti_type_of(c).bits);
    put(76, step); // its first number says that the quaternion does not mirror
    put(108, static_cast<float>(values_at));
    put(112, 1.0F); // values are as they are
    put(252, aligned);
    put(254, aligned);
    // x and y of LPS run against those of RAS: half a turn around z, the quaternion (0, 0, 0, 1).
    const float sign = axes == patient_axes::lps ? -1.0F : 1.0F;
    put(264, axes == patient_axes::lps ? 1.0F : 0.0F);
    for (std::size_t a = 0; a < 3; ++a) {
        std::array<float, 4> row{0, 0, 0, 0};
        row[a] = a < 2 ? sign * step[a + 1] : step[a + 1];
        row[3] = (a < 2 ? sign : 1.0F) * static_cast<float>(v.origin[a] + v.voxel_size[a] / 2);
        put(268 + 4 * a, row[3]);
        put(280 + 16 * a, row);
    }
    const std::string program = "voxelize", name = c.name.substr(0, 15); // both end with a zero
    std::memcpy(&header[148], program.data(), program.size());
    std::memcpy(&header[328], name.data(), name.size());
    put(344, std::array<char, 4>{'n', '+', '1', '\0'});
    return header;
}

// One component of a channel as a channel, which reads that of `v`.
channel plane_of(const volume& v, const channel& c, std::size_t component) {
    const scalar type = streamed_type(c.type, half_floats::widen);
    const std::size_t size = size_of(type), each = size * static_cast<std::size_t>(c.components);
    return {c.name, type, 1, {}, [&v, &c, component, size, each](std::uint64_t first, std::span<std::byte> to) {
                std::vector<std::byte> room;
                const std::size_t count = to.size() / size;
                const auto from = streamed_piece(v, c, half_floats::widen, first * each, count * each, room);
                for (std::size_t i = 0; i < count; ++i)
                    std::memcpy(&to[i * size], &from[i * each + component * size], size);
            }};
}

} // namespace

std::vector<std::filesystem::path> write_nii(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    double moved = 0;
    v.for_each_channel([&](const volume& of, const channel&) {
        check_extent(path, of.extent);
        for (std::size_t a = 0; a < 3; ++a) moved = std::max(moved, moved_by_floats(of, a));
    });
    if (constexpr double most = 0x1p-10; moved > most && options.warn)
        options.warn("\"" + path.string() + "\": its header has floats, which move voxels by up to " +
                     decimal(moved, 3) + " of their size; .nrrd has doubles");
    progress_meter meter(options.progress, streamed_bytes(v, half_floats::widen));
    const bool compress = lower_extension(path) == ".nii.gz";
    std::vector<std::unique_ptr<output_file>> files;
    v.for_each_channel([&](const volume& of, const channel& c) {
        files.push_back(std::make_unique<output_file>(channel_path(path, v, c)));
        output_file& out = *files.back();
        std::vector<channel> planes;
        if (has_planes(c))
            for (int m = 0; m < c.components; ++m) planes.push_back(plane_of(of, c, static_cast<std::size_t>(m)));
        const std::span<const channel> parts = planes.empty() ? std::span{&c, 1} : std::span<const channel>{planes};
        const std::vector<std::byte> header = nifti_header(of, c, options.space);
        if (compress) {
            write_gzip_image(out, header, of, parts, options, meter);
        } else {
            out.write(header);
            for (const channel& part : parts) write_plain(out, of, part, meter);
        }
    });
    return commit_all(files);
}

std::vector<std::filesystem::path> write_nrrd(const volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    progress_meter meter(options.progress, streamed_bytes(v, half_floats::widen));
    const bool compress = options.compression > 0;
    std::vector<std::unique_ptr<output_file>> files;
    v.for_each_channel([&](const volume& of, const channel& c) {
        files.push_back(std::make_unique<output_file>(channel_path(path, v, c)));
        output_file& out = *files.back();
        out.write(header_of(of, c, options.space, compress));
        if (compress)
            write_gzip_image(out, {}, of, {&c, 1}, options, meter);
        else
            write_plain(out, of, c, meter);
    });
    return commit_all(files);
}

} // namespace voxelize
