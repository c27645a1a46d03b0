// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment lists: every fragment, ordered by (voxel, primitive) (paper section 3, A-buffer). In general fragments are
// counted, given offsets by a scan, and written by ascending primitive. Those of one draw are listed in one pass, in
// any order (fragments/list_sink.cuh), if its shader is constant or discards nothing. A stable radix sort by voxel over
// just the bits in use follows, and each voxel's first fragment is selected. Fragments listed in any order are ordered
// within each voxel on the way (fragments/order_voxels.cuh), and shaded then. Memory is proportional to the fragments.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/counting_sort.cuh>
#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/device/fragments/order_voxels.cuh>
#include <voxelpipe/device/fragments/radix_sort.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/fragment_shade.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

#include <algorithm>
#include <bit>
#include <utility>

namespace voxelpipe::device {

// Fragments as cells of count_and_emit: the voxel is the key; the value is the primitive or, if there are payloads, the
// fragment's offset among them.
template <coverage Rule, class Scene, class Payload, class MakePayload>
struct fragment_cells {
    static constexpr coverage rule = Rule;
    static constexpr std::int64_t small_columns = tuning::small_fragment_columns;
    static constexpr bool has_payload = !std::is_same_v<Payload, no_payload>;

    Scene s;
    void* keys; // std::uint64_t if are_wide, otherwise std::uint32_t: one kernel for both
    bool are_wide;
    std::uint32_t* values;
    std::uint32_t* primitives; // by offset, if there are payloads
    Payload* payloads;         // by offset
    bool counts_triangles;

    [[nodiscard]] __device__ core::voxel_box cells(const core::voxel_box& reach) const { return reach; }
    [[nodiscard]] __device__ cell_counts count(const geometry&, const loaded_triangle& t, std::uint32_t primitive,
                                               const core::voxel_box& box, bool) const {
        return walk(t, primitive, box, nothing);
    }
    __device__ void emit(const geometry&, const loaded_triangle& t, std::uint32_t primitive, const core::voxel_box& box,
                         bool, unsigned long long at) const {
        (void)walk(t, primitive, box, at);
    }

private:
    static constexpr unsigned long long nothing = ~0ull;

    // Shades the triangle's fragments within the box and returns how many are kept and discarded. Stores the kept ones
    // from `at` on, unless `at` is `nothing`. Out of line and shared by all kernels that count or store: it is most of
    // their code, and what a shader computes is compiled once.
    __device__ __noinline__ cell_counts walk(const loaded_triangle& t, std::uint32_t primitive,
                                             const core::voxel_box& box, unsigned long long at) const {
        const auto nx = static_cast<std::uint64_t>(s.geo.extent.x), ny = static_cast<std::uint64_t>(s.geo.extent.y);
        cell_counts n;
        shade_fragments<Rule>(s, t, primitive, box, [&](int x, int y, int z, const auto& out) {
            ++(out.keep ? n.kept : n.discarded);
            if (!out.keep || at == nothing) return;
            const std::uint64_t voxel = (static_cast<std::uint64_t>(z) * ny + static_cast<std::uint64_t>(y)) * nx +
                                        static_cast<std::uint64_t>(x);
            if (are_wide)
                static_cast<std::uint64_t*>(keys)[at] = voxel;
            else
                static_cast<std::uint32_t*>(keys)[at] = static_cast<std::uint32_t>(voxel);
            if constexpr (has_payload) {
                primitives[at] = primitive;
                payloads[at] = MakePayload{}(out);
            }
            values[at] = has_payload ? static_cast<std::uint32_t>(at) : primitive;
            ++at;
        });
        return n;
    }
};

// The A-buffer's payload: the fragment shader's one output.
struct first_value {
    template <class Output>
    __device__ auto operator()(const Output& o) const {
        return voxelpipe::get<0>(o.values);
    }
};
// All outputs, for folding them in order.
struct all_values {
    template <class Output>
    __device__ auto operator()(const Output& o) const {
        return o.values;
    }
};

// Arrays of the fragment lists of one call.
template <class Key, class Payload>
struct list_buffers {
    Key* keys[2];
    std::uint32_t* values[2];
    int bits;                      // of a voxel
    sort_memory sort;              // used if are_sorted_here,
    counting_memory counting;      // unless this is in use
    std::uint32_t* primitives;     // by offset; null without payloads
    Payload* payloads;             // by offset; null without payloads
    std::uint64_t* first_of_voxel; // fragment numbers, ascending: list_voxels of them, and room for one more
    csr_pointers* pointers;        // output pointers of the call
    void* storage;
    std::size_t storage_bytes;
};

// Arrays for counting and writing fragments.
struct list_memory {
    cell_buffers cells;
    void* storage; // of the scan
    std::size_t storage_bytes;

    list_memory(arena& memory, std::uint32_t num_primitives, unsigned long long record_capacity)
        : cells(take_cell_buffers(memory, num_primitives, record_capacity)),
          storage_bytes(cell_scan_bytes(num_primitives)) {
        storage = memory.take<std::byte>(storage_bytes);
    }
    [[nodiscard]] list_memory with(pipeline_state* state) const {
        list_memory m = *this;
        m.cells.num_records = &state->fragment_records;
        m.cells.num_cells = &state->list_fragments;
        return m;
    }
};

// The sorted lists, in the memory of the call.
template <class Key, class Payload>
struct fragment_lists {
    const Key* keys;
    const std::uint32_t* voxels; // of each first_of_voxel; null: its key
    const std::uint32_t* values;
    const std::uint32_t* primitives; // null: a value is a primitive
    const Payload* payloads;         // null: all are `payload`
    const std::uint64_t* first_of_voxel;
    const csr_pointers* pointers; // output pointers of the call
    Payload payload;
    bool are_at_output;          // all but the payloads are at the output pointers, and only there
    bool payloads_in_order;      // payloads are by fragment, not by offset
    bool are_payloads_at_output; // and they are there too

    // True if nothing is to be copied to the output pointers.
    [[nodiscard]] bool are_stored() const {
        return are_at_output && (std::is_same_v<Payload, no_payload> || are_payloads_at_output);
    }
    [[nodiscard]] __device__ std::uint64_t voxel(std::uint64_t i) const {
        return voxels != nullptr ? voxels[i] : keys[first_of_voxel[i]];
    }
    [[nodiscard]] __device__ std::uint32_t primitive(std::uint64_t i) const {
        const std::uint32_t value = values[i];
        return primitives == nullptr ? value : primitives[value];
    }
    [[nodiscard]] __device__ const Payload& payload_of(std::uint64_t i) const {
        return payloads == nullptr ? payload : payloads[payloads_in_order ? i : values[i]];
    }
};

// Runs the preparation. If scene/key_sort.cuh sorts, fills the capacity beyond the fragments.
template <class Key>
void prepare_sort(Key* keys, std::uint32_t* values, std::uint64_t capacity, const sort_preparation& preparation,
                  const pipeline_state* state, const capacities& limits, cudaStream_t stream);

// The preparation that a call's lists need before they are sorted.
template <class Key, class Payload>
[[nodiscard]] sort_preparation prepare_lists(const list_buffers<Key, Payload>& b, const output_pointers& outputs,
                                             const tile_counts& tiles, const capacities& limits) {
    sort_preparation p;
    p.is_wanted = true;
    p.sorts = are_sorted_here<Key>(limits.fragments);
    p.sort = b.sort;
    p.counting = b.counting;
    p.capacity = limits.fragments;
    p.tiles = tiles;
    p.outputs = outputs;
    p.pointers = b.pointers;
    return p;
}

template <class Key>
struct sorted_pairs {
    Key *keys, *spare_keys;
    std::uint32_t *values, *spare_values;
};
// Sorts listed fragments by voxel, stably, after `preparation`, if that is wanted.
template <class Key, class Payload>
[[nodiscard]] sorted_pairs<Key> sort_by_voxel(const list_buffers<Key, Payload>& b, const sort_preparation& preparation,
                                              pipeline_state* state, const capacities& limits, cudaStream_t stream,
                                              stage_clock* clock) {
    if (preparation.is_wanted)
        prepare_sort(b.keys[0], b.values[0], limits.fragments, preparation, state, limits, stream);
    int at = 0;
    if (!are_sorted_here<Key>(limits.fragments)) {
        at = sort_by_cell(b.keys, b.values, limits.fragments, b.bits, b.storage, b.storage_bytes, stage::abuffer_emit,
                          stream);
    } else if constexpr (sizeof(Key) == sizeof(std::uint32_t)) {
        at = sort_fragments({{b.keys[0], b.keys[1]}, {b.values[0], b.values[1]}}, sort_count{state, limits},
                            limits.fragments, b.sort, stream);
    }
    end_stage(clock, &stage_times::tile_sort);
    return {b.keys[at], b.keys[1 - at], b.values[at], b.values[1 - at]};
}

// Sorts listed fragments by voxel and selects the first fragment of each voxel.
template <class Key, class Payload>
[[nodiscard]] fragment_lists<Key, Payload>
sort_lists(const list_buffers<Key, Payload>& b, const output_pointers& outputs, pipeline_state* state,
           const capacities& limits, cudaStream_t stream, stage_clock* clock) {
    const sorted_pairs<Key> sorted =
        sort_by_voxel(b, prepare_lists(b, outputs, {}, limits), state, limits, stream, clock);
    fragment_lists<Key, Payload> lists{};
    lists.keys = sorted.keys;
    lists.values = sorted.values;
    lists.primitives = b.primitives;
    lists.payloads = b.payloads;
    lists.first_of_voxel = b.first_of_voxel;
    lists.pointers = b.pointers;
    select_voxels({lists.keys, sizeof(Key) == sizeof(std::uint64_t)}, b.first_of_voxel, state, limits, b.storage,
                  b.storage_bytes, stream);
    end_stage(clock, &stage_times::abuffer_emit);
    return lists;
}

// Sorts primitives listed in any order by voxel, and writes the lists to the output pointers. The raster has run the
// preparation, except for fillers. spare: room for limits.fragments if the sorted voxels are needed afterwards;
// otherwise null.
template <class Payload>
[[nodiscard]] fragment_lists<std::uint32_t, Payload>
sort_unordered(const list_buffers<std::uint32_t, Payload>& b, const order_memory& order, const output_pointers& outputs,
               std::uint32_t num_primitives, std::uint32_t* spare, pipeline_state* state, const capacities& limits,
               cudaStream_t stream, stage_clock* clock) {
    csr_pointers here;
    here.offsets = b.first_of_voxel;
    here.voxel_capacity = limits.fragments;
    fragment_lists<std::uint32_t, Payload> lists{};
    if (b.counting.is_used()) {
        VOXELPIPE_ASSERT(spare == nullptr);
        here.narrow_voxels = b.keys[1];
        here.primitives = b.values[0]; // after they have been read
        order_by_counting({nullptr, b.values[1], b.keys[0], b.pointers, here, order.tiles, order.lists.with(state)},
                          {b.keys[0], b.values[0]}, b.counting, num_primitives, state, limits, stream, clock);
    } else {
        sort_preparation preparation = prepare_lists(b, outputs, order.tiles, limits);
        preparation.is_wanted = !preparation.sorts; // for the fillers
        const sorted_pairs<std::uint32_t> sorted = sort_by_voxel(b, preparation, state, limits, stream, clock);
        here.narrow_voxels = sorted.spare_keys;
        here.primitives = sorted.spare_values;
        order_fragments({sorted.keys, sorted.values, spare != nullptr ? spare : sorted.keys, b.pointers, here,
                         order.tiles, order.lists.with(state)},
                        num_primitives, state, limits, stream);
        lists.keys = sorted.keys;
    }
    end_stage(clock, &stage_times::abuffer_emit);
    lists.voxels = here.narrow_voxels;
    lists.first_of_voxel = here.offsets;
    lists.values = here.primitives; // a value is a primitive
    lists.pointers = b.pointers;
    lists.are_at_output = outputs.value.voxels != nullptr;
    return lists;
}

template <coverage Rule, class MakePayload, class Scene, class Key, class Payload>
[[nodiscard]] fragment_lists<Key, Payload>
build_lists(const Scene& s, const list_buffers<Key, Payload>& b, const list_memory& m, pipeline_state* state,
            const capacities& limits, bool counts_triangles, cudaStream_t stream, stage_clock* clock,
            const output_pointers& outputs = {}) {
    const fragment_cells<Rule, Scene, Payload, MakePayload> op{
        s, b.keys[0], sizeof(Key) == sizeof(std::uint64_t), b.values[0], b.primitives, b.payloads, counts_triangles};
    count_cells(s.geo, op, m.cells, state, m.storage, m.storage_bytes, stage::abuffer_emit, stream);
    emit_cells(s.geo, op, m.cells, state, limits, stage::abuffer_emit, stream);
    end_stage(clock, &stage_times::fine_raster);
    return sort_lists(b, outputs, state, limits, stream, clock);
}

// Takes fragment lists with payloads of one type. one_payload: all fragments have the same payload, which takes no
// memory. may_count: they may be sorted by counting, which leaves no sorted keys.
template <class Key, class Payload>
[[nodiscard]] list_buffers<Key, Payload> take_lists(arena& memory, std::uint64_t num_voxels,
                                                    unsigned long long capacity, bool one_payload = false,
                                                    bool may_count = false) {
    list_buffers<Key, Payload> b{};
    if constexpr (std::is_same_v<Key, std::uint32_t>) {
        const sort_pairs pairs = sort_pairs::take(memory, capacity);
        std::copy_n(pairs.keys, 2, b.keys);
        std::copy_n(pairs.values, 2, b.values);
    } else {
        for (int i = 0; i < 2; ++i) {
            b.keys[i] = memory.take<Key>(capacity);
            b.values[i] = memory.take<std::uint32_t>(capacity);
        }
    }
    b.storage_bytes = select_bytes(capacity);
    if (may_count && counting_memory::suits(num_voxels, capacity)) {
        b.counting = counting_memory::take(memory, capacity, num_voxels);
    } else if (are_sorted_here<Key>(capacity)) {
        b.bits = static_cast<int>(std::bit_width(num_voxels - 1));
        b.sort = sort_memory::take(memory, capacity, b.bits);
    } else {
        b.bits = key_bits(num_voxels);
        b.storage_bytes = std::max(b.storage_bytes, sort_bytes<Key>(capacity, b.bits));
    }
    if (!std::is_same_v<Payload, no_payload> && !one_payload) {
        b.primitives = memory.take<std::uint32_t>(capacity);
        b.payloads = memory.take<Payload>(capacity);
    }
    b.first_of_voxel = memory.take<std::uint64_t>(capacity + 1);
    b.pointers = memory.take<csr_pointers>(1);
    b.storage = memory.take<std::byte>(b.storage_bytes);
    return b;
}

} // namespace voxelpipe::device
