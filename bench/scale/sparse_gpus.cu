// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on 1, 2, 4, ... GPUs of one host, a slab each (slabs/devices.cuh): calls that wait, calls that do
// not, and those with the merge of all slabs on the first GPU behind them; by the host's clock, until all have ended.
// Before it is timed, each of the three is compared with one GPU's result, byte for byte, where a copy of that fits the
// host; of larger ones, numbers of bricks, voxels and fragments. --repeat-gpu draws several slabs on one GPU. Prints a
// table of medians; --out writes it as CSV too.

#include "gpu_set.cuh"
#include "mean_shaders.hpp"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;
using namespace bench;

struct options : gpu::run_options {
    int largest_mean = 1024, largest_async = 16384, repeat_gpu = 0, align = 8;
    std::uint64_t largest_compared = std::uint64_t{1} << 30; // bytes
};

struct occupancy {
    using framebuffer = vp::sparse_framebuffer<vp::cuda_backend, vp::target<vp::bit, vp::blend::bit_or>>;
    using result = vp::sparse_result<vp::target<vp::bit, vp::blend::bit_or>>;
    using vertex_shader = vp::passthrough;
    static constexpr const char* name = "occupancy";
    static auto shader() { return vp::constant(true); }
};
struct mean {
    using sum = vp::target<glm::vec4, vp::blend::add>;
    using count = vp::target<std::uint32_t, vp::blend::count>;
    using framebuffer = vp::sparse_framebuffer<vp::cuda_backend, sum, count>;
    using result = vp::sparse_result<sum, count>;
    using vertex_shader = pass_position;
    static constexpr const char* name = "mean";
    static auto shader() { return give_position{}; }
};

// Memory of one asynchronous call on its GPU.
class call_memory {
public:
    call_memory(vp::cuda_backend& backend, std::size_t bytes, const vp::workspace_limits& limits)
        : memory_(backend, bytes), view{memory_.data(), bytes, limits} {
        if (bytes == 0) throw std::runtime_error("no workspace for this call");
    }

private:
    vp::cuda_backend::buffer<unsigned char> memory_;

public:
    vp::workspace_view view;
};

void expect(bool is_equal, const char* what) {
    if (!is_equal) throw std::runtime_error(std::string("not one GPU's: ") + what);
}

// What one GPU makes, to be compared with.
template <class Kind>
struct expected {
    using host = decltype(std::declval<const typename Kind::framebuffer&>().to_host(std::declval<vp::cuda_backend&>()));
    std::uint64_t bricks = 0, voxels = 0, fragments = 0, bytes = 0;
    host contents; // if it is compared
    double ms = 0, async_ms = 0;
};
struct measured {
    double ms = 0, async_ms = 0, merged_ms = 0; // 0: not measured
    std::string compared;
};

// One kind of call of one scene in one grid, with some GPUs.
template <class Kind>
class cell {
    using result = typename Kind::result;

public:
    cell(const options& how, slabs::devices& gpus, const mesh_data& data, const vp::grid& g)
        : how_(how), gpus_(gpus), drawn_(gpus, g, vp::mesh_view<>{data.positions, data.triangles},
                                         typename Kind::vertex_shader{}, options_of_slabs()),
          results_(drawn_.size()) {}

    [[nodiscard]] measured run(expected<Kind>& one, bool is_one) {
        measured m;
        auto parts = drawn_.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
            return typename Kind::framebuffer{gpu, extent};
        });
        vp::status s;
        const auto call = [&] {
            s = drawn_.draw(Kind::shader(), parts);
            if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
            s.or_throw();
        };
        call();
        std::uint64_t bricks = 0, voxels = 0, bytes = 0;
        for (const auto& p : parts) {
            bricks += p.num_bricks();
            voxels += p.num_voxels();
            bytes += p.num_bytes();
        }
        if (is_one) one = {bricks, voxels, s.counts.fragments, bytes, {}, 0, 0};
        const bool cuts_bricks = how_.align % 8 != 0 && !is_one;
        expect((cuts_bricks || bricks == one.bricks) && voxels == one.voxels && s.counts.fragments == one.fragments,
               "counts");
        m.compared = "counts";
        if (one.bytes <= how_.largest_compared) {
            std::vector<typename expected<Kind>::host> on_host;
            for (std::size_t i = 0; i < parts.size(); ++i) on_host.push_back(parts[i].to_host(gpus_.backend(i)));
            auto joined = vp::merge(std::span<const typename expected<Kind>::host>(on_host));
            if (is_one)
                one.contents = std::move(joined);
            else
                expect(vp::same_contents(joined, one.contents), "slabs of calls that wait");
            m.compared = "bytes";
        }
        m.ms = gpu::median_ms(how_.repeat, call);
        if (drawn_.slabs()[0].where.extent.x > how_.largest_async) return m;
        std::vector<vp::workspace_limits> limits;
        for (std::size_t i = 0; i < parts.size(); ++i) {
            vp::workspace_limits l = vp::workspace_limits::for_triangles(drawn_.mesh(i).num_triangles());
            l.fragments = drawn_.slabs()[i].drawn.counts.fragments;
            l.lists_fragments = true;
            l.bricks = parts[i].num_bricks();
            l.voxels = parts[i].num_voxels();
            limits.push_back(l);
        }
        parts.clear();
        run_async(limits, one, m);
        return m;
    }

private:
    [[nodiscard]] slabs::device_options options_of_slabs() const {
        slabs::device_options o;
        o.align = how_.align;
        o.voxelize.count_voxels = false;
        return o;
    }
    void run_async(std::vector<vp::workspace_limits> limits, const expected<Kind>& one, measured& m) {
        std::vector<std::unique_ptr<call_memory>> memories;
        std::vector<vp::workspace_view> workspaces;
        const auto draw = [&] { drawn_.draw_async(Kind::shader(), results_, workspaces).or_throw(); };
        vp::status s;
        for (int tries = 0; tries < 8; ++tries) { // nodes and records are not known before
            memories.clear();
            workspaces.clear();
            for (std::size_t i = 0; i < drawn_.size(); ++i) {
                const slabs::detail::current_device device(gpus_.ordinal(i));
                const std::size_t bytes = drawn_.workspace_bytes(i, Kind::shader(), results_[i], limits[i]);
                memories.push_back(std::make_unique<call_memory>(gpus_.backend(i), bytes, limits[i]));
                workspaces.push_back(memories.back()->view);
            }
            draw();
            std::vector<vp::workspace_limits> need;
            s = drawn_.read_status(workspaces, &need);
            if (s.code != vp::status_code::capacity_exceeded) break;
            limits = need;
        }
        s.or_throw();
        expect(s.counts.fragments == one.fragments, "fragments of calls that do not wait");
        vp::workspace_limits of_whole{};
        for (const vp::workspace_limits& l : limits) {
            of_whole.bricks += l.bricks;
            of_whole.voxels += l.voxels;
            of_whole.nodes += l.nodes;
        }
        const slabs::detail::current_device device(gpus_.ordinal(0));
        const std::size_t bytes = vp::merge_workspace_bytes(std::span<const result>(results_), workspaces, of_whole);
        const call_memory for_whole(gpus_.backend(0), bytes, of_whole);
        result whole;
        const auto merge = [&] { drawn_.merge_async(results_, workspaces, 0, whole, for_whole.view).or_throw(); };
        merge();
        vp::read_status(gpus_.backend(0), for_whole.view).or_throw();
        if (m.compared == "bytes")
            expect(vp::same_contents(whole.to_host(gpus_.backend(0)), one.contents), "the merge");
        m.async_ms = gpu::median_ms(how_.repeat, [&] {
            draw();
            drawn_.read_status(workspaces).or_throw();
        });
        m.merged_ms = gpu::median_ms(how_.repeat, [&] {
            draw();
            merge();
            vp::read_status(gpus_.backend(0), for_whole.view).or_throw();
        });
        if (m.compared == "bytes") // what was timed last
            expect(vp::same_contents(whole.to_host(gpus_.backend(0)), one.contents), "the last merge");
    }

    const options& how_;
    slabs::devices& gpus_;
    slabs::device_slabs<typename Kind::vertex_shader> drawn_;
    std::vector<result> results_;
};

int run(const options& how, const std::string& command) {
    std::vector<int> ordinals = slabs::devices::all();
    if (ordinals.empty()) throw std::runtime_error("no GPU");
    gpu::keep_memory(ordinals);
    if (how.repeat_gpu > 0) ordinals.assign(static_cast<std::size_t>(how.repeat_gpu), ordinals[0]);
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "output", "bricks", "voxels", "fragments", "result_MiB", "gpus", "ms",
                "efficiency", "async_ms", "async_efficiency", "merged_ms", "compared"});
    std::vector<std::string> notes;
    bool failed = false;
    const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
    for (const std::string& name : how.names.empty() ? available_scenes(how.scenes, notes) : how.names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const auto measure = [&]<class Kind>(Kind, int n) {
            try {
                expected<Kind> one;
                for (std::size_t k = 1; k <= ordinals.size(); k *= 2) {
                    slabs::devices gpus({ordinals.begin(), ordinals.begin() + static_cast<std::ptrdiff_t>(k)},
                                        how.repeat_gpu == 0);
                    measured m;
                    {
                        cell<Kind> c(how, gpus, data, vp::fit(data.positions, glm::ivec3(n)));
                        m = c.run(one, k == 1);
                    }
                    gpu::trim_pools(gpus);
                    watch.read();
                    if (k == 1) {
                        one.ms = m.ms;
                        one.async_ms = m.async_ms;
                    }
                    const auto efficiency = [&](double alone, double together) {
                        return together > 0 ? significant(alone / (static_cast<double>(k) * together)) : std::string{};
                    };
                    rows.add_row({data.name, std::to_string(n), Kind::name, std::to_string(one.bricks),
                                  std::to_string(one.voxels), std::to_string(one.fragments),
                                  significant(static_cast<double>(one.bytes) / (1 << 20), 4), std::to_string(k),
                                  ms(m.ms), efficiency(one.ms, m.ms), ms(m.async_ms),
                                  efficiency(one.async_ms, m.async_ms), ms(m.merged_ms), m.compared});
                    say(data.name + " " + std::to_string(n) + " " + Kind::name + ", GPUs: " + std::to_string(k) + ": " +
                        ms(m.ms) + " ms, without waits " + ms(m.async_ms) + ", merged " + ms(m.merged_ms) + ", same " +
                        m.compared);
                }
            } catch (const std::exception& e) {
                failed = true;
                notes.push_back("failed: " + data.name + " " + std::to_string(n) + " " + Kind::name + ": " + e.what());
                say(notes.back());
                (void)cudaGetLastError();
            }
        };
        for (const int n : how.resolutions) {
            measure(occupancy{}, n);
            if (n <= how.largest_mean) measure(mean{}, n);
        }
    }
    gpu::write_report(
        how,
        {"Sparse framebuffers on several GPUs of one host",
         "gpu_sparse_scale",
         "by the host's clock until all GPUs have ended, mesh on the devices",
         {"ms: calls that wait and allocate; async_ms: calls in memory of the caller; merged_ms: the same "
          "and the merge of all slabs on the first GPU",
          "efficiency: the time of one GPU over the number of GPUs times theirs"},
         notes,
         {}},
        watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {1024, 4096};
    gpu::command line("bench_gpu_sparse_gpus",
                      "Sparse framebuffers: one GPU against several of the same host, a slab each", how,
                      "gpu_sparse_scale.md and gpu_sparse_scale.csv");
    line.add_meshes();
    line.add("--largest-mean", how.largest_mean, "Largest grid of the mean");
    line.add("--largest-async", how.largest_async, "Largest grid of calls that do not wait");
    line.add("--largest-compared", how.largest_compared, "Bytes of the largest result that is compared");
    line.add("--align", how.align, "Slabs begin at multiples of so many voxels");
    line.add("--repeat-gpu", how.repeat_gpu, "Draw on the first GPU alone, as so many; 0: on all GPUs");
    return line.run(argc, argv, [&](const std::string& command) { return run(how, command); });
}
