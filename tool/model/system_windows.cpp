// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "system.hpp"

#define WIN32_LEAN_AND_MEAN
#if !defined(NOMINMAX)
#define NOMINMAX
#endif
#include <windows.h>
// Behind windows.h, whose types they use.
#include <psapi.h>
#include <shellapi.h>

#include <fcntl.h>
#include <io.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <locale>
#include <stdexcept>
#include <system_error>
#include <vector>

// libstdc++ turns narrow text into paths and back by this facet, as the C library does, which knows no UTF-8. The
// program's own definitions take its place: all narrow text is UTF-8.
namespace std { // NOLINT(cert-dcl58-cpp): members of a class that the static library has, and that no object of it then
                // brings

// A surrogate without its other half becomes U+FFFD.
codecvt_base::result codecvt<wchar_t, char, mbstate_t>::do_out(mbstate_t&, const wchar_t* from, const wchar_t* from_end,
                                                               const wchar_t*& from_next, char* to, char* to_end,
                                                               char*& to_next) const {
    from_next = from;
    to_next = to;
    while (from_next < from_end) {
        char32_t c = static_cast<char16_t>(*from_next);
        const char32_t low = from_end - from_next > 1 ? static_cast<char16_t>(from_next[1]) : U'\0';
        const bool is_pair = c >= 0xD800 && c < 0xDC00 && low >= 0xDC00 && low < 0xE000;
        if (is_pair)
            c = 0x10000 + ((c - 0xD800) << 10) + (low - 0xDC00);
        else if (c >= 0xD800 && c < 0xE000)
            c = 0xFFFD;
        const int size = c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4;
        if (to_end - to_next < size) return partial;
        constexpr array<unsigned char, 5> leads{0, 0, 0xC0, 0xE0, 0xF0};
        for (int i = size - 1; i > 0; --i, c >>= 6) to_next[i] = static_cast<char>(0x80 | (c & 0x3F));
        to_next[0] = static_cast<char>(leads[static_cast<size_t>(size)] | c);
        from_next += is_pair ? 2 : 1;
        to_next += size;
    }
    return ok;
}

// A byte that is no UTF-8 becomes U+FFFD: a name with it is of no file, and no error of its own.
codecvt_base::result codecvt<wchar_t, char, mbstate_t>::do_in(mbstate_t&, const char* from, const char* from_end,
                                                              const char*& from_next, wchar_t* to, wchar_t* to_end,
                                                              wchar_t*& to_next) const {
    from_next = from;
    to_next = to;
    while (from_next < from_end) {
        const auto byte = [&](int i) { return static_cast<unsigned char>(from_next[i]); };
        const int size = byte(0) < 0xC2 ? 1 : byte(0) < 0xE0 ? 2 : byte(0) < 0xF0 ? 3 : 4;
        bool is_good = byte(0) < 0x80 || (byte(0) >= 0xC2 && byte(0) < 0xF5 && from_end - from_next >= size);
        char32_t c = size == 1 ? byte(0) : byte(0) & (0xFFU >> (size + 1));
        for (int i = 1; i < size && is_good; ++i) {
            is_good = (byte(i) & 0xC0U) == 0x80;
            c = c << 6 | (byte(i) & 0x3FU);
        }
        const bool is_too_long = (size == 3 && c < 0x800) || (size == 4 && c < 0x10000);
        is_good = is_good && !is_too_long && c <= 0x10FFFF && (c < 0xD800 || c >= 0xE000);
        if (!is_good) c = 0xFFFD;
        if (to_end - to_next < (c >= 0x10000 ? 2 : 1)) return partial;
        if (c >= 0x10000) {
            *to_next++ = static_cast<wchar_t>(0xD800 + ((c - 0x10000) >> 10));
            c = 0xDC00 + ((c - 0x10000) & 0x3FF);
        }
        *to_next++ = static_cast<wchar_t>(c);
        from_next += is_good ? size : 1;
    }
    return ok;
}

int codecvt<wchar_t, char, mbstate_t>::do_encoding() const noexcept { return 0; }
int codecvt<wchar_t, char, mbstate_t>::do_max_length() const noexcept { return 4; }

int codecvt<wchar_t, char, mbstate_t>::do_length(mbstate_t& state, const char* from, const char* end,
                                                 size_t most) const {
    const char* next = from;
    for (array<wchar_t, 2> unit; most > 0 && next < end;) {
        const char* after = next;
        wchar_t* unit_end = unit.data();
        (void)do_in(state, next, end, after, unit.data(), unit.data() + min<size_t>(most, 1), unit_end);
        if (after == next)
            (void)do_in(state, next, end, after, unit.data(), unit.data() + min<size_t>(most, 2), unit_end);
        if (after == next) break;
        next = after;
        most -= static_cast<size_t>(unit_end - unit.data());
    }
    return static_cast<int>(next - from);
}

} // namespace std

namespace voxelize::os {
namespace {

// Sets errno to what the last failure of a call of the system comes to.
void keep_error() {
    switch (::GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
    case ERROR_INVALID_DRIVE:
    case ERROR_BAD_PATHNAME:
    case ERROR_BAD_NETPATH:
    case ERROR_BAD_NET_NAME:
    case ERROR_DELETE_PENDING:
        errno = ENOENT;
        return;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
        errno = EEXIST;
        return;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_WRITE_PROTECT:
        errno = EACCES;
        return;
    case ERROR_LOCK_VIOLATION:
    case ERROR_IO_PENDING:
        errno = EWOULDBLOCK;
        return;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
        errno = ENOSPC;
        return;
    case ERROR_DIR_NOT_EMPTY:
        errno = ENOTEMPTY;
        return;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
    case ERROR_COMMITMENT_LIMIT:
        errno = ENOMEM;
        return;
    case ERROR_TOO_MANY_OPEN_FILES:
        errno = EMFILE;
        return;
    case ERROR_BUFFER_OVERFLOW:
    case ERROR_FILENAME_EXCED_RANGE:
        errno = ENAMETOOLONG;
        return;
    default:
        errno = EIO;
    }
}

HANDLE handle_of(int file) { return reinterpret_cast<HANDLE>(::_get_osfhandle(file)); }

constexpr DWORD shared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

std::optional<file_facts> facts_behind(HANDLE handle) {
    BY_HANDLE_FILE_INFORMATION found{};
    if (::GetFileType(handle) != FILE_TYPE_DISK) return file_facts{};
    if (::GetFileInformationByHandle(handle, &found) == 0) {
        keep_error();
        return std::nullopt;
    }
    file_facts facts{{found.dwVolumeSerialNumber, std::uint64_t{found.nFileIndexHigh} << 32 | found.nFileIndexLow}};
    if ((found.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) == 0)
        facts.kind = (found.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0 ? file_kind::folder : file_kind::regular;
    facts.is_only_name = found.nNumberOfLinks == 1; // a file of another user cannot be opened for writing
    return facts;
}

std::string narrow(const wchar_t* text) {
    const int size = ::WideCharToMultiByte(CP_UTF8, 0, text, -1, nullptr, 0, nullptr, nullptr); // with the final zero
    std::string result(static_cast<std::size_t>(std::max(size, 1)), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, text, -1, result.data(), size, nullptr, nullptr);
    result.pop_back();
    return result;
}

HANDLE stream_handle(int file) {
    return ::GetStdHandle(file == 2 ? STD_ERROR_HANDLE : file == 1 ? STD_OUTPUT_HANDLE : STD_INPUT_HANDLE);
}

PROCESS_MEMORY_COUNTERS_EX counters() noexcept {
    PROCESS_MEMORY_COUNTERS_EX found{};
    ::K32GetProcessMemoryInfo(::GetCurrentProcess(), reinterpret_cast<PROCESS_MEMORY_COUNTERS*>(&found), sizeof(found));
    return found;
}

} // namespace

void begin_program(int& argc, char**& argv) {
    // What main() gets has lost characters that the machine's code page lacks, and has wildcards in place.
    static std::vector<std::string> words;
    static std::vector<char*> pointers;
    int count = 0;
    if (wchar_t** const wide = ::CommandLineToArgvW(::GetCommandLineW(), &count); wide != nullptr) {
        for (int i = 0; i < count; ++i) words.push_back(narrow(wide[i]));
        ::LocalFree(wide);
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        argc = count;
        argv = pointers.data();
    }
    ::_setmode(0, _O_BINARY);
    ::_setmode(1, _O_BINARY);
    ::_setmode(2, _O_BINARY);
    if (is_terminal(1) || is_terminal(2)) ::SetConsoleOutputCP(CP_UTF8);
}

void keep_running_without_reader() {} // no write ends a process

bool is_terminal(int file) {
    DWORD mode = 0;
    return ::GetConsoleMode(stream_handle(file), &mode) != 0;
}

bool draws_over_lines(int file) {
    DWORD mode = 0;
    const HANDLE handle = stream_handle(file);
    return ::GetConsoleMode(handle, &mode) != 0 &&
           ::SetConsoleMode(handle, mode | ENABLE_PROCESSED_OUTPUT | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

std::tm utc(std::time_t seconds) {
    std::tm result{};
    ::gmtime_s(&result, &seconds);
    return result;
}

std::optional<file_facts> facts_of(const std::filesystem::path& path, links how) {
    const DWORD flags = FILE_FLAG_BACKUP_SEMANTICS | (how == links::keep ? FILE_FLAG_OPEN_REPARSE_POINT : 0);
    const HANDLE handle =
        ::CreateFileW(path.c_str(), FILE_READ_ATTRIBUTES, shared, nullptr, OPEN_EXISTING, flags, nullptr);
    if (handle == INVALID_HANDLE_VALUE) {
        keep_error();
        return std::nullopt;
    }
    const std::optional<file_facts> facts = facts_behind(handle);
    ::CloseHandle(handle);
    return facts;
}

std::optional<file_facts> facts_of(int file) { return facts_behind(handle_of(file)); }

std::string compared_name(const std::filesystem::path& name) {
    std::wstring lower = name.native();
    if (!lower.empty())
        ::LCMapStringEx(LOCALE_NAME_INVARIANT, LCMAP_LOWERCASE, name.c_str(), static_cast<int>(lower.size()),
                        lower.data(), static_cast<int>(lower.size()), nullptr, nullptr, 0);
    return std::filesystem::path(lower).string();
}

int open_file(const std::filesystem::path& path, opening how) {
    DWORD access = GENERIC_READ, disposition = OPEN_EXISTING, flags = FILE_ATTRIBUTE_NORMAL;
    if (how != opening::read) access |= GENERIC_WRITE | DELETE;
    if (how == opening::append_shared) access = GENERIC_READ | FILE_APPEND_DATA;
    if (how == opening::create) disposition = CREATE_NEW;
    if (how == opening::share || how == opening::append_shared) disposition = OPEN_ALWAYS;
    if (how == opening::read_write) flags |= FILE_FLAG_OPEN_REPARSE_POINT;
    const HANDLE handle = ::CreateFileW(path.c_str(), access, shared, nullptr, disposition, flags, nullptr);
    if (handle == INVALID_HANDLE_VALUE) {
        keep_error();
        // A file that was removed while another process has it open is there in name alone.
        if (errno == EACCES && ::GetFileAttributesW(path.c_str()) == INVALID_FILE_ATTRIBUTES) errno = ENOENT;
        return -1;
    }
    const int mode = how == opening::read ? _O_RDONLY : how == opening::append_shared ? _O_RDWR | _O_APPEND : _O_RDWR;
    const int file = ::_open_osfhandle(reinterpret_cast<std::intptr_t>(handle), mode | _O_BINARY | _O_NOINHERIT);
    if (file < 0) ::CloseHandle(handle);
    return file;
}

void close_file(int file) { ::_close(file); }

int open_again(int file) {
    HANDLE copy = nullptr;
    const HANDLE process = ::GetCurrentProcess();
    if (::DuplicateHandle(process, handle_of(file), process, &copy, 0, FALSE, DUPLICATE_SAME_ACCESS) == 0) {
        keep_error();
        return -1;
    }
    const int again = ::_open_osfhandle(reinterpret_cast<std::intptr_t>(copy), _O_RDWR | _O_BINARY | _O_NOINHERIT);
    if (again < 0) ::CloseHandle(copy);
    return again;
}

bool lock_file(int file, bool wait) {
    // A byte far behind every file's end: a lock keeps others from reading what it covers.
    OVERLAPPED where{};
    where.OffsetHigh = 0x40000000;
    const DWORD flags = LOCKFILE_EXCLUSIVE_LOCK | (wait ? 0 : LOCKFILE_FAIL_IMMEDIATELY);
    if (::LockFileEx(handle_of(file), flags, 0, 1, 0, &where) != 0) return true;
    keep_error();
    return false;
}

bool empty_file(int file) { return ::_chsize_s(file, 0) == 0; }

bool write_once(int file, std::string_view text) {
    return ::_write(file, text.data(), static_cast<unsigned>(text.size())) == static_cast<int>(text.size());
}

std::optional<char> last_byte(int file) {
    char last = 0;
    const std::int64_t size = ::_lseeki64(file, 0, SEEK_END);
    if (size <= 0 || ::_lseeki64(file, size - 1, SEEK_SET) < 0 || ::_read(file, &last, 1) != 1) return std::nullopt;
    return last;
}

std::FILE* write_stream(int file) { return ::_fdopen(file, "wb"); }
std::FILE* write_stream(const std::filesystem::path& path) { return ::_wfopen(path.c_str(), L"wb"); }
int descriptor_of(std::FILE* stream) { return ::_fileno(stream); }

bool seek_stream(std::FILE* stream, std::uint64_t offset) {
    if (offset > static_cast<std::uint64_t>(INT64_MAX)) {
        errno = EFBIG;
        return false;
    }
    return ::_fseeki64(stream, static_cast<std::int64_t>(offset), SEEK_SET) == 0;
}

bool make_folder(const std::filesystem::path& path) {
    if (::CreateDirectoryW(path.c_str(), nullptr) != 0) return true;
    keep_error();
    return false;
}

bool remove_empty_folder(const std::filesystem::path& path) {
    if (::RemoveDirectoryW(path.c_str()) != 0) return true;
    keep_error();
    return false;
}

const std::byte* map_file(const std::filesystem::path& path, std::size_t size) {
    const HANDLE file =
        ::CreateFileW(path.c_str(), GENERIC_READ, shared, nullptr, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (file == INVALID_HANDLE_VALUE) {
        keep_error();
        return nullptr;
    }
    const HANDLE mapping = ::CreateFileMappingW(file, nullptr, PAGE_READONLY, 0, 0, nullptr);
    void* const data = mapping != nullptr ? ::MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, size) : nullptr;
    if (data == nullptr) keep_error();
    if (mapping != nullptr) ::CloseHandle(mapping); // the view stays
    ::CloseHandle(file);
    return static_cast<const std::byte*>(data);
}

void unmap_file(const std::byte* data, std::size_t) { ::UnmapViewOfFile(data); }

namespace {

constexpr const wchar_t* worker_variable = L"VOXELIZE_WORKER";

// Ends the processes in it once this process has ended.
HANDLE job_of_children() {
    static const HANDLE job = [] {
        const HANDLE made = ::CreateJobObjectW(nullptr, nullptr);
        JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
        limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
        if (made != nullptr)
            ::SetInformationJobObject(made, JobObjectExtendedLimitInformation, &limits, sizeof(limits));
        return made;
    }();
    return job;
}

std::string all_from(HANDLE file) {
    std::string text;
    std::array<char, 65536> block;
    for (DWORD got = 0;
         ::ReadFile(file, block.data(), static_cast<DWORD>(block.size()), &got, nullptr) != 0 && got > 0;)
        text.append(block.data(), got);
    return text;
}

} // namespace

child_process::child_process(const std::string& order) {
    std::wstring program(32768, L'\0');
    program.resize(::GetModuleFileNameW(nullptr, program.data(), static_cast<DWORD>(program.size())));
    std::wstring words = ::GetCommandLineW();
    SECURITY_ATTRIBUTES inherited{sizeof(inherited), nullptr, TRUE};
    HANDLE to = nullptr;
    STARTUPINFOW start{};
    start.cb = sizeof(start);
    start.dwFlags = STARTF_USESTDHANDLES;
    PROCESS_INFORMATION made{};
    bool is_made = ::CreatePipe(&start.hStdInput, &to, &inherited, 0) != 0 &&
                   ::CreatePipe(&from_, &start.hStdOutput, &inherited, 0) != 0 &&
                   ::SetHandleInformation(to, HANDLE_FLAG_INHERIT, 0) != 0 &&
                   ::SetHandleInformation(from_, HANDLE_FLAG_INHERIT, 0) != 0;
    if (is_made) {
        start.hStdError = ::GetStdHandle(STD_ERROR_HANDLE);
        ::SetEnvironmentVariableW(worker_variable, L"1");
        is_made = ::CreateProcessW(program.c_str(), words.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &start,
                                   &made) != 0;
        ::SetEnvironmentVariableW(worker_variable, nullptr);
    }
    if (!is_made) keep_error();
    for (const HANDLE end : {start.hStdInput, start.hStdOutput})
        if (end != nullptr) ::CloseHandle(end);
    if (is_made) {
        ::CloseHandle(made.hThread);
        process_ = made.hProcess;
        ::AssignProcessToJobObject(job_of_children(), process_);
        DWORD written = 0; // less where the process has ended, which wait() tells
        ::WriteFile(to, order.data(), static_cast<DWORD>(order.size()), &written, nullptr);
    }
    if (to != nullptr) ::CloseHandle(to);
    if (is_made) return;
    if (from_ != nullptr) ::CloseHandle(from_);
    throw std::runtime_error("no further process: " + std::generic_category().message(errno));
}

child_process::~child_process() {
    ::CloseHandle(from_);
    ::CloseHandle(process_);
}

child_process::result child_process::wait() {
    result done{all_from(from_)};
    ::WaitForSingleObject(process_, INFINITE);
    ::GetExitCodeProcess(process_, &done.code);
    return done;
}

std::optional<std::string> worker_order() {
    if (::GetEnvironmentVariableW(worker_variable, nullptr, 0) == 0) return std::nullopt;
    return all_from(::GetStdHandle(STD_INPUT_HANDLE));
}

residence residence_now() noexcept {
    const PROCESS_MEMORY_COUNTERS_EX found = counters();
    // Private pages that the system has promised and moved out count, too.
    const std::uint64_t all = std::max<std::uint64_t>(found.WorkingSetSize, found.PrivateUsage);
    return {all, found.WorkingSetSize - std::min(found.WorkingSetSize, found.PrivateUsage)};
}

std::uint64_t most_resident() { return counters().PeakWorkingSetSize; }
std::uint64_t heap_bytes() noexcept { return 0; }

std::uint64_t allowed_memory() {
    MEMORYSTATUSEX found{};
    found.dwLength = sizeof(found);
    ::GlobalMemoryStatusEx(&found);
    std::uint64_t least = found.ullTotalPhys;
    // The job of this process may have a limit.
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION job{};
    if (::QueryInformationJobObject(nullptr, JobObjectExtendedLimitInformation, &job, sizeof(job), nullptr) != 0) {
        const DWORD flags = job.BasicLimitInformation.LimitFlags;
        if ((flags & JOB_OBJECT_LIMIT_PROCESS_MEMORY) != 0)
            least = std::min<std::uint64_t>(least, job.ProcessMemoryLimit);
        if ((flags & JOB_OBJECT_LIMIT_JOB_MEMORY) != 0) least = std::min<std::uint64_t>(least, job.JobMemoryLimit);
    }
    return least;
}

} // namespace voxelize::os
