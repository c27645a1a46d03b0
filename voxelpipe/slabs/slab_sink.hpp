// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Calls of a user's sink by a stream that cuts slabs where memory is short.

#include <voxelpipe/slabs/slab_lists.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/voxelize.hpp>

#include <exception>
#include <new>

namespace voxelpipe::slabs::detail {

// Calls work(the sink, as one that returns true if it has thrown nothing). A shortage of memory is a status, but
// one of the sink is thrown: a slab that was cut for it would reach the sink twice.
template <class Sink, class Work>
[[nodiscard]] status with_sink(const Sink& sink, const Work& work) {
    std::exception_ptr thrown;
    status result;
    try {
        result = work([&](const slab& part, auto& out) {
            try {
                sink(part, out);
            } catch (...) {
                thrown = std::current_exception();
            }
            return !thrown;
        });
    } catch (const std::bad_alloc&) {
        result = core::failure(status_code::out_of_memory, stage::coarse_raster);
    }
    if (thrown) std::rethrow_exception(thrown);
    return result;
}

} // namespace voxelpipe::slabs::detail
