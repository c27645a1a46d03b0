// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "npy.hpp"

#include "dense_stream.hpp"
#include "progress.hpp"

#include <array>
#include <memory>
#include <set>

namespace voxelize {
namespace {

// Type string of numpy.dtype: byte order, kind, bytes.
std::string_view dtype_of(scalar type) {
    constexpr std::array<std::string_view, 10> names{"|u1", "|u1", "<u2", "<u4", "<u8",
                                                     "<i4", "<i8", "<f2", "<f4", "<f8"};
    return names[static_cast<std::size_t>(type)];
}

} // namespace

std::string npy_header(const volume& v, const channel& c) {
    std::string shape = "(";
    shape += std::to_string(v.extent[2]) + ", " + std::to_string(v.extent[1]) + ", " + std::to_string(v.extent[0]);
    if (c.components > 1) shape += ", " + std::to_string(c.components);
    return npy_header(c.type, shape + ")");
}

std::string npy_header(scalar type, const std::string& shape) {
    std::string text =
        "{'descr': '" + std::string(dtype_of(type)) + "', 'fortran_order': False, 'shape': " + shape + ", }";
    constexpr std::size_t prefix = 10; // magic, version, length
    const std::size_t padded = (prefix + text.size() + 1 + 63) / 64 * 64;
    text.append(padded - prefix - text.size() - 1, ' ');
    text += '\n';
    std::string header = "\x93NUMPY";
    header += '\x01';
    header += '\0';
    header += static_cast<char>(text.size() & 0xff);
    header += static_cast<char>(text.size() >> 8);
    return header + text;
}

std::filesystem::path channel_path(const std::filesystem::path& path, const volume& v, const channel& c) {
    if (v.num_channels() < 2) return path;
    return with_word(path, c.name);
}

written_names channel_names(const volume& shape, const std::filesystem::path& path, const write_options&, held_as) {
    written_names names;
    shape.for_each_channel(
        [&](const volume&, const channel& c) { names.files.push_back(channel_path(path, shape, c)); });
    return names;
}

written_names npy_names(const volume& shape, const std::filesystem::path& path, const write_options& options,
                        held_as held) {
    written_names names;
    if (held != held_as::list) names = channel_names(shape, path, options, held);
    if (held == held_as::grid) return names;
    std::set<std::filesystem::path> files(names.files.begin(), names.files.end());
    files.insert(path);
    for (const channel& c : shape.channels)
        if (c.type != scalar::bit) files.insert(with_word(path, c.name));
    names.files.assign(files.begin(), files.end());
    return names;
}

std::vector<std::filesystem::path> write_npy(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    progress_meter meter(options.progress, streamed_bytes(v, half_floats::keep));
    std::vector<std::unique_ptr<output_file>> files;
    v.for_each_channel([&](const volume& of, const channel& c) {
        files.push_back(std::make_unique<output_file>(channel_path(path, v, c)));
        output_file& out = *files.back();
        out.write(npy_header(of, c));
        stream_values(of, c, half_floats::keep, [&](std::span<const std::byte> piece) {
            out.write(piece);
            meter.advance(piece.size());
        });
    });
    return commit_all(files);
}

} // namespace voxelize
