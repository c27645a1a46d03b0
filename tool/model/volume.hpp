// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The result that the pipeline hands to the writers: one grid with any number of named, dense channels.
// Plain host memory, owned; it knows nothing of the library, so that writers and their tests build without it.
//
// Voxel (i,j,k) fills the box  origin + (i,j,k) * voxel_size  ..  origin + (i+1,j+1,k+1) * voxel_size  of world space.
// Every channel is dense and x runs fastest, then y, then z; components of one voxel lie together (RGBARGBA).
// A `bit` channel packs 32 voxels along x into a 32-bit word, lowest bit first; each row (j,k) starts a new word, so a
// row is ceil(nx/32) words, and the bits past nx are zero.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

// Value type of one component. `bit` is the packed type described above; f16 is IEEE 754 binary16.
enum class scalar : std::uint8_t { bit, u8, u16, u32, u64, i32, i64, f16, f32, f64 };

// Bytes of one component; 0 for `bit`, which has no byte of its own.
[[nodiscard]] constexpr std::size_t size_of(scalar type) {
    switch (type) {
    case scalar::bit:
        return 0;
    case scalar::u8:
        return 1;
    case scalar::u16:
    case scalar::f16:
        return 2;
    case scalar::u32:
    case scalar::i32:
    case scalar::f32:
        return 4;
    case scalar::u64:
    case scalar::i64:
    case scalar::f64:
        return 8;
    }
    return 0;
}

// "bit", "u8", ... as the command line and the messages spell them.
[[nodiscard]] constexpr std::string_view name_of(scalar type) {
    constexpr std::array<std::string_view, 10> names{"bit", "u8",  "u16", "u32", "u64",
                                                     "i32", "i64", "f16", "f32", "f64"};
    return names[static_cast<std::size_t>(type)];
}

// std::allocator, but that elements without a value stay as the memory is. Clearing gigabytes on one thread before all
// threads write them would cost more than the writing.
template <class T>
struct unset_allocator : std::allocator<T> {
    template <class U>
    struct rebind {
        using other = unset_allocator<U>;
    };
    template <class U>
    void construct(U* at) noexcept(std::is_nothrow_default_constructible_v<U>) {
        ::new (static_cast<void*>(at)) U;
    }
    template <class U, class... Args>
    void construct(U* at, Args&&... args) {
        ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
    }
};
using channel_bytes = std::vector<std::byte, unset_allocator<std::byte>>;

// One value per voxel. Names with a meaning to the writers: "occupancy" (bit), "color" (u8 x 4, sRGB and alpha).
// A name is made of letters, digits, '_', '-' and '.', since it becomes part of file names and of XML.
struct channel {
    std::string name;
    scalar type = scalar::bit;
    int components = 1; // 1..4; always 1 for `bit`
    channel_bytes data;
    // In place of data: writes the values of the voxels from number `first` on, in storage order, as many as `to` has
    // room for; bits as bytes 0 and 1. Any thread may call it. Only dense_stream.hpp and level_set.hpp read such
    // channels; those of f16 come from halved(), for formats that keep half floats.
    std::function<void(std::uint64_t first, std::span<std::byte> to)> read = {};
};

// What the channel "distance" of a volume holds: distances from a mesh in world units, a sample at each voxel's centre.
struct distance_field {
    float band = std::numeric_limits<float>::infinity(); // what samples further away hold; infinity: there are none
    bool is_signed = true;                               // negative inside
};

struct volume {
    std::array<std::int64_t, 3> extent{0, 0, 0}; // nx, ny, nz, each >= 1 in a valid volume
    std::array<double, 3> origin{0, 0, 0};       // world position of the low corner of voxel (0,0,0)
    std::array<double, 3> voxel_size{1, 1, 1};   // world units, per axis, > 0
    std::vector<channel> channels;
    std::optional<distance_field> distances; // of a volume with the channel "distance"
    // What lies on the faces between voxels, of which a grid has one more along an axis than voxels: a volume of one
    // channel for each such channel, whose voxels are centred on the faces. They have no faces of their own.
    std::vector<volume> faces;

    // Calls use(v, c) for every channel, with the volume whose extent it has: those of this volume, then those of
    // faces.
    template <class Use>
    void for_each_channel(const Use& use) const {
        for (const channel& c : channels) use(*this, c);
        for (const volume& f : faces)
            for (const channel& c : f.channels) use(f, c);
    }
    [[nodiscard]] std::size_t num_channels() const { return channels.size() + faces.size(); }

    [[nodiscard]] std::int64_t num_voxels() const { return extent[0] * extent[1] * extent[2]; }

    // 32-bit words in one row of a bit channel.
    [[nodiscard]] std::int64_t words_per_row() const { return (extent[0] + 31) / 32; }

    // Linear index of a voxel in a channel that is not `bit`; multiply by its components for the first value.
    [[nodiscard]] std::int64_t index(std::int64_t i, std::int64_t j, std::int64_t k) const {
        return (k * extent[1] + j) * extent[0] + i;
    }

    // Bytes that a channel of this volume holds.
    [[nodiscard]] std::size_t num_bytes(scalar type, int components) const {
        if (type == scalar::bit) return static_cast<std::size_t>(words_per_row() * extent[1] * extent[2]) * 4;
        return static_cast<std::size_t>(num_voxels()) * size_of(type) * static_cast<std::size_t>(components);
    }

    // Appends a zero-filled channel and returns it; the reference holds until the next call.
    channel& add(std::string name, scalar type, int components = 1) {
        channels.push_back({std::move(name), type, components, {}});
        channels.back().data.resize(num_bytes(type, components), std::byte{0});
        return channels.back();
    }

    // The same with bytes of any value, for those who write every one of them.
    channel& add_unset(std::string name, scalar type, int components = 1) {
        channels.push_back({std::move(name), type, components, {}});
        channels.back().data.resize(num_bytes(type, components));
        return channels.back();
    }

    // The channel of that name, or null.
    [[nodiscard]] const channel* find(std::string_view name) const {
        for (const channel& c : channels)
            if (c.name == name) return &c;
        return nullptr;
    }
    [[nodiscard]] channel* find(std::string_view name) { return const_cast<channel*>(std::as_const(*this).find(name)); }

    // The packed occupancy, or null when the volume has none. occupied() and popcount() then throw.
    [[nodiscard]] const channel* occupancy() const {
        const channel* c = find("occupancy");
        return c != nullptr && c->type == scalar::bit ? c : nullptr;
    }

    // Word w of row (j,k) of a bit channel: voxels (32 w .. 32 w + 31, j, k).
    [[nodiscard]] std::uint32_t word(const channel& bits, std::int64_t w, std::int64_t j, std::int64_t k) const {
        std::uint32_t value;
        std::memcpy(&value, bits.data.data() + 4 * ((k * extent[1] + j) * words_per_row() + w), 4);
        return value;
    }

    [[nodiscard]] bool bit(const channel& bits, std::int64_t i, std::int64_t j, std::int64_t k) const {
        return (word(bits, i / 32, j, k) >> (i % 32) & 1u) != 0;
    }

    void set_bit(channel& bits, std::int64_t i, std::int64_t j, std::int64_t k, bool on = true) const {
        std::byte* at = bits.data.data() + 4 * ((k * extent[1] + j) * words_per_row() + i / 32);
        std::uint32_t value;
        std::memcpy(&value, at, 4);
        const std::uint32_t mask = std::uint32_t{1} << (i % 32);
        value = on ? value | mask : value & ~mask;
        std::memcpy(at, &value, 4);
    }

    [[nodiscard]] bool occupied(std::int64_t i, std::int64_t j, std::int64_t k) const {
        const channel* bits = occupancy();
        if (bits == nullptr) throw std::logic_error("the volume has no occupancy channel");
        return bit(*bits, i, j, k);
    }

    // Number of set voxels of the occupancy, or of any bit channel.
    [[nodiscard]] std::int64_t popcount() const {
        const channel* bits = occupancy();
        if (bits == nullptr) throw std::logic_error("the volume has no occupancy channel");
        return popcount(*bits);
    }
    [[nodiscard]] static std::int64_t popcount(const channel& bits) {
        std::int64_t sum = 0;
        for (std::size_t at = 0; at + 4 <= bits.data.size(); at += 4) {
            std::uint32_t value;
            std::memcpy(&value, bits.data.data() + at, 4);
            sum += std::popcount(value);
        }
        return sum;
    }

    // Throws std::invalid_argument with one line when the parts do not fit together: an extent below 1 or too large to
    // count, components outside 1..4, a bit channel with several, data of the wrong length, a name missing or used
    // twice.
    void check() const {
        std::int64_t count = 1;
        for (std::int64_t n : extent) {
            if (n < 1) throw std::invalid_argument("every extent of a volume must be at least 1");
            if (count > std::numeric_limits<std::int64_t>::max() / 64 / n)
                throw std::invalid_argument("the volume has more voxels than can be counted");
            count *= n;
        }
        for (const double s : voxel_size)
            if (!(s > 0)) throw std::invalid_argument("every voxel size of a volume must be positive");
        for (const channel& c : channels) {
            if (c.name.empty()) throw std::invalid_argument("a channel has no name");
            for (const char ch : c.name)
                if (!((ch >= 'a' && ch <= 'z') || (ch >= 'A' && ch <= 'Z') || (ch >= '0' && ch <= '9') || ch == '_' ||
                      ch == '-' || ch == '.'))
                    throw std::invalid_argument("a channel name may hold only letters, digits, '_', '-' and '.'");
            if (find(c.name) != &c) throw std::invalid_argument("two channels are named '" + c.name + "'");
            if (c.components < 1 || c.components > 4 || (c.type == scalar::bit && c.components != 1))
                throw std::invalid_argument("channel '" + c.name + "' has an impossible number of components");
            if (!c.read && c.data.size() != num_bytes(c.type, c.components))
                throw std::invalid_argument("channel '" + c.name + "' does not hold one value per voxel");
        }
        for (const volume& f : faces) {
            if (f.channels.size() != 1 || !f.faces.empty())
                throw std::invalid_argument("faces of a volume hold one channel each");
            f.check();
        }
    }
};

} // namespace voxelize
