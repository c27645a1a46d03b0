// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A model as the tool has it: read from a file by its readers, or made of the arrays of a mesh with its visuals.

#include "arrays.hpp"

#include "model/scene.hpp"

namespace voxelpipe::python {

struct model_scene {
    voxelize::scene scene;
};

// Its arrays and what is drawn of it.
void bind_scene_draw(nb::class_<model_scene>& c);

} // namespace voxelpipe::python
