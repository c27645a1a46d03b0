// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "obj_file.hpp"

#include "model/finite.hpp"
#include "model/memory.hpp"
#include "read/assimp/pictures.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/resources.hpp"
#include "read/gltf/text.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

using assimp::obj_corner;
using assimp::obj_refusal;
using assimp::obj_statement;

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

// Faces to triangles, in order; polygons many at a time.
class face_cutter {
public:
    using taker = std::function<void(std::uint32_t run, const obj_corner& a, const obj_corner& b, const obj_corner& c)>;

    face_cutter(position_cache& positions, scratch_bytes& vertices, taker take)
        : positions_(positions), vertices_(vertices), take_(std::move(take)) {}

    // The face whose corners end the list.
    void add(std::uint32_t run, std::size_t num_corners) {
        constexpr std::size_t most_corners = 65536;
        faces_.push_back({run, static_cast<std::uint32_t>(num_corners)});
        if (corners.size() >= most_corners) cut();
    }
    void cut() {
        std::vector<glm::vec3> places;
        std::vector<std::uint32_t> sizes;
        std::size_t at = 0;
        for (const face& f : faces_) {
            if (f.num_corners > 3) {
                sizes.push_back(f.num_corners);
                for (std::size_t i = 0; i < f.num_corners; ++i)
                    places.push_back(positions_.at(corners[at + i].vertex, vertices_));
            }
            at += f.num_corners;
        }
        const std::vector<glm::uvec3> triangles = sizes.empty() ? std::vector<glm::uvec3>() : cut(places, sizes);
        std::size_t next = 0, place = 0;
        at = 0;
        for (const face& f : faces_) {
            const obj_corner* const own = corners.data() + at;
            at += f.num_corners;
            if (f.num_corners == 3) {
                take_(f.run, own[0], own[1], own[2]);
                continue;
            }
            for (; next < triangles.size() && triangles[next].x - place < f.num_corners; ++next) {
                glm::uvec3 t = triangles[next] - static_cast<std::uint32_t>(place);
                if (t.y >= f.num_corners || t.z >= f.num_corners) fail();
                take_(f.run, own[t.x], own[t.y], own[t.z]);
            }
            place += f.num_corners;
        }
        if (next != triangles.size()) fail();
        faces_.clear();
        corners.clear();
    }

    std::vector<obj_corner> corners; // of the faces that wait

private:
    struct face {
        std::uint32_t run, num_corners;
    };

    static std::vector<glm::uvec3> cut(const std::vector<glm::vec3>& places, const std::vector<std::uint32_t>& sizes) {
        try {
            return assimp::cut_polygons(places, sizes);
        } catch (const model_error& error) {
            throw obj_refusal(std::string("polygons before it cannot be cut: ") + error.what());
        }
    }
    [[noreturn]] static void fail() { throw model_error("assimp cut polygons into triangles of others"); }

    position_cache& positions_;
    scratch_bytes& vertices_;
    taker take_;
    std::vector<face> faces_;
};

// Faces and their corners, also of a file that is not streamed, as far as its lines can be read.
struct face_counts {
    std::uint64_t faces = 0, corners = 0;

    // Bytes that a run takes which holds the model, with the process that reads it: 353 a triangle and 430 a
    // quadrilateral were measured with assimp 5.2.5. More than half of it is assimp's.
    [[nodiscard]] double likely_bytes() const { return bytes(128, 80); }
    [[nodiscard]] double least_bytes() const { return bytes(96, 64); }

private:
    [[nodiscard]] double bytes(double face, double corner) const {
        return face * static_cast<double>(faces) + corner * static_cast<double>(corners);
    }
};

face_counts count_faces(const std::filesystem::path& path) {
    face_counts count;
    try {
        assimp::for_each_obj_line(path, [&count](std::string_view line) {
            if (!line.starts_with("f ") && !line.starts_with("f\t")) return;
            ++count.faces;
            for (std::size_t i = 1; i < line.size(); ++i) count.corners += line[i] > ' ' && line[i - 1] <= ' ' ? 1 : 0;
        });
    } catch (const obj_refusal&) { // found again by whoever reads more than that
    }
    return count;
}

} // namespace

obj_file::obj_file(const std::filesystem::path& path, std::uint64_t room, const std::filesystem::path& folder,
                   const gltf_limits& limits, const gltf_options& options)
    : path_(path), limits_(limits), options_(options), vertices_(folder), texcoords_(folder), triangles_(folder) {
    assimp::obj_outline outline;
    const bool has_colors = read_vertices(outline);
    read_outline(outline);
    make_caches(room, has_colors);
    read_faces();
    number_parts();
}

bool obj_file::read_vertices(assimp::obj_outline& outline) {
    bool is_within_run = false, has_colors = false;
    assimp::for_each_obj_line(path_, [&](std::string_view line) {
        const obj_statement statement = assimp::statement_of(line);
        switch (statement) {
        case obj_statement::vertex: {
            const assimp::obj_vertex v = assimp::vertex_of(line);
            if (counts_.vertices == 0) has_colors = v.has_color;
            if (has_colors != v.has_color) throw obj_refusal("some vertices have colours, and some have none");
            vertices_.append(bytes_of(v.position));
            if (!is_finite(v.position)) ++num_not_finite_;
            if (has_colors && options_.colors) vertices_.append(bytes_of(v.color));
            break;
        }
        case obj_statement::face:
            if (!std::exchange(is_within_run, true)) outline.add_run();
            break;
        case obj_statement::structure:
            is_within_run = false;
            outline.add_structure(line);
            break;
        case obj_statement::texcoord:
        case obj_statement::normal:
        case obj_statement::nothing:
            break;
        }
        counts_.add(statement);
        if (std::max(counts_.vertices, counts_.texcoords) > std::uint64_t{std::numeric_limits<std::int32_t>::max()})
            throw obj_refusal("there are more vertices than indices can name");
    });
    runs_.resize(outline.num_runs());
    if (runs_.empty()) throw obj_refusal("vertices without faces are points, which are not streamed");
    return has_colors;
}

void obj_file::read_outline(const assimp::obj_outline& outline) {
    assimp::obj_outline::parts found = outline.read(path_);
    assimp::name_files(found.source, options_);
    materials_ = std::move(found.source.materials);
    warnings_ = std::move(found.source.warnings);
    named_.textures = std::move(found.source.textures);
    asks_for_texture_.resize(materials_.size());
    for (const instance& one : found.source.instances) {
        const primitive& part = found.source.primitives[one.primitive];
        if (found.runs[one.primitive].empty()) continue;
        asks_for_texture_[part.material] =
            assimp::asks_for_texture(materials_[part.material], named_.textures[part.material], options_);
        parts_.push_back({part.name, one.to_world, part.material, 0, 0});
        runs_of_.push_back(found.runs[one.primitive]);
    }
}

void obj_file::make_caches(std::uint64_t room, bool has_colors) {
    const bool keeps_colors = has_colors && options_.colors;
    const bool keeps_texcoords =
        std::find(asks_for_texture_.begin(), asks_for_texture_.end(), true) != asks_for_texture_.end();
    room /= 1 + (keeps_colors ? 1 : 0) + (keeps_texcoords ? 1 : 0);
    position_layout layout;
    layout.count = counts_.vertices;
    layout.stride = keeps_colors ? 2 * sizeof(glm::vec3) : sizeof(glm::vec3);
    for (std::size_t a = 0; a < 3; ++a) layout.place[a] = a * sizeof(float);
    positions_.emplace(layout, room);
    if (keeps_colors) {
        color_layout of_colors;
        of_colors.count = counts_.vertices;
        of_colors.stride = layout.stride;
        of_colors.is_encoded = true;
        for (std::size_t c = 0; c < 3; ++c) of_colors.place[c] = sizeof(glm::vec3) + c * sizeof(float);
        colors_.emplace(of_colors, room);
    }
    if (keeps_texcoords) {
        texcoord_layout of_texcoords;
        of_texcoords.count = counts_.texcoords;
        of_texcoords.stride = sizeof(glm::vec2);
        texcoord_cache_.emplace(of_texcoords, room);
    }
}

void obj_file::read_faces() {
    assimp::obj_counts before;
    std::uint64_t num_triangles = 0;
    const bool are_finite = std::exchange(num_not_finite_, 0) == 0;
    std::uint32_t num_runs = 0;
    bool is_within_run = false;
    face_cutter faces(*positions_, vertices_, [&](std::uint32_t number, const auto& a, const auto& b, const auto& c) {
        run& of_face = runs_[number];
        if (of_face.num_triangles++ == 0) of_face.first = num_triangles;
        ++num_triangles;
        triangles_.append(bytes_of(glm::uvec3(a.vertex, b.vertex, c.vertex)));
        if (texcoord_cache_) triangles_.append(bytes_of(glm::uvec3(a.texcoord, b.texcoord, c.texcoord)));
    });
    assimp::for_each_obj_line(path_, [&](std::string_view line) {
        const obj_statement statement = assimp::statement_of(line);
        switch (statement) {
        case obj_statement::texcoord:
            if (texcoord_cache_) texcoords_.append(bytes_of(assimp::texcoord_of(line)));
            break;
        case obj_statement::face: {
            if (!std::exchange(is_within_run, true)) ++num_runs;
            if (before.vertices > counts_.vertices || before.texcoords > counts_.texcoords || num_runs > runs_.size())
                throw model_error("the file changes while it is read");
            const std::size_t first = faces.corners.size();
            assimp::add_face(line, before, faces.corners);
            std::uint32_t& texcoords_end = runs_[num_runs - 1].texcoords_end;
            for (std::size_t i = first; i < faces.corners.size(); ++i) {
                const obj_corner& corner = faces.corners[i];
                if (corner.vertex >= counts_.vertices) throw model_error("an index is out of range");
                if (!are_finite && !is_finite(positions_->at(corner.vertex, vertices_))) ++num_not_finite_;
                if (corner.texcoord != obj_corner::none) texcoords_end = std::max(texcoords_end, corner.texcoord + 1);
            }
            num_corners_ += faces.corners.size() - first;
            ++num_faces_;
            faces.add(num_runs - 1, faces.corners.size() - first);
            break;
        }
        case obj_statement::structure:
            is_within_run = false;
            break;
        case obj_statement::vertex:
        case obj_statement::normal:
        case obj_statement::nothing:
            break;
        }
        before.add(statement);
    });
    faces.cut();
}

double obj_file::held_bytes() const { return face_counts{num_faces_, num_corners_}.likely_bytes(); }

void obj_file::number_parts() {
    std::uint64_t first = 0;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        parts_[p].first_number = first;
        // As assimp has it: one index out of range, and none of the part's faces has texture coordinates.
        std::uint32_t texcoords_end = 0;
        for (const std::uint32_t r : runs_of_[p]) {
            parts_[p].num_triangles += runs_[r].num_triangles;
            texcoords_end = std::max(texcoords_end, runs_[r].texcoords_end);
        }
        parts_[p].has_texcoords =
            asks_for_texture_[parts_[p].material] && texcoords_end != 0 && texcoords_end <= counts_.texcoords;
        first += parts_[p].num_triangles;
        // Its vertices would be points.
        if (parts_[p].num_triangles == 0)
            throw obj_refusal("no polygon of " + gltf::in_quotes(parts_[p].name) + " has an area");
    }
}

void obj_file::read_part(std::size_t part, const visitor& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    const std::uint64_t triangle_bytes = (texcoord_cache_ ? 2 : 1) * sizeof(glm::uvec3);
    std::vector<glm::uvec3> indices; // of a triangle's vertices, and then of its texture coordinates
    std::vector<glm::vec3> corners;
    std::vector<glm::vec4> colors;
    std::vector<glm::vec2> texcoords;
    std::uint64_t number = parts_[part].first_number;
    for (const std::uint32_t r : runs_of_[part])
        for (std::uint64_t done = 0; done < runs_[r].num_triangles;) {
            const std::uint64_t count = std::min(block, runs_[r].num_triangles - done);
            indices.resize(static_cast<std::size_t>(count * triangle_bytes / sizeof(glm::uvec3)));
            triangles_.read((runs_[r].first + done) * triangle_bytes,
                            {reinterpret_cast<char*>(indices.data()), indices.size() * sizeof(glm::uvec3)});
            corners.clear();
            colors.clear();
            texcoords.clear();
            for (std::size_t i = 0; i < indices.size(); ++i) {
                const bool is_of_texcoords = texcoord_cache_ && i % 2 == 1;
                for (const std::uint32_t v : {indices[i].x, indices[i].y, indices[i].z}) {
                    if (is_of_texcoords) {
                        if (parts_[part].has_texcoords)
                            texcoords.push_back(v == obj_corner::none ? assimp::no_texcoord_value
                                                                      : texcoord_cache_->at(v, texcoords_));
                        continue;
                    }
                    corners.push_back(positions_->at(v, vertices_));
                    if (colors_) colors.push_back(colors_->at(v, vertices_));
                }
            }
            visit({part, number, corners, colors, texcoords});
            done += count;
            number += count;
        }
}

void obj_file::read_textures(const picture_hook& take) {
    gltf::budget memory{limits_};
    scene shown;
    shown.materials = materials_;
    assimp::load_pictures(named_, asks_for_texture_, gltf::folder_reader(path_.parent_path()), memory, shown,
                          {{}, take});
    materials_ = std::move(shown.materials);
    textures_ = std::move(shown.textures);
    images_ = std::move(shown.images);
    warnings_.insert(warnings_.end(), shown.warnings.begin(), shown.warnings.end());
    for (part& one : parts_)
        one.has_texcoords = one.has_texcoords && materials_[one.material].texture != material::no_texture;
}

opened_stream open_obj(const std::filesystem::path& path, const stream_room& room, const std::filesystem::path& folder,
                       const gltf_limits& limits, const gltf_options& options) {
    // A triangle takes eight bytes of text at least; a polygon more for the same need. What fits so is not read.
    constexpr double most_by_byte = 46;
    std::error_code error;
    if (options.animation || !std::filesystem::is_regular_file(path, error)) return {};
    const auto bytes = static_cast<double>(std::filesystem::file_size(path, error));
    if (error || most_by_byte * bytes <= room.loaded) return {};
    const face_counts count = count_faces(path);
    if (count.likely_bytes() <= room.loaded) return {};
    opened_stream opened;
    try {
        opened.stream = std::make_unique<obj_file>(path, room.stream, folder, limits, options);
    } catch (const obj_refusal& refusal) {
        opened.refusal = std::string("it cannot be streamed: ") + refusal.what();
        opened.need = count.likely_bytes();
        memory::require(count.least_bytes(), "the model", opened.refusal, opened.need);
    }
    return opened;
}

} // namespace voxelize
