// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Volumes of bits, what label says of them on any backend, and what a flood of one voxel after the other says.

#include <voxelpipe/label/label.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

namespace label_tests {

namespace vp = voxelpipe;

inline constexpr std::array<int, 3> connectivities{6, 18, 26};

struct volume {
    glm::ivec3 extent{0};
    std::vector<std::uint8_t> set; // by voxel number

    explicit volume(const glm::ivec3& e) : extent(e), set(number(0, 0, e.z)) {}
    [[nodiscard]] std::size_t number(int x, int y, int z) const {
        const auto wide = [](int n) { return static_cast<std::size_t>(n); };
        return wide(x) + wide(extent.x) * (wide(y) + wide(extent.y) * wide(z));
    }
    [[nodiscard]] bool has(int x, int y, int z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < extent.x && y < extent.y && z < extent.z;
    }
    void add(int x, int y, int z) { set[number(x, y, z)] = 1; }
    // Sets the voxels for which f(x, y, z) is true.
    template <class F>
    volume& add_where(const F& f) {
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x)
                    if (f(x, y, z)) add(x, y, z);
        return *this;
    }
    // As elements of a target of bits. Padding of rows gets bits that belong to no voxel.
    template <class Layout>
    [[nodiscard]] std::vector<std::uint32_t> words() const {
        using map = vp::core::storage_map<vp::bit, Layout>;
        std::vector<std::uint32_t> w(map::elements(extent), 0xdeadbeefu);
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) map::store(w.data(), extent, x, y, z, set[number(x, y, z)] != 0);
        return w;
    }
};

struct result {
    vp::status status;
    std::vector<std::int64_t> labels;
    std::vector<vp::voxel_component> components;
    [[nodiscard]] bool is(const result& o) const {
        return status.ok() == o.status.ok() && status.label == o.status.label && labels == o.labels &&
               components == o.components;
    }
};

template <class Label, class Layout = vp::layout::linear, class Backend>
[[nodiscard]] result label(Backend& backend, const volume& v, int connectivity, bool with_components = true) {
    const std::vector<std::uint32_t> words = v.words<Layout>();
    typename Backend::template buffer<std::uint32_t> bits(backend, vp::array_view<const std::uint32_t>(words));
    // What was there does not matter.
    const std::vector<Label> before(v.set.size(), Label{5});
    typename Backend::template buffer<Label> labels(backend, vp::array_view<const Label>(before));
    typename Backend::template buffer<vp::voxel_component> components(backend, 0);
    const vp::target_view<vp::target<vp::bit, vp::blend::replace, Layout>> from{bits.data(), v.extent};
    const vp::target_view<vp::target<Label, vp::blend::replace>> to{labels.data(), v.extent};
    const vp::label_options options{.connectivity = connectivity};
    const vp::status status =
        with_components ? vp::label(backend, from, to, components, options) : vp::label(backend, from, to, options);
    const std::vector<Label> host = labels.to_host(backend);
    return {status, {host.begin(), host.end()}, components.to_host(backend)};
}

// By a flood from each voxel, in ascending order, that has no label yet.
[[nodiscard]] inline result flood(const volume& v, int connectivity) {
    result r;
    r.labels.assign(v.set.size(), -1);
    const int most = connectivity == 6 ? 1 : connectivity == 18 ? 2 : 3; // coordinates in which neighbours differ
    std::vector<glm::ivec3> steps, queue;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                if (const int n = x * x + y * y + z * z; n != 0 && n <= most) steps.emplace_back(x, y, z);
    std::size_t next = 0;
    for (int z = 0; z < v.extent.z; ++z)
        for (int y = 0; y < v.extent.y; ++y)
            for (int x = 0; x < v.extent.x; ++x, ++next) {
                if (v.set[next] == 0 || r.labels[next] >= 0) continue;
                const auto name = static_cast<std::int64_t>(next);
                vp::voxel_component c{name, 0, glm::ivec3(x, y, z), glm::ivec3(x, y, z)};
                r.labels[next] = name;
                queue.assign(1, glm::ivec3(x, y, z));
                while (!queue.empty()) {
                    const glm::ivec3 at = queue.back();
                    queue.pop_back();
                    ++c.voxels;
                    c.min = glm::ivec3(std::min(c.min.x, at.x), std::min(c.min.y, at.y), std::min(c.min.z, at.z));
                    c.max = glm::ivec3(std::max(c.max.x, at.x), std::max(c.max.y, at.y), std::max(c.max.z, at.z));
                    for (const glm::ivec3& step : steps) {
                        const glm::ivec3 to = at + step;
                        if (!v.has(to.x, to.y, to.z)) continue;
                        const std::size_t i = v.number(to.x, to.y, to.z);
                        if (v.set[i] == 0 || r.labels[i] >= 0) continue;
                        r.labels[i] = name;
                        queue.push_back(to);
                    }
                }
                r.components.push_back(c);
            }
    r.status.label.components = r.components.size();
    return r;
}

[[nodiscard]] inline volume random_volume(std::mt19937& random, const glm::ivec3& extent, unsigned percent) {
    volume v(extent);
    for (std::uint8_t& s : v.set) s = random() % 100 < percent ? 1 : 0;
    return v;
}
// Widths at the borders of words more often than others.
[[nodiscard]] inline volume random_volume(std::mt19937& random) {
    constexpr std::array<int, 12> widths{1, 2, 31, 32, 33, 63, 64, 65, 66, 127, 128, 130};
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    const int x = random() % 2 == 0 ? widths[random() % widths.size()] : 1 + below(70);
    const int y = 1 + below(x > 40 ? 5 : 9), z = 1 + below(x > 40 ? 4 : 8);
    return random_volume(random, glm::ivec3(x, y, z), 10 + 8 * static_cast<unsigned>(below(11)));
}

struct named_volume {
    std::string name;
    volume voxels;
};
// Shapes that are hard to label, in grids of a width.
[[nodiscard]] inline std::vector<named_volume> shapes(int nx) {
    std::vector<named_volume> s;
    const auto make = [&](const char* name, int ny, int nz, const auto& f) {
        s.push_back({name, volume(glm::ivec3(nx, ny, nz)).add_where(f)});
    };
    make("empty", 3, 2, [](int, int, int) { return false; });
    make("full", 3, 4, [](int, int, int) { return true; });
    make("full row", 1, 1, [](int, int, int) { return true; });
    make("checkerboard", 5, 4, [](int x, int y, int z) { return (x + y + z) % 2 == 0; });
    make("other checkerboard", 5, 4, [](int x, int y, int z) { return (x + y + z) % 2 == 1; });
    make("columns", 5, 3, [](int x, int y, int) { return x % 2 == 0 && y % 2 == 0; });
    // One way through the whole grid, row after row, slice after slice.
    make("serpentine", 9, 5, [=](int x, int y, int z) {
        if (z % 2 == 1) return y == (z / 2 % 2 == 0 ? 8 : 0) && x == nx - 1;
        return y % 2 == 0 || x == (y / 2 % 2 == 0 ? nx - 1 : 0);
    });
    // Columns that bridges join from the last pair on, row by row, so that each set is joined with a lower one.
    make("late bridges", nx / 2 + 2, 1, [=](int x, int y, int) { return x % 2 == 0 || y == (nx - x) / 2; });
    make("late bridges between slices", 3, nx / 2 + 2,
         [=](int x, int y, int z) { return (x % 2 == 0 && y != 1) || z == (nx - x) / 2; });
    make("diagonal lines", 9, 3, [](int x, int y, int z) { return (x + y) % 3 == 0 && (x - y + 30 + z) % 4 == 0; });
    make("stairs down", 8, 2, [=](int x, int y, int z) { return x % 8 == (z == 0 ? y : 7 - y); });
    make("open boxes", 7, 7, [](int x, int y, int z) {
        const int h = std::max({std::abs(x % 9 - 4), std::abs(y - 3), std::abs(z - 3)});
        return h == 3 || h == 1;
    });
    // A spiral, and what winds between its arms.
    volume spiral(glm::ivec3(nx, nx / 2 + 3, 1));
    glm::ivec3 at(0), step(1, 0, 0), low(0), high(spiral.extent.x - 1, spiral.extent.y - 1, 0);
    for (int turns = 0; low.x <= high.x && low.y <= high.y; ++turns) {
        while (at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y) {
            spiral.add(at.x, at.y, 0);
            at += step;
        }
        at -= step;
        if (step.x > 0) low.y += 2;
        if (step.y > 0) high.x -= 2;
        if (step.x < 0) high.y -= 2;
        if (step.y < 0) low.x += 2;
        step = glm::ivec3(-step.y, step.x, 0);
        at += step;
    }
    s.push_back({"spiral", spiral});
    for (std::uint8_t& b : spiral.set) b = b == 0 ? 1 : 0;
    s.push_back({"inverse spiral", spiral});
    return s;
}

// Patterns of 3 x 3 x 2 voxels, bit dx + 3 (dy + 3 dz) of each, that do not touch: `columns` of them along x.
[[nodiscard]] inline volume of_patterns(const std::vector<std::uint32_t>& patterns, int columns, int first, int period,
                                        int width) {
    const int rows = (static_cast<int>(patterns.size()) + columns - 1) / columns;
    volume v(glm::ivec3(width, 4 * rows, 2));
    for (std::size_t i = 0; i < patterns.size(); ++i) {
        const int x = first + period * (static_cast<int>(i) % columns), y = 4 * (static_cast<int>(i) / columns);
        for (int b = 0; b < 18; ++b)
            if ((patterns[i] >> b & 1) != 0) v.add(x + b % 3, y + b / 3 % 3, b / 9);
    }
    return v;
}

} // namespace label_tests
