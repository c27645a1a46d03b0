// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "npz.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"
#include "npy.hpp"
#include "progress.hpp"

#include <exception>
#include <minizip/zip.h>
#include <utility>
#include <zlib.h>

namespace voxelize {
namespace {

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

struct npz_archive::state {
    state(const std::filesystem::path& path, int level) : out(path), sink{out}, compression(level) {
        zlib_filefunc64_def callbacks{on_open, on_read, on_write, on_tell, on_seek, on_close, on_error, &sink};
        archive = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &callbacks);
        if (archive == nullptr) throw write_error(path, "out of memory");
        info.dosDate = 1u << 21 | 1u << 16; // 1980-01-01, the earliest that zip knows
    }
    output_file out;
    zip_sink sink;
    int compression;
    zipFile archive = nullptr;
    bool entry_open = false;
    zip_fileinfo info{};
};

npz_archive::npz_archive(const std::filesystem::path& path, int compression)
    : state_(std::make_unique<state>(path, compression)) {}

npz_archive::~npz_archive() {
    if (state_->archive == nullptr) return;                     // committed
    if (state_->entry_open) zipCloseFileInZip(state_->archive); // frees minizip's state; its errors no longer matter
    zipClose(state_->archive, nullptr);
}

void npz_archive::check(int code) {
    if (code == ZIP_OK) return;
    if (state_->sink.failure) std::rethrow_exception(state_->sink.failure);
    throw write_error(state_->out.target(), "the zip library gave error " + std::to_string(code));
}

void npz_archive::add(const std::string& name, const std::string& header,
                      const std::function<void(const array_sink&)>& stream) {
    const int level = state_->compression;
    check(zipOpenNewFileInZip64(state_->archive, (name + ".npy").c_str(), &state_->info, nullptr, 0, nullptr, 0,
                                nullptr, level > 0 ? Z_DEFLATED : 0, level, 1));
    state_->entry_open = true;
    const auto write = [this](std::span<const std::byte> bytes) {
        check(zipWriteInFileInZip(state_->archive, bytes.data(), static_cast<unsigned>(bytes.size())));
    };
    write(std::as_bytes(std::span{header}));
    stream(write);
    state_->entry_open = false;
    check(zipCloseFileInZip(state_->archive));
}

void npz_archive::add_compressed(const std::string& name, const std::function<source(const array_sink&)>& stream) {
    check(zipOpenNewFileInZip2_64(state_->archive, (name + ".npy").c_str(), &state_->info, nullptr, 0, nullptr, 0,
                                  nullptr, Z_DEFLATED, state_->compression, 1, 1));
    state_->entry_open = true;
    const source whole = stream([this](std::span<const std::byte> bytes) {
        check(zipWriteInFileInZip(state_->archive, bytes.data(), static_cast<unsigned>(bytes.size())));
    });
    state_->entry_open = false;
    check(zipCloseFileInZipRaw64(state_->archive, whole.size, whole.crc));
}

void npz_archive::commit() {
    const zipFile archive = std::exchange(state_->archive, nullptr);
    check(zipClose(archive, nullptr)); // gives the archive back whatever it returns
    state_->out.commit();
}

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    std::uint64_t total = 0;
    for (const channel& c : v.channels) total += streamed_bytes(v, c, half_floats::keep);
    progress_meter meter(options.progress, total);

    npz_archive archive(path, options.compression);
    for (const channel& c : v.channels) {
        const std::string header = npy_header(v, c);
        if (options.compression > 0) {
            // Compressed here, on all threads; minizip writes what surrounds it.
            archive.add_compressed(c.name, [&](const array_sink& add) {
                piece_compressor compressor(piece_compressor::form::stream_part, options.compression);
                running_crc whole;
                compress_channel(v, c, half_floats::keep, std::as_bytes(std::span{header}), compressed_piece_bytes,
                                 options.threads, compressor, [&](const compressed_piece& piece) {
                                     add(piece.bytes);
                                     whole.add(piece);
                                     meter.advance(piece.source_size);
                                 });
                add(deflate_end);
                return npz_archive::source{whole.size, whole.crc};
            });
        } else {
            archive.add(c.name, header, [&](const array_sink& add) {
                stream_values(v, c, half_floats::keep, [&](std::span<const std::byte> piece) {
                    add(piece);
                    meter.advance(piece.size());
                });
            });
        }
    }
    archive.commit();
    return {path};
}

} // namespace voxelize
