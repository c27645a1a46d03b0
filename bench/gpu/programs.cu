// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Programs, instances, points and lines on a GPU: tessellating the base mesh of a split scene next to drawing that
// scene, a million instances of a small mesh, ten million points, a million segments, and 10^9 triangles of 10^6
// patches in chunks. Prints a table of medians; --out writes it as CSV too.

#include "generated_meshes.hpp"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

using bits = vp::target<vp::bit, vp::blend::bit_or>;
using counts = vp::target<std::uint32_t, vp::blend::count>;
constexpr vp::coverage rule = vp::coverage::conservative;

// Every edge in the same number of parts.
struct even {
    static constexpr int max_level = 64;
    int level;
    VOXELPIPE_HD int edge_level(const vp::vertex_output<>&, const vp::vertex_output<>&) const { return level; }
    VOXELPIPE_HD glm::vec3 operator()(const vp::patch_point<vp::no_varyings>& p) const { return p.position(); }
};
// Copies in a lattice of 100 x 100 x 100.
struct placed {
    float spacing, size;
    VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
        const glm::vec3 cell(v.instance % 100, v.instance / 100 % 100, v.instance / 10000);
        return {vp::exact::fma(size, v.position.x, (cell.x + 0.5f) * spacing),
                vp::exact::fma(size, v.position.y, (cell.y + 0.5f) * spacing),
                vp::exact::fma(size, v.position.z, (cell.z + 0.5f) * spacing)};
    }
};

class program_table {
public:
    explicit program_table(const gpu::run_options& how) : how_(how), backend_(session_.stream()) {}

    // The scene was made of a base mesh by dividing each triangle into n^2, row by row.
    void tessellated(const std::string& name, unsigned n) {
        const mesh_data scene = find_mesh(how_.scenes, name);
        mesh_data base;
        std::uint32_t vertices = 0;
        for (std::size_t t = 0; t + n * n <= scene.triangles.size(); t += n * n) {
            base.triangles.emplace_back(scene.triangles[t].x, scene.triangles[t + n * n - 1].y,
                                        scene.triangles[t + 2 * (n - 1)].z);
            vertices = std::max({vertices, base.triangles.back().x, base.triangles.back().y, base.triangles.back().z});
        }
        base.positions.assign(scene.positions.begin(), scene.positions.begin() + vertices + 1);
        const vp::grid g = vp::fit(scene.positions, glm::ivec3(1024));
        const vp::mesh whole{backend_, scene.positions, scene.triangles},
            small{backend_, base.positions, base.triangles};
        vp::framebuffer<vp::cuda_backend, bits> fb{backend_, g.extent};
        const double resident =
            time([&] { return vp::voxelize<rule>(backend_, whole, g, vp::passthrough{}, vp::constant(true), fb); });
        add(name + ", resident", 1024, resident, 0);
        const double made = time([&] {
            return vp::voxelize<rule>(backend_, small, g, vp::passthrough{}, vp::tessellate{even{static_cast<int>(n)}},
                                      vp::constant(true), fb);
        });
        add(name + ", tessellated", 1024, made, resident);
    }
    void instanced() {
        const mesh_data m = icosphere(7); // 980 triangles
        const vp::mesh one{backend_, m.positions, m.triangles};
        vp::grid g;
        g.extent = glm::ivec3(1024);
        vp::framebuffer<vp::cuda_backend, bits> fb{backend_, g.extent};
        for (const std::uint64_t n : {std::uint64_t{100'000}, std::uint64_t{1'000'000}}) {
            const double ms = time([&] {
                return vp::voxelize<rule>(backend_, one.view(vp::instances{n}), g, placed{10.24f, 4.0f},
                                          vp::constant(true), fb);
            });
            add(std::to_string(n) + " instances of 980 triangles", 1024, ms, 0);
        }
    }
    void elements() {
        random_numbers random(1);
        const auto coordinate = [&] { return static_cast<float>(256.0 + 256.0 * random.signed_unit()); };
        std::vector<glm::vec3> points(10'000'000);
        for (glm::vec3& p : points) p = {coordinate(), coordinate(), coordinate()};
        vp::grid g;
        g.extent = glm::ivec3(512);
        vp::framebuffer<vp::cuda_backend, counts> fb{backend_, g.extent};
        const vp::cuda_backend::buffer<glm::vec3> there(backend_, vp::array_view<const glm::vec3>(points));
        add("10^7 points, thin, counts", 512, time([&] {
                return vp::voxelize<vp::coverage::thin>(backend_, vp::points_view<>{there.view()}, g, vp::passthrough{},
                                                        vp::constant(1u), fb);
            }),
            0);
        points.resize(2'000'000);
        for (std::size_t i = 0; i < points.size(); i += 2) {
            glm::vec3 d(random.signed_unit(), random.signed_unit(), random.signed_unit());
            points[i + 1] = points[i] + 4.0f * glm::normalize(d);
        }
        const vp::cuda_backend::buffer<glm::vec3> ends(backend_, vp::array_view<const glm::vec3>(points));
        add("10^6 segments of 4 voxels, conservative, counts", 512, time([&] {
                return vp::voxelize<rule>(backend_, vp::lines_view<>{ends.view()}, g, vp::passthrough{},
                                          vp::constant(1u), fb);
            }),
            0);
    }
    // 1.02 x 10^9 triangles, 64 chunks of 2^24; an eighth of them in the part of the grid that is drawn.
    void in_chunks() {
        const mesh_data m = triangle_soup(1'000'000, 0.002, 2);
        const vp::mesh patches{backend_, m.positions, m.triangles};
        const vp::grid whole = vp::fit(m.positions, glm::ivec3(512));
        const vp::grid g = whole.crop({0, 0, 224}, {512, 512, 64});
        vp::framebuffer<vp::cuda_backend, bits> fb{backend_, g.extent};
        how_.repeat = {1, 2, 1, 1};
        add("10^6 patches of 32^2, in chunks", 512, time([&] {
                return vp::voxelize<rule>(backend_, patches, g, vp::passthrough{}, vp::tessellate{even{32}},
                                          vp::constant(true), fb);
            }),
            0);
    }
    void print(const std::string& command) {
        gpu::write_report(
            how_,
            {"Programs, instances, points and lines on a GPU",
             "gpu_programs",
             "CUDA events around the whole call, clear and count of voxels included, inputs on the device",
             {},
             {},
             {}},
            watch_, command, rows_);
    }

private:
    template <class Call>
    double time(const Call& call) {
        status_ = call();
        status_.or_throw();
        const sample s = gpu::time_calls(session_, how_.repeat, [&] { (void)call(); });
        watch_.read();
        return s.median;
    }
    // `resident`: the time of the same triangles as a mesh on the device, or 0.
    void add(const std::string& what, int resolution, double ms, double resident) {
        const double n = static_cast<double>(status_.counts.triangles_in);
        rows_.add_row({what, std::to_string(resolution), std::to_string(status_.counts.triangles_in),
                       std::to_string(status_.counts.fragments), std::to_string(status_.counts.voxels),
                       significant(ms, 4), significant(n / ms * 1e-6, 3),
                       resident > 0 ? significant(ms / resident, 3) : std::string{}});
        say(what + " " + significant(ms) + " ms");
    }

    gpu::run_options how_;
    gpu::session session_;
    gpu::clock_watch watch_;
    vp::cuda_backend backend_;
    vp::status status_;
    table rows_{{"what", "resolution", "triangles", "fragments", "voxels", "ms", "G_triangles/s", "ms/resident"}};
};

} // namespace

int main(int argc, char** argv) {
    gpu::run_options how;
    gpu::command line("bench_gpu_programs", "cuda_backend's times of programs, instances, points and lines", how,
                      "gpu_programs.md and gpu_programs.csv");
    return line.run(argc, argv, [&](const std::string& command) {
        program_table table(how);
        table.tessellated("asiandragon", 16);
        table.tessellated("blade", 3);
        table.instanced();
        table.elements();
        table.in_chunks();
        table.print(command);
        return 0;
    });
}
