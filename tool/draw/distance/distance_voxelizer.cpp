// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "distance_voxelizer.hpp"

#include "distance_drawer.hpp"
#include "draw/cuda_device.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

bool is_of_nearest(target id) {
    return id == target::distance || id == target::nearest || id == target::color || id == target::normal ||
           id == target::material || id == target::triangle || id == target::depth;
}

distance_bytes::distance_bytes(const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double all = n.x * n.y * n.z;
    bool numbers = false, shaded = false;
    for (const target id : request.targets) {
        numbers = numbers || id == target::nearest || id == target::triangle || id == target::material;
        shaded = shaded || id != target::distance;
    }
    constexpr double triangle_bytes = 224, crossing_bytes = 16, thread_bytes = 1 << 20;
    samples = volume_bytes(request) + (numbers ? 4 * all : 0);
    if (shaded) vertex += sizeof(surface_varyings);
    triangle = triangle_bytes + (request.distance->is_signed ? crossing_bytes : 0);
    threads = thread_count(request.threads) * thread_bytes;
    if (!request.distance->is_signed) return;
    samples += all / 8; // and grids of bits: of the rows of three axes, and of the cover and what a flood reaches
    if (request.distance->sign.vote) samples += all * 3 / 8;
    if (request.distance->sign.rule == solid_rule::exterior) samples += all * 5 / 8;
}

namespace {

// Samples of the band of a surface as large as the grid's.
double band_samples(const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z;
    if (request.distance->is_whole) return samples;
    return std::min(samples, 2 * (n.x * n.y + n.y * n.z + n.z * n.x) * 2 * request.distance->band);
}
// What the writers take beside the volume, whose band they may hold in bricks.
double writer_bytes(const voxelize_request& request) {
    if (!request.write_bytes) return 0;
    const glm::dvec3 n(request.grid.extent);
    constexpr double brick_voxels = 512, filled = 0.5;
    const double band = band_samples(request);
    return request.write_bytes(std::min(band / filled, n.x * n.y * n.z) / brick_voxels, band, 0);
}

} // namespace

double written_bytes(const voxelize_request& request) {
    return request.write_bytes ? volume_bytes(request) + writer_bytes(request) : 0;
}

double held_band_bytes(const voxelize_request& request) {
    if (!request.write_bytes) return 0;
    const double held = writer_bytes(request) - request.write_bytes(0, 0, 0);
    if (held <= 0) return 0;
    const glm::dvec3 n(request.grid.extent);
    return held + volume_bytes(request) / (n.x * n.y * n.z) * band_samples(request);
}

namespace {

double distance_need(const scene& model, const voxelize_request& request) {
    return std::max(written_bytes(request), distance_bytes(request).of(static_cast<double>(model.triangle_count()),
                                                                       static_cast<double>(model.vertex_count())));
}

// A field of which two slabs are kept, so that threads that read near each other find theirs.
class late_field {
public:
    late_field(glm::ivec3 extent, std::vector<int> ends, std::function<volume(std::size_t)> draw, voxelize_stats& stats)
        : extent_(extent), ends_(std::move(ends)), draw_(std::move(draw)), stats_(stats), is_counted_(ends_.size()) {}

    // Values of a channel of the field, from number `first` on. Any thread may call it.
    void read(std::size_t channel, std::uint64_t first, std::span<std::byte> to) {
        const std::lock_guard lock(mutex_);
        const std::uint64_t layer = static_cast<std::uint64_t>(extent_.x) * static_cast<std::uint64_t>(extent_.y);
        while (!to.empty()) {
            const auto slab = static_cast<std::size_t>(
                std::upper_bound(ends_.begin(), ends_.end(), static_cast<int>(first / layer)) - ends_.begin());
            const volume& v = slab_of(slab);
            const auto& data = v.channels[channel].data;
            const auto begin = static_cast<std::uint64_t>(slab == 0 ? 0 : ends_[slab - 1]);
            const std::uint64_t values = static_cast<std::uint64_t>(v.num_voxels()), skipped = first - begin * layer;
            const std::size_t each = data.size() / static_cast<std::size_t>(values);
            const std::size_t count = std::min(to.size() / each, static_cast<std::size_t>(values - skipped));
            std::memcpy(to.data(), data.data() + static_cast<std::size_t>(skipped) * each, count * each);
            to = to.subspan(count * each);
            first += count;
        }
    }

private:
    struct kept {
        std::size_t slab = SIZE_MAX;
        volume field;
    };

    // Draws it, unless it is kept. What is drawn again is not counted again.
    const volume& slab_of(std::size_t slab) {
        if (kept_[1].slab == slab) std::swap(kept_[0], kept_[1]);
        if (kept_[0].slab == slab) return kept_[0].field;
        kept_[1] = {};
        std::swap(kept_[0], kept_[1]);
        const voxelize_stats before = stats_;
        kept_[0].field = draw_(slab);
        kept_[0].slab = slab;
        if (is_counted_[slab] != 0) stats_ = before;
        is_counted_[slab] = 1;
        return kept_[0].field;
    }

    glm::ivec3 extent_;
    std::vector<int> ends_; // layers of slabs
    std::function<volume(std::size_t)> draw_;
    voxelize_stats& stats_;
    std::vector<char> is_counted_;
    kept kept_[2];
    std::mutex mutex_;
};

// What draws slabs of a model that is held, on the CPU.
struct loaded_distances {
    scene model;
    voxelize_request request; // of the slab
    vp::cpu_backend on;
    std::optional<distance_drawer<vp::cpu_backend>> drawer; // of these

    // stats: as of run_distance_voxelizer.
    loaded_distances(scene&& moved, const voxelize_request& all, voxelize_stats& stats)
        : model(std::move(moved)), request(all), on{static_cast<unsigned>(thread_count(all.threads))} {
        request.progress = nullptr; // that of the outputs goes on
        drawer.emplace(on, model, request, stats);
    }
    [[nodiscard]] volume run(const voxelpipe::grid& whole, int begin, int end) {
        request.grid = whole.crop({0, 0, begin}, {whole.extent.x, whole.extent.y, end - begin});
        return drawer->run();
    }
};

// The request of some layers of its grid.
voxelize_request request_of_layers(const voxelize_request& request, int begin, int end) {
    voxelize_request part = request;
    part.grid = request.grid.crop({0, 0, begin}, {request.grid.extent.x, request.grid.extent.y, end - begin});
    return part;
}

// Layers of slabs of which two fit, a multiple of distance_request::slab_layers; none: the field is drawn at once.
// Throws memory_error where it cannot be.
std::optional<int> layers_of_slabs(const scene& model, const voxelize_request& request, double need) {
    const distance_request& distance = *request.distance;
    const glm::ivec3 extent = request.grid.extent;
    const auto room = static_cast<double>(memory::room());
    const int step = distance.slab_layers;
    const bool sees_all = distance.is_signed && distance.sign.rule == solid_rule::exterior;
    const bool has_slabs =
        step > 0 && extent.z > step && !distance.at_corners && !sees_all && request.backend != backend_choice::cuda;
    const double held = step > 0 ? held_band_bytes(request) : 0;
    const auto need_of = [&](int layers) {
        const voxelize_request part = request_of_layers(request, 0, std::min(extent.z, layers));
        const double drawn = held == 0 ? distance_need(model, part)
                                       : held + request.write_bytes(0, 0, 0) +
                                             distance_bytes(part).of(static_cast<double>(model.triangle_count()),
                                                                     static_cast<double>(model.vertex_count()));
        return drawn + volume_bytes(part);
    };
    std::string what = std::string(distance.is_whole ? "a whole distance field of " : "a distance field of ") +
                       std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " + std::to_string(extent.z) +
                       " samples";
    if (need <= room || !has_slabs) {
        memory::expect(need);
        memory::require(need, what, memory::fewer_voxels_hint, need);
        return std::nullopt;
    }
    const int layers = most_layers(extent.z, step, room, need_of);
    const double need_of_slabs = need_of(layers);
    memory::expect(need_of_slabs);
    memory::require(need_of_slabs, what + ", in slabs of " + std::to_string(layers) + " layers",
                    memory::fewer_voxels_hint, need_of_slabs);
    return layers;
}

} // namespace

volume make_late_volume(const voxelize_request& request, std::vector<int> ends,
                        const std::function<volume(std::size_t)>& draw, voxelize_stats& stats) {
    volume field = volume_of(request.grid);
    if (request.distance)
        field.distances = distance_field{vp::core::band_distance(options_of(*request.distance).band, request.grid),
                                         request.distance->is_signed};
    const auto drawn = std::make_shared<late_field>(request.grid.extent, std::move(ends), draw, stats);
    for (std::size_t c = 0; c < request.targets.size(); ++c) {
        const target_info& info = info_of(request.targets[c]);
        field.channels.push_back({std::string(info.name), info.type, info.components, {}});
        field.channels.back().read = [drawn, c](std::uint64_t first, std::span<std::byte> to) {
            drawn->read(c, first, to);
        };
    }
    return field;
}

bool is_drawn_late(const volume& v) { return !v.channels.empty() && v.channels.front().read != nullptr; }

void add_distance_warnings(const voxelize_request& request, voxelize_stats& stats) {
    if (stats.solid)
        if (std::string warning = open_warning(request.distance->sign, *stats.solid); !warning.empty())
            stats.warnings.push_back("the sign of --distance: " + warning);
    if (!has_triangles_to_measure(stats))
        stats.warnings.push_back(
            "there is no triangle to measure from: every sample is " +
            std::string(request.distance->is_whole ? "infinitely far away" : "the band's distance away"));
}

volume run_distance_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    const double need = distance_need(model, request);
    const std::optional<int> layers = layers_of_slabs(model, request, need);
    if (const std::uint64_t lines = model.line_count(); lines != 0)
        stats.warnings.push_back(std::to_string(lines) +
                                 " line(s) and point(s) have no distances: --distance leaves them out");
    if (request.devices != 1) throw backend_error("--devices: one GPU draws distances");
    try {
        stats.triangles = model.triangle_count();
        if (layers) {
            stats.backend = "cpu";
            stats.threads = thread_count(request.threads);
            std::vector<int> ends;
            for (int end = 0; end < request.grid.extent.z;)
                ends.push_back(end = std::min(end + *layers, request.grid.extent.z));
            stats.slabs = static_cast<int>(ends.size());
            const auto drawn = std::make_shared<loaded_distances>(std::move(model), request, stats);
            return make_late_volume(
                request, ends,
                [drawn, ends, whole = request.grid](std::size_t i) {
                    return drawn->run(whole, i == 0 ? 0 : ends[i - 1], ends[i]);
                },
                stats);
        }
        if (request.backend != backend_choice::cpu)
            if (std::optional<volume> drawn = draw_on_cuda(model, request, false, stats,
                                                           [&](const cuda_facts& facts, const voxelize_request& how) {
                                                               return distances_on_cuda(facts, model, how, stats);
                                                           })) {
                add_distance_warnings(request, stats);
                return std::move(*drawn);
            }
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        if (request.progress)
            on.progress = [&request](std::uint64_t done, std::uint64_t total) {
                request.progress(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
        stats.backend = "cpu";
        stats.threads = threads;
        volume field = draw_distances(on, model, request, stats);
        add_distance_warnings(request, stats);
        return field;
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
