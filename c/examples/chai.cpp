// A height field as an object of a CHAI3D-like world, from a callback.
//
//   c++ -std=c++11 -Ic/include c/examples/chai.cpp -Ltarget/release -lhapterra_c
//
// With CHAI3D itself, include "chai3d.h" instead of the stand-in, and store the results of
// computeLocalInteraction in the interaction recorder of the object.

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "chai_stand_in.h"
#include "hapterra.h"

class HeightField : public cGenericObject {
  public:
    HeightField(uint32_t columns, uint32_t rows, double cell_mm, HapterraRead read, void *user)
        : terrain(hapterra_terrain_new()), contact(hapterra_contact_new()) {
        HapterraSurface surface;
        hapterra_surface_default(&surface);
        surface.shading = HAPTERRA_SHADING_SMOOTH;
        if (hapterra_terrain_set_reader(terrain, read, user, columns, rows, cell_mm) ||
            hapterra_contact_begin(contact, terrain, &surface, 1, 1000)) {
            std::runtime_error error(std::string(hapterra_terrain_message(terrain)) +
                                     hapterra_contact_message(contact));
            end();
            throw error;
        }
    }
    HeightField(const HeightField &) = delete;
    HeightField &operator=(const HeightField &) = delete;
    ~HeightField() override { end(); }

    // Called in the haptics thread only. An error has no force.
    cVector3d computeLocalInteraction(const cVector3d &tool, cVector3d &proxy) override {
        const double hip_mm[3] = {1e3 * tool.x(), 1e3 * tool.y(), 1e3 * tool.z()};
        HapterraStep step;
        if (hapterra_contact_step(contact, hip_mm, &step) != HAPTERRA_STATUS_OK) {
            return cVector3d();
        }
        proxy = cVector3d(1e-3 * step.proxy_mm[0], 1e-3 * step.proxy_mm[1],
                          1e-3 * step.proxy_mm[2]);
        return cVector3d(step.force_n[0], step.force_n[1], step.force_n[2]);
    }

  private:
    void end() {
        hapterra_contact_free(contact);
        hapterra_terrain_free(terrain);
    }

    HapterraTerrain *terrain;
    HapterraContact *contact;
};

// Waves, 3 mm high, over 100,000 × 100,000 samples, too many for the memory.
extern "C" uint32_t read_waves(void *user, uint32_t column, uint32_t row, uint32_t columns,
                               uint32_t rows, double *heights) {
    const double height_mm = *static_cast<double *>(user);
    for (uint32_t y = 0; y < rows; y++) {
        for (uint32_t x = 0; x < columns; x++) {
            *heights++ = height_mm * std::sin(0.1 * (column + x)) * std::cos(0.1 * (row + y));
        }
    }
    return 0;
}

int main() {
    double height_mm = 3.0;
    HeightField waves(100000, 100000, 0.5, read_waves, &height_mm);
    cWorld world;
    world.addChild(&waves);
    cVector3d force, proxy;
    double most = 0.0;
    for (int tick = 0; tick < 2000; tick++) {
        // Down from 10 mm, then sideways.
        const double t = 1e-3 * tick;
        const double height = std::fmax(0.010 - 0.020 * t, -0.002);
        force = world.computeInteractionForces(cVector3d(20.0 + 0.05 * t, 30.0, height), proxy);
        most = std::fmax(most, force.z());
    }
    std::printf("at most %.3f N; the proxy at %.4f m\n", most, proxy.z());
    return most > 0.5 && most < 8.5 ? 0 : 1;
}
