// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The correct part of every program in this folder: one triangle, drawn by the given shaders into the given targets.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <array>
#include <cstdint>

namespace vp = voxelpipe;

inline constexpr std::array<glm::vec3, 3> positions{{{0.0f, 0.0f, 0.0f}, {4.0f, 0.0f, 1.0f}, {0.0f, 4.0f, 2.0f}}};
inline constexpr std::array<glm::uvec3, 1> triangles{{{0u, 1u, 2u}}};
inline constexpr std::array<float, 3> heat{1.0f, 2.0f, 3.0f};

inline vp::grid small_grid() {
    vp::grid g;
    g.extent = {8, 8, 8};
    return g;
}

// A fragment shader for one counter.
struct ones {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const { return vp::outputs(1u); }
};

template <class... Targets, class VertexShader, class FragmentShader>
bool draw_into(const VertexShader& vertex_shader, const FragmentShader& fragment_shader) {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, Targets...> framebuffer{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vertex_shader, fragment_shader, framebuffer).ok();
}

template <class Payload, class FragmentShader>
bool collect(const FragmentShader& fragment_shader) {
    vp::cpu_backend backend;
    vp::abuffer<vp::cpu_backend, Payload> lists{backend};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, fragment_shader, lists).ok();
}

using counter = vp::target<std::uint32_t, vp::blend::add>;
