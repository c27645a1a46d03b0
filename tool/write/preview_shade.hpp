// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Light and colour of the preview. Rows of the picture are rendered one band at a time: find what each sample sees,
// gather ambient occlusion and sunlight with few rays, once for the samples of a pixel that lie on one surface, smooth
// these over neighbouring pixels of the same surface, shade, and average. Which rays a sample casts depends on its
// position alone, and every row is found once and by itself, so the picture is the same on any number of threads.
// Internal to the preview.

#include "preview.hpp"
#include "preview_camera.hpp"
#include "preview_colors.hpp"
#include "preview_scene.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace voxelize {

using rgb_linear = std::array<float, 3>;

class preview_shader {
public:
    // All three must outlive the shader; the options are checked already.
    // `colors` holds a value for each voxel of the volume or, if the scene is sparse, for each voxel of its bricks, and
    // may be of any type (preview_colors.hpp); null: no colours.
    preview_shader(const volume& v, const preview_scene& scene, const preview_options& options, const channel* colors);

    // The whole picture into `pixels`, RGB or RGBA, on `threads` threads (>= 1). `progress`, which may be empty, is
    // called with the rows that are done, from the calling thread.
    void render(int components, std::uint8_t* pixels, int threads, const std::function<void(int)>& progress) const;

private:
    // The first thing that a sample sees.
    enum class seen : std::uint8_t { nothing, ground, voxel };
    struct sample {
        seen what = seen::nothing;
        std::array<float, 3> position{}; // in world units, as the camera's
        std::array<float, 3> normal{};   // unit length; of the face, or of the surface where voxels are small
        float smoothness = 0;            // 0: the face's normal, 1: the surface's
        float slack = 0; // world units that neighbours may lie off the tangent plane and still share light
        rgb_linear albedo{};
        float open = 1;   // share of the sky that is not hidden by voxels nearby
        float sunlit = 1; // share of the sun that is seen
        int light = 0;    // which sample of the pixel gathered the two; the others have none
    };
    // Rows of pixels, a few more than the band on either side for the smoothing.
    struct pixel_rows {
        int first = 0; // row of the picture that row 0 is
        int rows = 0;
        int width = 0;               // pixels
        int per_pixel = 1;           // samples
        std::vector<sample> samples; // of each pixel, row by row
        [[nodiscard]] sample* at(int x, int row) {
            return samples.data() + (std::ptrdiff_t{row} * width + x) * per_pixel;
        }
        [[nodiscard]] const sample* at(int x, int row) const {
            return samples.data() + (std::ptrdiff_t{row} * width + x) * per_pixel;
        }
    };

    // Makes `rows` hold the rows [begin, end) of the picture, and finds those that it did not hold.
    void find_rows(pixel_rows& rows, int begin, int end, int threads) const;
    // Row `y` of the picture into `out`.
    void shade_row(const pixel_rows& rows, int y, int components, std::uint8_t* out) const;
    [[nodiscard]] camera::ray ray_of(int x, int y) const;
    // The surface normal of the voxel that the last ray hit: neighbouring rays mostly hit the same one.
    struct normal_cache {
        std::array<std::int32_t, 3> voxel{-1, -1, -1};
        vec3 normal{};
    };
    [[nodiscard]] sample find(const camera::ray& ray, normal_cache& cache) const;
    [[nodiscard]] rgb_linear albedo_of(const ray_hit& hit, const vec3& at, double pixels_per_voxel) const;
    // True if light that falls on one sample falls on the other.
    [[nodiscard]] static bool on_one_surface(const sample& a, const sample& b);
    // The samples of pixel (x, y).
    void find_pixel(sample* samples, int x, int y, normal_cache& cache) const;
    void gather_light(sample& s, int x, int y) const;
    void smooth(const pixel_rows& rows, int x, int row, const sample& middle, float& open, float& sunlit) const;
    [[nodiscard]] rgb_linear shade(const sample& s, float open, float sunlit) const;
    [[nodiscard]] float ground_shade(float open, float sunlit) const;
    [[nodiscard]] rgb_linear backdrop_at(double x, double y) const;

    const volume& volume_;
    const preview_scene& scene_;
    const preview_options& options_;
    voxel_colors colors_;
    camera camera_;
    world_axes axes_;
    vec3 voxel_size_{};
    vec3 sun_{};         // unit vector towards the sun
    vec3 sun_side_[2]{}; // unit vectors across it
    vec3 center_{};      // middle of the occupied voxels' ground area
    double radius_ = 0;  // half diagonal of the occupied voxels, world units
    double occlusion_reach_ = 0;
    double ground_height_ = 0;
    std::array<float, 256> to_linear_{};
    // For each rank of a pixel in the pattern: directions of its occlusion rays along the normal and across it, and the
    // direction of its ray to the sun in voxels.
    static constexpr int occlusion_rays = 2;
    std::array<vec3, std::size_t{64} * occlusion_rays> occlusion_pattern_{};
    std::array<vec3, 64> sun_pattern_{};
    std::array<rgb_linear, 2> backdrop_{}; // top, bottom
};

} // namespace voxelize
