// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// libFuzzer target for the glTF loader, from memory. For any bytes, the loader returns a valid scene or throws
// gltf_error with one printable line. Anything else (crash, sanitizer report, other exception, time, memory) is a
// finding. Compiled with VOXELPIPE_FUZZ_REPLAY, it is a plain program that runs the given files and folders.
#include <read/gltf_scene.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

namespace {

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "fuzz_gltf: %s\n", what);
    std::abort();
}

// The promises of scene.hpp to code that uses a loaded scene.
void check(const voxelize::scene& scene) {
    for (const voxelize::primitive& part : scene.primitives) {
        require(part.material < scene.materials.size(), "material out of range");
        require(part.texcoords.empty() || part.texcoords.size() == part.positions.size(), "texcoords of wrong length");
        require(part.colors.empty() || part.colors.size() == part.positions.size(), "colors of wrong length");
        for (const glm::uvec3& t : part.triangles)
            require(t.x < part.positions.size() && t.y < part.positions.size() && t.z < part.positions.size(),
                    "vertex index out of range");
    }
    for (const voxelize::instance& shown : scene.instances) {
        require(shown.primitive < scene.primitives.size(), "primitive out of range");
        require(shown.to_world.is_finite(), "transform that is not finite");
    }
    for (const voxelize::material& material : scene.materials)
        require(material.texture >= -1 && material.texture < static_cast<std::int64_t>(scene.textures.size()),
                "texture out of range");
    for (const voxelize::texture& texture : scene.textures)
        require(texture.image < scene.images.size(), "image out of range");
    for (const voxelize::picture& image : scene.images)
        require(image.width > 0 && image.height > 0 && image.rgba.size() == std::size_t{4} * image.width * image.height,
                "image of wrong size");
}

void check(const voxelize::gltf_error& error) {
    const std::string_view text = error.what();
    require(!text.empty(), "error without text");
    for (const char c : text) require(c >= ' ' && c <= '~', "error with a character that is not printable");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    voxelize::gltf_limits limits; // small, so that a thousand inputs a second stay possible
    limits.base_memory = std::uint64_t{16} << 20;
    limits.max_image_side = 1024;
    const auto reader = [](const std::filesystem::path& path, std::uint64_t) {
        require(path.is_relative() && *path.begin() != "..", "a path that leaves the folder");
        return std::vector<std::byte>(64, std::byte{1});
    };
    // The length of the input decides between strict and lenient loading, and the file's pose and its first
    // animation's.
    voxelize::gltf_options options;
    options.threads = 1;
    options.lenient = size % 2 != 0;
    if (size / 2 % 2 != 0) {
        options.animation = "0";
        options.seconds = 0.5;
    }
    try {
        check(voxelize::load_gltf(std::as_bytes(std::span(data, size)), reader, limits, options));
    } catch (const voxelize::gltf_error& error) {
        check(error);
    }
    return 0;
}

#ifdef VOXELPIPE_FUZZ_REPLAY
#include <filesystem>
#include <fstream>
#include <iterator>

int main(int argc, char** argv) {
    std::size_t count = 0;
    const auto replay = [&](const std::filesystem::path& file) {
        std::ifstream stream(file, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
        ++count;
    };
    for (int i = 1; i < argc; ++i) {
        if (!std::filesystem::is_directory(argv[i])) {
            replay(argv[i]);
            continue;
        }
        for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i]))
            if (entry.is_regular_file()) replay(entry.path());
    }
    std::printf("replayed %zu files\n", count);
    return count != 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
#endif
