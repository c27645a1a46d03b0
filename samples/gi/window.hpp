// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// --window: frames on the screen, by GLFW where the program is built with it.

#include "renderer.hpp"

namespace gi {

// Returns when the window is closed. Throws usage_error if the program is built without GLFW or there is no display.
void show_window(renderer& r, const settings& s);

} // namespace gi
