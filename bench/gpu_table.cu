// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The paper's table on one GPU: five scenes x 128, 512, 1024 x bit conservative, bit thin, reproducible float add
// conservative, A-buffer thin and conservative. Median milliseconds of 20 calls after 3 warm-ups, CUDA events around
// the whole call (clear and the wait for the counters included), mesh resident on the device. `async` is
// voxelize_async.
//   gpu_table FOLDER_OF_VPM_FILES [SCENE RESOLUTION] > table.csv

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace vp = voxelpipe;

namespace {

struct mesh_data {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
};

mesh_data read_vpm(const std::string& path) {
    mesh_data m;
    std::ifstream in(path, std::ios::binary);
    char magic[8];
    std::uint32_t counts[2];
    if (!in.read(magic, 8) || std::memcmp(magic, "VPMESH1", 8) != 0) return m;
    in.read(reinterpret_cast<char*>(counts), 8);
    m.positions.resize(counts[0]);
    m.triangles.resize(counts[1]);
    in.read(reinterpret_cast<char*>(m.positions.data()), static_cast<std::streamsize>(sizeof(glm::vec3) * counts[0]));
    in.read(reinterpret_cast<char*>(m.triangles.data()), static_cast<std::streamsize>(sizeof(glm::uvec3) * counts[1]));
    return m;
}

double median_ms(cudaStream_t stream, const std::function<void()>& call) {
    cudaEvent_t start, stop;
    cudaEventCreate(&start);
    cudaEventCreate(&stop);
    std::vector<float> times;
    for (int i = 0; i < 23; ++i) {
        cudaEventRecord(start, stream);
        call();
        cudaEventRecord(stop, stream);
        cudaEventSynchronize(stop);
        float ms = 0;
        cudaEventElapsedTime(&ms, start, stop);
        if (i >= 3) times.push_back(ms);
    }
    cudaEventDestroy(start);
    cudaEventDestroy(stop);
    std::nth_element(times.begin(), times.begin() + 10, times.end());
    return times[10];
}

template <class Target, class Value>
void framebuffer_cell(const char* scene, int n, const char* cell, vp::cuda_backend& be,
                      const vp::mesh<vp::cuda_backend>& mesh, const vp::grid& g, vp::coverage rule, Value value) {
    vp::framebuffer<vp::cuda_backend, Target> fb{be, g.extent};
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::solid<Value>>;
    const draw d{mesh.view(), {}, vp::constant(value)};
    const std::span<const draw> draws(&d, 1);
    const vp::voxelize_options options{rule, false};
    vp::status s;
    const double ms = median_ms(be.stream, [&] { s = vp::voxelize(be, draws, g, fb, options); });
    s.or_throw();
    vp::workspace_limits limits = vp::workspace_limits::for_triangles(mesh.view().triangles.size());
    double async_ms = -1;
    for (int tries = 0; tries < 4; ++tries) {
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), options, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        vp::voxelize_async(be, draws, g, fb.view(), options, workspace).or_throw();
        if (!vp::read_status(be, workspace, &limits).ok()) continue;
        async_ms = median_ms(be.stream, [&] { (void)vp::voxelize_async(be, draws, g, fb.view(), options, workspace); });
        break;
    }
    std::printf("%s,%d,%s,%.4f,%.4f,%llu\n", scene, n, cell, ms, async_ms,
                static_cast<unsigned long long>(s.counts.fragments));
    std::fflush(stdout);
}

void list_cell(const char* scene, int n, const char* cell, vp::cuda_backend& be, const vp::mesh<vp::cuda_backend>& mesh,
               const vp::grid& g, vp::coverage rule) {
    vp::abuffer<vp::cuda_backend> lists{be};
    vp::status s;
    const double ms = median_ms(
        be.stream, [&] { s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists, rule); });
    s.or_throw();
    std::printf("%s,%d,%s,%.4f,,%llu\n", scene, n, cell, ms, static_cast<unsigned long long>(s.counts.fragments));
    std::fflush(stdout);
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: gpu_table FOLDER_OF_VPM_FILES\n");
        return 2;
    }
    // Freed memory stays in the pool of this program's device, as a program that calls often would have it.
    cudaMemPool_t pool = nullptr;
    std::uint64_t keep = ~std::uint64_t{0};
    cudaDeviceGetDefaultMemPool(&pool, 0);
    cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep);
    cudaStream_t stream;
    cudaStreamCreate(&stream);
    std::printf("scene,resolution,cell,ms,async_ms,fragments\n");
    for (const char* scene : {"conference", "dragon", "blade", "hairball", "asiandragon"}) {
        const mesh_data m = read_vpm(std::string(argv[1]) + "/" + scene + ".vpm");
        if (m.triangles.empty() || (argc > 2 && std::string(argv[2]) != scene)) continue;
        for (const int n : {128, 512, 1024}) {
            if (argc > 3 && std::atoi(argv[3]) != n) continue;
            vp::cuda_backend be{stream};
            const vp::grid g = vp::fit(m.positions, glm::ivec3(n));
            const vp::mesh<vp::cuda_backend> mesh{be, m.positions, m.triangles};
            using bits = vp::target<vp::bit, vp::blend::bit_or>;
            using sum = vp::target<float, vp::blend::add>;
            framebuffer_cell<bits>(scene, n, "bit_conservative", be, mesh, g, vp::coverage::conservative, true);
            framebuffer_cell<bits>(scene, n, "bit_thin", be, mesh, g, vp::coverage::thin, true);
            framebuffer_cell<sum>(scene, n, "float_add_conservative", be, mesh, g, vp::coverage::conservative, 1.0f);
            list_cell(scene, n, "abuffer_thin", be, mesh, g, vp::coverage::thin);
            list_cell(scene, n, "abuffer_conservative", be, mesh, g, vp::coverage::conservative);
        }
    }
    cudaStreamDestroy(stream);
}
