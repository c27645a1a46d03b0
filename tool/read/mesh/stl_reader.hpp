// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// STL. Binary: the little end first, with facet colours as VisCAM or (after "COLOR=" in the header) Magics writes them;
// bytes behind the facets are passed over, whatever the header begins with. Text: words in any case and layout, several
// solids, each a part; positions in double; normals are not read.

#include "mesh_reader.hpp"

#include <filesystem>
#include <memory>

namespace voxelize {

// Throws model_error where the file is no STL.
[[nodiscard]] std::unique_ptr<mesh_reader> open_stl(const std::filesystem::path& path, const gltf_options& options);

} // namespace voxelize
