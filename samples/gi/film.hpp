// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The output of frames: a picture, a film by ffmpeg, or a picture a frame where there is no ffmpeg.

#include "settings.hpp"

#include <glm/gtc/type_precision.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace gi {

class film {
public:
    virtual ~film() = default;
    // The next frame: rows from the top, of the size that the film was opened with. Throws voxelize::write_error.
    virtual void add(const std::vector<glm::u8vec4>& pixels) = 0;
    // After the last frame. Returns the files. Without it a film that was begun may stay unfinished.
    virtual std::vector<std::filesystem::path> finish() = 0;
};

// Opens settings::output: a .png for one frame; a .png a frame, numbered, for several or without ffmpeg; otherwise a
// film. Throws usage_error for a name of another kind, voxelize::write_error where the folder is not there.
[[nodiscard]] std::unique_ptr<film> open_film(const settings& s);

} // namespace gi
