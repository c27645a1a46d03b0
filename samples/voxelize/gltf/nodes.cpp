// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"

#include "../gltf_scene.hpp"

#include <algorithm>
#include <cmath>

namespace voxelize::gltf {

namespace {

std::string node_name(std::size_t index) { return "nodes[" + std::to_string(index) + "]"; }

affine local_transform(const tinygltf::Node& node, std::size_t index) {
    affine result;
    if (!node.matrix.empty()) { // 16 numbers, column by column
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 4; ++c) result.m[r][c] = node.matrix[c * 4 + r];
        const double projective = std::abs(node.matrix[3]) + std::abs(node.matrix[7]) + std::abs(node.matrix[11]) +
                                  std::abs(node.matrix[15] - 1);
        if (!(projective < 1e-5)) throw gltf_error(node_name(index) + ".matrix: its last row is not 0 0 0 1");
        return result;
    }
    std::array<double, 3> translation{0, 0, 0};
    std::array<double, 4> rotation{0, 0, 0, 1};
    std::array<double, 3> scale{1, 1, 1};
    std::copy(node.translation.begin(), node.translation.end(), translation.begin());
    std::copy(node.rotation.begin(), node.rotation.end(), rotation.begin());
    std::copy(node.scale.begin(), node.scale.end(), scale.begin());
    // Exporters write quaternions as floats; bring the length to 1 in double.
    double squared = 0;
    for (const double part : rotation) squared = std::fma(part, part, squared);
    const double length = std::sqrt(squared);
    if (!(length > 0) || !std::isfinite(length))
        throw gltf_error(node_name(index) + ".rotation: is not a quaternion of a rotation");
    for (double& part : rotation) part /= length;
    return affine::from_parts(translation, rotation, scale);
}

// Every node has at most one parent and none is below itself; gives the nodes without a parent.
std::vector<std::size_t> forest_roots(const tinygltf::Model& model) {
    std::vector<bool> has_parent(model.nodes.size());
    for (std::size_t index = 0; index < model.nodes.size(); ++index) {
        for (const int child : model.nodes[index].children) {
            if (has_parent[static_cast<std::size_t>(child)])
                throw gltf_error(node_name(static_cast<std::size_t>(child)) + ": is a child of two nodes");
            has_parent[static_cast<std::size_t>(child)] = true;
        }
    }
    std::vector<std::size_t> roots;
    for (std::size_t index = 0; index < model.nodes.size(); ++index)
        if (!has_parent[index]) roots.push_back(index);

    // With one parent at most, whatever no root leads to is on a cycle.
    std::vector<bool> reached(model.nodes.size());
    std::vector<std::size_t> pending = roots;
    while (!pending.empty()) {
        const std::size_t index = pending.back();
        pending.pop_back();
        reached[index] = true;
        for (const int child : model.nodes[index].children) pending.push_back(static_cast<std::size_t>(child));
    }
    const auto looping = std::find(reached.begin(), reached.end(), false);
    if (looping != reached.end())
        throw gltf_error(node_name(static_cast<std::size_t>(looping - reached.begin())) + ": is below itself");
    return roots;
}

} // namespace

std::vector<shown_mesh> shown_meshes(const tinygltf::Model& model, std::vector<std::string>& warnings) {
    if (model.nodes.empty() && model.scenes.empty()) {
        std::vector<shown_mesh> all;
        for (std::size_t mesh = 0; mesh < model.meshes.size(); ++mesh) all.push_back({mesh, affine{}});
        if (!all.empty()) warnings.push_back("the file has no nodes: every mesh is taken once, as it stands");
        return all;
    }
    std::vector<std::size_t> roots = forest_roots(model);
    if (!model.scenes.empty()) {
        const std::size_t chosen = model.defaultScene >= 0 ? static_cast<std::size_t>(model.defaultScene) : 0;
        const tinygltf::Scene& scene = model.scenes[chosen];
        roots.assign(scene.nodes.begin(), scene.nodes.end());
        if (model.scenes.size() > 1)
            warnings.push_back("the file has " + std::to_string(model.scenes.size()) + " scenes: scene " +
                               std::to_string(chosen) + " is taken");
    }

    struct visit {
        std::size_t node;
        affine parent_to_world;
    };
    std::vector<visit> pending;
    for (std::size_t i = roots.size(); i-- > 0;) pending.push_back({roots[i], affine{}});
    std::vector<bool> seen(model.nodes.size());
    std::vector<shown_mesh> shown;
    std::size_t without_place = 0;
    while (!pending.empty()) {
        const visit current = pending.back();
        pending.pop_back();
        // A forest leaves one way to come twice: through the scene's own list.
        if (seen[current.node]) throw gltf_error(node_name(current.node) + ": is in the scene twice");
        seen[current.node] = true;
        const tinygltf::Node& node = model.nodes[current.node];
        const affine to_world = current.parent_to_world.after(local_transform(node, current.node));
        if (node.mesh >= 0 && to_world.is_finite()) shown.push_back({static_cast<std::size_t>(node.mesh), to_world});
        if (node.mesh >= 0 && !to_world.is_finite()) ++without_place;
        for (std::size_t i = node.children.size(); i-- > 0;)
            pending.push_back({static_cast<std::size_t>(node.children[i]), to_world});
    }
    if (without_place != 0)
        warnings.push_back(std::to_string(without_place) + " node(s) with a transform that is not finite are left out");
    if (shown.empty() && !model.meshes.empty()) warnings.push_back("no node of the scene shows a mesh");
    return shown;
}

} // namespace voxelize::gltf
