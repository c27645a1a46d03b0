// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zip.hpp"

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

struct zip_archive::state {
    state(output_file& file, int level) : out(file), sink{out}, compression(level) {
        zlib_filefunc64_def callbacks{on_open, on_read, on_write, on_tell, on_seek, on_close, on_error, &sink};
        archive = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &callbacks);
        if (archive == nullptr) throw write_error(out.target(), "out of memory");
        info.dosDate = 1u << 21 | 1u << 16; // 1980-01-01, the earliest that zip knows
    }
    output_file& out;
    zip_sink sink;
    int compression;
    zipFile archive = nullptr;
    bool entry_open = false;
    zip_fileinfo info{};
};

zip_archive::zip_archive(output_file& out, int compression) : state_(std::make_unique<state>(out, compression)) {}

zip_archive::~zip_archive() {
    if (state_->archive == nullptr) return;                     // finished
    if (state_->entry_open) zipCloseFileInZip(state_->archive); // frees minizip's state; its errors no longer matter
    zipClose(state_->archive, nullptr);
}

void zip_archive::check(int code) {
    if (code == ZIP_OK) return;
    if (state_->sink.failure) std::rethrow_exception(state_->sink.failure);
    throw write_error(state_->out.target(), "the zip library gave error " + std::to_string(code));
}

void zip_archive::add(const std::string& name, const std::function<void(const entry_sink&)>& stream, bool is_large) {
    const int level = state_->compression;
    check(zipOpenNewFileInZip64(state_->archive, name.c_str(), &state_->info, nullptr, 0, nullptr, 0, nullptr,
                                level > 0 ? Z_DEFLATED : 0, level, is_large ? 1 : 0));
    state_->entry_open = true;
    stream([this](std::span<const std::byte> bytes) {
        check(zipWriteInFileInZip(state_->archive, bytes.data(), static_cast<unsigned>(bytes.size())));
    });
    state_->entry_open = false;
    check(zipCloseFileInZip(state_->archive));
}

void zip_archive::add_compressed(const std::string& name, const std::function<source(const entry_sink&)>& stream,
                                 bool is_large) {
    check(zipOpenNewFileInZip2_64(state_->archive, name.c_str(), &state_->info, nullptr, 0, nullptr, 0, nullptr,
                                  Z_DEFLATED, state_->compression, 1, is_large ? 1 : 0));
    state_->entry_open = true;
    const source whole = stream([this](std::span<const std::byte> bytes) {
        check(zipWriteInFileInZip(state_->archive, bytes.data(), static_cast<unsigned>(bytes.size())));
    });
    state_->entry_open = false;
    check(zipCloseFileInZipRaw64(state_->archive, whole.size, whole.crc));
}

void zip_archive::finish() {
    const zipFile archive = std::exchange(state_->archive, nullptr);
    check(zipClose(archive, nullptr)); // gives the archive back whatever it returns
}

} // namespace voxelize
