// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Samples of fields for both backends, and their digest, the same on every machine.

#include <voxelpipe/programs/field.hpp>

#include <bit>
#include <cstdint>
#include <vector>

namespace fields {

namespace vp = voxelpipe;

inline constexpr int width = 13, height = 9, depth = 5, num_samples = 3000;

struct sampler {
    vp::field2d<glm::vec3> plane;
    vp::field3d<float> box;
    glm::vec4* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto n = static_cast<std::uint32_t>(i);
        const auto coordinate = [&](std::uint32_t factor) {
            const std::uint32_t bits = (n + 1) * factor;
            return vp::exact::mul(static_cast<float>(static_cast<std::int32_t>(bits)), 0x1p-29f); // -4 to 4
        };
        vp::field2d<glm::vec3> p = plane;
        vp::field3d<float> b = box;
        p.filter = b.filter = n % 2 == 0 ? vp::filter_mode::linear : vp::filter_mode::nearest;
        p.wrap_x = b.wrap_y = static_cast<vp::wrap_mode>(n / 2 % 3);
        p.wrap_y = b.wrap_z = static_cast<vp::wrap_mode>(n / 6 % 3);
        b.wrap_x = static_cast<vp::wrap_mode>(n / 18 % 3);
        const glm::vec3 c = p({coordinate(2654435761u), coordinate(2246822519u)}, static_cast<int>(n / 54 % 4));
        out[i] = {c, b({coordinate(3266489917u), coordinate(668265263u), coordinate(374761393u)},
                       static_cast<int>(n / 216 % 4))};
    }
};

inline std::vector<float> texels_of(std::size_t n, std::uint32_t factor) {
    std::vector<float> t(n);
    for (std::size_t i = 0; i < n; ++i)
        t[i] = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(i + 1) * factor)) * 0x1p-31f;
    return t;
}
inline std::vector<glm::vec3> plane_texels() {
    const std::vector<float> t = texels_of(std::size_t{3} * width * height, 2654435761u);
    std::vector<glm::vec3> v;
    for (std::size_t i = 0; i < t.size(); i += 3) v.emplace_back(t[i], t[i + 1], t[i + 2]);
    return vp::with_levels<glm::vec3>(v, width, height);
}
inline std::vector<float> box_texels() {
    return vp::with_levels<float>(texels_of(std::size_t{width} * height * depth, 2246822519u), width, height, depth);
}
inline sampler make_sampler(const glm::vec3* plane, const float* box, glm::vec4* out) {
    return {{plane, width, height, 4}, {box, width, height, depth, 4}, out};
}
inline std::vector<glm::vec4> sample_on_host() {
    const std::vector<glm::vec3> plane = plane_texels();
    const std::vector<float> box = box_texels();
    std::vector<glm::vec4> out(num_samples);
    const sampler s = make_sampler(plane.data(), box.data(), out.data());
    for (std::uint64_t i = 0; i < num_samples; ++i) s(i);
    return out;
}
inline std::uint64_t digest(const std::vector<glm::vec4>& values) {
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const glm::vec4& v : values)
        for (int k = 0; k < 4; ++k) h = (h ^ std::bit_cast<std::uint32_t>(v[k])) * 0x100000001b3u;
    return h;
}
inline constexpr std::uint64_t golden = 0xf3f3c2a23030d97eu;

} // namespace fields
