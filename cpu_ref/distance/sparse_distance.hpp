// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance into sparse framebuffers on CPU threads: the samples of the band become lists, and the lists the
// bricks of the framebuffer.

#include <cpu_ref/distance/voxelize_distance.hpp>
#include <cpu_ref/sparse/voxelize_sparse.hpp>
#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/sparse/passes/all_outputs.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace voxelpipe::core {

// Implements voxelize_distance. Arguments are validated. Exceptions of a user's shader pass through.
template <class Mesh, class VertexShader, class Shader, class... Targets>
[[nodiscard]] status run_module(sparse_distance_tag, cpu_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& samples,
                                sparse_framebuffer<cpu_backend, Targets...>& fb, const distance_options& options,
                                std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    using payload = typename outputs_payload<
        distance_output<Shader, typename cpu::scene<Mesh, VertexShader, Shader>::varyings>>::type;
    status result;
    abuffer<cpu_backend, payload> lists(backend);
    result = backend.guarded(triangles_in, [&](const cpu::execution& how) {
        cpu::inside_bits inside;
        const status solid = inside.draw(backend, draws, samples, options, triangles_in);
        if (!solid.ok()) return solid;
        const cpu::distance_call<cpu::scene<Mesh, VertexShader, Shader>> call(how, draws, samples, options);
        status drawn = call.begin(solid);
        if (!drawn.ok()) return drawn;

        how.enter(stage::fine_raster);
        const cpu::brick_runs runs(samples.extent);
        struct item {
            std::uint64_t key; // linear number of the sample
            std::uint32_t primitive;
            payload values;
        };
        struct scratch {
            cpu::brick_search search;
            std::vector<item> kept;
            std::uint64_t discarded = 0;
            distance_counters distance{};
        };
        const auto workers = std::max<std::size_t>(1, std::min<std::size_t>(how.threads, runs.count()));
        std::vector<std::unique_ptr<scratch>> own;
        for (std::size_t w = 0; w < workers; ++w)
            own.push_back(std::unique_ptr<scratch>(new scratch{cpu::brick_search(call.scene), {}}));
        const auto nx = static_cast<std::uint64_t>(samples.extent.x), ny = static_cast<std::uint64_t>(samples.extent.y);
        const std::uint64_t all = nx * ny * static_cast<std::uint64_t>(samples.extent.z);
        {
            const cpu::stopwatch watch(how.times, &stage_times::fine_raster);
            cpu::progress_meter meter(how, runs.count());
            cpu::parallel_for(how.threads, runs.count(), [&](unsigned worker, std::size_t i) {
                scratch& mine = *own[worker];
                cpu::shade_run<true>(
                    call.shapes, call.scene, inside, runs.first(i), mine.search, mine.distance,
                    [&](const glm::ivec3& p, const auto& out, std::uint32_t id) {
                        if (!out.keep) {
                            ++mine.discarded;
                            return;
                        }
                        const auto row = static_cast<std::uint64_t>(p.z) * ny + static_cast<std::uint64_t>(p.y);
                        mine.kept.push_back({row * nx + static_cast<std::uint64_t>(p.x), id, out.values});
                    },
                    [](int, int, int, int, std::uint32_t) { return false; });
                meter.advance();
            });
        }
        how.enter(stage::abuffer_emit);
        const cpu::stopwatch watch(how.times, &stage_times::abuffer_emit);
        std::size_t count = 0;
        for (const auto& s : own) count += s->kept.size();
        cpu::raw_array<item> items(count);
        item* next = items.begin();
        for (const auto& s : own) {
            next = std::copy(s->kept.begin(), s->kept.end(), next);
            s->kept = {};
            drawn.counts.fragments_discarded += s->discarded;
            drawn.distance.band_samples += s->distance.band_samples;
        }
        cpu::radix_sort(how.threads, items, static_cast<int>(std::bit_width(all - 1)));
        lists.voxels = cpu_backend::buffer<std::uint64_t>(backend, count);
        lists.offsets = cpu_backend::buffer<std::uint64_t>(backend, count == 0 ? 0 : count + 1);
        lists.primitives = cpu_backend::buffer<std::uint32_t>(backend, count);
        lists.payloads = cpu_backend::buffer<payload>(backend, count);
        lists.extent = samples.extent;
        for (std::size_t i = 0; i < count; ++i) {
            lists.voxels.data()[i] = items[i].key;
            lists.offsets.data()[i] = i;
            lists.primitives.data()[i] = items[i].primitive;
            lists.payloads.data()[i] = items[i].values;
        }
        if (count != 0) lists.offsets.data()[count] = count;
        drawn.counts.fragments = count;
        drawn.counts.voxels = options.count_voxels ? count : 0;
        return drawn;
    });
    if (!result.ok()) return result;
    status stored = run_module(store_sparse_tag{}, backend, samples, lists, fb, result);
    if (stored.ok()) {
        stored.solid = result.solid;
        stored.distance = result.distance;
    }
    return stored;
}

} // namespace voxelpipe::core
