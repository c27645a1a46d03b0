// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Union-find over numbers in an array that many threads change, on the host or on the device. The root of a set is its
// lowest number, whatever order threads join in.

#include <voxelpipe/config.hpp>

#include <atomic>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

template <class Number>
struct disjoint_sets {
    static_assert(std::is_same_v<Number, std::uint32_t> || std::is_same_v<Number, std::uint64_t>);

    Number* parents; // of each number a lower one of its set; of a root itself

    [[nodiscard]] VOXELPIPE_HD Number root(Number v) const {
        for (;;) {
            const Number up = load(parents[v]);
            if (up == v) return v;
            const Number next = load(parents[up]);
            if (next == up) return up;
            // Halves the path. Only roots are joined, and v is not one, so that no join is lost, whatever other threads
            // have stored meanwhile: all of it is lower, and of the same set.
            store(parents[v], next);
            v = next;
        }
    }
    // A number of the set of v: v itself where it is the root.
    [[nodiscard]] VOXELPIPE_HD Number parent(Number v) const { return load(parents[v]); }
    // The root without a change. While threads replace parents by roots, a path must not be halved: a thread that has
    // read the path before would put an older parent in the place of a root.
    [[nodiscard]] VOXELPIPE_HD Number find(Number v) const {
        for (;;) {
            const Number up = load(parents[v]);
            if (up == v) return v;
            v = up;
        }
    }
    // Returns whether that made one set of two, which it does for one of the threads that join the same two.
    VOXELPIPE_HD bool join(Number a, Number b) const {
        for (;;) {
            a = root(a);
            b = root(b);
            if (a == b) return false;
            const Number high = a > b ? a : b, low = a > b ? b : a;
            if (exchange(parents[high], high, low)) return true;
        }
    }
    // The same while no other thread changes these sets.
    VOXELPIPE_HD void join_alone(Number a, Number b) const {
        a = root(a);
        b = root(b);
        if (a < b)
            store(parents[b], a);
        else
            store(parents[a], b);
    }
    // Makes a root the parent of v. Other threads may do the same for other numbers, if they call find and not root.
    VOXELPIPE_HD void set_root(Number v, Number root) const { store(parents[v], root); }

private:
    [[nodiscard]] VOXELPIPE_HD static Number load(Number& from) {
#if defined(__CUDA_ARCH__)
        return *const_cast<const volatile Number*>(&from);
#else
        return std::atomic_ref(from).load(std::memory_order_relaxed);
#endif
    }
    VOXELPIPE_HD static void store(Number& to, Number value) {
#if defined(__CUDA_ARCH__)
        *const_cast<volatile Number*>(&to) = value;
#else
        std::atomic_ref(to).store(value, std::memory_order_relaxed);
#endif
    }
    // True if `to` was `from`, and is `value` now.
    VOXELPIPE_HD static bool exchange(Number& to, Number from, Number value) {
#if defined(__CUDA_ARCH__)
        if constexpr (sizeof(Number) == 8)
            return atomicCAS(reinterpret_cast<unsigned long long*>(&to), static_cast<unsigned long long>(from),
                             static_cast<unsigned long long>(value)) == from;
        else
            return atomicCAS(&to, from, value) == from;
#else
        return std::atomic_ref(to).compare_exchange_strong(from, value, std::memory_order_relaxed);
#endif
    }
};

} // namespace voxelpipe::core
