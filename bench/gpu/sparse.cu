// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on a GPU, by scene and grid: occupancy, and the sum of four varyings with a count, from which a
// shaded mean comes; the most device memory that a call takes, and what its result takes; at 1024 the same into dense
// targets, with their clear; and the fastest published figure. Prints a table of medians; --out writes it as CSV too.

#include "mean_shaders.hpp"
#include "octrees.cuh"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options : gpu::run_options {
    int largest_mean = 4096, largest_dense = 1024, largest_octree = 0, slabs = 1;
};

struct published_sparse {
    std::string_view scene;
    int resolution;
    double peer; // ms
};
// The fastest of five public sparse voxelizers on an H200; some leave out a part of the cover.
constexpr published_sparse published[] = {
    {"conference", 1024, 4.38}, {"dragon", 1024, 1.95},      {"blade", 1024, 1.60},
    {"hairball", 1024, 14.4},   {"asiandragon", 1024, 2.79},
};
double published_peer(std::string_view scene, int n) {
    for (const auto& p : published)
        if (p.scene == scene && p.resolution == n) return p.peer;
    return 0;
}

using bit = vp::target<vp::bit, vp::blend::bit_or>;
using sum = vp::target<glm::vec4, vp::blend::add>;
using count = vp::target<std::uint32_t, vp::blend::count>;

// The memory that the device's pool has given out.
class pool_watch {
public:
    pool_watch() {
        int device = 0;
        gpu::check(cudaGetDevice(&device), "pool");
        gpu::check(cudaDeviceGetDefaultMemPool(&pool_, device), "pool");
    }
    void start() {
        std::uint64_t zero = 0;
        gpu::check(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrUsedMemHigh, &zero), "pool");
    }
    [[nodiscard]] std::uint64_t peak() const {
        std::uint64_t bytes = 0;
        gpu::check(cudaMemPoolGetAttribute(pool_, cudaMemPoolAttrUsedMemHigh, &bytes), "pool");
        return bytes;
    }

private:
    cudaMemPool_t pool_ = nullptr;
};

struct measured {
    double ms = 0;
    std::uint64_t bricks = 0, voxels = 0, fragments = 0, bytes = 0, peak = 0;
    vp::stage_times stages;   // of one more call
    gpu::octree_times octree; // where it is wanted
};

// Parts of a grid along z, whole bricks of equal size.
std::vector<vp::grid> cut(const vp::grid& g, int slabs) {
    const int depth = g.extent.z / slabs;
    if (slabs < 1 || (slabs > 1 && (g.extent.z % slabs != 0 || depth % 8 != 0)))
        throw std::runtime_error("slabs of equal size are not whole bricks");
    std::vector<vp::grid> parts;
    for (int i = 0; i < slabs; ++i)
        parts.push_back(slabs == 1 ? g : g.crop({0, 0, i * depth}, {g.extent.x, g.extent.y, depth}));
    return parts;
}

// One kind of output of one scene in the parts of a grid, one after the other in the same framebuffer. A backend of its
// own, so that no memory is there before.
template <class Framebuffer, class VertexShader, class Shader>
measured measure(gpu::session& s, const gpu::resident_mesh& mesh, const std::vector<vp::grid>& parts,
                 const Shader& shader, const gpu::repetition& how, bool wants_octree = false) {
    s.wait();
    s.trim();
    vp::cuda_backend backend(s.stream());
    vp::mesh_view<> view{{mesh.positions.data(), mesh.positions.size()},
                         {mesh.triangles.data(), mesh.triangles.size()}};
    view.checked = vp::check_indices(backend, view.triangles);
    pool_watch watch;
    Framebuffer framebuffer(backend, parts[0].extent);
    measured m;
    const auto call = [&] {
        m.bricks = m.voxels = m.fragments = m.bytes = 0;
        for (const vp::grid& part : parts) {
            const vp::status last = vp::voxelize(backend, view, part, VertexShader{}, shader, framebuffer);
            if (last.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(last.message());
            last.or_throw();
            m.voxels += last.counts.voxels;
            m.fragments += last.counts.fragments;
            if constexpr (requires { framebuffer.num_bricks(); }) {
                m.bricks += framebuffer.num_bricks();
                m.bytes = std::max(m.bytes, framebuffer.num_bytes());
            }
        }
    };
    watch.start();
    call();
    s.wait();
    m.peak = watch.peak();
    m.ms = gpu::time_calls(s, how, call).median;
    backend.times = &m.stages;
    call();
    if constexpr (std::is_same_v<Framebuffer, vp::sparse_framebuffer<vp::cuda_backend, sum, count>>)
        if (wants_octree) m.octree = gpu::time_octree(s, backend, framebuffer, how);
    return m;
}

std::string mib(std::uint64_t bytes) {
    return bytes == 0 ? std::string{} : significant(static_cast<double>(bytes) / (1 << 20), 4);
}

int run(const options& how, const std::string& command) {
    using sparse_bits = vp::sparse_framebuffer<vp::cuda_backend, bit>;
    using sparse_mean = vp::sparse_framebuffer<vp::cuda_backend, sum, count>;
    using dense_bits = vp::framebuffer<vp::cuda_backend, bit>;
    using dense_mean = vp::framebuffer<vp::cuda_backend, sum, count>;
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "output", "bricks", "voxels", "fragments", "ms", "dense_ms", "peer_ms",
                "dense/ours", "peer/ours", "result_MiB", "peak_MiB", "peak/result", "coarse_ms", "sort_ms", "fine_ms",
                "resolve_ms"});
    table octrees({"scene", "resolution", "voxels", "nodes", "tree_MiB", "build_ms", "host_build_ms", "mean_ms",
                   "host_mean_ms", "dag_nodes", "dag_MiB", "dag_ms", "host_dag_ms", "rays_ms", "host_rays_ms", "hits"});
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
    const auto ratio = [](double a, double b) { return a > 0 && b > 0 ? significant(a / b) : std::string{}; };
    bool failed = false;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const gpu::resident_mesh mesh = gpu::upload(data);
        for (const int n : how.resolutions)
            for (const bool is_mean : {false, true}) {
                if (is_mean && n > how.largest_mean) continue;
                try {
                    const std::vector<vp::grid> whole{vp::fit(data.positions, glm::ivec3(n))},
                        parts = cut(whole[0], how.slabs);
                    const auto bits = vp::constant(true);
                    measured m, dense;
                    if (n <= how.largest_dense)
                        dense = is_mean ? measure<dense_mean, pass_position>(session, mesh, whole, give_position{},
                                                                             how.repeat)
                                        : measure<dense_bits, vp::passthrough>(session, mesh, whole, bits, how.repeat);
                    m = is_mean ? measure<sparse_mean, pass_position>(session, mesh, parts, give_position{}, how.repeat,
                                                                      n <= how.largest_octree && how.slabs == 1)
                                : measure<sparse_bits, vp::passthrough>(session, mesh, parts, bits, how.repeat);
                    watch.read();
                    const double peer = is_mean ? 0 : published_peer(data.name, n);
                    rows.add_row(
                        {data.name, std::to_string(n), is_mean ? "mean" : "occupancy", std::to_string(m.bricks),
                         std::to_string(m.voxels), std::to_string(m.fragments), ms(m.ms), ms(dense.ms), ms(peer),
                         ratio(dense.ms, m.ms), ratio(peer, m.ms), mib(m.bytes), mib(m.peak),
                         ratio(static_cast<double>(m.peak), static_cast<double>(m.bytes)), ms(m.stages.coarse_raster),
                         ms(m.stages.tile_sort), ms(m.stages.fine_raster), ms(m.stages.tile_resolve)});
                    if (const gpu::octree_times& t = m.octree; t.nodes != 0)
                        octrees.add_row({data.name, std::to_string(n), std::to_string(m.voxels),
                                         std::to_string(t.nodes), mib(t.bytes), ms(t.build), ms(t.host_build),
                                         ms(t.mean), ms(t.host_mean), std::to_string(t.dag_nodes), mib(t.dag_bytes),
                                         ms(t.dag), ms(t.host_dag), ms(t.rays), ms(t.host_rays),
                                         std::to_string(t.hits)});
                    say(data.name + " " + std::to_string(n) + (is_mean ? " mean " : " occupancy ") + significant(m.ms) +
                        " ms, peak " + mib(m.peak) + " MiB");
                } catch (const std::exception& e) {
                    failed = true;
                    notes.push_back("failed: " + name + " " + std::to_string(n) + (is_mean ? " mean: " : ": ") +
                                    e.what());
                    say(notes.back());
                    (void)cudaGetLastError();
                }
            }
    }
    gpu::run_report report{"Sparse framebuffers on a GPU",
                           "gpu_sparse",
                           "CUDA events around the whole call, allocations and waits included, mesh on the device",
                           {"conservative coverage; mean: the sums of four floats that vary and a count",
                            "peak: device memory that the first call takes in all, its result included",
                            "peer: quoted, the fastest of five public sparse voxelizers on an NVIDIA H200"},
                           notes,
                           {}};
    if (how.largest_octree > 0)
        report.after =
            "\nOctrees over the framebuffers of the mean, all byte-equal to the host's; host: one thread; mean: of the "
            "four sums on every level; rays: 1024 x 1024, parallel\n\n" +
            octrees.markdown();
    gpu::write_report(how, report, watch, command, rows);
    if (!how.out.empty() && how.largest_octree > 0)
        write_file(std::filesystem::path(how.out) / "gpu_octrees.csv", octrees.csv());
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {1024, 4096, 16384};
    gpu::command line("bench_gpu_sparse",
                      "cuda_backend's times and memory of sparse framebuffers next to dense ones and published figures",
                      how, "gpu_sparse.md, gpu_sparse.csv and gpu_octrees.csv");
    line.add_meshes();
    line.add("--largest-mean", how.largest_mean, "Largest grid of the mean");
    line.add("--largest-dense", how.largest_dense, "Largest grid of dense targets");
    line.add("--largest-octree", how.largest_octree, "Largest grid of octrees, of the mean; 0: none");
    line.add("--slabs", how.slabs,
             "Parts along z that sparse grids are drawn in, one after the other; result and peak are then those of the "
             "largest");
    return line.run(argc, argv, [&](const std::string& command) { return run(how, command); });
}
