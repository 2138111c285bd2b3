// Meshes whose displacements count as small, and that have turned: they grow by their turn, and nothing else says so.
#include <array>
#include <cmath>
#include <cstdio>

#include "../base/vectors.hpp"
#include "../fe/bulk_model.hpp"
#include "simulation.hpp"

namespace cairn {
namespace {

// Largest rotation of a mesh of small displacements [rad]: it lengthens the mesh by half the square of the rotation, .5
// % here.
constexpr double widest_turn = 0.1;

bool counts_as_small(const MeshModel& model) {
  if (!model.bulk) return true;
  const BulkModel* solid = model.bulk->solid();
  return solid && !solid->cells().empty() && !solid->finite();
}

using Vector = std::array<double, 3>;

double determinant(const Vector& a, const Vector& b, const Vector& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// The turn w that fits displacements u of the nodes best, by least squares of u - w x X [rad]; X from their middle.
double turn_of(const MeshModel& model, const double* position) {
  const int dim = model.dim;
  const std::int64_t nodes = model.nodes();
  const double* reference = model.reference.data();
  Vector middle{}, moment{}, spread[3]{};
  for (std::int64_t i = 0; i < nodes; ++i)
    for (int k = 0; k < dim; ++k) middle[std::size_t(k)] += reference[i * dim + k] / double(nodes);
  double squares = 0;
  for (std::int64_t i = 0; i < nodes; ++i) {
    Vector arm{}, u{};
    for (int k = 0; k < dim; ++k) {
      arm[std::size_t(k)] = reference[i * dim + k] - middle[std::size_t(k)];
      u[std::size_t(k)] = position[i * dim + k] - reference[i * dim + k];
    }
    add_cross(arm.data(), u.data(), moment.data());
    for (std::size_t k = 0; k < 3; ++k) {
      squares += arm[k] * arm[k];
      for (std::size_t l = 0; l < 3; ++l) spread[k][l] -= arm[k] * arm[l];
    }
  }
  // Nodes on a line say nothing of a turn about it: a hair more than their own moment of area leaves that at nought.
  constexpr double hair = 1e-9;
  for (std::size_t k = 0; k < 3; ++k) spread[k][k] += (1 + hair) * squares;
  const double whole = determinant(spread[0], spread[1], spread[2]);
  if (!(whole > 0)) return 0; // one node
  return std::hypot(determinant(moment, spread[1], spread[2]), determinant(spread[0], moment, spread[2]),
                    determinant(spread[0], spread[1], moment)) /
         whole;
}

} // namespace

void Simulation::tell_of_small_turns() {
  report.mesh_turned.clear();
  double most = widest_turn;
  for (const MeshBody& mesh : meshes.meshes) {
    if (!counts_as_small(mesh.model)) continue;
    const double turn = turn_of(mesh.model, scene.nodes.position.values.data() + mesh.first_node() * mesh.model.dim);
    if (!(turn > most)) continue;
    most = turn;
    char text[200];
    std::snprintf(text, sizeof text,
                  " has turned by %.2g rad, and its displacements count as small: it is %.2g %% too long across the "
                  "turn; give a SolidBody whose kinematics are not \"small\"",
                  turn, 100 * (std::hypot(1.0, turn) - 1));
    report.mesh_turned = "the mesh '" + mesh.model.name + "'" + text;
  }
}

} // namespace cairn
