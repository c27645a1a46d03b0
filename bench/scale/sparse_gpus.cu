// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on 1, 2, 4, ... GPUs of one host, a slab each (slabs/devices.cuh): calls that wait, calls that do
// not, and those with the merge of all slabs on the first GPU behind them; by the host's clock, until all have ended.
// Before it is timed, each of the three is compared with one GPU's result, byte for byte, where a copy of that fits the
// host; of larger ones, numbers of bricks, voxels and fragments. --repeat-gpu draws several slabs on one GPU. Prints a
// table of medians; --out writes it as CSV too.

#include "device_record.hpp"
#include "machine.hpp"
#include "output.hpp"
#include "scene_choice.hpp"
#include "session.hpp"
#include "table.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;
using namespace bench;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR, out;
    std::vector<std::string> names;
    std::vector<int> resolutions{1024, 4096};
    gpu::repetition repeat;
    int largest_mean = 1024, largest_async = 16384, repeat_gpu = 0;
    std::uint64_t largest_compared = std::uint64_t{1} << 30; // bytes
};

double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
template <class Call>
double median_ms(const gpu::repetition& how, const Call& call) {
    for (int i = 0; i < how.warmups; ++i) call();
    std::vector<double> times;
    const double start = now_ms();
    while (static_cast<int>(times.size()) < how.runs &&
           (static_cast<int>(times.size()) < how.least_runs || now_ms() - start < 1000 * how.seconds)) {
        const double begin = now_ms();
        call();
        times.push_back(now_ms() - begin);
    }
    return summarize(times).median;
}

struct position_varying {
    glm::vec4 value;
};
struct pass_position {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<position_varying> operator()(const Vertex& v) const {
        return {v.position, {glm::vec4(v.position, 1.0f)}};
    }
};
struct give_position {
    VOXELPIPE_HD vp::output<glm::vec4, std::uint32_t> operator()(const vp::fragment<position_varying>& f) const {
        return vp::outputs(f.varyings.value, 1u);
    }
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
                                         typename Kind::vertex_shader{}, options_of_slabs(g)),
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
        expect(bricks == one.bricks && voxels == one.voxels && s.counts.fragments == one.fragments, "counts");
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
        m.ms = median_ms(how_.repeat, call);
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
    [[nodiscard]] static slabs::device_options options_of_slabs(const vp::grid& g) {
        slabs::device_options o;
        o.align = g.extent.x > 2048 ? 128 : 8; // whole nodes of the index, where it has any
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
        m.async_ms = median_ms(how_.repeat, [&] {
            draw();
            drawn_.read_status(workspaces).or_throw();
        });
        m.merged_ms = median_ms(how_.repeat, [&] {
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

// Memory that is freed stays with each GPU's pool, as in a program that calls often.
void keep_memory(int ordinal) {
    cudaMemPool_t pool = nullptr;
    std::uint64_t all = ~std::uint64_t{0};
    gpu::check(cudaDeviceGetDefaultMemPool(&pool, ordinal), "pool");
    gpu::check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &all), "pool");
}
void trim_pools(const slabs::devices& gpus) {
    gpus.for_each(gpus.size(), [&](std::size_t i, vp::cuda_backend& backend) {
        cudaMemPool_t pool = nullptr;
        gpu::check(cudaStreamSynchronize(backend.stream), "wait");
        gpu::check(cudaDeviceGetDefaultMemPool(&pool, gpus.ordinal(i)), "pool");
        gpu::check(cudaMemPoolTrimTo(pool, 0), "pool");
    });
}

int run(const options& how, const std::string& command) {
    std::vector<int> ordinals = slabs::devices::all();
    if (ordinals.empty()) throw std::runtime_error("no GPU");
    for (const int o : ordinals) keep_memory(o);
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
                    trim_pools(gpus);
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
    std::string text =
        "# Sparse framebuffers on several GPUs of one host\n\n" + gpu::describe_device(watch) +
        "- commit: " + describe_machine().commit + "\n- date: " + describe_machine().date + "\n" +
        "- clocks over the run: " + watch.range() + "\n- command: `" + command +
        "`\n- milliseconds, medians of at most " + std::to_string(how.repeat.runs) +
        " calls by the host's clock until all GPUs have ended, mesh on the devices\n"
        "- ms: calls that wait and allocate; async_ms: calls in memory of the caller; merged_ms: the same "
        "and the merge of all slabs on the first GPU\n"
        "- efficiency: the time of one GPU over the number of GPUs times theirs\n";
    for (const std::string& note : notes) text += "- " + note + "\n";
    text += "\n" + rows.markdown();
    std::cout << text;
    if (!how.out.empty()) {
        write_file(std::filesystem::path(how.out) / "gpu_sparse_scale.md", text);
        write_file(std::filesystem::path(how.out) / "gpu_sparse_scale.csv", rows.csv());
    }
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"Sparse framebuffers: one GPU against several of the same host, a slab each"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes (.vpm or .vpz)")->capture_default_str();
    app.add_option("--mesh", how.names, "A scene, a generated mesh or a file; may be repeated. Default: five scenes");
    app.add_option("--resolution", how.resolutions, "Voxels a side; may be repeated")->capture_default_str();
    app.add_option("--runs", how.repeat.runs, "Timed calls a figure, at most")->capture_default_str();
    app.add_option("--seconds", how.repeat.seconds, "Fewer calls once they took so long")->capture_default_str();
    app.add_option("--largest-mean", how.largest_mean, "Largest grid of the mean")->capture_default_str();
    app.add_option("--largest-async", how.largest_async, "Largest grid of calls that do not wait")
        ->capture_default_str();
    app.add_option("--largest-compared", how.largest_compared, "Bytes of the largest result that is compared")
        ->capture_default_str();
    app.add_option("--repeat-gpu", how.repeat_gpu, "Draw on the first GPU alone, as so many; 0: on all GPUs")
        ->capture_default_str();
    app.add_option("--out", how.out, "Folder for gpu_sparse_scale.md and gpu_sparse_scale.csv");
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_gpu_sparse_gpus: %s\n", e.what());
        return 1;
    }
}
