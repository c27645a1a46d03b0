// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "animation.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace voxelize::gltf {

namespace {

// A moment among keys: between two of them, or on one of the ends.
struct moment {
    std::size_t key = 0;
    double fraction = 0; // of the way to the next key
    double duration = 0; // seconds to the next key; 0 on an end
};

moment find_moment(const std::vector<double>& times, double seconds, const std::string& where) {
    for (std::size_t i = 0; i < times.size(); ++i)
        if (!std::isfinite(times[i]) || (i != 0 && !(times[i] > times[i - 1])))
            throw gltf_error(where + ": its times do not ascend at key " + std::to_string(i));
    const auto above = std::upper_bound(times.begin(), times.end(), seconds);
    if (above == times.begin()) return {};
    const auto key = static_cast<std::size_t>(above - times.begin()) - 1;
    if (above == times.end()) return {key, 0, 0};
    const double duration = times[key + 1] - times[key];
    return {key, (seconds - times[key]) / duration, duration};
}

// The shorter arc between two unit quaternions.
std::vector<double> slerp(std::span<const double> from, std::span<const double> to, double t) {
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot = std::fma(from[i], to[i], dot);
    const double sign = dot < 0 ? -1 : 1;
    const double angle = std::acos(std::min(std::abs(dot), 1.0));
    double a = 1 - t;
    double b = t;
    if (const double sine = std::sin(angle); sine > 1e-6) {
        a = std::sin((1 - t) * angle) / sine;
        b = std::sin(t * angle) / sine;
    }
    std::vector<double> result(4);
    for (std::size_t i = 0; i < 4; ++i) result[i] = std::fma(a, from[i], sign * b * to[i]);
    return result;
}

// WIDTH numbers at the moment. VALUES has as many for each key, three times as many for a spline (in-tangent, value,
// out-tangent).
std::vector<double> value_at(const moment& at, std::span<const double> values, std::size_t width,
                             const std::string& interpolation, bool is_rotation) {
    const bool spline = interpolation == "CUBICSPLINE";
    const auto part = [&](std::size_t key, std::size_t which) {
        return values.subspan((spline ? 3 * key + which : key) * width, width);
    };
    const std::span<const double> from = part(at.key, 1);
    if (at.duration == 0 || interpolation == "STEP") return {from.begin(), from.end()};
    const std::span<const double> to = part(at.key + 1, 1);
    const double t = at.fraction;
    if (!spline && is_rotation) return slerp(from, to, t);
    std::vector<double> result(width);
    for (std::size_t i = 0; i < width; ++i) {
        if (!spline) {
            result[i] = std::fma(t, to[i] - from[i], from[i]);
            continue;
        }
        const double t2 = t * t;
        const double t3 = t2 * t;
        const double leaving = part(at.key, 2)[i] * at.duration;
        const double arriving = part(at.key + 1, 0)[i] * at.duration;
        result[i] = std::fma(2 * t3 - 3 * t2 + 1, from[i], (t3 - 2 * t2 + t) * leaving) +
                    std::fma(3 * t2 - 2 * t3, to[i], (t3 - t2) * arriving);
    }
    return result;
}

std::size_t num_weights(const tinygltf::Model& model, const tinygltf::Node& node) {
    std::size_t most = 0;
    if (node.mesh < 0) return 0;
    for (const tinygltf::Primitive& part : model.meshes[static_cast<std::size_t>(node.mesh)].primitives)
        most = std::max(most, part.targets.size());
    return most;
}

} // namespace

void apply_animation(tinygltf::Model& model, const accessor_reader& accessors, double seconds,
                     std::vector<std::string>& warnings) {
    const tinygltf::Animation& animation = model.animations.front();
    std::size_t with_matrix = 0;
    for (std::size_t index = 0; index < animation.channels.size(); ++index) {
        const tinygltf::AnimationChannel& channel = animation.channels[index];
        const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
        tinygltf::Node& node = model.nodes[static_cast<std::size_t>(channel.target_node)];
        const std::string where = "the animation's channels[" + std::to_string(index) + "]";
        const bool is_rotation = channel.target_path == "rotation";
        const bool is_weights = channel.target_path == "weights";
        const std::size_t width = is_weights ? num_weights(model, node) : is_rotation ? 4 : 3;
        if (width == 0) continue; // weights of a mesh without targets
        if (!is_weights && !node.matrix.empty()) {
            ++with_matrix;
            continue;
        }
        const auto input = static_cast<std::size_t>(sampler.input);
        const auto output = static_cast<std::size_t>(sampler.output);
        if (const int type = model.accessors[output].type; type != (is_weights    ? TINYGLTF_TYPE_SCALAR
                                                                    : is_rotation ? TINYGLTF_TYPE_VEC4
                                                                                  : TINYGLTF_TYPE_VEC3))
            throw gltf_error(where + ": its output is of the wrong type for " + channel.target_path);
        const std::vector<double> times = accessors.numbers(input, false, where);
        const std::vector<double> values = accessors.numbers(output, model.accessors[output].normalized, where);
        const std::size_t wanted = times.size() * width * (sampler.interpolation == "CUBICSPLINE" ? 3 : 1);
        if (values.size() != wanted)
            throw gltf_error(where + ": its output has " + std::to_string(values.size()) + " numbers, " +
                             std::to_string(times.size()) + " keys need " + std::to_string(wanted));
        std::vector<double> value =
            value_at(find_moment(times, seconds, where), values, width,
                     sampler.interpolation.empty() ? "LINEAR" : sampler.interpolation, is_rotation);
        if (is_weights)
            node.weights = std::move(value);
        else if (is_rotation)
            node.rotation = std::move(value);
        else if (channel.target_path == "scale")
            node.scale = std::move(value);
        else
            node.translation = std::move(value);
    }
    if (with_matrix != 0)
        warnings.push_back(std::to_string(with_matrix) +
                           " channel(s) of the animation move nodes that have a matrix: they are left out");
}

} // namespace voxelize::gltf
