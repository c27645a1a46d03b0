// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Hands a channel out in pieces, in storage order (x fastest): bits become bytes 0 and 1 on the way, half floats become
// floats where a format has no half. No second dense copy is ever made; a piece is about a megabyte.

#include "model/volume.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace voxelize {

// A format's treatment of half floats.
enum class half_floats { keep, widen };

// Receives the next piece; it is valid only during the call.
using byte_sink = std::function<void(std::span<const std::byte>)>;

// IEEE 754 binary16 to binary32; exact for every value, NaN payloads included.
[[nodiscard]] std::uint32_t widened_half(std::uint16_t half);

// Type of the streamed values: u8 for a bit channel, f32 for a widened f16 one, otherwise the channel's own.
[[nodiscard]] scalar streamed_type(scalar type, half_floats halves);

// Bytes that the whole stream has.
[[nodiscard]] std::uint64_t streamed_bytes(const volume& v, const channel& c, half_floats halves);
// Bytes that the streams of all channels have, those of faces included.
[[nodiscard]] std::uint64_t streamed_bytes(const volume& v, half_floats halves);

// A channel of floats as one of half floats, each the nearest, ties to even, for formats that keep those. It refers to
// `floats`, which it reads as it is streamed. Sets `overflows` once a finite float is beyond 65504, and thus infinite.
[[nodiscard]] channel halved(const channel& floats, std::atomic<bool>& overflows);

// Bytes [begin, begin + size) of the stream, which must be in it. They lie in the channel itself where it is streamed
// as it is, otherwise in `room`, which is resized to hold them. Several threads may read one channel.
[[nodiscard]] std::span<const std::byte> streamed_piece(const volume& v, const channel& c, half_floats halves,
                                                        std::uint64_t begin, std::size_t size,
                                                        std::vector<std::byte>& room);

// Calls `sink` with one piece after the other until the channel is through.
void stream_values(const volume& v, const channel& c, half_floats halves, const byte_sink& sink);

} // namespace voxelize
