// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A checked document -> tinygltf's model, without any bytes.

#include "check.hpp"
#include "text.hpp"

#include <tiny_gltf.h>

#include <string>

namespace voxelize::gltf {

// Throws gltf_error.
[[nodiscard]] inline tinygltf::Model parse(const checked_document& document) {
    tinygltf::Model model;
    tinygltf::TinyGLTF parser;
    std::string error;
    std::string warning;
    if (!parser.LoadASCIIFromString(&model, &error, &warning, document.json.data(),
                                    static_cast<unsigned int>(document.json.size()), ""))
        throw gltf_error("tinygltf: " + printable(error.substr(0, error.find('\n')), 200));
    return model;
}

} // namespace voxelize::gltf
