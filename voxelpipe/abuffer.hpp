// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The A-buffer: every fragment kept, bucketed by voxel (paper section 3, "A-buffer"). CSR: occupied voxel ids
// ascending, offsets, and for each voxel its fragments by ascending primitive number, each with the payload that the
// fragment shader gave (its one output), or the number alone where Payload is void: the triangle lists of a ray-tracing
// grid.

#include <voxelpipe/framebuffer.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

struct no_payload {};

template <class Payload>
using payload_storage = std::conditional_t<std::is_void_v<Payload>, no_payload, Payload>;

// Host copy of an A-buffer. voxels[i] is a linear id, (z * ny + y) * nx + x, within the computed part of the grid; its
// fragments are [offsets[i], offsets[i + 1]). payloads is empty where Payload is void.
template <class Payload>
class host_abuffer {
public:
    std::vector<std::uint64_t> voxels;
    std::vector<std::uint64_t> offsets;
    std::vector<std::uint32_t> primitives;
    std::vector<payload_storage<Payload>> payloads;
    glm::ivec3 extent{0};

    // A fragment unpacks as [triangle, value]; the value of a void payload is no_payload.
    struct fragment_entry {
        std::uint32_t triangle;
        [[no_unique_address]] payload_storage<Payload> value;
    };

    class fragment_range {
    public:
        fragment_range(const host_abuffer& owner, std::size_t first, std::size_t last)
            : owner_(owner), first_(first), last_(last) {}
        class iterator {
        public:
            iterator(const host_abuffer& owner, std::size_t i) : owner_(&owner), i_(i) {}
            fragment_entry operator*() const {
                if constexpr (std::is_void_v<Payload>)
                    return {owner_->primitives[i_], {}};
                else
                    return {owner_->primitives[i_], owner_->payloads[i_]};
            }
            iterator& operator++() {
                ++i_;
                return *this;
            }
            friend bool operator==(const iterator& a, const iterator& b) { return a.i_ == b.i_; }

        private:
            const host_abuffer* owner_;
            std::size_t i_;
        };
        [[nodiscard]] iterator begin() const { return {owner_, first_}; }
        [[nodiscard]] iterator end() const { return {owner_, last_}; }
        [[nodiscard]] std::size_t size() const { return last_ - first_; }

    private:
        const host_abuffer& owner_;
        std::size_t first_, last_;
    };

    // An occupied voxel unpacks as [voxel, fragments].
    struct voxel_entry {
        glm::ivec3 voxel;
        fragment_range fragments;
    };

    class iterator {
    public:
        iterator(const host_abuffer& owner, std::size_t i) : owner_(&owner), i_(i) {}
        voxel_entry operator*() const {
            return {owner_->position(owner_->voxels[i_]),
                    fragment_range(*owner_, owner_->offsets[i_], owner_->offsets[i_ + 1])};
        }
        iterator& operator++() {
            ++i_;
            return *this;
        }
        friend bool operator==(const iterator& a, const iterator& b) { return a.i_ == b.i_; }

    private:
        const host_abuffer* owner_;
        std::size_t i_;
    };
    [[nodiscard]] iterator begin() const { return {*this, 0}; }
    [[nodiscard]] iterator end() const { return {*this, voxels.size()}; }

    [[nodiscard]] glm::ivec3 position(std::uint64_t voxel) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        return {static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny), static_cast<int>(voxel / (nx * ny))};
    }
};

// Owns its lists on `Backend`; voxelize makes them as long as they must be. Empty before the first voxelize; after one
// that failed they are as they were. So the new lists are made before the old ones go, and memory has to hold both.
template <class Backend, class Payload = void>
class abuffer {
    static_assert(std::is_void_v<Payload> || std::is_trivially_copyable_v<Payload>,
                  "voxelpipe: an A-buffer's payload must be trivially copyable");
    static_assert(!std::is_same_v<Payload, bool>,
                  "voxelpipe: an A-buffer's payload cannot be bool, whose std::vector is no array; use std::uint8_t");
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using payload_type = payload_storage<Payload>;
    static constexpr bool has_payload = !std::is_void_v<Payload>;

    explicit abuffer(Backend& backend)
        : voxels(backend, 0), offsets(backend, 0), primitives(backend, 0), payloads(backend, 0) {}

    buffer<std::uint64_t> voxels;     // occupied voxels, ascending
    buffer<std::uint64_t> offsets;    // one more than voxels; empty where there are none
    buffer<std::uint32_t> primitives; // one per fragment
    buffer<payload_type> payloads;    // one per fragment; empty where Payload is void
    glm::ivec3 extent{0};             // of the grid of the last voxelize

    [[nodiscard]] std::size_t num_voxels() const { return voxels.size(); }
    [[nodiscard]] std::size_t num_fragments() const { return primitives.size(); }

    // Copies, then waits.
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
