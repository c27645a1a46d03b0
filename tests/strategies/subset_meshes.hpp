// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Some triangles of a mesh, with their numbers in the whole (mesh_view::part), on any backend.

#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <vector>

namespace device_test {

template <class Backend>
class some_triangles {
public:
    // Every third triangle of those in host memory.
    some_triangles(Backend& backend, const std::vector<glm::uvec3>& all)
        : some_triangles(backend, all, numbers_below(all.size())) {}
    // The triangles with these numbers.
    some_triangles(Backend& backend, const std::vector<glm::uvec3>& all, const std::vector<std::uint32_t>& numbers)
        : triangles_(backend, voxelpipe::array_view<const glm::uvec3>(choose(all, numbers))),
          numbers_(backend, voxelpipe::array_view<const std::uint32_t>(numbers)), whole_(all.size()) {}

    // The whole mesh's view with these triangles alone.
    template <class View>
    [[nodiscard]] View of(View whole, std::uint64_t copies = 1) const {
        whole.triangles = triangles_.view();
        whole.checked = {};
        whole.copies.count = copies;
        whole.part = {numbers_.view(), whole_};
        return whole;
    }

private:
    [[nodiscard]] static std::vector<std::uint32_t> numbers_below(std::size_t count) {
        std::vector<std::uint32_t> numbers;
        for (std::uint32_t i = 1; i < count; i += 3) numbers.push_back(i);
        return numbers;
    }
    [[nodiscard]] static std::vector<glm::uvec3> choose(const std::vector<glm::uvec3>& all,
                                                        const std::vector<std::uint32_t>& numbers) {
        std::vector<glm::uvec3> chosen;
        for (const std::uint32_t i : numbers) chosen.push_back(all[i % all.size()]);
        return chosen;
    }
    typename Backend::template buffer<glm::uvec3> triangles_;
    typename Backend::template buffer<std::uint32_t> numbers_;
    std::uint64_t whole_;
};

} // namespace device_test
