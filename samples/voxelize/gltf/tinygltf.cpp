// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The one translation unit that compiles tinygltf and stb_image, as small as they go: tinygltf without file system and
// pictures (TINYGLTF_* definitions of the target), stb_image with the two formats that glTF knows.
#define TINYGLTF_IMPLEMENTATION
#define STB_IMAGE_IMPLEMENTATION
#include <nlohmann/json.hpp>

#include <fstream> // tinygltf's writer wants it even with TINYGLTF_NO_FS

#include <stb_image.h>
#include <tiny_gltf.h>
