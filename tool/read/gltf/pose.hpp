// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Morph targets and skins: the vertices of a primitive as one node of the scene bends them.

#include "accessor.hpp"
#include "nodes.hpp"

#include <tiny_gltf.h>

#include <cstddef>
#include <string>
#include <vector>

namespace voxelize::gltf {

// The positions of a primitive in one pose.
struct posed_positions {
    std::vector<double> xyz; // 3 a vertex
    bool in_world = false;   // a skin has put them there; otherwise in the mesh's own space
    bool mirrored = false;   // the skin exchanges front and back
};

class pose_reader {
public:
    // All of them must outlive this.
    pose_reader(const tinygltf::Model& model, const accessor_reader& accessors,
                const std::vector<affine>& node_to_world, budget& memory)
        : model_{model}, accessors_{accessors}, node_to_world_{node_to_world}, memory_{memory} {}

    // True if PART looks different for the node of SHOWN than in its mesh's base shape.
    [[nodiscard]] bool is_posed(const shown_mesh& shown, const tinygltf::Primitive& part) const;

    // The positions of PART, whose base shape is BASE (3 numbers a vertex), for SHOWN. WHERE is named in errors.
    // A vertex that no joint moves is moved by the skin's first one.
    [[nodiscard]] posed_positions positions(const shown_mesh& shown, const tinygltf::Primitive& part,
                                            std::vector<double> base, const std::string& where) const;

private:
    [[nodiscard]] const std::vector<double>& weights_of(const shown_mesh& shown) const;
    void morph(std::vector<double>& xyz, const tinygltf::Primitive& part, const std::vector<double>& weights,
               const std::string& where) const;
    [[nodiscard]] std::vector<affine> joint_matrices(std::size_t skin) const;
    void bend(std::vector<double>& xyz, const tinygltf::Primitive& part, const std::vector<affine>& joints,
              const std::string& where) const;

    const tinygltf::Model& model_;
    const accessor_reader& accessors_;
    const std::vector<affine>& node_to_world_;
    budget& memory_;
};

} // namespace voxelize::gltf
