// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// What ranks of several hosts send each other, and how long it takes:
//
//   scripts/run_hosts.sh R [--rate RATE] mpiexec -n R bench_ranks [TRIANGLES [SIDE [none|close_holes|vote|exterior]]]
//
// TRIANGLES (4,000,000) of all ranks together, about two voxels each, lie anywhere in a grid of SIDE (512) voxels a
// side, so each rank sends away all but its own share. A rank prints the seconds of its draw(), which has the exchange,
// and the bytes that its host has sent and received meanwhile, of interface eth0. The model's bytes are 40 for each
// triangle and slab of another rank that it reaches, without what frames and MPI add.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/slabs/mpi.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

// Bytes that eth0 has received and sent; 0 without such an interface.
std::pair<std::uint64_t, std::uint64_t> interface_bytes() {
    std::ifstream file("/proc/net/dev");
    for (std::string word; file >> word;) {
        if (word != "eth0:") continue;
        std::uint64_t received = 0, sent = 0, other = 0;
        file >> received;
        for (int i = 0; i < 7; ++i) file >> other;
        file >> sent;
        return {received, sent};
    }
    return {0, 0};
}

vp::repair repair_of(const std::string& name) {
    if (name == "close_holes") return vp::repair::close_holes;
    if (name == "vote") return vp::repair::vote;
    return name == "exterior" ? vp::repair::exterior : vp::repair::none;
}

} // namespace

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    int rank = 0, ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const std::uint64_t total = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 4'000'000;
    const int side = argc > 2 ? std::atoi(argv[2]) : 512;
    const vp::repair repair = repair_of(argc > 3 ? argv[3] : "none");
    vp::grid grid;
    grid.voxel_size = {1, 1, 1};
    grid.extent = {side, side, side};
    vp::cpu_backend backend(1);
    slabs::stream_options options;
    options.is_solid = repair != vp::repair::none;
    options.repair = repair;
    options.threads = 1;

    slabs::mpi_stream stream(MPI_COMM_WORLD, backend, grid, vp::passthrough{}, options);
    const auto [first, last] = slabs::share_of(total, rank, ranks);
    std::mt19937 random(static_cast<unsigned>(rank));
    std::uniform_real_distribution<float> corner(2, static_cast<float>(side) - 2), beside(-1, 1);
    std::vector<std::pair<int, int>> reach; // layers of each triangle, from its corners
    for (std::uint64_t i = first; i < last;) {
        std::vector<glm::vec3> positions;
        std::vector<glm::uvec3> triangles;
        for (; i < last && triangles.size() < 65536; ++i) {
            const glm::vec3 a(corner(random), corner(random), corner(random));
            const auto n = static_cast<unsigned>(positions.size());
            const auto near = [&] { return a + glm::vec3(beside(random), beside(random), beside(random)); };
            positions.insert(positions.end(), {a, near(), near()});
            triangles.emplace_back(n, n + 1, n + 2);
            const float z[] = {positions[n].z, positions[n + 1].z, positions[n + 2].z};
            reach.emplace_back(static_cast<int>(std::min({z[0], z[1], z[2]})),
                               static_cast<int>(std::max({z[0], z[1], z[2]})));
        }
        stream.add({positions, triangles}).or_throw();
    }
    using bits = vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>>;
    const auto make = [&](const glm::ivec3& extent) { return bits{backend, extent}; };
    const auto sink = [](const slabs::slab&, const bits&) {};
    vp::solid_options solid;
    solid.repair = repair;
    MPI_Barrier(MPI_COMM_WORLD);
    const auto before = interface_bytes();
    const auto start = std::chrono::steady_clock::now();
    const vp::status s = repair == vp::repair::none ? stream.draw(vp::constant(true), make, sink)
                                                    : stream.draw_solid(vp::constant(true), make, sink, solid);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto after = interface_bytes();

    std::uint64_t away = 0;
    if (stream.slabs().axis == 2)
        for (const auto& [low, high] : reach)
            for (int r = 0; r < ranks; ++r) {
                const slabs::layer_range& of = stream.slabs().slabs[static_cast<std::size_t>(r)];
                away += r != rank && low < of.end && high >= of.begin ? 1 : 0;
            }
    std::printf("rank %d of %d: draw %.2f s, sent %.3f MB, received %.3f MB, model sends %.3f MB: %s, %llu voxels\n",
                rank, ranks, seconds, static_cast<double>(after.second - before.second) * 1e-6,
                static_cast<double>(after.first - before.first) * 1e-6, static_cast<double>(away) * 40e-6,
                s.message().c_str(), static_cast<unsigned long long>(s.counts.voxels));
    std::fflush(stdout);
    MPI_Finalize();
    return s.ok() ? 0 : 1;
}
