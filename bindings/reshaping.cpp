// Rigid bodies made deformable in a run, and back: the core's part behind Python's bodies.
#include "strategies/reshaping.hpp"

#include "strategies/contact_loads.hpp"

#include "alone.hpp"
#include "arrays.hpp"
#include "known.hpp"

using cairn::Rotation;
using cairn::Scene;
using cairn::Simulation;

namespace {

template <class Values>
py::array_t<double> array_of(std::vector<py::ssize_t> shape, const Values& values) {
  py::array_t<double> out(std::move(shape));
  std::copy_n(values.begin(), out.size(), out.mutable_data());
  return out;
}
py::array_t<double> rows_of(int dim, const std::vector<double>& values) {
  return array_of({py::ssize_t(values.size()) / dim, py::ssize_t(dim)}, values);
}

// (dim, dim), body to space.
py::array_t<double> matrix_of(int dim, const Rotation& r) {
  py::array_t<double> out({py::ssize_t(dim), py::ssize_t(dim)});
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j) out.mutable_at(i, j) = r[std::size_t(3 * i + j)];
  return out;
}
Rotation rotation_from(const Input<double>& matrix) {
  Rotation out = cairn::upright;
  for (py::ssize_t i = 0; i < matrix.shape(0); ++i)
    for (py::ssize_t j = 0; j < matrix.shape(1); ++j) out[std::size_t(3 * i + j)] = matrix.at(i, j);
  return out;
}

std::span<const double> all_of(const Input<double>& a) { return {a.data(), std::size_t(a.size())}; }
std::span<const std::int64_t> all_of(const Input<std::int64_t>& a) { return {a.data(), std::size_t(a.size())}; }

// Where a rigid body is and how it moves; spin: its angular momentum about its centre of mass.
py::dict motion_of(const Scene& scene, std::int64_t id) {
  const cairn::RigidMotion at = cairn::motion_of(scene, id);
  const auto dim = py::ssize_t(scene.dim);
  py::dict out;
  out["mass"] = at.mass;
  out["kinetic"] = at.kinetic;
  out["position"] = array_of({dim}, at.position);
  out["velocity"] = array_of({dim}, at.velocity);
  out["spin"] = array_of({2 * dim - 3}, at.spin);
  out["rotation"] = matrix_of(scene.dim, at.rotation);
  return out;
}

// A mesh in the place of a rigid body that came in as `start`: by the lower triangle of its mass, and its points (n,
// dim) as it is given. See cairn::MeshPlace; velocity (n, dim), kinetic: of its mass there.
py::dict place_of_mesh(const Scene& scene, std::int64_t id, const Input<std::int64_t>& first,
                       const Input<std::int32_t>& row, const Input<double>& value, const Input<double>& points,
                       const Input<double>& start, bool large) {
  const int dim = scene.dim;
  cairn::SparseMatrix mass;
  mass.n = points.size();
  mass.start.assign(first.data(), first.data() + first.size());
  mass.row.assign(row.data(), row.data() + row.size());
  mass.value.assign(value.data(), value.data() + value.size());
  const cairn::RigidMotion at = cairn::motion_of(scene, id);
  const cairn::MeshPlace place = cairn::place_of(dim, mass, all_of(points), at, rotation_from(start), large);
  for (double& m : mass.value) m *= place.factor;
  double kinetic = 0;
  const std::vector<double> velocity = cairn::velocities_of(dim, mass, place, at, kinetic);
  py::dict out;
  out["own"] = rows_of(dim, place.own);
  out["base"] = matrix_of(dim, place.base);
  out["reference"] = rows_of(dim, place.reference);
  out["displacement"] = rows_of(dim, place.displacement);
  out["velocity"] = rows_of(dim, velocity);
  out["factor"] = place.factor;
  out["kinetic"] = kinetic;
  return out;
}

// Places of the nodes of a mesh, absolute, and their velocities.
void read_nodes(Simulation& s, const cairn::MeshBody& mesh, std::vector<double>& x, std::vector<double>& v) {
  const auto n = std::size_t(mesh.model.dofs()), dim = std::size_t(s.scene.dim);
  x.resize(n);
  v.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = s.scene.nodes.position[mesh.first_node()][i] + s.scene.origin[i % dim];
    v[i] = s.scene.nodes.velocity[mesh.first_node()][i];
  }
}
cairn::MeshBody& placed(Simulation& s, std::size_t which) {
  s.place_meshes();
  return s.meshes.meshes.at(which);
}

// Motion of the nodes of a mesh: mass, centre, momentum and angular momentum about the centre, kinetic and stored
// energy.
py::dict motion_of_mesh(Simulation& s, std::size_t which) {
  cairn::MeshBody& mesh = placed(s, which);
  std::vector<double> x, v;
  read_nodes(s, mesh, x, v);
  const auto dim = py::ssize_t(s.scene.dim);
  const cairn::NodesMotion motion = cairn::motion_of_nodes(s.scene.dim, mesh.model.mass, x, v);
  py::dict out;
  out["mass"] = motion.mass;
  out["kinetic"] = motion.kinetic;
  out["centre"] = array_of({dim}, motion.centre);
  out["momentum"] = array_of({3 * dim - 3}, motion.momentum);
  out["stored"] = cairn::stored_at_begin(mesh, s.scene.nodes);
  return out;
}

py::tuple velocity_of(int dim, double mass, const Input<double>& momentum, const Input<double>& axes,
                      const Input<double>& inertia) {
  cairn::NodesMotion motion;
  motion.mass = mass;
  std::copy_n(momentum.data(), momentum.size(), motion.momentum.begin());
  double kinetic = 0;
  const std::vector<double> velocity = cairn::velocity_of(dim, motion, rotation_from(axes), all_of(inertia), kinetic);
  return py::make_tuple(array_of({py::ssize_t(velocity.size())}, velocity), kinetic);
}

// Contact loads of the last step: largest forces (n) [N] and mean stresses (n) [Pa] of rigid bodies, by their volumes;
// largest forces (m) [N] of meshes, by their indices in the simulation.
py::tuple contact_loads(Simulation& s, const Input<std::int64_t>& bodies, const Input<double>& volume,
                        const Input<std::int64_t>& meshes) {
  const std::vector<std::size_t> which(meshes.data(), meshes.data() + meshes.size());
  cairn::ContactLoads loads;
  loads.read(known(s), all_of(bodies), which);
  py::array_t<double> force(bodies.size()), stress(bodies.size()), of_meshes(meshes.size());
  for (py::ssize_t i = 0; i < bodies.size(); ++i) {
    force.mutable_at(i) = loads.of_bodies[std::size_t(i)].force;
    stress.mutable_at(i) = loads.of_bodies[std::size_t(i)].stress(s.scene.dim, volume.at(i));
  }
  for (py::ssize_t i = 0; i < meshes.size(); ++i) of_meshes.mutable_at(i) = loads.of_meshes[std::size_t(i)].force;
  return py::make_tuple(force, stress, of_meshes);
}

} // namespace

void bind_reshaping(py::module_& m) {
  m.def("rotation_of",
        [](int dim, const Input<double>& stored) { return matrix_of(dim, cairn::rotation_of(dim, stored.data())); });
  m.def("stored_rotation", [](int dim, const Input<double>& matrix) { // an angle (1,), or a quaternion (1, 4)
    std::array<double, 4> out{};
    cairn::stored_rotation(dim, rotation_from(matrix), out.data());
    return array_of(dim == 2 ? std::vector<py::ssize_t>{1} : std::vector<py::ssize_t>{1, 4}, out);
  });
  m.def("motion_of", motion_of);
  m.def("place_of_mesh", place_of_mesh);
  m.def("motion_of_mesh", motion_of_mesh);
  m.def("stored_by_mesh", [](Simulation& s, std::size_t which) {
    cairn::MeshBody& mesh = placed(s, which);
    return cairn::stored_at_begin(mesh, s.scene.nodes);
  });
  // How a body stands that came in as its mesh was made (own, base), where the nodes are now.
  m.def("turn_of_mesh", [](Simulation& s, std::size_t which, const Input<double>& own, const Input<double>& base) {
    const cairn::MeshBody& mesh = placed(s, which);
    std::vector<double> x, v;
    read_nodes(s, mesh, x, v);
    const int dim = s.scene.dim;
    return matrix_of(dim, cairn::turn_of(dim, mesh.model.mass, x, all_of(own), rotation_from(base)));
  });
  m.def("contact_loads", contact_loads);
  m.def("check_unbonded", [](const Simulation& s, const Input<std::int64_t>& ids, const std::string& what) {
    cairn::check_unbonded(s, all_of(ids), what);
  });
  m.def("velocity_of", velocity_of);                     // of a body with the momentum of nodes, and its kinetic energy
  py::class_<cairn::PassedContacts>(m, "PassedContacts") // of bodies, or parts of meshes, in whose place others come
      .def(py::init([](Simulation& s, double h, const Input<std::int64_t>& ids) {
        return cairn::PassedContacts(s, h, all_of(ids));
      }))
      .def("pass_to", [](cairn::PassedContacts& passed, Simulation& s, const Input<std::int64_t>& ids) {
        passed.pass_to(s, all_of(ids));
      });
}
