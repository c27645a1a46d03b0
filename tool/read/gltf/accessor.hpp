// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Accessors as numbers: every component type, normalised or not, interleaved, sparse over a buffer view or over zeros.
// The document's layout has been checked (check.hpp); what depends on the data itself is checked here.

#include "budget.hpp"
#include "check.hpp"
#include "resources.hpp"

#include <tiny_gltf.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize::gltf {

class accessor_reader {
public:
    // All of them must outlive this. Decodes what Draco has compressed; throws gltf_error.
    accessor_reader(const tinygltf::Model& model, const checked_document& document, const resources& bytes,
                    budget& memory)
        : model_{model}, document_{document}, bytes_{bytes}, memory_{memory} {
        read_draco();
    }

    // count * components numbers of accessor INDEX, which must not be a matrix. Integers as they are, or with
    // NORMALIZED as glTF maps them to [0, 1] or [-1, 1]. USER is named in errors.
    [[nodiscard]] std::vector<double> numbers(std::size_t index, bool normalized, const std::string& user) const;

    // The elements of accessor INDEX in the file, one every `stride` bytes; nothing for an accessor that is
    // sparse or without a buffer view, whose elements lie nowhere.
    struct elements_in_place {
        const std::byte* first;
        std::size_t stride;
    };
    [[nodiscard]] std::optional<elements_in_place> in_place(std::size_t index) const;

    // The values of an unsigned scalar accessor.
    [[nodiscard]] std::vector<std::uint32_t> indices(std::size_t index, const std::string& user) const;

    // The bytes of buffer view INDEX, decompressed where they have to be.
    [[nodiscard]] std::span<const std::byte> view(std::size_t index) const;

private:
    void read_draco();

    // count elements, tightly packed, sparse substitution done.
    [[nodiscard]] std::vector<std::byte> packed(std::size_t index, std::size_t element_bytes,
                                                const std::string& user) const;

    const tinygltf::Model& model_;
    const checked_document& document_;
    const resources& bytes_;
    budget& memory_;
    std::map<std::size_t, std::vector<std::byte>> draco_accessors_; // packed
    mutable std::map<std::size_t, std::vector<std::byte>> meshopt_views_;
};

} // namespace voxelize::gltf
