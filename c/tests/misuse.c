/* Wrong calls: each returns an error with a text, and changes nothing. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "hapterra.h"

static int failures;

static void expect(uint32_t found, uint32_t expected, const char *what) {
    if (found != expected) {
        printf("%s: status %u, not %u\n", what, (unsigned)found, (unsigned)expected);
        failures++;
    }
}

static void says(const char *message, const char *part) {
    if (strstr(message, part) == NULL) {
        printf("`%s` does not contain `%s`\n", message, part);
        failures++;
    }
}

/* Fails with the number that `user` points to. */
static uint32_t read_fails(void *user, uint32_t column, uint32_t row, uint32_t columns,
                           uint32_t rows, double *heights) {
    (void)column, (void)row, (void)columns, (void)rows, (void)heights;
    return *(uint32_t *)user;
}

static void nulls(void) {
    HapterraTerrain *terrain = hapterra_terrain_new();
    HapterraContact *contact = hapterra_contact_new();
    HapterraSurface surface;
    HapterraStep step;
    double numbers[3] = {0.0, 0.0, 1.0};
    float heights[4] = {0};
    uint8_t materials[4] = {0};
    const uint32_t null = HAPTERRA_STATUS_NULL_POINTER;

    expect(hapterra_surface_default(NULL), null, "surface_default");
    expect(hapterra_surface_default(&surface), 0, "surface_default");
    expect(hapterra_terrain_set_f32(NULL, heights, 2, 2, 1.0, 0), null, "set_f32");
    expect(hapterra_terrain_set_f32(terrain, NULL, 2, 2, 1.0, 0), null, "set_f32, heights");
    expect(hapterra_terrain_set_f64(NULL, numbers, 2, 2, 1.0, 0), null, "set_f64");
    expect(hapterra_terrain_set_f64(terrain, NULL, 2, 2, 1.0, 0), null, "set_f64, heights");
    expect(hapterra_terrain_set_reader(NULL, read_fails, NULL, 2, 2, 1.0), null, "set_reader");
    expect(hapterra_terrain_set_reader(terrain, NULL, NULL, 2, 2, 1.0), null, "set_reader, read");
    expect(hapterra_terrain_set_height_scale(NULL, 1.0), null, "set_height_scale");
    expect(hapterra_terrain_set_height_scale(terrain, 1.0), HAPTERRA_STATUS_NOT_BEGUN,
           "set_height_scale without heights");
    expect(hapterra_terrain_set_tip(NULL, 1.0), null, "set_tip");
    expect(hapterra_terrain_set_tip(terrain, 1.0), HAPTERRA_STATUS_NOT_BEGUN,
           "set_tip without heights");
    expect(hapterra_terrain_set_materials(NULL, materials, 4, 0), null, "set_materials");
    expect(hapterra_contact_begin(NULL, terrain, &surface, 1, 1000), null, "begin");
    expect(hapterra_contact_begin(contact, NULL, &surface, 1, 1000), null, "begin, terrain");
    expect(hapterra_contact_begin(contact, terrain, &surface, 1, 1000),
           HAPTERRA_STATUS_NOT_BEGUN, "begin without heights");
    expect(hapterra_contact_step(contact, numbers, &step), HAPTERRA_STATUS_NOT_BEGUN, "step");
    expect(hapterra_contact_set_surface(contact, &surface, 1), HAPTERRA_STATUS_NOT_BEGUN,
           "set_surface");

    expect(hapterra_terrain_set_f32(terrain, heights, 2, 2, 1.0, 0), 0, "set_f32");
    expect(hapterra_terrain_set_materials(terrain, NULL, 4, 0), null, "set_materials, materials");
    expect(hapterra_contact_begin(contact, terrain, NULL, 1, 1000), null, "begin, surfaces");
    expect(hapterra_contact_begin(contact, terrain, &surface, 1, 1000), 0, "begin");
    expect(hapterra_contact_set_surface(NULL, &surface, 1), null, "set_surface");
    expect(hapterra_contact_set_surface(contact, NULL, 1), null, "set_surface, surfaces");
    expect(hapterra_contact_step(NULL, numbers, &step), null, "step");
    expect(hapterra_contact_step(contact, NULL, &step), null, "step, hip");
    expect(hapterra_contact_step(contact, numbers, NULL), null, "step, step");
    expect(hapterra_contact_run(NULL, numbers, 1, &step, NULL), null, "run");
    says(hapterra_contact_message(contact), "null");
    if (hapterra_terrain_message(NULL) || hapterra_contact_message(NULL)) {
        failures++;
    }
    if (hapterra_terrain_height_mm(NULL, 0.5, 0.5) == 0.0) {
        failures++;
    }
    hapterra_terrain_free(terrain);
    /* The contact still has its terrain. */
    expect(hapterra_contact_step(contact, numbers, &step), 0, "step");
    hapterra_contact_free(contact);
    hapterra_contact_free(NULL);
    hapterra_terrain_free(NULL);
    hapterra_free(NULL, 8);
}

static void numbers(void) {
    HapterraTerrain *terrain = hapterra_terrain_new();
    HapterraContact *contact = hapterra_contact_new();
    HapterraSurface surfaces[17];
    HapterraStep steps[3];
    float heights[9] = {0}, tall[4] = {0.0f, 1e12f, 0.0f, 0.0f};
    double path[9] = {1.0, 1.0, 2.0, 1.0, 1.0, -1.0, 1.0, 0.0, 1.0};
    size_t done = 7;
    uint8_t materials[9] = {0, 0, 0, 0, 3, 0, 0, 0, 0};
    uint32_t error = 0;

    for (int i = 0; i < 17; i++) {
        hapterra_surface_default(&surfaces[i]);
    }
    expect(hapterra_terrain_set_f32(terrain, heights, 1, 9, 1.0, 0), HAPTERRA_STATUS_SIZE, "1 x 9");
    expect(hapterra_terrain_set_f32(terrain, heights, 4000000000u, 4000000000u, 1.0, 0),
           HAPTERRA_STATUS_POINTER, "more than memory");
    expect(hapterra_terrain_set_f32(terrain, heights, 3, 3, -1.0, 0), HAPTERRA_STATUS_SCALE, "cell");
    expect(hapterra_terrain_set_f32(terrain, heights, 3, 3, 1.0, 2), HAPTERRA_STATUS_CHOICE, "order");
    says(hapterra_terrain_message(terrain), "row order is 2");
    expect(hapterra_terrain_set_f32(terrain, (const float *)((const char *)heights + 1), 2, 2, 1.0, 0),
           HAPTERRA_STATUS_POINTER, "not aligned");
    expect(hapterra_terrain_set_f32(terrain, tall, 2, 2, 1.0, 0), 0, "tall");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 1, 1000), HAPTERRA_STATUS_HEIGHTS,
           "begin, tall");
    expect(hapterra_terrain_set_f32(terrain, heights, 3, 3, 1.0, 0), 0, "set_f32");
    expect(hapterra_terrain_set_tip(terrain, -1.0), HAPTERRA_STATUS_TIP, "tip below 0");
    expect(hapterra_terrain_set_tip(terrain, 8.5), HAPTERRA_STATUS_TIP, "tip of 8.5 cells");
    says(hapterra_terrain_message(terrain), "a tip of 8.5 mm: 8.5 cells of 1 mm, where 0 to 8");
    expect(hapterra_terrain_height_mm(terrain, 1.5, 1.5) == 0.0, 1, "a point still");
    expect(hapterra_terrain_set_tip(terrain, 2.0), 0, "set_tip");
    expect(hapterra_terrain_height_mm(terrain, 1.5, 1.5) == 2.0, 1, "centre of the ball");
    expect(hapterra_terrain_set_tip(terrain, 0.0), 0, "set_tip, 0");
    expect(hapterra_terrain_height_mm(terrain, 1.5, 1.5) == 0.0, 1, "a point again");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 0, 1000), HAPTERRA_STATUS_SURFACE,
           "no surface");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 17, 1000), HAPTERRA_STATUS_SURFACE,
           "17 surfaces");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 1, 1500), HAPTERRA_STATUS_RATE, "rate");
    surfaces[0].texture = 3;
    expect(hapterra_contact_begin(contact, terrain, surfaces, 1, 1000), HAPTERRA_STATUS_CHOICE,
           "texture");
    surfaces[0].texture = HAPTERRA_TEXTURE_NONE;
    expect(hapterra_terrain_set_materials(terrain, materials, 8, 0), HAPTERRA_STATUS_SIZE,
           "8 materials");
    expect(hapterra_terrain_set_materials(terrain, materials, 9, 0), 0, "materials");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 3, 1000), HAPTERRA_STATUS_MATERIAL,
           "material 3 of 3");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 4, 1000), 0, "material 3 of 4");

    /* The third position of the path is not a number. */
    path[7] = path[7] / path[7];
    expect(hapterra_contact_run(contact, path, 3, steps, &done), HAPTERRA_STATUS_PLACE, "run");
    expect((uint32_t)done, 2, "steps done");
    expect(steps[1].state, HAPTERRA_STATE_TOUCHING, "state");
    expect(steps[1].force_n[2] == 0.5, 1, "force");

    expect(hapterra_terrain_set_reader(terrain, read_fails, &error, 9, 9, 1.0), 0, "set_reader");
    expect(hapterra_contact_begin(contact, terrain, surfaces, 1, 1000), 0, "begin");
    error = 42;
    expect(hapterra_contact_step(contact, path, steps), HAPTERRA_STATUS_UNREAD, "unread");
    says(hapterra_contact_message(contact), "42");
    for (uint32_t status = 0; status <= HAPTERRA_STATUS_TIP + 1; status++) {
        says(hapterra_error_text(status), " ");
    }
    says(hapterra_version(), ".");
    hapterra_terrain_free(terrain);
    hapterra_contact_free(contact);
}

int main(void) {
    nulls();
    numbers();
    void *memory = hapterra_alloc(100);
    if (memory == NULL || (uintptr_t)memory % 16 != 0 || hapterra_alloc(0) != NULL ||
        hapterra_alloc(SIZE_MAX) != NULL) {
        failures++;
    }
    hapterra_free(memory, 100);
    return failures != 0;
}
