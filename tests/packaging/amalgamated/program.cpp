// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Prints hashes of what a program gets: compiled with the amalgamated header and with the library's, it has to print
// the same. -DVOXELPIPE_HEADER is what it includes.
#include VOXELPIPE_HEADER

#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

namespace vp = voxelpipe;

struct facing {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.normal.x + f.barycentric.y); }
};

template <class T>
std::uint64_t hash(const std::vector<T>& values) { // FNV-1a
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const T& value : values) {
        unsigned char bytes[sizeof(T)];
        std::memcpy(bytes, &value, sizeof(T));
        for (const unsigned char byte : bytes) h = (h ^ byte) * 0x100000001b3u;
    }
    return h;
}

void say(const char* what, const vp::status& s, std::uint64_t h) {
    std::printf("%s: %s, %llu fragments, %llu voxels, %016llx\n", what, s.message().c_str(),
                static_cast<unsigned long long>(s.counts.fragments), static_cast<unsigned long long>(s.counts.voxels),
                static_cast<unsigned long long>(h));
}

int main() {
    std::vector<glm::vec3> positions; // a dented sphere
    std::vector<glm::uvec3> triangles;
    constexpr unsigned columns = 40, rows = 20;
    for (unsigned i = 0; i <= rows; ++i)
        for (unsigned k = 0; k < columns; ++k) {
            const float a = 6.2831853f * static_cast<float>(k) / columns, e = 3.1415927f * static_cast<float>(i) / rows;
            const float r = 1.0f + 0.1f * std::sin(5.0f * a) * std::sin(e);
            positions.emplace_back(r * std::sin(e) * std::cos(a), r * std::cos(e), r * std::sin(e) * std::sin(a));
            if (i == rows) continue;
            const unsigned p = i * columns + k, q = i * columns + (k + 1) % columns;
            triangles.emplace_back(p, q, p + columns);
            triangles.emplace_back(q, q + columns, p + columns);
        }
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    const vp::grid grid = vp::fit_longest(vp::bounds(positions), 48);

    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::max>> values{backend, grid.extent};
    const vp::status drawn = vp::voxelize(backend, mesh, grid, vp::passthrough{}, facing{}, values);
    say("conservative", drawn, hash(vp::get<0>(values).to_host(backend)));

    vp::framebuffer<vp::cpu_backend, vp::target<std::uint8_t, vp::blend::replace>> inside{backend, grid.extent};
    const vp::status filled =
        vp::voxelize_solid(backend, mesh, grid, vp::passthrough{}, vp::constant(std::uint8_t{1}), inside);
    say("solid", filled, hash(vp::get<0>(inside).to_host(backend)));

    const bool good =
        drawn.ok() && filled.ok() && filled.counts.voxels > drawn.counts.voxels && drawn.counts.fragments > 10000;
    return good ? 0 : 1;
}
