// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangles on their way to slabs. A record is a triangle by itself: positions and varyings as the vertex shader gave
// them, and its number in the whole mesh. A bin is a list of records that only grows; beyond a budget its records lie
// in a temporary file. Needs POSIX files.

#include <voxelpipe/shader.hpp>

#include <glm/vec3.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// A temporary file without a name: it is gone when the object is, or the process. Moves, and does not copy. Members
// throw std::system_error, such as for a full disk.
class scratch_file {
public:
    // A new, empty file in a folder that is there.
    explicit scratch_file(const std::string& folder) {
        std::string name = folder + "/voxelpipe-XXXXXX";
        file_ = ::mkstemp(name.data());
        if (file_ < 0) fail("cannot make a temporary file in " + folder);
        (void)::unlink(name.c_str());
    }
    scratch_file(scratch_file&& other) noexcept
        : file_(std::exchange(other.file_, -1)), size_(std::exchange(other.size_, 0)) {}
    scratch_file& operator=(scratch_file&& other) noexcept {
        std::swap(file_, other.file_);
        std::swap(size_, other.size_);
        return *this;
    }
    ~scratch_file() {
        if (file_ >= 0) ::close(file_);
    }

    [[nodiscard]] std::uint64_t size() const { return size_; } // bytes
    // Writes bytes at the end.
    void append(std::span<const std::byte> bytes) {
        while (!bytes.empty()) {
            const ssize_t n = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(size_));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) fail("cannot write a temporary file");
            size_ += static_cast<std::uint64_t>(n);
            bytes = bytes.subspan(static_cast<std::size_t>(n));
        }
    }
    // Fills `bytes` from the file's bytes at `offset` on; all of them have been written.
    void read(std::uint64_t offset, std::span<std::byte> bytes) const {
        while (!bytes.empty()) {
            const ssize_t n = ::pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) fail("cannot read a temporary file");
            offset += static_cast<std::uint64_t>(n);
            bytes = bytes.subspan(static_cast<std::size_t>(n));
        }
    }

private:
    [[noreturn]] static void fail(const std::string& what) {
        throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), "voxelpipe::slabs: " + what);
    }
    int file_ = -1;
    std::uint64_t size_ = 0;
};

// Records in the order in which they came. Those in a file precede those in memory.
template <class Record>
class bin {
    static_assert(std::is_trivially_copyable_v<Record>, "voxelpipe: varyings must be trivially copyable");

public:
    [[nodiscard]] std::uint64_t size() const { return in_file() + in_memory_; }
    // Records in the file, and in memory.
    [[nodiscard]] std::uint64_t in_file() const { return file_.empty() ? 0 : file_[0].size() / sizeof(Record); }
    // Records in memory.
    [[nodiscard]] std::uint64_t in_memory() const { return in_memory_; }

    // block: records that memory is taken for at a time. Returns whether it was taken.
    bool push(const Record& r, std::size_t block) {
        const bool grows = blocks_.empty() || blocks_.back().size() == blocks_.back().capacity();
        if (grows) {
            blocks_.emplace_back();
            blocks_.back().reserve(block);
        }
        blocks_.back().push_back(r);
        ++in_memory_;
        return grows;
    }
    // Bytes that records in memory take, with those that are reserved.
    [[nodiscard]] std::uint64_t memory_bytes() const {
        std::uint64_t bytes = 0;
        for (const auto& b : blocks_) bytes += b.capacity() * sizeof(Record);
        return bytes;
    }
    // Moves the records in memory to the file.
    void spill(const std::string& folder) {
        if (in_memory_ == 0) return;
        if (file_.empty()) file_.emplace_back(folder);
        for (const auto& b : blocks_) file_[0].append(std::as_bytes(std::span(b)));
        blocks_.clear();
        in_memory_ = 0;
    }
    // Calls f(std::span<const Record>) with all records, in order.
    template <class F>
    void for_each_block(F&& f) const {
        std::vector<Record> read;
        const std::uint64_t total = in_file(),
                            most = std::max<std::uint64_t>(1, (std::uint64_t{4} << 20) / sizeof(Record));
        for (std::uint64_t first = 0; first < total; first += most) {
            read.resize(static_cast<std::size_t>(std::min(most, total - first)));
            file_[0].read(first * sizeof(Record), std::as_writable_bytes(std::span(read)));
            f(std::span<const Record>(read));
        }
        for (const auto& b : blocks_) f(std::span<const Record>(b));
    }

private:
    std::vector<std::vector<Record>> blocks_;
    std::vector<scratch_file> file_; // none or one
    std::uint64_t in_memory_ = 0;
};

// Keeps the memory of several bins below a budget: beyond it, the largest goes to its file.
template <class Record>
class bin_memory {
public:
    // budget: bytes of all bins' memory. folder: for files.
    bin_memory(std::uint64_t budget, std::size_t num_bins, std::string folder)
        : budget_(budget), folder_(std::move(folder)),
          block_(static_cast<std::size_t>(std::clamp<std::uint64_t>(
              budget / sizeof(Record) / (4 * std::max<std::size_t>(1, num_bins)), 16, 65536))) {}

    // Appends to bin i of the bins that share this budget.
    void push(std::vector<bin<Record>>& bins, std::size_t i, const Record& r) {
        if (!bins[i].push(r, block_)) return;
        used_ += block_ * sizeof(Record);
        if (used_ <= budget_) return;
        auto& largest = *std::max_element(
            bins.begin(), bins.end(), [](const auto& a, const auto& b) { return a.memory_bytes() < b.memory_bytes(); });
        used_ -= largest.memory_bytes();
        largest.spill(folder_);
    }

private:
    std::uint64_t budget_, used_ = 0;
    std::string folder_;
    std::size_t block_;
};

} // namespace voxelpipe::slabs
