// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "nrrd.hpp"

#include "dense_stream.hpp"
#include "npy.hpp"
#include "progress.hpp"
#include "text.hpp"

#include <array>
#include <memory>
#include <zlib.h>

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

// A gzip stream into an output_file, with an empty name and no time, so that equal input gives equal bytes.
class gzip_stream {
public:
    gzip_stream(output_file& out, int level) : out_(out), buffer_(std::size_t{1} << 18) {
        constexpr int gzip_window = 15 + 16; // 32 KiB window, gzip wrapper
        if (deflateInit2(&stream_, level, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) != Z_OK)
            throw write_error(out.target(), "out of memory");
    }
    ~gzip_stream() { deflateEnd(&stream_); }
    gzip_stream(const gzip_stream&) = delete;
    gzip_stream& operator=(const gzip_stream&) = delete;

    // Pieces stay far below 4 GiB, which is what zlib's counters hold.
    void write(std::span<const std::byte> piece) { run(piece, Z_NO_FLUSH); }
    void finish() { run({}, Z_FINISH); }

private:
    void run(std::span<const std::byte> piece, int flush) {
        stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(piece.data()));
        stream_.avail_in = static_cast<uInt>(piece.size());
        do {
            stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
            stream_.avail_out = static_cast<uInt>(buffer_.size());
            deflate(&stream_, flush); // cannot fail on a valid stream with room to write
            out_.write(std::span{buffer_}.first(buffer_.size() - stream_.avail_out));
        } while (stream_.avail_out == 0);
    }

    output_file& out_;
    std::vector<std::byte> buffer_;
    z_stream stream_{};
};

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
            gzip_stream gzip(out, options.compression);
            stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) {
                gzip.write(piece);
                meter.advance(piece.size());
            });
            gzip.finish();
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
