// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lists in a backend's memory, and how the host reads them.

#include "model/parallel.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace voxelize {

// Access of the host to a backend's memory. This is for memory that it reads where it lies; other backends specialise
// it before the pipeline is instantiated.
template <class Backend>
struct memory_access {
    static constexpr bool on_host = true;

    // out[i] = value(i) for every i < count. `out` is host memory, what `value` reads is the backend's.
    template <class T, class Value>
    static void read(Backend&, T* out, std::size_t count, const Value& value, int threads) {
        constexpr std::size_t block = 1 << 16;
        parallel_for((count + block - 1) / block, threads, [&](std::size_t b) {
            for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) out[i] = value(i);
        });
    }
    // Copies a list out of the backend's memory.
    template <class T>
    [[nodiscard]] static std::vector<T> list(Backend&, const T* from, std::size_t count) {
        return std::vector(from, from + count);
    }
};

// A list of the scene where the backend reads it: taken over where that is host memory, otherwise copied.
template <class Backend, class T>
class stored {
public:
    stored(Backend& backend, std::vector<T>& source) {
        if constexpr (memory_access<Backend>::on_host)
            host_ = std::move(source);
        else
            copy_.push_back({backend, source});
    }
    // Takes a list that others may hold too.
    stored(Backend& backend, const std::shared_ptr<const std::vector<T>>& source) {
        if constexpr (memory_access<Backend>::on_host)
            shared_ = source;
        else
            copy_.push_back({backend, *source});
    }
    [[nodiscard]] const T* data() const { return copy_.empty() ? on_host().data() : copy_.front().data(); }
    [[nodiscard]] std::size_t size() const { return copy_.empty() ? on_host().size() : copy_.front().size(); }
    [[nodiscard]] voxelpipe::array_view<const T> view() const { return {data(), size()}; }

private:
    [[nodiscard]] const std::vector<T>& on_host() const { return shared_ ? *shared_ : host_; }

    std::vector<T> host_;
    std::shared_ptr<const std::vector<T>> shared_; // in place of host_
    std::vector<typename Backend::template buffer<T>> copy_;
};

} // namespace voxelize
