// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The memory that a file may ask for, in proportion to its own size: a protection against files that claim what they do
// not hold. Every allocation whose size the file decides is charged here before it is made; what does not fit is a
// gltf_error. Honest files stay far below; whether they fit into the machine is another question (memory.hpp).

#include "read/gltf_scene.hpp"

#include <cstdint>
#include <string>

namespace voxelize::gltf {

class budget {
public:
    explicit budget(const gltf_limits& limits) : limits_{limits}, allowed_{limits.base_memory} {}

    // BYTES of input have been read: that much more may be asked for.
    void grant_input(std::uint64_t bytes) {
        input_ += bytes;
        allowed_ += saturating_product(bytes, limits_.memory_per_input_byte);
    }

    // WHAT is going to take COUNT things of BYTES_EACH. Products that overflow never fit.
    void charge(std::uint64_t count, std::uint64_t bytes_each, const std::string& what) {
        const std::uint64_t bytes = saturating_product(count, bytes_each);
        if (bytes > allowed_ - used_)
            throw gltf_error(what + ": with it the file asks for " +
                             std::to_string((used_ + bytes + (1 << 20) - 1) >> 20) + " MiB of memory, and its " +
                             std::to_string(input_) + " bytes cannot hold what fills more than " +
                             std::to_string(allowed_ >> 20) + " MiB");
        used_ += bytes;
    }

    // Counts memory that outlives every scope.
    void charge_to_the_end(std::uint64_t count, std::uint64_t bytes_each, const std::string& what) {
        charge(count, bytes_each, what);
        lasting_ += saturating_product(count, bytes_each);
    }

    [[nodiscard]] const gltf_limits& limits() const { return limits_; }

    // Charges while a scope lives are temporary: the scope's end gives them back.
    class scope {
    public:
        explicit scope(budget& owner) : owner_{owner}, used_before_{owner.used_}, lasting_before_{owner.lasting_} {}
        ~scope() { owner_.used_ = used_before_ + (owner_.lasting_ - lasting_before_); }
        scope(const scope&) = delete;
        scope& operator=(const scope&) = delete;

    private:
        budget& owner_;
        std::uint64_t used_before_;
        std::uint64_t lasting_before_;
    };

private:
    // Bounded well below 2^64, so that sums of a few of them cannot wrap.
    static std::uint64_t saturating_product(std::uint64_t a, std::uint64_t b) {
        constexpr std::uint64_t most = std::uint64_t{1} << 60;
        if (a == 0 || b == 0) return 0;
        return a > most / b ? most : a * b;
    }

    gltf_limits limits_;
    std::uint64_t allowed_;
    std::uint64_t used_ = 0;
    std::uint64_t lasting_ = 0; // of used_: what no scope gives back
    std::uint64_t input_ = 0;   // bytes
};

} // namespace voxelize::gltf
