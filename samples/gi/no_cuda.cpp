// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// In place of cuda.cu where the program is built without CUDA.

#include "renderer.hpp"

#include <stdexcept>

namespace gi {

std::string why_no_cuda() { return "this program was built without CUDA"; }

std::unique_ptr<renderer> make_cuda_renderer(scene, const settings&) { throw std::runtime_error(why_no_cuda()); }

} // namespace gi
