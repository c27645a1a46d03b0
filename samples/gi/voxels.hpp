// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene as voxels, made again in every frame: bits at twice the resolution, insides filled, for opacity and
// shadows; one pass that lists the triangles of each voxel (rays.hpp); the light of what they show there; and what
// bounced in the last frame.

#include "cones.hpp"
#include "rays.hpp"

#include <voxelpipe/levels/dense_bits.hpp>
#include <voxelpipe/voxelpipe.hpp>

namespace gi {

using bits_target = vp::target<vp::bit, vp::blend::bit_or>;

// Means over a voxel's fragments.
struct lit_voxel {
    glm::vec3 light{0.0f};  // that leaves it: what it emits and reflects of the light source
    glm::vec3 color{0.0f};  // diffuse reflectance
    glm::vec3 normal{0.0f}; // unit, or 0
    float density = 0;      // the largest; 0: all fragments are cut off
    bool has_side = false;  // its fragments face one way
    bool two_sided = false; // they face all ways, so that none is the voxel's: `normal` is one of two opposite ones
};

// The density times the share of a voxel's eighths that are filled, so that nothing jumps when a surface moves.
[[nodiscard]] VOXELPIPE_HD inline float opacity_of(const vp::dense_bits& bits, const glm::ivec3& v, float density) {
    const float a = density * static_cast<float>(vp::exact::count_ones(bits.children(v))) * 0.125f;
    return a < 1.0f ? a : 1.0f;
}

// The factor of the light's colour that gives the irradiance at fragment i of the list. It is 0 if a filled voxel lies
// on the ray to the light. A lamp has four points that rays go to; neighbouring voxels take different ones.
struct light_fragments {
    gi::world world;
    triangle_lists lists;
    vp::brick_bits_view blockers; // bits at twice the resolution
    float* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const surface s = lists.fragment(world, i);
        const bool sheet = s.density > 1.0f;
        const glm::ivec3 v(s.position);
        const int number = (v.x & 1) + 2 * ((v.y + v.z) & 1);
        const light_sample l = sample_light_point(world.light, s.position, s.normal, sheet, number);
        float part = mean_light(world.light, s.position, s.normal, sheet);
        if (part > 0.0f && l.part > 0.0f) {
            // A ray starts outside of the voxels that the surface itself fills.
            const float side = glm::dot(l.direction, s.normal) < 0.0f ? -1.0f : 1.0f;
            const glm::vec3 start = s.position + s.normal * (1.4f * side) + l.direction * 0.4f;
            const float limit = l.distance - 3.0f; // short of the lamp's own voxels
            if (limit > 0.0f && blockers.blocks(start * 2.0f, l.direction, limit * 2.0f)) part = 0.0f;
        }
        out[i] = part;
    }
};

// Number i of the voxels with triangles: the means of its fragments, in the order of the list. A fragment that other
// closed parts cover, as the foot of a column and the floor under it, counts where nothing else does: it is dark, and
// its normal may cancel that of what is seen.
struct fold_fragments {
    gi::world world;
    triangle_lists lists;
    vp::dense_bits bits;      // at twice the resolution
    const float* irradiances; // of light_fragments
    lit_voxel* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        lit_voxel sum;
        float count = 0.0f;
        for (std::uint64_t k = lists.offsets[i]; k < lists.offsets[i + 1]; ++k) {
            const surface s = lists.fragment(world, k);
            if (s.cut) continue;
            const glm::vec3 over = (s.position + s.normal) * 2.0f;
            const bool covered =
                s.density <= 1.0f && over.x >= 0.0f && over.y >= 0.0f && over.z >= 0.0f && bits(glm::ivec3(over));
            const float weight = covered ? 0x1p-10f : 1.0f;
            const glm::vec3 diffuse = s.color * (1.0f - 0.7f * s.metallic); // what a metal reflects blurs here
            glm::vec3 light = diffuse * world.light.color * (irradiances[k] * (1.0f / 3.14159265f));
            if (!s.is_light) light = light + s.emission;
            sum.light = sum.light + light * weight;
            sum.color = sum.color + diffuse * weight;
            sum.normal = sum.normal + s.normal * weight;
            sum.density = s.density > sum.density ? s.density : sum.density;
            count = count + weight;
        }
        if (count > 0.0f) {
            const float part = 1.0f / count;
            const float length = vp::exact::sqrt(glm::dot(sum.normal, sum.normal));
            sum.light = sum.light * part;
            sum.color = sum.color * part;
            sum.has_side = sum.density <= 1.0f && length > 0.3f * count;
            // What is covered on all sides takes no light: it would shine into the rooms on both sides of a thin wall.
            const bool faces = length > 0.02f * count, seen = count >= 1.0f;
            sum.two_sided = sum.density > 1.0f || !faces;
            sum.normal = faces ? sum.normal / length : seen ? glm::vec3(0, 1, 0) : glm::vec3(0.0f);
        }
        out[i] = sum;
    }
};

// The light that the last frame's voxels send to number i, by the cones of its phase.
struct gathered {
    glm::vec3 light{0.0f};
    std::uint32_t facing = 0; // of its normal
};
constexpr float voxel_cone_width = 2.0f;

struct find_voxel_walls {
    gi::world world;
    triangle_lists lists;
    const lit_voxel* voxels;
    glm::vec3* moved;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (voxels[i].normal == glm::vec3(0.0f)) return; // sends no cone
        const glm::vec3 at = glm::vec3(lists.voxel(lists.voxels[i])) + 0.5f;
        moved[i] = off_walls(world, lists, at, voxels[i].normal, voxel_cone_width);
    }
};

struct gather_voxels {
    gi::world world;
    triangle_lists lists;
    vp::direction_mips_view last;
    cone_set cones; // of 8 phases, or of one
    const lit_voxel* voxels;
    const glm::vec3* moved; // of off_walls; null: cones start over their voxel
    gathered* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const lit_voxel& voxel = voxels[i];
        gathered g;
        if (voxel.normal != glm::vec3(0.0f)) {
            const glm::ivec3 v = lists.voxel(lists.voxels[i]);
            const int phase = cones.phases == 1 ? 0 : (v.x & 1) + 2 * (v.y & 1) + 4 * (v.z & 1);
            const glm::vec3 at = glm::vec3(v) + 0.5f;
            g.light = gather(last, world, cones, phase, at, voxel.normal, voxel_cone_width,
                             moved != nullptr ? moved + i : nullptr)
                          .light;
            if (voxel.two_sided)
                g.light =
                    (g.light + gather(last, world, cones, phase, at, -voxel.normal, voxel_cone_width).light) * 0.5f;
            g.facing = vp::pack_facing(voxel.normal);
        }
        out[i] = g;
    }
};

// Light of number i with what bounced: the mean of what it and its neighbours that face as it does have gathered.
struct light_surfaces {
    triangle_lists lists;
    vp::dense_bits bits;
    const lit_voxel* voxels;
    const gathered* bounced; // null: there is no last frame
    vp::packed_light* out;
    std::uint32_t* facings;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const lit_voxel& voxel = voxels[i];
        const glm::ivec3 v = lists.voxel(lists.voxels[i]);
        glm::vec3 light = voxel.light;
        if (bounced != nullptr && voxel.normal != glm::vec3(0.0f)) light = light + voxel.color * mean_around(v, voxel);
        const float a = opacity_of(bits, v, voxel.density);
        out[lists.voxels[i]] = vp::pack_light(glm::vec4(light * a, a));
        // Light leaves on the side of the normal. Sheets let it through; a voxel that holds all of a small thing has no
        // side.
        facings[lists.voxels[i]] = voxel.has_side ? vp::pack_facing(voxel.normal) : 0;
    }

private:
    [[nodiscard]] VOXELPIPE_HD glm::vec3 mean_around(const glm::ivec3& v, const lit_voxel& voxel) const {
        glm::vec3 sum(0.0f);
        float weights = 0.0f;
        for (int k = 0; k < 27; ++k) {
            const glm::ivec3 step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
            const std::uint32_t slot = lists.slot(v + step);
            if (slot == 0) continue;
            const gathered& g = bounced[slot - 1];
            if (!(vp::facing_part(g.facing, -voxel.normal) == 1.0f) || g.facing == 0) continue;
            // 2 in the middle and 1 beside it along each axis, so that all phases have the same part.
            const float weight = static_cast<float>(8 >> (step.x * step.x + step.y * step.y + step.z * step.z));
            sum = sum + g.light * weight;
            weights = weights + weight;
        }
        return weights > 0.0f ? sum / weights : sum;
    }
};

// All other voxels. Filled ones get the light of their neighbours: through a surface voxel that is filled in part, one
// sees the one behind it.
struct light_insides {
    triangle_lists lists;
    vp::dense_bits bits;
    const lit_voxel* voxels;
    vp::packed_light* out; // of light_surfaces; only other voxels are read than written
    std::uint32_t* facings;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (lists.slots[i] != 0) return;
        const glm::ivec3 v = lists.voxel(i);
        const float a = opacity_of(bits, v, 1.0f);
        glm::vec4 sum(0.0f);
        glm::vec3 normal(0.0f);
        if (a != 0.0f)
            for (int side = 0; side < 6; ++side) {
                glm::ivec3 w = v;
                w[side >> 1] += (side & 1) != 0 ? 1 : -1;
                const std::uint32_t slot = lists.slot(w);
                if (slot == 0) continue;
                sum = sum + vp::unpack_light(out[vp::direction_mips_view::index(lists.extent, w)]);
                normal = normal + voxels[slot - 1].normal;
            }
        // Between two sides of a thin wall it stays dark.
        const float length = vp::exact::sqrt(glm::dot(normal, normal));
        const bool lit = sum.w > 0.0f && length > 0.5f;
        out[i] = vp::pack_light(lit ? glm::vec4(glm::vec3(sum) * (a / sum.w), a) : glm::vec4(0.0f, 0.0f, 0.0f, a));
        facings[i] = lit ? vp::pack_facing(normal / length) : 0;
    }
};

} // namespace gi
