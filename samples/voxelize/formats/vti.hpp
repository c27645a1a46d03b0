// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// VTK's XML image data (.vti) for ParaView and VTK: every channel as cell data, bits as UInt8, half floats as Float32.
// Values follow the XML as appended raw binary, in zlib blocks unless compression is 0. A .pvti names several .vti,
// each of which holds some layers of one grid.

#include "formats.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_vti(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

// OUT.pvti, and its pieces OUT.1.vti, OUT.2.vti, ... beside it, which come first in the result: options.pieces, or as
// many as options.piece_bytes asks for, 512 at most. The .pvti gets its name last.
std::vector<std::filesystem::path> write_pvti(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

} // namespace voxelize
