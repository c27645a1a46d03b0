// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The A-buffer: keeps every fragment, grouped by voxel (paper section 3, "A-buffer"). The layout is CSR: occupied voxel
// ids, ascending; offsets; and for each voxel its fragments by ascending primitive number, each with its payload, the
// fragment shader's one output. If Payload is void there are only the numbers: the triangle lists of a ray-tracing
// grid.

#include <voxelpipe/core/index_iterator.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

struct no_payload {}; // the payload of lists that hold primitives alone

// What a fragment's payload is stored as: void has no_payload.
template <class Payload>
using payload_storage = std::conditional_t<std::is_void_v<Payload>, no_payload, Payload>;

// Host copy of an A-buffer: a random-access range of occupied voxels, ascending, each of which has a random-access
// range of its fragments. voxels[i] is a linear id, (z * ny + y) * nx + x, within the computed part of the grid: in a
// crop it counts from the crop's corner, as in a framebuffer, while fragment::voxel counts in the whole grid. Its
// fragments are [offsets[i], offsets[i + 1]). payloads is empty if Payload is void.
template <class Payload>
class host_abuffer {
public:
    std::vector<std::uint64_t> voxels;              // linear ids of occupied voxels, ascending
    std::vector<std::uint64_t> offsets;             // one more than voxels; empty if there are none
    std::vector<std::uint32_t> primitives;          // one per fragment
    std::vector<payload_storage<Payload>> payloads; // one per fragment
    glm::ivec3 extent{0};                           // voxels of the computed part

    // A fragment unpacks as [primitive, value]; the value of a void payload is no_payload. Primitives are numbered
    // through all draws of the call; primitive_map gives the draw and the triangle.
    struct fragment_entry {
        std::uint32_t primitive;                              // number through all draws of the call
        [[no_unique_address]] payload_storage<Payload> value; // what the fragment shader returned
    };

    // The fragments of a voxel. Refers to the host_abuffer.
    class fragment_range {
    public:
        fragment_range() = default;
        // Fragments [first, last) of all.
        fragment_range(const host_abuffer& owner, std::size_t first, std::size_t last)
            : owner_(&owner), first_(first), last_(last) {}
        [[nodiscard]] fragment_entry operator[](std::size_t i) const {
            VOXELPIPE_EXPECTS(i < size());
            return owner_->fragment(first_ + i);
        }
        [[nodiscard]] auto begin() const { return core::index_iterator(fragment_at{owner_}, first_); }
        [[nodiscard]] auto end() const { return core::index_iterator(fragment_at{owner_}, last_); }
        [[nodiscard]] std::size_t size() const { return last_ - first_; }
        [[nodiscard]] bool empty() const { return first_ == last_; }

    private:
        struct fragment_at {
            const host_abuffer* owner = nullptr;
            fragment_entry operator()(std::size_t i) const { return owner->fragment(i); }
        };
        const host_abuffer* owner_ = nullptr;
        std::size_t first_ = 0, last_ = 0;
    };

    // An occupied voxel unpacks as [voxel, fragments].
    struct voxel_entry {
        glm::ivec3 voxel;         // (x, y, z) in the computed part
        fragment_range fragments; // ascending by primitive
    };

    // Occupied voxel i.
    [[nodiscard]] voxel_entry operator[](std::size_t i) const {
        VOXELPIPE_EXPECTS(i < size());
        return {position(voxels[i]), fragment_range(*this, offsets[i], offsets[i + 1])};
    }
    [[nodiscard]] std::size_t size() const { return voxels.size(); }
    [[nodiscard]] bool empty() const { return voxels.empty(); }
    [[nodiscard]] auto begin() const { return core::index_iterator(voxel_at{this}, 0); }
    [[nodiscard]] auto end() const { return core::index_iterator(voxel_at{this}, size()); }

    // The fragments of a voxel, found by bisection; empty if the voxel is not occupied or outside the extent.
    [[nodiscard]] fragment_range find(const glm::ivec3& voxel) const {
        for (int a = 0; a < 3; ++a)
            if (voxel[a] < 0 || voxel[a] >= extent[a]) return {};
        const auto at = std::lower_bound(voxels.begin(), voxels.end(), id(voxel));
        if (at == voxels.end() || *at != id(voxel)) return {};
        const auto i = static_cast<std::size_t>(at - voxels.begin());
        return fragment_range(*this, offsets[i], offsets[i + 1]);
    }

    // Fragment i of all voxels together.
    [[nodiscard]] fragment_entry fragment(std::size_t i) const {
        if constexpr (std::is_void_v<Payload>)
            return {primitives[i], {}};
        else
            return {primitives[i], payloads[i]};
    }

    // Converts a voxel to its linear id, and back.
    [[nodiscard]] std::uint64_t id(const glm::ivec3& voxel) const {
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        return (wide(voxel.z) * wide(extent.y) + wide(voxel.y)) * wide(extent.x) + wide(voxel.x);
    }
    // (x, y, z) of a linear id.
    [[nodiscard]] glm::ivec3 position(std::uint64_t voxel) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        return {static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny), static_cast<int>(voxel / (nx * ny))};
    }

private:
    struct voxel_at {
        const host_abuffer* owner = nullptr;
        voxel_entry operator()(std::size_t i) const { return (*owner)[i]; }
    };
};

// Owns its lists on `Backend`; voxelize gives them the lengths that they need. Empty before the first voxelize. A
// failed voxelize leaves them unchanged, so memory must hold the old and the new lists at once. Members and to_host
// throw what Backend::buffer throws.
template <class Backend, class Payload = void>
class abuffer {
    static_assert(std::is_void_v<Payload> || std::is_trivially_copyable_v<Payload>,
                  "voxelpipe: an A-buffer's payload must be trivially copyable");
    static_assert(!std::is_same_v<Payload, bool>,
                  "voxelpipe: an A-buffer's payload cannot be bool, whose std::vector is no array; use std::uint8_t");
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using payload_type = payload_storage<Payload>;                // the element of `payloads`
    static constexpr bool has_payload = !std::is_void_v<Payload>; // false if Payload is void

    // Empty. Calls allocate on the backend.
    explicit abuffer(Backend& backend)
        : voxels(backend, 0), offsets(backend, 0), primitives(backend, 0), payloads(backend, 0) {}

    buffer<std::uint64_t> voxels;     // occupied voxels, ascending
    buffer<std::uint64_t> offsets;    // one more than voxels; empty if there are none
    buffer<std::uint32_t> primitives; // one per fragment
    buffer<payload_type> payloads;    // one per fragment; empty if Payload is void
    glm::ivec3 extent{0};             // of the grid of the last voxelize

    [[nodiscard]] std::size_t num_voxels() const { return voxels.size(); }        // Occupied voxels of the last call.
    [[nodiscard]] std::size_t num_fragments() const { return primitives.size(); } // Fragments of the last call.

    // Copies to the host and waits.
    [[nodiscard]] host_abuffer<Payload> to_host(Backend& backend) const {
        host_abuffer<Payload> h;
        h.voxels = voxels.to_host(backend);
        h.offsets = offsets.to_host(backend);
        h.primitives = primitives.to_host(backend);
        h.payloads = payloads.to_host(backend);
        h.extent = extent;
        return h;
    }
};

} // namespace voxelpipe
