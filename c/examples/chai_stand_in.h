/* Replaces the few parts of CHAI3D that chai.cpp uses, so that it can be built and run without
 * CHAI3D: a vector, an object of the world that a tool touches, and the loop of a tool. Names and
 * meaning are CHAI3D's; lengths are metres. */
#ifndef CHAI_STAND_IN_H
#define CHAI_STAND_IN_H

#include <vector>

struct cVector3d {
    double v[3];

    cVector3d(double x = 0.0, double y = 0.0, double z = 0.0) : v{x, y, z} {}
    double x() const { return v[0]; }
    double y() const { return v[1]; }
    double z() const { return v[2]; }
    void add(const cVector3d &other) {
        for (int i = 0; i < 3; i++) {
            v[i] += other.v[i];
        }
    }
};

class cGenericObject {
  public:
    virtual ~cGenericObject() {}

    /* The force on a tool at a position in the object's frame, N, and the proxy's position. */
    virtual cVector3d computeLocalInteraction(const cVector3d &tool, cVector3d &proxy) = 0;
};

class cWorld {
  public:
    void addChild(cGenericObject *object) { objects.push_back(object); }

    /* Called by a haptics thread a thousand times a second. */
    cVector3d computeInteractionForces(const cVector3d &tool, cVector3d &proxy) {
        cVector3d force;
        for (cGenericObject *object : objects) {
            force.add(object->computeLocalInteraction(tool, proxy));
        }
        return force;
    }

  private:
    std::vector<cGenericObject *> objects;
};

#endif
