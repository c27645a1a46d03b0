// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The meaning of each glTF extension for a voxelization: one table.

#include "compression.hpp"

#include <array>
#include <string_view>

namespace voxelize::gltf {

enum class extension_effect {
    honoured,   // implemented here, or without any effect on geometry and base colour
    appearance, // changes how the surface looks: a warning
    fallback,   // other geometry data, but a file may bring a plain copy: an error only where it is required
    unknown     // not in the table: a warning, an error where it is required
};

// extensionsUsed / extensionsRequired name -> effect. KHR_materials_* and the other vendors' materials count as
// appearance.
[[nodiscard]] constexpr extension_effect effect_of(std::string_view name) {
    struct rule {
        std::string_view name;
        extension_effect effect;
    };
    constexpr std::array rules{
        rule{"KHR_texture_transform", extension_effect::honoured},
        rule{"KHR_mesh_quantization", extension_effect::honoured},
        rule{"KHR_materials_unlit", extension_effect::honoured},
        rule{"KHR_materials_variants", extension_effect::honoured},
        rule{"KHR_lights_punctual", extension_effect::honoured},
        rule{"KHR_xmp", extension_effect::honoured},
        rule{"KHR_xmp_json_ld", extension_effect::honoured},
        rule{"KHR_draco_mesh_compression", reads_draco ? extension_effect::honoured : extension_effect::fallback},
        rule{"EXT_mesh_gpu_instancing", extension_effect::honoured},
        rule{"KHR_node_visibility", extension_effect::honoured},
        // A picture that cannot be decoded is named when it is needed.
        rule{"KHR_texture_basisu", extension_effect::honoured},
        rule{"EXT_texture_webp", extension_effect::honoured},
        rule{"EXT_texture_avif", extension_effect::honoured},
        rule{"MSFT_texture_dds", extension_effect::honoured},
        rule{"KHR_materials_pbrSpecularGlossiness",
             extension_effect::honoured}, // its diffuse colour is the base colour
        rule{"EXT_lights_image_based", extension_effect::appearance},
        rule{"KHR_techniques_webgl", extension_effect::appearance},
    };
    if (is_meshopt(name)) return reads_meshopt ? extension_effect::honoured : extension_effect::fallback;
    for (const rule& known : rules)
        if (known.name == name) return known.effect;
    for (const std::string_view prefix : {"KHR_materials_", "EXT_materials_", "ADOBE_materials_"})
        if (name.substr(0, prefix.size()) == prefix) return extension_effect::appearance;
    return extension_effect::unknown;
}

} // namespace voxelize::gltf
