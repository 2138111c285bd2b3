// How the surfaces of two bodies are curved where they touch.
#pragma once
#include "interaction_state.hpp"

namespace cairn {

// Along t t, t s and s s of a contact, in 2D along t alone [1/m]: flat 0, hollow below 0. An edge is sharp along one
// direction of the plane, a corner along all; no number stands for that.
struct SurfaceCurvature {
  double k[3] = {0, 0, 0};
  int sharp = 0;      // directions
  bool rocks = false; // a flat face of a superquadric looks at the contact
  double across[2] = {1, 0};
  bool is_flat() const { return !(sharp || k[0] != 0 || k[1] != 0 || k[2] != 0); }
};

struct Interactions::State::Curvatures {
  SurfaceCurvature a, b;
  double size = 0;    // of the smaller shape that bodies are made of [m]
  bool known = false; // of both shapes
  // Radii of rolling, 1/(Ka + Kb) [m]: 0 along directions sharp on either side, and along those flat on both, where
  // contact points carry moments by themselves; false where the sum is hollow.
  bool radii(double p[3]) const;
};

// Principal values of a symmetric matrix of a plane (11, 12, 22) and the unit vector along which the first is.
void principal(const double m[3], double value[2], double along[2]);

} // namespace cairn
