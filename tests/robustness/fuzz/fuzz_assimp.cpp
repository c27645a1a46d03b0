// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// libFuzzer target over the formats that assimp reads. The first byte chooses the format, the rest is the file; or the
// rest is what the process that runs assimp sends back, as a hostile file may make it. Whatever the bytes are, a valid
// scene or a model_error of one printable line comes out; anything else is a finding. Compiled with
// VOXELPIPE_FUZZ_REPLAY it is a plain program that runs the files and folders it is given.
#include <read/assimp/wire.hpp>
#include <read/assimp_scene.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

namespace {

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "fuzz_assimp: %s\n", what);
    std::abort();
}

// The promises of scene.hpp to everyone behind the loader, but for pictures.
void check(const std::vector<voxelize::primitive>& primitives, const std::vector<voxelize::instance>& instances,
           std::size_t num_materials) {
    for (const voxelize::primitive& part : primitives) {
        require(part.material < num_materials, "material out of range");
        require(part.texcoords.empty() || part.texcoords.size() == part.positions.size(), "texcoords of wrong length");
        require(part.colors.empty() || part.colors.size() == part.positions.size(), "colors of wrong length");
        for (const glm::uvec3& t : part.triangles)
            require(t.x < part.positions.size() && t.y < part.positions.size() && t.z < part.positions.size(),
                    "vertex index out of range");
    }
    for (const voxelize::instance& shown : instances)
        require(shown.primitive < primitives.size() && shown.to_world.is_finite(), "instance out of range");
}

void check(const voxelize::model_error& error) {
    const std::string_view text = error.what();
    require(!text.empty(), "error without text");
    for (const char c : text) require(c >= ' ' && c <= '~', "error with a character that is not printable");
}

} // namespace

// The process of its own has no bound on its address space under AddressSanitizer.
extern "C" const char* __asan_default_options() { return "max_allocation_size_mb=512"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    constexpr const char* names[] = {"m.obj", "m.dae", "m.3ds", "m.3mf"};
    const unsigned kind = data[0] % 8;
    const std::span<const std::byte> rest = std::as_bytes(std::span(data, size)).subspan(1);
    voxelize::gltf_limits limits;
    limits.base_memory = std::uint64_t{16} << 20;
    limits.max_image_side = 1024;
    limits.import_seconds = 1;
    const auto reader = [](const std::filesystem::path& path, std::uint64_t) {
        require(path.is_relative() && *path.begin() != "..", "a path that leaves the folder");
        return std::vector<std::byte>(64, std::byte{'m'});
    };
    try {
        if (kind >= 4) { // quick, and seen by the fuzzer: half of the choices
            const voxelize::assimp::model model = voxelize::assimp::from_bytes(rest);
            check(model.primitives, model.instances, model.materials.size());
            require(model.textures.size() == model.materials.size(), "textures of wrong length");
            require(voxelize::assimp::to_bytes(model).size() <= rest.size() + 4096, "it grows on its way");
        } else {
            const voxelize::scene scene = voxelize::load_by_assimp(rest, names[kind], reader, limits);
            check(scene.primitives, scene.instances, scene.materials.size());
        }
    } catch (const voxelize::model_error& error) {
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
