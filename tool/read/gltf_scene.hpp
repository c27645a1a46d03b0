// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// glTF 2.0 (.gltf and .glb) -> scene. What a file may ask for is bounded by its own size before any memory is taken:
// a malformed or hostile file gives a gltf_error of one line, never a crash, a hang or a huge allocation.
//
// Positions are taken as the file gives them: no axis swap, no recentring. Node transforms are composed in double and
// stay apart from the positions, with every operation written out, so the same file gives the same bits whatever the
// compiler's floating-point flags. A mesh that many nodes show is kept once.
//
// Skins, morph targets and instances of EXT_mesh_gpu_instancing stand in the pose that the file states, or in that of
// one animation at one time.
//
// Unsupported parts of a file: where geometry would be lost (required extensions that are not known, Draco or meshopt
// compression in a build without the library) the load fails and says so; otherwise scene::warnings names it.

#include "model/affine.hpp"
#include "model/model_error.hpp"
#include "model/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

// A file cannot be loaded; the message says why.
struct gltf_error : model_error {
    using model_error::model_error;
};

// Bounds on what a file may make the loader do. Memory for decoded data (vertices, triangles, nodes) may reach
// base_memory + memory_per_input_byte * (bytes read), and a picture what its bytes can decode to, so that a file which
// claims more than it holds is refused by name.
struct gltf_limits {
    std::uint64_t max_file_bytes = std::uint64_t{8} << 30;
    std::uint64_t max_json_bytes = std::uint64_t{1} << 30;
    std::uint64_t base_memory = std::uint64_t{256} << 20;
    std::uint64_t memory_per_input_byte = 256;
    std::uint32_t max_image_side = 16384; // pixels
    std::uint64_t room = UINT64_MAX;      // bytes that the run may still take; assimp's process keeps to it
    std::uint64_t import_seconds = 3;     // of processor time for assimp, and two more for each MiB of the file
};

// The caller's choices.
struct gltf_options {
    // Faults that can be put right (unaligned strides, a node in the scene twice, ...) become warnings.
    bool lenient = false;
    // Nodes stand as this animation (its name, or its number from 0) has them at this time. None: as the file places
    // them.
    std::optional<std::string> animation;
    double seconds = 0;
    // Primitives show the material that this variant of the file (KHR_materials_variants), by name, gives them. None:
    // their own.
    std::optional<std::string> variant{};
    int threads = 0; // that read vertices and indices; 0: one for each core. The scene does not depend on it
    // False: pictures are read only for materials that cut fragments off by alpha, MASK and, if blend_cuts, BLEND; the
    // others have no texture then.
    bool colors = true;
    bool blend_cuts = false;
    // Reads roughness, metal and emission too, for programs that light the model. Textures with coordinates other than
    // the base colour's are left out, with a warning.
    bool shading = false;
    // Called with each file that the model names, by its path relative to the model's folder, whether it is read or
    // not, and more than once for some. Of an OBJ these are material libraries and pictures. May be empty.
    std::function<void(const std::filesystem::path& relative)> names_file{};
};

// Gives the bytes of a file that a .gltf names. The path is relative, normalised, percent-decoded and never leaves
// the folder of the .gltf. Throws gltf_error with the bare reason where the file cannot be had.
using gltf_file_reader =
    std::function<std::vector<std::byte>(const std::filesystem::path& relative, std::uint64_t max_bytes)>;

// Loads FILE; a .gltf finds its buffers and images in its own folder or below it. Throws gltf_error, and std::bad_alloc
// where a file whose claims are in order does not fit into memory.
[[nodiscard]] scene load_gltf(const std::filesystem::path& file, const gltf_limits& limits = {},
                              const gltf_options& options = {}, const load_hooks& hooks = {});

// The same from memory. Without a reader a file that names other files is refused.
[[nodiscard]] scene load_gltf(std::span<const std::byte> bytes, const gltf_file_reader& read_file = {},
                              const gltf_limits& limits = {}, const gltf_options& options = {},
                              const load_hooks& hooks = {});

} // namespace voxelize
