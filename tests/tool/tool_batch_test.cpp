// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Many models in one run: shares of ranks, jobs, names, the manifest, and what a later run does after one that was
// killed.
#include "tool_test.hpp"

#include "run/batch.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <set>
#include <sstream>
#include <thread>

namespace {

using namespace tool_test;

// COUNT models of one triangle each, of different sizes, listed in models.txt; NAME(i) is a path in the folder.
struct models {
    scratch_folder folder;
    std::vector<std::string> inputs;

    void add(const std::string& name, float size = 1) {
        const std::string path = folder / name;
        fs::create_directories(fs::path(path).parent_path());
        std::ofstream(path) << "v 0 0 0\nv " << size << " 0 0\nv 0 " << size / 2 << " 0\nv 0 0 0.5\nf 1 2 3\nf 1 2 4\n";
        inputs.push_back(path);
    }
    void write_list() const {
        std::ofstream list(folder / "models.txt");
        list << "# models\n\n";
        for (const std::string& input : inputs) list << input << '\n';
    }
    outcome run_list(std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments{"--list", folder / "models.txt", "-o", folder / "out/{name}.npy", "-r",
                                           "16"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(folder, arguments);
    }
    [[nodiscard]] std::vector<json> manifest(int rank = 0) const {
        std::vector<json> records;
        std::istringstream lines(read_file(folder / ("out/manifest." + std::to_string(rank) + ".jsonl")));
        for (std::string line; std::getline(lines, line);) records.push_back(json::parse(line));
        return records;
    }
};

TEST(ToolBatch, NamesAreStemsAndEqualOnesAreNumbered) {
    std::istringstream list("a/x.obj\n\n# no model\nb/x.glb\r\nx-2.obj\nc/x.stl\ny.tar.gz\nd/x-2.ply\n");
    const auto models = voxelize::read_list(list);
    std::vector<std::string> names;
    for (const auto& m : models) names.push_back(m.name);
    EXPECT_EQ(names, (std::vector<std::string>{"x", "x-3", "x-2", "x-4", "y.tar", "x-2-2"}));
    EXPECT_EQ(models[1].input, "b/x.glb");
    EXPECT_EQ(voxelize::with_name("o/{name}/{name}.npy", "m{name}").string(), "o/m{name}/m{name}.npy");
    EXPECT_EQ(voxelize::manifest_folder("o/p/{name}.npy"), "o/p");
    EXPECT_EQ(voxelize::manifest_folder("o/{name}/p/x.npy"), "o");
    EXPECT_EQ(voxelize::manifest_folder("{name}.npy"), "");
}

TEST(ToolBatch, AByteOrderMarkAndBlanksAroundPathsArePassedOver) {
    std::istringstream list("\xEF\xBB\xBF"
                            "a b.obj\r\n \t c.obj \t\r\n \t\r\n  # no model\n\td e.obj\n#f.obj");
    std::vector<std::string> inputs;
    for (const auto& m : voxelize::read_list(list)) inputs.push_back(m.input.string());
    EXPECT_EQ((std::vector<std::string>{"a b.obj", "c.obj", "d e.obj"}), inputs);

    models all;
    all.add("one.obj");
    all.add("two.obj", 2);
    std::ofstream(all.folder / "models.txt") << "\xEF\xBB\xBF" << all.inputs[0] << " \r\n\t" << all.inputs[1] << "\r\n";
    const outcome result = all.run_list();
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_TRUE(fs::exists(all.folder / "out/one.npy"));
    EXPECT_TRUE(fs::exists(all.folder / "out/two.npy"));

    std::ofstream(all.folder / "models.txt") << "\xFF\xFE"
                                             << "a";
    const outcome wide = all.run_list();
    EXPECT_EQ(2, wide.code);
    EXPECT_EQ("voxelize: cannot read the list '" + (all.folder / "models.txt") + "': it is text in UTF-16, not UTF-8\n",
              wide.err);
}

TEST(ToolBatch, EachModelIsWhatARunByItselfGives) {
    models all;
    for (int i = 0; i < 7; ++i) all.add("m/part" + std::to_string(i) + ".obj", 1.0f + static_cast<float>(i));
    all.write_list();
    const outcome result = all.run_list({"--jobs", "2"});
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_NE(result.out.find("7 models: 7 done, 0 were finished, 0 failed"), std::string::npos) << result.out;
    const auto records = all.manifest();
    ASSERT_EQ(records.size(), 7u);
    std::set<std::string> inputs;
    for (const json& record : records) {
        EXPECT_EQ(record["status"], "ok");
        inputs.insert(record["input"].get<std::string>());
        ASSERT_EQ(record["outputs"].size(), 1u);
        const std::string file = record["outputs"][0]["file"];
        const std::string alone = all.folder / "alone.npy";
        ASSERT_EQ(run(all.folder, {record["input"], "-o", alone, "-r", "16"}).code, 0);
        EXPECT_EQ(read_file(file), read_file(alone));
        EXPECT_EQ(record["outputs"][0]["bytes"], fs::file_size(file));
        EXPECT_EQ(record["outputs"][0]["hash"].get<std::string>().substr(0, 6), "crc32:");
        EXPECT_EQ(record["counts"]["triangles"], 2);
        EXPECT_GT(record["counts"]["voxels"], 10);
        EXPECT_GT(record["ms"], 0);
    }
    EXPECT_EQ(inputs.size(), 7u);

    // What is finished is left out; a file that is gone, or other options, are not.
    EXPECT_NE(all.run_list().out.find("0 done, 7 were finished"), std::string::npos);
    fs::remove(all.folder / "out/part3.npy");
    EXPECT_NE(all.run_list().out.find("1 done, 6 were finished"), std::string::npos);
    EXPECT_NE(all.run_list({"--coverage", "thin"}).out.find("7 done, 0 were finished"), std::string::npos);
    EXPECT_NE(all.run_list({"--coverage", "thin", "-j", "1"}).out.find("0 done, 7 were finished"), std::string::npos);
    // So is a model that has changed.
    all.inputs.clear();
    all.add("m/part5.obj", 3.25f);
    EXPECT_NE(all.run_list({"--coverage", "thin"}).out.find("1 done, 6 were finished"), std::string::npos);
}

TEST(ToolBatch, ForeignLinesOfAManifestArePassedOver) {
    models all;
    all.add("p.obj");
    all.write_list();
    fs::create_directories(all.folder / "out");
    std::ofstream(all.folder / "out/manifest.other.jsonl")
        << "{\"name\": 3, \"work\": \"x\", \"status\": \"ok\", \"outputs\": []}\n"
        << "{\"name\": \"p\", \"work\": 5, \"status\": \"ok\", \"outputs\": []}\n"
        << "{\"name\": \"p\", \"work\": \"x\", \"status\": 7}\n"
        << "{\"name\": \"p\", \"work\": \"x\", \"status\": \"ok\", \"outputs\": [3]}\n"
        << "{\"name\": \"p\", \"work\": \"x\", \"status\": \"ok\", \"outputs\": [{\"file\": 3}]}\n[1]\nnull\n";
    const outcome first = all.run_list();
    EXPECT_EQ(first.code, 0) << first.err;
    EXPECT_NE(first.out.find("1 done, 0 were finished"), std::string::npos) << first.out;
    EXPECT_NE(all.run_list().out.find("0 done, 1 were finished"), std::string::npos);
}

TEST(ToolBatch, RanksShareTheList) {
    models all;
    for (int i = 0; i < 5; ++i) all.add("p" + std::to_string(i) + ".obj");
    all.add("other/p1.obj", 2);
    all.write_list();
    ASSERT_EQ(all.run_list({"--rank", "1", "--world-size", "2"}).code, 0);
    EXPECT_EQ(all.manifest(1).size(), 3u);
    EXPECT_FALSE(fs::exists(all.folder / "out/p0.npy"));
    EXPECT_TRUE(fs::exists(all.folder / "out/p1-2.npy")); // its name does not depend on who makes it
    ASSERT_EQ(all.run_list({"--rank", "0", "--world-size", "2"}).code, 0);
    EXPECT_EQ(all.manifest(0).size(), 3u);
    std::set<std::string> names;
    for (int rank = 0; rank < 2; ++rank)
        for (const json& record : all.manifest(rank)) names.insert(record["name"].get<std::string>());
    EXPECT_EQ(names, (std::set<std::string>{"p0", "p1", "p2", "p3", "p4", "p1-2"}));
    // Another number of ranks knows what these have done.
    EXPECT_NE(all.run_list().out.find("0 done, 6 were finished"), std::string::npos);
}

// Two ranks have made the same outputs, by different options: the files are those of the later one.
TEST(ToolBatch, TheLatestRecordOfAllRanksCounts) {
    for (const bool first_is_0 : {true, false}) {
        SCOPED_TRACE(first_is_0);
        models all;
        all.add("p.obj");
        std::ofstream(all.inputs[0]) << "v 0 0 0\nv 1 0.3 0.2\nv 0.2 1 0.6\nf 1 2 3\n"; // slanted
        const std::string ranks[] = {first_is_0 ? "0" : "1", first_is_0 ? "1" : "0"};
        const std::vector<std::string> thin{"--coverage", "thin"};
        const auto as = [&](const std::string& rank, std::vector<std::string> more) {
            // Of a list of two, rank 1 has the second.
            std::ofstream(all.folder / "models.txt") << (rank == "1" ? "other.obj\n" : "") << all.inputs[0] << '\n';
            more.insert(more.end(), {"--rank", rank, "--world-size", "2"});
            return all.run_list(more).out;
        };
        EXPECT_NE(as(ranks[0], {}).find("1 done, 0 were finished"), std::string::npos);
        const std::string conservative = read_file(all.folder / "out/p.npy");
        EXPECT_NE(as(ranks[1], thin).find("1 done, 0 were finished"), std::string::npos);
        EXPECT_TRUE(read_file(all.folder / "out/p.npy") != conservative);
        EXPECT_NE(as(ranks[1], thin).find("0 done, 1 were finished"), std::string::npos);
        EXPECT_NE(as(ranks[0], {}).find("1 done, 0 were finished"), std::string::npos);
        EXPECT_TRUE(read_file(all.folder / "out/p.npy") == conservative);
        EXPECT_NE(as(ranks[1], thin).find("1 done, 0 were finished"), std::string::npos);
    }
}

// Models of equal names, sizes and times that swap their places in the list, and so their outputs.
TEST(ToolBatch, AModelIsKnownByItsPath) {
    models all;
    all.add("a/p.obj", 2);
    all.add("b/p.obj", 4);
    const auto time = fs::last_write_time(all.inputs[0]);
    fs::last_write_time(all.inputs[1], time);
    ASSERT_EQ(fs::file_size(all.inputs[0]), fs::file_size(all.inputs[1]));
    all.write_list();
    EXPECT_NE(all.run_list().out.find("2 done, 0 were finished"), std::string::npos);
    EXPECT_NE(all.run_list().out.find("0 done, 2 were finished"), std::string::npos);
    const std::string second = read_file(all.folder / "out/p-2.npy");
    std::swap(all.inputs[0], all.inputs[1]);
    all.write_list();
    EXPECT_NE(all.run_list().out.find("2 done, 0 were finished"), std::string::npos);
    EXPECT_TRUE(read_file(all.folder / "out/p.npy") == second);
}

TEST(ToolBatch, ABadModelStopsNothing) {
    models all;
    all.add("good1.obj");
    all.inputs.push_back(all.folder / "missing.obj");
    std::ofstream(all.folder / "broken.glb") << "glTF, but not really";
    all.inputs.push_back(all.folder / "broken.glb");
    // No files: what a list names is looked at before any of it is read.
    for (const char* const name : {"folder", "folder.glb", "folder.obj"}) {
        fs::create_directories(all.folder / name);
        all.inputs.push_back(all.folder / name);
    }
    ASSERT_EQ(0, ::mkfifo((all.folder / "pipe.glb").c_str(), 0600));
    all.inputs.push_back(all.folder / "pipe.glb");
    all.add("good2.obj");
    all.write_list();
    const outcome result = all.run_list();
    EXPECT_EQ(result.code, 2);
    EXPECT_NE(result.err.find("missing.obj: bad_model: "), std::string::npos) << result.err;
    EXPECT_NE(result.out.find("2 done, 0 were finished, 6 failed"), std::string::npos) << result.out;
    int bad = 0;
    for (const json& record : all.manifest()) {
        if (record["status"] == "ok") continue;
        ++bad;
        EXPECT_EQ(record["status"], "bad_model");
        EXPECT_FALSE(record["error"].get<std::string>().empty());
        EXPECT_FALSE(record.contains("outputs"));
    }
    EXPECT_EQ(bad, 6);
    // Failures are tried again.
    std::ofstream(all.folder / "missing.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    EXPECT_NE(all.run_list().out.find("1 done, 2 were finished, 5 failed"), std::string::npos);
    // A model that needs more than its share of the memory fails by itself.
    models large;
    large.add("cube.obj");
    large.write_list();
    const outcome over =
        run(large.folder, {"--list", large.folder / "models.txt", "-o", large.folder / "{name}.npy", "-r",
                           "1600x1600x1600", "-t", "count", "--dense", "--max-memory", "200", "--jobs", "4"});
    EXPECT_EQ(over.code, 2);
    EXPECT_NE(over.err.find("out_of_memory"), std::string::npos) << over.err;
    EXPECT_NE(over.err.find("50 MiB"), std::string::npos) << over.err; // a quarter of the budget
}

TEST(ToolBatch, MeshesAreCountedByTheirFaces) {
    models all;
    all.add("part.obj");
    all.write_list();
    const std::vector<std::string> remesh{
        "--list", all.folder / "models.txt", "-o", all.folder / "out/{name}.ply", "-r", "16", "--remesh", "--iso",
        "0.1"};
    const outcome result = run(all.folder, remesh);
    ASSERT_EQ(result.code, 0) << result.err;
    const json counts = all.manifest().at(0)["counts"];
    EXPECT_GT(counts["faces"], 100);
    EXPECT_EQ(counts["vertices"].get<int>() - counts["faces"].get<int>() / 2, counts["euler"]);
    EXPECT_EQ(counts["components"], 1);
    EXPECT_FALSE(counts.contains("voxels"));
    EXPECT_NE(result.out.find("part: " + counts["faces"].dump() + " faces, "), std::string::npos) << result.out;
    std::vector<std::string> with_report = remesh;
    with_report.emplace_back("--report");
    EXPECT_NE(run(all.folder, with_report).err.find("--report does not go with --list: see the manifest"),
              std::string::npos);
}

TEST(ToolBatch, ARunThatIsKilledGoesOnWhereItStopped) {
    models all;
    for (int i = 0; i < 12; ++i) all.add("k" + std::to_string(i) + ".obj", 1.0f + static_cast<float>(i));
    all.write_list();
    const pid_t child = fork();
    if (child == 0) {
        const char* const elsewhere = std::getenv("VOXELPIPE_VOXELIZE");
        const std::string tool = elsewhere != nullptr ? elsewhere : VOXELPIPE_VOXELIZE;
        dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
        execl(tool.c_str(), tool.c_str(), "--list", (all.folder / "models.txt").c_str(), "-o",
              (all.folder / "out/{name}.npy").c_str(), "-r", "160", static_cast<char*>(nullptr));
        _exit(127);
    }
    const std::string first = all.folder / "out/manifest.0.jsonl";
    const auto lines = [&] {
        const std::string text = read_file(first);
        return std::count(text.begin(), text.end(), '\n');
    };
    for (int i = 0; i < 3000 && lines() < 3; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const auto before = lines();
    ASSERT_GE(before, 3);
    // As if the kill had met a line half written.
    std::ofstream(first, std::ios::app) << "{\"input\": \"half";
    const outcome again =
        run(all.folder, {"--list", all.folder / "models.txt", "-o", all.folder / "out/{name}.npy", "-r", "160"});
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_NE(again.out.find(std::to_string(12 - before) + " done, " + std::to_string(before) + " were finished"),
              std::string::npos)
        << again.out;
    for (int i = 0; i < 12; ++i)
        EXPECT_EQ(fs::file_size(all.folder / ("out/k" + std::to_string(i) + ".npy")) > 1000, true);
}

TEST(ToolBatch, ChecksItsOptions) {
    const scratch_folder folder;
    const auto error = [&](const std::vector<std::string>& arguments) {
        const outcome result = run(folder, arguments);
        EXPECT_EQ(result.code, 1);
        return result.err;
    };
    EXPECT_NE(error({"-o", "x.npy"}).find("INPUT is required"), std::string::npos);
    EXPECT_NE(error({"m.obj", "--list", "l", "-o", "{name}.npy"}).find("do not go together"), std::string::npos);
    EXPECT_NE(error({"--list", "l", "-o", "x.npy"}).find("needs {name}"), std::string::npos);
    EXPECT_NE(error({"--list", "l", "-o", "{name}.zarr", "--resume"}).find("for one model"), std::string::npos);
    EXPECT_NE(error({"--list", "l", "-o", "{name}.npy", "--rank", "2", "--world-size", "2"}).find("below --world-size"),
              std::string::npos);
    EXPECT_NE(error({"--list", "l", "-o", "{name}.npy", "--world-size", "2"}).find("--world-size needs --rank"),
              std::string::npos);
    EXPECT_NE(error({"m.obj", "-o", "m.zarr", "--world-size", "2"}).find("--world-size needs --rank"),
              std::string::npos);
    EXPECT_NE(error({"m.obj", "-o", "x.npy", "--jobs", "2"}).find("--list"), std::string::npos);
    ::setenv("PMI_SIZE", "2", 1); // as under mpiexec
    EXPECT_NE(error({"m.obj", "-o", "x.npy"})
                  .find("2 processes share one model by slabs (--list shares many models), "
                        "which needs one output, a .zarr"),
              std::string::npos);
    ::unsetenv("PMI_SIZE");
    const outcome missing = run(folder, {"--list", folder / "none.txt", "-o", folder / "{name}.npy"});
    EXPECT_EQ(missing.code, 2);
    EXPECT_NE(missing.err.find("cannot read the list '"), std::string::npos);
    EXPECT_NE(missing.err.find("': No such file or directory"), std::string::npos) << missing.err;
    const outcome a_folder = run(folder, {"--list", folder.path().string(), "-o", folder / "{name}.npy"});
    EXPECT_EQ("voxelize: cannot read the list '" + folder.path().string() + "': it is a folder\n", a_folder.err);
}

TEST(ToolBatch, PagesAreShownSideBySide) {
    models all;
    all.add("m/one.obj");
    all.add("m/two & three.obj", 2);
    all.write_list();
    const std::vector<std::string> pages{
        "--list", all.folder / "models.txt", "-o", all.folder / "o/{name}/p.html", "-r", "16"};
    ASSERT_EQ(0, run(all.folder, pages).code);
    const std::string page = read_file(all.folder / "o/side_by_side.html");
    EXPECT_NE(
        page.find(R"("pages":[{"name":"one","file":"one/p.html"},{"name":"two & three","file":"two & three/p.html"}])"),
        std::string::npos);
    EXPECT_TRUE(fs::exists(all.folder / "o/two & three/p.html"));

    // Another rank leaves it to the first, and no model takes its place.
    fs::remove(all.folder / "o/side_by_side.html");
    std::vector<std::string> second = pages;
    second.insert(second.end(), {"--rank", "1", "--world-size", "2"});
    ASSERT_EQ(0, run(all.folder, second).code);
    EXPECT_FALSE(fs::exists(all.folder / "o/side_by_side.html"));
    all.add("m/side_by_side.obj");
    all.write_list();
    const outcome taken =
        run(all.folder, {"--list", all.folder / "models.txt", "-o", all.folder / "o/{name}.html", "-r", "16"});
    EXPECT_EQ(1, taken.code);
    EXPECT_NE(taken.err.find("side_by_side.html"), std::string::npos) << taken.err;
}

} // namespace
