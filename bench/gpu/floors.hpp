// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The least that a call can take on this device, measured: every triangle read once (indices and gathered positions)
// and the dense grid written once, or for an A-buffer 8 bytes written a fragment.

#include "session.hpp"

#include <cstdint>

namespace bench::gpu {

// Bytes read and written by a large copy, a second.
[[nodiscard]] double copy_bandwidth(const session& s);
[[nodiscard]] double gather_ms(const session& s, const resident_mesh& mesh);
// 0 bytes: 0.
[[nodiscard]] double memset_ms(const session& s, std::uint64_t bytes);

} // namespace bench::gpu
