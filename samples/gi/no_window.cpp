// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "window.hpp"

namespace gi {

void show_window(renderer&, const settings&) {
    throw usage_error("this program is built without GLFW (libglfw3-dev), which --window needs");
}

} // namespace gi
