// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cuda_backend: the pipeline on an NVIDIA GPU, with the same bits as cpu_backend. All work, copies and memory go
// through one stream of the current device. A call of voxelize waits once, for the counters in its status, and once
// more for each try that did not fit.

#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/call/attempt.cuh>
#include <voxelpipe/device/call/call_workspace.cuh>
#include <voxelpipe/device/call/framebuffer_call.cuh>
#include <voxelpipe/device/call/kernels.cuh>
#include <voxelpipe/device/call/list_arrays.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/device/scene/subset.cuh>
#include <voxelpipe/program.hpp>
#include <voxelpipe/solid.hpp>
#include <voxelpipe/sparse.hpp>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

class cuda_backend;
namespace device { // device/optional/sparse.cuh
template <class Payload, class... Targets>
[[nodiscard]] status finish_sparse(cuda_backend& backend, const grid& g, const abuffer<cuda_backend, Payload>& lists,
                                   sparse_framebuffer<cuda_backend, Targets...>& fb, const status& drawn);
} // namespace device

// Has, from stream_memory, a `stream`, which it does not own, and the `resource` that all memory comes from.
// May be used by one thread at a time, with its framebuffers, A-buffers and buffers: a call changes the workspace, the
// history and the graph that the backend keeps. Threads that work at the same time have a backend each, with a stream
// each. They may share meshes that nobody changes, once the stream that made these has been waited for.
class cuda_backend : public stream_memory {
public:
    static constexpr bool takes_solid_slabs = true; // its solid calls take solid_options::slab

    // Device memory of the backend; see device_buffer.
    template <class T>
    using buffer = device_buffer<T>;

    cuda_backend() = default;
    // All work runs on stream_. Memory comes from resource_, by default from the current device's pool.
    explicit cuda_backend(cudaStream_t stream_, memory_resource resource_ = {}) : stream_memory{stream_, resource_} {}

    // If not null, voxelize adds the time of each stage to it, measured by events on the stream. They are read after
    // the call's wait; new fragment lists wait once more, for their copy. voxelize_async has no times.
    stage_times* times = nullptr;

    // A backend that is used more than once may keep a page of locked host memory for the counters of its calls, which
    // saves 10 us a call. release and the destructor then wait for the device, to unlock it.
    bool use_pinned_memory = true;

    // The third call in a row with the same arguments is kept as a CUDA graph, which saves host and device some 10 us a
    // call from then on. Needs use_pinned_memory. The arrays of an A-buffer may differ from call to call. The driver
    // takes memory for the graph, until a call with other arguments, release or the destructor.
    bool use_graphs = true;

    // How framebuffer calls are drawn (call/strategy.hpp); results are the same. `automatic` takes the first rule of a
    // table that applies. Any other value forces that strategy, and a call that it cannot serve fails with
    // strategy_unavailable and writes nothing. Sorted strategies take 17 bytes of device memory a fragment, and more if
    // a blend depends on the order. If there is no such memory, `automatic` draws in tiles, for about 10 bytes a pair
    // of triangle and tile that meet. A-buffer calls ignore it.
    voxelpipe::strategy strategy = voxelpipe::strategy::automatic;

    // The strategy of the last framebuffer call, and the rule that chose it in words.
    [[nodiscard]] strategy_choice last_strategy() const { return choice_; }

    // Copies an array of device memory, then waits. Throws like buffer.
    template <class T>
    [[nodiscard]] std::vector<std::remove_const_t<T>> read(backend_view<T> from) {
        std::vector<std::remove_const_t<T>> host(from.size());
        if (from.size() != 0)
            device::with_runtime_errors([&] {
                device::check(
                    cudaMemcpyAsync(host.data(), from.data(), from.size() * sizeof(T), cudaMemcpyDeviceToHost, stream));
                device::check(cudaStreamSynchronize(stream));
            });
        return host;
    }

    // The largest vertex index, for check_indices. Waits. A template, so that its kernel is compiled only if called.
    template <int = 0>
    [[nodiscard]] std::uint32_t max_index(array_view<const glm::uvec3> triangles) {
        buffer<std::uint32_t> max(*this, std::size_t{1});
        device::with_runtime_errors([&] {
            device::check(cudaMemsetAsync(max.data(), 0, sizeof(std::uint32_t), stream));
            device::find_max_index(triangles, max.data(), stream);
        });
        return max.to_host(*this)[0];
    }

    // Implements vp::clear, and voxelize without triangles. Arguments are validated. Waits.
    template <class... Targets>
    [[nodiscard]] status clear(const framebuffer_view<Targets...>& fb) {
        try {
            device::launch_until(stage::fine_raster, [&] {
                device::clear_framebuffer(fb, workspace_.zeroed_state(*this), stream);
                device::check(cudaStreamSynchronize(stream));
            });
        } catch (const device::cuda_failure& e) {
            workspace_.forget_contents();
            return device::to_status(e);
        } catch (const std::bad_alloc&) {
            return core::failure(status_code::out_of_memory);
        }
        return {};
    }

    // Implements voxelize. Arguments are validated. `Selector` picks tile and block size (tuning/); results do not
    // depend on it.
    template <class Selector = tuning::fine_raster_selector, class Mesh, class VertexShader, class FragmentShader,
              class... Targets, class Coverage = core::known_coverage<>>
    [[nodiscard]] status run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                             const framebuffer_view<Targets...>& fb, const voxelize_options& options,
                             std::uint64_t triangles_in, Coverage = {});

    template <class Mesh, class VertexShader, class FragmentShader, class Payload,
              class Coverage = core::known_coverage<>>
    [[nodiscard]] status run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                             abuffer<cuda_backend, Payload>& lists, const voxelize_options& options,
                             std::uint64_t triangles_in, Coverage = {});

    // Implements voxelize_solid. Arguments are validated. Defined in device/optional/solid.cuh.
    template <class Mesh, class VertexShader, class SolidShader, class... Targets>
    [[nodiscard]] status run_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                   const framebuffer_view<Targets...>& fb, const solid_options& options,
                                   std::uint64_t triangles_in);
    template <class Mesh, class VertexShader, class SolidShader, class Payload>
    [[nodiscard]] status run_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                   abuffer<cuda_backend, Payload>& lists, const solid_options& options,
                                   std::uint64_t triangles_in);

    // Implements diagnose_repair: lids on all holes of each body. Waits. Throws std::bad_alloc, std::length_error, or
    // std::runtime_error with CUDA's text. Defined in device/optional/solid.cuh.
    template <class Mesh, class VertexShader, class SolidShader>
    [[nodiscard]] std::vector<core::hole_cones> find_holes(std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                           const grid& g, bodies each);

    // Implement voxelize and clear of sparse framebuffers. Arguments are validated. Defined in
    // device/optional/sparse.cuh.
    template <class Mesh, class VertexShader, class FragmentShader, class... Targets,
              class Coverage = core::known_coverage<>>
    [[nodiscard]] status run_sparse(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                                    sparse_framebuffer<cuda_backend, Targets...>& fb, const voxelize_options& options,
                                    std::uint64_t triangles_in, Coverage = {});
    // Implements voxelize_solid of sparse framebuffers. Defined in device/optional/sparse_solid.cuh.
    template <class Mesh, class VertexShader, class SolidShader, class... Targets>
    [[nodiscard]] status run_sparse_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                          sparse_framebuffer<cuda_backend, Targets...>& fb,
                                          const solid_options& options, std::uint64_t triangles_in);
    // Implements voxelize of nothing into a sparse framebuffer.
    template <class... Targets>
    [[nodiscard]] status clear_sparse(const grid& g, sparse_framebuffer<cuda_backend, Targets...>& fb);

    // Implements voxelize of points and lines where lists are not needed; otherwise returns nothing. Arguments are
    // validated. Defined in device/optional/elements.cuh.
    template <coverage Rule, class View, class VertexShader, class FragmentShader, class... Targets>
    [[nodiscard]] std::optional<status> draw_elements(std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                                      const grid& g, const framebuffer_view<Targets...>& fb,
                                                      bool count_voxels);

    // Implements voxelize with a tessellation where its triangles need not be in memory; otherwise returns nothing.
    // Arguments are validated. most: triangles. Defined in device/optional/patches.cuh.
    template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class Program, class... Targets>
    [[nodiscard]] std::optional<status>
    draw_patches(std::span<const draw<Mesh, VertexShader, FragmentShader, tessellate<Program>>> draws, const grid& g,
                 const framebuffer_view<Targets...>& fb, const voxelize_options& options, std::uint64_t most);

    // Used by brick_slots; table and slots are in device memory. Throws std::runtime_error with the CUDA error. Defined
    // in device/optional/sparse.cuh.
    template <int = 0>
    void fill_brick_slots(const brick_table& table, std::uint32_t* slots, int log2_slots);
    // ---- used by programs (program_call.hpp) ------------------------------------------------------------------------

    // Calls f(i) for i below `count`, in any order, on the stream.
    template <class F>
    void for_each(std::uint64_t count, const F& f) const {
        device::with_runtime_errors([&] { device::for_each(count, f, stage::vertex_shade, stream); });
    }
    // offsets[i] becomes the sum of the counts before i. The last count must be 0; returns the total. Waits.
    template <int = 0>
    std::uint64_t sum(const buffer<std::uint32_t>& counts, buffer<std::uint64_t>& offsets) {
        const auto n = static_cast<std::uint32_t>(counts.size());
        device::with_runtime_errors([&] {
            const std::size_t bytes = device::cell_scan_bytes(n);
            buffer<std::uint8_t> storage(*this, bytes);
            device::sum_counts(counts.data(), reinterpret_cast<unsigned long long*>(offsets.data()), n, storage.data(),
                               bytes, stage::vertex_shade, stream);
        });
        return read(backend_view<const std::uint64_t>{offsets.data() + n - 1, 1})[0];
    }
    // Sorts pairs by the lowest `bits` bits of the key, stably.
    template <int = 0>
    void sort_by_key(buffer<std::uint64_t>& keys, buffer<std::uint32_t>& values, int bits) {
        const std::size_t n = keys.size();
        if (n < 2) return;
        buffer<std::uint64_t> other_keys(*this, n);
        buffer<std::uint32_t> other_values(*this, n);
        int result = 0;
        device::with_runtime_errors([&] {
            const std::size_t bytes = device::sort_bytes<std::uint64_t>(n, bits);
            buffer<std::uint8_t> storage(*this, bytes);
            std::uint64_t* const k[2] = {keys.data(), other_keys.data()};
            std::uint32_t* const v[2] = {values.data(), other_values.data()};
            result =
                device::sort_by_cell<std::uint64_t>(k, v, n, bits, storage.data(), bytes, stage::tile_sort, stream);
        });
        if (result == 0) return;
        std::swap(keys, other_keys);
        std::swap(values, other_values);
    }
    // Runs work(), which returns a status. Failed allocations and CUDA errors become one.
    template <class Work>
    [[nodiscard]] status guard(const Work& work) {
        try {
            return work();
        } catch (const std::bad_alloc&) {
            return core::failure(status_code::out_of_memory, stage::vertex_shade);
        } catch (const std::length_error&) { // fragments that cannot be numbered
            return core::failure(status_code::out_of_memory, stage::abuffer_emit);
        } catch (const std::runtime_error&) { // of a buffer, or of a hook above
            status s = core::failure(status_code::device_error, stage::vertex_shade);
            s.device_error = static_cast<int>(cudaGetLastError());
            return s;
        }
    }
    // Lists with all outputs become the contents of a sparse framebuffer. `drawn` has the counts of the call.
    template <class Payload, class... Targets>
    [[nodiscard]] status store_sparse(const grid& g, const abuffer<cuda_backend, Payload>& lists,
                                      sparse_framebuffer<cuda_backend, Targets...>& fb, const status& drawn) {
        return device::finish_sparse(*this, g, lists, fb, drawn);
    }

    // Frees the memory that is kept between calls.
    void release() { workspace_.release(); }

private:
    // Launches the call. If `automatic` chose to list fragments and there is no memory for them, chooses again.
    template <class Coverage, class Call>
    void launch_within_memory(Call call, device::pipeline_state& state) {
        const auto launch_one = [&] {
            Coverage::dispatch(call.plan.options.rule, [&]<coverage Rule>() { launch<Rule>(call, state); });
        };
        if (!call.lists_fragments() || strategy != voxelpipe::strategy::automatic) {
            launch_one();
            return;
        }
        bool fits = true;
        try {
            launch_one();
        } catch (const device::cuda_failure& e) {
            if (e.error != cudaErrorMemoryAllocation) throw;
            fits = false;
        } catch (const std::bad_alloc&) {
            fits = false;
        }
        if (fits) return;
        choose(call, false);
        launch_one();
    }

    // Chooses the call's strategy. Throws strategy_refused if it is forced and cannot serve the call.
    template <class Call>
    void choose(Call& call, bool may_list) {
        if (!call.choose(strategy, may_list)) throw device::strategy_refused{};
        choice_ = {call.plan.rule->value, call.plan.rule->when};
    }

    template <coverage Rule, class Call>
    void launch(const Call& call, device::pipeline_state& state) {
        void* const memory = workspace_.prepare(call.plan_memory(), *this, use_pinned_memory, use_graphs);
        device::launch_until(call.last_stage(), [&] {
            std::optional<device::call_bytes> bytes;
            if constexpr (Call::has_bytes)
                bytes = workspace_.bytes_for_graph(call.clock, [&](const void* workspace, const void* page) {
                    return call.template bytes<Rule>(workspace, page);
                });
            state = workspace_.run(call.clock, bytes, call.zeroed_bytes(), stream, [&](cudaStream_t on) {
                device::arena carved(memory);
                call.template launch<Rule>(carved, on);
            });
        });
    }

    // A solid call that counts its rows, then write(call, sorted entries, its memory, state). Defined in
    // device/optional/solid.cuh.
    template <class Call, class Draw, class Write>
    [[nodiscard]] status sweep_solid(std::span<const Draw> draws, const grid& g, const solid_options& options,
                                     std::uint64_t triangles_in, const Write& write);

    device::call_history framebuffer_history_{{true, false, true}}, list_history_{{true, false, true}},
        solid_history_{{true, false, true}};
    device::call_workspace workspace_;
    strategy_choice choice_;
    std::vector<const void*> discarding_; // types of A-buffer calls that were shaded late and discarded fragments
};

// Outside the class, and so not inline: a unit that links voxelpipe::cuda_kernels does not compile the calls that the
// library holds (device/call/kernels.cuh).
template <class Selector, class Mesh, class VertexShader, class FragmentShader, class... Targets, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         const framebuffer_view<Targets...>& fb, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    if (const status s = device::check_subsets(draws, *this); !s.ok()) return s;
    // Tiny triangles have few fragments, so the first guess stays within what lists can be sorted.
    return device::attempt(
        framebuffer_history_, {triangles_in, g.extent, g.offset, options.rule}, device::max_sorted_fragments, times,
        stream, [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
            device::capacities& limits = guess.limits;
            limits.longest_ordered = ~0ull; // an order may come before a blend
            return device::with_framebuffer_call<Selector>(draws, g, fb, options, triangles_in, limits, [&](auto call) {
                call.clock = clock;
                choose(call, true);
                limits.deferred = call.plan.limits.deferred = call.deferral_for(guess.num_deferred);
                launch_within_memory<Coverage>(call, state);
                return call.lists_fragments() && strategy == voxelpipe::strategy::automatic;
            });
        });
}

template <class Mesh, class VertexShader, class FragmentShader, class Payload, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         abuffer<cuda_backend, Payload>& lists, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    using call_type = device::abuffer_call<draw<Mesh, VertexShader, FragmentShader>, payload_storage<Payload>>;
    if (const status wrong = device::check_subsets(draws, *this); !wrong.ok()) return wrong;
    abuffer<cuda_backend, Payload> made(*this); // so that a call that fails leaves `lists` as they were
    status s = device::attempt(
        list_history_, {triangles_in, g.extent, g.offset, options.rule}, core::max_numbered, times, stream,
        [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
            device::capacities& limits = guess.limits;
            call_type call{draws, g, static_cast<std::uint32_t>(triangles_in), limits, clock};
            limits.deferred = call.limits.deferred = call.deferral_for(guess.num_deferred);
            call.arms = core::arms_of(options.rule);
            call.has_few_a_voxel = limits.fragments < tuning::min_counted * guess.expected_voxels;
            device::list_filler filler(call, *this, workspace_, use_pinned_memory, use_graphs, made, state);
            if (device::num_voxels(g) >= std::numeric_limits<std::uint32_t>::max()) {
                filler.template fill<Coverage, std::uint64_t>(options.rule, guess.expected_voxels);
                return false;
            }
            call.may_shade_late = true;
            const void* const type = device::tag_of_call<call_type>();
            call.filters = std::find(discarding_.begin(), discarding_.end(), type) != discarding_.end();
            filler.template fill<Coverage, std::uint32_t>(options.rule, guess.expected_voxels);
            if (state.discarded != 0 && call.template shades_late<std::uint32_t>() && !call.filters) {
                discarding_.push_back(type);
                call.filters = true;
                filler.template fill<Coverage, std::uint32_t>(options.rule, guess.expected_voxels);
            }
            return false;
        });
    if (s.ok() && core::has_subset(draws))
        s = guard([&] {
            const std::vector<device::listed_draw> listed = device::listed_draws(draws);
            const buffer<device::listed_draw> in_device(*this, array_view<const device::listed_draw>(listed));
            device::with_runtime_errors([&] {
                device::renumber_lists(in_device.data(), listed.size(), made.primitives.data(), nullptr,
                                       made.primitives.size(), stream);
            });
            return s;
        });
    if (s.ok()) {
        made.extent = g.extent;
        lists = std::move(made);
        s.counts.fragments = lists.num_fragments();
        s.counts.voxels = lists.num_voxels();
    }
    return s;
}

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
VOXELPIPE_BIT_CALLS(extern template)
VOXELPIPE_SUM_CALLS(extern template)
VOXELPIPE_LIST_CALLS(extern template)
#endif

} // namespace voxelpipe
