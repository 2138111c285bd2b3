// Point-in-mesh test by winding number: how often the boundary of the cells of a mesh, or its contact sides if they
// close, goes round a point.
#pragma once
#include <cstdint>
#include <vector>

namespace cairn {

struct MeshModel;

// Edges (2, n), the body on their left, or triangles (3, n), anticlockwise from outside, that have no rim, by nodes of
// a mesh; empty where neither its cells nor its sides close.
std::vector<std::int32_t> closed_sides(const MeshModel& model);

// Closed surface with its sides sorted into strips across the first axis, so that a query looks only at the few sides
// of its strip. Crossings are decided per edge from its lower end on: neighbours agree to the bit where the ray meets
// an edge or a node.
class ClosedSurface {
public:
  // place (dim, nodes) [m], which stays as long as this is asked.
  ClosedSurface(int dim, std::vector<std::int32_t> side, const double* place);

  // Times that it goes round a point (dim) [m]: 1 within, 0 outside, more within bodies that overlap; of a point on it
  // it is either.
  int turns(const double* point) const;

private:
  std::int64_t strip(int axis, double x) const;
  bool ahead(const double* one, const double* other, int across, int along, const double* point) const;

  int dim_;
  std::vector<std::int32_t> side_;
  const double* place_;
  std::int64_t strips_ = 1; // along each axis but the first
  double low_[3] = {0, 0, 0}, per_length_[3] = {0, 0, 0};
  std::vector<std::int64_t> start_; // of each strip among sides_in_
  std::vector<std::int32_t> sides_in_;
};

} // namespace cairn
