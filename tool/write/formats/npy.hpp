// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// NumPy's .npy, format version 1.0: a text header and the values in C order. Shape (nz, ny, nx), or
// (nz, ny, nx, components) for several components; bits as uint8 0/1; half floats as float16.
//
// NumPy's .npz: a zip archive with one CHANNEL.npy for each channel, as numpy.savez or, with compression,
// numpy.savez_compressed writes it. Zip64 throughout, so an array may pass 4 GiB. Time stamps are fixed: the same
// volume gives the same bytes.

#include "formats.hpp"

#include <string>

namespace voxelize {

// Everything that stands before the values, padded so that they start at a multiple of 64 bytes. Also used by .npz.
[[nodiscard]] std::string npy_header(const volume& v, const channel& c);
// The header of any array; `shape` as Python writes a tuple.
[[nodiscard]] std::string npy_header(scalar type, const std::string& shape);

// One file a channel: PATH itself for a single one, PATH with ".CHANNEL" before the extension for several.
std::vector<std::filesystem::path> write_npy(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

// out.npy -> out.color.npy; the rule for every format that holds one channel a file.
[[nodiscard]] std::filesystem::path channel_path(const std::filesystem::path& path, const volume& v, const channel& c);

// The names of such a format; of .npy, which may list voxels (sparse_formats.hpp).
[[nodiscard]] written_names channel_names(const volume& shape, const std::filesystem::path& path,
                                          const write_options& options, held_as held);
[[nodiscard]] written_names npy_names(const volume& shape, const std::filesystem::path& path,
                                      const write_options& options, held_as held);

} // namespace voxelize
