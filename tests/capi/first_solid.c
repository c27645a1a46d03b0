// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include <voxelpipe.h>

#include <stdio.h>
#include <stdlib.h>

// snippet: first solid
// Fills `inside`, 64 x 64 x 64 bytes with x fastest, of a tetrahedron. Returns the call's code.
static vp_code fill_tetrahedron(uint8_t* inside, uint64_t size, vp_counters* counters) {
    static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t triangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const vp_mesh_desc desc = {.struct_size = sizeof desc,
                               .positions = &positions[0][0],
                               .num_vertices = 4,
                               .triangles = triangles,
                               .num_triangles = 4};
    const vp_array out = {.struct_size = sizeof out, .type = VP_TYPE_UINT8, .data = inside, .size = size};
    vp_grid grid = {.struct_size = sizeof grid};
    vp_context* context = NULL;
    vp_mesh* mesh = NULL;

    vp_code code = vp_context_create(VP_ABI_VERSION, VP_BACKEND_CPU, 0, &context);
    if (code == VP_OK) code = vp_mesh_create(context, &desc, &mesh);
    if (code == VP_OK) code = vp_grid_fit_longest(mesh, 64, &grid);
    if (code == VP_OK) code = vp_solid(context, mesh, &grid, NULL, &out, counters);
    if (code != VP_OK) fprintf(stderr, "%s: %s\n", vp_code_name(code), vp_last_message());
    vp_mesh_destroy(mesh);
    vp_context_destroy(context);
    return code;
}
// end snippet

int main(void) {
    const uint64_t size = 64 * 64 * 64;
    uint8_t* inside = malloc(size);
    vp_counters counters = {.struct_size = sizeof counters};
    const vp_code code = inside == NULL ? VP_ERROR_OUT_OF_MEMORY : fill_tetrahedron(inside, size, &counters);
    printf("%llu voxels are inside, a sixth of the cube is %llu\n", (unsigned long long)counters.voxels,
           (unsigned long long)(size / 6));
    free(inside);
    return code == VP_OK && counters.voxels > size / 6 - 2100 && counters.voxels < size / 6 + 2100 ? 0 : 1;
}
