// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "stl.hpp"

#include "write_items.hpp"

#include <cmath>
#include <string>
#include <string_view>

namespace voxelize {
namespace {

// The unit normal of a triangle.
std::array<double, 3> normal_of(const stl_triangle& t) {
    std::array<double, 3> a{}, b{}, n{};
    for (std::size_t i = 0; i < 3; ++i) {
        a[i] = t[1][i] - t[0][i];
        b[i] = t[2][i] - t[0][i];
    }
    for (std::size_t i = 0; i < 3; ++i) n[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    const double length = std::hypot(n[0], n[1], n[2]);
    for (double& each : n) each = length > 0 ? each / length : 0;
    return n;
}

} // namespace

void write_stl_triangles(output_file& out, std::uint64_t count, int threads, progress_meter& meter,
                         const std::function<stl_triangle(std::size_t)>& triangle) {
    if (count > max_stl_triangles) throw write_error(out.target(), "more than 2^32 - 1 triangles, the most of .stl");
    constexpr std::size_t header_bytes = 80;
    std::string header = "binary STL made by voxelize"; // a header that begins with "solid" would be taken for text
    header.resize(header_bytes);
    out.write(header);
    out.write_value(static_cast<std::uint32_t>(count));
    constexpr std::size_t triangle_bytes = 50;
    write_items(
        out, count, threads, meter,
        [&](std::string& text, std::size_t n) {
            const stl_triangle corners = triangle(n);
            for (const double each : normal_of(corners)) put(text, static_cast<float>(each));
            for (const std::array<double, 3>& corner : corners)
                for (const double each : corner) put(text, static_cast<float>(each));
            put(text, std::uint16_t{0});
        },
        triangle_bytes);
}

} // namespace voxelize
