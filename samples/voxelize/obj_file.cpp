// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "obj_file.hpp"

#include "assimp/obj_outline.hpp"
#include "assimp/obj_text.hpp"
#include "gltf/text.hpp"
#include "memory.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

using assimp::obj_refusal;
using assimp::obj_statement;

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

// Faces to triangles, in order; polygons many at a time.
class face_cutter {
public:
    using taker = std::function<void(std::uint32_t run, const glm::uvec3& vertices)>;

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
                    places.push_back(positions_.at(corners[at + i], vertices_));
            }
            at += f.num_corners;
        }
        const std::vector<glm::uvec3> triangles = sizes.empty() ? std::vector<glm::uvec3>() : cut(places, sizes);
        std::size_t next = 0, place = 0;
        at = 0;
        for (const face& f : faces_) {
            const std::uint32_t* const own = corners.data() + at;
            at += f.num_corners;
            if (f.num_corners == 3) {
                take_(f.run, {own[0], own[1], own[2]});
                continue;
            }
            for (; next < triangles.size() && triangles[next].x - place < f.num_corners; ++next) {
                glm::uvec3 t = triangles[next] - static_cast<std::uint32_t>(place);
                if (t.y >= f.num_corners || t.z >= f.num_corners) fail();
                take_(f.run, {own[t.x], own[t.y], own[t.z]});
            }
            place += f.num_corners;
        }
        if (next != triangles.size()) fail();
        faces_.clear();
        corners.clear();
    }

    std::vector<std::uint32_t> corners; // of the faces that wait

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
                   const gltf_options& options)
    : vertices_(folder), triangles_(folder) {
    read_vertices(path, room, options);
    read_faces(path);
    number_parts();
}

void obj_file::read_vertices(const std::filesystem::path& path, std::uint64_t room, const gltf_options& options) {
    assimp::obj_outline outline;
    bool is_within_run = false, has_colors = false;
    assimp::for_each_obj_line(path, [&](std::string_view line) {
        switch (assimp::statement_of(line)) {
        case obj_statement::vertex: {
            const assimp::obj_vertex v = assimp::vertex_of(line);
            if (num_vertices_ == 0) has_colors = v.has_color;
            if (has_colors != v.has_color) throw obj_refusal("some vertices have colours, and some have none");
            if (++num_vertices_ > static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()))
                throw obj_refusal("there are more vertices than indices can name");
            vertices_.append(bytes_of(v.position));
            if (has_colors && options.colors) vertices_.append(bytes_of(v.color));
            break;
        }
        case obj_statement::face:
            if (!std::exchange(is_within_run, true)) outline.add_run();
            break;
        case obj_statement::structure:
            is_within_run = false;
            outline.add_structure(line);
            break;
        case obj_statement::nothing:
            break;
        }
    });
    const bool keeps_colors = has_colors && options.colors;
    position_layout layout;
    layout.count = num_vertices_;
    layout.stride = keeps_colors ? 2 * sizeof(glm::vec3) : sizeof(glm::vec3);
    for (std::size_t a = 0; a < 3; ++a) layout.place[a] = a * sizeof(float);
    positions_.emplace(layout, keeps_colors ? room / 2 : room);
    if (keeps_colors) {
        color_layout of_colors;
        of_colors.count = num_vertices_;
        of_colors.stride = layout.stride;
        of_colors.is_encoded = true;
        for (std::size_t c = 0; c < 3; ++c) of_colors.place[c] = sizeof(glm::vec3) + c * sizeof(float);
        colors_.emplace(of_colors, room / 2);
    }
    runs_.resize(outline.num_runs());
    if (runs_.empty()) throw obj_refusal("vertices without faces are points, which are not streamed");

    assimp::obj_outline::parts found = outline.read(path);
    materials_ = std::move(found.source.materials);
    warnings_ = std::move(found.source.warnings);
    for (const instance& one : found.source.instances) {
        const primitive& part = found.source.primitives[one.primitive];
        if (found.runs[one.primitive].empty()) continue;
        const assimp::texture_source& texture = found.source.textures[part.material];
        const bool shows_it =
            options.colors || (options.blend_cuts && materials_[part.material].alpha == alpha_mode::blend);
        if (texture.is_there() && shows_it)
            throw obj_refusal("textures are not streamed, and colours of " + gltf::in_quotes(texture.path) +
                              " are asked for");
        parts_.push_back({part.name, one.to_world, part.material, 0, 0});
        runs_of_.push_back(found.runs[one.primitive]);
    }
}

void obj_file::read_faces(const std::filesystem::path& path) {
    std::uint64_t before = 0, num_triangles = 0;
    std::uint32_t num_runs = 0;
    bool is_within_run = false;
    face_cutter faces(*positions_, vertices_, [&](std::uint32_t number, const glm::uvec3& vertices) {
        run& of_face = runs_[number];
        if (of_face.num_triangles++ == 0) of_face.first = num_triangles;
        ++num_triangles;
        triangles_.append(bytes_of(vertices));
    });
    assimp::for_each_obj_line(path, [&](std::string_view line) {
        switch (assimp::statement_of(line)) {
        case obj_statement::vertex:
            ++before;
            break;
        case obj_statement::face: {
            if (!std::exchange(is_within_run, true)) ++num_runs;
            if (before > num_vertices_ || num_runs > runs_.size())
                throw model_error("the file changes while it is read");
            const std::size_t first = faces.corners.size();
            assimp::add_face(line, before, faces.corners);
            for (std::size_t i = first; i < faces.corners.size(); ++i)
                if (faces.corners[i] >= num_vertices_) throw model_error("an index is out of range");
            num_corners_ += faces.corners.size() - first;
            ++num_faces_;
            faces.add(num_runs - 1, faces.corners.size() - first);
            break;
        }
        case obj_statement::structure:
            is_within_run = false;
            break;
        case obj_statement::nothing:
            break;
        }
    });
    faces.cut();
}

double obj_file::held_bytes() const { return face_counts{num_faces_, num_corners_}.likely_bytes(); }

void obj_file::number_parts() {
    std::uint64_t first = 0;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        parts_[p].first_number = first;
        for (const std::uint32_t r : runs_of_[p]) parts_[p].num_triangles += runs_[r].num_triangles;
        first += parts_[p].num_triangles;
        // Its vertices would be points.
        if (parts_[p].num_triangles == 0)
            throw obj_refusal("no polygon of " + gltf::in_quotes(parts_[p].name) + " has an area");
    }
}

void obj_file::read_part(std::size_t part, const visitor& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    std::vector<glm::uvec3> indices;
    std::vector<glm::vec3> corners;
    std::vector<glm::vec4> colors;
    std::uint64_t number = parts_[part].first_number;
    for (const std::uint32_t r : runs_of_[part])
        for (std::uint64_t done = 0; done < runs_[r].num_triangles;) {
            indices.resize(static_cast<std::size_t>(std::min(block, runs_[r].num_triangles - done)));
            triangles_.read((runs_[r].first + done) * sizeof(glm::uvec3),
                            {reinterpret_cast<char*>(indices.data()), indices.size() * sizeof(glm::uvec3)});
            corners.clear();
            colors.clear();
            for (const glm::uvec3& t : indices)
                for (const std::uint32_t v : {t.x, t.y, t.z}) {
                    corners.push_back(positions_->at(v, vertices_));
                    if (colors_) colors.push_back(colors_->at(v, vertices_));
                }
            visit({part, number, corners, colors});
            done += indices.size();
            number += indices.size();
        }
}

opened_stream open_obj(const std::filesystem::path& path, std::uint64_t room, const std::filesystem::path& folder,
                       const gltf_options& options) {
    // A triangle takes eight bytes of text at least; a polygon more for the same need. What fits so is not read.
    constexpr double most_by_byte = 46;
    const auto room_now = [] { return static_cast<double>(memory::room()); };
    std::error_code error;
    if (options.animation || !std::filesystem::is_regular_file(path, error)) return {};
    const auto bytes = static_cast<double>(std::filesystem::file_size(path, error));
    if (error || most_by_byte * bytes <= room_now()) return {};
    const face_counts count = count_faces(path);
    if (count.likely_bytes() <= room_now()) return {};
    opened_stream opened;
    try {
        opened.stream = std::make_unique<obj_file>(path, room, folder, options);
    } catch (const obj_refusal& refusal) {
        opened.refusal = std::string("it cannot be streamed: ") + refusal.what();
        opened.need = count.likely_bytes();
        memory::require(count.least_bytes(), "the model", opened.refusal, opened.need);
    }
    return opened;
}

} // namespace voxelize
