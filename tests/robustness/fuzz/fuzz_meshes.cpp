// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// libFuzzer target over the reader of one format, VOXELPIPE_FUZZ_FORMAT. The first byte chooses the options, the rest
// is the file. Whatever the bytes are, a valid scene or a model_error of one printable line comes out; where there is a
// scene there is a stream of the same triangles, or a refusal. Compiled with VOXELPIPE_FUZZ_REPLAY it is a plain
// program that runs the files and folders it is given.
#include "model/model_error.hpp"
#include "read/mesh/mesh_formats.hpp"
#include "read/mesh/mesh_scene.hpp"
#include "read/mesh/mesh_stream.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

namespace {

constexpr const char* format = VOXELPIPE_FUZZ_FORMAT;

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "fuzz_%s: %s\n", format, what);
    std::abort();
}

// The bytes as a file in memory, under a name of the format.
class memory_file {
public:
    memory_file(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("model", MFD_CLOEXEC)) {
        require(descriptor_ >= 0 && write(descriptor_, data, size) == static_cast<ssize_t>(size), "no file in memory");
        const std::filesystem::path target = "/proc/self/fd/" + std::to_string(descriptor_);
        path_ = std::filesystem::temp_directory_path() / ("fuzz_" + std::to_string(getpid()) + '.' + format);
        std::error_code error;
        std::filesystem::remove(path_, error);
        std::filesystem::create_symlink(target, path_, error);
        require(!error, "no name for the file");
    }
    ~memory_file() {
        std::error_code error;
        std::filesystem::remove(path_, error);
        close(descriptor_);
    }
    memory_file(const memory_file&) = delete;
    memory_file& operator=(const memory_file&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    int descriptor_;
    std::filesystem::path path_;
};

// The promises of scene.hpp to everyone behind the loader.
void check(const voxelize::scene& scene) {
    for (const voxelize::primitive& part : scene.primitives) {
        require(part.material < scene.materials.size(), "material out of range");
        require(part.texcoords.empty() || part.texcoords.size() == part.positions.size(), "texcoords of wrong length");
        require(part.colors.empty() || part.colors.size() == part.positions.size(), "colors of wrong length");
        for (const glm::uvec3& t : part.triangles)
            require(t.x < part.positions.size() && t.y < part.positions.size() && t.z < part.positions.size(),
                    "vertex index out of range");
        for (const glm::uvec2& l : part.lines)
            require(l.x < part.positions.size() && l.y < part.positions.size(), "end of a line out of range");
    }
    for (const voxelize::instance& shown : scene.instances)
        require(shown.primitive < scene.primitives.size() && shown.to_world.is_finite(), "instance out of range");
}

void check(std::string_view text) {
    require(!text.empty(), "error without text");
    for (const char c : text) require(c >= ' ' && c <= '~', "error with a character that is not printable");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2) return 0;
    const memory_file file(data + 1, size - 1);
    voxelize::gltf_limits limits;
    limits.base_memory = std::uint64_t{16} << 20;
    limits.max_image_side = 1024;
    voxelize::gltf_options options;
    options.lenient = (data[0] & 1U) != 0;
    options.colors = (data[0] & 2U) == 0;
    voxelize::scene scene;
    try {
        scene = voxelize::scene_of(*voxelize::open_mesh(file.path(), options), file.path(), limits, options);
        check(scene);
    } catch (const voxelize::model_error& error) {
        check(error.what());
        return 0;
    }
    try {
        const voxelize::opened_stream opened =
            voxelize::stream_of(voxelize::open_mesh(file.path(), options), file.path(), {1 << 20, 0},
                                std::filesystem::temp_directory_path(), limits, options);
        require((opened.stream != nullptr) == opened.refusal.empty(), "neither a stream nor a refusal");
        if (!opened.stream) return 0;
        std::uint64_t found = 0;
        opened.stream->for_each_block([&](const voxelize::triangle_stream::block& block) {
            require(block.first_number == found, "triangles that are out of order");
            found += block.corners.size() / 3;
            require(block.colors.empty() || block.colors.size() == block.corners.size(), "colors of wrong length");
        });
        require(found == scene.triangle_count() && found == opened.stream->num_triangles(),
                "a stream of other triangles");
    } catch (const voxelize::model_error&) {
        require(false, "a model that is loaded is no stream");
    }
    return 0;
}

#ifdef VOXELPIPE_FUZZ_REPLAY
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
