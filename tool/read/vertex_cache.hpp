// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Positions, colours and texture coordinates that stay in their file: blocks of them are read where they are asked for,
// and some blocks are kept. A mesh whose faces name vertices that lie near each other in the file is read about once.

#include "model/finite.hpp"
#include "model/model_error.hpp"
#include "model/texture_transform.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

namespace voxelize {

// The layout of positions in a file.
struct position_layout {
    using value_type = glm::vec3;

    std::uint64_t first = 0; // byte of the first vertex
    std::uint64_t count = 0; // vertices
    std::size_t stride = 0;  // bytes from one to the next
    std::size_t place[3]{};  // bytes of x, y and z from there
    bool is_double[3]{};     // otherwise float
    glm::dvec3 origin{0.0};  // which values count from

    // The bytes that a vertex takes, up to the end of its last component: less than `stride` where others follow.
    [[nodiscard]] std::size_t bytes() const;
    [[nodiscard]] glm::vec3 value(const char* vertex) const;
};

// The type of an attribute's components; unsigned integers are fractions of their greatest.
enum class vertex_component : std::uint8_t { float32, byte, word };

// The layout of vertex colours in a file.
struct color_layout {
    using value_type = glm::vec4; // linear light and alpha

    std::uint64_t first = 0, count = 0; // as above
    std::size_t stride = 0;
    std::size_t place[4]{};  // bytes of red, green, blue and alpha
    bool has_alpha = false;  // otherwise 1
    bool is_encoded = false; // sRGB, as in the formats that assimp reads; an alpha beyond [0, 1] is 1
    vertex_component type = vertex_component::float32;

    [[nodiscard]] std::size_t bytes() const;
    [[nodiscard]] glm::vec4 value(const char* vertex) const;
};

// The layout of texture coordinates in a file.
struct texcoord_layout {
    using value_type = glm::vec2; // transformed

    std::uint64_t first = 0, count = 0; // as above
    std::size_t stride = 0;
    texture_transform transform = no_texture_transform;
    vertex_component type = vertex_component::float32;

    [[nodiscard]] std::size_t bytes() const;
    [[nodiscard]] glm::vec2 value(const char* vertex) const;
};

// A file whose parts are read where they lie. Throws model_error where it ends before them.
class model_bytes {
public:
    explicit model_bytes(const std::filesystem::path& path) : file_(path, std::ios::binary) {}
    void read(std::uint64_t offset, std::span<char> bytes);

private:
    std::ifstream file_;
};

// The values of a layout (position_layout, color_layout, texcoord_layout).
template <class Layout>
class vertex_cache {
public:
    using value_type = typename Layout::value_type;

    // room: bytes of the blocks that are kept; at least eight of 4096 vertices are.
    vertex_cache(const Layout& layout, std::uint64_t room) : layout_(layout) {
        constexpr std::uint64_t least = 8;
        const std::uint64_t blocks = (layout.count + block_vertices - 1) / block_vertices;
        blocks_.resize(
            static_cast<std::size_t>(std::min(blocks, std::max(least, room / (block_vertices * sizeof(value_type))))));
    }

    // file: a model_bytes or scratch_bytes. Throws model_error for an index that names no vertex.
    template <class File>
    [[nodiscard]] const value_type& at(std::uint64_t i, File& file) {
        if (i >= layout_.count) throw model_error("an index is out of range");
        const std::uint64_t number = i / block_vertices;
        block& kept = blocks_[static_cast<std::size_t>(number % blocks_.size())];
        if (kept.number != number) read(kept, number, file);
        return kept.values[static_cast<std::size_t>(i % block_vertices)];
    }

private:
    static constexpr std::size_t block_vertices = 4096;
    struct block {
        std::uint64_t number = ~std::uint64_t{0};
        std::vector<value_type> values;
    };

    template <class File>
    void read(block& kept, std::uint64_t number, File& file) {
        const std::uint64_t first = number * block_vertices;
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_vertices, layout_.count - first));
        kept.number = ~std::uint64_t{0};
        kept.values.resize(count);
        raw_.resize((count - 1) * layout_.stride + layout_.bytes());
        file.read(layout_.first + first * layout_.stride, raw_);
        for (std::size_t v = 0; v < count; ++v) kept.values[v] = layout_.value(raw_.data() + v * layout_.stride);
        kept.number = number;
    }

    Layout layout_;
    std::vector<block> blocks_; // block b at b % size
    std::vector<char> raw_;
};

// The number of a layout's positions that are not finite. Reads them all, in order. Throws as vertex_cache::at() does.
template <class File>
[[nodiscard]] std::uint64_t count_not_finite(const position_layout& layout, File& file) {
    vertex_cache<position_layout> positions(layout, 0);
    std::uint64_t count = 0;
    for (std::uint64_t v = 0; v < layout.count; ++v) count += is_finite(positions.at(v, file)) ? 0 : 1;
    return count;
}

using position_cache = vertex_cache<position_layout>;
using color_cache = vertex_cache<color_layout>;
using texcoord_cache = vertex_cache<texcoord_layout>;

} // namespace voxelize
