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
#include <utility>

namespace voxelize {
namespace {

using index_list = std::array<std::uint32_t, 4>; // of a face; its last is not used by triangles

class surface_writer {
public:
    surface_writer(const surface_mesh& mesh, const std::filesystem::path& path, const write_options& options)
        : mesh_(mesh), path_(path), options_(options), meter_(options.progress, mesh.vertices.size() + faces()) {}

    std::vector<std::filesystem::path> write() {
        output_file out(path_);
        const std::string extension = lower_extension(path_);
        if (extension == ".ply") write_ply(out);
        if (extension == ".obj") write_obj(out);
        if (extension == ".glb") write_glb(out);
        if (extension == ".stl") write_stl(out);
        if (extension == ".3mf") write_3mf(out);
        if (extension == ".npz") write_npz(out);
        out.commit();
        return {path_};
    }

private:
    [[nodiscard]] std::size_t faces() const { return mesh_.num_faces(); }
    [[nodiscard]] bool has_quads() const { return !mesh_.quads.empty(); }
    [[nodiscard]] std::size_t corners() const { return has_quads() ? 4 : 3; }
    [[nodiscard]] index_list face(std::size_t n) const {
        if (has_quads()) {
            const glm::uvec4& q = mesh_.quads[n];
            return {q.x, q.y, q.z, q.w};
        }
        const glm::uvec3& t = mesh_.triangles[n];
        return {t.x, t.y, t.z, t.z};
    }
    // Triangles of all faces: a quad is cut from its first corner.
    [[nodiscard]] std::size_t triangles() const { return has_quads() ? 2 * faces() : faces(); }
    [[nodiscard]] std::array<std::uint32_t, 3> triangle(std::size_t n) const {
        if (!has_quads()) {
            const index_list f = face(n);
            return {f[0], f[1], f[2]};
        }
        const index_list f = face(n / 2);
        return {f[0], f[1 + n % 2], f[2 + n % 2]};
    }

    // Place of a vertex along an axis, in voxels from the grid's low corner.
    [[nodiscard]] static double place(const voxelpipe::surface_vertex& v, std::size_t axis, std::uint32_t q) {
        return v.cell[static_cast<glm::length_t>(axis)] + 0.5 + q / 65536.0;
    }
    [[nodiscard]] double world(std::size_t vertex, std::size_t axis) const {
        const voxelpipe::surface_vertex& v = mesh_.vertices[vertex];
        return std::fma(place(v, axis, v.q[axis]), mesh_.voxel_size[axis], mesh_.origin[axis]);
    }
    // Bits of a place in its cell that floats of the grid tell apart.
    [[nodiscard]] int float_bits() const {
        int log2 = 0;
        while ((1 << log2) < *std::max_element(mesh_.extent.begin(), mesh_.extent.end()) + 1) ++log2;
        return std::clamp(22 - log2, 1, 16);
    }
    // The same in that many bits, still within the cell.
    [[nodiscard]] double rounded(std::size_t vertex, std::size_t axis, int bits) const {
        const voxelpipe::surface_vertex& v = mesh_.vertices[vertex];
        const std::uint32_t step = 1U << (16 - bits), half = bits == 16 ? 0 : step / 2;
        const std::uint32_t q = std::clamp((v.q[axis] + half) / step * step, step, 65536U - step);
        return place(v, axis, q);
    }

    void write_ply(output_file& out) {
        out.write("ply\nformat binary_little_endian 1.0\ncomment made by voxelize\nelement vertex " +
                  std::to_string(mesh_.vertices.size()) +
                  "\nproperty double x\nproperty double y\nproperty double z\nelement face " + std::to_string(faces()) +
                  "\nproperty list uchar uint vertex_indices\nend_header\n");
        write_items(out, mesh_.vertices.size(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            for (std::size_t a = 0; a < 3; ++a) put(text, world(n, a));
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
            text += '\n';
        });
        write_items(out, faces(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            text += 'f';
            const index_list f = face(n);
            for (std::size_t i = 0; i < corners(); ++i)
                text.append(1, ' ').append(std::to_string(std::uint64_t{f[i]} + 1));
            text += '\n';
        });
    }

    void write_glb(output_file& out) {
        const std::uint64_t positions = 12 * std::uint64_t{mesh_.vertices.size()},
                            indices = 12 * std::uint64_t{triangles()}, total = positions + indices;
        if (total > std::numeric_limits<std::uint32_t>::max() - 4096)
            throw write_error(path_, "a .glb holds at most 4 GiB; .ply and .npz hold more");
        std::string json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{}]})";
        const int bits = float_bits();
        const auto coordinate = [&](std::size_t n, std::size_t a) {
            return static_cast<float>(rounded(n, a, bits) * mesh_.voxel_size[a]);
        };
        if (faces() != 0) {
            std::array<float, 3> low{}, high{};
            for (std::size_t a = 0; a < 3; ++a) low[a] = high[a] = coordinate(0, a);
            for (std::size_t n = 1; n < mesh_.vertices.size(); ++n)
                for (std::size_t a = 0; a < 3; ++a) {
                    low[a] = std::min(low[a], coordinate(n, a));
                    high[a] = std::max(high[a], coordinate(n, a));
                }
            const auto list = [](const auto& values) {
                return "[" + number(static_cast<double>(values[0])) + "," + number(static_cast<double>(values[1])) +
                       "," + number(static_cast<double>(values[2])) + "]";
            };
            json = R"({"asset":{"version":"2.0","generator":"voxelize"},"scene":0,"scenes":[{"nodes":[0]}],)"
                   R"("nodes":[{"name":"surface","mesh":0,"translation":)" +
                   list(mesh_.origin) +
                   R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
                   R"("materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":1}}],"accessors":[)"
                   R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
                   std::to_string(mesh_.vertices.size()) + R"(,"min":)" + list(low) + R"(,"max":)" + list(high) +
                   R"(},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" +
                   std::to_string(3 * triangles()) + R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" +
                   std::to_string(positions) + R"(,"target":34962},{"buffer":0,"byteOffset":)" +
                   std::to_string(positions) + R"(,"byteLength":)" + std::to_string(indices) +
                   R"(,"target":34963}],"buffers":[{"byteLength":)" + std::to_string(total) + "}]}";
        }
        json.append((4 - json.size() % 4) % 4, ' ');
        out.write("glTF");
        out.write_value<std::uint32_t>(2);
        out.write_value(static_cast<std::uint32_t>(20 + json.size() + (faces() != 0 ? 8 + total : 0)));
        out.write_value(static_cast<std::uint32_t>(json.size()));
        out.write("JSON");
        out.write(json);
        if (faces() == 0) return; // glTF has no empty accessors
        out.write_value(static_cast<std::uint32_t>(total));
        out.write(std::string_view("BIN\0", 4));
        write_items(out, mesh_.vertices.size(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            for (std::size_t a = 0; a < 3; ++a) put(text, coordinate(n, a));
        });
        write_items(out, triangles(), options_.threads, meter_, [&](std::string& text, std::size_t n) {
            for (const std::uint32_t index : triangle(n)) put(text, index);
        });
    }

    // Ways of vertices that share their place with another one of their cell, towards the mean of their faces'
    // vertices.
    [[nodiscard]] std::vector<std::array<double, 3>> insets() const {
        const auto& v = mesh_.vertices;
        const auto is_shared = [&](std::size_t n) {
            const auto same = [&](std::size_t other) {
                return v[other].cell == v[n].cell && std::equal(v[n].q, v[n].q + 3, v[other].q);
            };
            for (std::size_t other = n; other-- > 0 && v[other].cell == v[n].cell;)
                if (same(other)) return true;
            for (std::size_t other = n + 1; other < v.size() && v[other].cell == v[n].cell; ++other)
                if (same(other)) return true;
            return false;
        };
        std::vector<char> shared(v.size());
        for (std::size_t n = 0; n < v.size(); ++n) shared[n] = is_shared(n) ? 1 : 0;
        std::vector<std::array<double, 3>> ways(v.size());
        std::vector<std::uint32_t> counts(v.size());
        for (std::size_t f = 0; f < faces(); ++f) {
            const index_list all = face(f);
            for (std::size_t i = 0; i < corners(); ++i) {
                const std::uint32_t n = all[i];
                if (shared[n] == 0) continue;
                for (std::size_t k = 0; k < corners(); ++k)
                    for (std::size_t a = 0; a < 3; ++a)
                        ways[n][a] += place(v[all[k]], a, v[all[k]].q[a]) - place(v[n], a, v[n].q[a]);
                counts[n] += static_cast<std::uint32_t>(corners());
            }
        }
        for (std::size_t n = 0; n < v.size(); ++n)
            for (double& way : ways[n]) way = counts[n] != 0 ? way / counts[n] / 64 : 0;
        return ways;
    }

    void write_stl(output_file& out) {
        if (triangles() > max_stl_triangles)
            throw write_error(path_, "a .stl counts its triangles with 32 bits; .ply and .npz hold more");
        const int bits = float_bits();
        const std::vector<std::array<double, 3>> ways = insets();
        const auto coordinate = [&](std::size_t n, std::size_t a) {
            return std::fma(rounded(n, a, bits) + ways[n][a], mesh_.voxel_size[a], mesh_.origin[a]);
        };
        if (options_.warn) {
            std::vector<std::array<float, 3>> floats(mesh_.vertices.size());
            for (std::size_t n = 0; n < floats.size(); ++n)
                for (std::size_t a = 0; a < 3; ++a) floats[n][a] = static_cast<float>(coordinate(n, a));
            std::sort(floats.begin(), floats.end());
            if (std::adjacent_find(floats.begin(), floats.end()) != floats.end())
                options_.warn(path_.string() + ": the floats of .stl merge vertices of this mesh, which is far from 0 "
                                               "for its voxel size; .glb, .ply and .obj keep them apart");
        }
        write_stl_triangles(out, triangles(), options_.threads, meter_, [&](std::size_t n) {
            stl_triangle t{};
            const auto index = triangle(n);
            for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t a = 0; a < 3; ++a) t[c][a] = coordinate(index[c], a);
            return t;
        });
    }

    void write_3mf(output_file& out) {
        constexpr std::uint64_t most_of_line = 128;
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
            say("<object id=\"1\" type=\"model\" name=\"surface\">\n<mesh>\n<vertices>\n");
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
                text.append("\" v3=\"").append(std::to_string(t[2])).append("\"/>\n");
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
        archive.finish();
    }

    const surface_mesh& mesh_;
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
