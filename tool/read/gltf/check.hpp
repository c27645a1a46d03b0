// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// JSON text -> the part of the document that the loader uses, every type, range, reference and length checked. tinygltf
// accepts wrong types in silence, drops primitives that it cannot parse and trusts references; so it is given the
// reduced text that this leaves, in which all of that has been settled, and never the file itself.

#include "budget.hpp"
#include "compression.hpp"
#include "leniency.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::gltf {

struct buffer_source {
    std::uint64_t byte_length = 0;  // as declared; every buffer view lies inside it
    std::optional<std::string> uri; // none: the BIN chunk where it is the first buffer, otherwise no data
};

// Neither a uri nor a view: there is no picture.
struct image_source {
    std::string name;
    std::optional<std::string> uri;
    std::optional<std::uint32_t> buffer_view;
};

struct checked_document {
    std::string json; // for tinygltf: without buffers, images, cameras, extras, other animations
    std::vector<buffer_source> buffers;
    std::vector<std::uint64_t> view_strides; // per buffer view, 0: packed. tinygltf insists on multiples of 4
    std::vector<std::optional<meshopt_view>> meshopt_views; // per buffer view that has compressed bytes only
    std::vector<draco_primitive> draco_primitives;          // those that have compressed data only
    std::vector<image_source> images;
    // Per texture: indices into images that show the same thing, the one to try first in front. Empty: none is named.
    std::vector<std::vector<std::uint32_t>> texture_images;
    // Per accessor: it has no buffer view of its own, its base values are zero. (tinygltf insists on a view for
    // indices, so the reduced text gives them one that is never read.)
    std::vector<bool> zero_base;
};

// Throws gltf_error with the path of the first thing that is wrong; what is left out becomes a warning.
[[nodiscard]] checked_document check_document(std::string_view json_text, bool has_binary_chunk, budget& memory,
                                              leniency& tolerance, const gltf_options& options);

} // namespace voxelize::gltf
