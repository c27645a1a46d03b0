// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "npy.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "progress.hpp"
#include "zip.hpp"

#include <span>
#include <string>

namespace voxelize {

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    progress_meter meter(options.progress, streamed_bytes(v, half_floats::keep));

    output_file out(path);
    zip_archive archive(out, options.compression);
    v.for_each_channel([&](const volume& of, const channel& c) {
        const std::string header = npy_header(of, c);
        if (options.compression > 0) {
            // Compressed here, on all threads; minizip writes what surrounds it.
            archive.add_compressed(c.name + ".npy", [&](const entry_sink& add) {
                piece_compressor compressor(piece_compressor::form::stream_part, options.compression);
                running_crc whole;
                compress_channel(of, c, half_floats::keep, std::as_bytes(std::span{header}), compressed_piece_bytes,
                                 options.threads, compressor, [&](const compressed_piece& piece) {
                                     add(piece.bytes);
                                     whole.add(piece);
                                     meter.advance(piece.source_size);
                                 });
                add(deflate_end);
                return zip_archive::source{whole.size, whole.crc};
            });
        } else {
            archive.add(c.name + ".npy", [&](const entry_sink& add) {
                add(std::as_bytes(std::span{header}));
                stream_values(of, c, half_floats::keep, [&](std::span<const std::byte> piece) {
                    add(piece);
                    meter.advance(piece.size());
                });
            });
        }
    });
    archive.finish();
    out.commit();
    return {path};
}

} // namespace voxelize
