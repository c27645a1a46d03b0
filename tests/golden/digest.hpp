// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The hash of all golden tests: 64-bit FNV-1a. What is hashed has one form on every machine: numbers are taken byte by
// byte from the lowest, floats as their bits, and an array begins with its length in bytes, as 8 bytes.

#include <voxelpipe/core/value_traits.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace golden {

class digest {
public:
    // An array of integers, enumerations, floats, halves, bytes, or glm vectors of these.
    template <class T>
    void add(const std::vector<T>& values) {
        add(std::span<const T>(values));
    }
    template <class T>
    void add(std::span<const T> values) {
        add_length(values.size() * size_of<T>());
        for (const T& v : values) put(v);
    }
    // An array of one number.
    void add(std::uint64_t value) { add(std::span<const std::uint64_t>(&value, 1)); }

    [[nodiscard]] std::uint64_t value() const { return hash_; }
    // 16 digits.
    [[nodiscard]] std::string hex() const {
        std::string text(16, '0');
        for (std::size_t i = 0; i < 16; ++i) text[i] = "0123456789abcdef"[(hash_ >> (60 - 4 * i)) & 15u];
        return text;
    }

private:
    template <class T>
    static constexpr std::size_t size_of() {
        using namespace voxelpipe::core;
        return static_cast<std::size_t>(vector_traits<T>::components) * sizeof(typename vector_traits<T>::element);
    }
    void add_length(std::uint64_t bytes) { put(bytes); }
    template <class T>
    void put(const T& v) {
        namespace core = voxelpipe::core;
        if constexpr (core::vector_traits<T>::components > 1) {
            for (int i = 0; i < core::vector_traits<T>::components; ++i) put(v[i]);
        } else if constexpr (core::is_floating<T>) {
            put(core::bit_cast<typename core::float_bits<T>::type>(v));
        } else if constexpr (core::is_packed<T>) {
            put(v.bits);
        } else if constexpr (std::is_enum_v<T>) { // std::byte among them
            put(static_cast<std::underlying_type_t<T>>(v));
        } else {
            static_assert(std::is_integral_v<T>, "a type whose bytes have no order of their own");
            const auto bits = static_cast<std::uint64_t>(v);
            for (std::size_t i = 0; i < sizeof(T); ++i) hash_ = (hash_ ^ ((bits >> (8 * i)) & 0xffu)) * 0x100000001b3u;
        }
    }

    std::uint64_t hash_ = 0xcbf29ce484222325u;
};

} // namespace golden
