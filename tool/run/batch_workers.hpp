// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The processes of the models of a list. A system that can double a process does the work of a model in a copy of this
// one. Windows starts the program once more, which gets an order.

#include "batch.hpp"
#include "model/model_error.hpp"
#include "model/system.hpp"

#if defined(_WIN32)
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#else
#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#endif

#include <functional>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

// What a process of a model ends with.
struct work_done {
    std::string record; // of the manifest, in JSON
    exit_code code = exit_ok;
};

class workers {
public:
    // DOES the work of a model in a copy of this process; ORDERS it from a new one, which finds the order in
    // os::worker_order() and prints the record.
    workers(std::function<work_done(const listed_model&, const std::string& work)> does,
            std::function<std::string(const listed_model&, const std::string& work)> orders)
        : does_(std::move(does)), orders_(std::move(orders)) {}
    workers(const workers&) = delete;
    workers& operator=(const workers&) = delete;

    struct ended {
        listed_model model;
        std::string work;
        std::string record; // as the process has left it: no JSON if it has broken down
        std::string how;    // it ended in that case
    };
    [[nodiscard]] std::size_t size() const { return jobs_.size(); }

#if defined(_WIN32)
    ~workers() {
        for (job& j : jobs_) j.waiting.join();
    }

    // Throws std::runtime_error where there can be no further process.
    void start(listed_model model, std::string work) {
        std::cout.flush();
        auto process = std::make_unique<os::child_process>(orders_(model, work));
        job& started = jobs_.emplace_back();
        started.end.model = std::move(model);
        started.end.work = std::move(work);
        started.waiting = std::thread([this, &started, child = std::move(process)] {
            os::child_process::result result = child->wait();
            started.end.record = std::move(result.output);
            started.end.how = "ended without a word, code " + std::to_string(result.code);
            const std::lock_guard lock(mutex_);
            started.is_over = true;
            is_one_over_.notify_one();
        });
    }

    // Waits until a process ends.
    [[nodiscard]] std::vector<ended> wait() {
        std::vector<ended> ends;
        std::unique_lock lock(mutex_);
        while (ends.empty()) {
            for (auto at = jobs_.begin(); at != jobs_.end();) {
                const auto j = at++;
                if (!j->is_over) continue;
                lock.unlock();
                j->waiting.join();
                lock.lock();
                ends.push_back(std::move(j->end));
                jobs_.erase(j);
            }
            if (ends.empty()) is_one_over_.wait(lock);
        }
        return ends;
    }

private:
    struct job {
        ended end;
        bool is_over = false;
        std::thread waiting; // for the process
    };
    std::list<job> jobs_;
    std::mutex mutex_; // of is_over
    std::condition_variable is_one_over_;
#else
    // Throws std::runtime_error where there can be no further process.
    void start(listed_model model, std::string work) {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
        std::cout.flush();
        const pid_t process = fork();
        if (process < 0) throw std::runtime_error(std::string("no further process: ") + std::strerror(errno));
        if (process == 0) {
            close(ends[0]);
            run_child(model, work, ends[1]);
        }
        close(ends[1]);
        jobs_.push_back({{std::move(model), std::move(work), {}, {}}, process, ends[0]});
    }

    // Waits until something comes from a process; returns those that have ended.
    [[nodiscard]] std::vector<ended> wait() {
        std::vector<ended> ends;
        std::vector<pollfd> files;
        for (const job& j : jobs_) files.push_back({j.from, POLLIN, 0});
        if (poll(files.data(), files.size(), -1) < 0 && errno != EINTR)
            throw std::runtime_error(std::string("poll: ") + std::strerror(errno));
        for (std::size_t i = files.size(); i-- > 0;) {
            if (files[i].revents == 0) continue;
            std::array<char, 65536> block;
            const ssize_t n = read(files[i].fd, block.data(), block.size());
            if (n > 0) jobs_[i].end.record.append(block.data(), static_cast<std::size_t>(n));
            if (n > 0 || (n < 0 && errno == EINTR)) continue;
            job over = std::move(jobs_[i]);
            jobs_.erase(jobs_.begin() + static_cast<std::ptrdiff_t>(i));
            close(over.from);
            int status = 0;
            while (waitpid(over.process, &status, 0) < 0 && errno == EINTR) {
            }
            over.end.how = WIFSIGNALED(status) ? "ended by signal " + std::to_string(WTERMSIG(status))
                                               : "ended without a word, code " + std::to_string(WEXITSTATUS(status));
            ends.push_back(std::move(over.end));
        }
        return ends;
    }

private:
    struct job {
        ended end;
        pid_t process;
        int from;
    };

    // In the process of a model: does the work, sends the record through OUT.
    [[noreturn]] void run_child(const listed_model& model, const std::string& work, int out) const {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        const auto [text, code] = does_(model, work);
        for (std::size_t at = 0; at < text.size();) {
            const ssize_t n = ::write(out, text.data() + at, text.size() - at);
            if (n < 0 && errno != EINTR) break;
            at += n > 0 ? static_cast<std::size_t>(n) : 0;
        }
        _exit(code);
    }

    std::vector<job> jobs_;
#endif
    std::function<work_done(const listed_model&, const std::string&)> does_;
    std::function<std::string(const listed_model&, const std::string&)> orders_;
};

} // namespace voxelize
