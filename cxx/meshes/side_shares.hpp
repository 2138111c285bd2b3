// Shares of the corners in the area of each piece of a mesh's surface.
#pragma once
#include <vector>

namespace cairn {

struct MeshModel;

// (3, sides): area that corners 0, 1 and, of a triangle, 2 of each edge or triangle have of it, by the reference
// configuration [m2], in the plane of a metre across, or round the axis. Their sum is the area of the piece.
std::vector<double> shares_of_sides(const MeshModel& m);

} // namespace cairn
