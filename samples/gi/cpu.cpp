// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "frame.hpp"

#include <cpu_ref/backend.hpp>

#include <thread>

namespace gi {

template <>
std::string frame_renderer<vp::cpu_backend>::device() const {
    const unsigned n = how_.threads != 0 ? how_.threads : std::thread::hardware_concurrency();
    return "the CPU, " + std::to_string(n) + (n == 1 ? " thread" : " threads");
}

std::unique_ptr<renderer> make_cpu_renderer(scene s, const settings& how) {
    return std::make_unique<frame_renderer<vp::cpu_backend>>(vp::cpu_backend{how.threads}, std::move(s), how);
}

} // namespace gi
