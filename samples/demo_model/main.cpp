// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// demo_model OUT.glb: writes the model that `make demo` voxelizes. Exit code 0 on success, 1 when the file cannot be
// written, 2 when the arguments are wrong.

#include "lighthouse.hpp"

#include <exception>
#include <iostream>

int main(int argc, char** argv) {
    const std::filesystem::path path = argc == 2 ? argv[1] : "";
    if (path.extension() != ".glb") {
        std::cerr << "usage: demo_model OUT.glb\n";
        return 2;
    }
    try {
        const demo_model::scene scene = demo_model::make_lighthouse();
        demo_model::write_glb(scene, path);
        std::cout << path.string() << ": a lighthouse, " << scene.nodes.size() << " nodes, " << scene.meshes.size()
                  << " meshes, " << scene.materials.size() << " materials, " << demo_model::num_triangles(scene)
                  << " triangles\n";
        return 0;
    } catch (const std::exception& e) {
        std::cerr << "demo_model: " << e.what() << "\n";
        return 1;
    }
}
