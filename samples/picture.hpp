// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A picture of voxels for the samples: a camera from the front, the left and above, a sun with shadows, the sky's light
// with the corners that it does not reach, and a floor. Writes a .ppm file, PICTURE_WIDTH pixels wide where that is
// set.

#include <glm/glm.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace picture {

struct view {
    glm::vec3 along{-0.55f, -0.5f, -1.0f}; // from the camera; y points up
    float zoom = 1.0f;
    bool has_floor = true; // below the lowest voxel
    float aspect = 1.25f;  // width / height
    // How many voxels around it a point is lit by: 0 shades the sides of voxels. For voxels of about a pixel, whose
    // sides would make stripes and speckles of a surface that is round.
    int smooth = 0;
};

class scene {
public:
    // color(x, y, z) is a voxel's colour, 0 to 1; negative if it is empty. smooth: as in view.
    template <class Color>
    scene(const glm::ivec3& extent, const Color& color, int smooth = 0)
        : extent_(extent), low_(extent), high_(0), smooth_(smooth) {
        voxels_.reserve(static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) *
                        static_cast<std::size_t>(extent.z));
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const glm::vec3 c = color(x, y, z);
                    voxels_.push_back(c.x < 0.0f ? glm::u8vec4(0)
                                                 : glm::u8vec4(255.0f * glm::clamp(c, 0.0f, 1.0f) + 0.5f, 255));
                    if (c.x < 0.0f) continue;
                    low_ = glm::min(low_, glm::ivec3(x, y, z));
                    high_ = glm::max(high_, glm::ivec3(x + 1, y + 1, z + 1));
                }
        if (high_.x == 0) low_ = glm::ivec3(0), high_ = extent;
        if (smooth_ > 0) find_outside();
    }

    // The colour along a ray, and of the sky where it meets nothing; `noise`, 0 to 1, moves the sun within its disc.
    [[nodiscard]] glm::vec3 look(const glm::vec3& from, const glm::vec3& along, bool has_floor,
                                 const glm::vec2& noise) const {
        const glm::vec3 sun =
            glm::normalize(glm::vec3(0.62f + 0.12f * noise.x, 1.0f, 0.42f + 0.12f * noise.y)); // towards it
        hit h;
        const float size = glm::length(glm::vec3(high_ - low_));
        if (trace(from, along, h)) {
            const glm::vec3 at = from + h.t * along;
            const glm::u8vec4 c = get(h.voxel);
            const glm::vec3 albedo = glm::pow(glm::vec3(c) / 255.0f, glm::vec3(2.2f));
            if (smooth_ > 0) {
                const round_surface s = round_off(at, h);
                // The ray to the sun starts over the steps of the voxels, which would throw shadows on each other.
                return albedo * light(at + 2.0f * s.normal, s.normal, sun, s.open);
            }
            return albedo * light(at, h.normal, sun, corner_light(at, h));
        }
        const glm::vec3 sky = glm::mix(glm::vec3(0.70f, 0.74f, 0.78f), glm::vec3(0.36f, 0.47f, 0.60f),
                                       glm::clamp(0.5f + 1.2f * along.y, 0.0f, 1.0f));
        const float down = (static_cast<float>(low_.y) - 0.01f - from.y) / along.y;
        if (!has_floor || along.y >= 0.0f) return sky;
        const glm::vec3 at = from + down * along, middle = 0.5f * glm::vec3(low_ + high_);
        const float far = glm::length(glm::vec2(at.x - middle.x, at.z - middle.z)) / size;
        const glm::vec3 lit = glm::vec3(0.60f) * light(at, glm::vec3(0, 1, 0), sun, 1.0f);
        return glm::mix(lit, sky, glm::smoothstep(0.5f, 2.2f, far));
    }

    [[nodiscard]] glm::vec3 middle() const { return 0.5f * glm::vec3(low_ + high_); }
    [[nodiscard]] float size() const { return glm::length(glm::vec3(high_ - low_)); }

private:
    struct hit {
        glm::ivec3 voxel;
        glm::vec3 normal;
        int axis;
        float t;
    };

    [[nodiscard]] bool is_within(const glm::ivec3& v) const {
        return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < extent_.x && v.y < extent_.y && v.z < extent_.z;
    }
    [[nodiscard]] std::size_t index(const glm::ivec3& v) const {
        return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(extent_.y) + static_cast<std::size_t>(v.y)) *
                   static_cast<std::size_t>(extent_.x) +
               static_cast<std::size_t>(v.x);
    }
    [[nodiscard]] glm::u8vec4 get(const glm::ivec3& v) const {
        return is_within(v) ? voxels_[index(v)] : glm::u8vec4(0);
    }

    // Empty voxels that a line along an axis reaches from outside. The others count as filled where a surface is
    // rounded off: within a closed shell they do not lie in front of it.
    void find_outside() {
        outside_.assign(voxels_.size(), 0);
        for (int axis = 0; axis < 3; ++axis) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            glm::ivec3 p;
            for (p[v] = 0; p[v] < extent_[v]; ++p[v])
                for (p[u] = 0; p[u] < extent_[u]; ++p[u]) {
                    for (p[axis] = 0; p[axis] < extent_[axis] && get(p).a == 0; ++p[axis]) outside_[index(p)] = 1;
                    for (p[axis] = extent_[axis] - 1; p[axis] >= 0 && get(p).a == 0; --p[axis]) outside_[index(p)] = 1;
                }
        }
    }

    // The surface of all voxels around a point of a side: its normal, away from what is filled, and how much of the sky
    // it sees, which is 1 where it is flat, also half a voxel below the outermost step.
    struct round_surface {
        glm::vec3 normal;
        float open;
    };
    [[nodiscard]] round_surface round_off(const glm::vec3& at, const hit& h) const {
        glm::vec3 sum(0.0f);
        float open = 0.0f, all = 0.0f; // weights of the empty voxels, and of all
        for (int z = -smooth_; z <= smooth_; ++z)
            for (int y = -smooth_; y <= smooth_; ++y)
                for (int x = -smooth_; x <= smooth_; ++x) {
                    const glm::ivec3 p = h.voxel + glm::ivec3(x, y, z);
                    const glm::vec3 step = glm::vec3(p) + 0.5f - at;
                    const float weight = 1.0f - glm::length(step) / static_cast<float>(smooth_);
                    if (weight <= 0.0f) continue;
                    all += weight;
                    if (is_within(p) && outside_[index(p)] == 0) continue;
                    sum += weight * step;
                    open += weight;
                }
        const float length = glm::length(sum);
        return {length > 0.0f ? sum / length : h.normal, glm::min(1.0f, 2.3f * open / all)};
    }

    // The first voxel on a ray, from side to side within the box of all voxels.
    bool trace(const glm::vec3& from, const glm::vec3& along, hit& h) const {
        const glm::vec3 a = (glm::vec3(low_) - from) / along, b = (glm::vec3(high_) - from) / along;
        const glm::vec3 enter = glm::min(a, b), leave = glm::max(a, b);
        float t = std::max({enter.x, enter.y, enter.z, 0.0f});
        if (t >= std::min({leave.x, leave.y, leave.z})) return false;
        int axis = enter.x == t ? 0 : enter.z == t ? 2 : 1;
        const glm::vec3 start = from + (t + 1e-3f) * along;
        glm::ivec3 at = glm::clamp(glm::ivec3(glm::floor(start)), low_, high_ - 1);
        const glm::ivec3 step(along.x > 0 ? 1 : -1, along.y > 0 ? 1 : -1, along.z > 0 ? 1 : -1);
        const glm::vec3 each = glm::abs(1.0f / along);
        glm::vec3 next = (glm::vec3(at) + glm::vec3(glm::greaterThan(along, glm::vec3(0.0f))) - from) / along;
        for (;;) {
            if (get(at).a != 0) {
                glm::vec3 normal(0.0f);
                normal[axis] = static_cast<float>(-step[axis]);
                h = {at, normal, axis, t};
                return true;
            }
            axis = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
            t = next[axis];
            next[axis] += each[axis];
            at[axis] += step[axis];
            if (at[axis] < low_[axis] || at[axis] >= high_[axis]) return false;
        }
    }

    // How much of the sky a point of a side sees: less towards edges at which other voxels stand.
    [[nodiscard]] float corner_light(const glm::vec3& at, const hit& h) const {
        const int u = (h.axis + 1) % 3, v = (h.axis + 2) % 3;
        const auto blocks = [&](int du, int dv) {
            glm::ivec3 p = h.voxel + glm::ivec3(h.normal);
            p[u] += du;
            p[v] += dv;
            return get(p).a != 0;
        };
        const float fu = at[u] - static_cast<float>(h.voxel[u]), fv = at[v] - static_cast<float>(h.voxel[v]);
        float light = 0.0f;
        for (int cu = 0; cu < 2; ++cu)
            for (int cv = 0; cv < 2; ++cv) {
                const int du = cu != 0 ? 1 : -1, dv = cv != 0 ? 1 : -1;
                const bool a = blocks(du, 0), b = blocks(0, dv), c = blocks(du, dv);
                const float corner = a && b ? 0.35f : 1.0f - 0.22f * static_cast<float>(int{a} + int{b} + int{c});
                light += corner * (cu != 0 ? fu : 1.0f - fu) * (cv != 0 ? fv : 1.0f - fv);
            }
        return light;
    }

    [[nodiscard]] glm::vec3 light(const glm::vec3& at, const glm::vec3& normal, const glm::vec3& sun,
                                  float open) const {
        hit h;
        const float facing = std::max(0.0f, glm::dot(normal, sun));
        const bool is_lit = facing > 0.0f && !trace(at + 2e-2f * normal, sun, h);
        const glm::vec3 sky =
            glm::mix(glm::vec3(0.20f, 0.19f, 0.18f), glm::vec3(0.42f, 0.50f, 0.60f), 0.5f + 0.5f * normal.y);
        return open * sky + (is_lit ? facing * glm::vec3(1.12f, 1.02f, 0.86f) : glm::vec3(0.0f));
    }

    glm::ivec3 extent_, low_, high_;
    int smooth_;
    std::vector<glm::u8vec4> voxels_;
    std::vector<std::uint8_t> outside_; // 1 for voxels of find_outside
};

// The sky along a ray, with a glare around the sun, and a floor of tiles: for samples that shade by themselves.
inline glm::vec3 clear_sky(const glm::vec3& along, const glm::vec3& sun) {
    const float glare = std::pow(std::max(0.0f, glm::dot(along, sun)), 90.0f);
    return glm::mix(glm::vec3(0.72f, 0.76f, 0.80f), glm::vec3(0.14f, 0.30f, 0.56f),
                    glm::clamp(1.6f * along.y, 0.0f, 1.0f)) +
           3.0f * glare;
}
inline glm::vec3 tiles(const glm::vec3& at, float size) {
    const bool is_dark = std::fmod(std::abs(std::floor(at.x / size) + std::floor(at.z / size)), 2.0f) != 0.0f;
    return is_dark ? glm::vec3(0.10f, 0.12f, 0.15f) : glm::vec3(0.62f, 0.60f, 0.56f);
}

// Pixels of a picture from side to side.
inline int width() {
    const char* asked = std::getenv("PICTURE_WIDTH"); // NOLINT(concurrency-mt-unsafe): nobody sets it meanwhile
    return asked != nullptr ? std::clamp(std::atoi(asked), 16, 4096) : 800;
}
// True for pictures that people look at; those of tests are smaller, and take few voxels and samples.
inline bool is_fine() { return width() >= 400; }

// A file of the colours that look(x, y, noise) gives, x and y from 0 to 1 from the upper left; 4 of them make a pixel,
// 16 in a fine picture, whose noise covers the square evenly.
template <class Look>
void write_pixels(const std::string& path, float aspect, const Look& look) {
    const int width = picture::width(), height = static_cast<int>(static_cast<float>(width) / aspect);
    const int side = is_fine() ? 4 : 2, samples = side * side;
    const float part = 1.0f / static_cast<float>(side);
    std::vector<char> pixels;
    std::uint32_t random = 1;
    const auto noise = [&] { return static_cast<float>((random = random * 1664525u + 1013904223u) >> 8) * 0x1p-24f; };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            glm::vec3 sum(0.0f);
            for (int i = 0; i < samples; ++i) {
                const int right = i % side, low = i / side;
                const float px = static_cast<float>(x) + part * (static_cast<float>(right) + 0.5f),
                            py = static_cast<float>(y) + part * (static_cast<float>(low) + 0.5f);
                // The noise lies in another part of the square than the sample: an edge has all parts on both sides.
                const int part_x = (low + x) % side, part_y = (right + y) % side;
                const glm::vec2 within(part * (static_cast<float>(part_x) + noise()),
                                       part * (static_cast<float>(part_y) + noise()));
                const glm::vec3 c = look(px / static_cast<float>(width), py / static_cast<float>(height), within);
                sum += glm::pow(glm::clamp(c, 0.0f, 1.0f), glm::vec3(1.0f / 2.2f));
            }
            for (int c = 0; c < 3; ++c) pixels.push_back(static_cast<char>(std::lround(255.0f * part * part * sum[c])));
        }
    std::ofstream out(path, std::ios::binary);
    out << "P6\n" << width << ' ' << height << "\n255\n";
    out.write(pixels.data(), static_cast<std::streamsize>(pixels.size()));
}

template <class Color>
void write(const std::string& path, const glm::ivec3& extent, const Color& color, const view& v = {}) {
    const scene s(extent, color, v.smooth);
    const glm::vec3 along = glm::normalize(v.along);
    const glm::vec3 right = glm::normalize(glm::cross(along, glm::vec3(0, 1, 0))), up = glm::cross(right, along);
    const float distance = 1.75f * s.size() / v.zoom, tangent = 0.36f;
    const glm::vec3 eye = s.middle() - distance * along;
    write_pixels(path, v.aspect, [&](float x, float y, const glm::vec2& noise) {
        const glm::vec3 ray = along + (2.0f * x - 1.0f) * tangent * right + (1.0f - 2.0f * y) * tangent / v.aspect * up;
        return s.look(eye, glm::normalize(ray), v.has_floor, noise);
    });
}

} // namespace picture
