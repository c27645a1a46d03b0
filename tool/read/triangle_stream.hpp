// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model's triangles, read from its file block by block: for models that do not fit into memory.

#include "model/affine.hpp"
#include "model/placement.hpp"
#include "model/scene.hpp"
#include "model_file.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

class triangle_stream {
public:
    // Triangles with one transform and one material, numbered one after the other: an instance of a primitive in a
    // scene.
    struct part {
        std::string name;
        affine to_world;
        std::uint32_t material = 0;                        // of materials()
        std::uint64_t first_number = 0, num_triangles = 0; // at least one
        bool has_texcoords = false;                        // of its material's texture
    };
    // Triangles of one part.
    struct block {
        std::size_t part = 0;
        std::uint64_t first_number = 0;            // of the first triangle, among all of the stream
        std::span<const glm::vec3> corners;        // three a triangle, as the file has them
        std::span<const glm::vec4> colors;         // of the corners, linear; empty: white
        std::span<const glm::vec2> texcoords = {}; // of the corners, if the part has them
    };
    using visitor = std::function<void(const block&)>;

    triangle_stream() = default;
    triangle_stream(const triangle_stream&) = delete;
    triangle_stream& operator=(const triangle_stream&) = delete;
    virtual ~triangle_stream() = default;

    // In the order of the scene's instances.
    [[nodiscard]] const std::vector<part>& parts() const { return parts_; }
    [[nodiscard]] std::uint64_t num_triangles() const {
        return parts_.empty() ? 0 : parts_.back().first_number + parts_.back().num_triangles;
    }
    // Vertices of the file, once for each part that names them; three a triangle where it shares none.
    [[nodiscard]] virtual std::uint64_t num_vertices() const { return 3 * num_triangles(); }
    // Bytes that a run takes, at least, which holds the model.
    [[nodiscard]] virtual double held_bytes() const { return 300 * static_cast<double>(num_triangles()); }
    // Those of the scene. Without textures, until read_textures().
    [[nodiscard]] const std::vector<material>& materials() const { return materials_; }
    [[nodiscard]] const std::vector<texture>& textures() const { return textures_; }
    [[nodiscard]] const std::vector<picture>& images() const { return images_; }
    // True if a part has texture coordinates.
    [[nodiscard]] bool has_texcoords() const;
    // Reads the pictures that the materials show. Each is given to the hook before the next is read, as in
    // load_hooks::picture, with a scene of materials alone. Throws picture_memory_error and model_error.
    using picture_hook = std::function<void(const scene&, picture&, const std::vector<std::uint32_t>& materials)>;
    virtual void read_textures(const picture_hook&) {}
    // True if any vertex has a colour of its own.
    [[nodiscard]] virtual bool has_colors() const { return false; }
    // Messages about what was left out or put right, one line each; those of bounds() and read_textures() follow their
    // calls. They are the loader's, in its order.
    [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
    // Calls visit with the triangles of a part in order, some thousands at a time. Throws model_error where the file is
    // damaged.
    virtual void read_part(std::size_t part, const visitor& visit) = 0;
    // The same with those of all parts.
    void for_each_block(const visitor& visit);

    // Multiplies all lengths, about the world's origin. Throws model_error where a transform is not finite then.
    void scale_lengths(double factor);
    // The boxes around all finite corners: of each part in its own coordinates, and of all in the world.
    struct boxes {
        std::vector<bounding_box> own;
        bounding_box placed;
    };
    [[nodiscard]] boxes bounds();

protected:
    // The number of vertices that are not finite, as the loader counts them. Nothing: all corners are looked at.
    [[nodiscard]] virtual std::optional<std::uint64_t> count_not_finite() { return std::nullopt; }
    // One part, with the material that a scene has without any.
    void add_only_part(const std::filesystem::path& file, std::uint64_t num_triangles);

    std::vector<part> parts_;
    std::vector<material> materials_;
    std::vector<texture> textures_;
    std::vector<picture> images_;
    std::vector<std::string> warnings_;
};

// A model that may not fit into memory.
struct opened_stream {
    std::unique_ptr<triangle_stream> stream; // none: the model is to be loaded
    std::string refusal;                     // why a model that is not likely to fit is no stream, where that is known
    double need = 0;                         // bytes that it is likely to take when it is loaded, with a refusal
};

// Bytes that the model may take.
struct stream_room {
    std::uint64_t stream = 0; // read as a stream
    double loaded = 0;        // held as a whole, with all that a run takes for that
};

// The file as a stream, where it is of a kind that can be read so (mesh/mesh_formats.hpp, gltf_stream.hpp,
// obj/stream.hpp) and is not likely to fit when it is loaded. folder: for temporary files. Throws as open_obj_stream()
// and stream_of() do.
[[nodiscard]] opened_stream open_stream(const std::filesystem::path& file, const stream_room& room,
                                        const std::filesystem::path& folder, const load_options& options);

} // namespace voxelize
