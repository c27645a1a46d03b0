// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Writes .html: one page that shows the voxels in a browser and needs no network. page.html is the page, with a
// description of the data that are put into it; embedded at build time.

#include "model/sparse_volume.hpp"
#include "write/formats/formats.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace voxelize {

// All channels. Values of other types than the page knows become float32. Throws write_error.
std::vector<std::filesystem::path> write_page(const sparse_volume& v, const std::filesystem::path& path,
                                              const write_options& options);
std::vector<std::filesystem::path> write_page(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

// A page of voxels, by the name that a reader sees and its file relative to the page that shows it.
struct page_link {
    std::string name;
    std::filesystem::path file;
};

// Writes a page that shows others side by side, each in a frame; what is turned, cut or chosen in one happens in all.
// Throws write_error.
void write_pages_beside(const std::vector<page_link>& pages, const std::filesystem::path& path);

} // namespace voxelize
