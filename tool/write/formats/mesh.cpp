// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "mesh.hpp"

#include "mesh_parts.hpp"
#include "model/parallel.hpp"
#include "text.hpp"
#include "write_items.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

namespace voxelize {
namespace {

// FORMAT(text, brick, glm::ivec3 voxel) for every occupied voxel, in storage order.
template <class Format>
void write_voxels(output_file& out, const voxel_shape& v, const write_options& options, const Format& format) {
    const brick_order order(v, 2);
    const std::size_t planes = 8 * order.num_layers();
    progress_meter meter(options.progress, planes);
    ordered_for(
        planes, thread_count(options.threads),
        [&](std::size_t n) {
            std::string text;
            order.for_each_voxel(order.layer(n / 8), static_cast<unsigned>(n % 8),
                                 [&](std::size_t brick, const glm::ivec3& voxel) { format(text, brick, voxel); });
            return text;
        },
        [&](std::size_t, const std::string& text) {
            out.write(text);
            meter.advance(1);
        });
}

// Colours are those of the faces where there are any, otherwise of the vertices.
std::string ply_header(std::uint64_t vertices, bool colored, std::optional<std::size_t> faces) {
    std::string text = "ply\nformat binary_little_endian 1.0\ncomment made by voxelize\nelement vertex " +
                       std::to_string(vertices) + "\nproperty double x\nproperty double y\nproperty double z\n";
    if (faces) text += "element face " + std::to_string(*faces) + "\nproperty list uchar uint vertex_indices\n";
    if (colored) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    return text + "end_header\n";
}

void put_color(std::string& out, std::uint32_t rgb) {
    put(out, red(rgb));
    put(out, green(rgb));
    put(out, blue(rgb));
}

std::vector<std::filesystem::path> write_ply_points(const voxel_shape& v, const std::filesystem::path& path,
                                                    const write_options& options) {
    output_file out(path);
    out.write(ply_header(v.num_voxels(), v.colored(), std::nullopt));
    write_voxels(out, v, options, [&](std::string& text, std::size_t brick, const glm::ivec3& voxel) {
        for (int a = 0; a < 3; ++a) put(text, world(v, static_cast<std::size_t>(a), voxel[a] + 0.5));
        if (v.colored()) put_color(text, v.rgb(brick, voxel));
    });
    out.commit();
    return {path};
}

// sRGB byte -> linear light as glTF's normalised 16-bit integer.
std::array<std::uint16_t, 256> linear_table() {
    std::array<std::uint16_t, 256> table{};
    for (std::size_t b = 0; b < table.size(); ++b) {
        const double encoded = static_cast<double>(b) / 255;
        const double linear = encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
        table[b] = static_cast<std::uint16_t>(std::lround(linear * 65535));
    }
    return table;
}

struct glb_layout {
    std::uint64_t positions = 0, colors = 0, indices = 0, total = 0; // offsets into the BIN chunk, and its length
};

std::string glb_json(const voxel_shape& v, const welded_mesh& mesh, bool colored, const glb_layout& at) {
    std::array<std::uint32_t, 3> low{}, high{};
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = n == 0 ? mesh.vertices[n].corner[a] : std::min(low[a], mesh.vertices[n].corner[a]);
            high[a] = std::max(high[a], mesh.vertices[n].corner[a]);
        }
    const auto triple = [&](const std::array<std::uint32_t, 3>& corner) {
        std::string text = "[";
        for (std::size_t a = 0; a < 3; ++a) { // as the floats that the file holds
            const auto value = static_cast<float>(corner[a] * v.voxel_size[a]);
            text += (a != 0 ? "," : "") + number(static_cast<double>(value));
        }
        return text + "]";
    };
    const std::string vertices = std::to_string(mesh.vertices.size());
    const std::string index_count = std::to_string(6 * mesh.quads.size());
    const auto view = [&](std::uint64_t offset, std::uint64_t end, int target) {
        return R"({"buffer":0,"byteOffset":)" + std::to_string(offset) + R"(,"byteLength":)" +
               std::to_string(end - offset) + R"(,"target":)" + std::to_string(target) + "}";
    };
    std::string json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{"nodes":[0]}],)";
    json += R"("nodes":[{"name":"voxels","mesh":0,"translation":[)" + number(v.origin[0]) + "," + number(v.origin[1]) +
            "," + number(v.origin[2]) + "]}],";
    json += R"("meshes":[{"primitives":[{"attributes":{"POSITION":0)";
    if (colored) json += R"(,"COLOR_0":2)";
    json += R"(},"indices":1,"material":0}]}],"materials":[{"pbrMetallicRoughness":{)";
    if (!colored) {
        json += R"("baseColorFactor":[)";
        for (const std::uint8_t c : clay) json += number(linear_table()[c] / 65535.0) + ",";
        json += "1],";
    }
    json += R"("metallicFactor":0,"roughnessFactor":1}}],"accessors":[)";
    json += R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":)" + vertices + R"(,"min":)" + triple(low) +
            R"(,"max":)" + triple(high) + "},";
    json += R"({"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" + index_count + "}";
    if (colored)
        json += R"(,{"bufferView":2,"componentType":5123,"normalized":true,"type":"VEC4","count":)" + vertices + "}";
    json += R"(],"bufferViews":[)" + view(at.positions, at.colors, 34962) + "," + view(at.indices, at.total, 34963);
    if (colored) json += "," + view(at.colors, at.indices, 34962);
    json += R"(],"buffers":[{"byteLength":)" + std::to_string(at.total) + "}]}";
    json.append((4 - json.size() % 4) % 4, ' ');
    return json;
}

void write_glb_part(output_file& out, const voxel_shape& v, const welded_mesh& mesh, const write_options& options,
                    progress_meter& meter) {
    const bool colored = v.colored();
    glb_layout at;
    at.colors = 12 * static_cast<std::uint64_t>(mesh.vertices.size());
    at.indices = at.colors + (colored ? 8 * static_cast<std::uint64_t>(mesh.vertices.size()) : 0);
    at.total = at.indices + 24 * static_cast<std::uint64_t>(mesh.quads.size());
    std::string json;
    if (mesh.quads.empty()) { // glTF has no empty accessors
        json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{}]})";
        json.append((4 - json.size() % 4) % 4, ' ');
    } else {
        json = glb_json(v, mesh, colored, at);
    }
    const std::uint64_t length = 12 + 8 + json.size() + (mesh.quads.empty() ? 0 : 8 + at.total);
    out.write("glTF");
    out.write_value<std::uint32_t>(2);
    out.write_value(static_cast<std::uint32_t>(length));
    out.write_value(static_cast<std::uint32_t>(json.size()));
    out.write("JSON");
    out.write(json);
    if (mesh.quads.empty()) return;
    out.write_value(static_cast<std::uint32_t>(at.total));
    out.write(std::string_view("BIN\0", 4));
    write_items(out, mesh.vertices.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
        for (std::size_t a = 0; a < 3; ++a) put(text, static_cast<float>(mesh.vertices[n].corner[a] * v.voxel_size[a]));
    });
    if (colored) {
        const auto linear = linear_table();
        write_items(out, mesh.vertices.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
            const std::uint32_t rgb = mesh.vertices[n].rgb_and_sheet;
            for (const std::uint8_t c : {red(rgb), green(rgb), blue(rgb)}) put(text, linear[c]);
            put(text, std::uint16_t{65535});
        });
    }
    write_items(out, mesh.quads.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
        const auto& [a, b, c, d] = mesh.quads[n];
        for (const std::uint32_t index : {a, b, c, a, c, d}) put(text, index);
    });
}

} // namespace

std::vector<file_part> split(std::span<const voxel_face> faces, const std::filesystem::path& path, std::uint64_t most) {
    if (faces.size() <= most) return {{path, faces}};
    const std::size_t parts = (faces.size() + most - 1) / most;
    std::vector<file_part> result;
    for (std::size_t n = 0; n < parts; ++n) {
        const std::size_t begin = faces.size() * n / parts, end = faces.size() * (n + 1) / parts;
        result.push_back({with_word(path, std::to_string(n + 1)), faces.subspan(begin, end - begin)});
    }
    return result;
}

written_names mesh_names(const volume& shape, const std::filesystem::path& path, const write_options& options,
                         held_as) {
    written_names names{{path}, {}};
    const std::string extension = lower_extension(path);
    if (options.points && extension == ".ply") return names;
    // A side between two voxels is a face at most once.
    double faces = 0;
    for (std::size_t a = 0; a < 3; ++a)
        faces += static_cast<double>(shape.extent[a] + 1) * static_cast<double>(shape.extent[(a + 1) % 3]) *
                 static_cast<double>(shape.extent[(a + 2) % 3]);
    const std::uint64_t of_format = extension == ".glb"   ? max_glb_faces
                                    : extension == ".3mf" ? max_3mf_faces
                                                          : max_faces;
    const auto most = static_cast<double>(most_faces(of_format, options));
    if (faces > most && !is_standard_output(path))
        names.numbered.push_back({path.parent_path(), path.stem().string() + ".", path.extension().string(),
                                  static_cast<std::uint64_t>(std::ceil(faces / most))});
    return names;
}

std::vector<std::filesystem::path> write_ply(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    if (options.points) return write_ply_points(v, path, options);
    const bool colored = v.colored();
    return write_parts(
        v, path, options, max_faces, [&](output_file& out, std::span<const voxel_face> faces, progress_meter& meter) {
            const welded_mesh mesh = weld(faces, v.extent, options.threads, false);
            out.write(ply_header(mesh.vertices.size(), colored, mesh.quads.size()));
            write_items(out, mesh.vertices.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
                for (std::size_t a = 0; a < 3; ++a) put(text, world(v, a, mesh.vertices[n].corner[a]));
            });
            write_items(out, mesh.quads.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
                put(text, std::uint8_t{4});
                for (const std::uint32_t index : mesh.quads[n]) put(text, index);
                if (colored) put_color(text, faces[n].rgb);
            });
        });
}

std::vector<std::filesystem::path> write_obj(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    const bool colored = v.colored();
    const coordinate_texts coordinates(v, 0, 1);
    std::vector<std::string> fractions;
    fractions.reserve(256);
    for (int b = 0; b < 256; ++b) fractions.push_back(fraction_text(b));
    return write_parts(
        v, path, options, max_faces, [&](output_file& out, std::span<const voxel_face> faces, progress_meter& meter) {
            const welded_mesh mesh = weld(faces, v.extent, options.threads);
            out.write("# made by voxelize\no voxels\n");
            write_items(out, mesh.vertices.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
                const auto& [corner, rgb] = mesh.vertices[n];
                text += "v ";
                coordinates.append(text, corner[0], corner[1], corner[2]);
                if (colored)
                    for (const std::uint8_t c : {red(rgb), green(rgb), blue(rgb)})
                        text.append(1, ' ').append(fractions[c]);
                text += '\n';
            });
            write_items(out, mesh.quads.size(), options.threads, meter, [&](std::string& text, std::size_t n) {
                text += 'f';
                for (const std::uint32_t index : mesh.quads[n])
                    text.append(1, ' ').append(std::to_string(std::uint64_t{index} + 1));
                text += '\n';
            });
        });
}

std::vector<std::filesystem::path> write_glb(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    return write_parts(v, path, options, max_glb_faces,
                       [&](output_file& out, std::span<const voxel_face> faces, progress_meter& meter) {
                           write_glb_part(out, v, weld(faces, v.extent, options.threads), options, meter);
                       });
}

std::vector<std::filesystem::path> write_xyz(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    const coordinate_texts centers(v, 0.5, 0);
    output_file out(path);
    write_voxels(out, v, options, [&](std::string& text, std::size_t brick, const glm::ivec3& voxel) {
        centers.append(text, static_cast<std::size_t>(voxel.x), static_cast<std::size_t>(voxel.y),
                       static_cast<std::size_t>(voxel.z));
        if (v.colored()) {
            const std::uint32_t rgb = v.rgb(brick, voxel);
            for (const std::uint8_t c : {red(rgb), green(rgb), blue(rgb)})
                text.append(1, ' ').append(std::to_string(c));
        }
        text += '\n';
    });
    out.commit();
    return {path};
}

} // namespace voxelize
