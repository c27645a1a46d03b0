// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Shaders that compute, on a GPU: five programs x scene x grid, conservative, by each strategy that serves them,
// forced; and two of a constant, in tiles and as they are drawn otherwise. All strategies must leave the same bytes;
// those of the first are kept and compared. Beside each time stand the floor (fragments once written and read, the grid
// cleared) and the sum of a constant by the 2011 program. Prints a table of medians; --out writes it as CSV too.

#include "../published_gpu_figures.hpp"
#include "floors.hpp"
#include "one_thread_a_triangle.hpp"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstdio>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options : gpu::run_options {
    std::vector<std::string> programs, strategies;
    bool compares = true, tracks = false;
};

// ---- the five programs ----------------------------------------------------------------------------------------------

struct height {
    float value;
};
struct pass_height {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<height> operator()(const Vertex& v) const {
        return {v.position, {v.position.z}};
    }
};
struct give_height {
    VOXELPIPE_HD vp::output<float> operator()(const vp::fragment<height>& f) const {
        return vp::outputs(f.varyings.value);
    }
};
// The sine series of the height's first terms: some dozen operations that nothing else shares.
struct give_wave {
    VOXELPIPE_HD vp::output<float> operator()(const vp::fragment<height>& f) const {
        const float x = f.varyings.value, xx = vp::exact::mul(x, x);
        float y = 1.0f / 362880;
        for (const float c : {-1.0f / 5040, 1.0f / 120, -1.0f / 6, 1.0f}) y = vp::exact::fma(y, xx, c);
        return vp::outputs(vp::exact::mul(x, y));
    }
};

struct place {
    glm::vec2 value;
};
struct pass_place {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<place> operator()(const Vertex& v) const {
        return {v.position, {glm::vec2(v.position.x, v.position.y)}};
    }
};
// Four floats of a texture that repeats 16 times over a unit, between its four nearest texels.
struct give_texel {
    static constexpr int size = 256;
    const glm::vec4* texels;

    VOXELPIPE_HD vp::output<glm::vec4, std::uint32_t> operator()(const vp::fragment<place>& f) const {
        int at[2], next[2];
        float part[2];
        for (int k = 0; k < 2; ++k) {
            const float scaled = vp::exact::mul(f.varyings.value[k], 16.0f * size);
            const auto whole = static_cast<int>(scaled);
            part[k] = vp::exact::fma(1.0f, scaled, -static_cast<float>(whole));
            at[k] = whole & (size - 1);
            next[k] = (whole + 1) & (size - 1);
        }
        glm::vec4 value;
        for (int c = 0; c < 4; ++c) {
            const auto row = [&](int y) {
                const float a = texels[y * size + at[0]][c];
                return vp::exact::fma(part[0], vp::exact::fma(1.0f, texels[y * size + next[0]][c], -a), a);
            };
            const float a = row(at[1]);
            value[c] = vp::exact::fma(part[1], vp::exact::fma(1.0f, row(next[1]), -a), a);
        }
        return vp::outputs(value, 1u);
    }
};
struct give_normal {
    VOXELPIPE_HD vp::output<glm::vec3, std::uint32_t> operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.normal, 1u);
    }
};

template <class Value, class Blend>
using target = vp::target<Value, Blend>;
using count = vp::target<std::uint32_t, vp::blend::count>;

// ---- one cell -------------------------------------------------------------------------------------------------------

// A result's words, and those of the first strategy.
class kept_words {
public:
    // True if the words are those of the first call, or this is it.
    bool agree(const gpu::session& s, const void* words, std::size_t bytes) {
        const std::size_t n = bytes / sizeof(std::uint32_t);
        if (first_.size() != n) {
            first_ = gpu::device_array<std::uint32_t>(n);
            gpu::check(cudaMemcpyAsync(first_.data(), words, bytes, cudaMemcpyDeviceToDevice, s.stream()), "copy");
            s.wait();
            return true;
        }
        return gpu::count_differences(s.stream(), static_cast<const std::uint32_t*>(words), first_.data(), n) == 0;
    }

private:
    gpu::device_array<std::uint32_t> first_;
};

struct cell {
    std::string program, strategy;
    double published_ms = 0; // of the 2011 program; 0 if it has no figure
    vp::counters counts{};
    double ms = 0, target_bytes = 0, fragment_bytes = 0;
    vp::stage_times stages{}; // of one more call
    bool differs = false;
};

struct runner {
    gpu::session& session;
    const options& how;
    const gpu::resident_mesh& mesh;
    const vp::grid& grid;
    std::vector<cell>& cells;
    std::vector<std::string>& failures;

    [[nodiscard]] bool wants(const std::vector<std::string>& names, const std::string& name) const {
        return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
    }
    // Elements of target K's memory.
    template <std::size_t K, class... Targets>
    [[nodiscard]] std::size_t elements() const {
        using type = std::tuple_element_t<K, std::tuple<Targets...>>;
        return static_cast<std::size_t>(type::map::elements(grid.extent));
    }
    // Zeros for a scene without published figures.
    [[nodiscard]] published_gpu_scene published() const {
        for (const auto& p : published_gpu_scenes)
            if (p.scene == mesh.name && p.resolution == grid.extent.x) return p;
        return {};
    }
    [[nodiscard]] vp::mesh_view<> view(vp::cuda_backend& backend) const {
        vp::mesh_view<> v{{mesh.positions.data(), mesh.positions.size()},
                          {mesh.triangles.data(), mesh.triangles.size()}};
        v.checked = vp::check_indices(backend, v.triangles);
        return v;
    }
    // Times `call`, which returns a status.
    template <class Call>
    void time(cell c, vp::cuda_backend& backend, const Call& call) {
        const auto checked = [&] {
            const vp::status s = call();
            if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
            s.or_throw();
            c.counts = s.counts;
        };
        c.ms = gpu::time_calls(session, how.repeat, checked).median;
        backend.times = &c.stages;
        checked();
        cells.push_back(std::move(c));
        say(mesh.name + " " + std::to_string(grid.extent.x) + " " + cells.back().program + " " + cells.back().strategy +
            " " + significant(cells.back().ms) + " ms");
    }
    template <class Work>
    void guarded(const std::string& name, const Work& work) {
        session.wait();
        session.trim();
        try {
            work();
        } catch (const std::exception& e) {
            failures.push_back("failed: " + mesh.name + " " + std::to_string(grid.extent.x) + " " + name + ": " +
                               e.what());
            say(failures.back());
            (void)cudaGetLastError();
        }
    }

    // A framebuffer of linear targets or of bits by two strategies, `first` and tiled.
    template <class... Targets, class VertexShader, class FragmentShader>
    void framebuffer(const std::string& program, const VertexShader& vertex, const FragmentShader& fragment,
                     double published_ms, vp::strategy first = vp::strategy::sorted_reduce) {
        if (!wants(how.programs, program)) return;
        kept_words kept[sizeof...(Targets)];
        for (const vp::strategy strategy : {first, vp::strategy::tiled}) {
            if (!wants(how.strategies, to_string(strategy))) continue;
            guarded(program, [&] {
                vp::cuda_backend backend(session.stream());
                backend.strategy = strategy;
                vp::framebuffer<vp::cuda_backend, Targets...> fb(backend, grid.extent);
                if (how.tracks) fb.track_changes(backend);
                const vp::mesh_view<> v = view(backend);
                cell c{program, to_string(strategy), published_ms};
                vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
                    const auto t = vp::get<K>(fb).view();
                    c.target_bytes += static_cast<double>(elements<K, Targets...>() * sizeof(*t.elements));
                });
                c.fragment_bytes = 16;
                time(c, backend,
                     [&] { return vp::voxelize<vp::coverage::conservative>(backend, v, grid, vertex, fragment, fb); });
                if (!how.compares) return;
                vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
                    const auto t = vp::get<K>(fb).view();
                    if (!kept[K].agree(session, t.elements, elements<K, Targets...>() * sizeof(*t.elements)))
                        cells.back().differs = true;
                });
            });
        }
    }
    // Lists with the height of each fragment.
    void lists() {
        if (!wants(how.programs, "abuffer_height") || !wants(how.strategies, "lists")) return;
        guarded("abuffer_height", [&] {
            vp::cuda_backend backend(session.stream());
            vp::abuffer<vp::cuda_backend, float> lists(backend);
            const vp::mesh_view<> v = view(backend);
            cell c{"abuffer_height", "lists", published().original_float};
            c.fragment_bytes = 24; // voxel, primitive and payload
            time(c, backend, [&] {
                return vp::voxelize<vp::coverage::conservative>(backend, v, grid, pass_height{}, give_height{}, lists);
            });
        });
    }
};

int run(const options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    const double bandwidth = gpu::copy_bandwidth(session);
    std::vector<glm::vec4> texels(give_texel::size * give_texel::size);
    for (std::size_t i = 0; i < texels.size(); ++i) {
        const auto bits = static_cast<std::uint32_t>(i) * 2654435761u;
        for (int c = 0; c < 4; ++c) texels[i][c] = static_cast<float>(bits >> 8 * c & 255u) / 255;
    }
    const gpu::device_array<glm::vec4> texture(texels.size());
    gpu::check(cudaMemcpy(texture.data(), texels.data(), texture.bytes(), cudaMemcpyHostToDevice), "texture");

    table rows({"scene", "resolution", "program", "strategy", "fragments", "ms", "floor_ms", "ms/floor", "2011_ms",
                "2011/ours", "vertex_ms", "coarse_ms", "tile_sort_ms", "split_ms", "clear_ms", "fine_ms", "resolve_ms",
                "emit_ms"});
    std::vector<std::string> notes;
    bool differ = false;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const gpu::resident_mesh mesh = gpu::upload(data);
        for (const int n : how.resolutions) {
            const vp::grid grid = vp::fit(data.positions, glm::ivec3(n));
            std::vector<cell> cells;
            runner r{session, how, mesh, grid, cells, notes};
            const published_gpu_scene published = r.published();
            const double sum = published.original_float;
            r.framebuffer<target<vp::bit, vp::blend::bit_or>>("constant_bit", vp::passthrough{}, vp::constant(true),
                                                              published.original_bit, vp::strategy::occupancy_mask);
            r.framebuffer<target<float, vp::blend::add>>("constant_sum", vp::passthrough{}, vp::constant(1.0f), sum,
                                                         vp::strategy::immediate);
            r.framebuffer<target<float, vp::blend::add>>("float_add_varying", pass_height{}, give_height{}, sum);
            r.framebuffer<target<float, vp::blend::max>>("float_max_computed", pass_height{}, give_wave{}, sum);
            r.framebuffer<target<glm::vec4, vp::blend::add>, count>("texture_mean", pass_place{},
                                                                    give_texel{texture.data()}, sum);
            r.framebuffer<target<glm::vec3, vp::blend::add>, count>("normal_mean", vp::passthrough{}, give_normal{},
                                                                    sum);
            r.lists();
            watch.read();
            for (const cell& c : cells) {
                const double floor = gpu::memset_ms(session, static_cast<std::uint64_t>(c.target_bytes)) +
                                     c.fragment_bytes * static_cast<double>(c.counts.fragments) / bandwidth * 1e3;
                const vp::stage_times& t = c.stages;
                const auto ms = [](double v) { return v > 0 ? significant(v) : std::string{}; };
                rows.add_row({data.name, std::to_string(n), c.program, c.strategy, std::to_string(c.counts.fragments),
                              significant(c.ms), significant(floor), significant(c.ms / floor),
                              c.published_ms > 0 ? plain(c.published_ms) : "", ms(c.published_ms / c.ms),
                              ms(t.vertex_shade), ms(t.coarse_raster), ms(t.tile_sort), ms(t.tile_split), ms(t.clear),
                              ms(t.fine_raster), ms(t.tile_resolve), ms(t.abuffer_emit)});
                if (!c.differs) continue;
                differ = true;
                notes.push_back("**differs**: " + data.name + " " + std::to_string(n) + " " + c.program + " " +
                                c.strategy);
                say(notes.back());
            }
        }
    }
    gpu::write_report(how,
                      {"Shaders that compute",
                       "gpu_computed",
                       "CUDA events around the whole call, clear and wait included, mesh on the device",
                       {"device copy, read and write: " + significant(bandwidth * 1e-12) + " TB/s",
                        "each strategy forced; its targets compared word by word with the first one's",
                        "floor: each fragment's pair once written and read, the targets cleared",
                        "2011: quoted from an NVIDIA H200, its bits of a constant (constant_bit) or sum of a constant",
                        "stages: of one more call, with events between them"},
                       notes,
                       {}},
                      watch, command, rows);
    return differ ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {128, 512, 1024};
    gpu::command line("bench_gpu_computed",
                      "cuda_backend's times of shaders that compute, by strategy, next to floors and published figures",
                      how, "gpu_computed.md and gpu_computed.csv");
    line.add_meshes();
    line.add("--program", how.programs,
             "constant_bit, constant_sum, float_add_varying, float_max_computed, texture_mean, normal_mean or "
             "abuffer_height; may be repeated. Default: all");
    line.add("--strategy", how.strategies,
             "occupancy_mask, immediate, sorted_reduce, tiled or lists; may be repeated. Default: all");
    line.add_flag("!--no-comparison", how.compares, "Leave out the comparison of strategies");
    line.add_flag("--track", how.tracks, "Targets track their changes");
    return line.run(argc, argv, [&](const std::string& command) { return run(how, command); });
}
