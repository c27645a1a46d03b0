// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fills an A-buffer. A call whose lists are about as long as those of the call before writes them to arrays that are
// made beforehand; any other waits for its counts, makes arrays of that length and copies.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/call/call_workspace.cuh>
#include <voxelpipe/device/fragments/store_lists.cuh>

#include <cstdint>
#include <optional>
#include <utility>

namespace voxelpipe::device {

// Arrays of an A-buffer with room for num_voxels voxels and num_fragments fragments.
template <class Payload>
struct list_arrays {
    static constexpr bool has_payload = !std::is_void_v<Payload>;
    device_buffer<std::uint64_t> voxels, offsets;
    device_buffer<std::uint32_t> primitives;
    device_buffer<payload_storage<Payload>> payloads;

    list_arrays(const stream_memory& from, std::uint64_t num_voxels, std::uint64_t num_fragments)
        : voxels(from, num_voxels, stage::abuffer_emit),
          offsets(from, num_voxels == 0 ? 0 : num_voxels + 1, stage::abuffer_emit),
          primitives(from, num_fragments, stage::abuffer_emit),
          payloads(from, has_payload ? num_fragments : 0, stage::abuffer_emit) {}
    [[nodiscard]] csr_pointers pointers(std::uint64_t voxel_capacity) {
        csr_pointers p;
        p.voxels = voxels.data();
        p.offsets = offsets.data();
        p.voxel_capacity = voxel_capacity;
        p.primitives = primitives.data();
        p.payloads = payloads.data();
        return p;
    }
    // Copies as many elements as `to` has room for.
    void copy(list_arrays& to, cudaStream_t stream) const {
        const auto copy_one = [&](const auto& from, auto& array) {
            if (array.size() != 0)
                check(cudaMemcpyAsync(array.data(), from.data(), array.size() * sizeof(*from.data()),
                                      cudaMemcpyDeviceToDevice, stream),
                      stage::abuffer_emit);
        };
        copy_one(voxels, to.voxels);
        copy_one(offsets, to.offsets);
        copy_one(primitives, to.primitives);
        copy_one(payloads, to.payloads);
    }
    // Moves the first num_voxels and num_fragments into `lists`.
    template <class Lists>
    void move_into(Lists& lists, std::uint64_t num_voxels, std::uint64_t num_fragments) {
        voxels.shorten(num_voxels);
        offsets.shorten(num_voxels == 0 ? 0 : num_voxels + 1);
        primitives.shorten(num_fragments);
        payloads.shorten(has_payload ? num_fragments : 0);
        lists.voxels = std::move(voxels);
        lists.offsets = std::move(offsets);
        lists.primitives = std::move(primitives);
        lists.payloads = std::move(payloads);
    }
};

// Runs one A-buffer call. `call` and `lists` outlive it; a call that fails leaves `lists` as they were.
template <class Call, class Backend, class Payload>
class list_filler {
public:
    list_filler(const Call& call, const stream_memory& from, call_workspace& workspace, bool may_lock, bool may_graph,
                abuffer<Backend, Payload>& lists, pipeline_state& state)
        : call_(call), from_(from), workspace_(workspace), may_lock_(may_lock), may_graph_(may_graph), lists_(lists),
          state_(state) {}

    // Key: of a voxel. expected_voxels: how many voxels the lists are likely to have; 0 if nothing is known.
    template <class Coverage, class Key>
    void fill(coverage rule, std::uint64_t expected_voxels) {
        Coverage::dispatch(rule, [&]<coverage Rule>() { fill<Rule, Key>(expected_voxels); });
    }

private:
    using arrays_type = list_arrays<Payload>;

    // Without a wait before the lists are written, if expected_voxels is not 0.
    template <coverage Rule, class Key>
    void fill(std::uint64_t expected_voxels) {
        arena plan;
        call_.template plan_memory<Key>(plan);
        void* const memory = workspace_.prepare(plan.used(), from_, may_lock_, may_graph_);
        arrays_type arrays = make_beforehand(expected_voxels);
        if (expected_voxels == 0) {
            fill_exactly<Rule, Key>(memory);
            return;
        }
        launch_until(stage::abuffer_emit, [&] {
            std::optional<call_bytes> bytes;
            if constexpr (Call::has_bytes)
                bytes = workspace_.bytes_for_graph(call_.clock, [&](const void* workspace, const void* page) {
                    return call_.template bytes<Rule, Key>(workspace, page);
                });
            const output_pointers outputs = workspace_.set_outputs(arrays.pointers(expected_voxels));
            state_ = workspace_.run(call_.clock, bytes, sizeof(pipeline_state), from_.stream, [&](cudaStream_t on) {
                arena carved(memory);
                const auto sorted = call_.template launch<Rule, Key>(carved, on, outputs);
                store_lists(sorted, static_cast<const pipeline_state*>(memory), call_.limits, on, call_.clock);
            });
        });
        if (has_failed(state_, call_.limits)) return;
        const std::uint64_t num_voxels = state_.list_voxels, num_fragments = state_.list_fragments;
        if (num_voxels > expected_voxels) { // more than guessed
            fill<Rule, Key>(0);
        } else if (num_fragments >= call_.limits.fragments / 4 * 3 || num_fragments == 0) {
            arrays.move_into(lists_, num_voxels, num_fragments);
        } else {
            arrays_type exact(from_, num_voxels, num_fragments);
            arrays.copy(exact, from_.stream);
            exact.move_into(lists_, num_voxels, num_fragments);
        }
    }

    // Arrays with a little more room than the lists are likely to need. If memory is short, empty ones, and
    // expected_voxels becomes 0: lists of the exact length may still fit.
    [[nodiscard]] arrays_type make_beforehand(std::uint64_t& expected_voxels) const {
        try {
            return {from_, expected_voxels, expected_voxels == 0 ? 0 : call_.limits.fragments};
        } catch (const cuda_failure& e) {
            if (e.error != cudaErrorMemoryAllocation) throw;
            expected_voxels = 0;
            return {from_, 0, 0};
        }
    }

    // Makes the arrays when their lengths are known.
    template <coverage Rule, class Key>
    void fill_exactly(void* memory) {
        constexpr stage where = stage::abuffer_emit;
        fragment_lists<Key, payload_storage<Payload>> sorted{};
        launch_until(where, [&] {
            state_ =
                workspace_.run(call_.clock, std::nullopt, sizeof(pipeline_state), from_.stream, [&](cudaStream_t on) {
                    arena carved(memory);
                    sorted = call_.template launch<Rule, Key>(carved, on);
                });
        });
        if (has_failed(state_, call_.limits)) return;
        const std::uint64_t num_voxels = state_.list_voxels, num_fragments = state_.list_fragments;
        arrays_type exact(from_, num_voxels, num_fragments);
        if (num_fragments != 0) {
            if (call_.clock != nullptr) call_.clock->start(); // leaves out the wait and the allocations
            copy_lists_kernel<<<fill_device(num_fragments), threads_per_block, 0, from_.stream>>>(
                sorted, num_voxels, num_fragments, exact.voxels.data(), exact.offsets.data(), exact.primitives.data(),
                exact.payloads.data());
            check(cudaGetLastError(), where);
            end_stage(call_.clock, &stage_times::abuffer_emit);
        }
        exact.move_into(lists_, num_voxels, num_fragments);
    }

    const Call& call_;
    const stream_memory& from_;
    call_workspace& workspace_;
    bool may_lock_, may_graph_;
    abuffer<Backend, Payload>& lists_;
    pipeline_state& state_;
};

} // namespace voxelpipe::device
