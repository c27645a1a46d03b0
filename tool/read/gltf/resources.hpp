// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The bytes behind a document: buffers and pictures, from the BIN chunk, from data URIs and from files in the folder of
// the .gltf (never outside it). tinygltf is given no file system: it would read any path, wants files of exactly the
// declared length and copies all of them.

#include "budget.hpp"
#include "check.hpp"

#include "model/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize::gltf {

// Gives the bytes of a file that a .gltf names, as a mapping that outlives the resources; the path is as
// gltf_file_reader has it.
using file_mapper = std::function<std::span<const std::byte>(const std::filesystem::path& relative)>;

class resources {
public:
    // Loads every buffer; a buffer that is missing or shorter than declared is a gltf_error (up to 3 bytes of padding
    // may be missing in lenient loading). BINARY is a view into the caller's bytes and must outlive this; DOCUMENT too.
    // With MAP_FILE buffers in files are not copied.
    resources(const checked_document& document, std::span<const std::byte> binary, bool has_binary,
              const gltf_file_reader& read_file, budget& memory, leniency& tolerance, const file_mapper& map_file = {});

    // Bytes of buffer INDEX, byte_length of them as declared; throws gltf_error for a placeholder without data.
    [[nodiscard]] std::span<const std::byte> buffer(std::size_t index) const;

    // The pictures of texture INDEX, the one to try first in front.
    [[nodiscard]] const std::vector<std::uint32_t>& texture_images(std::size_t index) const {
        return document_.texture_images[index];
    }

    [[nodiscard]] std::size_t image_count() const { return document_.images.size(); }

    // Picture INDEX as messages name it beside its number: a blank, and its name or file in quotes; empty if it has
    // neither.
    [[nodiscard]] std::string image_title(std::size_t index) const;

    // The buffer view that picture INDEX lies in, if it lies in one.
    [[nodiscard]] std::optional<std::uint32_t> image_view(std::size_t index) const {
        return document_.images[index].buffer_view;
    }

    // Decodes picture INDEX (see picture_file.hpp). VIEW_BYTES are those of its buffer view where it has one. Throws
    // gltf_error with the reason; the caller decides whether that is fatal.
    [[nodiscard]] picture decode_image(std::size_t index, std::span<const std::byte> view_bytes) const;

private:
    [[nodiscard]] std::vector<std::byte> fetch(const std::string& uri) const;

    const checked_document& document_;
    const gltf_file_reader& read_file_;
    budget& memory_;
    std::vector<std::vector<std::byte>> owned_;
    std::vector<std::span<const std::byte>> buffers_; // empty: a placeholder
};

// The file that a URI of a .gltf names: a relative path that stays inside its folder. Throws gltf_error for anything
// else, and for every URI with a scheme.
[[nodiscard]] std::filesystem::path local_path(const std::string& uri);

// Calls options.names_file with the files of buffers and pictures, but those that local_path() refuses.
void name_files(const checked_document& document, const gltf_options& options);

// Reads files below FOLDER, which need not exist for files that name no others.
[[nodiscard]] gltf_file_reader folder_reader(std::filesystem::path folder);

// Bytes of FILE; throws gltf_error where it is no regular file or larger than MAX_BYTES.
[[nodiscard]] std::size_t checked_file_size(const std::filesystem::path& file, std::uint64_t max_bytes);

// The whole of FILE, refused by name where it is no regular file or larger than MAX_BYTES.
[[nodiscard]] std::vector<std::byte> read_whole_file(const std::filesystem::path& file, std::uint64_t max_bytes);

// A file as memory, without a copy of it: pages come from the page cache when they are read.
class mapped_file {
public:
    // Refuses by name what is no regular file, cannot be read, or has more than MAX_BYTES; throws gltf_error. A file
    // that another program cuts short while it is mapped ends this one (SIGBUS), as with every mapping.
    mapped_file(const std::filesystem::path& file, std::uint64_t max_bytes);
    ~mapped_file();
    mapped_file(const mapped_file&) = delete;
    mapped_file& operator=(const mapped_file&) = delete;

    [[nodiscard]] std::span<const std::byte> bytes() const { return {data_, size_}; }

private:
    const std::byte* data_ = nullptr; // null where the file is empty
    std::size_t size_ = 0;
};

} // namespace voxelize::gltf
