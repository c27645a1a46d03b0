// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A small ray tracer over the voxels: an A-buffer has the triangles of each voxel, a walk through the bricks of the
// grid tests those of the voxels that a ray meets. Made again in every frame.

#include "world.hpp"

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/levels/brick_bits.hpp>

namespace gi {

struct ray_hit {
    bool found = false;
    float distance = 1e30f;
    std::uint32_t triangle = 0;
    glm::vec3 weights{0.0f}; // barycentric
};

// The fragment shader of the frame's one pass: where in the voxel the triangle was met, for the light of the voxel.
struct list_fragments {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const glm::vec3 weights = f.clamped_barycentric();
        return vp::outputs(glm::vec2(weights.y, weights.z));
    }
};

struct triangle_lists {
    const std::uint32_t* slots = nullptr; // of each voxel its number among those with triangles, plus 1; 0: none
    const std::uint64_t* voxels = nullptr;
    const std::uint64_t* offsets = nullptr;
    const std::uint32_t* primitives = nullptr;
    const glm::vec2* weights = nullptr; // of list_fragments
    vp::brick_bits_view filled;         // the voxels with triangles
    glm::ivec3 extent{0};

    [[nodiscard]] VOXELPIPE_HD glm::ivec3 voxel(std::uint64_t i) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        return {static_cast<int>(i % nx), static_cast<int>(i / nx % ny), static_cast<int>(i / (nx * ny))};
    }
    // 0 outside the grid.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t slot(const glm::ivec3& v) const {
        if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= extent.x || v.y >= extent.y || v.z >= extent.z) return 0;
        return slots[vp::direction_mips_view::index(extent, v)];
    }

    // The surface of the list's fragment number i.
    [[nodiscard]] VOXELPIPE_HD surface fragment(const world& w, std::uint64_t i) const {
        return w.at(primitives[i], {1.0f - weights[i].x - weights[i].y, weights[i].x, weights[i].y});
    }

    // The nearest triangle along the ray, or any within `limit` if `any`.
    [[nodiscard]] VOXELPIPE_HD ray_hit trace(const world& w, const glm::vec3& origin, const glm::vec3& direction,
                                             float limit, bool any) const {
        ray_hit best;
        best.distance = limit;
        const triangle_lists& lists = *this;
        filled.walk(origin, direction, limit, [&](const vp::walked_cell<float>& at) {
            const std::uint32_t slot = lists.slots[vp::direction_mips_view::index(lists.extent, at.cell)];
            for (std::uint64_t i = lists.offsets[slot - 1]; i < lists.offsets[slot]; ++i) {
                intersect(w, lists.primitives[i], origin, direction, best);
                if (any && best.found) return true;
            }
            return best.found && best.distance <= at.leave; // not one of a voxel further on
        });
        return best;
    }
    // True if something lies between a point of a surface and a point in `direction`.
    [[nodiscard]] VOXELPIPE_HD bool blocks(const world& w, const glm::vec3& origin, const glm::vec3& direction,
                                           float limit) const {
        return trace(w, origin, direction, limit, true).found;
    }

private:
    VOXELPIPE_HD static void intersect(const world& w, std::uint32_t triangle, const glm::vec3& origin,
                                       const glm::vec3& direction, ray_hit& best) {
        const glm::uvec3 t = w.triangles[triangle];
        const glm::vec3 a = w.positions[t.x], ab = w.positions[t.y] - a, ac = w.positions[t.z] - a;
        const glm::vec3 p = glm::cross(direction, ac);
        const float determinant = glm::dot(ab, p);
        if (determinant == 0.0f) return;
        const float inverse = 1.0f / determinant;
        const glm::vec3 from_a = origin - a, q = glm::cross(from_a, ab);
        const float u = glm::dot(from_a, p) * inverse, v = glm::dot(direction, q) * inverse,
                    distance = glm::dot(ac, q) * inverse;
        constexpr float slack = -1e-5f; // no ray slips between two triangles
        if (!(u >= slack && v >= slack && u + v <= 1.0f - slack && distance > 0.0f && distance < best.distance)) return;
        const glm::vec3 weights(1.0f - u - v, u, v);
        if (w.materials[w.triangle_materials[triangle]].cutoff >= 0.0f && w.at(triangle, weights).cut) return;
        best = {true, distance, triangle, weights};
    }
};

// Make triangle_lists::slots: zero all, then number those of the A-buffer.
struct clear_slots {
    std::uint32_t* slots;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { slots[i] = 0; }
};
struct number_slots {
    const std::uint64_t* voxels;
    std::uint32_t* slots;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { slots[voxels[i]] = static_cast<std::uint32_t>(i + 1); }
};
// For brick_bits::build.
struct slot_rows {
    const std::uint32_t* slots;
    glm::ivec3 extent;
    VOXELPIPE_HD std::uint32_t operator()(const glm::ivec3& v) const {
        const std::uint32_t* const row = slots + vp::direction_mips_view::index(extent, v);
        std::uint32_t bits = 0;
        for (int k = 0; k < 4 && v.x + k < extent.x; ++k) bits |= (row[k] != 0 ? 1u : 0u) << k;
        return bits;
    }
};

} // namespace gi
