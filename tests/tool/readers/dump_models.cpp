// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Prints what the tool reads of the files whose names stand in its input, one a line: for each a line "file NAME", then
// "t" and nine coordinates and nine sRGB bytes of each triangle, "l" and six coordinates of each line; or "error" and
// the message. With "stream" before its name a file is read as a stream.
#include "read/model_file.hpp"
#include "read/triangle_stream.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

namespace {

int shown_as(float linear) {
    const auto c = static_cast<double>(linear);
    return static_cast<int>(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
}

void print(const std::array<glm::dvec3, 3>& corners, const std::array<glm::vec4, 3>& colors) {
    std::fputc('t', stdout);
    for (const glm::dvec3& p : corners) std::printf(" %.17g %.17g %.17g", p.x, p.y, p.z);
    for (const glm::vec4& c : colors) std::printf(" %d %d %d", shown_as(c.r), shown_as(c.g), shown_as(c.b));
    std::fputc('\n', stdout);
}

void dump_loaded(const std::string& file) {
    const voxelize::scene scene = voxelize::load_model(file);
    for (const voxelize::instance& shown : scene.instances) {
        const voxelize::primitive& part = scene.primitives[shown.primitive];
        const glm::vec4 base = scene.materials[part.material].base_color;
        const auto corner = [&](std::uint32_t v) { return shown.to_world(part.positions[v]); };
        const auto color = [&](std::uint32_t v) { return part.colors.empty() ? base : base * part.colors[v]; };
        for (const glm::uvec3& t : part.triangles)
            print({corner(t.x), corner(t.y), corner(t.z)}, {color(t.x), color(t.y), color(t.z)});
        for (const glm::uvec2& l : part.lines) {
            const glm::dvec3 a = corner(l.x), b = corner(l.y);
            std::printf("l %.17g %.17g %.17g %.17g %.17g %.17g\n", a.x, a.y, a.z, b.x, b.y, b.z);
        }
    }
}

void dump_streamed(const std::string& file) {
    const voxelize::opened_stream opened =
        voxelize::open_stream(file, {std::uint64_t{1} << 20, 0}, std::filesystem::path(file).parent_path(), {});
    if (!opened.stream) {
        std::printf("refused %s\n", opened.refusal.c_str());
        return;
    }
    voxelize::triangle_stream& stream = *opened.stream;
    stream.for_each_block([&](const voxelize::triangle_stream::block& b) {
        const voxelize::triangle_stream::part& part = stream.parts()[b.part];
        const glm::vec4 base = stream.materials()[part.material].base_color;
        const auto color = [&](std::size_t i) { return b.colors.empty() ? base : base * b.colors[i]; };
        for (std::size_t i = 0; i < b.corners.size(); i += 3)
            print({part.to_world(b.corners[i]), part.to_world(b.corners[i + 1]), part.to_world(b.corners[i + 2])},
                  {color(i), color(i + 1), color(i + 2)});
    });
}

} // namespace

int main() {
    for (std::string name; std::getline(std::cin, name);) {
        std::printf("file %s\n", name.c_str());
        try {
            if (name.starts_with("stream "))
                dump_streamed(name.substr(7));
            else
                dump_loaded(name);
        } catch (const std::exception& error) {
            std::printf("error %s\n", error.what());
        }
    }
    return 0;
}
