// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "mesh_file.hpp"

#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include <fcntl.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace bench {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little, "the file's numbers are little-endian");

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
    throw std::runtime_error(file.string() + ": " + what);
}

// True if `program arguments...` ended with success; its output is dropped.
bool run_program(const std::string& program, const std::vector<std::string>& arguments) {
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int started = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (started != 0) return false;
    int state = 0;
    while (waitpid(child, &state, 0) < 0)
        if (errno != EINTR) return false;
    return WIFEXITED(state) && WEXITSTATUS(state) == 0;
}

// The first process unpacks, others wait for it.
class cache_lock {
public:
    explicit cache_lock(const fs::path& file) : descriptor_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
        if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX) != 0) fail(file, "cannot be locked");
    }
    cache_lock(const cache_lock&) = delete;
    cache_lock& operator=(const cache_lock&) = delete;
    ~cache_lock() { ::close(descriptor_); }

private:
    int descriptor_;
};

fs::path unpack(const fs::path& packed) {
    const fs::path cache = VOXELPIPE_SCENE_CACHE;
    const fs::path plain = cache / (packed.stem().string() + ".vpm");
    fs::create_directories(cache);
    const cache_lock lock(plain.string() + ".lock");
    if (fs::exists(plain) && fs::last_write_time(plain) >= fs::last_write_time(packed)) return plain;
    const fs::path part = plain.string() + ".part";
    const std::string script = (packed.parent_path() / "vpmesh.py").string();
    if (!run_program(VOXELPIPE_SCENE_PYTHON, {script, "decode", packed.string(), part.string()}))
        fail(packed, "cannot be unpacked by " VOXELPIPE_SCENE_PYTHON " " + script);
    fs::rename(part, plain);
    return plain;
}

} // namespace

mesh_data read_vpm(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) fail(file, "cannot be opened");
    char magic[8];
    std::uint32_t counts[2];
    in.read(magic, sizeof magic);
    in.read(reinterpret_cast<char*>(counts), sizeof counts);
    if (!in || std::memcmp(magic, "VPMESH1", sizeof magic) != 0) fail(file, "is no VPM file");
    const std::uint64_t expected = 16 + 12 * (std::uint64_t{counts[0]} + counts[1]);
    if (fs::file_size(file) != expected) fail(file, "has another size than its header says");
    mesh_data m;
    m.name = file.stem().string();
    m.positions.resize(counts[0]);
    m.triangles.resize(counts[1]);
    static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::uvec3) == 12);
    in.read(reinterpret_cast<char*>(m.positions.data()), static_cast<std::streamsize>(12 * m.positions.size()));
    in.read(reinterpret_cast<char*>(m.triangles.data()), static_cast<std::streamsize>(12 * m.triangles.size()));
    if (!in) fail(file, "cannot be read");
    for (const glm::uvec3& t : m.triangles)
        if (t.x >= counts[0] || t.y >= counts[0] || t.z >= counts[0]) fail(file, "has an index out of range");
    return m;
}

mesh_data read_mesh(const fs::path& file) { return read_vpm(file.extension() == ".vpz" ? unpack(file) : file); }

bool has_scene(const fs::path& folder, std::string_view name, std::string& why) {
    why.clear();
    const std::string stem(name);
    if (folder.empty())
        why = "no folder of scenes";
    else if (fs::exists(folder / (stem + ".vpm")))
        return true;
    else if (!fs::exists(folder / (stem + ".vpz")))
        why = "no " + stem + ".vpm or .vpz in " + folder.string();
    else if (std::string_view(VOXELPIPE_SCENE_PYTHON).empty())
        why = "no Python with numpy to unpack " + stem + ".vpz";
    else
        return true;
    return false;
}

mesh_data load_scene(const fs::path& folder, std::string_view name) {
    std::string why;
    if (!has_scene(folder, name, why)) throw std::runtime_error(why);
    const std::string stem(name);
    const fs::path plain = folder / (stem + ".vpm");
    mesh_data m = read_mesh(fs::exists(plain) ? plain : folder / (stem + ".vpz"));
    m.name = stem;
    if (name == "blade" || name == "asiandragon") m.note = "split decimation";
    if (name == "hairball") m.note = "procedural stand-in";
    return m;
}

} // namespace bench
