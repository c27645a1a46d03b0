// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Arrays of the host's in the memory of a call's backend. Where that is the host's, calls read and write them as they
// are; for a device they are copied. A session runs a call on its backend and copies from it (cpu_calls.cpp,
// cuda/session.cuh).

#include "calls.hpp"

#include <cstddef>
#include <optional>

namespace voxelpipe::capi {

// True where a backend's calls take memory of the host.
template <class Backend>
inline constexpr bool takes_host_memory = requires {
    Backend::runs_on_host;
};

// What a call reads.
template <class Backend, class T>
class input_array {
public:
    input_array(Backend& backend, const T* from, std::size_t count) : data_(from), count_(count) {
        if constexpr (!takes_host_memory<Backend>) {
            copy_.emplace(backend, array_view<const T>(from, count));
            data_ = copy_->data();
        }
    }
    [[nodiscard]] const T* data() const { return data_; }
    [[nodiscard]] array_view<const T> view() const { return {data_, count_}; }

private:
    const T* data_;
    std::size_t count_;
    std::optional<typename Backend::template buffer<T>> copy_;
};

// What a call writes. Null stays null.
template <class Session, class T>
class output_array {
public:
    using backend_type = typename Session::backend_type;

    output_array(backend_type& backend, T* to, std::size_t count) : to_(to), data_(to) {
        if constexpr (!takes_host_memory<backend_type>) {
            if (to == nullptr) return;
            memory_.emplace(backend, count);
            data_ = memory_->data();
        }
    }
    [[nodiscard]] T* data() const { return data_; }
    // Copies what a call that succeeded has written, and returns its status.
    [[nodiscard]] status take(backend_type& backend, const status& s) const {
        if (s.ok() && memory_) Session::copy(backend, *memory_, to_);
        return s;
    }

private:
    T* to_;
    T* data_;
    std::optional<typename backend_type::template buffer<T>> memory_;
};

// A mesh in the memory of a backend.
template <class Backend>
class mesh_on {
public:
    mesh_on(Backend& backend, const vp_mesh& m)
        : positions_(backend, m.positions.data(), m.positions.size()),
          triangles_(backend, m.triangles.data(), m.triangles.size()), index_bound_(m.index_bound) {}
    [[nodiscard]] mesh_view<> view() const {
        return {positions_.view(), triangles_.view(), {}, {triangles_.data(), triangles_.view().size(), index_bound_}};
    }

private:
    input_array<Backend, glm::vec3> positions_;
    input_array<Backend, glm::uvec3> triangles_;
    std::uint64_t index_bound_;
};

// Voxels of an extent that a caller's array has memory for.
[[nodiscard]] inline std::size_t count_of(const glm::ivec3& extent) {
    return static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z);
}

} // namespace voxelpipe::capi
