// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Animation: one mesh, whose vertex shader moves it, drawn into one framebuffer frame by frame. The framebuffer keeps
// track of what changes, so a clear writes no more than was drawn on a GPU. Five of its frames (jellyfish.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct skin {
    glm::vec3 color;
};

// Attribute: (part, along, around). part 0 is the bell, from its top to its rim; the others are arms, from root to tip.
struct swim {
    float time; // in strokes
    VOXELPIPE_HD auto operator()(const vp::vertex<glm::vec3>& v) const {
        const float part = vp::get<0>(v).x, t = vp::get<0>(v).y, a = 6.2831853f * vp::get<0>(v).z;
        const float stroke = 6.2831853f * time, rise = 66.0f + 7.0f * std::sin(stroke - 0.9f);
        const auto rim = [&](float u) {
            return (0.9f + 0.22f * std::sin(stroke + 2.4f * u)) * 26.0f * std::sin(1.75f * u);
        };
        if (part == 0.0f) { // frilled at its rim
            const float r = rim(t) * (1.0f + 0.05f * t * std::cos(12.0f * a));
            const glm::vec3 dark(0.58f, 0.20f, 0.52f), bright(0.98f, 0.62f, 0.66f);
            return vp::vertex_output{
                glm::vec3(32 + r * std::cos(a), rise + 24.0f * std::cos(1.75f * t), 32 + r * std::sin(a)),
                skin{glm::mix(bright, dark, t * t)}};
        }
        const float turn = 6.2831853f * part / 8.0f, sway = 5.0f * t * std::sin(stroke - 4.5f * t + 2.1f * part);
        const float out = rim(0.9f) * (0.62f - 0.2f * t), thick = 1.5f - 1.1f * t;
        return vp::vertex_output{glm::vec3(32 + (out + thick * std::cos(a)) * std::cos(turn) - sway * std::sin(turn),
                                           rise + 6.0f - 58.0f * t + 2.0f * std::sin(stroke + 5.0f * t),
                                           32 + (out + thick * std::cos(a)) * std::sin(turn) +
                                               (sway + thick * std::sin(a)) * std::cos(turn)),
                                 skin{glm::mix(glm::vec3(0.95f, 0.55f, 0.60f), glm::vec3(0.45f, 0.40f, 0.80f), t)}};
    }
};
struct paint {
    VOXELPIPE_HD auto operator()(const vp::fragment<skin>& f) const { return vp::outputs(f.clamped_varyings().color); }
};

int main() {
    std::vector<glm::vec3> places; // of vertices, and their attribute: the shader makes positions
    std::vector<glm::uvec3> triangles;
    const auto add = [&](int part, unsigned rows, unsigned columns) {
        const auto first = static_cast<unsigned>(places.size());
        for (unsigned i = 0; i <= rows; ++i)
            for (unsigned k = 0; k < columns; ++k) {
                places.emplace_back(part, static_cast<float>(i) / static_cast<float>(rows),
                                    static_cast<float>(k) / static_cast<float>(columns));
                if (i == rows) continue;
                const unsigned p = first + i * columns + k, q = first + i * columns + (k + 1) % columns;
                triangles.emplace_back(p, q, p + columns);
                triangles.emplace_back(q, q + columns, p + columns);
            }
    };
    add(0, 40, 96);
    for (int arm = 1; arm <= 8; ++arm) add(arm, 48, 6);

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, places, triangles, places};
    vp::grid grid;
    grid.extent = {64, 104, 64};
    using colors = vp::target<glm::vec3, vp::blend::max>;
    vp::framebuffer<vp::cpu_backend, colors> fb{backend, grid.extent};
    vp::get<0>(fb).clear(glm::vec3(-1.0f));
    fb.track_changes(backend);
    constexpr int frames = 20, shown = 5;
    std::vector<vp::host_target<colors>> kept;
    std::uint64_t least = ~std::uint64_t{0}, most = 0;
    for (int frame = 0; frame < frames; ++frame) {
        const float time = static_cast<float>(frame) / frames;
        const vp::status s = vp::voxelize(backend, mesh, grid, swim{time}, paint{}, fb).or_throw();
        least = std::min(least, s.counts.voxels);
        most = std::max(most, s.counts.voxels);
        if (frame % (frames / shown) == 0) kept.push_back(vp::get<0>(fb).to_host_target(backend));
    }
    // The last frame is what a framebuffer of its own would have.
    vp::framebuffer<vp::cpu_backend, colors> fresh{backend, grid.extent};
    vp::get<0>(fresh).clear(glm::vec3(-1.0f));
    vp::voxelize(backend, mesh, grid, swim{static_cast<float>(frames - 1) / frames}, paint{}, fresh).or_throw();
    const bool same = vp::get<0>(fresh).to_host(backend) == vp::get<0>(fb).to_host(backend);

    picture::write("jellyfish.ppm", {shown * 64, 104, 64},
                   [&](int x, int y, int z) { return kept[static_cast<std::size_t>(x / 64)](x % 64, y, z); },
                   {.along = {-0.02f, -0.22f, -1.0f}, .zoom = 1.3f, .has_floor = false, .aspect = 2.2f});
    std::printf("%d frames, %llu to %llu voxels, the last one is %s\n", frames, static_cast<unsigned long long>(least),
                static_cast<unsigned long long>(most), same ? "right" : "wrong");
    return same && least > 5000 && most > least ? 0 : 1;
}
