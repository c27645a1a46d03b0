// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tool asks of the operating system beyond the standard library: system_posix.cpp and system_windows.cpp
// answer the same questions. Text is UTF-8 on both.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace voxelize::os {

// ---- The program

// To be called first in main(): from here on argv has the words of the command line in UTF-8, standard output takes
// bytes as they are, and a file beyond a limit of the shell fails like one on a full disk.
void begin_program(int& argc, char**& argv);
// A reader of standard output that goes away is a failed write from here on, and not the end of the process.
void keep_running_without_reader();
// True if the standard stream of this descriptor is a terminal.
[[nodiscard]] bool is_terminal(int file);
// True if it is a terminal on which a line can be drawn over by escape sequences.
[[nodiscard]] bool draws_over_lines(int file);
// The date and time of a clock in UTC.
[[nodiscard]] std::tm utc(std::time_t seconds);

// ---- Files. Functions that fail say why in errno.

// Tells a file or folder from all others of the machine, whatever path leads to it.
struct file_identity {
    std::uint64_t device = 0, file = 0;
    auto operator<=>(const file_identity&) const = default;
};
enum class file_kind { regular, folder, other };
struct file_facts {
    file_identity id;
    file_kind kind = file_kind::other;
    bool is_only_name = false; // it has no other name, and is this user's
};
enum class links { follow, keep };
// Nothing if there is no such file. links::keep: of a symbolic link itself, which is of another kind.
[[nodiscard]] std::optional<file_facts> facts_of(const std::filesystem::path& path, links how = links::follow);
[[nodiscard]] std::optional<file_facts> facts_of(int file);
// The name of a file as names are compared in folders: Windows takes "A.npy" and "a.npy" for one.
[[nodiscard]] std::string compared_name(const std::filesystem::path& name);

// True where a folder cannot be renamed or removed while a file in it is open.
#if defined(_WIN32)
inline constexpr bool open_files_keep_folders = true;
#else
inline constexpr bool open_files_keep_folders = false;
#endif

enum class opening {
    read,         // what is there
    read_write,   // what is there, and no symbolic link
    create,       // a file that is not there yet, for both
    share,        // for both, whether or not it is there
    append_shared // the same, and each write goes to the end
};
// A descriptor that no other process inherits, or -1. Others may open, rename and remove the file meanwhile.
[[nodiscard]] int open_file(const std::filesystem::path& path, opening how);
void close_file(int file);
// A second descriptor of the open file, or -1: its lock holds as long as one of both is open.
[[nodiscard]] int open_again(int file);
// Takes the lock of the file, which the system takes back from a process that ends in whatever way. False if another
// has it (errno is EWOULDBLOCK), or if there are no locks. wait: until the other has given it back.
[[nodiscard]] bool lock_file(int file, bool wait);
// Makes it empty.
[[nodiscard]] bool empty_file(int file);
// Writes all of the text with one call. Never from text to lines of another kind.
[[nodiscard]] bool write_once(int file, std::string_view text);
// The last byte, if there is one.
[[nodiscard]] std::optional<char> last_byte(int file);
// A stream of bytes that takes over the descriptor, or null; one of a path, which is made empty.
[[nodiscard]] std::FILE* write_stream(int file);
[[nodiscard]] std::FILE* write_stream(const std::filesystem::path& path);
[[nodiscard]] int descriptor_of(std::FILE* stream);
// Moves to an offset from the start, which may be beyond 2^32. EFBIG where offsets are not as large.
[[nodiscard]] bool seek_stream(std::FILE* stream, std::uint64_t offset);
// False also where something of this name is there (EEXIST).
[[nodiscard]] bool make_folder(const std::filesystem::path& path);
[[nodiscard]] bool remove_empty_folder(const std::filesystem::path& path);

// The SIZE bytes of a file for reading, without a copy: pages come from the system's cache when they are read. Null
// data where that fails. A file without bytes cannot be mapped.
[[nodiscard]] const std::byte* map_file(const std::filesystem::path& path, std::size_t size);
void unmap_file(const std::byte* data, std::size_t size);

#if defined(_WIN32)
// ---- Processes, where none can be doubled

// This program once more, with its own command line. ORDER is what worker_order() gives there. It ends with this
// process.
class child_process {
public:
    // Throws std::runtime_error.
    explicit child_process(const std::string& order);
    child_process(const child_process&) = delete;
    child_process& operator=(const child_process&) = delete;
    ~child_process();

    struct result {
        std::string output; // standard output
        unsigned long code = 0;
    };
    // Until it ends. To be called once.
    [[nodiscard]] result wait();

private:
    void *process_ = nullptr, *from_ = nullptr;
};
#endif
// What a process that is this program once more is to do; nothing in others, and on systems that double processes.
[[nodiscard]] std::optional<std::string> worker_order();

// ---- Memory of this process in bytes

struct residence {
    std::uint64_t all = 0, of_files = 0; // in physical memory; of_files: code and mapped files
};
// Takes no block by operator new.
[[nodiscard]] residence residence_now() noexcept;
[[nodiscard]] std::uint64_t most_resident();
// Bytes of the heaps where small blocks lie and where their memory stays once they are given back; 0 if it is unknown.
[[nodiscard]] std::uint64_t heap_bytes() noexcept;
// What the machine, its control groups and limits of this process allow, whichever is least.
[[nodiscard]] std::uint64_t allowed_memory();

} // namespace voxelize::os
