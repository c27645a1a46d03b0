// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Several GPUs of one host: each cell is drawn by the first GPU alone, and by 2, 3, ... of all GPUs, which have a slab
// each (slabs/devices.cuh); in the same run, by the host's clock around calls that wait. Efficiency is the time of one
// GPU over the number of GPUs times theirs. Before it is timed, a cell is gathered on the first GPU and compared there
// with what that GPU drew alone, where both fit. One GPU works for two where there is no other. Prints a table of
// medians; --out writes it as CSV too. Cells of solids, with their repairs, are measured where they are asked for.

#include "gpu_set.cuh"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;
using namespace bench;

struct options : gpu::run_options {
    std::vector<std::string> cells{"bit", "float_add", "abuffer"};
    double triangle_bytes = slabs::device_options{}.triangle_bytes;
};

constexpr std::pair<const char*, vp::repair> solids[] = {{"solid", vp::repair::none},
                                                         {"close_holes", vp::repair::close_holes},
                                                         {"vote", vp::repair::vote},
                                                         {"exterior", vp::repair::exterior}};

struct words_differ {
    const std::uint32_t *a, *b;
    unsigned long long* count;
    __device__ void operator()(std::uint64_t i) const {
        if (a[i] != b[i]) atomicAdd(count, 1ull);
    }
};

struct measured {
    double ms = 0, binning_ms = 0, first_ms = 0, gather_ms = 0;
    std::string compared; // with the result of one GPU
    std::string slabs_ms; // each GPU's own call, on its own
};

struct surfaces {};

// One kind of call of one scene in one grid. Kind: surfaces, or the vp::solid_options of solids.
template <class Output, class Shader, class Kind>
class cell {
    static constexpr bool is_list = slabs::detail::is_abuffer<Output>, is_solid = !std::is_same_v<Kind, surfaces>;

public:
    cell(const options& how, const slabs::devices& one, const mesh_data& data, int n, const Shader& shader,
         const Kind& kind)
        : how_(how), data_(data), grid_(vp::fit(data.positions, glm::ivec3(n))), shader_(shader), kind_(kind),
          backend_(one.backend(0)), mesh_(backend_, data.positions, data.triangles),
          whole_(make(backend_, grid_.extent)) {
        options_.count_voxels = is_list;
        one_ms_ = gpu::median_ms(how_.repeat, [&] {
            if constexpr (is_solid)
                last_ = vp::voxelize_solid(backend_, mesh_, grid_, vp::passthrough{}, shader_, whole_, kind_);
            else
                last_ = vp::voxelize(backend_, mesh_, grid_, vp::passthrough{}, shader_, whole_, options_);
            if (last_.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(last_.message());
            last_.or_throw();
        });
    }
    [[nodiscard]] double one_ms() const { return one_ms_; }
    [[nodiscard]] const vp::counters& counts() const { return last_.counts; }

    [[nodiscard]] measured draw_with(slabs::devices& gpus) {
        measured m;
        slabs::device_options cut;
        cut.voxelize = options_;
        cut.may_turn = false;
        cut.voxel_bytes = slabs::detail::bytes_per_voxel<Output>;
        cut.triangle_bytes = how_.triangle_bytes;
        if constexpr (is_solid) {
            cut.is_solid = true;
            cut.repair = kind_.repair;
        }
        const vp::mesh_view<> view{data_.positions, data_.triangles};
        using slabs_type = slabs::device_slabs<vp::passthrough>;
        const auto make_parts = [](slabs_type& drawn) {
            return drawn.make([](vp::cuda_backend& backend, glm::ivec3 extent) { return make(backend, extent); });
        };
        vp::status s;
        const auto call = [&](slabs_type& drawn, std::vector<Output>& parts) {
            if constexpr (is_solid)
                s = drawn.draw_solid(shader_, parts, kind_);
            else
                s = drawn.draw(shader_, parts);
            s.or_throw();
        };
        { // loads the kernels on all GPUs
            slabs_type drawn(gpus, grid_, view, vp::passthrough{}, cut);
            auto parts = make_parts(drawn);
            call(drawn, parts);
        }
        double begin = gpu::now_ms();
        slabs_type drawn(gpus, grid_, view, vp::passthrough{}, cut);
        m.binning_ms = gpu::now_ms() - begin;
        auto parts = make_parts(drawn);
        begin = gpu::now_ms();
        call(drawn, parts);
        m.first_ms = gpu::now_ms() - begin;
        compare(drawn, gpus, parts, s, m);
        m.ms = gpu::median_ms(how_.repeat, [&] { call(drawn, parts); });
        if constexpr (!is_solid) // the call of a solid's slab needs what the others found
            time_alone(drawn, gpus, parts, m);
        return m;
    }

private:
    [[nodiscard]] static Output make(vp::cuda_backend& backend, glm::ivec3 extent) {
        if constexpr (is_list)
            return Output{backend};
        else
            return Output{backend, extent};
    }
    // Each slab's call while the other GPUs rest.
    void time_alone(slabs::device_slabs<vp::passthrough>& drawn, slabs::devices& gpus, std::vector<Output>& parts,
                    measured& m) {
        for (std::size_t i = 0; i < drawn.size(); ++i) {
            double ms = 0;
            gpus.for_each(i + 1, [&](std::size_t k, vp::cuda_backend& backend) {
                if (k != i) return;
                ms = gpu::median_ms(how_.repeat, [&] {
                    vp::voxelize(backend, drawn.mesh(i), drawn.slabs()[i].where, vp::passthrough{}, shader_, parts[i],
                                 options_)
                        .or_throw();
                });
            });
            m.slabs_ms += (i == 0 ? "" : " ") + significant(ms);
        }
    }
    template <class Slabs>
    void compare(Slabs& drawn, slabs::devices& gpus, std::vector<Output>& parts, const vp::status& s, measured& m) {
        if (!(s.counts == last_.counts) || !(s.solid == last_.solid))
            throw std::runtime_error("other counts than one GPU's");
        m.compared = "counts";
        if constexpr (is_list) {
            vp::host_abuffer<void> joined;
            for (std::size_t i = 0; i < parts.size(); ++i)
                slabs::append(joined, grid_, drawn.slabs()[i], parts[i].to_host(gpus.backend(i)));
            const auto expected = whole_.to_host(backend_);
            if (joined.voxels != expected.voxels || joined.offsets != expected.offsets ||
                joined.primitives != expected.primitives)
                throw std::runtime_error("other lists than one GPU's");
            m.compared = "lists";
        } else {
            if (grid_.extent.x > 1024) return; // one framebuffer of the whole is enough
            Output gathered = make(backend_, grid_.extent);
            gpu::check(cudaStreamSynchronize(backend_.stream), "wait");
            m.gather_ms =
                gpu::median_ms({1, 3, 1, 1}, [&] { drawn.template gather<0>(parts, gathered.view()).or_throw(); });
            const auto& a = vp::get<0>(whole_).view();
            const auto& b = vp::get<0>(gathered).view();
            using element = std::remove_cvref_t<decltype(*a.elements)>;
            using map = typename std::remove_cvref_t<decltype(a)>::map;
            static_assert(sizeof(element) == sizeof(std::uint32_t));
            vp::cuda_backend::buffer<unsigned long long> count(backend_, std::vector<unsigned long long>(1));
            backend_.for_each(map::elements(grid_.extent),
                              words_differ{reinterpret_cast<const std::uint32_t*>(a.elements),
                                           reinterpret_cast<const std::uint32_t*>(b.elements), count.data()});
            if (count.to_host(backend_)[0] != 0) throw std::runtime_error("other voxels than one GPU's");
            m.compared = "voxels";
        }
    }

    const options& how_;
    const mesh_data& data_;
    vp::grid grid_;
    Shader shader_;
    Kind kind_;
    vp::voxelize_options options_;
    vp::cuda_backend& backend_;
    vp::mesh<vp::cuda_backend> mesh_;
    Output whole_;
    vp::status last_;
    double one_ms_ = 0;
};

int run(const options& how, const std::string& command) {
    using bits = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, vp::blend::bit_or>>;
    using sums = vp::framebuffer<vp::cuda_backend, vp::target<float, vp::blend::add>>;
    using lists = vp::abuffer<vp::cuda_backend>;
    std::vector<int> ordinals = slabs::devices::all();
    if (ordinals.empty()) throw std::runtime_error("no GPU");
    gpu::keep_memory(ordinals);
    if (ordinals.size() == 1) ordinals.push_back(ordinals[0]);
    slabs::devices one({ordinals[0]});
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "cell", "triangles", "fragments", "gpus", "one_ms", "ms", "efficiency",
                "slabs_ms", "binning_ms", "first_ms", "gather_ms", "compared"});
    std::vector<std::string> notes;
    bool failed = false;
    for (const std::string& name : how.names.empty() ? available_scenes(how.scenes, notes) : how.names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const auto measure = [&]<class Output>(std::type_identity<Output>, const char* kind, int n, auto shader,
                                               auto how_drawn) {
            if (std::find(how.cells.begin(), how.cells.end(), kind) == how.cells.end()) return;
            try {
                gpu::trim_pools(one);
                cell<Output, decltype(shader), decltype(how_drawn)> c(how, one, data, n, shader, how_drawn);
                for (std::size_t k = 2; k <= ordinals.size(); ++k) {
                    slabs::devices gpus({ordinals.begin(), ordinals.begin() + static_cast<std::ptrdiff_t>(k)});
                    const measured m = c.draw_with(gpus);
                    gpu::trim_pools(gpus);
                    watch.read();
                    const double efficiency = c.one_ms() / (static_cast<double>(k) * m.ms);
                    rows.add_row({data.name, std::to_string(n), kind, std::to_string(c.counts().triangles_in),
                                  std::to_string(c.counts().fragments), std::to_string(k), significant(c.one_ms(), 4),
                                  significant(m.ms, 4), significant(efficiency), m.slabs_ms, significant(m.binning_ms),
                                  significant(m.first_ms), m.gather_ms > 0 ? significant(m.gather_ms) : "",
                                  m.compared});
                    say(data.name + " " + std::to_string(n) + " " + kind + ", " + std::to_string(k) +
                        " GPUs: " + significant(c.one_ms(), 4) + " -> " + significant(m.ms, 4) + " ms, slabs " +
                        m.slabs_ms + ", same " + m.compared);
                }
            } catch (const std::exception& e) {
                failed = true;
                notes.push_back("failed: " + data.name + " " + std::to_string(n) + " " + kind + ": " + e.what());
                say(notes.back());
                (void)cudaGetLastError();
            }
        };
        for (const int n : how.resolutions) {
            measure(std::type_identity<bits>{}, "bit", n, vp::constant(true), surfaces{});
            measure(std::type_identity<sums>{}, "float_add", n, vp::constant(0.7f), surfaces{});
            measure(std::type_identity<lists>{}, "abuffer", n, vp::constant(true), surfaces{});
            for (const auto& [kind, repair] : solids)
                measure(std::type_identity<bits>{}, kind, n, vp::constant(true), vp::solid_options{.repair = repair});
        }
    }
    std::string used = "GPUs:";
    for (const int o : ordinals) used += " " + std::to_string(o);
    gpu::write_report(
        how,
        {"Several GPUs of one host",
         "gpu_scale",
         "by the host's clock, allocations and waits included, mesh on the devices",
         {used,
          "slabs_ms: the slab of each GPU while the others rest; binning_ms: copying the mesh to all "
          "GPUs, cutting and binning, once a mesh, with the search of close_holes and vote; first_ms: the first call "
          "behind it, which floods for exterior; gather_ms: all slabs to the first GPU"},
         notes,
         {}},
        watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {512, 1024, 2048};
    gpu::command line("bench_gpu_gpus", "One GPU against several of the same host, a slab each", how,
                      "gpu_scale.md and gpu_scale.csv");
    line.add_meshes();
    std::vector<std::string> cells = how.cells;
    for (const auto& [kind, repair] : solids) cells.emplace_back(kind);
    line.add("--cell", how.cells, "What is drawn, bit, float_add and abuffer by default; may be repeated", cells);
    line.add("--triangle-bytes", how.triangle_bytes, "What a triangle costs when the grid is cut");
    return line.run(argc, argv, [&](const std::string& command) { return run(how, command); });
}
