// Deformable bodies: matrices and nodes go to the core once, loads and held velocities before each step.
#include <pybind11/functional.h>

#include "alone.hpp"
#include "arrays.hpp"
#include "bulk.hpp"
#include "fe/frame_model.hpp"
#include "fe/internal_forces.hpp"
#include "files/run_snapshot.hpp"
#include "scene/mesh_parts.hpp"
#include "script_error.hpp"
#include "simulation/simulation.hpp"

using cairn::Simulation;

void bind_reshaping(py::module_& m);

namespace {

template <class T>
std::vector<T> vector_of(const py::dict& d, const char* name) {
  const auto a = py::cast<Input<T>>(d[name]);
  return {a.data(), a.data() + a.size()};
}

// Products and solutions of another code, in Python: they take the lock that a step gives away.
std::function<void(const double*, double*)> product_of(py::object function, std::int64_t n) {
  auto held = std::make_shared<py::object>(std::move(function));
  return [held, n](const double* x, double* out) {
    const py::gil_scoped_acquire lock;
    const auto y = by_script([&] { return py::cast<Input<double>>((*held)(py::array_t<double>(n, x))); });
    if (y.size() != n)
      throw cairn::Error("an operator of a mesh gave " + std::to_string(y.size()) + " numbers, not " +
                         std::to_string(n));
    std::copy_n(y.data(), n, out);
  };
}

std::function<std::function<void(double*)>(double, double)> solver_of(py::object make, std::vector<std::int64_t> free,
                                                                      std::int64_t n) {
  auto held = std::make_shared<py::object>(std::move(make));
  return [held, free = std::move(free), n](double h, double theta) -> std::function<void(double*)> {
    const py::gil_scoped_acquire lock;
    auto solve = std::make_shared<py::object>(by_script([&] { return (*held)(h, theta); }));
    return [solve, free, n](double* b) {
      const py::gil_scoped_acquire inner;
      py::array_t<double> right(py::ssize_t(free.size()));
      for (std::size_t i = 0; i < free.size(); ++i) right.mutable_data()[i] = b[free[i]];
      const auto x = by_script([&] { return py::cast<Input<double>>((*solve)(right)); });
      if (std::size_t(x.size()) != free.size())
        throw cairn::Error("the solver of a mesh gave " + std::to_string(x.size()) + " numbers, not " +
                           std::to_string(free.size()));
      for (std::size_t i = 0; i < free.size(); ++i) b[free[i]] = x.data()[i];
    };
  };
}

cairn::SoeStorage storage_of(const std::string& name) {
  const std::pair<const char*, cairn::SoeStorage> known[] = {{"automatic", cairn::SoeStorage::automatic},
                                                             {"diagonal", cairn::SoeStorage::diagonal},
                                                             {"banded", cairn::SoeStorage::banded},
                                                             {"dense", cairn::SoeStorage::dense},
                                                             {"sparse", cairn::SoeStorage::sparse}};
  for (const auto& [text, storage] : known)
    if (name == text) return storage;
  throw cairn::Error("there is no storage '" + name + "'");
}

cairn::MeshModel model_of(const py::dict& d) {
  cairn::MeshModel m;
  m.dim = py::cast<int>(d["dim"]);
  m.name = py::cast<std::string>(d["name"]);
  m.reference = vector_of<double>(d, "reference");
  const auto matrix = [&](const char* name) {
    cairn::SparseMatrix a;
    a.n = m.dofs();
    a.start = vector_of<std::int64_t>(d, "start");
    a.row = vector_of<std::int32_t>(d, "row");
    a.value = vector_of<double>(d, name);
    return a;
  };
  m.mass = matrix("mass");
  m.held = vector_of<std::uint8_t>(d, "held");
  if (d.contains("node_mass")) m.node_mass = vector_of<double>(d, "node_mass");
  if (d.contains("solver")) {
    m.times_stiffness = product_of(d["times_stiffness"], m.dofs());
    m.times_damping = product_of(d["times_damping"], m.dofs());
    m.make_solver = solver_of(d["solver"], vector_of<std::int64_t>(d, "free"), m.dofs());
  } else {
    m.stiffness = matrix("stiffness");
    m.damping = matrix("damping");
  }
  if (d.contains("initial_force")) {
    m.initial_force = vector_of<double>(d, "initial_force");
    m.initial_energy = py::cast<double>(d["initial_energy"]);
  }
  if (d.contains("cells"))
    for (const auto& item : py::cast<py::list>(d["cells"])) {
      const auto cells = py::cast<py::tuple>(item);
      const auto node = py::cast<Input<std::int32_t>>(cells[1]);
      const auto elasticity = py::cast<Input<double>>(cells[2]);
      m.cells.push_back({&cairn::element_named(py::cast<std::string>(cells[0])),
                         {node.data(), node.data() + node.size()},
                         {elasticity.data(), elasticity.data() + elasticity.size()}});
    }
  if (d.contains("modes")) {
    m.modes = vector_of<double>(d, "modes");
    m.mode_rates = vector_of<double>(d, "mode_rates");
  }
  if (d.contains("bulk")) {
    m.bulk = bulk_model_of(m.dim, py::cast<Input<double>>(d["bulk_place"]), py::cast<py::list>(d["bulk"]));
    m.bulk->fit(m.mass);
  }
  if (d.contains("called")) {
    m.bulk = py::cast<std::shared_ptr<cairn::InternalForces>>(d["called"]);
    m.bulk->fit(m.mass);
    if (const auto* frame = dynamic_cast<cairn::FrameModel*>(m.bulk.get())) frame->stiffen(m.stiffness);
  }
  m.options.storage = storage_of(py::cast<std::string>(d["storage"]));
  m.node_ids = vector_of<std::int64_t>(d, "node_ids");
  m.point_ids = vector_of<std::int64_t>(d, "point_ids");
  m.side_ids = vector_of<std::int64_t>(d, "side_ids");
  m.self_contact = d.contains("self_contact") && py::cast<bool>(d["self_contact"]);
  m.mortar = d.contains("mortar") && py::cast<bool>(d["mortar"]);
  if (d.contains("ring")) m.ring = py::cast<bool>(d["ring"]);
  if (d.contains("thickness")) m.thickness = py::cast<double>(d["thickness"]);
  if (d.contains("axis")) m.axis = py::cast<double>(d["axis"]);
  m.contact_nodes = vector_of<std::int32_t>(d, "contact_nodes");
  m.point_nodes = vector_of<std::int32_t>(d, "point_nodes");
  m.point_weights = vector_of<double>(d, "point_weights");
  m.side_nodes = vector_of<std::int32_t>(d, "side_nodes");
  m.face_nodes = vector_of<std::int32_t>(d, "face_nodes");
  if (d.contains("whole_nodes")) m.whole_nodes = vector_of<std::int32_t>(d, "whole_nodes");
  m.around = vector_of<std::int32_t>(d, "around");
  m.around_start = vector_of<std::int32_t>(d, "around_start");
  if (d.contains("ties")) {
    const auto t = py::cast<py::dict>(d["ties"]);
    m.ties.dof = vector_of<std::int32_t>(t, "dof");
    m.ties.first = vector_of<std::int64_t>(t, "first");
    m.ties.master = vector_of<std::int32_t>(t, "master");
    m.ties.weight = vector_of<double>(t, "weight");
    m.ties.rigid_node = vector_of<std::int32_t>(t, "rigid_node");
    m.ties.rigid_first = vector_of<std::int64_t>(t, "rigid_first");
    m.ties.turns = py::cast<bool>(t["turns"]);
  }
  return m;
}

// Forces of the last step that a mesh takes over from the body it replaces.
template <class Values>
void take_forces(Values& to, const py::dict& d, const char* name) {
  if (!d.contains(name)) return;
  const std::vector<double> values = vector_of<double>(d, name);
  if (values.size() != to.size())
    throw cairn::Error(std::string(name) + " of a mesh holds " + std::to_string(values.size()) + " numbers: it has " +
                       std::to_string(to.size()) + " dofs");
  std::copy(values.begin(), values.end(), to.begin());
}

// Bodies that deform from now on, in this order: numbers of those that stay as they are, models of new ones.
void set_meshes(Simulation& s, const py::list& given) {
  std::vector<std::size_t> stays(given.size(), s.meshes.meshes.size());
  std::vector<cairn::MeshModel> models(given.size());
  bool same = given.size() == s.meshes.meshes.size();
  for (std::size_t k = 0; k < given.size(); ++k) {
    if (py::isinstance<py::dict>(given[k]))
      models[k] = model_of(given[k]);
    else if (stays[k] = py::cast<std::size_t>(given[k]); stays[k] >= s.meshes.meshes.size())
      throw cairn::Error("there is no mesh " + std::to_string(stays[k]));
    same = same && stays[k] == k;
  }
  if (same) return;
  cairn::MeshList before = std::move(s.meshes.meshes);
  s.meshes = cairn::MeshSet();
  for (std::size_t k = 0; k < given.size(); ++k) {
    if (stays[k] < before.size()) {
      s.meshes.meshes.take(before, stays[k]);
      continue;
    }
    s.add_mesh(std::move(models[k]));
    take_forces(s.meshes.meshes.back().impulse, given[k], "impulse");
    take_forces(s.meshes.meshes.back().reaction, given[k], "reaction");
  }
}

// Sides of mesh `which` that pressures press, before its first step: dicts of node (nodes, sides), ring, thickness,
// axis.
void press_mesh(Simulation& s, std::size_t which, const py::list& sets) {
  cairn::MeshBody& mesh = s.meshes.meshes.at(which);
  mesh.loads.pressed.clear();
  for (const auto& item : sets) {
    const auto d = py::cast<py::dict>(item);
    cairn::PressedSides sides;
    sides.nodes = py::cast<int>(d["nodes"]);
    sides.node = vector_of<std::int32_t>(d, "node");
    sides.ring = py::cast<bool>(d["ring"]);
    sides.thickness = py::cast<double>(d["thickness"]);
    sides.axis = py::cast<double>(d["axis"]);
    mesh.loads.pressed.push_back(std::move(sides));
  }
}

// Sets pressures of the pressed sides of a mesh at the begin and end of the coming steps [Pa], (sets, 2).
void set_pressures(Simulation& s, std::size_t which, const Input<double>& values) {
  cairn::MeshBody& mesh = s.meshes.meshes.at(which);
  if (std::size_t(values.size()) != 2 * mesh.loads.pressed.size())
    throw cairn::Error("the mesh '" + mesh.model.name + "' has " + std::to_string(mesh.loads.pressed.size()) +
                       " sets of pressed sides, and " + std::to_string(values.size()) + " pressures are given");
  for (std::size_t k = 0; k < mesh.loads.pressed.size(); ++k)
    mesh.loads.pressed[k].begin = values.data()[2 * k], mesh.loads.pressed[k].end = values.data()[2 * k + 1];
}

// Forces on the dofs of mesh `which` at both ends of the coming steps [N], and velocities of its held dofs [m/s].
void load_mesh(Simulation& s, std::size_t which, const Input<double>& begin, const Input<double>& end,
               const Input<double>& held) {
  cairn::MeshBody& mesh = s.meshes.meshes.at(which);
  for (const Input<double>* a : {&begin, &end, &held})
    if (a->size() != mesh.model.dofs())
      throw cairn::Error("a load of the mesh '" + mesh.model.name + "' holds " + std::to_string(a->size()) +
                         " numbers: it has " + std::to_string(mesh.model.dofs()) + " dofs");
  mesh.loads.begin.assign(begin.data(), begin.data() + begin.size());
  mesh.loads.end.assign(end.data(), end.data() + end.size());
  mesh.loads.held_velocity.assign(held.data(), held.data() + held.size());
}

} // namespace

void bind_meshes(py::module_& m) {
  auto simulation = py::reinterpret_borrow<py::class_<Simulation>>(m.attr("Simulation"));
  simulation.def("set_meshes", &set_meshes)
      .def("load_mesh", &load_mesh)
      .def("press_mesh", &press_mesh)
      .def("set_pressures", &set_pressures)
      .def("mesh_work",
           [](const Simulation& s) {
             py::dict out;
             std::int64_t solves = 0, factorisations = 0, bytes = 0, dofs = 0;
             for (const cairn::MeshBody& mesh : s.meshes.meshes) {
               solves += mesh.solves();
               factorisations += mesh.factorisations();
               bytes += mesh.bytes();
               dofs += mesh.model.dim * mesh.contact_nodes();
             }
             out["solves"] = solves;
             out["factorisations"] = factorisations;
             out["bytes"] = bytes;
             out["contact_dofs"] = dofs;
             return out;
           })
      .def("mesh_bulk", // what a material found in the last step: stress and state of each kind of cells
           [](Simulation& s, std::size_t k) {
             py::list out;
             cairn::MeshBody& mesh = s.meshes.meshes.at(k);
             const cairn::BulkModel* solid = mesh.linear() ? nullptr : mesh.model.bulk->solid();
             for (std::size_t b = 0; solid && b < solid->cells().size(); ++b) {
               const cairn::BulkCells& c = solid->cells()[b];
               py::array_t<double> stress({py::ssize_t(c.count()), py::ssize_t(6)}),
                   state({py::ssize_t(c.count()), py::ssize_t(c.material->state.size())});
               solid->cell_stress(b, stress.mutable_data());
               solid->cell_state(b, state.mutable_data());
               out.append(py::make_tuple(stress, state));
             }
             return out;
           })
      .def("mesh_forces", // of the last step: impulses of contacts on the dofs [N s], forces that hold them [N]
           [](Simulation& s, std::size_t k) {
             const cairn::MeshBody& mesh = s.meshes.meshes.at(k);
             return py::make_tuple(py::array_t<double>(py::ssize_t(mesh.impulse.size()), mesh.impulse.data()),
                                   py::array_t<double>(py::ssize_t(mesh.reaction.size()), mesh.reaction.data()));
           })
      .def("mesh_memory", // for a checkpoint: state of the points, forces of the stresses; empty if linear or new
           [](Simulation& s, std::size_t k) {
             cairn::MeshBody& mesh = s.meshes.meshes.at(k);
             if (mesh.linear()) return py::make_tuple(py::array_t<double>(0), py::array_t<double>(0));
             const std::vector<double> state = mesh.model.bulk->history(), memory = mesh.memory();
             return py::make_tuple(py::array_t<double>(py::ssize_t(state.size()), state.data()),
                                   py::array_t<double>(py::ssize_t(memory.size()), memory.data()));
           })
      .def("restore_mesh",
           [](Simulation& s, std::size_t k, const Input<double>& state, const Input<double>& memory) {
             s.meshes.meshes.at(k).restore({state.data(), std::size_t(state.size())},
                                           {memory.data(), std::size_t(memory.size())});
           })
      .def("restore_touched",
           [](Simulation& s, std::size_t k, const Input<double>& of) {
             s.meshes.meshes.at(k).restore_touched({of.data(), std::size_t(of.size())});
           })
      .def("forget_mesh", [](Simulation& s, std::size_t k) { s.meshes.meshes.at(k).forget(); })
      .def("nodes_of_contactors", // (n, 4) ids
           [](Simulation& s) {
             const std::vector<std::int64_t> ids = cairn::nodes_of_contactors(s);
             return py::array_t<std::int64_t>({py::ssize_t(ids.size()) / 4, py::ssize_t(4)}, ids.data());
           })
      .def("account_for_reshaping", &Simulation::account_for_reshaping)
      .def("follow_meshes", &Simulation::follow_meshes);
  bind_reshaping(m);
}
