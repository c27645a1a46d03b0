// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "compression.hpp"

#ifdef VOXELIZE_HAS_MESHOPT
#include <meshoptimizer.h>
#endif

namespace voxelize::gltf {

#ifdef VOXELIZE_HAS_MESHOPT
std::vector<std::byte> decode_meshopt(const meshopt_view& view, std::span<const std::byte> compressed,
                                      const std::string& where) {
    const auto count = static_cast<std::size_t>(view.count);
    const auto stride = static_cast<std::size_t>(view.byte_stride);
    std::vector<std::byte> bytes(count * stride);
    const auto* const source = reinterpret_cast<const unsigned char*>(compressed.data());
    int error = 0;
    switch (view.mode) {
    case meshopt_mode::attributes:
        error = meshopt_decodeVertexBuffer(bytes.data(), count, stride, source, compressed.size());
        break;
    case meshopt_mode::triangles:
        error = meshopt_decodeIndexBuffer(bytes.data(), count, stride, source, compressed.size());
        break;
    case meshopt_mode::indices:
        error = meshopt_decodeIndexSequence(bytes.data(), count, stride, source, compressed.size());
        break;
    }
    if (error != 0) throw gltf_error(where + ": its compressed data cannot be decoded by meshoptimizer");
    if (view.filter == meshopt_filter::octahedral) meshopt_decodeFilterOct(bytes.data(), count, stride);
    if (view.filter == meshopt_filter::quaternion) meshopt_decodeFilterQuat(bytes.data(), count, stride);
    if (view.filter == meshopt_filter::exponential) meshopt_decodeFilterExp(bytes.data(), count, stride);
    return bytes;
}
#else
std::vector<std::byte> decode_meshopt(const meshopt_view&, std::span<const std::byte>, const std::string& where) {
    throw gltf_error(where + ": this build has no meshoptimizer");
}
#endif

} // namespace voxelize::gltf
