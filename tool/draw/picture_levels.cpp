// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "picture_levels.hpp"

#include "mip_levels.hpp"
#include "model/parallel.hpp"
#include "surface.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

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

// A grid, and pictures as triangles in it sample them.
class sampler {
public:
    sampler(std::uint32_t width, std::uint32_t height, const voxelpipe::grid& grid, int threads)
        : reference_(reference_point(grid)), threads_(thread_count(threads)) {
        texture_.width = static_cast<int>(width);
        texture_.height = static_cast<int>(height);
        texture_.levels = mip_level_count(width, height);
        voxelpipe::grid relative = grid;
        relative.origin -= reference_;
        snap_ = vp::core::make_snap_transform(relative);
        centers_ = {relative.origin, relative.voxel_size};
        first_ = texture_.levels - 1;
    }
    // The first level of all triangles so far.
    [[nodiscard]] int first() const { return first_; }

    // Triangles with one transform; corners(i) gives the numbers of the vertices of the i-th.
    template <class Corners>
    void add(const affine& to_world, std::span<const glm::vec3> positions, std::span<const glm::vec2> texcoords,
             std::size_t num_triangles, const Corners& corners) {
        const placed_vertex_shader place(to_world, reference_);
        const bool mirrors = to_world.mirrors();
        constexpr std::size_t block = 4096;
        parallel_for((num_triangles + block - 1) / block, threads_, [&](std::size_t number) {
            int least = first_;
            const std::size_t end = std::min(num_triangles, (number + 1) * block);
            for (std::size_t i = number * block; i < end && least != 0; ++i)
                least = std::min(least, level_of(place, mirrors, positions, texcoords, corners(i), least));
            int known = first_;
            while (least < known && !first_.compare_exchange_weak(known, least)) {
            }
        });
    }

private:
    // The level of a triangle as the library will draw it; `none` if it is not drawn.
    [[nodiscard]] int level_of(const placed_vertex_shader& place, bool mirrors, std::span<const glm::vec3> positions,
                               std::span<const glm::vec2> texcoords, const glm::uvec3& corners, int none) const {
        surface_varyings vertices[3]{};
        vp::core::snapped_position snapped[3];
        for (int i = 0; i < 3; ++i) {
            // A mirrored triangle is drawn with its last two corners exchanged.
            const std::uint32_t corner = corners[mirrors && i != 0 ? 3 - i : i];
            vertices[i].position = place(positions[corner]);
            vertices[i].texcoord = texcoords[corner];
            const glm::vec3& p = vertices[i].position;
            snapped[i] = vp::core::snap(snap_, p.x, p.y, p.z);
            if (!vp::core::is_drawable(snapped[i])) return none;
        }
        vp::fragment<surface_varyings> fragment{};
        fragment.axis = axis_of(snapped[0], snapped[1], snapped[2], snap_.fraction);
        for (int i = 0; i < 3; ++i) fragment.vertex_varyings[i] = &vertices[i];
        return finest_level(texture_footprint(fragment, centers_, texture_), texture_.levels);
    }

    sampled_texture texture_;
    glm::dvec3 reference_;
    vp::core::snap_transform snap_{};
    voxel_centers centers_;
    int threads_;
    std::atomic<int> first_;
};

bool is_among(const std::vector<std::uint32_t>& materials, std::uint32_t material) {
    return std::find(materials.begin(), materials.end(), material) != materials.end();
}

// Replaces the texels of a picture by the levels that its materials sample; first_level() says from where on, at a
// look at every triangle.
template <class FirstLevel>
void reduce(const std::vector<material>& all, picture& decoded, const std::vector<std::uint32_t>& materials,
            const voxelize_request& request, const FirstLevel& first_level) {
    std::array<bool, 2> needed{}; // without and with the weight of alpha
    bool has_masks = false;       // which sample level 0 (surface.hpp)
    for (const std::uint32_t number : materials) {
        const alpha_mode alpha = alpha_of(all[number], request.alpha);
        needed[alpha != alpha_mode::opaque ? 1 : 0] = true;
        has_masks = has_masks || alpha == alpha_mode::mask;
    }
    // A picture of less is not worth a look at every triangle.
    constexpr std::size_t worth_a_look = std::size_t{1} << 18;
    if (!has_masks && std::size_t{decoded.width} * decoded.height > worth_a_look) decoded.first_level = first_level();
    for (std::size_t by_alpha = 0; by_alpha < 2; ++by_alpha)
        if (needed[by_alpha])
            decoded.levels[by_alpha] = std::make_shared<const std::vector<glm::u8vec4>>(
                with_mip_levels(decoded, by_alpha != 0, thread_count(request.threads), decoded.first_level));
    decoded.rgba = std::vector<std::uint8_t>(); // = {} would keep the memory
}

} // namespace

int first_sampled_level(const scene& model, std::uint32_t width, std::uint32_t height,
                        const std::vector<std::uint32_t>& materials, const voxelpipe::grid& grid, int threads) {
    sampler found(width, height, grid, threads);
    for (const instance& shown : model.instances) {
        const primitive& source = model.primitives[shown.primitive];
        if (source.texcoords.empty() || !is_among(materials, source.material)) continue;
        found.add(shown.to_world, source.positions, source.texcoords, source.triangles.size(),
                  [&](std::size_t i) { return source.triangles[i]; });
        if (found.first() == 0) break;
    }
    return found.first();
}

void read_textures(triangle_stream& model, const voxelpipe::grid& grid, const voxelize_request& request) {
    model.read_textures([&](const scene& materials, picture& decoded, const std::vector<std::uint32_t>& users) {
        if (!request.wants_colors()) { // masks alone, of level 0
            std::vector<glm::u8vec4> texels(decoded.rgba.size() / 4);
            std::memcpy(texels.data(), decoded.rgba.data(), decoded.rgba.size());
            decoded.levels.fill(std::make_shared<const std::vector<glm::u8vec4>>(std::move(texels)));
            decoded.rgba = std::vector<std::uint8_t>();
            return;
        }
        reduce(materials.materials, decoded, users, request, [&] {
            sampler found(decoded.width, decoded.height, grid, request.threads);
            for (std::size_t p = 0; p < model.parts().size() && found.first() != 0; ++p) {
                const triangle_stream::part& part = model.parts()[p];
                if (!part.has_texcoords || !is_among(users, part.material)) continue;
                model.read_part(p, [&](const triangle_stream::block& b) {
                    found.add(part.to_world, b.corners, b.texcoords, b.corners.size() / 3,
                              [](std::size_t i) { return 3 * static_cast<std::uint32_t>(i) + glm::uvec3(0, 1, 2); });
                });
            }
            return found.first();
        });
    });
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
    if (!request_.wants_colors() || !grid_of(model)) return;
    reduce(model.materials, decoded, materials, request_, [&] {
        return first_sampled_level(model, decoded.width, decoded.height, materials, *grid_, request_.threads);
    });
}

} // namespace voxelize
