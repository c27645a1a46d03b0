// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs the voxelize program as a person does, and reads the .npy files that it writes.

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace tool_test {

namespace fs = std::filesystem;

inline std::string read_file(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

// A folder of the test's own, removed at its end.
class scratch_folder {
public:
    scratch_folder() {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        path_ =
            fs::path(testing::TempDir()) / ("voxelize_" + std::string(test->name()) + '_' + std::to_string(getpid()));
        fs::create_directories(path_);
    }
    ~scratch_folder() { fs::remove_all(path_); }
    scratch_folder(const scratch_folder&) = delete;
    scratch_folder& operator=(const scratch_folder&) = delete;
    [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }
    [[nodiscard]] const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

struct outcome {
    int code = -1; // exit code; 128 + signal where one ended it
    std::string out;
    std::string err;
};

// Starts the program, with its streams in stdout.txt and stderr.txt of the folder. The caller waits for it.
// ADDRESS_SPACE bounds that of the program, in bytes; 0: it has no bound.
inline pid_t start(const scratch_folder& folder, const std::vector<std::string>& arguments,
                   std::uint64_t address_space = 0) {
    const char* const elsewhere = std::getenv("VOXELPIPE_VOXELIZE"); // for tests moved to another machine
    std::vector<std::string> all{elsewhere != nullptr ? elsewhere : VOXELPIPE_VOXELIZE};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out = folder / "stdout.txt";
    const std::string err = folder / "stderr.txt";
    const pid_t child = fork();
    if (child == 0) {
        const rlimit bound{address_space, address_space};
        if (address_space != 0) setrlimit(RLIMIT_AS, &bound);
        dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
        dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
        execv(argv[0], argv.data());
        _exit(127);
    }
    return child;
}

// Waits for a program that was started.
inline outcome wait_for(const scratch_folder& folder, pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(folder / "stdout.txt"),
            read_file(folder / "stderr.txt")};
}

// Neither stream is a terminal. ADDRESS_SPACE as above.
inline outcome run(const scratch_folder& folder, const std::vector<std::string>& arguments,
                   std::uint64_t address_space = 0) {
    return wait_for(folder, start(folder, arguments, address_space));
}

// An array of a .npy file, version 1.0, C order.
struct array {
    std::string type; // "<f4", "|u1", ...
    std::vector<std::size_t> shape;
    std::vector<std::byte> data;

    template <class Value>
    [[nodiscard]] Value at(std::size_t i) const {
        Value value;
        std::memcpy(&value, data.data() + i * sizeof(Value), sizeof(Value));
        return value;
    }
    [[nodiscard]] std::size_t voxels() const { return shape[0] * shape[1] * shape[2]; }
};

inline array read_npy(const std::string& file) {
    const std::string bytes = read_file(file);
    array result;
    if (bytes.size() < 10 || bytes.compare(0, 6, "\x93NUMPY") != 0) {
        ADD_FAILURE() << file << " is not a .npy file";
        return result;
    }
    const std::size_t start = 10 + static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]);
    const std::string header = bytes.substr(10, start - 10);
    const std::size_t type = header.find("'descr': '") + 10;
    result.type = header.substr(type, header.find('\'', type) - type);
    EXPECT_NE(std::string::npos, header.find("'fortran_order': False")) << header;
    std::size_t at = header.find('(', header.find("'shape'")) + 1;
    while (header[at] != ')') {
        std::size_t length = 0;
        result.shape.push_back(std::stoul(header.substr(at), &length));
        at = header.find_first_not_of(", ", at + length);
    }
    result.data.resize(bytes.size() - start);
    std::memcpy(result.data.data(), bytes.data() + start, result.data.size());
    std::size_t count = static_cast<std::size_t>(result.type.back() - '0');
    for (const std::size_t n : result.shape) count *= n;
    EXPECT_EQ(count, result.data.size()) << header;
    return result;
}

} // namespace tool_test
