// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "surface_files.hpp"

#include "formats/mesh_3mf.hpp"
#include "formats/npy.hpp"
#include "formats/progress.hpp"
#include "formats/stl.hpp"
#include "formats/text.hpp"
#include "formats/voxel_shape.hpp"
#include "formats/write_items.hpp"
#include "formats/zip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

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

// Writes a .glb: colours are linear, as normalised 16-bit integers. Throws write_error where it would pass 4 GiB.
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

class surface_writer : surface_shape {
public:
    surface_writer(const surface_mesh& mesh, const std::filesystem::path& path, const write_options& options)
        : surface_shape(mesh), path_(path), options_(options),
          meter_(options.progress, mesh.vertices.size() + faces()) {}

    std::vector<std::filesystem::path> write() {
        output_file out(path_);
        const std::string extension = lower_extension(path_);
        if (extension == ".ply") write_ply(out);
        if (extension == ".obj") write_obj(out);
        if (extension == ".glb") write_surface_glb(out, *this, path_, options_);
        if (extension == ".stl") write_stl(out);
        if (extension == ".3mf") write_3mf(out);
        if (extension == ".npz") write_npz(out);
        out.commit();
        return {path_};
    }

private:
    void write_ply(output_file& out) {
        out.write("ply\nformat binary_little_endian 1.0\ncomment made by voxelize\nelement vertex " +
                  std::to_string(mesh_.vertices.size()) +
                  "\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\n"
                  "property float nz\n" +
                  (has_colors() ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") +
                  "element face " + std::to_string(faces()) +
                  "\nproperty list uchar uint vertex_indices\nend_header\n");
        write_items(out, mesh_.vertices.size(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            for (std::size_t a = 0; a < 3; ++a) put(text, world(n, a));
            for (glm::length_t a = 0; a < 3; ++a) put(text, mesh_.normals[n][a]);
            if (has_colors())
                for (const std::uint8_t c : encoded(n)) put(text, c);
        });
        write_items(out, faces(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            put(text, static_cast<std::uint8_t>(corners()));
            const index_list f = face(n);
            for (std::size_t i = 0; i < corners(); ++i) put(text, f[i]);
        });
    }

    void write_obj(output_file& out) {
        out.write("# made by voxelize\no surface\n");
        write_items(out, mesh_.vertices.size(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            text += 'v';
            for (std::size_t a = 0; a < 3; ++a) text.append(1, ' ').append(number(world(n, a)));
            if (has_colors())
                for (const std::uint8_t c : encoded(n)) text.append(1, ' ').append(fraction_text(c));
            text += '\n';
        });
        write_items(out, mesh_.vertices.size(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            text += "vn";
            for (glm::length_t a = 0; a < 3; ++a) text.append(1, ' ').append(decimal(mesh_.normals[n][a], 5));
            text += '\n';
        });
        write_items(out, faces(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            text += 'f';
            const index_list f = face(n);
            for (std::size_t i = 0; i < corners(); ++i) {
                const std::string at = std::to_string(std::uint64_t{f[i]} + 1);
                text.append(1, ' ').append(at).append("//").append(at);
            }
            text += '\n';
        });
    }

    // Ways of vertices that share their place with another one of their cell, towards the mean of their faces'
    // vertices.
    [[nodiscard]] std::unordered_map<std::uint32_t, std::array<double, 3>> insets() const {
        struct sum {
            std::array<double, 3> way{};
            std::uint32_t count = 0;
        };
        std::unordered_map<std::uint32_t, sum> sums;
        const auto& v = mesh_.vertices;
        for (std::size_t first = 0, end = 0; first < v.size(); first = end) {
            std::vector<voxelpipe::surface_vertex> cell{v[first]};
            for (end = first + 1; end < v.size() && v[end].cell == cell[0].cell; ++end) cell.push_back(v[end]);
            for (std::size_t i = 0; i < cell.size(); ++i)
                for (std::size_t k = 0; k < cell.size(); ++k)
                    if (i != k && std::equal(cell[i].q, cell[i].q + 3, cell[k].q))
                        sums.try_emplace(static_cast<std::uint32_t>(first + i));
        }
        if (sums.empty()) return {};
        for (std::size_t f = 0; f < faces(); ++f) {
            const index_list all = face(f);
            for (std::size_t i = 0; i < corners(); ++i) {
                const auto found = sums.find(all[i]);
                if (found == sums.end()) continue;
                const voxelpipe::surface_vertex from = v[all[i]];
                for (std::size_t k = 0; k < corners(); ++k) {
                    const voxelpipe::surface_vertex to = v[all[k]];
                    for (std::size_t a = 0; a < 3; ++a)
                        found->second.way[a] += place(to, a, to.q[a]) - place(from, a, from.q[a]);
                }
                found->second.count += static_cast<std::uint32_t>(corners());
            }
        }
        std::unordered_map<std::uint32_t, std::array<double, 3>> ways;
        for (auto& [n, s] : sums) {
            for (double& way : s.way) way = way / s.count / 64;
            ways.emplace(n, s.way);
        }
        return ways;
    }

    // True if two vertices have the same floats. Vertices come by layers, whose floats ascend along z.
    template <class Coordinate>
    [[nodiscard]] bool merge_as_floats(const Coordinate& coordinate) const {
        std::vector<std::array<float, 3>> floats; // of layers that share floats along z
        float highest = -std::numeric_limits<float>::infinity();
        const auto has_same = [&floats] {
            std::sort(floats.begin(), floats.end());
            return std::adjacent_find(floats.begin(), floats.end()) != floats.end();
        };
        for (std::size_t n = 0; n < mesh_.vertices.size();) {
            const int layer = mesh_.vertices[n].cell.z;
            const std::size_t before = floats.size();
            float lowest = std::numeric_limits<float>::infinity();
            for (; n < mesh_.vertices.size() && mesh_.vertices[n].cell.z == layer; ++n) {
                floats.push_back({static_cast<float>(coordinate(n, 0)), static_cast<float>(coordinate(n, 1)),
                                  static_cast<float>(coordinate(n, 2))});
                lowest = std::min(lowest, floats.back()[2]);
            }
            if (lowest > highest) { // nothing of the layers before is met again
                std::vector<std::array<float, 3>> next(floats.begin() + static_cast<std::ptrdiff_t>(before),
                                                       floats.end());
                floats.resize(before);
                if (has_same()) return true;
                floats = std::move(next);
            }
            for (const std::array<float, 3>& p : floats) highest = std::max(highest, p[2]);
        }
        return has_same();
    }

    void write_stl(output_file& out) {
        if (triangles() > max_stl_triangles)
            throw write_error(path_, "a .stl counts its triangles with 32 bits; .ply and .npz hold more");
        const int bits = float_bits();
        const std::unordered_map<std::uint32_t, std::array<double, 3>> ways = insets();
        const auto coordinate = [&](std::size_t n, std::size_t a) {
            const auto way = ways.find(static_cast<std::uint32_t>(n));
            const double at = rounded(n, a, bits) + (way != ways.end() ? way->second[a] : 0.0);
            return std::fma(at, mesh_.voxel_size[a], mesh_.origin[a]);
        };
        if (options_.warn && merge_as_floats(coordinate))
            options_.warn(path_.string() + ": the floats of .stl merge vertices of this mesh, which is far from 0 "
                                           "for its voxel size; .glb, .ply and .obj keep them apart");
        write_stl_triangles(out, triangles(), options_.threads, meter_, [&](std::size_t n) {
            stl_triangle t{};
            const auto index = triangle(n);
            for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t a = 0; a < 3; ++a) t[c][a] = coordinate(index[c], a);
            return t;
        });
    }

    void write_3mf(output_file& out) {
        const std::uint64_t most_of_line = has_colors() ? 256 : 128;
        const bool is_large = (mesh_.vertices.size() + triangles()) * most_of_line > 0xffff'ffffU;
        write_3mf_package(out, options_.compression, is_large, faces() == 0, [&](const entry_sink& add) {
            const auto in_pieces = [&](std::size_t count, const auto& format) {
                constexpr std::size_t piece = std::size_t{1} << 14;
                for (std::size_t begin = 0; begin < count; begin += piece) {
                    const std::size_t end = std::min(count, begin + piece);
                    std::string text;
                    for (std::size_t n = begin; n < end; ++n) format(text, n);
                    add(std::as_bytes(std::span{text}));
                    meter_.advance(end - begin);
                }
            };
            const auto say = [&](std::string_view text) { add(std::as_bytes(std::span{text})); };
            std::vector<std::uint32_t> palette;
            if (has_colors()) {
                const auto sort = [&palette] {
                    std::sort(palette.begin(), palette.end());
                    palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
                };
                std::size_t room = std::size_t{1} << 16; // a mesh has fewer colours than vertices
                for (std::size_t n = 0; n < mesh_.vertices.size(); ++n) {
                    palette.push_back(encoded_number(n));
                    if (palette.size() < room) continue;
                    sort();
                    room = std::max(room, 2 * palette.size());
                }
                sort();
                say("<m:colorgroup id=\"2\">\n");
                in_pieces(palette.size(), [&](std::string& text, std::size_t n) { add_3mf_color(text, palette[n]); });
                say("</m:colorgroup>\n");
            }
            const auto color_of = [&](std::uint32_t vertex) {
                return std::lower_bound(palette.begin(), palette.end(), encoded_number(vertex)) - palette.begin();
            };
            say("<object id=\"1\" type=\"model\" name=\"surface\"");
            say(has_colors() ? " pid=\"2\" pindex=\"0\">\n" : ">\n");
            say("<mesh>\n<vertices>\n");
            in_pieces(mesh_.vertices.size(), [&](std::string& text, std::size_t n) {
                text.append("<vertex x=\"").append(number(world(n, 0)));
                text.append("\" y=\"").append(number(world(n, 1)));
                text.append("\" z=\"").append(number(world(n, 2))).append("\"/>\n");
            });
            say("</vertices>\n<triangles>\n");
            in_pieces(triangles(), [&](std::string& text, std::size_t n) {
                const auto t = triangle(n);
                text.append("<triangle v1=\"").append(std::to_string(t[0]));
                text.append("\" v2=\"").append(std::to_string(t[1]));
                text.append("\" v3=\"").append(std::to_string(t[2]));
                if (has_colors()) {
                    text.append("\" pid=\"2\" p1=\"").append(std::to_string(color_of(t[0])));
                    text.append("\" p2=\"").append(std::to_string(color_of(t[1])));
                    text.append("\" p3=\"").append(std::to_string(color_of(t[2])));
                }
                text.append("\"/>\n");
            });
            say("</triangles>\n</mesh>\n</object>\n");
        });
    }

    // An array of `columns` values a row; value(row, column) has the type that the file holds.
    template <class Value>
    void add_array(zip_archive& archive, const std::string& name, scalar type, std::size_t rows, std::size_t columns,
                   const Value& value) {
        archive.add(name + ".npy", [&](const entry_sink& add) {
            const std::string shape = columns == 1 ? "(" + std::to_string(rows) + ",)"
                                                   : "(" + std::to_string(rows) + ", " + std::to_string(columns) + ")";
            std::string text = npy_header(type, shape);
            for (std::size_t r = 0; r < rows; ++r) {
                for (std::size_t c = 0; c < columns; ++c) put(text, value(r, c));
                if (text.size() < (std::size_t{1} << 20)) continue;
                add(std::as_bytes(std::span{text}));
                text.clear();
            }
            add(std::as_bytes(std::span{text}));
            meter_.advance(rows / 4);
        });
    }
    void write_npz(output_file& out) {
        zip_archive archive(out, options_.compression);
        const auto& v = mesh_.vertices;
        add_array(archive, "vertices", scalar::f64, v.size(), 3,
                  [&](std::size_t r, std::size_t c) { return world(r, c); });
        add_array(archive, has_quads() ? "quads" : "triangles", scalar::u32, faces(), corners(),
                  [&](std::size_t r, std::size_t c) { return face(r)[c]; });
        add_array(archive, "cell", scalar::i32, v.size(), 3, [&](std::size_t r, std::size_t c) {
            return static_cast<std::int32_t>(v[r].cell[static_cast<glm::length_t>(c)]);
        });
        add_array(archive, "sheet", scalar::u8, v.size(), 1,
                  [&](std::size_t r, std::size_t) { return static_cast<std::uint8_t>(v[r].sheet); });
        add_array(archive, "source", scalar::i64, mesh_.sources.size(), 1, [&](std::size_t r, std::size_t) {
            return mesh_.sources[r] == UINT32_MAX ? std::int64_t{-1} : std::int64_t{mesh_.sources[r]};
        });
        add_array(archive, "normal", scalar::f32, v.size(), 3,
                  [&](std::size_t r, std::size_t c) { return mesh_.normals[r][static_cast<glm::length_t>(c)]; });
        if (has_colors())
            add_array(archive, "color", scalar::u8, v.size(), 3,
                      [&](std::size_t r, std::size_t c) { return encoded(r)[c]; });
        archive.finish();
    }

    const std::filesystem::path& path_;
    const write_options& options_;
    progress_meter meter_;
};

} // namespace

bool writes_surface(const std::filesystem::path& path) {
    constexpr std::array<std::string_view, 6> all{".glb", ".ply", ".stl", ".obj", ".3mf", ".npz"};
    return std::find(all.begin(), all.end(), lower_extension(path)) != all.end();
}

std::vector<std::filesystem::path> write_surface(const surface_mesh& mesh, const std::filesystem::path& path,
                                                 const write_options& options) {
    return surface_writer(mesh, path, options).write();
}

} // namespace voxelize
