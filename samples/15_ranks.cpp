// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// One voxelization over several machines, by MPI: mpiexec -n 4 15_ranks. Each rank makes a part of a ring of spheres,
// the ranks agree on slabs, and each writes its own layers into one file, spheres.raw: the mean brightness of each
// voxel as a float, x fastest. Another resolution: 15_ranks 512.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/slabs/mpi.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

struct light {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(vp::exact::fma(f.normal.z, 0.5f, 0.5f), 1u);
    }
};

void add_sphere(std::vector<glm::vec3>& positions, std::vector<glm::uvec3>& triangles, glm::dvec3 centre,
                double radius) {
    constexpr unsigned around = 200, down = 100;
    const auto first = static_cast<unsigned>(positions.size());
    for (unsigned j = 0; j <= down; ++j)
        for (unsigned i = 0; i < around; ++i) {
            const double a = 6.283185307179586 * i / around, b = 3.141592653589793 * j / down;
            positions.emplace_back(
                centre + radius * glm::dvec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
        }
    for (unsigned j = 0; j < down; ++j)
        for (unsigned i = 0; i < around; ++i) {
            const unsigned p = first + j * around + i, q = first + j * around + (i + 1) % around;
            triangles.emplace_back(p, p + around, q);
            triangles.emplace_back(q, p + around, q + around);
        }
}

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    int rank = 0, ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const int n = argc > 1 ? std::atoi(argv[1]) : 256;
    vp::cpu_backend backend(1);
    const vp::grid grid = vp::fit(vp::bounding_box{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}}, {n, n, n});
    // snippet: ranks
    slabs::mpi_stream stream(MPI_COMM_WORLD, backend, grid, vp::passthrough{}, {});
    const auto [first, last] = slabs::share_of(40, rank, ranks); // of 40 spheres
    for (auto i = first; i < last; ++i) {
        std::vector<glm::vec3> positions;
        std::vector<glm::uvec3> triangles;
        const double a = 6.283185307179586 * static_cast<double>(i) / 40;
        add_sphere(positions, triangles, {std::cos(a), 0.2 * std::sin(3 * a), std::sin(a)}, 0.25);
        stream.add({positions, triangles}).or_throw();
    }
    MPI_File file;
    MPI_File_open(MPI_COMM_WORLD, "spheres.raw", MPI_MODE_CREATE | MPI_MODE_WRONLY, MPI_INFO_NULL, &file);
    using targets = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::add>,
                                    vp::target<std::uint32_t, vp::blend::count>>;
    const vp::status s = stream.draw(
        light{},
        [&](glm::ivec3 extent) {
            return targets{backend, extent};
        },
        [&](const slabs::slab& part, const targets& drawn) {
            std::vector<float> mean = vp::get<0>(drawn).to_host(backend);
            const std::vector<std::uint32_t> count = vp::get<1>(drawn).to_host(backend);
            for (std::size_t i = 0; i < mean.size(); ++i)
                mean[i] = count[i] != 0 ? mean[i] / static_cast<float>(count[i]) : 0;
            // Rows of this rank's slab, wherever its borders are.
            const glm::ivec3 e = part.where.extent, o = part.where.offset;
            for (int z = 0; z < e.z; ++z)
                for (int y = 0; y < e.y; ++y) {
                    const MPI_Offset at = ((MPI_Offset{o.z} + z) * n + o.y + y) * n + o.x;
                    MPI_File_write_at(file, at * 4,
                                      &mean[(static_cast<std::size_t>(z) * static_cast<std::size_t>(e.y) +
                                             static_cast<std::size_t>(y)) *
                                            static_cast<std::size_t>(e.x)],
                                      e.x, MPI_FLOAT, MPI_STATUS_IGNORE);
                }
            std::printf("rank %d: layers %d to %d of axis %d, %llu voxels\n", rank, o[stream.slabs().axis],
                        (o + e)[stream.slabs().axis], stream.slabs().axis,
                        static_cast<unsigned long long>(part.drawn.counts.voxels));
        });
    MPI_File_close(&file);
    // end snippet
    if (rank == 0)
        std::printf("%s: %llu triangles, %llu voxels\n", s.message().c_str(),
                    static_cast<unsigned long long>(s.counts.triangles_in),
                    static_cast<unsigned long long>(s.counts.voxels));
    MPI_Finalize();
    return s.ok() && s.counts.triangles_in == 1'600'000 && s.counts.voxels != 0 ? 0 : 1;
}
