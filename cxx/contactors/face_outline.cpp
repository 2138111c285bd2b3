#include "face_outline.hpp"

#include <algorithm>
#include <numbers>

namespace cairn {

// From the first corner: far from the origin the terms of the usual sum would hide the area.
double signed_area(const std::vector<std::array<double, 2>>& corner) {
  double twice = 0;
  for (std::size_t i = 2; i < corner.size(); ++i) {
    const double one[2] = {corner[i - 1][0] - corner[0][0], corner[i - 1][1] - corner[0][1]};
    const double other[2] = {corner[i][0] - corner[0][0], corner[i][1] - corner[0][1]};
    twice += one[0] * other[1] - one[1] * other[0];
  }
  return twice / 2;
}

void FaceOutline::clear() {
  corner.clear();
  radius = 0;
  endless = false;
}

void FaceOutline::turn_left() {
  if (signed_area(corner) < 0) std::reverse(corner.begin(), corner.end());
}

double FaceOutline::area() const { return is_disk() ? std::numbers::pi * radius * radius : signed_area(corner); }

} // namespace cairn
