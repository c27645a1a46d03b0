// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The bytes that the process that runs assimp sends back. The reader trusts nothing: the sender has had a hostile file.

#include "model/affine.hpp"
#include "model/model_error.hpp"
#include "model/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace voxelize::assimp {

// A texture as its material names it.
struct texture_source {
    std::string path;           // as the file has it; empty: embedded or none
    std::int32_t embedded = -1; // index into model::embedded
    wrap_mode wrap_s = wrap_mode::repeat;
    wrap_mode wrap_t = wrap_mode::repeat;
    // A picture of alpha alone (map_d of an OBJ), which multiplies that of the texture; empty: none.
    std::string alpha_path;
    // The channel of that: 'r', 'g', 'b', 'm' (alpha) or 'l' (luminance); else alpha, or luminance where it is opaque.
    char alpha_channel = 0;

    [[nodiscard]] bool is_there() const { return !path.empty() || embedded >= 0 || !alpha_path.empty(); }
};

// An encoded picture, or with a width pixels of RGBA.
struct embedded_picture {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::byte> bytes;
};

// A model between assimp and the scene: all but decoded pictures.
struct model {
    std::vector<primitive> primitives;
    std::vector<instance> instances;
    std::vector<material> materials;      // texture is not set
    std::vector<texture_source> textures; // one a material
    std::vector<embedded_picture> embedded;
    std::vector<std::string> warnings;
    std::vector<std::string> files; // that were read beside the model's own, relative to its folder
};

class wire_writer {
public:
    template <class Value>
    requires std::is_trivially_copyable_v<Value>
    void value(const Value& v) {
        const auto* const at = reinterpret_cast<const std::byte*>(&v);
        bytes_.insert(bytes_.end(), at, at + sizeof(Value));
    }

    template <class List>
    void list(const List& elements) {
        value(static_cast<std::uint64_t>(elements.size()));
        const std::span<const std::byte> bytes = std::as_bytes(std::span(elements.data(), elements.size()));
        bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    }

    [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

private:
    std::vector<std::byte> bytes_;
};

class wire_reader {
public:
    explicit wire_reader(std::span<const std::byte> bytes) : bytes_{bytes} {}

    template <class Value>
    requires std::is_trivially_copyable_v<Value>
    void value(Value& v) {
        const std::span<const std::byte> source = take(1, sizeof(Value));
        std::memcpy(&v, source.data(), sizeof(Value));
    }

    template <class List>
    void list(List& elements) {
        using element = typename List::value_type;
        static_assert(std::is_trivially_copyable_v<element>);
        std::uint64_t count = 0;
        value(count);
        const std::span<const std::byte> source = take(count, sizeof(element));
        elements.resize(static_cast<std::size_t>(count));
        if (count != 0) std::memcpy(elements.data(), source.data(), source.size());
    }

    // A number of elements that follow, each of MIN_BYTES at least.
    [[nodiscard]] std::size_t count(std::size_t min_bytes) {
        std::uint64_t number = 0;
        value(number);
        if (number > bytes_.size() / min_bytes) fail();
        return static_cast<std::size_t>(number);
    }

    [[nodiscard]] bool at_end() const { return bytes_.empty(); }

    [[noreturn]] static void fail() { throw model_error("assimp gave a model that is not valid"); }

private:
    std::span<const std::byte> take(std::uint64_t count, std::size_t bytes_each) {
        if (count > bytes_.size() / bytes_each) fail();
        const std::span<const std::byte> taken = bytes_.first(static_cast<std::size_t>(count) * bytes_each);
        bytes_ = bytes_.subspan(taken.size());
        return taken;
    }

    std::span<const std::byte> bytes_;
};

[[nodiscard]] std::vector<std::byte> to_bytes(const model& source);

// Everything that scene.hpp promises of indices and lengths holds of the result. Throws model_error.
[[nodiscard]] model from_bytes(std::span<const std::byte> bytes);

} // namespace voxelize::assimp
