// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "window.hpp"

#include <GLFW/glfw3.h>

#include <chrono>

namespace gi {

void show_window(renderer& r, const settings& s) {
    if (glfwInit() == GLFW_FALSE) throw usage_error("--window finds no display");
    struct closer {
        ~closer() { glfwTerminate(); }
    } const at_end{};
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    GLFWwindow* const window = glfwCreateWindow(s.width, s.height, "gi: voxel cone tracing", nullptr, nullptr);
    if (window == nullptr) throw usage_error("--window cannot open a window of this size");
    glfwMakeContextCurrent(window);
    glPixelZoom(1.0f, -1.0f); // rows from the top
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    const auto start = std::chrono::steady_clock::now();
    while (glfwWindowShouldClose(window) == GLFW_FALSE) {
        // As quickly as it is rendered, at the pace of a film of 30 frames a second.
        const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start;
        const frame made = r.render(s.still ? s.start : s.start + since.count() * 30 / s.round);
        glRasterPos2f(-1.0f, 1.0f);
        glDrawPixels(s.width, s.height, GL_RGBA, GL_UNSIGNED_BYTE, made.pixels.data());
        glfwSwapBuffers(window);
        glfwPollEvents();
        if (glfwGetKey(window, GLFW_KEY_ESCAPE) == GLFW_PRESS) glfwSetWindowShouldClose(window, GLFW_TRUE);
    }
}

} // namespace gi
