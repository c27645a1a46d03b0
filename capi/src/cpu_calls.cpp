// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The calls on threads of the CPU.

#include "field_calls.hpp"
#include "solid_calls.hpp"
#include "surface_calls.hpp"

#include <cpu_ref/backend.hpp>

namespace voxelpipe::capi {
namespace {

struct cpu_session {
    using backend_type = cpu_backend;
    unsigned threads = 0;

    template <class F>
    status run(const F& f) const {
        cpu_backend backend{threads};
        return f(backend);
    }
    template <class T>
    static void copy(const cpu_backend&, const cpu_backend::buffer<T>& from, T* to) {
        std::copy_n(from.data(), from.size(), to);
    }
};

} // namespace

backend_calls cpu_calls(unsigned threads) {
    const cpu_session session{threads};
    return {std::make_unique<surface_calls_on<cpu_session>>(session, threads),
            std::make_unique<solid_calls_on<cpu_session>>(session),
            std::make_unique<field_calls_on<cpu_session>>(session)};
}

} // namespace voxelpipe::capi
