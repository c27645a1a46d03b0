// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "position_cache.hpp"

#include "model_error.hpp"

#include <algorithm>
#include <cstring>

namespace voxelize {
namespace {

constexpr std::size_t block_vertices = 4096;

} // namespace

void model_bytes::read(std::uint64_t offset, std::span<char> bytes) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw model_error("the file ends before its triangles do");
}

position_cache::position_cache(const position_layout& layout, std::uint64_t room) : layout_(layout) {
    constexpr std::uint64_t least = 8;
    const std::uint64_t blocks = (layout.count + block_vertices - 1) / block_vertices;
    blocks_.resize(
        static_cast<std::size_t>(std::min(blocks, std::max(least, room / (block_vertices * sizeof(glm::vec3))))));
}

const glm::vec3& position_cache::at(std::uint64_t i, model_bytes& file) {
    if (i >= layout_.count) throw model_error("an index is out of range");
    const std::uint64_t number = i / block_vertices;
    block& kept = blocks_[static_cast<std::size_t>(number % blocks_.size())];
    if (kept.number != number) {
        const std::uint64_t first = number * block_vertices;
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_vertices, layout_.count - first));
        std::size_t last = 0; // bytes of the last vertex, behind which the file may end
        for (std::size_t a = 0; a < 3; ++a) last = std::max(last, layout_.place[a] + (layout_.is_double[a] ? 8 : 4));
        kept.number = ~std::uint64_t{0};
        kept.positions.resize(count);
        raw_.resize((count - 1) * layout_.stride + last);
        file.read(layout_.first + first * layout_.stride, raw_);
        for (std::size_t v = 0; v < count; ++v)
            for (std::size_t a = 0; a < 3; ++a) {
                const char* const from = raw_.data() + v * layout_.stride + layout_.place[a];
                float& to = kept.positions[v][static_cast<glm::length_t>(a)];
                double wide = 0;
                if (layout_.is_double[a])
                    std::memcpy(&wide, from, sizeof(wide));
                else
                    std::memcpy(&to, from, sizeof(to));
                if (layout_.is_double[a]) to = static_cast<float>(wide);
            }
        kept.number = number;
    }
    return kept.positions[static_cast<std::size_t>(i % block_vertices)];
}

} // namespace voxelize
