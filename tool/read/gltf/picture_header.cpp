// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "picture_header.hpp"

#include "text.hpp"

#include <algorithm>
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

std::uint64_t little_endian(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
    std::uint64_t number = 0;
    for (std::size_t i = count; i-- > 0;) number = number << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
    return number;
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

// The header of a TGA, as far as it matters here.
struct tga_header {
    std::uint64_t width = 0, height = 0, bits = 0, alpha_bits = 0;
    bool has_map = false, is_packed = false, is_known = false;
};

constexpr std::size_t tga_header_bytes = 18;

tga_header tga_header_of(std::span<const std::byte> bytes) {
    tga_header header;
    if (bytes.size() < tga_header_bytes) return header;
    const std::uint64_t map = little_endian(bytes, 1, 1), type = little_endian(bytes, 2, 1);
    header.has_map = map == 1;
    header.is_packed = type >= 8;
    header.width = little_endian(bytes, 12, 2);
    header.height = little_endian(bytes, 14, 2);
    header.bits = little_endian(bytes, 16, 1);
    header.alpha_bits = little_endian(bytes, 17, 1) & 0xF;
    const std::uint64_t color_type = type & 7;
    const bool has_type = (type | 8) == (color_type | 8) && color_type >= 1 && color_type <= 3;
    constexpr std::array<std::uint64_t, 5> depths{8, 15, 16, 24, 32};
    header.is_known = map <= 1 && has_type && (color_type == 1) == header.has_map && header.width != 0 &&
                      header.height != 0 && std::find(depths.begin(), depths.end(), header.bits) != depths.end();
    return header;
}

} // namespace

bool is_tga(std::span<const std::byte> bytes) { return tga_header_of(bytes).is_known; }

bool states_tga_alpha(std::span<const std::byte> bytes) {
    const tga_header header = tga_header_of(bytes);
    return header.has_map || header.alpha_bits != 0;
}

bool may_have_alpha(std::span<const std::byte> start) {
    const auto has_magic = [&](std::size_t at, std::string_view magic) {
        return start.size() >= at + magic.size() &&
               std::string_view(reinterpret_cast<const char*>(start.data()) + at, magic.size()) == magic;
    };
    if (has_magic(0, "\x89PNG\r\n\x1a\n")) {
        if (start.size() < 26) return false;
        const std::uint64_t type = big_endian(start, 25, 1);
        if (type == 4 || type == 6) return true;
        for (std::size_t at = 8; start.size() - at >= 8;) {
            if (has_magic(at + 4, "tRNS")) return true;
            if (has_magic(at + 4, "IDAT")) return false;
            const std::uint64_t length = big_endian(start, at, 4) + 12;
            if (length > start.size() - at) return false;
            at += static_cast<std::size_t>(length);
        }
        return false;
    }
    if (has_magic(0, "RIFF") && has_magic(8, "WEBP")) {
        if (has_magic(12, "VP8X") && start.size() > 20) return (little_endian(start, 20, 1) & 0x10) != 0;
        return has_magic(12, "VP8L") && start.size() > 24 && (little_endian(start, 24, 1) & 0x10) != 0;
    }
    if (has_magic(0, "BM")) return start.size() > 30 && little_endian(start, 28, 2) == 32;
    const tga_header header = tga_header_of(start);
    return !has_magic(0, "\xFF\xD8\xFF") && header.is_known && header.alpha_bits != 0;
}

void check_tga(std::span<const std::byte> bytes, const gltf_limits& limits) {
    const tga_header header = tga_header_of(bytes);
    check_sides(header.width, header.height, limits);
    const std::uint64_t pixel = (header.bits + 7) / 8, pixels = header.width * header.height;
    constexpr std::uint64_t most_of_packet = 128; // pixels
    const std::uint64_t least =
        header.is_packed ? (pixels + most_of_packet - 1) / most_of_packet * (1 + pixel) : pixels * pixel;
    if (least > bytes.size() - tga_header_bytes)
        throw gltf_error("the TGA is cut short: " + in_pixels(header.width, header.height) + " cannot come from " +
                         std::to_string(bytes.size()) + " bytes");
}

void check_bmp(std::span<const std::byte> bytes, const gltf_limits& limits) {
    constexpr std::size_t core_header = 26, info_header = 54; // bytes, with those of the file
    if (bytes.size() < core_header) throw gltf_error("the BMP is cut short within its header");
    const std::uint64_t first = little_endian(bytes, 10, 4), size = little_endian(bytes, 14, 4);
    const bool is_core = size == 12;
    if (!is_core && bytes.size() < info_header) throw gltf_error("the BMP is cut short within its header");
    const std::uint64_t width = is_core ? little_endian(bytes, 18, 2) : little_endian(bytes, 18, 4);
    std::uint64_t height = is_core ? little_endian(bytes, 20, 2) : little_endian(bytes, 22, 4);
    constexpr std::uint64_t sign = std::uint64_t{1} << 31;
    if (!is_core && height >= sign) height = 2 * sign - height; // from the top down
    const std::uint64_t bits = little_endian(bytes, is_core ? 24 : 28, 2);
    const std::uint64_t compression = is_core ? 0 : little_endian(bytes, 30, 4);
    if (compression != 0 && compression != 3)
        throw gltf_error("it is a compressed BMP, and only those without compression are supported");
    check_sides(width, height, limits);
    const std::uint64_t least = (width * bits + 31) / 32 * 4 * height;
    if (first > bytes.size() || least > bytes.size() - first)
        throw gltf_error("the BMP is cut short: " + in_pixels(width, height) + " cannot come from " +
                         std::to_string(bytes.size()) + " bytes");
}

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
