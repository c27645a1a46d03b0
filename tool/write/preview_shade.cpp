// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview_shade.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace voxelize {
namespace {

// Light, as linear RGB: what a white surface that faces it fully would receive.
constexpr rgb_linear sun_color{0.80f, 0.74f, 0.64f};
constexpr rgb_linear sky_color{0.45f, 0.49f, 0.56f};
constexpr rgb_linear bounce_color{0.30f, 0.28f, 0.26f}; // from the ground below

constexpr double sun_azimuth = -52; // degrees from the camera, so that the two sides in view differ
constexpr double sun_elevation = 48;
constexpr double sun_softness = 0.045;   // radius of the sun's disc at distance 1
constexpr double occlusion_share = 0.22; // reach of ambient occlusion, in diagonals of the model
constexpr int smoothing = 4;             // pixels to either side; with the pattern of 8 x 8 below all of it is seen

constexpr double ray_lift = 1e-3; // voxels above the face where a secondary ray starts

// Rank of a pixel in a pattern of 8 x 8, such that neighbours lie far apart: the bits of x^y and y, interleaved.
unsigned pattern_rank(int x, int y) {
    const unsigned a = static_cast<unsigned>(x ^ y), b = static_cast<unsigned>(y);
    unsigned rank = 0;
    for (unsigned bit = 0; bit < 3; ++bit) rank = rank << 2 | (a >> bit & 1u) << 1 | (b >> bit & 1u);
    return rank;
}

// Radical inverse in base 2 of an index below 2^32, in [0, 1).
double radical_inverse(std::uint32_t n) {
    n = n << 16 | n >> 16;
    n = (n & 0x00ff00ffu) << 8 | (n & 0xff00ff00u) >> 8;
    n = (n & 0x0f0f0f0fu) << 4 | (n & 0xf0f0f0f0u) >> 4;
    n = (n & 0x33333333u) << 2 | (n & 0xccccccccu) >> 2;
    n = (n & 0x55555555u) << 1 | (n & 0xaaaaaaaau) >> 1;
    return n * 0x1p-32;
}

float smooth_step(double from, double to, double value) {
    const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
    return static_cast<float>(t * t * (3 - 2 * t));
}

double srgb_to_linear(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

// The least linear value of each byte of sRGB.
std::array<float, 256> byte_thresholds() {
    std::array<float, 256> thresholds{};
    for (std::size_t byte = 1; byte < thresholds.size(); ++byte)
        thresholds[byte] = static_cast<float>(srgb_to_linear((static_cast<double>(byte) - 0.5) / 255));
    return thresholds;
}

std::uint8_t linear_to_srgb8(float linear) {
    static const std::array<float, 256> thresholds = byte_thresholds();
    std::size_t byte = 0;
    for (std::size_t step = 128; step != 0; step /= 2) byte += linear >= thresholds[byte + step] ? step : 0;
    return static_cast<std::uint8_t>(byte);
}

// Leaves values below the knee as they are and bends the rest towards 1.
float soften(float v) {
    constexpr float knee = 0.72f;
    return v <= knee ? v : knee + (1 - knee) * std::tanh((v - knee) / (1 - knee));
}

vec3 divided(const vec3& a, const vec3& b) { return {a[0] / b[0], a[1] / b[1], a[2] / b[2]}; }

} // namespace

preview_shader::preview_shader(const volume& v, const preview_scene& scene, const preview_options& options,
                               const channel* colors)
    : volume_(v), scene_(scene), options_(options),
      colors_(options.use_color ? colors : nullptr, scene.is_sparse() ? nullptr : &v), axes_(axes_of(options.up)) {
    for (std::size_t n = 0; n < to_linear_.size(); ++n)
        to_linear_[n] = static_cast<float>(srgb_to_linear(static_cast<double>(n) / 255));
    for (std::size_t a = 0; a < 3; ++a) {
        backdrop_[0][a] = to_linear_[options.backdrop.top[a]];
        backdrop_[1][a] = to_linear_[options.backdrop.bottom[a]];
    }
    // Only proportions matter, so the largest voxel side is 1; that keeps the numbers away from the ends of the range.
    const double unit = *std::max_element(v.voxel_size.begin(), v.voxel_size.end());
    for (std::size_t a = 0; a < 3; ++a) voxel_size_[a] = v.voxel_size[a] / unit;
    if (scene.empty()) return;
    camera_ = fit_camera(scene, voxel_size_, options);
    vec3 size{};
    for (std::size_t a = 0; a < 3; ++a) {
        center_[a] = (scene.low()[a] + scene.high()[a]) / 2.0 * voxel_size_[a];
        size[a] = (scene.high()[a] - scene.low()[a]) * voxel_size_[a];
    }
    radius_ = std::sqrt(dot(size, size)) / 2;
    occlusion_reach_ = 2 * radius_ * occlusion_share;
    ground_height_ = scene.low()[axes_.up_index] * voxel_size_[axes_.up_index];
    sun_ = direction_of(axes_, options.azimuth + sun_azimuth, sun_elevation);
    sun_side_[0] = direction_of(axes_, options.azimuth + sun_azimuth + 90, 0);
    sun_side_[1] = direction_of(axes_, options.azimuth + sun_azimuth, sun_elevation + 90);
    // Directions about the normal, more of them where they count more (cosine), from a point set that is even over each
    // 8 x 8 pixels and rays together.
    for (std::size_t n = 0; n < occlusion_pattern_.size(); ++n) {
        const double u = (static_cast<double>(n) + 0.5) / (64.0 * occlusion_rays);
        const double phi = 2 * std::numbers::pi * radical_inverse(static_cast<std::uint32_t>(n));
        const double across = std::sqrt(u);
        occlusion_pattern_[n] = {std::sqrt(1 - u), across * std::cos(phi), across * std::sin(phi)};
    }
    for (std::size_t n = 0; n < sun_pattern_.size(); ++n) {
        const double r = std::sqrt((static_cast<double>(n) + 0.5) / 64) * sun_softness;
        const double phi = 2 * std::numbers::pi * radical_inverse(static_cast<std::uint32_t>(n));
        sun_pattern_[n] =
            divided(sun_ + sun_side_[0] * (r * std::cos(phi)) + sun_side_[1] * (r * std::sin(phi)), voxel_size_);
    }
}

camera::ray preview_shader::ray_of(int x, int y) const {
    const double s = options_.samples;
    return camera_.through((x + 0.5) / (options_.width * s) * 2 - 1, 1 - (y + 0.5) / (options_.height * s) * 2);
}

rgb_linear preview_shader::albedo_of(const ray_hit& hit, const vec3& at, double pixels_per_voxel) const {
    const auto number = scene_.is_sparse() ? static_cast<std::int64_t>(scene_.rank_of(hit.voxel))
                                           : volume_.index(hit.voxel[0], hit.voxel[1], hit.voxel[2]);
    const rgb8 bytes = colors_.of(number);
    rgb_linear color{};
    for (std::size_t a = 0; a < 3; ++a) color[a] = to_linear_[bytes[a]];
    if (!options_.edges) return color;
    // A darker seam along the sides of the face. It fades out where a voxel is only a few pixels wide.
    const float strength = 0.30f * smooth_step(5, 16, pixels_per_voxel);
    if (strength == 0) return color;
    double nearest = 0.5;
    for (std::size_t a = 0; a < 3; ++a) {
        if (static_cast<int>(a) == hit.axis) continue;
        const double inside = at[a] - hit.voxel[a];
        nearest = std::min({nearest, inside, 1 - inside});
    }
    const double width = std::max(0.035, 0.6 / pixels_per_voxel);
    const float seam = 1 - strength * (1 - smooth_step(width * 0.4, width * 1.4, nearest));
    for (float& c : color) c *= seam;
    return color;
}

preview_shader::sample preview_shader::find(const camera::ray& ray, normal_cache& cache) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const vec3 origin = divided(ray.origin, voxel_size_);
    const vec3 direction = divided(ray.direction, voxel_size_);
    const auto to_float = [](const vec3& a) {
        return std::array<float, 3>{static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
    };
    sample s;
    const ray_hit hit = scene_.first_hit(origin, direction, infinity);
    if (hit.axis >= 0) {
        const auto axis = static_cast<std::size_t>(hit.axis);
        s.what = seen::voxel;
        const double pixels_per_voxel = options_.height / camera_.height_at(hit.distance);
        vec3 at = origin + direction * hit.distance;
        at[axis] = hit.voxel[axis] + (hit.high ? 1 : 0);
        s.albedo = albedo_of(hit, at, pixels_per_voxel);
        for (std::size_t a = 0; a < 3; ++a) s.position[a] = static_cast<float>(at[a] * voxel_size_[a]);
        vec3 normal{};
        normal[axis] = hit.high ? 1 : -1;
        // Faces of a pixel or two would only flicker between three tones: there the light follows the surface instead.
        constexpr double most = 0.7; // keeps a trace of the voxels
        s.smoothness = static_cast<float>(most * (1 - smooth_step(3, 14, pixels_per_voxel)));
        if (s.smoothness > 0) {
            if (cache.voxel != hit.voxel) {
                const vec3 n = scene_.surface_normal(hit.voxel, direction * -1.0, voxel_size_);
                cache.voxel = hit.voxel;
                cache.normal = n * (1 / std::sqrt(dot(n, n)));
            }
            const double k = static_cast<double>(s.smoothness);
            normal = normal * (1 - k) + cache.normal * k;
            normal = normal * (1 / std::sqrt(dot(normal, normal)));
        }
        s.normal = to_float(normal);
        s.slack = 0.05f + 1.5f * s.smoothness;
        return s;
    }
    const std::size_t up = axes_.up_index;
    const double drop = ray.direction[up];
    if (!options_.ground || drop >= 0 || ray.origin[up] <= ground_height_) return s;
    const vec3 at = ray.origin + ray.direction * ((ground_height_ - ray.origin[up]) / drop);
    vec3 aside = at - center_;
    aside[up] = 0;
    if (dot(aside, aside) > 16 * radius_ * radius_) return s; // no shadow reaches there
    s.what = seen::ground;
    s.position = to_float(at);
    s.normal[up] = 1;
    s.slack = 1;
    return s;
}

bool preview_shader::on_one_surface(const sample& a, const sample& b) {
    if (a.what != b.what) return false;
    float alike = 0, off = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        alike += b.normal[i] * a.normal[i];
        off += (b.position[i] - a.position[i]) * a.normal[i];
    }
    return alike >= 0.85f && std::abs(off) <= a.slack; // nearly the same normal, close to the tangent plane
}

void preview_shader::find_pixel(sample* samples, int x, int y, normal_cache& cache) const {
    const int s = options_.samples;
    for (int n = 0; n < s * s; ++n) {
        samples[n] = find(ray_of(x * s + n % s, y * s + n / s), cache);
        samples[n].light = 0;
        while (samples[n].light < n && (samples[samples[n].light].light != samples[n].light ||
                                        !on_one_surface(samples[samples[n].light], samples[n])))
            ++samples[n].light;
        if (samples[n].light == n) gather_light(samples[n], x, y);
    }
}

void preview_shader::gather_light(sample& s, int x, int y) const {
    if (s.what == seen::nothing) return;
    const vec3 normal{s.normal[0], s.normal[1], s.normal[2]};
    // Start above the surface: a hair for a face, and where the surface is smoothed so far that its own steps do not
    // count.
    const double lift = ray_lift + 1.6 * static_cast<double>(s.smoothness);
    const vec3 position = vec3{s.position[0], s.position[1], s.position[2]} + normal * lift;
    const vec3 at = divided(position, voxel_size_);
    // Two directions across the normal, after T. Duff et al., "Building an orthonormal basis, revisited" (JCGT 2017).
    const double sign = normal[2] >= 0 ? 1 : -1;
    const double p = -1 / (sign + normal[2]);
    const double q = normal[0] * normal[1] * p;
    const vec3 side_u{1 + sign * normal[0] * normal[0] * p, sign * q, -sign * normal[0]};
    const vec3 side_v{q, sign + normal[1] * normal[1] * p, -normal[1]};

    const std::size_t rank = pattern_rank(x, y);
    double hidden = 0;
    for (std::size_t n = 0; n < occlusion_rays; ++n) {
        const vec3& pattern = occlusion_pattern_[n * 64 + rank];
        const vec3 direction = normal * pattern[0] + side_u * pattern[1] + side_v * pattern[2];
        const ray_hit hit = scene_.first_hit(at, divided(direction, voxel_size_), occlusion_reach_);
        if (hit.axis >= 0) {
            const double near = 1 - hit.distance / occlusion_reach_;
            hidden += near * (1.5 - 0.5 * near); // fades to nothing at the reach
        }
    }
    s.open = static_cast<float>(1 - hidden / occlusion_rays);

    s.sunlit = 0;
    if (dot(sun_, normal) <= 0) return;
    const ray_hit hit = scene_.first_hit(at, sun_pattern_[rank], std::numeric_limits<double>::infinity());
    s.sunlit = hit.axis < 0 ? 1.0f : 0.0f;
}

// Mean of the light over this sample and the pixels around it whose first sample lies on the same surface.
void preview_shader::smooth(const pixel_rows& rows, int x, int row, const sample& middle, float& open,
                            float& sunlit) const {
    float weight = 0, open_sum = 0, sun_sum = 0;
    const auto add = [&](const sample& other) {
        weight += 1;
        open_sum += other.open;
        sun_sum += other.sunlit;
    };
    for (int y = std::max(0, row - smoothing); y < std::min(rows.rows, row + smoothing); ++y)
        for (int i = std::max(0, x - smoothing); i < std::min(rows.width, x + smoothing); ++i)
            if (const sample& other = *rows.at(i, y); on_one_surface(middle, other)) add(other);
    if (middle.light != 0) add(middle); // not among the first ones
    open = open_sum / weight;
    sunlit = sun_sum / weight;
}

rgb_linear preview_shader::shade(const sample& s, float open, float sunlit) const {
    float toward_sun = 0;
    for (std::size_t a = 0; a < 3; ++a) toward_sun += s.normal[a] * static_cast<float>(sun_[a]);
    toward_sun = std::max(0.0f, toward_sun);
    const float sky = 0.5f + 0.5f * s.normal[axes_.up_index];
    rgb_linear out{};
    for (std::size_t a = 0; a < 3; ++a) {
        const float ambient = bounce_color[a] + (sky_color[a] - bounce_color[a]) * sky;
        out[a] = soften(s.albedo[a] * (sun_color[a] * toward_sun * sunlit + ambient * open));
    }
    return out;
}

// Light on the ground as a share of what it has far from the model.
float preview_shader::ground_shade(float open, float sunlit) const {
    constexpr float sun_share = 0.42f, sky_share = 0.38f;
    return 1 - sun_share * (1 - sunlit) - sky_share * (1 - open);
}

rgb_linear preview_shader::backdrop_at(double x, double y) const {
    const float t = smooth_step(0.0, 1.0, y);
    const double dx = x - 0.5, dy = y - 0.5;
    const auto vignette = static_cast<float>(1 - 0.12 * (dx * dx + dy * dy));
    rgb_linear out{};
    for (std::size_t a = 0; a < 3; ++a) out[a] = (backdrop_[0][a] + (backdrop_[1][a] - backdrop_[0][a]) * t) * vignette;
    return out;
}

void preview_shader::find_rows(pixel_rows& rows, int begin, int end, int threads) const {
    const int held = std::max(rows.first + rows.rows - begin, 0); // of them, from `begin` on
    const auto row_samples = static_cast<std::ptrdiff_t>(rows.width) * rows.per_pixel;
    if (held != 0) rows.samples.erase(rows.samples.begin(), rows.samples.begin() + (begin - rows.first) * row_samples);
    rows.first = begin;
    rows.rows = end - begin;
    rows.samples.resize(static_cast<std::size_t>(rows.rows * row_samples));
    if (scene_.empty()) return;
    parallel_for(static_cast<std::size_t>(rows.rows - held), threads, [&](std::size_t n) {
        const int row = held + static_cast<int>(n);
        normal_cache cache;
        for (int x = 0; x < rows.width; ++x) find_pixel(rows.at(x, row), x, rows.first + row, cache);
    });
}

void preview_shader::shade_row(const pixel_rows& rows, int y, int components, std::uint8_t* out) const {
    const float share = 1.0f / static_cast<float>(rows.per_pixel);
    std::vector<std::array<float, 2>> light(static_cast<std::size_t>(rows.per_pixel)); // open and sunlit, smoothed
    for (int x = 0; x < rows.width; ++x, out += components) {
        const rgb_linear behind = backdrop_at((x + 0.5) / options_.width, (y + 0.5) / options_.height);
        rgb_linear sum{};
        float alpha = 0;
        const sample* const samples = rows.at(x, y - rows.first);
        for (int n = 0; n < rows.per_pixel; ++n) {
            const sample& hit = samples[n];
            auto& [open, sunlit] = light[static_cast<std::size_t>(n)];
            if (hit.light != n)
                light[static_cast<std::size_t>(n)] = light[static_cast<std::size_t>(hit.light)];
            else if (hit.what != seen::nothing)
                smooth(rows, x, y - rows.first, hit, open, sunlit);
            if (hit.what == seen::voxel) {
                const rgb_linear lit = shade(hit, open, sunlit);
                for (std::size_t a = 0; a < 3; ++a) sum[a] += lit[a] * share;
                alpha += share;
                continue;
            }
            const float shown = hit.what == seen::ground ? ground_shade(open, sunlit) : 1.0f;
            if (components == 4)
                alpha += (1 - shown) * share; // black over whatever lies behind
            else
                for (std::size_t a = 0; a < 3; ++a) sum[a] += behind[a] * shown * share;
        }
        const float scale = components == 4 && alpha > 0 ? 1 / alpha : 1.0f;
        for (std::size_t a = 0; a < 3; ++a) out[a] = linear_to_srgb8(sum[a] * scale);
        if (components == 4) out[3] = static_cast<std::uint8_t>(std::lround(std::clamp(alpha, 0.0f, 1.0f) * 255));
    }
}

void preview_shader::render(int components, std::uint8_t* pixels, int threads,
                            const std::function<void(int)>& progress) const {
    pixel_rows rows;
    rows.width = options_.width;
    rows.per_pixel = options_.samples * options_.samples;
    const std::size_t row_bytes =
        static_cast<std::size_t>(rows.width) * static_cast<std::size_t>(rows.per_pixel) * sizeof(sample);
    constexpr std::size_t band_bytes = std::size_t{64} << 20;
    const int band = std::max(static_cast<int>(band_bytes / row_bytes), 4 * smoothing);
    for (int from = 0; from < options_.height; from += band) {
        const int to = std::min(from + band, options_.height);
        find_rows(rows, std::max(0, from - smoothing), std::min(options_.height, to + smoothing), threads);
        parallel_for(static_cast<std::size_t>(to - from), threads, [&](std::size_t n) {
            const int y = from + static_cast<int>(n);
            shade_row(rows, y, components, pixels + std::ptrdiff_t{y} * options_.width * components);
        });
        if (progress) progress(to);
    }
}

} // namespace voxelize
