// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a reader of one format of plain meshes (OBJ, STL, PLY, OFF) gives, in the order of its file: mesh_scene.hpp
// makes a scene of it, mesh_stream.hpp a stream of triangles. A format is read by one reader for both.
//
// Each reader has a function that opens a file: `std::unique_ptr<mesh_reader> open_NAME(path, limits, options)`. It
// throws model_error where the file cannot be read. Messages say the line or byte, the thing and what was expected.

#include "model/scene.hpp"
#include "model/texture_transform.hpp"
#include "read/assimp/wire.hpp"
#include "read/gltf_scene.hpp"
#include "read/vertex_cache.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

// A surface whose file gives it no colour is white, whatever the format: the base colour of a material{}.
inline constexpr glm::vec4 default_color{1.0F};

// The kept texture coordinates run downwards, those of the formats upwards.
inline constexpr texture_transform upside_down{1, 0, 0, 0, -1, 1};

// Triangles, lines and points of one name and one material.
struct mesh_part {
    std::string name;
    std::uint32_t material = 0; // of mesh_description::materials
};

// What holds of the whole file.
struct mesh_description {
    std::vector<mesh_part> parts;
    std::vector<material> materials;              // at least one where there is a part; their textures are not set
    std::vector<assimp::texture_source> textures; // of each material; paths are relative to the model's folder
    bool is_double = false;                       // positions may have more digits than a float
    bool has_vertex_colors = false;               // mesh_vertex::color counts
    bool has_vertex_texcoords = false;            // mesh_vertex::texcoord counts
    bool has_face_colors = false;                 // mesh_face::color counts
    bool has_corner_texcoords = false;            // mesh_corner::texcoord counts; not both
    std::vector<std::string> warnings;            // one line each
    std::vector<std::string> files;               // that were read beside the model's own, relative to its folder
};

struct mesh_vertex {
    glm::dvec3 position{0.0};
    glm::vec4 color = default_color; // linear light and alpha
    glm::vec2 texcoord{0.0F};        // as the file has it: v runs upwards
};

struct mesh_corner {
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    std::uint32_t vertex = 0;      // number of a vertex, in the order of mesh_sink::vertex(); less than their number
    std::uint32_t texcoord = none; // number of a texture coordinate, in the order of mesh_sink::texcoord()
};

// A polygon of three corners or more.
struct mesh_face {
    std::uint32_t part = 0;
    std::span<const mesh_corner> corners;    // empty where the face has positions of its own
    std::span<const glm::dvec3> positions{}; // of a face that shares no vertices (STL)
    std::optional<glm::vec4> color{};        // of the whole face, linear: it wins over those of its vertices
};

// Takes what a reader finds.
class mesh_sink {
public:
    mesh_sink() = default;
    mesh_sink(const mesh_sink&) = delete;
    mesh_sink& operator=(const mesh_sink&) = delete;
    virtual ~mesh_sink() = default;

    virtual void vertex(const mesh_vertex& v) = 0;
    virtual void texcoord(const glm::vec2& value) = 0; // v runs upwards
    virtual void face(const mesh_face& f) = 0;
    // A strip of lines through vertices; one vertex alone is a point.
    virtual void line(std::uint32_t part, std::span<const std::uint32_t> vertices) = 0;
};

class mesh_reader {
public:
    mesh_reader() = default;
    mesh_reader(const mesh_reader&) = delete;
    mesh_reader& operator=(const mesh_reader&) = delete;
    virtual ~mesh_reader() = default;

    // What it says of the positions and of what counts holds before read_vertices(); parts, materials, warnings and
    // files may come later, each part before the first face that names it.
    [[nodiscard]] const mesh_description& description() const { return description_; }
    // A guess at the numbers to come, never more than the file's bytes can hold; 0: none.
    [[nodiscard]] virtual std::uint64_t expected_vertices() const { return 0; }
    [[nodiscard]] virtual std::uint64_t expected_faces() const { return 0; }

    // Calls sink.vertex() and sink.texcoord(). Called once, first. Throws model_error.
    virtual void read_vertices(mesh_sink& sink) = 0;
    // Calls sink.face(), sink.line() and sink.texcoord(), the last for corners of faces to come. Throws model_error,
    // also where the file promises more than there is, unless it is read leniently: then that is a warning. The
    // vertices of a file without any face are points, each given by line(), and only those.
    virtual void read_faces(mesh_sink& sink) = 0;

    // Vertices that a stream reads where they lie in the file; none: it copies them into a temporary file.
    struct layouts {
        position_layout positions;
        std::optional<color_layout> colors;
        std::optional<texcoord_layout> texcoords;
    };
    [[nodiscard]] virtual std::optional<layouts> vertices_in_place() const { return std::nullopt; }
    // True if read_faces() can be called many times, is fast, gives one part alone and calls nothing but face(). A
    // stream copies faces into a temporary file otherwise.
    [[nodiscard]] virtual bool reads_faces_again() const { return false; }

protected:
    mesh_description description_;
};

} // namespace voxelize
