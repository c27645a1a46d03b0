// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Small glTF files for tests: JSON that a test fills in as it likes, and one buffer that grows by what it appends.

#include "../test_scale.hpp"

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gltf_test {

using nlohmann::json;
using tests::is_slow_build;

// Every one, but in a slow build one in `step`.
template <class T>
[[nodiscard]] std::vector<T> some_of(const std::vector<T>& all, std::size_t step) {
    std::vector<T> some;
    if (!is_slow_build()) step = 1;
    for (std::size_t n = step / 2; n < all.size(); n += step) some.push_back(all[n]);
    return some;
}

enum component { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };

template <class Value>
constexpr int component_of() {
    if constexpr (std::is_same_v<Value, std::int8_t>) return i8;
    if constexpr (std::is_same_v<Value, std::uint8_t>) return u8;
    if constexpr (std::is_same_v<Value, std::int16_t>) return i16;
    if constexpr (std::is_same_v<Value, std::uint16_t>) return u16;
    if constexpr (std::is_same_v<Value, std::uint32_t>) return u32;
    return f32;
}

struct builder {
    json root = {{"asset", {{"version", "2.0"}}}};
    std::vector<std::byte> binary;

    // Appends bytes, aligned to 4, in a new buffer view; gives its index.
    int view(std::span<const std::byte> bytes, int byte_stride = 0) {
        while (binary.size() % 4 != 0) binary.push_back(std::byte{0});
        json entry = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
        if (byte_stride != 0) entry["byteStride"] = byte_stride;
        binary.insert(binary.end(), bytes.begin(), bytes.end());
        return append("bufferViews", entry);
    }

    // A tightly packed accessor of TYPE ("SCALAR", "VEC3", ...) over the values; gives its index.
    template <class Value>
    int accessor(const std::vector<Value>& values, const char* type, bool normalized = false) {
        const std::size_t components = type[0] == 'S' ? 1 : static_cast<std::size_t>(type[3] - '0');
        json entry = {{"bufferView", view(std::as_bytes(std::span(values)))},
                      {"componentType", component_of<Value>()},
                      {"count", values.size() / components},
                      {"type", type}};
        if (normalized) entry["normalized"] = true;
        return append("accessors", entry);
    }

    int append(const char* list, const json& entry) {
        root[list].push_back(entry);
        return static_cast<int>(root[list].size()) - 1;
    }

    // A mesh of one primitive and a node that shows it; gives the primitive's JSON, valid until the next mesh.
    json& mesh(const json& attributes) {
        const int index = append("meshes", {{"primitives", {{{"attributes", attributes}}}}});
        append("nodes", {{"mesh", index}});
        return root["meshes"].back()["primitives"][0];
    }

    // The unit right triangle in z = 0 as a mesh of its own.
    json& triangle() { return mesh({{"POSITION", accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")}}); }

    // The file as one GLB.
    [[nodiscard]] std::vector<std::byte> glb() const {
        json whole = root;
        if (!binary.empty() && !whole.contains("buffers")) whole["buffers"] = {{{"byteLength", binary.size()}}};
        std::string text = whole.dump();
        while (text.size() % 4 != 0) text += ' ';
        std::vector<std::byte> chunk = binary;
        while (chunk.size() % 4 != 0) chunk.push_back(std::byte{0});
        std::vector<std::byte> file;
        const auto put = [&](std::size_t number) {
            for (int shift = 0; shift < 32; shift += 8) file.push_back(static_cast<std::byte>(number >> shift & 0xFF));
        };
        put(0x46546C67);
        put(2);
        put(12 + 8 + text.size() + (chunk.empty() ? 0 : 8 + chunk.size()));
        put(text.size());
        put(0x4E4F534A);
        for (const char c : text) file.push_back(static_cast<std::byte>(c));
        if (!chunk.empty()) {
            put(chunk.size());
            put(0x004E4942);
            file.insert(file.end(), chunk.begin(), chunk.end());
        }
        return file;
    }

    void write_glb(const std::string& file) const {
        const std::vector<std::byte> bytes = glb();
        std::ofstream(file, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
};

inline std::string base64(std::span<const std::byte> bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t j = 0; j < 3; ++j)
            group = group << 8 | (i + j < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + j]) : 0);
        for (std::size_t j = 0; j < 4; ++j) text += i + j > bytes.size() ? '=' : digits[group >> (18 - 6 * j) & 63];
    }
    return text;
}

inline std::vector<std::byte> bytes_of(std::string_view text) {
    std::vector<std::byte> bytes(text.size());
    if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

// A PNG of RGBA pixels, stored without compression: enough for textures of a test.
inline std::vector<std::byte> png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba) {
    std::vector<std::byte> file = bytes_of("\x89PNG\r\n\x1a\n");
    const auto chunk = [&](const char* type, std::vector<std::uint8_t> data) {
        std::vector<std::uint8_t> body(type, type + 4);
        body.insert(body.end(), data.begin(), data.end());
        std::uint32_t crc = 0xFFFFFFFF;
        for (const std::uint8_t byte : body) {
            crc ^= byte;
            for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320U : 0U);
        }
        const auto put = [&](std::uint32_t number) {
            for (int shift = 24; shift >= 0; shift -= 8) file.push_back(static_cast<std::byte>(number >> shift & 0xFF));
        };
        put(static_cast<std::uint32_t>(data.size()));
        for (const std::uint8_t byte : body) file.push_back(static_cast<std::byte>(byte));
        put(~crc);
    };
    const auto big_endian = [](std::uint32_t number) {
        return std::vector<std::uint8_t>{static_cast<std::uint8_t>(number >> 24),
                                         static_cast<std::uint8_t>(number >> 16),
                                         static_cast<std::uint8_t>(number >> 8), static_cast<std::uint8_t>(number)};
    };
    std::vector<std::uint8_t> header = big_endian(width);
    const std::vector<std::uint8_t> rows = big_endian(height);
    header.insert(header.end(), rows.begin(), rows.end());
    header.insert(header.end(), {8, 6, 0, 0, 0});
    chunk("IHDR", header);

    std::vector<std::uint8_t> raw;
    for (std::uint32_t y = 0; y < height; ++y) {
        raw.push_back(0); // filter: none
        const auto row = rgba.begin() + static_cast<std::ptrdiff_t>(y) * width * 4;
        raw.insert(raw.end(), row, row + static_cast<std::ptrdiff_t>(width) * 4);
    }
    std::vector<std::uint8_t> stream = {0x78, 0x01};
    std::uint32_t a = 1;
    std::uint32_t b = 0;
    for (const std::uint8_t byte : raw) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    for (std::size_t at = 0; at < raw.size() || at == 0;) {
        const std::size_t length = std::min<std::size_t>(raw.size() - at, 65535);
        stream.push_back(at + length == raw.size() ? 1 : 0);
        for (const std::size_t number : {length, ~length}) {
            stream.push_back(static_cast<std::uint8_t>(number & 0xFF));
            stream.push_back(static_cast<std::uint8_t>(number >> 8 & 0xFF));
        }
        stream.insert(stream.end(), raw.begin() + static_cast<std::ptrdiff_t>(at),
                      raw.begin() + static_cast<std::ptrdiff_t>(at + length));
        at += std::max<std::size_t>(length, 1);
    }
    const std::vector<std::uint8_t> adler = big_endian(b << 16 | a);
    stream.insert(stream.end(), adler.begin(), adler.end());
    chunk("IDAT", stream);
    chunk("IEND", {});
    return file;
}

} // namespace gltf_test
