// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A zip archive that is written file by file. Zip64 where a file is large, which may pass 4 GiB then. Time stamps are
// fixed: the same content gives the same bytes. Headers are written again once a file is whole, so its target must
// seek.

#include "output_file.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace voxelize {

// Receives the next bytes of a file of the archive; they are valid only during the call.
using entry_sink = std::function<void(std::span<const std::byte>)>;

// Throws write_error.
class zip_archive {
public:
    // Writes to `out`, which outlives the archive and which the caller commits. `compression`: level of zlib, 0 stores.
    zip_archive(output_file& out, int compression);
    ~zip_archive();
    zip_archive(const zip_archive&) = delete;
    zip_archive& operator=(const zip_archive&) = delete;

    // A file of what `stream` hands to its sink, compressed by this thread. `is_large`: it may have 4 GiB or more.
    // Readers that compare the headers before a file and at the archive's end want that only where it is so.
    void add(const std::string& name, const std::function<void(const entry_sink&)>& stream, bool is_large = true);
    // The same from bytes that are compressed already, a whole deflate stream: `stream` hands them over and returns the
    // size and CRC-32 of what they are compressed from. Not with a compression of 0.
    struct source {
        std::uint64_t size;
        std::uint32_t crc;
    };
    void add_compressed(const std::string& name, const std::function<source(const entry_sink&)>& stream,
                        bool is_large = true);
    // Makes the archive whole. To be called once, last.
    void finish();

private:
    struct state;
    void check(int code);
    std::unique_ptr<state> state_;
};

} // namespace voxelize
