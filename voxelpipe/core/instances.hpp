// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a mesh that is drawn several times. Instances share the indices; each has vertices of its own behind
// those of the one before.

#include <voxelpipe/config.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Remainders of 32-bit numbers by one that is known before, without a division or a branch.
class remainder_by {
public:
    remainder_by() = default;
    // 0 counts as 1.
    VOXELPIPE_HD explicit constexpr remainder_by(std::uint32_t divisor)
        : divisor_(divisor != 0 ? divisor : 1),
          reciprocal_(divisor_ != 1 ? static_cast<std::uint32_t>((std::uint64_t{1} << 32) / divisor_) : ~0u) {}

    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::uint32_t of(std::uint32_t n) const {
        // The reciprocal is rounded down by less than 1, so that the quotient is at most 1 too small.
        const auto quotient = static_cast<std::uint32_t>((std::uint64_t{n} * reciprocal_) >> 32);
        const std::uint32_t rest = n - quotient * divisor_, less = rest - divisor_;
        return rest < less ? rest : less; // below the divisor, `less` wraps around
    }

private:
    std::uint32_t divisor_ = 1, reciprocal_ = ~0u;
};

// An index of a triangle's vertices, moved to an instance whose vertices begin at `first`. An index that names no
// vertex of the mesh names none of the instances either.
[[nodiscard]] VOXELPIPE_HD inline glm::uvec3 move_to_instance(const glm::uvec3& t, std::uint32_t num_vertices,
                                                              std::uint32_t first) {
    const bool ok = t.x < num_vertices && t.y < num_vertices && t.z < num_vertices;
    return ok ? glm::uvec3(t.x + first, t.y + first, t.z + first) : glm::uvec3(~std::uint32_t{0});
}

// The triangles of one draw for all of its instances: triangle i of the first `each` is instance 0's, and so on. A bad
// index of the mesh shows in every instance but the first, where it may name a vertex of another one.
struct instanced_triangles {
    const glm::uvec3* triangles = nullptr; // of one instance
    std::uint32_t each = 0;                // how many these are
    std::uint32_t vertices_each = 0;       // vertices of one instance

    struct place {
        std::uint32_t triangle, instance;
    };
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE place find(std::uint32_t i) const {
        if (i < each) return {i, 0};
        return {i % each, i / each};
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE glm::uvec3 operator[](std::uint32_t i) const {
        if (i < each) return triangles[i];
        return move_to_instance(triangles[i % each], vertices_each, i / each * vertices_each);
    }
};
} // namespace voxelpipe::core
