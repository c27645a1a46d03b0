// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"

#include "read/gltf_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

namespace voxelize::gltf {

namespace {

std::string node_name(std::size_t index) { return "nodes[" + std::to_string(index) + "]"; }

// A rotation of any length but 0: exporters write quaternions as floats, their length is brought to 1 in double.
affine from_parts(const std::array<double, 3>& translation, std::array<double, 4> rotation,
                  const std::array<double, 3>& scale, const std::string& where) {
    double squared = 0;
    for (const double part : rotation) squared = std::fma(part, part, squared);
    const double length = std::sqrt(squared);
    if (!(length > 0) || !std::isfinite(length)) throw gltf_error(where + ": is not a quaternion of a rotation");
    for (double& part : rotation) part /= length;
    return affine::from_parts(translation, rotation, scale);
}

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
    return from_parts(translation, rotation, scale, node_name(index) + ".rotation");
}

// True if local_transform does not throw.
bool is_usable(const tinygltf::Node& node) {
    try {
        (void)local_transform(node, 0);
        return true;
    } catch (const gltf_error&) {
        return false;
    }
}

// The children of every node, each node below one parent at most and none below itself.
struct forest {
    static constexpr std::size_t none = SIZE_MAX;

    forest(const tinygltf::Model& model, leniency& tolerance)
        : children(model.nodes.size()), parent(model.nodes.size(), none) {
        for (std::size_t index = 0; index < model.nodes.size(); ++index) {
            for (const int number : model.nodes[index].children) {
                const auto child = static_cast<std::size_t>(number);
                if (parent[child] != none) {
                    tolerance.accept(node_name(child) + ": is a child of two nodes", "it stays below the first");
                    continue;
                }
                parent[child] = index;
                children[index].push_back(child);
            }
        }
        // From the roots down; what is not reached is on a cycle.
        for (std::size_t index = 0; index < parent.size(); ++index)
            if (parent[index] == none) order.push_back(index);
        num_roots = order.size();
        for (std::size_t at = 0; at < order.size(); ++at)
            order.insert(order.end(), children[order[at]].begin(), children[order[at]].end());
        if (order.size() == parent.size()) return;
        std::vector<bool> reached(parent.size());
        for (const std::size_t index : order) reached[index] = true;
        const auto looping = std::find(reached.begin(), reached.end(), false);
        throw gltf_error(node_name(static_cast<std::size_t>(looping - reached.begin())) + ": is below itself");
    }

    std::vector<std::vector<std::size_t>> children;
    std::vector<std::size_t> parent; // or none
    std::vector<std::size_t> order;  // every node, after its parent; the roots first
    std::size_t num_roots = 0;
};

// The nodes that the scene to show lists, or all roots; none twice, none below another.
std::vector<std::size_t> scene_roots(const tinygltf::Model& model, const forest& nodes, leniency& tolerance) {
    if (model.scenes.empty())
        return {nodes.order.begin(), nodes.order.begin() + static_cast<std::ptrdiff_t>(nodes.num_roots)};
    const std::size_t chosen = model.defaultScene >= 0 ? static_cast<std::size_t>(model.defaultScene) : 0;
    if (model.scenes.size() > 1)
        tolerance.warnings().push_back("the file has " + std::to_string(model.scenes.size()) + " scenes: scene " +
                                       std::to_string(chosen) + " is taken");
    std::vector<bool> listed(model.nodes.size());
    std::vector<std::size_t> roots;
    for (const int number : model.scenes[chosen].nodes) {
        const auto node = static_cast<std::size_t>(number);
        if (listed[node]) {
            tolerance.accept(node_name(node) + ": is in the scene twice", "it is shown once");
            continue;
        }
        listed[node] = true;
        roots.push_back(node);
    }
    // One pass from the roots of the file down: is a node below one that is listed?
    std::vector<bool> below(model.nodes.size());
    for (const std::size_t node : nodes.order)
        if (const std::size_t above = nodes.parent[node]; above != forest::none)
            below[node] = below[above] || listed[above];
    std::erase_if(roots, [&](std::size_t node) {
        if (below[node])
            tolerance.accept(node_name(node) + ": is in the scene twice", "it is shown once, below its parent");
        return below[node];
    });
    return roots;
}

bool is_hidden(const tinygltf::Node& node) {
    const auto found = node.extensions.find("KHR_node_visibility");
    return found != node.extensions.end() && found->second.Has("visible") && !found->second.Get("visible").Get<bool>();
}

bool is_scaled_to_nothing(const affine& transform) {
    for (const auto& row : transform.m)
        if (row[0] != 0 || row[1] != 0 || row[2] != 0) return false;
    return true;
}

// The transforms of EXT_mesh_gpu_instancing in the node's own space; nothing where the node has no such extension.
std::optional<std::vector<affine>> instances_of(const tinygltf::Model& model, const tinygltf::Node& node,
                                                std::size_t index, const accessor_reader& accessors) {
    const auto found = node.extensions.find("EXT_mesh_gpu_instancing");
    if (found == node.extensions.end()) return std::nullopt;
    const std::string where = node_name(index) + ".extensions.EXT_mesh_gpu_instancing";
    const tinygltf::Value& attributes = found->second.Get("attributes");
    std::size_t count = 0;
    const auto read = [&](const char* name) -> std::vector<double> {
        if (!attributes.Has(name)) return {};
        const auto accessor = static_cast<std::size_t>(attributes.Get(name).GetNumberAsInt());
        count = model.accessors[accessor].count; // the same for all: check_nodes.cpp
        return accessors.numbers(accessor, model.accessors[accessor].normalized, where);
    };
    const std::vector<double> translations = read("TRANSLATION");
    const std::vector<double> rotations = read("ROTATION");
    const std::vector<double> scales = read("SCALE");
    std::vector<affine> transforms;
    transforms.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::array<double, 3> translation{0, 0, 0};
        std::array<double, 4> rotation{0, 0, 0, 1};
        std::array<double, 3> scale{1, 1, 1};
        if (!translations.empty()) std::copy_n(&translations[3 * i], 3, translation.begin());
        if (!rotations.empty()) std::copy_n(&rotations[4 * i], 4, rotation.begin());
        if (!scales.empty()) std::copy_n(&scales[3 * i], 3, scale.begin());
        transforms.push_back(from_parts(translation, rotation, scale, where + ": ROTATION " + std::to_string(i)));
    }
    return transforms;
}

} // namespace

shown_scene shown_meshes(const tinygltf::Model& model, const accessor_reader& accessors, leniency& tolerance) {
    shown_scene result;
    std::vector<std::string>& warnings = tolerance.warnings();
    if (model.nodes.empty() && model.scenes.empty()) {
        for (std::size_t mesh = 0; mesh < model.meshes.size(); ++mesh) result.meshes.push_back({mesh, affine{}});
        if (!result.meshes.empty()) warnings.push_back("the file has no nodes: every mesh is taken once, as it stands");
        return result;
    }
    const forest nodes{model, tolerance};
    const std::vector<std::size_t> roots = scene_roots(model, nodes, tolerance);
    std::vector<affine>& to_world = result.node_to_world;
    to_world.resize(model.nodes.size());
    std::vector<bool> hidden(model.nodes.size());
    std::vector<bool> is_root(model.nodes.size());
    std::vector<bool> in_scene(model.nodes.size());
    for (const std::size_t node : roots) is_root[node] = true;
    for (const std::size_t index : nodes.order) {
        const std::size_t above = nodes.parent[index];
        in_scene[index] = is_root[index] || (above != forest::none && in_scene[above]);
        // Outside the scene only the joints of skins are asked for: nobody minds if another node's transform is wrong.
        if (in_scene[index] || is_usable(model.nodes[index]))
            to_world[index] = local_transform(model.nodes[index], index);
        hidden[index] = is_hidden(model.nodes[index]);
        // Nodes that a scene lists stand in the world, whatever is above them.
        if (above == forest::none || is_root[index]) continue;
        to_world[index] = to_world[above].after(to_world[index]);
        hidden[index] = hidden[index] || hidden[above];
    }

    std::size_t num_hidden = 0;
    std::size_t num_without_place = 0;
    std::vector<std::size_t> pending(roots.rbegin(), roots.rend());
    while (!pending.empty()) {
        const std::size_t index = pending.back();
        pending.pop_back();
        pending.insert(pending.end(), nodes.children[index].rbegin(), nodes.children[index].rend());
        const tinygltf::Node& node = model.nodes[index];
        if (node.mesh < 0) continue;
        const auto show = [&](const affine& transform) {
            // A skin decides in place of the node where its mesh stands, see skins.hpp.
            if (hidden[index] || (node.skin < 0 && is_scaled_to_nothing(transform)))
                ++num_hidden;
            else if (node.skin < 0 && !transform.is_finite())
                ++num_without_place;
            else
                result.meshes.push_back(
                    {static_cast<std::size_t>(node.mesh), transform, static_cast<std::int32_t>(index), node.skin});
        };
        if (const auto transforms = instances_of(model, node, index, accessors))
            for (const affine& transform : *transforms) show(to_world[index].after(transform));
        else
            show(to_world[index]);
    }
    if (num_without_place != 0)
        warnings.push_back(std::to_string(num_without_place) +
                           " node(s) with a transform that is not finite are left out");
    if (result.meshes.empty() && !model.meshes.empty())
        warnings.push_back(num_hidden == 0 ? "no node of the scene shows a mesh"
                                           : "every mesh of the scene is hidden or scaled to nothing");
    return result;
}

} // namespace voxelize::gltf
