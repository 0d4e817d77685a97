/* A mountain from an array, pressed and stroked in C99.
 *
 *   cc -std=c99 -Ic/include c/examples/mountain.c -Ltarget/release -lhapterra_c -lm
 */
#include <math.h>
#include <stdio.h>

#include "hapterra.h"

enum { SIDE = 200 };

static float heights[SIDE * SIDE];

int main(void) {
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            double away = hypot(x - 100.0, y - 100.0);
            heights[y * SIDE + x] = (float)(20.0 * exp(-away * away / 1500.0));
        }
    }
    HapterraTerrain *terrain = hapterra_terrain_new();
    HapterraContact *contact = hapterra_contact_new();
    HapterraSurface surface;
    HapterraStep step;
    uint32_t failed = hapterra_surface_default(&surface);
    surface.static_friction = surface.dynamic_friction = 0.3f;
    failed |= hapterra_terrain_set_f32(terrain, heights, SIDE, SIDE, 0.5,
                                       HAPTERRA_ROW_ORDER_SOUTH_FIRST);
    failed |= hapterra_contact_begin(contact, terrain, &surface, 1, 1000);
    if (failed) {
        fprintf(stderr, "%s%s\n", hapterra_terrain_message(terrain),
                hapterra_contact_message(contact));
        return 1;
    }
    /* From the air to 2 mm below the western slope, and 10 mm east along it. */
    for (int tick = 0; tick <= 1000; tick++) {
        double east = 30.0 + 0.01 * tick;
        double ground = hapterra_terrain_height_mm(terrain, east, 50.0);
        double hip_mm[3] = {east, 50.0, tick == 0 ? ground + 5.0 : ground - 2.0};
        uint32_t status = hapterra_contact_step(contact, hip_mm, &step);
        if (status != HAPTERRA_STATUS_OK) {
            fprintf(stderr, "%s\n", hapterra_contact_message(contact));
            return 1;
        }
        if (tick % 200 == 0) {
            printf("%5.1f mm east: %6.3f %6.3f %6.3f N, state %u\n", east, step.force_n[0],
                   step.force_n[1], step.force_n[2], (unsigned)step.state);
        }
    }
    /* An impossible value is reported. */
    surface.dynamic_friction = -1.0f;
    if (hapterra_contact_set_surface(contact, &surface, 1) != HAPTERRA_STATUS_SURFACE) {
        return 1;
    }
    printf("%s: %s\n", hapterra_error_text(HAPTERRA_STATUS_SURFACE),
           hapterra_contact_message(contact));
    hapterra_contact_free(contact);
    hapterra_terrain_free(terrain);
    return step.state == HAPTERRA_STATE_TOUCHING && step.force_n[2] > 0.0 ? 0 : 1;
}
