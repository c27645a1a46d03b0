// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// An A-buffer as the grid of a ray tracer: each voxel lists the triangles that it touches, conservatively, so a ray
// that walks from voxel to voxel misses none. Mirrors on a floor (rays.ppm). Compared with all triangles for some rays.
#include "mirrors.hpp"
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

// The nearest triangle: from voxel to voxel, until the ray leaves the one in which it has met something.
ray_hit trace(const model& m, const vp::host_abuffer<void>& lists, const glm::vec3& from, glm::vec3 along) {
    for (int a = 0; a < 3; ++a) along[a] = along[a] == 0.0f ? 1e-20f : along[a]; // times are finite
    const glm::vec3 e(lists.extent), a = -from / along, b = (e - from) / along;
    const glm::vec3 enter = glm::min(a, b), leave = glm::max(a, b);
    const float begin = std::max({enter.x, enter.y, enter.z, 0.0f}), end = std::min({leave.x, leave.y, leave.z});
    ray_hit best;
    if (begin >= end) return best;
    glm::ivec3 at = glm::clamp(glm::ivec3(glm::floor(from + begin * along)), glm::ivec3(0), lists.extent - 1);
    for (;;) {
        for (const auto& [triangle, nothing] : lists.find(at)) intersect(m, triangle, from, along, best);
        const glm::vec3 next = (glm::vec3(at) + glm::vec3(glm::greaterThan(along, glm::vec3(0.0f))) - from) / along;
        const int axis = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
        if (best.t <= next[axis]) return best;
        at[axis] += along[axis] > 0.0f ? 1 : -1;
        if (at[axis] < 0 || at[axis] >= lists.extent[axis]) return best;
    }
}

glm::vec3 shade(const model& m, const vp::host_abuffer<void>& lists, glm::vec3 from, glm::vec3 along) {
    const glm::vec3 sun = glm::normalize(glm::vec3(0.5f, 0.9f, 0.45f));
    glm::vec3 color(0.0f), weight(1.0f);
    for (int bounce = 0; bounce < 4; ++bounce) {
        const ray_hit h = trace(m, lists, from, along);
        const float floor = (4.0f - from.y) / along.y; // a plane below everything
        const bool on_floor = floor > 1e-2f && floor < h.t;
        if (h.t > 1e29f && !on_floor) return color + weight * picture::clear_sky(along, sun);
        from += (on_floor ? floor : h.t) * along;
        glm::vec3 normal(0, 1, 0), surface;
        if (on_floor) {
            surface = picture::tiles(from, 12.0f);
        } else {
            const glm::uvec3& t = m.triangles[h.triangle];
            normal = glm::normalize((1.0f - h.weights.x - h.weights.y) * m.normals[t.x] + h.weights.x * m.normals[t.y] +
                                    h.weights.y * m.normals[t.z]);
            if (glm::dot(normal, along) > 0.0f) normal = -normal;
            surface = m.colors[h.triangle];
        }
        from += 0.05f * normal;
        const bool is_lit = trace(m, lists, from, sun).t > 1e29f;
        const float light = 0.35f + (is_lit ? 0.9f * glm::max(0.0f, glm::dot(normal, sun)) : 0.0f);
        const float far = glm::smoothstep(90.0f, 420.0f, glm::length(from - 64.0f)); // where the floor becomes the sky
        const float mirror = on_floor ? 0.12f + 0.88f * far : 0.55f;
        color += (1.0f - mirror) * light * weight * surface;
        weight *= mirror * (on_floor ? glm::vec3(1.0f) : glm::mix(glm::vec3(1.0f), surface, 0.6f));
        along = glm::reflect(along, normal);
    }
    return color;
}

int main() {
    const model m = mirrors();
    vp::cpu_backend backend;
    vp::grid grid;
    grid.extent = {128, 80, 128};
    // snippet: lists
    const vp::mesh mesh{backend, m.positions, m.triangles};
    vp::abuffer<vp::cpu_backend> device_lists{backend};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(), device_lists).or_throw();
    const vp::host_abuffer<void> lists = device_lists.to_host(backend);
    // end snippet

    int wrong = 0;
    for (int i = 0; i < 24; ++i) { // every triangle that a ray meets is in the lists
        const glm::vec3 from(64, 60, 220), to(20.0f + 3.6f * static_cast<float>(i), 10 + i * 7 % 60, 64);
        const glm::vec3 along = glm::normalize(to - from);
        ray_hit nearest;
        for (std::uint32_t t = 0; t < m.triangles.size(); ++t) intersect(m, t, from, along, nearest);
        wrong += trace(m, lists, from, along).t == nearest.t ? 0 : 1;
    }
    const glm::vec3 eye(14, 78, 236), ahead = glm::normalize(glm::vec3(62, 34, 68) - eye);
    const glm::vec3 right = glm::normalize(glm::cross(ahead, glm::vec3(0, 1, 0))), up = glm::cross(right, ahead);
    picture::write_pixels("rays.ppm", 1.25f, [&](float x, float y, const glm::vec2&) {
        return shade(m, lists, eye, glm::normalize(ahead + (x - 0.5f) * 0.80f * right + (0.5f - y) * 0.64f * up));
    });
    std::printf("%zu triangles, %zu references to them in %zu voxels, %d rays differ\n", m.triangles.size(),
                lists.primitives.size(), lists.size(), wrong);
    return wrong == 0 && lists.size() > 1000 ? 0 : 1;
}
