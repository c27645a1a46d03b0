// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Checks of the pose of meshes: morph targets, skins, one animation.
#include "checker.hpp"

#include <tiny_gltf.h>

#include <charconv>
#include <utility>

namespace voxelize::gltf {

void checker::check_numbers_list(const json_at& at, std::string_view key) const {
    if (const std::size_t size = at.array_size(key); size != 0) at.check_numbers(key, size);
}

// Only POSITION of the targets is used: nothing else moves a triangle.
void checker::check_targets(const json_at& primitive) const {
    memory_.charge(primitive.array_size("targets"), sizeof(std::map<std::string, int>), "morph targets");
    primitive.each_object("targets", [&](const json_at& target) {
        for (const auto& entry : target.value().items()) (void)target.index(entry.key(), "accessors", num_accessors_);
        target.keep_only({"POSITION"});
    });
}

void checker::check_skins() {
    root_.each_object("skins", [&](const json_at& skin) {
        if (skin.array_size("joints") == 0) skin.fail("has no joints");
        memory_.charge(skin.array_size("joints"), sizeof(int), "skins");
        skin.each("joints", [&](const json_at& joint) { (void)joint.as_index("nodes", num_nodes_); });
        if (const auto matrices = skin.index("inverseBindMatrices", "accessors", num_accessors_)) {
            const json& accessor = root_.value()["accessors"][*matrices];
            if (accessor["type"] != "MAT4" || accessor["componentType"] != TINYGLTF_COMPONENT_TYPE_FLOAT)
                skin.fail("inverseBindMatrices are not MAT4 of floats");
            if (accessor["count"].get<std::uint64_t>() < skin.array_size("joints"))
                skin.fail("has " + std::to_string(skin.array_size("joints")) + " joints and " +
                          accessor["count"].dump() + " inverseBindMatrices");
        }
        skin.keep_only({"joints", "inverseBindMatrices"});
    });
}

// Keeps the animation that is asked for, and checks that one: nobody minds if another is wrong.
void checker::choose_animation() {
    const std::size_t count = root_.array_size("animations");
    if (!options_.animation) {
        if (count != 0)
            tolerance_.warnings().push_back(
                "the file has " + std::to_string(count) +
                " animation(s): nodes stand as the file places them, --animation poses them");
        root_.value().erase("animations");
        return;
    }
    const std::string& wanted = *options_.animation;
    std::string known;
    std::optional<std::size_t> chosen;
    root_.each_object("animations", [&](const json_at& animation) {
        const std::size_t index = animation.index_in_list();
        const std::string name(animation.string("name").value_or(""));
        if (!chosen && name == wanted) chosen = index;
        if (index < 20) known += (index == 0 ? " " : ", ") + (name.empty() ? std::to_string(index) : in_quotes(name));
    });
    if (!chosen) { // by its place in the file, from 0
        std::size_t number = 0;
        const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
        if (error == std::errc{} && end == wanted.data() + wanted.size() && number < count) chosen = number;
    }
    if (!chosen)
        throw gltf_error("there is no animation " + in_quotes(wanted) +
                         (count == 0 ? ", the file has none" : "; the file has" + known + (count > 20 ? ", ..." : "")));
    root_.each_object("animations", [&](const json_at& animation) {
        if (animation.index_in_list() == *chosen) check_animation(animation);
    });
    json kept = std::move(root_.value()["animations"][*chosen]);
    root_.value()["animations"] = json::array({std::move(kept)});
}

void checker::check_animation(const json_at& animation) const {
    const std::size_t num_samplers = animation.array_size("samplers");
    memory_.charge(num_samplers, sizeof(tinygltf::AnimationSampler), "animations");
    memory_.charge(animation.array_size("channels"), sizeof(tinygltf::AnimationChannel), "animations");
    animation.each_object("samplers", [&](const json_at& sampler) {
        const auto input = sampler.required("input", sampler.index("input", "accessors", num_accessors_));
        (void)sampler.required("output", sampler.index("output", "accessors", num_accessors_));
        const json& accessor = root_.value()["accessors"][input];
        if (accessor["type"] != "SCALAR" || accessor["componentType"] != TINYGLTF_COMPONENT_TYPE_FLOAT)
            sampler.fail("input is not of scalar floats");
        const std::string_view interpolation = sampler.string("interpolation").value_or("LINEAR");
        if (interpolation != "LINEAR" && interpolation != "STEP" && interpolation != "CUBICSPLINE")
            sampler.fail("interpolation " + in_quotes(interpolation) + " is not one of glTF's");
        sampler.keep_only({"input", "output", "interpolation"});
    });
    json kept = json::array();
    std::size_t left_out = 0;
    animation.each_object("channels", [&](const json_at& channel) {
        (void)channel.required("sampler", channel.index("sampler", "samplers", num_samplers));
        const json_at target = channel.required("target", channel.object("target"));
        const std::string_view path = target.required("path", target.string("path"));
        const auto node = target.index("node", "nodes", num_nodes_);
        const bool moves = path == "translation" || path == "rotation" || path == "scale" || path == "weights";
        if (!node || !moves) {
            ++left_out; // KHR_animation_pointer and the like
            return;
        }
        target.keep_only({"node", "path"});
        channel.keep_only({"sampler", "target"});
        kept.push_back(channel.value());
    });
    if (left_out != 0)
        tolerance_.warnings().push_back("the animation has " + std::to_string(left_out) +
                                        " channel(s) that move no node: they are left out");
    animation.value()["channels"] = std::move(kept);
    animation.keep_only({"name", "channels", "samplers"});
}

} // namespace voxelize::gltf
