// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "obj_outline.hpp"

#include "import.hpp"
#include "model/memory.hpp"
#include "obj_text.hpp"
#include "read/gltf/resources.hpp"
#include "read/isolated.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace voxelize::assimp {
namespace {

// A run's number as two coordinates that floats hold.
constexpr std::size_t number_base = std::size_t{1} << 20;

constexpr std::uint64_t most_memory = std::uint64_t{256} << 20;

// In a process of its own, which takes no more than the budget has left, so that both stay within it. assimp holds a
// block of 16 MiB of a file twice, however short that is.
model read_isolated(std::span<const std::byte> bytes, const std::string& name, const gltf_file_reader& read_file) {
    isolation_limits limits;
    limits.memory = limits.result = std::min(most_memory, memory::room());
    try {
        return from_bytes(run_isolated([&] { return to_bytes(read_model(bytes, name, read_file)); }, limits, "assimp"));
    } catch (const isolation_memory_error&) {
        if (limits.memory == most_memory) throw;
        throw obj_refusal("assimp, which reads its groups and cuts its polygons, has " +
                          memory::mebibytes(static_cast<double>(limits.memory)) + " of the memory left");
    }
}

} // namespace

void obj_outline::add_structure(std::string_view line) { text_.append(line).push_back('\n'); }

void obj_outline::add_run() {
    text_ += "v " + std::to_string(num_runs_ % number_base) + ' ' + std::to_string(num_runs_ / number_base) +
             " 0\nf -1 -1 -1\n";
    ++num_runs_;
}

obj_outline::parts obj_outline::read(const std::filesystem::path& file) const {
    parts result;
    try {
        result.source = read_isolated(std::as_bytes(std::span(text_.data(), text_.size())), file.filename().string(),
                                      gltf::folder_reader(file.parent_path()));
    } catch (const isolation_memory_error&) {
        throw obj_refusal("it has too many objects, groups and changes of material");
    }
    for (const primitive& part : result.source.primitives) {
        std::vector<std::uint32_t>& runs = result.runs.emplace_back();
        for (const glm::uvec3& t : part.triangles) {
            const glm::vec3& p = part.positions[t.x];
            constexpr auto end = static_cast<float>(number_base);
            if (!(p.x >= 0 && p.x < end && p.y >= 0 && p.y < end)) wire_reader::fail();
            const std::size_t run = static_cast<std::size_t>(p.x) + number_base * static_cast<std::size_t>(p.y);
            if (run >= num_runs_) wire_reader::fail();
            runs.push_back(static_cast<std::uint32_t>(run));
        }
    }
    return result;
}

std::vector<glm::uvec3> cut_polygons(std::span<const glm::vec3> corners, std::span<const std::uint32_t> sizes) {
    // PLY, which holds the very bits of positions.
    const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                               std::to_string(corners.size()) +
                               "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                               std::to_string(sizes.size()) + "\nproperty list uint uint vertex_indices\nend_header\n";
    std::vector<std::byte> bytes;
    const auto put = [&bytes](std::span<const std::byte> more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
    put(std::as_bytes(std::span(header.data(), header.size())));
    put(std::as_bytes(corners));
    std::vector<std::uint32_t> face;
    std::uint32_t next = 0;
    for (const std::uint32_t size : sizes) {
        face.assign(1, size);
        for (std::uint32_t i = 0; i < size; ++i) face.push_back(next++);
        put(std::as_bytes(std::span(face.data(), face.size())));
    }
    model cut = read_isolated(bytes, "polygons.ply", {});
    for (primitive& part : cut.primitives)
        if (!part.triangles.empty()) {
            if (part.positions.size() != corners.size()) wire_reader::fail();
            return std::move(part.triangles);
        }
    return {};
}

} // namespace voxelize::assimp
