// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "formats/progress.hpp"
#include "formats/text.hpp"
#include "formats/write_items.hpp"
#include "surface_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace voxelize {
namespace {

// Views into the .glb's binary chunk, accessors of them, and the chunk's length.
struct surface_views {
    std::string views, accessors;
    std::uint64_t total = 0;

    // bytes: of a multiple of 4. accessor: what it has besides its view.
    void add(std::uint64_t bytes, int target, const std::string& accessor) {
        if (total != 0) views += ',';
        if (total != 0) accessors += ',';
        accessors += R"({"bufferView":)" + std::to_string(count_++) + "," + accessor + "}";
        views += R"({"buffer":0,"byteOffset":)" + std::to_string(total) + R"(,"byteLength":)" + std::to_string(bytes) +
                 R"(,"target":)" + std::to_string(target) + "}";
        total += bytes;
    }

private:
    int count_ = 0;
};

} // namespace

void write_surface_glb(output_file& out, const surface_shape& shape, const std::filesystem::path& path,
                       const write_options& options) {
    const surface_mesh& mesh = shape.mesh();
    const std::uint64_t vertices = mesh.vertices.size(), triangles = shape.triangles();
    const auto accessor = [](int type, const char* shape_of_element, std::uint64_t count,
                             const std::string& more = "") {
        return R"("componentType":)" + std::to_string(type) + R"(,"type":")" + shape_of_element + R"(","count":)" +
               std::to_string(count) + more;
    };
    const int bits = shape.float_bits();
    const auto coordinate = [&](std::size_t n, std::size_t a) {
        return static_cast<float>(shape.rounded(n, a, bits) * mesh.voxel_size[a]);
    };
    surface_views views;
    std::string json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{}]})";
    if (shape.faces() != 0) { // glTF has no empty accessors
        std::array<float, 3> low{}, high{};
        for (std::size_t a = 0; a < 3; ++a) low[a] = high[a] = coordinate(0, a);
        for (std::size_t n = 1; n < vertices; ++n)
            for (std::size_t a = 0; a < 3; ++a) {
                low[a] = std::min(low[a], coordinate(n, a));
                high[a] = std::max(high[a], coordinate(n, a));
            }
        const auto list = [](const auto& values) {
            return "[" + number(static_cast<double>(values[0])) + "," + number(static_cast<double>(values[1])) + "," +
                   number(static_cast<double>(values[2])) + "]";
        };
        constexpr int of_vertices = 34962, of_indices = 34963;
        views.add(12 * vertices, of_vertices,
                  accessor(5126, "VEC3", vertices, R"(,"min":)" + list(low) + R"(,"max":)" + list(high)));
        views.add(12 * triangles, of_indices, accessor(5125, "SCALAR", 3 * triangles));
        views.add(12 * vertices, of_vertices, accessor(5126, "VEC3", vertices));
        if (shape.has_colors())
            views.add(8 * vertices, of_vertices, accessor(5123, "VEC4", vertices, R"(,"normalized":true)"));
        json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{"nodes":[0]}],)"
               R"("nodes":[{"name":"surface","mesh":0,"translation":)" +
               list(mesh.origin) + R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":2)" +
               (shape.has_colors() ? R"(,"COLOR_0":3)" : "") +
               R"(},"indices":1,"material":0}]}],)"
               R"("materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":1}}],"accessors":[)" +
               views.accessors + R"(],"bufferViews":[)" + views.views + R"(],"buffers":[{"byteLength":)" +
               std::to_string(views.total) + "}]}";
    }
    if (views.total > std::numeric_limits<std::uint32_t>::max() - 4096)
        throw write_error(path, "a .glb holds at most 4 GiB; .ply and .npz hold more");
    json.append((4 - json.size() % 4) % 4, ' ');
    out.write("glTF");
    out.write_value<std::uint32_t>(2);
    out.write_value(static_cast<std::uint32_t>(20 + json.size() + (views.total != 0 ? 8 + views.total : 0)));
    out.write_value(static_cast<std::uint32_t>(json.size()));
    out.write("JSON");
    out.write(json);
    if (views.total == 0) return;
    out.write_value(static_cast<std::uint32_t>(views.total));
    out.write(std::string_view("BIN\0", 4));
    progress_meter meter(options.progress, (shape.has_colors() ? 3 : 2) * vertices + triangles);
    write_items(out, vertices, options.threads, meter, [&](std::string& text, std::size_t n) {
        for (std::size_t a = 0; a < 3; ++a) put(text, coordinate(n, a));
    });
    write_items(out, triangles, options.threads, meter, [&](std::string& text, std::size_t n) {
        for (const std::uint32_t index : shape.triangle(n)) put(text, index);
    });
    write_items(out, vertices, options.threads, meter, [&](std::string& text, std::size_t n) {
        for (glm::length_t a = 0; a < 3; ++a) put(text, mesh.normals[n][a]);
    });
    if (!shape.has_colors()) return;
    write_items(out, vertices, options.threads, meter, [&](std::string& text, std::size_t n) {
        for (glm::length_t c = 0; c < 3; ++c)
            put(text, static_cast<std::uint16_t>(std::lround(double{mesh.colors[n][c]} * 65535)));
        put(text, std::uint16_t{65535});
    });
}

} // namespace voxelize
