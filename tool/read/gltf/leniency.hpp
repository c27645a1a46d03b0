// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Treatment of files that break the specification in a way that can be put right: an error, or with --lenient a
// warning.

#include "read/gltf_scene.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace voxelize::gltf {

class leniency {
public:
    // WARNINGS must outlive this.
    leniency(bool lenient, std::vector<std::string>& warnings) : lenient_{lenient}, warnings_{warnings} {}

    // WHAT is wrong, REMEDY is what lenient loading does about it. Throws gltf_error unless lenient.
    void accept(const std::string& what, const std::string& remedy) {
        if (!lenient_) {
            gltf_error error(what);
            error.lenient_helps = true;
            throw error;
        }
        constexpr std::uint64_t most_lines = 20;
        if (++accepted_ <= most_lines) warnings_.push_back(what + "; " + remedy);
        if (accepted_ > most_lines) ++unnamed_;
    }

    [[nodiscard]] bool lenient() const { return lenient_; }

    [[nodiscard]] std::vector<std::string>& warnings() const { return warnings_; }

    // Appends how many warnings were left out.
    void finish() {
        if (unnamed_ != 0)
            warnings_.push_back(std::to_string(unnamed_) + " more faults of the file were put right by --lenient");
        unnamed_ = 0;
    }

private:
    bool lenient_;
    std::vector<std::string>& warnings_;
    std::uint64_t accepted_ = 0;
    std::uint64_t unnamed_ = 0;
};

} // namespace voxelize::gltf
