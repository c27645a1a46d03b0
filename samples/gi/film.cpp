// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "film.hpp"

#include "write/formats/output_file.hpp"
#include "write/formats/png.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <sys/wait.h>

namespace gi {
namespace {

namespace fs = std::filesystem;

class pictures : public film {
public:
    explicit pictures(const settings& s) : settings_(s) {}

    void add(const std::vector<glm::u8vec4>& pixels) override {
        fs::path file = settings_.output;
        if (settings_.frames > 1) {
            char number[16];
            std::snprintf(number, sizeof(number), "_%05d", static_cast<int>(files_.size()));
            file.replace_filename(file.stem().string() + number + ".png");
        }
        voxelize::write_picture(file, {}, [&](const voxelize::preview_options&) {
            voxelize::image picture;
            picture.width = settings_.width;
            picture.height = settings_.height;
            picture.components = 3;
            picture.pixels.reserve(pixels.size() * 3);
            for (const glm::u8vec4& p : pixels) picture.pixels.insert(picture.pixels.end(), {p.r, p.g, p.b});
            return picture;
        });
        files_.push_back(file);
    }
    std::vector<fs::path> finish() override { return files_; }

private:
    settings settings_;
    std::vector<fs::path> files_;
};

// Raw frames into a pipe. The name goes to ffmpeg by way of the environment, so that no character of it is the shell's.
class piped : public film {
public:
    explicit piped(const settings& s) : output_(s.output) {
        std::signal(SIGPIPE, SIG_IGN); // an ffmpeg that ends early is told by the pipe
        ::setenv("VOXELPIPE_GI_OUTPUT", fs::absolute(s.output).c_str(), 1);
        const std::string size = std::to_string(s.width) + "x" + std::to_string(s.height);
        const std::string even = s.width % 2 == 0 && s.height % 2 == 0 ? "" : " -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2'";
        const std::string command = "ffmpeg -loglevel error -y -f rawvideo -pix_fmt rgba -r 30 -s " + size +
                                    " -i - -an" + even + " -pix_fmt yuv420p \"$VOXELPIPE_GI_OUTPUT\"";
        pipe_ = ::popen(command.c_str(), "w");
        if (pipe_ == nullptr) throw voxelize::write_error(output_, "ffmpeg cannot be started");
    }
    ~piped() override {
        if (pipe_ != nullptr) ::pclose(pipe_);
    }
    void add(const std::vector<glm::u8vec4>& pixels) override {
        if (std::fwrite(pixels.data(), sizeof(glm::u8vec4), pixels.size(), pipe_) != pixels.size())
            throw voxelize::write_error(output_, "ffmpeg takes no more frames");
    }
    std::vector<fs::path> finish() override {
        const int result = ::pclose(pipe_);
        pipe_ = nullptr;
        if (result == -1 || !WIFEXITED(result) || WEXITSTATUS(result) != 0)
            throw voxelize::write_error(output_, "ffmpeg failed");
        return {output_};
    }
    piped(const piped&) = delete;
    piped& operator=(const piped&) = delete;

private:
    fs::path output_;
    std::FILE* pipe_ = nullptr;
};

bool has_ffmpeg() { return std::system("command -v ffmpeg >/dev/null 2>&1") == 0; }

} // namespace

std::unique_ptr<film> open_film(const settings& s) {
    const std::string kind = s.output.extension().string();
    const bool is_film = kind == ".mp4" || kind == ".mkv" || kind == ".webm";
    if (!is_film && kind != ".png")
        throw usage_error("-o ends in .png, .mp4, .mkv or .webm, not as " + s.output.string());
    const fs::path folder = s.output.has_parent_path() ? s.output.parent_path() : fs::path(".");
    std::error_code error;
    if (!fs::is_directory(folder, error))
        throw voxelize::write_error(s.output, "there is no folder " + folder.string());
    if (is_film && has_ffmpeg()) return std::make_unique<piped>(s);
    return std::make_unique<pictures>(s);
}

} // namespace gi
