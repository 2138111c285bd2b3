// Materials of solids, and the stresses of a mesh from them, for Python.
#include "fe/bulk_model.hpp"
#include "fe/umat.hpp"

#include "bulk.hpp"

using cairn::BulkModel;

namespace {

template <class E>
E chosen(const std::string& given, std::initializer_list<std::pair<const char*, E>> known, const char* what) {
  std::string names;
  for (const auto& [name, value] : known) {
    if (given == name) return value;
    names += std::string(names.empty() ? "" : ", ") + name;
  }
  throw cairn::Error(std::string(what) + " is '" + given + "'; give one of " + names);
}

cairn::BulkCells cells_of(const py::dict& d) {
  cairn::BulkCells c;
  const auto cell = py::cast<std::string>(d["cell"]);
  for (const cairn::ElementInfo& e : cairn::element_infos())
    if (cell == e.cell) c.element = &e;
  if (!c.element) throw cairn::Error("there is no element for cells of kind " + cell);
  c.material = &cairn::bulk_material_named(py::cast<std::string>(d["material"]));
  c.params = py::cast<std::vector<double>>(d["params"]);
  c.kinematics = chosen<cairn::Kinematics>(py::cast<std::string>(d["kinematics"]),
                                           {{"small", cairn::Kinematics::small},
                                            {"corotational", cairn::Kinematics::corotational},
                                            {"total_lagrangian", cairn::Kinematics::total_lagrangian},
                                            {"logarithmic", cairn::Kinematics::logarithmic}},
                                           "kinematics");
  c.plane = chosen<cairn::Plane>(py::cast<std::string>(d["plane"]),
                                 {{"strain", cairn::Plane::strain},
                                  {"stress", cairn::Plane::stress},
                                  {"axisymmetric", cairn::Plane::axisymmetric}},
                                 "plane");
  c.mean_dilatation = py::cast<bool>(d["mean_dilatation"]);
  c.thickness = py::cast<double>(d["thickness"]);
  const auto nodes = py::cast<Input<std::int32_t>>(d["nodes"]);
  c.node.assign(nodes.data(), nodes.data() + nodes.size());
  if (d.contains("initial_stress")) { // (cells, points, 6)
    const auto stress = py::cast<Input<double>>(d["initial_stress"]);
    c.initial_stress.assign(stress.data(), stress.data() + stress.size());
  }
  return c;
}

py::list materials() {
  py::list rows;
  for (const cairn::BulkMaterialInfo& m : cairn::bulk_material_infos()) {
    if (&cairn::bulk_material_named(m.name) != &m) continue; // another routine has its name now
    py::dict row;
    row["name"] = m.name;
    row["python_name"] = m.python_name;
    row["takes_gradient"] = m.takes_gradient;
    row["state"] = m.state;
    row["symmetric"] = m.symmetric;
    row["umat"] = m.umat != nullptr;
    py::list parameters;
    for (const cairn::BulkParameter& p : m.parameters)
      parameters.append(
          py::make_tuple(p.name, p.required ? py::object(py::none()) : py::float_(p.standard), p.smallest, p.largest));
    row["parameters"] = parameters;
    rows.append(row);
  }
  return rows;
}

// Stresses of points by themselves: measure (n, 6 | 9), state (n, states).
py::dict points(const std::string& name, const std::vector<double>& params, const Input<double>& measure,
                const Input<double>& begin, double h, double theta, double length) {
  const cairn::BulkMaterialInfo& m = cairn::bulk_material_named(name);
  if (!m.kernel) throw cairn::Error(name + " is a routine of a library: give it to a body");
  const py::ssize_t width = m.takes_gradient ? 9 : 6, states = py::ssize_t(m.state.size());
  const py::ssize_t n = measure.size() / width;
  if (measure.size() != n * width || begin.size() != n * states || params.size() != m.parameters.size())
    throw cairn::Error("points of " + name + " need (n, " + std::to_string(width) + ") and states (n, " +
                       std::to_string(states) + ")");
  py::array_t<double> stress({n, width}), tangent({n, width, width}), energy(n), dissipated(n), state({n, states});
  py::array_t<std::int32_t> status(n);
  std::fill_n(status.mutable_data(), n, 0);
  const std::vector<double> lengths(std::size_t(n), length);
  m.kernel(n, h, theta, params.data(), lengths.data(), measure.data(), begin.data(), state.mutable_data(),
           stress.mutable_data(), tangent.mutable_data(), energy.mutable_data(), dissipated.mutable_data(),
           status.mutable_data());
  py::dict out;
  out["stress"] = stress;
  out["tangent"] = tangent;
  out["energy"] = energy;
  out["dissipated"] = dissipated;
  out["state"] = state;
  out["status"] = status;
  return out;
}

// The first Piola-Kirchhoff stress (n, 9) and its tangent by columns (n, 9, 9) of a law on a measure.
py::tuple on_measure(int measure, const Input<double>& gradient, const std::string& name,
                     const std::vector<double>& params, const Input<double>& begin) {
  const py::ssize_t n = gradient.size() / 9;
  py::array_t<double> strain({n, py::ssize_t(6)}), piola({n, py::ssize_t(9)}), by({n, py::ssize_t(9), py::ssize_t(9)});
  std::vector<std::int32_t> status(std::size_t(n), 0);
  cairn_strain_measure(measure, n, gradient.data(), strain.mutable_data(), status.data());
  py::dict found = points(name, params, strain, begin, 1.0, 1.0, 1.0);
  const auto stress = py::cast<Input<double>>(found["stress"]), tangent = py::cast<Input<double>>(found["tangent"]);
  cairn_stress_of_measure(measure, n, gradient.data(), stress.data(), tangent.data(), 1, piola.mutable_data(),
                          by.mutable_data());
  return py::make_tuple(piola, by, found["energy"], strain);
}

py::tuple evaluate(BulkModel& model, const Input<double>& u, double h, double theta, const py::object& start,
                   const py::object& row) {
  py::array_t<double> force(u.size());
  py::object values = py::none();
  double* tangent = nullptr;
  if (!row.is_none()) {
    const auto s = py::cast<Input<std::int64_t>>(start);
    const auto r = py::cast<Input<std::int32_t>>(row);
    model.fit_once({s.data(), std::size_t(s.size())}, {r.data(), std::size_t(r.size())});
    py::array_t<double> made(r.size());
    tangent = made.mutable_data();
    std::fill_n(tangent, r.size(), 0.0);
    values = made;
  }
  const cairn::BulkResult found = model.evaluate(u.data(), h, theta, force.mutable_data(), tangent);
  if (!found.ok()) return py::make_tuple(py::none(), py::none(), model.told(found), 0.0, 0.0);
  return py::make_tuple(force, values, py::none(), found.energy, found.dissipated);
}

py::list per_block(BulkModel& model, bool stress) {
  py::list out;
  for (std::size_t k = 0; k < model.cells().size(); ++k) {
    const cairn::BulkCells& c = model.cells()[k];
    py::array_t<double> a({py::ssize_t(c.count()), py::ssize_t(stress ? 6 : c.material->state.size())});
    stress ? model.cell_stress(k, a.mutable_data()) : model.cell_state(k, a.mutable_data());
    out.append(a);
  }
  return out;
}

} // namespace

std::unique_ptr<BulkModel> bulk_model_of(int dim, const Input<double>& place, const py::list& blocks) {
  std::vector<cairn::BulkCells> cells;
  for (const py::handle d : blocks) cells.push_back(cells_of(py::cast<py::dict>(d)));
  return std::make_unique<BulkModel>(dim, std::vector<double>(place.data(), place.data() + place.size()),
                                     std::move(cells));
}

void bind_bulk(py::module_& m) {
  py::class_<BulkModel>(m, "BulkModel")
      .def(py::init(&bulk_model_of))
      .def("evaluate", &evaluate, py::arg("u"), py::arg("h"), py::arg("theta"), py::arg("start") = py::none(),
           py::arg("row") = py::none())
      .def("commit", &BulkModel::commit)
      .def("stress", [](BulkModel& b) { return per_block(b, true); })
      .def("states", [](BulkModel& b) { return per_block(b, false); });
  m.def("bulk_materials", &materials);
  m.def("bulk_points", &points);
  m.def("bulk_on_measure", &on_measure);
  m.def("plug_umat", &cairn::plug_umat);
}
