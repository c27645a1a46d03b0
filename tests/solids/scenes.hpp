// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The benchmark scenes as solids, where they are present.

#include "mesh_file.hpp"
#include "solid_support.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace solids {

// Nothing, and why not, where the scene is not present.
inline std::optional<mesh> load_scene(std::string_view name, std::string& why) {
    if (!bench::has_scene(VOXELPIPE_SCENES_DIR, name, why)) return std::nullopt;
    const bench::mesh_data loaded = bench::load_scene(VOXELPIPE_SCENES_DIR, name);
    return mesh{loaded.positions, loaded.triangles};
}

} // namespace solids
