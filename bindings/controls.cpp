// Bindings of drives, servo walls, cells and probes.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "base/expression.hpp"
#include "simulation/controls.hpp"
#include "simulation/probes.hpp"

#include "alone.hpp"
#include "arrays.hpp"
#include "known.hpp"

using cairn::Simulation;

namespace {

py::list probe_values(const Simulation& s) {
  py::list out;
  for (int k = 0; s.probes && k < s.probes->count(); ++k) out.append(s.probes->last(k));
  return out;
}

py::dict driven_cell(const Simulation& s) {
  const cairn::Cell& cell = s.scene.cell;
  const int dim = s.scene.dim;
  py::array_t<double> vectors({dim, dim}), gradient({dim, dim}), stress({dim, dim});
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j) {
      vectors.mutable_at(j, i) = cell.vectors[i + 3 * j]; // rows are cell vectors
      gradient.mutable_at(i, j) = cell.velocity_gradient[i + 3 * j];
      stress.mutable_at(i, j) = cell.stress[i + 3 * j];
    }
  py::dict out;
  out["vectors"] = vectors;
  out["rate"] = gradient;
  out["stress"] = stress;
  return out;
}

} // namespace

void bind_controls(py::class_<Simulation>& simulation) {
  simulation
      .def("release_bodies",
           [](Simulation& s) {
             if (s.controls) s.controls->release_bodies();
           })
      .def("drive_by",
           [](Simulation& s, const Input<std::int64_t>& ids, int dof, const std::string& velocity) {
             s.controlled().drive(s, {ids.data(), std::size_t(ids.size())}, dof, cairn::Expression(velocity));
           })
      .def("set_servo", // area: "grains", "walls", or a number
           [](Simulation& s, std::int64_t body, const std::array<double, 3>& normal, const std::string& stress,
              const std::string& area, double depth) {
             cairn::Servo servo;
             servo.body = body;
             servo.normal = normal;
             servo.stress = cairn::Expression(stress);
             servo.kind = area == "walls"    ? cairn::ServoArea::walls
                          : area == "grains" ? cairn::ServoArea::grains
                                             : cairn::ServoArea::given;
             if (servo.kind == cairn::ServoArea::given) servo.area = cairn::Expression(area);
             servo.depth = depth;
             s.controlled().press(s, servo);
           })
      .def("loaded_area",
           [](Simulation& s, const std::array<double, 3>& normal, const std::string& area, double depth) {
             cairn::Servo servo;
             servo.normal = normal;
             servo.kind = area == "walls" ? cairn::ServoArea::walls : cairn::ServoArea::grains;
             servo.depth = depth;
             return cairn::loaded_area(known(s), servo);
           })
      .def("grow",
           [](Simulation& s, const Input<std::int64_t>& ids, const std::string& rate) {
             s.controlled().grow(known(s), {ids.data(), std::size_t(ids.size())}, cairn::Expression(rate));
           })
      .def("stop_growth",
           [](Simulation& s, const Input<std::int64_t>& ids) {
             s.controlled().stop_growth({ids.data(), std::size_t(ids.size())});
           })
      .def("drive_cell",
           [](Simulation& s, const std::string& component, const std::string& rate) {
             s.controlled().drive_cell(s, component, cairn::Expression(rate));
           })
      .def("press_cell",
           [](Simulation& s, const std::string& component, const std::string& stress) {
             s.controlled().press_cell(s, component, cairn::Expression(stress));
           })
      .def("release_cell", [](Simulation& s) { s.controlled().release_cell(s); })
      .def("weigh_cell",
           [](Simulation& s, double inertia, double depth, bool keeps_volume) {
             s.controlled().weigh_cell(s, inertia, depth);
             s.controlled().keep_volume(s, keeps_volume);
           })
      .def_property( // that a cell keeps [m3]; 0: none
          "kept_volume", [](const Simulation& s) { return s.controls ? s.controls->kept_volume() : 0.0; },
          [](Simulation& s, double volume) { s.controlled().set_kept_volume(volume); })
      .def("driven_cell", &driven_cell)
      .def("add_probe",
           [](Simulation& s, const std::string& quantity, const Input<std::int64_t>& ids, const std::string& take,
              int every) {
             if (!s.probes) s.probes = std::make_unique<cairn::Probes>();
             return s.probes->add(s, quantity, {ids.data(), std::size_t(ids.size())}, take, every, false);
           })
      .def("clear_probes", [](Simulation& s) { s.probes.reset(); })
      .def("probe_values", &probe_values);
}

void bind_expressions(py::module_& m) {
  py::class_<cairn::Expression>(m, "Expression")
      .def(py::init<const std::string&>())
      .def("__call__", &cairn::Expression::operator());
}
