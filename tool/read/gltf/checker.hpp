// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The parts of check_document: one object that walks a document once. Private to check*.cpp.

#include "check.hpp"
#include "extensions.hpp"
#include "json_at.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::gltf {

// The largest count or offset that JSON carries exactly.
inline constexpr std::uint64_t largest_integer = std::uint64_t{1} << 53;

class checker {
public:
    // All of them must outlive this. ROOT is reduced in place.
    checker(json& root, bool has_binary_chunk, budget& memory, leniency& tolerance, const gltf_options& options)
        : root_{root}, has_binary_chunk_{has_binary_chunk}, memory_{memory}, tolerance_{tolerance}, options_{options} {}

    // Call once.
    [[nodiscard]] checked_document run();

private:
    // A buffer view as the bounds checks see it.
    struct view {
        std::uint64_t byte_offset = 0;
        std::uint64_t byte_length = 0;
        std::optional<std::uint64_t> byte_stride;
    };

    // check.cpp: the file as a whole, and its bytes.
    void check_asset();
    void count_lists();
    void check_extensions();
    void warn_of_extensions(const std::set<std::string>& used, extension_effect effect, const std::string& what,
                            const std::string& consequence);
    void check_buffers();
    void check_buffer_views();
    void check_accessors();
    [[nodiscard]] meshopt_view check_meshopt(const json_at& at, std::uint64_t view_length) const;
    [[nodiscard]] bool is_placeholder(std::size_t buffer) const;
    void check_span(const json_at& at, std::uint32_t view_index, std::uint64_t offset, std::uint64_t stride,
                    std::uint64_t count, std::uint64_t element) const;
    void check_sparse(const json_at& sparse, std::uint64_t accessor_count, std::uint64_t element) const;

    // check_materials.cpp: how surfaces look.
    void check_images();
    void check_samplers();
    void check_textures();
    void check_materials();
    void choose_variant();
    void use_variant(const json_at& primitive, const json_at& extension) const;
    void use_diffuse(const json_at& material, const json_at& extension) const;
    void check_texture_info(const json_at& info) const;

    // check_nodes.cpp: what is shown, and where.
    void check_meshes();
    void check_primitive(const json_at& primitive);
    void check_draco(const json_at& primitive, const json_at& extension);
    void check_index_accessor(const json_at& primitive, std::uint32_t index);
    void check_nodes_and_scenes();
    void check_node_extensions(const json_at& extensions) const;

    // check_pose.cpp: how it is bent.
    void check_numbers_list(const json_at& at, std::string_view key) const;
    void check_targets(const json_at& primitive) const;
    void check_skins();
    void choose_animation();
    void check_animation(const json_at& animation) const;

    json_at root_;
    bool has_binary_chunk_;
    budget& memory_;
    leniency& tolerance_;
    const gltf_options& options_;
    checked_document document_;
    std::vector<view> views_;
    bool placeholder_view_ = false;
    std::size_t num_variants_ = 0;
    std::optional<std::size_t> variant_; // that is asked for
    std::size_t num_buffers_ = 0, num_views_ = 0, num_accessors_ = 0, num_images_ = 0, num_samplers_ = 0;
    std::size_t num_textures_ = 0, num_materials_ = 0, num_meshes_ = 0, num_nodes_ = 0, num_scenes_ = 0, num_skins_ = 0;
};

} // namespace voxelize::gltf
