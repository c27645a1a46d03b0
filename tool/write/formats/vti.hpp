// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// VTK's XML image data (.vti) for ParaView and VTK: every channel as cell data, bits as UInt8, half floats as Float32.
// Values follow the XML as appended raw binary, in zlib blocks unless compression is 0. A .pvti names several .vti,
// each of which holds some layers of one grid.

#include "formats.hpp"

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace voxelize {

// An image of the voxels, and one for each channel of faces, OUT.CHANNEL.vti, unless there is no other channel.
std::vector<std::filesystem::path> write_vti(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);
[[nodiscard]] written_names vti_names(const volume& shape, const std::filesystem::path& path,
                                      const write_options& options, held_as held);

// OUT.pvti, and its pieces OUT.1.vti, OUT.2.vti, ... beside it, which come first in the result: options.pieces, or as
// many as options.piece_bytes asks for, 512 at most. The .pvti gets its name last.
std::vector<std::filesystem::path> write_pvti(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

// Its names: those of a .pvti of more pieces that is there are removed, and so are among them.
[[nodiscard]] written_names pvti_names(const volume& shape, const std::filesystem::path& path,
                                       const write_options& options, held_as held);

// The same piece by piece, in any order and by any number of processes. Only its shape and channels are asked for of a
// volume, but the values of its piece where that is written. Pieces count from 0 here.

// The number of pieces that write_pvti() makes.
[[nodiscard]] std::int64_t num_pvti_pieces(const volume& v, const write_options& options);
// The layers [first, last) of a piece.
[[nodiscard]] std::pair<std::int64_t, std::int64_t> pvti_piece_layers(const volume& v, std::int64_t piece,
                                                                      std::int64_t pieces);
// The path of a piece of a .pvti.
[[nodiscard]] std::filesystem::path pvti_piece_path(const std::filesystem::path& path, std::int64_t piece);
void write_pvti_piece(const volume& v, const std::filesystem::path& file, std::int64_t piece, std::int64_t pieces,
                      const write_options& options);
// The .pvti, once all pieces are there. Removes those of a .pvti of more pieces that was there.
void write_pvti_index(const volume& v, const std::filesystem::path& path, std::int64_t pieces);

} // namespace voxelize
