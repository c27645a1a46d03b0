// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "run.hpp"

#include "machine.hpp"
#include "output.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>

namespace bench::gpu {

struct command::parser : CLI::App {
    using CLI::App::App;
};

command::command(const std::string& name, const std::string& description, run_options& how, const std::string& files)
    : parser_(std::make_unique<parser>(description)), name_(name), how_(how) {
    parser_->add_option("--scenes", how_.scenes, "Folder of the benchmark scenes (.vpm or .vpz)")
        ->capture_default_str();
    add("--runs", how_.repeat.runs, "Timed calls a figure, at most");
    add("--seconds", how_.repeat.seconds, "Fewer calls once they took so long");
    parser_->add_option("--out", how_.out, "Folder for " + files);
}
command::~command() = default;

void command::add_meshes() {
    parser_->add_option("--mesh", how_.names,
                        "A scene, a generated mesh or a file; may be repeated. Default: five scenes");
    parser_->add_option("--resolution", how_.resolutions, "Voxels a side; may be repeated")->capture_default_str();
}
void command::add(const std::string& option, int& value, const std::string& help) {
    parser_->add_option(option, value, help)->capture_default_str();
}
void command::add(const std::string& option, double& value, const std::string& help) {
    parser_->add_option(option, value, help)->capture_default_str();
}
void command::add(const std::string& option, std::uint64_t& value, const std::string& help) {
    parser_->add_option(option, value, help)->capture_default_str();
}
void command::add(const std::string& option, std::vector<std::string>& words, const std::string& help,
                  const std::vector<std::string>& choices) {
    CLI::Option* const added = parser_->add_option(option, words, help)->capture_default_str();
    if (!choices.empty()) added->check(CLI::IsMember(choices));
}
void command::add_flag(const std::string& flag, bool& value, const std::string& help) {
    parser_->add_flag(flag, value, help);
}

int command::run(int argc, char** argv, const std::function<int(const std::string& typed)>& body) {
    CLI11_PARSE(*parser_, argc, argv);
    try {
        return body(command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s: %s\n", name_.c_str(), e.what());
        return 1;
    }
}

void write_report(const run_options& how, const run_report& report, const clock_watch& watch, const std::string& typed,
                  const table& rows) {
    const machine_record machine = describe_machine();
    std::string text = "# " + report.title + "\n\n" + describe_device(watch) + "- commit: " + machine.commit +
                       "\n- date: " + machine.date + "\n- clocks over the run: " + watch.range() + "\n- command: `" +
                       typed + "`\n- milliseconds, medians of at most " + std::to_string(how.repeat.runs) + " calls, " +
                       report.timing + "\n";
    for (const std::string& fact : report.facts) text += "- " + fact + "\n";
    for (const std::string& note : report.notes) text += "- " + note + "\n";
    text += "\n" + rows.markdown() + report.after;
    std::cout << text;
    if (how.out.empty()) return;
    const std::filesystem::path file = std::filesystem::path(how.out) / report.file;
    write_file(file.string() + ".md", text);
    write_file(file.string() + ".csv", rows.csv());
}

} // namespace bench::gpu
