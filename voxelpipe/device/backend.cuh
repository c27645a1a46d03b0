// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cuda_backend: the pipeline on an NVIDIA GPU, with the bits of cpu_backend. All work, copies and memory go through one
// stream of the current device; a call to voxelize waits once, for the counters in its status, unless it has to run
// again.

#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/call/capacity_history.hpp>
#include <voxelpipe/device/call/framebuffer_call.cuh>
#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/call/readback.cuh>
#include <voxelpipe/device/kernels.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace device {

// The counters of a call that succeeded; triangles_in counts every triangle that was looked at.
[[nodiscard]] inline status to_status(const pipeline_state& state) {
    status s;
    s.counts.triangles_nonfinite = state.nonfinite;
    s.counts.triangles_too_far = state.too_far;
    s.counts.triangles_zero_area = state.zero_area;
    s.counts.triangles_outside = state.outside;
    s.counts.triangles_drawn = state.drawn;
    s.counts.triangles_in = state.nonfinite + state.too_far + state.zero_area + state.outside + state.drawn;
    s.counts.fragments = state.fragments;
    s.counts.fragments_discarded = state.discarded;
    s.counts.voxels = state.voxels;
    return s;
}

// Where a call that has_failed for a capacity met it.
[[nodiscard]] inline stage find_overflow(const pipeline_state& s, const capacities& c) {
    return s.tile_pairs > c.tile_pairs || s.tile_records > c.tile_records ? stage::coarse_raster
           : misses_deferred(s, c)                                        ? stage::fine_raster
                                                                          : stage::abuffer_emit;
}

// Runs f, which launches stages. A failure that names none, of a query in between, is put down to the last of them:
// errors of kernels come late.
template <class F>
auto launch_until(stage last, F&& f) {
    try {
        return f();
    } catch (const cuda_failure& e) {
        throw cuda_failure{e.error, e.where == stage::validate ? last : e.where};
    }
}

} // namespace device

// Memory that a cuda_backend keeps between calls, released in stream order. Moves with its backend, is never shared.
class device_block {
public:
    device_block() = default;
    device_block(std::size_t bytes, const memory_resource& resource, cudaStream_t stream)
        : pointer_(resource.allocate(bytes, stream)), bytes_(bytes), resource_(resource), stream_(stream) {}
    device_block(device_block&& other) noexcept { swap(other); }
    device_block& operator=(device_block&& other) noexcept {
        device_block(std::move(other)).swap(*this);
        return *this;
    }
    ~device_block() { resource_.deallocate(pointer_, bytes_, stream_); }

    [[nodiscard]] void* data() const { return pointer_; }
    [[nodiscard]] std::size_t size() const { return bytes_; }

private:
    void swap(device_block& other) noexcept {
        std::swap(pointer_, other.pointer_);
        std::swap(bytes_, other.bytes_);
        std::swap(resource_, other.resource_);
        std::swap(stream_, other.stream_);
    }
    void* pointer_ = nullptr;
    std::size_t bytes_ = 0;
    memory_resource resource_;
    cudaStream_t stream_ = nullptr;
};

// May be used by one thread at a time, with its framebuffers, A-buffers and buffers, since a call changes the
// workspace, the history and the kept graph that the backend keeps. Threads that work at the same time have a backend
// each, with a stream each; meshes that nobody changes may be shared, once the stream that made them has been waited
// for.
class cuda_backend {
public:
    // Device memory on the backend's stream, uninitialised. Throws std::bad_alloc, or std::runtime_error with the CUDA
    // error. Freed in stream order; the stream must outlive it.
    template <class T>
    class buffer {
        static_assert(std::is_trivially_copyable_v<T>);

    public:
        buffer(cuda_backend& backend, std::size_t count) : count_(count) {
            if (count > std::numeric_limits<std::size_t>::max() / sizeof(T)) throw std::bad_alloc();
            translate([&] { block_ = device_block(count * sizeof(T), backend.resource, backend.stream); });
        }
        // Copies from the host, or from device memory: the source may go when the constructor returns, which therefore
        // waits for the copy unless it is from pageable memory, of which CUDA has a copy by then.
        buffer(cuda_backend& backend, array_view<const T> source) : buffer(backend, source.size()) {
            if (count_ == 0) return;
            translate([&] {
                device::check(cudaMemcpyAsync(block_.data(), source.data(), count_ * sizeof(T), cudaMemcpyDefault,
                                              backend.stream));
                cudaPointerAttributes memory{};
                device::check(cudaPointerGetAttributes(&memory, source.data()));
                if (memory.type != cudaMemoryTypeUnregistered) device::check(cudaStreamSynchronize(backend.stream));
            });
        }

        // Written out, so that they are host functions: the implicit ones would count as both.
        buffer(buffer&& other) noexcept : block_(std::move(other.block_)), count_(std::exchange(other.count_, 0)) {}
        buffer& operator=(buffer&& other) noexcept {
            block_ = std::move(other.block_);
            count_ = std::exchange(other.count_, 0);
            return *this;
        }
        ~buffer() {} // NOLINT(*-equals-default)

        [[nodiscard]] T* data() { return static_cast<T*>(block_.data()); }
        [[nodiscard]] const T* data() const { return static_cast<const T*>(block_.data()); }
        [[nodiscard]] std::size_t size() const { return count_; }
        [[nodiscard]] backend_view<const T> view() const { return {data(), count_}; }
        // Copies, then waits.
        [[nodiscard]] std::vector<T> to_host(cuda_backend& backend) const {
            std::vector<T> host(count_);
            if (count_ != 0)
                translate([&] {
                    device::check(cudaMemcpyAsync(host.data(), data(), count_ * sizeof(T), cudaMemcpyDeviceToHost,
                                                  backend.stream));
                    device::check(cudaStreamSynchronize(backend.stream));
                });
            return host;
        }
        // Copies a box of the elements, then waits; `to` has room for box.count() of them.
        void read_box(cuda_backend& backend, const core::element_box& box, T* to) const {
            translate([&] {
                for (std::size_t z = 0; z < box.slices; ++z)
                    device::check(cudaMemcpy2DAsync(to + z * box.row * box.rows, box.row * sizeof(T),
                                                    data() + box.first + z * box.slice_pitch, box.row_pitch * sizeof(T),
                                                    box.row * sizeof(T), box.rows, cudaMemcpyDeviceToHost,
                                                    backend.stream));
                device::check(cudaStreamSynchronize(backend.stream));
            });
        }

    private:
        friend cuda_backend;
        // Within a call: what goes wrong belongs in the call's status, with the stage that asked for the memory.
        buffer(cuda_backend& backend, std::size_t count, stage where) : count_(count) {
            try {
                block_ = device_block(count * sizeof(T), backend.resource, backend.stream);
            } catch (const device::cuda_failure& e) {
                throw device::cuda_failure{e.error, where};
            } catch (const std::bad_alloc&) {
                throw device::cuda_failure{cudaErrorMemoryAllocation, where};
            }
        }
        template <class F>
        static void translate(F&& f) {
            try {
                f();
            } catch (const device::cuda_failure& e) {
                throw std::runtime_error(std::string("voxelpipe: ") + cudaGetErrorString(e.error));
            }
        }
        device_block block_;
        std::size_t count_;
    };

    cuda_backend() = default;
    explicit cuda_backend(cudaStream_t stream_, memory_resource resource_ = {})
        : stream(stream_), resource(resource_) {}

    cudaStream_t stream = nullptr; // not owned
    memory_resource resource;      // where all memory comes from
    // Where voxelize adds up the time of each stage, if anywhere: by events on the stream, which a call without it does
    // not record. They are read after the call's wait, where new fragment lists wait once more, for their copy.
    // voxelize_async has no times.
    stage_times* times = nullptr;

    // Whether a backend that is used more than once may keep a page of locked host memory for the counters of its
    // calls, which takes 10 us off each. To give it back, release and the destructor wait for the device; without it
    // they do not.
    bool use_pinned_memory = true;

    // Whether a call with the same arguments as those before it, the third on a row, is kept as a CUDA graph, which
    // saves the host and the device some 10 us each time from then on. Where use_pinned_memory holds; the arrays of an
    // A-buffer may be others each time.
    // The driver has memory of its own for it, until a call with other arguments, release or the destructor.
    bool use_graphs = true;

    // How framebuffer calls are drawn (call/strategy.hpp). Results are the same. `automatic` takes the first rule of a
    // table that applies; any other value forces that strategy, and a call that it cannot serve fails with
    // strategy_unavailable and writes nothing. Sorted strategies take 17 bytes of device memory a fragment, and more if
    // a blend depends on the order; if there is no such memory, `automatic` draws in tiles, for about 10 bytes a pair
    // of triangle and tile that meet. A-buffer calls do not look at it.
    voxelpipe::strategy strategy = voxelpipe::strategy::automatic;

    // The strategy of the last framebuffer call, and the rule that chose it in words.
    [[nodiscard]] strategy_choice last_strategy() const { return choice_; }

    // Copies an array of device memory, then waits. Throws like buffer.
    template <class T>
    [[nodiscard]] std::vector<std::remove_const_t<T>> read(backend_view<T> from) {
        std::vector<std::remove_const_t<T>> host(from.size());
        if (from.size() != 0)
            buffer<std::remove_const_t<T>>::translate([&] {
                device::check(
                    cudaMemcpyAsync(host.data(), from.data(), from.size() * sizeof(T), cudaMemcpyDeviceToHost, stream));
                device::check(cudaStreamSynchronize(stream));
            });
        return host;
    }

    // What check_indices calls. A template, so that its kernel is compiled where it is called.
    template <int = 0>
    [[nodiscard]] std::uint32_t max_index(array_view<const glm::uvec3> triangles) {
        buffer<std::uint32_t> most(*this, std::size_t{1});
        buffer<std::uint32_t>::translate([&] {
            device::check(cudaMemsetAsync(most.data(), 0, sizeof(std::uint32_t), stream));
            device::find_most_index(triangles, most.data(), stream);
        });
        return most.to_host(*this)[0];
    }

    // What vp::clear calls, and voxelize without triangles; arguments are validated. Waits.
    template <class... Targets>
    [[nodiscard]] status clear(const framebuffer_view<Targets...>& fb) {
        try {
            device::launch_until(stage::fine_raster, [&] {
                constexpr std::size_t bytes = sizeof(device::pipeline_state);
                auto* const state = static_cast<device::pipeline_state*>(reserve(bytes));
                if (zeroed_bytes_ < bytes) device::check(cudaMemsetAsync(state, 0, bytes, stream));
                zeroed_bytes_ = std::max(zeroed_bytes_, bytes);
                device::clear_framebuffer(fb, state, stream);
                device::check(cudaStreamSynchronize(stream));
            });
        } catch (const device::cuda_failure& e) {
            zeroed_bytes_ = 0;
            return device::to_status(e);
        } catch (const std::bad_alloc&) {
            return core::failure(status_code::out_of_memory);
        }
        return {};
    }

    // What voxelize calls; arguments are validated. `Selector` picks tile and block size (tuning/); results do not
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

    // Gives back the memory that is kept between calls.
    void release() {
        call_graph_ = {};
        zeroed_bytes_ = 0;
        workspace_ = {};
        state_reader_ = {};
    }

private:
    // What tells calls apart that may need different capacities, as far as the host knows.
    struct call_key {
        std::uint64_t triangles;
        glm::ivec3 extent, offset;
        coverage rule;
        friend bool operator==(const call_key&, const call_key&) = default;
    };
    // Of tile pairs, tile records, fragments, fragment records, lists of voxels; and what calls may not need kernels
    // for: fragments of a voxel that the windows leave, triangles that the first kernel does (num_deferred).
    using room = core::capacity_history<call_key, 7>;

    // Runs the stages with capacities that should do, waits, and once more where something did not fit. launch_stages
    // takes back of the capacities what does not hold for its call, is told what calls like it num_deferred, and says
    // whether fragments were listed that need not be, where they are too many.
    template <class Launch>
    [[nodiscard]] status attempt(room& memory, const call_key& key, Launch&& launch_stages) {
        status s;
        try {
            std::optional<device::stage_clock> clock;
            if (times != nullptr) clock.emplace(stream);
            const std::uint64_t n = key.triangles;
            // No room for the lists of voxels where nothing is known of the call: they are copied when all is.
            // Tiny triangles have few fragments: those of a framebuffer are not taken for too many beforehand.
            const std::uint64_t most =
                &memory == &framebuffer_room_ ? device::max_sorted_fragments : core::max_numbered;
            room::lengths there = memory.guess(
                key, {n + n / 4 + 16384, n / 16 + 4096, std::min(4 * n + 65536, most), n / 16 + 4096, 0, 0, 0});
            const auto longest = memory.max_needed(key, 5), left = memory.max_needed(key, 6);
            bool left_some = false; // where that was taken for little
            for (int tries = 0;; ++tries) {
                device::capacities limits{there[0], there[1], there[2], there[3]};
                if (tries == 0 && longest) limits.longest_ordered = device::longest_like(*longest);
                device::pipeline_state state{};
                const bool need_not_list = launch_stages(
                    limits, there[4], tries == 0 && left ? *left : ~std::uint64_t{0}, state, clock ? &*clock : nullptr);
                left_some = left_some || device::misses_deferred(state, limits);
                if (state.index_error != 0) {
                    s = core::failure(status_code::index_out_of_range, stage::coarse_raster);
                    break;
                }
                const room::lengths needed{state.tile_pairs,
                                           state.tile_records,
                                           state.list_fragments + state.filtered,
                                           state.fragment_records,
                                           state.list_voxels,
                                           state.longest_ordered(),
                                           left_some ? ~std::uint64_t{0} : state.deferred.num_deferred(key.rule)};
                if (!device::has_failed(state, limits)) {
                    s = device::to_status(state);
                    memory.fitted(key, needed);
                    break;
                }
                // A pass that overflowed its records did not count all of its cells: the next try may need a third.
                if (tries == 4 || needed[0] > core::max_numbered ||
                    (needed[2] > core::max_numbered && !need_not_list)) {
                    s = core::failure(status_code::out_of_memory, device::find_overflow(state, limits));
                    s.required = {state.tile_pairs, state.list_fragments, 0};
                    break;
                }
                memory.raise(there, needed);
            }
            if (clock) clock->read(*times);
        } catch (const device::cuda_failure& e) {
            s = device::to_status(e);
        } catch (const std::bad_alloc&) {
            s = core::failure(status_code::out_of_memory);
        } catch (const strategy_refused&) {
            s = core::failure(status_code::strategy_unavailable);
        }
        s.counts.triangles_in = key.triangles;
        return s;
    }

    // The workspace, at least so large.
    [[nodiscard]] void* reserve(std::size_t bytes) {
        if (workspace_.size() < bytes) {
            zeroed_bytes_ = 0;
            workspace_ = {}; // first, so that both need not fit
            workspace_ = device_block(bytes, resource, stream);
        }
        return workspace_.data();
    }

    [[nodiscard]] bool may_keep_graph(const device::stage_clock* clock) const {
        return use_graphs && clock == nullptr && state_reader_.page() != nullptr;
    }
    // Puts launch_all(stream), which works in the workspace, on the stream, as a graph where `bytes`, if there are any,
    // have come before; waits. The state comes first in the workspace, of which so many bytes are to be zero before,
    // and are after, the state by way of the page; the call before has left them so, mostly.
    template <class F>
    [[nodiscard]] device::pipeline_state run_stages(device::stage_clock* clock,
                                                    const std::optional<device::call_bytes>& bytes,
                                                    std::size_t zeroed_bytes, const F& launch_all) {
        auto* const d_state = static_cast<device::pipeline_state*>(workspace_.data());
        if (clock != nullptr) clock->start();
        if (zeroed_bytes_ < zeroed_bytes) device::check(cudaMemsetAsync(d_state, 0, zeroed_bytes, stream));
        zeroed_bytes_ = 0;
        state_reader_.expect();
        const auto launch_and_send = [&](cudaStream_t on) {
            launch_all(on);
            state_reader_.send(d_state, on);
        };
        if (bytes)
            call_graph_.launch(*bytes, stream, launch_and_send);
        else
            launch_and_send(stream);
        const device::pipeline_state state = state_reader_.receive(d_state, stream);
        if (state_reader_.page() != nullptr) zeroed_bytes_ = zeroed_bytes;
        return state;
    }

    // With fragments listed where there is memory for them.
    template <class Coverage, class Call>
    void launch_where_it_fits(Call call, device::pipeline_state& state) {
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
    struct strategy_refused {};
    template <class Call>
    void choose(Call& call, bool may_list) {
        if (!call.choose(strategy, may_list)) throw strategy_refused{};
        choice_ = {call.plan.rule->value, call.plan.rule->when};
    }

    template <coverage Rule, class Call>
    void launch(const Call& call, device::pipeline_state& state) {
        void* const workspace = reserve(call.plan_memory());
        state_reader_.prepare(use_pinned_memory);
        device::launch_until(call.last_stage(), [&] {
            std::optional<device::call_bytes> bytes;
            if constexpr (Call::has_bytes)
                if (may_keep_graph(call.clock)) bytes = call.template bytes<Rule>(workspace, state_reader_.page());
            state = run_stages(call.clock, bytes, call.zeroed_bytes(), [&](cudaStream_t on) {
                device::arena memory(workspace);
                call.template launch<Rule>(memory, on);
            });
        });
    }

    // Arrays of an A-buffer with room for so many voxels and fragments.
    template <class Payload>
    struct list_arrays {
        static constexpr bool has_payload = abuffer<cuda_backend, Payload>::has_payload;
        buffer<std::uint64_t> voxels, offsets;
        buffer<std::uint32_t> primitives;
        buffer<payload_storage<Payload>> payloads;

        list_arrays(cuda_backend& b, std::uint64_t num_voxels, std::uint64_t num_fragments)
            : voxels(b, num_voxels, stage::abuffer_emit),
              offsets(b, num_voxels == 0 ? 0 : num_voxels + 1, stage::abuffer_emit),
              primitives(b, num_fragments, stage::abuffer_emit),
              payloads(b, has_payload ? num_fragments : 0, stage::abuffer_emit) {}
        [[nodiscard]] device::list_places places(std::uint64_t room) {
            device::list_places p;
            p.voxels = voxels.data();
            p.offsets = offsets.data();
            p.room = room;
            p.primitives = primitives.data();
            p.payloads = payloads.data();
            return p;
        }
        // As much as there is room for.
        void copy(list_arrays& to, cudaStream_t stream) const {
            const auto copy_one = [&](const auto& from, auto& array) {
                if (array.size() != 0)
                    device::check(cudaMemcpyAsync(array.data(), from.data(), array.size() * sizeof(*from.data()),
                                                  cudaMemcpyDeviceToDevice, stream),
                                  stage::abuffer_emit);
            };
            copy_one(voxels, to.voxels);
            copy_one(offsets, to.offsets);
            copy_one(primitives, to.primitives);
            copy_one(payloads, to.payloads);
        }
        void move_into(abuffer<cuda_backend, Payload>& lists, std::uint64_t num_voxels, std::uint64_t num_fragments) {
            voxels.count_ = num_voxels;
            offsets.count_ = num_voxels == 0 ? 0 : num_voxels + 1;
            primitives.count_ = num_fragments;
            payloads.count_ = has_payload ? num_fragments : 0;
            lists.voxels = std::move(voxels);
            lists.offsets = std::move(offsets);
            lists.primitives = std::move(primitives);
            lists.payloads = std::move(payloads);
        }
    };

    // With a little more room than the lists are likely to need. None, and then no voxel_room, where memory is short:
    // the exact lists may still fit.
    template <class Payload>
    [[nodiscard]] list_arrays<Payload> make_beforehand(std::uint64_t& voxel_room, std::uint64_t fragments) {
        try {
            return {*this, voxel_room, voxel_room == 0 ? 0 : fragments};
        } catch (const device::cuda_failure& e) {
            if (e.error != cudaErrorMemoryAllocation) throw;
            voxel_room = 0;
            return {*this, 0, 0};
        }
    }

    template <class Coverage, class Key, class Call, class Payload>
    void fill(coverage rule, const Call& call, std::uint64_t voxel_room, abuffer<cuda_backend, Payload>& lists,
              device::pipeline_state& state) {
        Coverage::dispatch(rule, [&]<coverage Rule>() { fill<Rule, Key>(call, voxel_room, lists, state); });
    }

    // voxel_room: how many voxels the lists are likely to have, 0 where nothing is known. Otherwise nobody waits in
    // between: the arrays are made beforehand.
    template <coverage Rule, class Key, class Call, class Payload>
    void fill(const Call& call, std::uint64_t voxel_room, abuffer<cuda_backend, Payload>& lists,
              device::pipeline_state& state) {
        constexpr stage where = stage::abuffer_emit;
        device::arena plan;
        call.template plan_memory<Key>(plan);
        void* const workspace = reserve(plan.used());
        state_reader_.prepare(use_pinned_memory);
        list_arrays<Payload> arrays = make_beforehand<Payload>(voxel_room, call.limits.fragments);
        if (voxel_room == 0) {
            fill_exactly<Rule, Key>(call, workspace, lists, state);
            return;
        }
        device::launch_until(where, [&] {
            std::optional<device::call_bytes> bytes;
            if constexpr (Call::has_bytes)
                if (may_keep_graph(call.clock)) bytes = call.template bytes<Rule, Key>(workspace, state_reader_.page());
            const device::output_pointers asked = state_reader_.ask(arrays.places(voxel_room));
            state = run_stages(call.clock, bytes, sizeof(device::pipeline_state), [&](cudaStream_t on) {
                device::arena memory(workspace);
                const auto sorted = call.template launch<Rule, Key>(memory, on, asked);
                const auto* const d_state = static_cast<const device::pipeline_state*>(workspace);
                device::place_lists(sorted, d_state, call.limits, on, call.clock);
            });
        });
        if (device::has_failed(state, call.limits)) return;
        const std::uint64_t num_voxels = state.list_voxels, num_fragments = state.list_fragments;
        if (num_voxels > voxel_room) { // more than the last time: once more
            fill<Rule, Key>(call, 0, lists, state);
        } else if (num_fragments >= call.limits.fragments / 4 * 3 || num_fragments == 0) {
            arrays.move_into(lists, num_voxels, num_fragments);
        } else {
            list_arrays<Payload> exact(*this, num_voxels, num_fragments);
            arrays.copy(exact, stream);
            exact.move_into(lists, num_voxels, num_fragments);
        }
    }

    // The same with arrays that are made when all is known.
    template <coverage Rule, class Key, class Call, class Payload>
    void fill_exactly(const Call& call, void* workspace, abuffer<cuda_backend, Payload>& lists,
                      device::pipeline_state& state) {
        constexpr stage where = stage::abuffer_emit;
        device::fragment_lists<Key, payload_storage<Payload>> sorted{};
        device::launch_until(where, [&] {
            state = run_stages(call.clock, std::nullopt, sizeof(device::pipeline_state), [&](cudaStream_t on) {
                device::arena memory(workspace);
                sorted = call.template launch<Rule, Key>(memory, on);
            });
        });
        if (device::has_failed(state, call.limits)) return;
        const std::uint64_t num_voxels = state.list_voxels, num_fragments = state.list_fragments;
        list_arrays<Payload> exact(*this, num_voxels, num_fragments);
        if (num_fragments != 0) {
            if (call.clock != nullptr) call.clock->start(); // leaves the wait and the allocations out
            device::copy_lists_kernel<<<device::fill_device(num_fragments), device::threads_per_block, 0, stream>>>(
                sorted, num_voxels, num_fragments, exact.voxels.data(), exact.offsets.data(), exact.primitives.data(),
                exact.payloads.data());
            device::check(cudaGetLastError(), where);
            device::end_stage(call.clock, &stage_times::abuffer_emit);
        }
        exact.move_into(lists, num_voxels, num_fragments);
    }

    room framebuffer_room_{{true, false, true}}, list_room_{{true, false, true}};
    device_block workspace_;
    device::readback state_reader_;
    device::call_graph call_graph_;
    std::size_t zeroed_bytes_ = 0; // of the workspace, from its start
    strategy_choice choice_;
    std::vector<const void*> discarding_; // kinds of lists' calls that were shaded late and discarded fragments
};

// Not in the class, and so not inline: a unit that links voxelpipe::cuda_kernels does not compile what that has
// (device/kernels.cuh).
template <class Selector, class Mesh, class VertexShader, class FragmentShader, class... Targets, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         const framebuffer_view<Targets...>& fb, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    return attempt(framebuffer_room_, {triangles_in, g.extent, g.offset, options.rule},
                   [&](device::capacities& limits, std::uint64_t, std::uint64_t left, device::pipeline_state& state,
                       device::stage_clock* clock) {
                       limits.longest_ordered = ~0ull; // an order may come before a blend
                       return device::with_framebuffer_call<Selector>(
                           draws, g, fb, options, triangles_in, limits, [&](auto call) {
                               call.clock = clock;
                               choose(call, true);
                               limits.skips_deferred_pass = call.plan.limits.skips_deferred_pass =
                                   call.can_skip_deferred_pass(left) ? 1 : 0;
                               launch_where_it_fits<Coverage>(call, state);
                               return call.lists_fragments() && strategy == voxelpipe::strategy::automatic;
                           });
                   });
}

template <class Mesh, class VertexShader, class FragmentShader, class Payload, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         abuffer<cuda_backend, Payload>& lists, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    using call_type = device::abuffer_call<draw<Mesh, VertexShader, FragmentShader>, payload_storage<Payload>>;
    abuffer<cuda_backend, Payload> made(*this); // so that a call that fails leaves `lists` as they were
    status s = attempt(list_room_, {triangles_in, g.extent, g.offset, options.rule},
                       [&](device::capacities& limits, std::uint64_t voxel_room, std::uint64_t left,
                           device::pipeline_state& state, device::stage_clock* clock) {
                           call_type call{draws, g, static_cast<std::uint32_t>(triangles_in), limits, clock};
                           limits.skips_deferred_pass = call.limits.skips_deferred_pass =
                               call.can_skip_deferred_pass(left) ? 1 : 0;
                           call.has_few_a_voxel = limits.fragments < device::min_counted * voxel_room;
                           if (device::num_voxels(g) >= std::numeric_limits<std::uint32_t>::max()) {
                               fill<Coverage, std::uint64_t>(options.rule, call, voxel_room, made, state);
                               return false;
                           }
                           call.may_shade_late = true;
                           const void* const kind = device::tag_of_call<call_type>();
                           call.filters = std::find(discarding_.begin(), discarding_.end(), kind) != discarding_.end();
                           fill<Coverage, std::uint32_t>(options.rule, call, voxel_room, made, state);
                           if (state.discarded != 0 && call.template shades_late<std::uint32_t>() && !call.filters) {
                               discarding_.push_back(kind);
                               call.filters = true;
                               fill<Coverage, std::uint32_t>(options.rule, call, voxel_room, made, state);
                           }
                           return false;
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
