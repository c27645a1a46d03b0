// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Out of core: a generated mesh that is never there as a whole, voxelized within a budget of memory.
//
//   bench_out_of_core [TRIANGLES [RESOLUTION [BUDGET_MIB [FOLDER [SLABS [REPAIR]]]]]]
//   bench_out_of_core 1000000000 16384 16384 /scratch      # 10^9 triangles into 16,384^3
//   bench_out_of_core 20000000 1024 256 /var/tmp 0 vote    # its inside; close_holes and exterior too
//
// The mesh is a relief over a unit square, of two triangles for each of its cells, some strips at a time. Voxels go
// into a sparse framebuffer of one bit, whose bricks are counted, added to a checksum that no cut of the grid changes,
// and dropped. Prints seconds of making the mesh, of binning and of drawing, bytes that went through files, those of
// them that the system wrote to the medium and read from it meanwhile, and peak memory. The medium's own rate is
// measured first: a file of 1 GiB, or of as much as the bins take if that is less, in the same folder, written until
// the medium has it and read past the cache. The rate reached is the time that the medium alone would take for the
// bytes, over that of binning and drawing; 80 % is aimed at. The folder needs about 42 bytes a triangle. SLABS is as
// many as leave a slab of mean size a third of the budget's room, so that few slabs have to be cut again.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/slabs/stream.hpp>

#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Rows [first, last) of a relief of n x n cells, 2 n triangles each; by all cores.
void make_strips(std::uint64_t n, std::uint64_t first, std::uint64_t last, std::vector<glm::vec3>& positions,
                 std::vector<glm::uvec3>& triangles) {
    const std::uint64_t rows = last - first, up = n + 1;
    positions.resize((rows + 1) * up);
    triangles.resize(2 * n * rows);
    vp::core::parallel_for(std::max(1u, std::thread::hardware_concurrency()), rows + 1, [&](unsigned, std::size_t row) {
        for (std::uint64_t i = 0; i <= n; ++i) {
            const double x = static_cast<double>(i) / static_cast<double>(n),
                         y = static_cast<double>(first + row) / static_cast<double>(n);
            const double waves = 0.5 + 0.25 * std::sin(9 * x + 4 * y) + 0.12 * std::sin(31 * y - 17 * x);
            positions[row * up + i] = {x, y, waves + 0.02 * std::sin(240 * x) * std::cos(220 * y)};
        }
        for (std::uint64_t i = 0; row < rows && i < n; ++i) {
            const auto at = static_cast<unsigned>(row * up + i), above = static_cast<unsigned>(at + up);
            triangles[2 * (row * n + i)] = {at, at + 1, above};
            triangles[2 * (row * n + i) + 1] = {at + 1, above + 1, above};
        }
    });
}

// A sum over bricks, whichever slabs they come in.
template <class Bits>
std::uint64_t checksum(const Bits& part) {
    const vp::brick_table table = part.view().table;
    std::atomic<std::uint64_t> sum = 0;
    constexpr std::uint64_t block = 4096;
    vp::core::parallel_for(std::max(1u, std::thread::hardware_concurrency()), (table.count + block - 1) / block,
                           [&](unsigned, std::size_t b) {
                               std::uint64_t of_block = 0;
                               for (std::uint64_t i = b * block; i < std::min(table.count, (b + 1) * block); ++i) {
                                   std::uint64_t h = table.keys[i] * 0x9e3779b97f4a7c15u;
                                   for (const std::uint64_t word : table.masks[i].words)
                                       h = (h ^ (h >> 29) ^ word) * 0xbf58476d1ce4e5b9u;
                                   of_block += h ^ (h >> 32);
                               }
                               sum += of_block;
                           });
    return sum;
}

struct disk_rate {
    double write = 0, read = 0; // bytes a second
};
disk_rate measure_disk(const std::string& folder, std::uint64_t bytes) {
    std::string name = folder + "/voxelpipe-XXXXXX";
    const int file = ::mkstemp(name.data());
    if (file < 0) throw std::runtime_error("cannot make a temporary file in " + folder);
    (void)::unlink(name.c_str());
    std::vector<std::byte> block(std::size_t{4} << 20);
    for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<std::byte>(i * 2654435761u >> 13);
    const auto size = static_cast<ssize_t>(block.size());
    const std::uint64_t blocks = (bytes + block.size() - 1) / block.size();
    bool good = true;
    const double start = seconds();
    for (std::uint64_t n = 0; n < blocks; ++n) good = good && ::write(file, block.data(), block.size()) == size;
    good = good && ::fdatasync(file) == 0;
    const double written = seconds();
    (void)::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
    good = good && ::lseek(file, 0, SEEK_SET) == 0;
    const double begin = seconds();
    for (std::uint64_t n = 0; n < blocks; ++n) good = good && ::read(file, block.data(), block.size()) == size;
    const double read = seconds();
    (void)::close(file);
    if (!good) throw std::runtime_error("the disk refuses " + std::to_string(bytes) + " bytes in " + folder);
    const auto total = static_cast<double>(blocks * block.size());
    return {total / (written - start), total / (read - begin)};
}

// Bytes that this process has written and read so far: through files, and to and from the medium.
struct traffic {
    double written = 0, read = 0, medium_written = 0, medium_read = 0;
};
traffic traffic_so_far() {
    traffic t;
    std::ifstream file("/proc/self/io");
    std::string key;
    for (double value = 0; file >> key >> value;) {
        if (key == "wchar:") t.written = value;
        if (key == "rchar:") t.read = value;
        if (key == "write_bytes:") t.medium_written = value;
        if (key == "read_bytes:") t.medium_read = value;
    }
    return t;
}

vp::repair repair_of(const std::string& name) {
    for (const auto& [known, kind] : {std::pair{"none", vp::repair::none},
                                      {"close_holes", vp::repair::close_holes},
                                      {"vote", vp::repair::vote},
                                      {"exterior", vp::repair::exterior}})
        if (name == known) return kind;
    throw std::runtime_error("no repair " + name);
}

int run(int argc, char** argv) {
#ifdef M_ARENA_MAX
    // Memory that one thread frees serves the others. By default glibc keeps some for each thread, which the peak
    // shows.
    (void)mallopt(M_ARENA_MAX, 1);
#endif
    const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
    const auto side = static_cast<std::uint64_t>(std::sqrt(number(1, 1e6) / 2));
    const int resolution = static_cast<int>(number(2, 1024));
    slabs::stream_options options;
    options.memory = static_cast<std::uint64_t>(number(3, 64)) << 20;
    options.folder = argc > 4 ? argv[4] : "/tmp";
    options.align = 8;
    options.voxel_bytes = 0.02; // of a relief's bricks, a voxel of the grid
    options.repair = repair_of(argc > 6 ? argv[6] : "none");
    options.is_solid = argc > 6;
    if (options.is_solid) options.voxel_bytes = 0; // an estimate
    const auto triangles_asked = 2.0 * static_cast<double>(side * side);
    constexpr double slab_triangle = 304; // bytes that a slab's call takes for one
    const double fitting = 3 * slab_triangle * triangles_asked / (0.75 * static_cast<double>(options.memory));
    options.num_slabs = static_cast<int>(number(5, 0));
    if (options.num_slabs == 0) options.num_slabs = static_cast<int>(std::clamp(fitting, 64.0, 1024.0));
    const double bin_bytes = triangles_asked * sizeof(slabs::record<vp::no_varyings>);
    const disk_rate disk =
        measure_disk(options.folder, static_cast<std::uint64_t>(std::min(bin_bytes, double{1 << 30})) + 1);

    vp::cpu_backend backend;
    const vp::grid grid = vp::fit(vp::bounding_box{{0, 0, 0}, {1, 1, 1}}, {resolution, resolution, resolution});
    slabs::stream stream(backend, grid, vp::passthrough{}, options);
    const traffic before = traffic_so_far();
    double making = 0, binning = 0, sinking = 0;
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    const std::uint64_t rows = std::max<std::uint64_t>(1, (1 << 20) / (2 * side)); // a million triangles at a time
    for (std::uint64_t row = 0; row < side; row += rows) {
        const double start = seconds();
        make_strips(side, row, std::min(side, row + rows), positions, triangles);
        const double made = seconds();
        stream.add({positions, triangles}).or_throw();
        making += made - start;
        binning += seconds() - made;
    }
    using bits = vp::sparse_framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>>;
    std::uint64_t bricks = 0, voxels = 0, parts = 0, sum = 0;
    const double start = seconds();
    const auto make = [&](glm::ivec3 extent) { return bits{backend, extent}; };
    const auto sink = [&](const slabs::slab&, const bits& part) {
        const double begin = seconds();
        ++parts;
        bricks += part.num_bricks();
        voxels += part.num_voxels();
        sum += checksum(part);
        sinking += seconds() - begin;
    };
    const vp::status s = options.is_solid
                             ? stream.draw_solid(vp::constant(true), make, sink, {.repair = options.repair})
                             : stream.draw(vp::constant(true), make, sink);
    const double drawing = seconds() - start - sinking;
    const traffic after = traffic_so_far();
    const double written = after.written - before.written, read = after.read - before.read;
    const double alone = written / disk.write + read / disk.read;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const double n = static_cast<double>(s.counts.triangles_in);
    std::printf("%s\n%.0f triangles, %d^3, budget %.0f MiB\n", s.message().c_str(), n, resolution,
                static_cast<double>(options.memory >> 20));
    std::printf(
        "making   %9.2f s\nbinning  %9.2f s, %.1f ns a triangle\ndrawing  %9.2f s, %.1f ns a triangle, %llu slabs\n",
        making, binning, 1e9 * binning / n, drawing, 1e9 * drawing / n, static_cast<unsigned long long>(parts));
    std::printf("bins     %9.2f GB written, %.2f GB read; medium %.0f MB/s written, %.0f MB/s read\n", written / 1e9,
                read / 1e9, disk.write / 1e6, disk.read / 1e6);
    std::printf("         %9.2f GB written to the medium until then, %.2f GB read from it\n",
                (after.medium_written - before.medium_written) / 1e9, (after.medium_read - before.medium_read) / 1e9);
    std::printf("rate     %9.2f s for the medium alone, %.0f %% of its rate reached, by %u cores\n", alone,
                100 * alone / (binning + drawing), std::thread::hardware_concurrency());
    std::printf("voxels   %llu in %llu bricks, checksum %016llx\npeak     %.0f MiB\n",
                static_cast<unsigned long long>(voxels), static_cast<unsigned long long>(bricks),
                static_cast<unsigned long long>(sum), static_cast<double>(usage.ru_maxrss) / 1024);
    return s.ok() && voxels == s.counts.voxels && s.counts.triangles_drawn == s.counts.triangles_in ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& e) { // such as a folder that is not there, or is full
        std::fprintf(stderr, "bench_out_of_core: %s\n", e.what());
        return 1;
    }
}
