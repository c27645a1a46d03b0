// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "picture_file.hpp"

#include "picture_header.hpp"
#include "stb_memory.hpp"
#include "text.hpp"

#include <stb_image.h>
#ifdef VOXELIZE_HAS_WEBP
#include <webp/decode.h>
#endif

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <string_view>

namespace voxelize::gltf {

namespace {

enum class picture_format { png, jpeg, webp, bmp, tga, other };

// MAGIC stands AT bytes behind the start.
bool has_magic(std::span<const std::byte> bytes, std::size_t at, std::string_view magic) {
    return bytes.size() >= at + magic.size() && std::memcmp(bytes.data() + at, magic.data(), magic.size()) == 0;
}

// The name of a format that is known and not supported, by the signature of BYTES; null for all others.
const char* unsupported_format(std::span<const std::byte> bytes) {
    struct known {
        std::size_t at;
        std::string_view magic;
        const char* name;
    };
    using namespace std::string_view_literals;
    constexpr known formats[] = {{0, "\xABKTX 20\xBB\r\n\x1A\n"sv, "KTX2"},
                                 {0, "\xABKTX 11\xBB\r\n\x1A\n"sv, "KTX"},
                                 {4, "ftypavif"sv, "AVIF"},
                                 {0, "DDS "sv, "DDS"},
                                 {0, "GIF8"sv, "GIF"},
                                 {0, "II*\0"sv, "TIFF"},
                                 {0, "MM\0*"sv, "TIFF"},
                                 {0, "sB"sv, "Basis Universal"}};
    for (const known& format : formats)
        if (has_magic(bytes, format.at, format.magic)) return format.name;
    return nullptr;
}

picture_format format_of(std::span<const std::byte> bytes) {
    if (has_magic(bytes, 0, "\x89PNG\r\n\x1a\n")) return picture_format::png;
    if (has_magic(bytes, 0, "\xFF\xD8\xFF")) return picture_format::jpeg;
    if (has_magic(bytes, 0, "RIFF") && has_magic(bytes, 8, "WEBP")) return picture_format::webp;
    if (has_magic(bytes, 0, "BM")) return picture_format::bmp;
    if (unsupported_format(bytes) == nullptr && is_tga(bytes)) return picture_format::tga;
    return picture_format::other;
}

// The reason why BYTES, which are in none of the formats above, are refused.
std::string reason_against(std::span<const std::byte> bytes) {
    if (const char* const name = unsupported_format(bytes))
        return std::string("it is ") + name + ", which is not supported (PNG, JPEG, WebP, TGA and BMP are)";
    return "it is neither PNG, JPEG, WebP, TGA nor BMP";
}

// stb_image's reason in words that name what is damaged, whatever it says and if it says nothing.
gltf_error not_decodable(const char* kind) {
    const char* const given = stbi_failure_reason();
    const std::string reason = given != nullptr ? printable(given) : "";
    return gltf_error("it cannot be decoded (damaged " + std::string(kind) + (reason.empty() ? "" : ": " + reason) +
                      ')');
}

picture decode_by_stb(std::span<const std::byte> bytes, const char* kind) {
    const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    int width = 0;
    int height = 0;
    int channels = 0;
    struct free_pixels {
        void operator()(stbi_uc* pixels) const { stbi_image_free(pixels); }
    };
    stb_ran_out_of_memory = false;
    forget_stb_failure(); // of another picture
    const std::unique_ptr<stbi_uc, free_pixels> decoded{
        stbi_load_from_memory(data, size, &width, &height, &channels, 4)};
    if (!decoded && stb_ran_out_of_memory) throw std::bad_alloc{};
    if (!decoded || width < 1 || height < 1) throw not_decodable(kind);
    picture result;
    result.width = static_cast<std::uint32_t>(width);
    result.height = static_cast<std::uint32_t>(height);
    result.rgba.assign(decoded.get(), decoded.get() + std::size_t{4} * result.width * result.height);
    return result;
}

#ifdef VOXELIZE_HAS_WEBP
// A picture may take 64 MiB, or 1024 times its encoded size, whichever is more. WebP has no such bound of its own: a
// lossless one of a single colour takes no bits for its pixels.
void check_webp_size(std::uint64_t width, std::uint64_t height, std::uint64_t encoded_bytes,
                     const gltf_limits& limits) {
    check_sides(width, height, limits);
    const std::uint64_t allowed = (std::uint64_t{64} << 20) + 1024 * encoded_bytes;
    if (width * height * 4 > allowed)
        throw gltf_error("its " + std::to_string(width) + " x " + std::to_string(height) +
                         " pixels are too large: at most " + std::to_string(allowed / 4) + " are read from a WebP of " +
                         std::to_string(encoded_bytes) + " bytes");
}

picture decode_webp(std::span<const std::byte> bytes, const gltf_limits& limits) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    int width = 0;
    int height = 0;
    if (WebPGetInfo(data, bytes.size(), &width, &height) == 0 || width < 1 || height < 1)
        throw gltf_error("it cannot be decoded (damaged WebP: no header with its size)");
    check_webp_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), bytes.size(), limits);
    picture result;
    result.width = static_cast<std::uint32_t>(width);
    result.height = static_cast<std::uint32_t>(height);
    result.rgba.resize(std::size_t{4} * result.width * result.height);
    if (WebPDecodeRGBAInto(data, bytes.size(), result.rgba.data(), result.rgba.size(), 4 * width) == nullptr)
        throw gltf_error("it cannot be decoded (damaged WebP)");
    return result;
}
#else
picture decode_webp(std::span<const std::byte>, const gltf_limits&) {
    throw gltf_error("it is WebP, and this build has no libwebp");
}
#endif

} // namespace

picture decode_picture(std::span<const std::byte> bytes, const gltf_limits& limits) {
    if (bytes.empty()) throw gltf_error("it is empty");
    if (bytes.size() > INT32_MAX) throw gltf_error("it is larger than 2 GiB");
    switch (format_of(bytes)) {
    case picture_format::png:
        check_png(bytes, limits);
        return decode_by_stb(bytes, "PNG");
    case picture_format::jpeg:
        check_jpeg(bytes, limits);
        return decode_by_stb(bytes, "JPEG");
    case picture_format::webp:
        return decode_webp(bytes, limits);
    case picture_format::bmp:
        check_bmp(bytes, limits);
        return decode_by_stb(bytes, "BMP");
    case picture_format::tga: {
        check_tga(bytes, limits);
        picture decoded = decode_by_stb(bytes, "TGA");
        if (!states_tga_alpha(bytes))
            for (std::size_t alpha = 3; alpha < decoded.rgba.size(); alpha += 4) decoded.rgba[alpha] = 255;
        return decoded;
    }
    case picture_format::other:
        break;
    }
    throw gltf_error(reason_against(bytes));
}

} // namespace voxelize::gltf
