// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// libFuzzer target over OBJ files and their material libraries. The bytes up to the first 0 are the model, those behind
// it the library m.mtl beside it. The model is loaded, and streamed: both give the same triangles, or a model_error of
// one printable line. Compiled with VOXELPIPE_FUZZ_REPLAY it is a plain program that runs the files and folders it is
// given.
#include <read/mesh/mesh_scene.hpp>
#include <read/mesh/mesh_stream.hpp>
#include <read/obj/reader.hpp>

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "fuzz_obj: %s\n", what);
    std::abort();
}

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
    for (const std::string& line : scene.warnings) require(!line.empty(), "warning without text");
}

std::string printable(const voxelize::model_error& error) {
    const std::string text = error.what();
    require(!text.empty(), "error without text");
    for (const char c : text) require(c >= ' ' && c <= '~', "error with a character that is not printable");
    return text;
}

// A folder of this process, removed at its end.
const fs::path& folder() {
    static const struct place {
        fs::path path = fs::temp_directory_path() / ("fuzz_obj_" + std::to_string(getpid()));
        place() { fs::create_directories(path); }
        ~place() { fs::remove_all(path); }
    } own;
    return own.path;
}

void write(const fs::path& file, std::string_view bytes) {
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view all{reinterpret_cast<const char*>(data), size};
    const std::size_t end = all.find('\0');
    const fs::path model = folder() / "m.obj";
    write(model, all.substr(0, end));
    write(folder() / "m.mtl", end == std::string_view::npos ? "" : all.substr(end + 1));
    voxelize::gltf_limits limits;
    limits.base_memory = std::uint64_t{16} << 20;
    voxelize::gltf_options options;
    options.lenient = size % 2 == 0;
    options.shading = size % 3 == 0;
    std::string refusal;
    std::uint64_t triangles = 0;
    try {
        const voxelize::scene scene = voxelize::scene_of(*voxelize::open_obj(model, options), model, limits, options);
        check(scene);
        triangles = scene.triangle_count();
    } catch (const voxelize::model_error& error) {
        refusal = printable(error);
    }
    try {
        const voxelize::opened_stream opened =
            voxelize::stream_of(voxelize::open_obj(model, options), model, {1 << 20, 0}, folder(), limits, options);
        if (!opened.stream) return 0; // it has lines or points
        require(refusal.empty(), "streamed, and not loaded");
        require(opened.stream->num_triangles() == triangles, "another number of triangles in the stream");
        std::uint64_t corners = 0;
        opened.stream->for_each_block([&](const auto& block) { corners += block.corners.size(); });
        require(corners == 3 * triangles, "another number of corners in the stream");
    } catch (const voxelize::model_error& error) {
        require(printable(error) == refusal, "another error of the stream");
    }
    return 0;
}

#ifdef VOXELPIPE_FUZZ_REPLAY
#include <iterator>

int main(int argc, char** argv) {
    std::size_t count = 0;
    const auto replay = [&](const fs::path& file) {
        std::ifstream stream(file, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
        ++count;
    };
    for (int i = 1; i < argc; ++i) {
        if (!fs::is_directory(argv[i])) {
            replay(argv[i]);
            continue;
        }
        for (const auto& entry : fs::recursive_directory_iterator(argv[i]))
            if (entry.is_regular_file()) replay(entry.path());
    }
    std::printf("replayed %zu files\n", count);
    return count != 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
#endif
