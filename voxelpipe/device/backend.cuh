// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cuda_backend: the pipeline on an NVIDIA GPU, with the same bits as cpu_backend. All work, copies and memory go
// through one stream of the current device. A call of voxelize waits once, for the counters in its status, and once
// more for each try that did not fit.

#include <voxelpipe/device/call/attempt.cuh>
#include <voxelpipe/device/call/backend_passes.cuh>
#include <voxelpipe/device/call/call_workspace.cuh>
#include <voxelpipe/device/call/framebuffer_call.cuh>
#include <voxelpipe/device/call/kernels.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

// Has, from stream_memory, a `stream`, which it does not own, and the `resource` that all memory comes from; and, from
// backend_passes, buffers, copies and what passes need.
// May be used by one thread at a time, with its framebuffers, A-buffers and buffers: a call changes the workspace, the
// history and the graph that the backend keeps. Threads that work at the same time have a backend each, with a stream
// each. They may share meshes that nobody changes, once the stream that made these has been waited for.
class cuda_backend : public device::backend_passes {
public:
    static constexpr bool takes_solid_slabs = true; // its solid calls take solid_options::slab

    cuda_backend() = default;
    // All work runs on stream_. Memory comes from resource_, by default from the current device's pool.
    explicit cuda_backend(cudaStream_t stream_, memory_resource resource_ = {}) : backend_passes{stream_, resource_} {}

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

    // Implements voxelize. Arguments are validated. Defined in surface_calls.cuh. `Selector` picks tile and block size
    // (tuning/); results do not depend on it.
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

    // ---- used by modules (solid/, sparse/, programs/) ---------------------------------------------------------------

    // The memory of a call, the page of its counters and the graph; kept from call to call.
    [[nodiscard]] device::call_workspace& workspace() { return workspace_; }
    // The capacities that calls of this kind have needed so far. Any type may be a kind's tag.
    template <class Tag>
    [[nodiscard]] device::call_history& history() {
        return histories_
            .try_emplace(device::tag_of_call<Tag>(), std::array<bool, device::call_needs::count>{true, false, true})
            .first->second;
    }
    // What last_strategy() returns from now on.
    void note_strategy(const strategy_choice& choice) { choice_ = choice; }

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

    std::map<const void*, device::call_history> histories_; // by the address that stands for the tag
    device::call_workspace workspace_;
    strategy_choice choice_;
    std::vector<const void*> discarding_; // types of A-buffer calls that were shaded late and discarded fragments
};

} // namespace voxelpipe
