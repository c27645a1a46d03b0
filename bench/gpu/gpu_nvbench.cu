// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The GPU table's cells under NVBench, for its statistics, its stopping criteria and its flush of the L2 cache between
// calls, which bench_gpu_table leaves out. Scenes come from the folder VOXELPIPE_SCENES in the environment; one that is
// absent is replaced by a generated mesh, as there. NVBench's own options choose, e.g. -a scene=dragon -a
// resolution=[512,1024] --csv out.csv.

#include "cells.hpp"
#include "scene_choice.hpp"

#include <nvbench/nvbench.cuh>

#include <algorithm>
#include <cstdlib>
#include <memory>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct loaded_scene {
    std::string name;
    mesh_data data;
    gpu::resident_mesh mesh;
};

gpu::session& shared_session() {
    static gpu::session s;
    return s;
}

// The last scene is kept: NVBench goes through the other axes first.
const loaded_scene& scene(const std::string& name) {
    static std::unique_ptr<loaded_scene> kept;
    if (kept != nullptr && kept->name == name) return *kept;
    kept = nullptr;
    const char* const told = std::getenv("VOXELPIPE_SCENES");
    const std::string folder = told != nullptr ? told : VOXELPIPE_SCENES_DIR;
    std::vector<std::string> notes;
    const auto scene_number = std::find(scene_names.begin(), scene_names.end(), name) - scene_names.begin();
    mesh_data data = find_mesh(folder, available_scenes(folder, notes).at(static_cast<std::size_t>(scene_number)));
    gpu::resident_mesh mesh = gpu::upload(data);
    kept = std::make_unique<loaded_scene>(loaded_scene{name, std::move(data), std::move(mesh)});
    return *kept;
}

void voxelize(nvbench::state& state) {
    const loaded_scene& s = scene(state.get_string("scene"));
    const auto n = static_cast<int>(state.get_int64("resolution"));
    gpu_cell kind{};
    if (!parse(state.get_string("cell"), kind)) {
        state.skip("no such cell");
        return;
    }
    gpu::session& session = shared_session();
    session.trim();
    state.set_cuda_stream(nvbench::make_cuda_stream_view(session.stream()));
    const auto cell = gpu::prepare(session, s.mesh, vp::fit(s.data.positions, glm::ivec3(n)), kind);
    state.add_element_count(cell->call().fragments, "fragments");
    auto& mesh_name = state.add_summary("voxelpipe/mesh");
    mesh_name.set_string("name", "mesh");
    mesh_name.set_string("value", s.data.name);
    // The call waits on the host.
    state.exec(nvbench::exec_tag::sync, [&](nvbench::launch&) { (void)cell->call(); });
}

std::vector<std::string> strings(const auto& names) {
    std::vector<std::string> out;
    for (const auto& n : names) out.emplace_back(n);
    return out;
}
std::vector<std::string> cell_names() {
    std::vector<std::string> out;
    for (const gpu_cell c : gpu_cells) out.emplace_back(name_of(c));
    return out;
}

} // namespace

NVBENCH_BENCH(voxelize)
    .add_int64_axis("resolution", {128, 512, 1024})
    .add_string_axis("cell", cell_names())
    .add_string_axis("scene", strings(scene_names));

NVBENCH_MAIN
