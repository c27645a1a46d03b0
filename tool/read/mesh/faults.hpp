// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Faults of a mesh's file that can be put right: an error, or with --lenient a warning.

#include "model/model_error.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace voxelize {

class mesh_faults {
public:
    // WARNINGS must outlive this.
    mesh_faults(bool lenient, std::vector<std::string>& warnings) : lenient_(lenient), warnings_(warnings) {}

    // WHAT is wrong, REMEDY is what lenient reading does about it. Throws model_error unless lenient.
    void accept(const std::string& what, const std::string& remedy) {
        if (!lenient_) {
            model_error error(what);
            error.lenient_helps = true;
            throw error;
        }
        if (is_quiet_) return;
        constexpr std::uint64_t most_lines = 20;
        if (++accepted_ <= most_lines) warnings_.push_back(what + "; " + remedy);
    }
    // PROMISED things of a name ("faces") are in the header, and FOUND in the file, which ends at PLACE.
    void promise(const std::string& name, std::uint64_t promised, std::uint64_t found, const std::string& place) {
        if (found >= promised) return;
        accept("the header promises " + std::to_string(promised) + ' ' + name + ", and the file has " +
                   std::to_string(found) + " (" + place + ')',
               "what is there is read");
    }
    // Says how many warnings were left out. What is found again is not told again.
    void finish() {
        constexpr std::uint64_t most_lines = 20;
        if (!is_quiet_ && accepted_ > most_lines)
            warnings_.push_back(std::to_string(accepted_ - most_lines) + " more faults of the file were put right");
        is_quiet_ = true;
    }

private:
    bool lenient_, is_quiet_ = false;
    std::vector<std::string>& warnings_;
    std::uint64_t accepted_ = 0;
};

} // namespace voxelize
