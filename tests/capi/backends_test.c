/* SPDX-FileCopyrightText: 2026 The VoxelPipe authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Every call of the C API on the CPU and on the GPU: the same bytes, counters and codes. Ends with 77 where there is no
 * device. */
#include <voxelpipe.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RINGS = 8, SECTORS = 12, BODY_VERTICES = 2 + (RINGS - 1) * SECTORS, BODY_TRIANGLES = 2 * SECTORS * (RINGS - 1) };
enum { BODIES = 2, VERTICES = BODIES * BODY_VERTICES, TRIANGLES = BODIES * BODY_TRIANGLES, POINTS = 100, COLUMNS = 4 };

/* What the calls of one backend gave, one after the other. */
typedef struct record {
    unsigned char* bytes;
    size_t size, room;
    struct {
        const char* name;
        size_t end;
    } entries[4096];
    int num_entries;
} record;

static void add(record* to, const char* name, const void* data, size_t size) {
    if (to->size + size > to->room) {
        to->room = 2 * (to->size + size);
        to->bytes = realloc(to->bytes, to->room);
        if (to->bytes == NULL) abort();
    }
    if (size != 0) memcpy(to->bytes + to->size, data, size);
    to->size += size;
    if (to->num_entries == 4096) abort();
    to->entries[to->num_entries].name = name;
    to->entries[to->num_entries++].end = to->size;
}

static float random_number(void) {
    static uint32_t state = 1;
    state = state * 1664525u + 1013904223u;
    return (float)(state >> 8) / 16777216.0f;
}

/* Two closed bodies that overlap, rough spheres. */
static float positions[VERTICES][3];
static uint32_t triangles[TRIANGLES][3];
static float per_vertex[VERTICES][COLUMNS], per_triangle[TRIANGLES][COLUMNS], points[POINTS][3];

static void make_bodies(void) {
    int b, r, s, a, i, n = 0;
    for (b = 0; b < BODIES; ++b) {
        const uint32_t first = (uint32_t)(b * BODY_VERTICES), last = first + BODY_VERTICES - 1;
        for (i = 0; i < BODY_VERTICES; ++i) {
            const int ring = i == 0 ? 0 : i == BODY_VERTICES - 1 ? RINGS : 1 + (i - 1) / SECTORS;
            const double polar = 3.14159265358979 * ring / RINGS;
            const double turn = 2 * 3.14159265358979 * ((i + SECTORS - 1) % SECTORS) / SECTORS;
            const double radius = 3.0 + 0.5 * random_number();
            float* const p = positions[first + (uint32_t)i];
            p[0] = (float)(5.0 + 2.3 * b + radius * sin(polar) * cos(turn));
            p[1] = (float)(5.1 + radius * sin(polar) * sin(turn));
            p[2] = (float)(4.9 + radius * cos(polar));
        }
        for (s = 0; s < SECTORS; ++s) {
            const uint32_t t = (uint32_t)((s + 1) % SECTORS), here = (uint32_t)s;
            const uint32_t below = last - SECTORS;
            const uint32_t caps[2][3] = {{first, first + 1 + here, first + 1 + t}, {last, below + t, below + here}};
            memcpy(triangles[n], caps, sizeof caps);
            n += 2;
            for (r = 0; r < RINGS - 2; ++r) {
                const uint32_t up = first + 1 + (uint32_t)(r * SECTORS), low = up + SECTORS;
                const uint32_t sides[2][3] = {{up + here, low + here, low + t}, {up + here, low + t, up + t}};
                memcpy(triangles[n], sides, sizeof sides);
                n += 2;
            }
        }
    }
    for (i = 0; i < VERTICES; ++i)
        for (a = 0; a < COLUMNS; ++a) per_vertex[i][a] = 10 * random_number() - 5;
    for (i = 0; i < TRIANGLES; ++i)
        for (a = 0; a < COLUMNS; ++a) per_triangle[i][a] = 10 * random_number() - 5;
    for (i = 0; i < POINTS; ++i)
        for (a = 0; a < 3; ++a) points[i][a] = 14 * random_number() - 2;
    points[7][1] = NAN; /* is refused */
}

static vp_mesh* make_mesh(vp_context* context, uint64_t num_triangles) {
    static const uint64_t parts[BODIES] = {0, BODY_TRIANGLES};
    vp_mesh_desc desc;
    vp_mesh* mesh = NULL;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.positions = &positions[0][0];
    desc.num_vertices = VERTICES;
    desc.triangles = triangles;
    desc.num_triangles = num_triangles;
    desc.first_of_part = parts;
    desc.num_parts = num_triangles < BODY_TRIANGLES ? 1 : BODIES;
    if (vp_mesh_create(context, &desc, &mesh) != VP_OK) {
        printf("a mesh: %s\n", vp_last_message());
        exit(1);
    }
    return mesh;
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

static vp_counters zero_counters(void) {
    vp_counters counters;
    memset(&counters, 0, sizeof counters);
    counters.struct_size = sizeof counters;
    return counters;
}

/* A call with its code, its counters and what it has written. Memory begins as 0xa5: a call that fails writes nothing. */
#define CALL(name, call, data, bytes)                                                                                  \
    do {                                                                                                               \
        vp_counters counters = zero_counters();                                                                        \
        vp_code code;                                                                                                  \
        memset(data, 0xa5, bytes);                                                                                     \
        code = (call);                                                                                                 \
        add(to, name ": code", &code, sizeof code);                                                                    \
        add(to, name ": message", vp_last_message(), strlen(vp_last_message()));                                       \
        add(to, name ": counters", &counters, sizeof counters);                                                        \
        add(to, name, data, bytes);                                                                                    \
    } while (0)

static void add_list(record* to, const char* name, vp_code code, vp_list** made) {
    vp_list* const list = *made; /* which the call has written by now */
    uint64_t n = 0;
    uint32_t columns = 0;
    add(to, name, &code, sizeof code);
    if (code != VP_OK) return;
    if (vp_list_size(list, &n, &columns) != VP_OK) abort();
    add(to, name, &n, sizeof n);
    if (n != 0) {
        int32_t* const where = malloc(3 * n * sizeof *where);
        float* const values = malloc((columns + 1) * n * sizeof *values);
        if (vp_list_read(list, 0, n, where, columns != 0 ? values : NULL) != VP_OK) abort();
        add(to, name, where, 3 * n * sizeof *where);
        add(to, name, values, columns * n * sizeof *values);
        free(where);
        free(values);
    }
    vp_list_destroy(list);
}

enum { MOST = 16 * 12 * 12 };

static void surfaces(record* to, vp_context* context, const vp_mesh* mesh, const vp_grid* grid, size_t voxels) {
    static uint8_t mask[MOST];
    static uint32_t words[MOST];
    static float dense[MOST * COLUMNS];
    const float background[COLUMNS] = {1, 2, 3, 4};
    vp_surface_options options;
    vp_rows rows;
    vp_list* list = NULL;
    memset(&options, 0, sizeof options);
    memset(&rows, 0, sizeof rows);
    options.struct_size = sizeof options;
    rows.struct_size = sizeof rows;
    rows.columns = COLUMNS;
    for (; options.coverage <= VP_COVERAGE_DIAGONAL; ++options.coverage) {
        const size_t bytes = (size_t)((grid->extent[0] + 31) / 32 * grid->extent[1] * grid->extent[2]) * 4;
        const vp_array out = packed(VP_TYPE_UINT8, mask, voxels), out_words = packed(VP_TYPE_BITS, words, bytes);
        CALL("surface", vp_surface(context, mesh, grid, &options, &out, &counters), mask, voxels);
        CALL("surface, bits", vp_surface(context, mesh, grid, &options, &out_words, &counters), words, bytes);
        add_list(to, "surface, list", vp_surface_list(context, mesh, grid, &options, NULL, &list, NULL), &list);
    }
    options.coverage = VP_COVERAGE_CONSERVATIVE;
    for (rows.blend = 0; rows.blend <= VP_BLEND_LAST; ++rows.blend) {
        const vp_array out = packed(VP_TYPE_FLOAT32, dense, voxels * COLUMNS * sizeof(float));
        rows.per = rows.blend % 2;
        rows.values = rows.per == VP_ROWS_PER_TRIANGLE ? per_triangle[0] : per_vertex[0];
        rows.num_rows = rows.per == VP_ROWS_PER_TRIANGLE ? TRIANGLES : VERTICES;
        CALL("values", vp_surface_values(context, mesh, grid, &options, &rows, background, &out, &counters), dense,
             voxels * COLUMNS * sizeof(float));
        add_list(to, "values, list", vp_surface_list(context, mesh, grid, &options, &rows, &list, NULL), &list);
    }
}

static void solids(record* to, vp_context* context, const vp_mesh* mesh, const vp_grid* grid, size_t voxels) {
    static const vp_solid_options all[] = {
        {sizeof(vp_solid_options), VP_FILL_NONZERO, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_NONE, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_EVEN_ODD, VP_BODIES_ALL, VP_EXTENT_OUTER, VP_REPAIR_NONE, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_POSITIVE, VP_BODIES_EACH, VP_EXTENT_INNER, VP_REPAIR_NONE, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_EVEN_ODD, VP_BODIES_EACH, VP_EXTENT_CENTRE, VP_REPAIR_NONE, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_NONZERO, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_CLOSE_HOLES, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_NONZERO, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_EXTERIOR, 1, 0},
        {sizeof(vp_solid_options), VP_FILL_NONZERO, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_VOTE, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_NONZERO, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_WINDING, 0, 0},
        {sizeof(vp_solid_options), VP_FILL_EVEN_ODD, VP_BODIES_ALL, VP_EXTENT_CENTRE, VP_REPAIR_WINDING, 0, 0}, /* fails */
    };
    static uint8_t mask[MOST];
    const vp_array out = packed(VP_TYPE_UINT8, mask, voxels);
    vp_list* list = NULL;
    size_t i;
    for (i = 0; i < sizeof all / sizeof all[0]; ++i) {
        CALL("solid", vp_solid(context, mesh, grid, &all[i], &out, &counters), mask, voxels);
        add_list(to, "solid, list", vp_solid_list(context, mesh, grid, &all[i], &list, NULL), &list);
    }
}

static void fields(record* to, vp_context* context, const vp_mesh* mesh, const vp_grid* grid, size_t voxels) {
    static float field[2 * MOST], at[POINTS];
    static int64_t nearest[2 * MOST], nearest_at[POINTS];
    const size_t corners = (size_t)((grid->extent[0] + 1) * (grid->extent[1] + 1) * (grid->extent[2] + 1));
    vp_array out = packed(VP_TYPE_FLOAT32, field, voxels * sizeof(float));
    vp_array numbers = packed(VP_TYPE_INT64, nearest, voxels * sizeof(int64_t));
    vp_distance_options options;
    vp_fraction_options fraction;
    memset(&options, 0, sizeof options);
    memset(&fraction, 0, sizeof fraction);
    options.struct_size = sizeof options;
    fraction.struct_size = sizeof fraction;
    CALL("distance", vp_distance(context, mesh, grid, &options, &out, NULL, &counters), field, voxels * sizeof(float));
    CALL("distance, nearest", vp_distance(context, mesh, grid, &options, &out, &numbers, &counters), nearest,
         voxels * sizeof(int64_t));
    options.bodies = VP_BODIES_EACH;
    options.at_corners = options.is_whole = 1;
    out = packed(VP_TYPE_FLOAT32, field, corners * sizeof(float));
    CALL("distance, corners", vp_distance(context, mesh, grid, &options, &out, NULL, &counters), field,
         corners * sizeof(float));
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    CALL("distances of points",
         vp_distance_at(context, mesh, grid, &options, points[0], POINTS, 0, at, nearest_at, &counters), at, sizeof at);
    add(to, "nearest of points", nearest_at, sizeof nearest_at);
    options.is_unsigned = 1;
    CALL("distances of points alone",
         vp_distance_at(context, mesh, grid, &options, points[0], POINTS, 0, at, NULL, &counters), at, sizeof at);
    out = packed(VP_TYPE_FLOAT32, field, voxels * sizeof(float));
    for (; fraction.axis < 3; ++fraction.axis)
        CALL("fractions", vp_fractions(context, mesh, grid, &fraction, &out, &counters), field, voxels * sizeof(float));
}

static void links(record* to, vp_context* context, const vp_mesh* mesh, const vp_grid* grid) {
    vp_link_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    for (options.neighbours = 18; options.neighbours <= 26; options.neighbours += 8) {
        vp_links* found = NULL;
        uint64_t n = 0;
        size_t all;
        const vp_code code = vp_links_create(context, mesh, grid, &options, &found, NULL);
        add(to, "links: code", &code, sizeof code);
        if (code != VP_OK || vp_links_size(found, &n, NULL) != VP_OK) continue;
        all = (size_t)n * (size_t)options.neighbours;
        {
            int32_t* const where = malloc(3 * n * sizeof *where + 1);
            int32_t* const part = malloc(all * sizeof *part + 1);
            int64_t* const triangle = malloc(all * sizeof *triangle + 1);
            float* const q = malloc(all * sizeof *q + 1);
            if (vp_links_read(found, 0, n, where, q, triangle, part) != VP_OK) abort();
            add(to, "links: voxels", where, 3 * n * sizeof *where);
            add(to, "links: q", q, all * sizeof *q);
            add(to, "links: triangles", triangle, all * sizeof *triangle);
            add(to, "links: parts", part, all * sizeof *part);
            free(where);
            free(part);
            free(triangle);
            free(q);
        }
        vp_links_destroy(found);
    }
}

/* Closed bodies, an open one, and nothing; a whole grid and a part of it. */
static void everything(record* to, vp_context* context) {
    static const uint64_t counts[] = {TRIANGLES, BODY_TRIANGLES - 9, 0};
    size_t m;
    int part, a;
    for (m = 0; m < 3; ++m) {
        vp_mesh* const mesh = make_mesh(context, counts[m]);
        for (part = 0; part < 2; ++part) {
            const uint64_t whole[3] = {16, 12, 12}, extent[3] = {9, 12, 7}, offset[3] = {3, 0, 5};
            vp_grid grid;
            size_t voxels;
            memset(&grid, 0, sizeof grid);
            grid.struct_size = sizeof grid;
            for (a = 0; a < 3; ++a) {
                grid.origin[a] = 0.01 * a;
                grid.voxel_size[a] = 0.9;
                grid.whole[a] = whole[a];
                grid.extent[a] = part ? extent[a] : whole[a];
                grid.offset[a] = part ? offset[a] : 0;
            }
            voxels = (size_t)(grid.extent[0] * grid.extent[1] * grid.extent[2]);
            surfaces(to, context, mesh, &grid, voxels);
            solids(to, context, mesh, &grid, voxels);
            fields(to, context, mesh, &grid, voxels);
            links(to, context, mesh, &grid);
        }
        vp_mesh_destroy(mesh);
    }
}

/* What is compared is worth it: closed bodies with an inside, and cut cells that sum to their volume. */
static int are_bodies(vp_context* context) {
    static uint8_t mask[MOST];
    static float field[MOST];
    const vp_array out = packed(VP_TYPE_UINT8, mask, sizeof mask), cells = packed(VP_TYPE_FLOAT32, field, sizeof field);
    vp_mesh* const mesh = make_mesh(context, TRIANGLES);
    vp_counters counters = zero_counters(), of_cells = zero_counters();
    vp_grid grid;
    vp_code code;
    int a;
    memset(&grid, 0, sizeof grid);
    grid.struct_size = sizeof grid;
    for (a = 0; a < 3; ++a) {
        grid.voxel_size[a] = 0.9;
        grid.extent[a] = a == 0 ? 16 : 12;
    }
    code = vp_solid(context, mesh, &grid, NULL, &out, &counters);
    if (code == VP_OK) code = vp_fractions(context, mesh, &grid, NULL, &cells, &of_cells);
    vp_mesh_destroy(mesh);
    return code == VP_OK && counters.open_rows == 0 && counters.max_winding == 2 && counters.voxels > 200 &&
           counters.voxels < 400 && of_cells.open_edges == 0 && of_cells.volume > 300 && of_cells.volume < 600;
}

int main(void) {
    static record cpu, cuda;
    vp_context *on_cpu = NULL, *on_cuda = NULL;
    const vp_code code = vp_context_create(VP_ABI_VERSION, VP_BACKEND_CUDA, 2, &on_cuda);
    int i, failures = 0;
    size_t begin = 0;
    if (code == VP_ERROR_NO_BACKEND && on_cuda == NULL) {
        printf("skipped: no device (%s)\n", vp_last_message());
        return 77;
    }
    if (code != VP_OK || vp_context_create(VP_ABI_VERSION, VP_BACKEND_CPU, 2, &on_cpu) != VP_OK) {
        printf("a context: %s: %s\n", vp_code_name(code), vp_last_message());
        return 1;
    }
    make_bodies();
    if (!are_bodies(on_cpu)) {
        printf("the bodies are not closed\n");
        ++failures;
    }
    everything(&cpu, on_cpu);
    everything(&cuda, on_cuda);
    vp_context_destroy(on_cpu);
    vp_context_destroy(on_cuda);
    if (cpu.num_entries != cuda.num_entries || cpu.num_entries < 1000) ++failures;
    for (i = 0; i < cpu.num_entries && failures < 20; ++i) {
        const size_t end = cpu.entries[i].end;
        if (cuda.entries[i].end != end || memcmp(cpu.bytes + begin, cuda.bytes + begin, end - begin) != 0) {
            printf("other than the CPU's: %s (result %d of %d)\n", cpu.entries[i].name, i, cpu.num_entries);
            ++failures;
            if (cuda.entries[i].end != end) break;
        }
        begin = end;
    }
    printf("%d results, %d bytes: %d failures\n", cpu.num_entries, (int)cpu.size, failures);
    free(cpu.bytes);
    free(cuda.bytes);
    return failures != 0;
}
