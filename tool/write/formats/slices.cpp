// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "slices.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "progress.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <libdeflate.h>
#include <string_view>

namespace voxelize {
namespace {

using png_bytes = std::vector<std::byte>;

std::filesystem::path slice_path(const std::filesystem::path& path, std::int64_t layer) {
    std::string number = std::to_string(layer);
    if (number.size() < 4) number.insert(0, 4 - number.size(), '0');
    std::string name = path.filename().string();
    name.replace(name.find(layer_place), layer_place.size(), number);
    return path.parent_path() / name;
}

void append_big_endian(png_bytes& to, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::byte>(value >> shift & 0xffU));
}

// A chunk of a PNG file: its length, its name and its bytes, and their check sum.
void append_chunk(png_bytes& to, std::string_view name, std::span<const std::byte> bytes) {
    append_big_endian(to, static_cast<std::uint32_t>(bytes.size()));
    const std::size_t begin = to.size();
    for (const char c : name) to.push_back(static_cast<std::byte>(c));
    to.insert(to.end(), bytes.begin(), bytes.end());
    append_big_endian(to, libdeflate_crc32(0, to.data() + begin, to.size() - begin));
}

template <class T>
T value_at(std::span<const std::byte> values, std::size_t n) {
    T value;
    std::memcpy(&value, values.data() + n * sizeof(T), sizeof(T));
    return value;
}

// Nearest number of `bits` bits to a share of white.
std::uint16_t shade(double value, int bits) {
    const double white = bits == 16 ? 65535 : 255;
    return static_cast<std::uint16_t>(value > 0 ? std::min(value, 1.0) * white + 0.5 : 0);
}

// The pixel of a value of the stream.
class shades {
public:
    shades(const channel& c, int bits) : is_bit_(c.type == scalar::bit), type_(c.type), bits_(bits) {}

    [[nodiscard]] std::uint16_t operator()(std::span<const std::byte> values, std::size_t n) const {
        if (is_bit_) return shade(value_at<std::uint8_t>(values, n) != 0 ? 1 : 0, bits_);
        if (type_ == scalar::u8) return value_at<std::uint8_t>(values, n);
        if (type_ == scalar::u16) return value_at<std::uint16_t>(values, n);
        if (type_ == scalar::f64) return shade(value_at<double>(values, n), bits_);
        return shade(value_at<float>(values, n), bits_);
    }

private:
    bool is_bit_;
    scalar type_;
    int bits_;
};

// A layer's rows from the top, each behind a byte that says that it is not filtered.
png_bytes rows_of(const volume& v, const channel& c, std::int64_t layer, int bits) {
    const auto width = static_cast<std::size_t>(v.extent[0]), height = static_cast<std::size_t>(v.extent[1]);
    const std::size_t value_size = size_of(streamed_type(c.type, half_floats::widen));
    std::vector<std::byte> room;
    const std::span<const std::byte> values =
        streamed_piece(v, c, half_floats::widen, static_cast<std::uint64_t>(layer) * width * height * value_size,
                       width * height * value_size, room);
    const shades shade_of(c, bits);
    png_bytes rows;
    rows.reserve(height * (1 + width * static_cast<std::size_t>(bits / 8)));
    for (std::size_t j = height; j-- > 0;) {
        rows.push_back(std::byte{0});
        for (std::size_t i = 0; i < width; ++i) {
            const std::uint16_t pixel = shade_of(values, j * width + i);
            if (bits == 16) rows.push_back(static_cast<std::byte>(pixel >> 8U));
            rows.push_back(static_cast<std::byte>(pixel & 0xffU));
        }
    }
    return rows;
}

png_bytes compress_rows(const png_bytes& rows, int level) {
    const whole_compressor compressor(level);
    png_bytes packed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
    packed.resize(libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), packed.data(), packed.size()));
    return packed;
}

png_bytes encode_slice(const volume& v, const channel& c, std::int64_t layer, int bits, int level) {
    constexpr std::array<std::uint8_t, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    constexpr std::uint32_t linear = 100'000; // the exponent 1, in units of 1/100000
    const png_bytes packed = compress_rows(rows_of(v, c, layer, bits), level);
    png_bytes file, head, gamma;
    file.reserve(packed.size() + 100);
    for (const std::uint8_t byte : signature) file.push_back(static_cast<std::byte>(byte));
    append_big_endian(head, static_cast<std::uint32_t>(v.extent[0]));
    append_big_endian(head, static_cast<std::uint32_t>(v.extent[1]));
    // Grey; deflate, the only set of filters, no interlacing.
    for (const int byte : {bits, 0, 0, 0, 0}) head.push_back(static_cast<std::byte>(byte));
    append_big_endian(gamma, linear);
    append_chunk(file, "IHDR", head);
    append_chunk(file, "gAMA", gamma);
    append_chunk(file, "IDAT", packed);
    append_chunk(file, "IEND", {});
    return file;
}

// Bits of a pixel.
int bits_of(const channel& c, const std::filesystem::path& path, const write_options& options) {
    if (c.type == scalar::u8 || c.type == scalar::u16) {
        const int bits = c.type == scalar::u8 ? 8 : 16;
        if (options.slice_bits != 0 && options.slice_bits != bits)
            throw write_error(path, "slices hold " + std::string(name_of(c.type)) + " as it is, in " +
                                        std::to_string(bits) + " bits");
        return bits;
    }
    const bool is_float = c.type == scalar::f16 || c.type == scalar::f32 || c.type == scalar::f64;
    if (c.type != scalar::bit && !is_float)
        throw write_error(path, "slices hold bits, bytes, 16-bit integers or floats from 0 to 1, and channel " +
                                    c.name + " is " + std::string(name_of(c.type)));
    if (options.slice_bits != 0) return options.slice_bits;
    return is_float ? 16 : 8;
}

} // namespace

std::vector<std::filesystem::path> write_slices(const volume& v, const std::filesystem::path& path,
                                                const write_options& options) {
    if (v.channels.size() != 1 || v.channels.front().components != 1)
        throw write_error(path, "slices hold one channel of one component");
    const channel& c = v.channels.front();
    const int bits = bits_of(c, path, options);
    // Less than what the length of a chunk can say, and a part of what libdeflate takes at once.
    if ((v.extent[0] * bits / 8 + 1) * v.extent[1] > 0x7000'0000)
        throw write_error(path, "a layer has more pixels than a PNG file holds");
    constexpr std::size_t group = 256; // files that are open at once
    std::vector<std::filesystem::path> paths;
    std::vector<std::unique_ptr<output_file>> files;
    progress_meter meter(options.progress, static_cast<std::uint64_t>(v.extent[2]));
    const auto commit = [&] {
        for (std::filesystem::path& each : commit_all(files)) paths.push_back(std::move(each));
        files.clear();
    };
    ordered_for(
        static_cast<std::size_t>(v.extent[2]), thread_count(options.threads),
        [&](std::size_t layer) {
            return encode_slice(v, c, static_cast<std::int64_t>(layer), bits, options.compression);
        },
        [&](std::size_t layer, const png_bytes& file) {
            files.push_back(std::make_unique<output_file>(slice_path(path, static_cast<std::int64_t>(layer))));
            files.back()->write(file);
            meter.advance(1);
            if (files.size() == group) commit();
        });
    commit();
    return paths;
}

written_names slice_names(const volume& shape, const std::filesystem::path& path, const write_options&, held_as) {
    written_names names;
    for (std::int64_t layer = 0; layer < std::max<std::int64_t>(1, shape.extent[2]); ++layer)
        names.files.push_back(slice_path(path, layer));
    return names;
}

} // namespace voxelize
