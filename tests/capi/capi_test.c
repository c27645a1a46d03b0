/* SPDX-FileCopyrightText: 2026 The VoxelPipe authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The C API used from C99: results that are known beforehand. capi_test.py has the errors, backends_test.c compares
 * backends. `capi_test cuda` runs on the GPU, and ends with 77 where there is no device. */
#include <voxelpipe.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;
#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            printf("%s:%d: %s does not hold; last message: %s\n", __FILE__, __LINE__, #condition, vp_last_message());  \
            ++failures;                                                                                                \
        }                                                                                                              \
    } while (0)
#define OK(call) CHECK((call) == VP_OK)

/* A cube from `low` to `high`, its faces outward; appended at vertex 8 * n, triangle 12 * n. */
static void add_cube(float (*positions)[3], uint32_t (*triangles)[3], uint32_t n, float low, float high) {
    static const uint32_t faces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                          {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    uint32_t i, a;
    for (i = 0; i < 8; ++i)
        for (a = 0; a < 3; ++a) positions[8 * n + i][a] = (i >> a & 1u) != 0 ? high : low;
    for (i = 0; i < 12; ++i)
        for (a = 0; a < 3; ++a) triangles[12 * n + i][a] = faces[i][a] + 8 * n;
}

static vp_mesh* make_mesh(vp_context* context, float (*positions)[3], uint64_t vertices, uint32_t (*triangles)[3],
                          uint64_t num_triangles, const uint64_t* parts, uint64_t num_parts) {
    vp_mesh_desc desc;
    vp_mesh* mesh = NULL;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.positions = &positions[0][0];
    desc.num_vertices = vertices;
    desc.triangles = triangles;
    desc.num_triangles = num_triangles;
    desc.first_of_part = parts;
    desc.num_parts = num_parts;
    OK(vp_mesh_create(context, &desc, &mesh));
    return mesh;
}

static vp_grid unit_grid(uint64_t n) {
    vp_grid grid;
    int a;
    memset(&grid, 0, sizeof grid);
    grid.struct_size = sizeof grid;
    for (a = 0; a < 3; ++a) {
        grid.voxel_size[a] = 1.0;
        grid.extent[a] = n;
    }
    return grid;
}

static vp_array packed(int32_t type, void* data, uint64_t size) {
    vp_array array;
    memset(&array, 0, sizeof array);
    array.struct_size = sizeof array;
    array.type = type;
    array.data = data;
    array.size = size;
    return array;
}

static int count(const uint8_t* mask, int n) {
    int i, set = 0;
    for (i = 0; i < n; ++i) set += mask[i];
    return set;
}

/* The cube from 0.75 to 3.25 in 4 x 4 x 4 unit voxels: its sides lie in the outer layers, 8 voxels are within. */
enum { N = 4, VOXELS = N * N * N, LINKS = 26 };

static void surfaces_and_solids(vp_context* context, const vp_mesh* cube) {
    static const struct {
        int32_t coverage;
        int voxels;
    } coverages[] = {{VP_COVERAGE_CONSERVATIVE, 56}, {VP_COVERAGE_THIN, 56}, {VP_COVERAGE_CROSSHAIR, 24}};
    static const struct {
        int32_t extent;
        int voxels;
    } extents[] = {{VP_EXTENT_CENTRE, 8}, {VP_EXTENT_OUTER, 64}, {VP_EXTENT_INNER, 8}};
    const vp_grid grid = unit_grid(N);
    uint8_t mask[VOXELS];
    uint32_t words[N * N];
    const vp_array out = packed(VP_TYPE_UINT8, mask, sizeof mask);
    const vp_array out_words = packed(VP_TYPE_BITS, words, sizeof words);
    vp_surface_options surface;
    vp_solid_options solid;
    vp_counters counters;
    size_t i;
    int v;
    memset(&surface, 0, sizeof surface);
    memset(&solid, 0, sizeof solid);
    memset(&counters, 0, sizeof counters);
    surface.struct_size = sizeof surface;
    solid.struct_size = sizeof solid;
    counters.struct_size = sizeof counters;
    for (i = 0; i < sizeof coverages / sizeof coverages[0]; ++i) {
        surface.coverage = coverages[i].coverage;
        OK(vp_surface(context, cube, &grid, &surface, &out, &counters));
        CHECK(count(mask, VOXELS) == coverages[i].voxels);
        CHECK(counters.voxels == (uint64_t)coverages[i].voxels && counters.triangles == 12);
        OK(vp_surface(context, cube, &grid, &surface, &out_words, NULL));
        for (v = 0; v < VOXELS; ++v) CHECK((words[v / N] >> v % N & 1u) == mask[v]);
    }
    for (i = 0; i < sizeof extents / sizeof extents[0]; ++i) {
        solid.extent = extents[i].extent;
        OK(vp_solid(context, cube, &grid, &solid, &out, &counters));
        CHECK(count(mask, VOXELS) == extents[i].voxels);
        CHECK(counters.open_rows == 0);
    }
    OK(vp_solid(context, cube, &grid, NULL, &out, NULL)); /* null: the defaults */
    CHECK(count(mask, VOXELS) == 8 && mask[(1 * N + 1) * N + 1] == 1 && mask[0] == 0);
}

/* Rules, bodies and repairs, on two cubes of which one lies within the other, and on a cube without two sides. */
static void rules_and_repairs(vp_context* context) {
    static const uint64_t parts[2] = {0, 12};
    float positions[16][3];
    uint32_t triangles[24][3];
    uint8_t mask[8 * 8 * 8];
    const vp_grid grid = unit_grid(8);
    const vp_array out = packed(VP_TYPE_UINT8, mask, sizeof mask);
    vp_solid_options solid;
    vp_counters counters;
    vp_mesh *nested, *open;
    memset(&solid, 0, sizeof solid);
    memset(&counters, 0, sizeof counters);
    solid.struct_size = sizeof solid;
    counters.struct_size = sizeof counters;
    add_cube(positions, triangles, 0, 1.25f, 6.75f); /* 6^3 centres */
    add_cube(positions, triangles, 1, 2.75f, 5.25f); /* 2^3 centres */
    nested = make_mesh(context, positions, 16, triangles, 24, parts, 2);
    OK(vp_solid(context, nested, &grid, &solid, &out, NULL));
    CHECK(count(mask, 512) == 216);
    solid.fill = VP_FILL_EVEN_ODD;
    OK(vp_solid(context, nested, &grid, &solid, &out, NULL));
    CHECK(count(mask, 512) == 216 - 8);
    solid.bodies = VP_BODIES_EACH;
    OK(vp_solid(context, nested, &grid, &solid, &out, NULL));
    CHECK(count(mask, 512) == 216);
    vp_mesh_destroy(nested);

    open = make_mesh(context, positions, 8, triangles, 8, NULL, 0); /* without the sides across x */
    memset(&solid, 0, sizeof solid);
    solid.struct_size = sizeof solid;
    OK(vp_solid(context, open, &grid, &solid, &out, &counters));
    CHECK(counters.crossings == 0 && count(mask, 512) == 0);
    solid.repair = VP_REPAIR_CLOSE_HOLES;
    OK(vp_solid(context, open, &grid, &solid, &out, &counters));
    CHECK(counters.hole_edges == 8 && counters.holes == 2 && counters.cones == 2 && count(mask, 512) == 216);
    solid.max_hole_edges = 3;
    OK(vp_solid(context, open, &grid, &solid, &out, &counters));
    CHECK(counters.cones == 0 && count(mask, 512) == 0);
    memset(&solid, 0, sizeof solid);
    solid.struct_size = sizeof solid;
    solid.repair = VP_REPAIR_VOTE;
    OK(vp_solid(context, open, &grid, &solid, &out, NULL));
    CHECK(count(mask, 512) >= 216);
    solid.repair = VP_REPAIR_WINDING; /* more than half of what a point sees is the box: not where two sides are near */
    OK(vp_solid(context, open, &grid, &solid, &out, &counters));
    CHECK(counters.holes == 2 && count(mask, 512) > 100 && count(mask, 512) <= 216);
    CHECK(mask[(4 * 8 + 4) * 8 + 4] == 1 && mask[0] == 0);
    solid.fill = VP_FILL_EVEN_ODD;
    CHECK(vp_solid(context, open, &grid, &solid, &out, NULL) == VP_ERROR_BAD_OPTION);
    vp_mesh_destroy(open);
}

/* Column 0 is 1 everywhere, column 1 the vertex's x, columns 2 and 3 its negative, so that two passes are drawn. */
static void values(vp_context* context, const vp_mesh* cube, float (*positions)[3]) {
    const vp_grid grid = unit_grid(N);
    const float background[4] = {-1, -2, -3, -4};
    float rows[8][4], dense[VOXELS][4];
    int64_t sum = 0;
    vp_rows from;
    vp_list* list = NULL;
    vp_array out = packed(VP_TYPE_FLOAT32, dense, sizeof dense);
    uint64_t n = 0, i;
    uint32_t columns = 0;
    int32_t* coordinates;
    float* listed;
    memset(&from, 0, sizeof from);
    for (i = 0; i < 8; ++i) {
        rows[i][0] = 1;
        rows[i][1] = positions[i][0];
        rows[i][2] = rows[i][3] = -positions[i][0];
    }
    from.struct_size = sizeof from;
    from.columns = 4;
    from.values = &rows[0][0];
    from.num_rows = 8;
    OK(vp_surface_values(context, cube, &grid, NULL, &from, background, &out, NULL));
    CHECK(dense[(1 * N + 1) * N + 1][3] == -4); /* within: nothing was drawn */
    CHECK(dense[(1 * N + 1) * N + 0][0] == 1 && dense[(1 * N + 1) * N + 0][1] == 0.75f);
    CHECK(dense[(1 * N + 1) * N + 3][1] == 3.25f && dense[(1 * N + 1) * N + 3][3] == -3.25f);
    OK(vp_surface_list(context, cube, &grid, NULL, &from, &list, NULL));
    OK(vp_list_size(list, &n, &columns));
    CHECK(n == 56 && columns == 4);
    coordinates = malloc(3 * n * sizeof *coordinates);
    listed = malloc(columns * n * sizeof *listed);
    OK(vp_list_read(list, 0, n, coordinates, listed));
    for (i = 0; i < n; ++i) {
        const int32_t* p = coordinates + 3 * i;
        CHECK(memcmp(listed + 4 * i, dense[(p[2] * N + p[1]) * N + p[0]], 4 * sizeof(float)) == 0);
        sum += p[0] + p[1] + p[2];
    }
    CHECK(sum == 3 * 56 * 3 / 2); /* the voxels lie around the middle */
    OK(vp_list_read(list, n - 1, 1, coordinates, NULL));
    CHECK(coordinates[0] == 3 && coordinates[1] == 3 && coordinates[2] == 3); /* the last in Morton order */
    vp_list_destroy(list);
    free(coordinates);
    free(listed);

    { /* A number a triangle: a side's two triangles in the same voxel. */
        float numbers[12];
        const int side = (1 * N + 1) * N + 0;
        float least[VOXELS], most[VOXELS], last[VOXELS], all[VOXELS];
        for (i = 0; i < 12; ++i) numbers[i] = (float)i;
        memset(&from, 0, sizeof from);
        from.struct_size = sizeof from;
        from.per = VP_ROWS_PER_TRIANGLE;
        from.columns = 1;
        from.values = numbers;
        from.num_rows = 12;
        from.blend = VP_BLEND_MIN;
        out = packed(VP_TYPE_FLOAT32, least, sizeof least);
        OK(vp_surface_values(context, cube, &grid, NULL, &from, NULL, &out, NULL));
        from.blend = VP_BLEND_MAX;
        out.data = most;
        OK(vp_surface_values(context, cube, &grid, NULL, &from, NULL, &out, NULL));
        from.blend = VP_BLEND_LAST;
        out.data = last;
        OK(vp_surface_values(context, cube, &grid, NULL, &from, NULL, &out, NULL));
        from.blend = VP_BLEND_SUM;
        out.data = all;
        OK(vp_surface_values(context, cube, &grid, NULL, &from, NULL, &out, NULL));
        CHECK(least[side] == 8 && most[side] == 9 && last[side] == 9 && all[side] == 17); /* on the diagonal */
        CHECK(least[(1 * N + 1) * N + 1] == 0);
    }
}

static void solid_list(vp_context* context, const vp_mesh* cube) {
    const vp_grid grid = unit_grid(N);
    vp_list* list = NULL;
    uint64_t n = 0;
    int32_t coordinates[24];
    OK(vp_solid_list(context, cube, &grid, NULL, &list, NULL));
    OK(vp_list_size(list, &n, NULL));
    CHECK(n == 8);
    OK(vp_list_read(list, 0, 8, coordinates, NULL));
    CHECK(coordinates[0] == 1 && coordinates[23] == 2);
    vp_list_destroy(list);
}

static void distances(vp_context* context, const vp_mesh* cube) {
    const vp_grid grid = unit_grid(N);
    float field[VOXELS], corners[(N + 1) * (N + 1) * (N + 1)], at[2];
    int64_t nearest[VOXELS], nearest_at[2];
    const float points[2][3] = {{2, 2, 2}, {0.75f, 2, 9}};
    const vp_array out = packed(VP_TYPE_FLOAT32, field, sizeof field);
    const vp_array out_corners = packed(VP_TYPE_FLOAT32, corners, sizeof corners);
    const vp_array out_nearest = packed(VP_TYPE_INT64, nearest, sizeof nearest);
    vp_distance_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    OK(vp_distance(context, cube, &grid, NULL, &out, &out_nearest, NULL));
    CHECK(field[(1 * N + 1) * N + 1] == -0.75f);
    CHECK(fabsf(field[0] - 0.25f * sqrtf(3.0f)) < 1e-6f);
    CHECK(nearest[(1 * N + 1) * N + 0] == 8 || nearest[(1 * N + 1) * N + 0] == 9);
    options.is_unsigned = 1;
    options.band = 0.5;
    OK(vp_distance(context, cube, &grid, &options, &out, &out_nearest, NULL));
    CHECK(field[(1 * N + 1) * N + 1] == 0.5f && nearest[(1 * N + 1) * N + 1] == -1); /* beyond the band */
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.is_whole = 1;
    options.at_corners = 1;
    OK(vp_distance(context, cube, &grid, &options, &out_corners, NULL, NULL));
    CHECK(corners[(2 * (N + 1) + 2) * (N + 1) + 2] == -1.25f); /* the cube's middle */
    CHECK(fabsf(corners[0] - 0.75f * sqrtf(3.0f)) < 1e-6f);
    OK(vp_distance_at(context, cube, &grid, NULL, &points[0][0], 2, 0, at, nearest_at, NULL));
    CHECK(at[0] == -1.25f && at[1] == 5.75f && nearest_at[1] >= 2 && nearest_at[1] <= 3);
}

static void fractions(vp_context* context, const vp_mesh* cube) {
    const vp_grid grid = unit_grid(N);
    float field[VOXELS];
    const vp_array out = packed(VP_TYPE_FLOAT32, field, sizeof field);
    vp_counters counters;
    memset(&counters, 0, sizeof counters);
    counters.struct_size = sizeof counters;
    OK(vp_fractions(context, cube, &grid, NULL, &out, &counters));
    CHECK(field[0] == 0.015625f && field[(1 * N + 1) * N + 0] == 0.25f && field[(1 * N + 1) * N + 1] == 1.0f);
    CHECK(counters.volume == 15.625 && counters.open_edges == 0);
}

/* Two cubes as parts: the walls of the first lie between the centres of voxels 0 and 1, and of 2 and 3. */
static void links(vp_context* context) {
    static const uint64_t parts[2] = {0, 12};
    float positions[16][3], q[LINKS * VOXELS];
    uint32_t triangles[24][3];
    const vp_grid grid = unit_grid(N);
    vp_link_options options;
    vp_counters counters;
    vp_mesh* both;
    vp_links* found = NULL;
    uint64_t n = 0, i, crossed = 0;
    uint32_t neighbours = 0, link, checked = 0;
    int32_t coordinates[3 * VOXELS], part[LINKS * VOXELS], direction[3], back[3];
    int64_t triangle[LINKS * VOXELS];
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    memset(&counters, 0, sizeof counters);
    counters.struct_size = sizeof counters;
    add_cube(positions, triangles, 0, 0.75f, 3.25f);
    add_cube(positions, triangles, 1, 9.0f, 10.0f); /* beyond the grid */
    both = make_mesh(context, positions, 16, triangles, 24, parts, 2);
    OK(vp_links_create(context, both, &grid, NULL, &found, &counters));
    OK(vp_links_size(found, &n, &neighbours));
    CHECK(neighbours == 18 && n == counters.voxels && n > 8);
    vp_links_destroy(found);
    options.neighbours = LINKS;
    OK(vp_links_create(context, both, &grid, &options, &found, &counters));
    OK(vp_links_size(found, &n, &neighbours));
    CHECK(neighbours == LINKS && n == VOXELS); /* every voxel has a neighbour across a wall */
    OK(vp_links_read(found, 0, n, coordinates, q, triangle, part));
    for (i = 0; i < n; ++i)
        for (link = 0; link < LINKS; ++link) {
            const uint64_t at = LINKS * i + link;
            const int32_t* const p = &coordinates[3 * i];
            OK(vp_link_direction((int32_t)link, direction));
            OK(vp_link_direction((int32_t)(link ^ 1u), back));
            CHECK(direction[0] == -back[0] && direction[1] == -back[1] && direction[2] == -back[2]);
            crossed += q[at] > 0;
            CHECK(q[at] > 0 ? part[at] == 0 && triangle[at] >= 0 && triangle[at] < 12
                            : q[at] == -1 && part[at] == -1 && triangle[at] == -1);
            if (p[1] != 1 || p[2] != 1 || direction[1] != 0 || direction[2] != 0) continue;
            ++checked; /* along x through the cube */
            CHECK(q[at] == (p[0] == 0 && direction[0] > 0   ? 0.25f
                            : p[0] == 1 && direction[0] < 0 ? 0.75f
                            : p[0] == 2 && direction[0] > 0 ? 0.75f
                            : p[0] == 3 && direction[0] < 0 ? 0.25f
                                                            : -1.0f));
            if (q[at] == 0.25f && p[0] == 0) CHECK(triangle[at] == 8 || triangle[at] == 9);
        }
    CHECK(checked == 8 && crossed == counters.fragments);
    OK(vp_links_read(found, n - 1, 1, coordinates, NULL, NULL, NULL));
    CHECK(coordinates[0] == N - 1 && coordinates[1] == N - 1 && coordinates[2] == N - 1);
    vp_links_destroy(found);
    vp_mesh_destroy(both);
}

static void grids(vp_context* context, const vp_mesh* cube) {
    static const uint64_t extent[3] = {10, 20, 30};
    static const double size[3] = {0.5, 0.5, 0.25};
    vp_grid grid = unit_grid(1), part;
    uint8_t whole[5 * 5 * 5], half[3 * 5 * 2];
    vp_array out = packed(VP_TYPE_UINT8, whole, sizeof whole);
    int i, j, k;
    OK(vp_grid_fit(cube, extent, &grid));
    CHECK(grid.extent[0] == 10 && grid.extent[1] == 20 && grid.extent[2] == 30);
    CHECK(grid.voxel_size[0] > 0.25 && grid.voxel_size[0] < 0.2502);
    OK(vp_grid_fit_voxel_size(cube, size, 1, &grid));
    CHECK(grid.origin[0] == 0.0 && grid.extent[0] == 8 && grid.origin[2] == 0.5 && grid.extent[2] == 12);
    OK(vp_grid_fit_longest(cube, 5, &grid));
    CHECK(grid.extent[0] == 5 && grid.extent[2] == 5);
    /* A part is that part of the whole. */
    OK(vp_surface(context, cube, &grid, NULL, &out, NULL));
    part = grid;
    part.extent[0] = 3;
    part.offset[0] = 2;
    part.extent[2] = 2;
    part.offset[2] = 1;
    out = packed(VP_TYPE_UINT8, half, sizeof half);
    OK(vp_surface(context, cube, &part, NULL, &out, NULL));
    for (k = 0; k < 2; ++k)
        for (j = 0; j < 5; ++j)
            for (i = 0; i < 3; ++i) CHECK(half[(k * 5 + j) * 3 + i] == whole[((k + 1) * 5 + j) * 5 + i + 2]);
}

/* A program may ask for the GPU anywhere: without one it is told so, and has the CPU. */
static void other_backend(void) {
    vp_context* context = NULL;
    const vp_code code = vp_context_create(VP_ABI_VERSION, VP_BACKEND_CUDA, 1, &context);
    CHECK(code == VP_OK || code == VP_ERROR_NO_BACKEND);
    CHECK(code == VP_OK ? context != NULL : context == NULL && strstr(vp_last_message(), "VP_BACKEND_CUDA") != NULL);
    vp_context_destroy(context);
}

int main(int argc, char** argv) {
    const int on_cuda = argc == 2 && strcmp(argv[1], "cuda") == 0;
    float positions[8][3];
    uint32_t triangles[12][3];
    vp_context* context = NULL;
    vp_mesh* cube;
    vp_code code;
    other_backend();
    code = vp_context_create(VP_ABI_VERSION, on_cuda ? VP_BACKEND_CUDA : VP_BACKEND_CPU, 2, &context);
    if (on_cuda && code == VP_ERROR_NO_BACKEND && failures == 0) {
        printf("skipped: no device (%s)\n", vp_last_message());
        return 77;
    }
    OK(code);
    if (code != VP_OK) return 1;
    CHECK(vp_abi_version() == VP_ABI_VERSION && strlen(vp_version()) >= 5);
    add_cube(positions, triangles, 0, 0.75f, 3.25f);
    cube = make_mesh(context, positions, 8, triangles, 12, NULL, 0);
    surfaces_and_solids(context, cube);
    rules_and_repairs(context);
    values(context, cube, positions);
    solid_list(context, cube);
    distances(context, cube);
    fractions(context, cube);
    links(context);
    grids(context, cube);
    vp_mesh_destroy(cube);
    vp_context_destroy(context);
    vp_mesh_destroy(NULL);
    vp_context_destroy(NULL);
    vp_list_destroy(NULL);
    vp_links_destroy(NULL);
    printf("%d failures\n", failures);
    return failures != 0;
}
