// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "scene_choice.hpp"

#include "generated_meshes.hpp"

#include <array>
#include <stdexcept>

namespace bench {

mesh_data find_mesh(const std::filesystem::path& folder, const std::string& name) {
    if (name == "icosphere") return icosphere(300);
    if (name == "torus_knot") return torus_knot(4356, 100);
    if (name == "torus_knot_fine") return torus_knot(12500, 288);
    if (name == "hairball_generated") return hairball(1500, 160, 1);
    if (name == "room") return room(331000, 1);
    if (name == "one_triangle") return one_triangle();
    std::string why;
    if (has_scene(folder, name, why)) return load_scene(folder, name);
    if (std::filesystem::exists(name)) return read_mesh(name);
    throw std::runtime_error("no mesh is called " + name + " (" + why + ")");
}

std::vector<std::string> available_scenes(const std::filesystem::path& folder, std::vector<std::string>& notes) {
    // As many triangles each, and of the same kind: mixed sizes, a scanned surface, two finer ones, thin strands.
    constexpr std::array<std::string_view, scene_names.size()> stand_in{"room", "torus_knot", "icosphere",
                                                                        "hairball_generated", "torus_knot_fine"};
    std::vector<std::string> out;
    for (std::size_t i = 0; i < scene_names.size(); ++i) {
        std::string why;
        if (has_scene(folder, scene_names[i], why)) {
            out.emplace_back(scene_names[i]);
        } else {
            notes.push_back("scene " + std::string(scene_names[i]) + " is absent (" + why + "): the generated mesh " +
                            std::string(stand_in[i]) + " stands in its place");
            out.emplace_back(stand_in[i]);
        }
    }
    return out;
}

} // namespace bench
