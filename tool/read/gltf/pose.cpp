// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "pose.hpp"

#include <algorithm>
#include <cmath>

namespace voxelize::gltf {

namespace {

// The accessor of attribute NAME; nothing where PART has none.
const int* find_attribute(const tinygltf::Primitive& part, const std::string& name) {
    const auto found = part.attributes.find(name);
    return found == part.attributes.end() ? nullptr : &found->second;
}

affine inverse_bind_matrix(const double* columns, const std::string& where) {
    affine result;
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 4; ++c) result.m[r][c] = columns[c * 4 + r];
    const double projective =
        std::abs(columns[3]) + std::abs(columns[7]) + std::abs(columns[11]) + std::abs(columns[15] - 1);
    if (!(projective < 1e-5)) throw gltf_error(where + ": the last row of a matrix is not 0 0 0 1");
    return result;
}

} // namespace

const std::vector<double>& pose_reader::weights_of(const shown_mesh& shown) const {
    if (shown.node >= 0)
        if (const auto& own = model_.nodes[static_cast<std::size_t>(shown.node)].weights; !own.empty()) return own;
    return model_.meshes[shown.mesh].weights;
}

bool pose_reader::is_posed(const shown_mesh& shown, const tinygltf::Primitive& part) const {
    if (shown.skin >= 0 && find_attribute(part, "JOINTS_0") != nullptr) return true;
    if (part.targets.empty()) return false;
    const std::vector<double>& weights = weights_of(shown);
    return std::any_of(weights.begin(), weights.end(), [](double weight) { return weight != 0; });
}

posed_positions pose_reader::positions(const shown_mesh& shown, const tinygltf::Primitive& part,
                                       std::vector<double> base, const std::string& where) const {
    posed_positions result;
    result.xyz = std::move(base);
    if (!part.targets.empty()) morph(result.xyz, part, weights_of(shown), where);
    if (shown.skin < 0 || find_attribute(part, "JOINTS_0") == nullptr) return result;
    const std::vector<affine> joints = joint_matrices(static_cast<std::size_t>(shown.skin));
    bend(result.xyz, part, joints, where);
    result.in_world = true;
    result.mirrored = joints.front().mirrors();
    return result;
}

void pose_reader::morph(std::vector<double>& xyz, const tinygltf::Primitive& part, const std::vector<double>& weights,
                        const std::string& where) const {
    for (std::size_t target = 0; target < std::min(part.targets.size(), weights.size()); ++target) {
        const auto found = part.targets[target].find("POSITION");
        if (found == part.targets[target].end() || weights[target] == 0) continue;
        const auto index = static_cast<std::size_t>(found->second);
        const tinygltf::Accessor& accessor = model_.accessors[index];
        const std::string name = where + ".targets[" + std::to_string(target) + "]";
        if (accessor.type != TINYGLTF_TYPE_VEC3) throw gltf_error(name + ": POSITION is not a VEC3");
        if (accessor.count * 3 != xyz.size())
            throw gltf_error(name + ": POSITION has " + std::to_string(accessor.count) + " elements, the base shape " +
                             std::to_string(xyz.size() / 3));
        const budget::scope temporary{memory_};
        const std::vector<double> offsets = accessors_.numbers(index, accessor.normalized, name);
        for (std::size_t i = 0; i < xyz.size(); ++i) xyz[i] = std::fma(weights[target], offsets[i], xyz[i]);
    }
}

std::vector<affine> pose_reader::joint_matrices(std::size_t skin_index) const {
    const tinygltf::Skin& skin = model_.skins[skin_index];
    const std::string where = "skins[" + std::to_string(skin_index) + "]";
    const budget::scope temporary{memory_};
    std::vector<double> inverse;
    if (skin.inverseBindMatrices >= 0)
        inverse = accessors_.numbers(static_cast<std::size_t>(skin.inverseBindMatrices), false, where);
    std::vector<affine> joints;
    joints.reserve(skin.joints.size());
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        const affine& world = node_to_world_[static_cast<std::size_t>(skin.joints[i])];
        joints.push_back(inverse.empty() ? world : world.after(inverse_bind_matrix(&inverse[16 * i], where)));
    }
    return joints;
}

void pose_reader::bend(std::vector<double>& xyz, const tinygltf::Primitive& part, const std::vector<affine>& joints,
                       const std::string& where) const {
    const std::size_t vertices = xyz.size() / 3;
    std::vector<double> sum(xyz.size());
    std::vector<double> total(vertices);
    for (int set = 0;; ++set) { // four joints each
        const std::string joints_name = "JOINTS_" + std::to_string(set);
        const std::string weights_name = "WEIGHTS_" + std::to_string(set);
        const int* const joints_index = find_attribute(part, joints_name);
        const int* const weights_index = find_attribute(part, weights_name);
        if (joints_index == nullptr || weights_index == nullptr) break;
        const budget::scope temporary{memory_};
        const auto read = [&](int index, const std::string& name, bool normalized) {
            const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
            std::string message = where;
            message.append(": ").append(name);
            if (accessor.type != TINYGLTF_TYPE_VEC4) throw gltf_error(message.append(" is not a VEC4"));
            if (accessor.count != vertices) {
                message.append(" has ").append(std::to_string(accessor.count));
                message.append(" elements, POSITION has ").append(std::to_string(vertices));
                throw gltf_error(message);
            }
            return accessors_.numbers(static_cast<std::size_t>(index), normalized, where);
        };
        const std::vector<double> numbers = read(*joints_index, joints_name, false);
        const std::vector<double> weights = read(*weights_index, weights_name, true);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const double weight = weights[i];
            if (weight == 0) continue;
            if (!(numbers[i] >= 0 && numbers[i] < static_cast<double>(joints.size())))
                throw gltf_error(where + ": joint " + std::to_string(static_cast<long long>(numbers[i])) +
                                 " of vertex " + std::to_string(i / 4) + " is not in the skin, which has " +
                                 std::to_string(joints.size()));
            const affine& joint = joints[static_cast<std::size_t>(numbers[i])];
            const double* const p = &xyz[i / 4 * 3];
            for (std::size_t axis = 0; axis < 3; ++axis)
                sum[i / 4 * 3 + axis] = std::fma(weight, joint.row(axis, p[0], p[1], p[2], 1), sum[i / 4 * 3 + axis]);
            total[i / 4] += weight;
        }
    }
    for (std::size_t i = 0; i < vertices; ++i) {
        const glm::dvec3 p(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        for (std::size_t axis = 0; axis < 3; ++axis)
            xyz[3 * i + axis] =
                total[i] != 0 ? sum[3 * i + axis] / total[i] : joints.front().row(axis, p.x, p.y, p.z, 1);
    }
}

} // namespace voxelize::gltf
