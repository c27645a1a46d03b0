// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One factory a kind of cell, each in a source file of its own, so that they compile side by side.

#include "cells.hpp"

#include <voxelpipe/core/triangle_setup.hpp>

namespace bench::gpu {

using cell_pointer = std::unique_ptr<prepared_cell>;

cell_pointer make_bits(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                       bool count_voxels);
// tracks: whether the framebuffer tracks its changes.
cell_pointer make_float_replace(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                                bool tracks);
cell_pointer make_float_add(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                            bool tracks);
cell_pointer make_float_add_unordered(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule);
cell_pointer make_float_add_varying(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                                    bool tracks);
cell_pointer make_abuffer(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule);

} // namespace bench::gpu
