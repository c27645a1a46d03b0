// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// NumPy's .npz: a zip archive with one CHANNEL.npy for each channel, as numpy.savez or, with compression,
// numpy.savez_compressed writes it. Zip64 throughout, so an array may pass 4 GiB. Time stamps are fixed: the same
// volume gives the same bytes.

#include "formats.hpp"
#include "output_file.hpp"

#include <functional>
#include <memory>
#include <span>
#include <string>

namespace voxelize {

// Receives the next bytes of an array; they are valid only during the call.
using array_sink = std::function<void(std::span<const std::byte>)>;

// An archive that is written array by array. Throws write_error.
class npz_archive {
public:
    // `compression`: level of zlib, 0 stores.
    npz_archive(const std::filesystem::path& path, int compression);
    ~npz_archive();
    npz_archive(const npz_archive&) = delete;
    npz_archive& operator=(const npz_archive&) = delete;

    // NAME.npy: the header of npy.hpp, then what `stream` hands to its sink, compressed by this thread.
    void add(const std::string& name, const std::string& header, const std::function<void(const array_sink&)>& stream);
    // The same from bytes that are compressed already, a whole deflate stream: `stream` hands them over and returns the
    // size and CRC-32 of what they are compressed from. Not with a compression of 0.
    struct source {
        std::uint64_t size;
        std::uint32_t crc;
    };
    void add_compressed(const std::string& name, const std::function<source(const array_sink&)>& stream);
    void commit();

private:
    struct state;
    void check(int code);
    std::unique_ptr<state> state_;
};

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
