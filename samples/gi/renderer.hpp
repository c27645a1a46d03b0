// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Renders frames of a scene; the work stands in frame.hpp, for either backend.

#include "scene.hpp"
#include "settings.hpp"
#include "stopwatch.hpp"

#include <glm/gtc/type_precision.hpp>

#include <memory>
#include <string>
#include <vector>

namespace gi {

struct frame {
    std::vector<glm::u8vec4> pixels; // rows from the top, sRGB
    stage_list milliseconds;
};

class renderer {
public:
    virtual ~renderer() = default;
    // The frame at a time of 0 to 1. Light bounces off what the call before rendered; the first call makes up for that.
    // Throws std::bad_alloc, and std::runtime_error with the library's message.
    [[nodiscard]] virtual frame render(double time) = 0;
    // The device's name, for people.
    [[nodiscard]] virtual std::string device() const = 0;
};

// Both take what they need of the scene by value. The pictures of both are the same bytes.
[[nodiscard]] std::unique_ptr<renderer> make_cpu_renderer(scene s, const settings& how);
// On the first GPU. Throws std::runtime_error where why_no_cuda says something, and with CUDA's text.
[[nodiscard]] std::unique_ptr<renderer> make_cuda_renderer(scene s, const settings& how);

// Why frames cannot be rendered on a GPU: the rest of a sentence. Empty where they can.
[[nodiscard]] std::string why_no_cuda();

} // namespace gi
