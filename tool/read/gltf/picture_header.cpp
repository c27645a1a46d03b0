// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "picture_header.hpp"

#include "text.hpp"

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace voxelize::gltf {

namespace {

std::uint64_t big_endian(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < count; ++i) number = number << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
    return number;
}

std::string in_pixels(std::uint64_t width, std::uint64_t height) {
    return "its " + std::to_string(width) + " x " + std::to_string(height) + " pixels";
}

gltf_error impossible(std::uint64_t width, std::uint64_t height, std::uint64_t bytes, const char* kind) {
    return gltf_error(in_pixels(width, height) + " cannot come from " + std::to_string(bytes) + " bytes" + kind);
}

// What the chunk IHDR holds.
struct png_header {
    std::uint64_t width = 0, height = 0, depth = 0, color = 0;
    bool interlaced = false;

    // Bits of a pixel; nothing for a type of colour that PNG does not have.
    [[nodiscard]] std::optional<std::uint64_t> pixel_bits() const {
        constexpr std::array<std::uint64_t, 7> channels{1, 0, 3, 1, 2, 0, 4};
        if (color >= channels.size() || channels[color] == 0) return std::nullopt;
        return channels[color] * depth;
    }
    // Bytes of all rows before they are compressed, each with its filter's byte.
    [[nodiscard]] std::uint64_t raw_bytes(std::uint64_t bits) const {
        struct pass {
            std::uint64_t x, y, step_x, step_y;
        };
        constexpr std::array<pass, 7> adam7{
            {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4}, {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}}};
        constexpr std::array<pass, 1> whole{{{0, 0, 1, 1}}};
        std::uint64_t total = 0;
        for (const pass& p : interlaced ? std::span<const pass>(adam7) : std::span<const pass>(whole)) {
            if (width <= p.x || height <= p.y) continue;
            const std::uint64_t columns = (width - p.x + p.step_x - 1) / p.step_x;
            const std::uint64_t rows = (height - p.y + p.step_y - 1) / p.step_y;
            total += rows * (1 + (columns * bits + 7) / 8);
        }
        return total;
    }
};

png_header header_of(std::span<const std::byte> content) {
    constexpr std::size_t header_bytes = 13;
    if (content.size() != header_bytes) throw gltf_error("its PNG header has another length than 13 bytes");
    png_header header;
    header.width = big_endian(content, 0, 4);
    header.height = big_endian(content, 4, 4);
    header.depth = big_endian(content, 8, 1);
    header.color = big_endian(content, 9, 1);
    header.interlaced = big_endian(content, 12, 1) != 0;
    return header;
}

} // namespace

void check_sides(std::uint64_t width, std::uint64_t height, const gltf_limits& limits) {
    const std::uint32_t side = limits.max_image_side;
    if (width > side || height > side)
        throw gltf_error(in_pixels(width, height) + " are too large: at most " + std::to_string(side) +
                         " a side are read");
}

void check_png(std::span<const std::byte> bytes, const gltf_limits& limits) {
    constexpr std::size_t signature = 8, chunk_head = 8, chunk_tail = 4; // length and type; checksum
    constexpr std::uint64_t deflate_ratio = 1032;
    std::optional<png_header> header;
    std::uint64_t compressed = 0;
    for (std::size_t at = signature;;) {
        if (bytes.size() - at < chunk_head) throw gltf_error("the PNG is cut short: its end chunk IEND is missing");
        const std::uint64_t length = big_endian(bytes, at, 4);
        const std::string_view type{reinterpret_cast<const char*>(bytes.data()) + at + 4, 4};
        at += chunk_head;
        if (type == "IEND") break;
        if (length > bytes.size() - at || bytes.size() - at - length < chunk_tail)
            throw gltf_error("the PNG is cut short within its chunk " + in_quotes(type));
        const auto content = bytes.subspan(at, static_cast<std::size_t>(length));
        at += content.size() + chunk_tail;
        if (type == "IHDR" && !header) {
            header = header_of(content);
            check_sides(header->width, header->height, limits);
            continue;
        }
        if (type == "CgBI") continue; // Apple's, which stands first
        if (!header) throw gltf_error("the PNG does not begin with its header IHDR");
        if (type == "IDAT") compressed += length;
        const bool is_critical = (std::to_integer<unsigned>(static_cast<std::byte>(type[0])) & 0x20U) == 0;
        if (is_critical && type != "IDAT" && type != "PLTE" && type != "IHDR")
            throw gltf_error("the PNG has a chunk " + in_quotes(type) + ", which is not known and not optional");
    }
    if (!header) throw gltf_error("the PNG has no header IHDR");
    if (compressed == 0) throw gltf_error("the PNG has no pixels: its chunk IDAT is missing or empty");
    const std::optional<std::uint64_t> bits = header->pixel_bits(); // nothing: the decoder says so
    if (bits && header->raw_bytes(*bits) > deflate_ratio * compressed)
        throw impossible(header->width, header->height, compressed, " of compressed data");
}

void check_jpeg(std::span<const std::byte> bytes, const gltf_limits& limits) {
    constexpr unsigned start_of_scan = 0xDA, end_of_image = 0xD9;
    for (std::size_t at = 2;;) { // behind the signature
        while (at < bytes.size() && bytes[at] != std::byte{0xFF}) ++at;
        while (at < bytes.size() && bytes[at] == std::byte{0xFF}) ++at;
        if (at >= bytes.size()) throw gltf_error("the JPEG is cut short: it has no frame");
        const auto marker = std::to_integer<unsigned>(bytes[at++]);
        if (marker == start_of_scan || marker == end_of_image)
            throw gltf_error("the JPEG has no frame before its pixels");
        if (marker <= 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue; // they stand alone
        const std::size_t left = bytes.size() - at;
        const std::uint64_t length = left >= 2 ? big_endian(bytes, at, 2) : 0;
        if (left < 2 || length > left) throw gltf_error("the JPEG is cut short within its header");
        if (length < 2) throw gltf_error("the JPEG has a segment without a length");
        const bool is_frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (!is_frame) {
            at += static_cast<std::size_t>(length);
            continue;
        }
        if (marker > 0xC2)
            throw gltf_error("it is a JPEG of a kind that is not supported: lossless, hierarchical or arithmetic");
        if (length < 8) throw gltf_error("the JPEG has a frame without a size");
        const std::uint64_t depth = big_endian(bytes, at + 2, 1);
        const std::uint64_t height = big_endian(bytes, at + 3, 2), width = big_endian(bytes, at + 5, 2);
        if (depth != 8)
            throw gltf_error("it is a JPEG of " + std::to_string(depth) + " bits a channel, and only 8 are supported");
        check_sides(width, height, limits);
        constexpr std::uint64_t least = (std::uint64_t{64} << 20) / 4; // pixels
        const std::uint64_t blocks = ((width + 7) / 8) * ((height + 7) / 8);
        if (width * height > least && blocks > 8 * bytes.size()) throw impossible(width, height, bytes.size(), "");
        return;
    }
}

} // namespace voxelize::gltf
