// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The one translation unit that compiles tinygltf and stb_image, as small as they go: tinygltf without file system and
// pictures (TINYGLTF_* definitions of the target), stb_image with the two formats that glTF knows and two of older
// models.
#define TINYGLTF_IMPLEMENTATION
#define STB_IMAGE_IMPLEMENTATION
#include <nlohmann/json.hpp>

#include <fstream> // tinygltf's writer wants it even with TINYGLTF_NO_FS

// Memory of stb_image is counted as all other memory of the program.
#include "stb_memory.hpp"

#include <cstring>
#include <new>
static void* new_block(std::size_t size) {
    void* const block = ::operator new(size, std::nothrow);
    if (block == nullptr) voxelize::gltf::stb_ran_out_of_memory = true;
    return block;
}
static void* resized_block(void* block, std::size_t old_size, std::size_t new_size) {
    void* const larger = new_block(new_size);
    if (larger != nullptr && block != nullptr) std::memcpy(larger, block, old_size < new_size ? old_size : new_size);
    if (larger != nullptr) ::operator delete(block);
    return larger;
}
#define STBI_MALLOC(size) new_block(size)
#define STBI_REALLOC_SIZED(block, old_size, new_size) resized_block(block, old_size, new_size)
#define STBI_REALLOC(block, size) static_assert(false)
#define STBI_FREE(block) ::operator delete(block)

#include <stb_image.h>
#include <tiny_gltf.h>

void voxelize::gltf::forget_stb_failure() { stbi__g_failure_reason = nullptr; }
