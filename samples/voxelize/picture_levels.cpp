// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "picture_levels.hpp"

#include "mip_levels.hpp"
#include "parallel.hpp"
#include "surface.hpp"

#include <algorithm>
#include <array>
#include <atomic>

namespace voxelize {

namespace {

// The axis along which the library sees a triangle, as its fragments have it.
int axis_of(const vp::core::snapped_position& a, const vp::core::snapped_position& b,
            const vp::core::snapped_position& c, int fraction) {
    const auto axis = [&](auto zero) {
        const auto frame = vp::core::make_frame<decltype(zero)>(a, b, c, fraction);
        return frame.zero_area ? 0 : frame.axis;
    };
    return vp::core::fits_narrow(a, b, c, fraction) ? axis(std::int64_t{0}) : axis(vp::int128{0});
}

// One instance of a primitive, as the library will draw it.
struct placed_primitive {
    const primitive& source;
    placed_vertex_shader place;
    bool mirrors;
    vp::core::snap_transform snap;
    voxel_centers centers;

    // The level of a triangle in TEXTURE; `none` if it is not drawn.
    [[nodiscard]] int level_of(const glm::uvec3& corners, const sampled_texture& texture, int none) const {
        surface_varyings vertices[3]{};
        vp::core::snapped_position snapped[3];
        for (int i = 0; i < 3; ++i) {
            // A mirrored triangle is drawn with its last two corners exchanged.
            const std::uint32_t corner = corners[mirrors && i != 0 ? 3 - i : i];
            vertices[i].position = place(source.positions[corner]);
            vertices[i].texcoord = source.texcoords[corner];
            const glm::vec3& p = vertices[i].position;
            snapped[i] = vp::core::snap(snap, p.x, p.y, p.z);
            if (!vp::core::is_drawable(snapped[i])) return none;
        }
        vp::fragment<surface_varyings> fragment{};
        fragment.axis = axis_of(snapped[0], snapped[1], snapped[2], snap.fraction);
        for (int i = 0; i < 3; ++i) fragment.vertex_varyings[i] = &vertices[i];
        return finest_level(texture_footprint(fragment, centers, texture), texture.levels);
    }
};

} // namespace

int first_sampled_level(const scene& model, std::uint32_t width, std::uint32_t height,
                        const std::vector<std::uint32_t>& materials, const voxelpipe::grid& grid, int threads) {
    sampled_texture texture;
    texture.width = static_cast<int>(width);
    texture.height = static_cast<int>(height);
    texture.levels = mip_level_count(width, height);
    const glm::dvec3 reference = reference_point(grid);
    voxelpipe::grid relative = grid;
    relative.origin -= reference;
    const vp::core::snap_transform snap = vp::core::make_snap_transform(relative);

    std::atomic<int> first{texture.levels - 1};
    for (const instance& shown : model.instances) {
        const primitive& source = model.primitives[shown.primitive];
        if (source.texcoords.empty()) continue;
        if (std::find(materials.begin(), materials.end(), source.material) == materials.end()) continue;
        const placed_primitive placed{source,
                                      placed_vertex_shader{shown.to_world, reference},
                                      shown.to_world.mirrors(),
                                      snap,
                                      {relative.origin, relative.voxel_size}};
        constexpr std::size_t block = 4096;
        const std::vector<glm::uvec3>& triangles = source.triangles;
        parallel_for((triangles.size() + block - 1) / block, thread_count(threads), [&](std::size_t number) {
            int least = first;
            const std::size_t end = std::min(triangles.size(), (number + 1) * block);
            for (std::size_t i = number * block; i < end && least != 0; ++i)
                least = std::min(least, placed.level_of(triangles[i], texture, least));
            int known = first;
            while (least < known && !first.compare_exchange_weak(known, least)) {
            }
        });
        if (first == 0) break;
    }
    return first;
}

const std::optional<voxelpipe::grid>& picture_reducer::grid_of(const scene& model) {
    if (placed_) return grid_;
    placed_ = true;
    const bounding_box bounds = bounds_of(model, request_.threads);
    if (bounds.empty) return grid_;
    try {
        grid_ = place_grid(wanted_, bounds);
    } catch (const grid_error&) { // who asks for the grid itself will hear of it
    }
    return grid_;
}

void picture_reducer::operator()(const scene& model, picture& decoded, const std::vector<std::uint32_t>& materials) {
    const bool shades = std::any_of(request_.targets.begin(), request_.targets.end(),
                                    [](target id) { return info_of(id).name.starts_with("color"); });
    if (!shades || !grid_of(model)) return;
    std::array<bool, 2> needed{}; // without and with the weight of alpha
    bool has_masks = false;       // which sample level 0 (surface.hpp)
    for (const std::uint32_t number : materials) {
        const alpha_mode alpha = alpha_of(model.materials[number], request_.alpha);
        needed[alpha != alpha_mode::opaque ? 1 : 0] = true;
        has_masks = has_masks || alpha == alpha_mode::mask;
    }
    // A picture of less is not worth a look at every triangle.
    constexpr std::size_t worth_a_look = std::size_t{1} << 18;
    if (!has_masks && std::size_t{decoded.width} * decoded.height > worth_a_look)
        decoded.first_level =
            first_sampled_level(model, decoded.width, decoded.height, materials, *grid_, request_.threads);
    for (std::size_t by_alpha = 0; by_alpha < 2; ++by_alpha)
        if (needed[by_alpha])
            decoded.levels[by_alpha] =
                with_mip_levels(decoded, by_alpha != 0, thread_count(request_.threads), decoded.first_level);
    decoded.rgba = std::vector<std::uint8_t>(); // = {} would keep the memory
}

} // namespace voxelize
