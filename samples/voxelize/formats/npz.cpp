// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "npz.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "npy.hpp"
#include "progress.hpp"

#include <exception>
#include <minizip/zip.h>
#include <zlib.h>

namespace voxelize {
namespace {

// What a thread compresses at once; numpy never sees it.
constexpr std::size_t piece_bytes = std::size_t{256} << 10;

// minizip writes through these callbacks into our output_file. A C library must not see an exception, so the first one
// is kept here and thrown again once minizip has returned its error code.
struct zip_sink {
    output_file& out;
    std::exception_ptr failure{};
};

voidpf on_open(voidpf opaque, const void*, int) { return opaque; }

uLong on_read(voidpf, voidpf, void*, uLong) { return 0; }

uLong on_write(voidpf opaque, voidpf, const void* data, uLong size) {
    auto& sink = *static_cast<zip_sink*>(opaque);
    try {
        sink.out.write(std::span{static_cast<const std::byte*>(data), size});
        return size;
    } catch (...) {
        sink.failure = std::current_exception();
        return 0;
    }
}

ZPOS64_T on_tell(voidpf opaque, voidpf) { return static_cast<zip_sink*>(opaque)->out.tell(); }

long on_seek(voidpf opaque, voidpf, ZPOS64_T offset, int origin) {
    auto& sink = *static_cast<zip_sink*>(opaque);
    if (origin != ZLIB_FILEFUNC_SEEK_SET) return -1; // an archive that is only created asks for no other
    try {
        sink.out.seek(offset);
        return 0;
    } catch (...) {
        sink.failure = std::current_exception();
        return -1;
    }
}

int on_close(voidpf, voidpf) { return 0; }

int on_error(voidpf opaque, voidpf) { return static_cast<zip_sink*>(opaque)->failure ? 1 : 0; }

} // namespace

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    std::uint64_t total = 0;
    for (const channel& c : v.channels) total += streamed_bytes(v, c, half_floats::keep);
    progress_meter meter(options.progress, total);

    output_file out(path);
    zip_sink sink{out};
    zlib_filefunc64_def callbacks{on_open, on_read, on_write, on_tell, on_seek, on_close, on_error, &sink};
    const zipFile archive = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &callbacks);
    if (archive == nullptr) throw write_error(path, "out of memory");
    bool entry_open = false;
    const auto check = [&](int code) {
        if (code == ZIP_OK) return;
        if (entry_open) zipCloseFileInZip(archive); // frees minizip's state; its own errors no longer matter
        zipClose(archive, nullptr);
        if (sink.failure) std::rethrow_exception(sink.failure);
        throw write_error(path, "the zip library gave error " + std::to_string(code));
    };

    zip_fileinfo info{};
    info.dosDate = 1u << 21 | 1u << 16; // 1980-01-01, the earliest that zip knows
    for (const channel& c : v.channels) {
        const std::string name = c.name + ".npy";
        const std::string header = npy_header(v, c);
        if (options.compression > 0) {
            // Compressed here, on all threads; minizip writes what surrounds it.
            check(zipOpenNewFileInZip2_64(archive, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                                          options.compression, 1, 1));
            entry_open = true;
            piece_compressor compressor(piece_compressor::form::stream_part, options.compression);
            running_crc whole;
            const auto add = [&](std::span<const std::byte> bytes) {
                check(zipWriteInFileInZip(archive, bytes.data(), static_cast<unsigned>(bytes.size())));
            };
            compress_channel(v, c, half_floats::keep, std::as_bytes(std::span{header}), piece_bytes, options.threads,
                             compressor, [&](const compressed_piece& piece) {
                                 add(piece.bytes);
                                 whole.add(piece);
                                 meter.advance(piece.source_size);
                             });
            add(deflate_end);
            entry_open = false;
            check(zipCloseFileInZipRaw64(archive, whole.size, whole.crc));
            continue;
        }
        check(zipOpenNewFileInZip64(archive, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, 0, 0, 1));
        entry_open = true;
        check(zipWriteInFileInZip(archive, header.data(), static_cast<unsigned>(header.size())));
        stream_values(v, c, half_floats::keep, [&](std::span<const std::byte> piece) {
            check(zipWriteInFileInZip(archive, piece.data(), static_cast<unsigned>(piece.size())));
            meter.advance(piece.size());
        });
        entry_open = false;
        check(zipCloseFileInZip(archive));
    }
    const int code = zipClose(archive, nullptr); // gives the archive back whatever it returns
    if (sink.failure) std::rethrow_exception(sink.failure);
    if (code != ZIP_OK) throw write_error(path, "the zip library gave error " + std::to_string(code));
    out.commit();
    return {path};
}

} // namespace voxelize
