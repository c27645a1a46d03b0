// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <algorithm>
#include <numeric>

namespace voxelpipe::capi {
namespace {

std::size_t element_bytes(std::int32_t type) {
    constexpr std::size_t bytes[] = {1, 4, 4, 8};
    return bytes[type];
}

[[noreturn]] void fail_array(const char* what, const std::string& why) {
    throw failure{VP_ERROR_BAD_ARRAY, std::string(what) + ": " + why};
}

} // namespace

array_place place_of(const vp_array* array, const char* what, std::initializer_list<std::int32_t> types,
                     const glm::ivec3& extent, std::size_t values) {
    const vp_array& a = checked_struct(array, what);
    if (std::find(types.begin(), types.end(), a.type) == types.end())
        fail_array(what, "type " + std::to_string(a.type) + " is none that this call writes");
    check_pointer(a.data, what);
    const std::size_t bytes = element_bytes(a.type);
    if (reinterpret_cast<std::uintptr_t>(a.data) % bytes != 0)
        fail_array(what, "the data is not aligned to " + std::to_string(bytes) + " bytes");
    array_place place;
    place.data = static_cast<std::byte*>(a.data);
    place.count = {a.type == VP_TYPE_BITS ? bindings::words_per_row(extent) : static_cast<std::size_t>(extent.x),
                   static_cast<std::size_t>(extent.y), static_cast<std::size_t>(extent.z), values};
    const auto& n = place.count;
    // 2^60 voxels of 1024 values and 8 bytes do not fit 64 bits: no array holds them, whatever its strides.
    const double needed = static_cast<double>(n[0]) * static_cast<double>(n[1]) * static_cast<double>(n[2]) *
                          static_cast<double>(n[3] * bytes);
    if (needed > 0x1p62 || static_cast<double>(a.size) < needed * 0.999)
        fail_array(what, "size is " + std::to_string(a.size) + " bytes, too few for " + std::to_string(n[0]) + " x " +
                             std::to_string(n[1]) + " x " + std::to_string(n[2]) + " elements of " +
                             std::to_string(n[3] * bytes) + " bytes");
    const std::array<std::size_t, 4> packed{n[3] * bytes, n[0] * n[3] * bytes, n[1] * n[0] * n[3] * bytes, bytes};
    place.stride = {a.stride[0], a.stride[1], a.stride[2], a.value_stride};
    if (place.stride == std::array<std::size_t, 4>{}) place.stride = packed;
    place.is_packed = true;
    std::array<std::size_t, 4> order{0, 1, 2, 3};
    for (const std::size_t i : order) {
        if (n[i] == 1) place.stride[i] = packed[i]; // nobody takes a step
        if (place.stride[i] % bytes != 0)
            fail_array(what,
                       "a stride of " + std::to_string(place.stride[i]) + " bytes is no whole number of elements");
        place.is_packed = place.is_packed && (n[i] == 1 || place.stride[i] == packed[i]);
    }
    // From the shortest stride on, each has to step over all that the shorter ones reach.
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
        return std::pair(n[i] == 1, place.stride[i]) < std::pair(n[j] == 1, place.stride[j]);
    });
    std::size_t reach = bytes; // of the axes so far, within `size`
    for (const std::size_t i : order) {
        if (n[i] == 1) continue;
        if (place.stride[i] < reach)
            fail_array(what, "with a stride of " + std::to_string(place.stride[i]) + " bytes elements overlap");
        if (reach > a.size || place.stride[i] > (a.size - reach) / (n[i] - 1))
            fail_array(what, "size is " + std::to_string(a.size) + " bytes, and the strides lead beyond it");
        reach += place.stride[i] * (n[i] - 1);
    }
    if (reach > a.size)
        fail_array(what, "size is " + std::to_string(a.size) + " bytes, too few for an element of " +
                             std::to_string(bytes) + " bytes");
    return place;
}

} // namespace voxelpipe::capi
