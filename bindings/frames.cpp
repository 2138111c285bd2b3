// Bars and beams that move far, see python/cairn/model/moving_frames.py.
#include "arrays.hpp"
#include "fe/frame_model.hpp"

using cairn::FrameModel;

namespace {

template <class T>
std::vector<T> values_of(const py::dict& d, const char* name) {
  const auto a = py::cast<Input<T>>(d[name]);
  return {a.data(), a.data() + a.size()};
}

std::shared_ptr<FrameModel> frame_of(int dim, const std::string& kinematics, const py::dict& d) {
  cairn::FrameCells cells;
  cells.dim = dim;
  cells.kinematics =
      kinematics == "total_lagrangian" ? cairn::Kinematics::total_lagrangian : cairn::Kinematics::corotational;
  cells.reference = values_of<double>(d, "points");
  cells.node = values_of<std::int32_t>(d, "cells");
  cells.young = values_of<double>(d, "young");
  cells.area = values_of<double>(d, "area");
  cells.pull = values_of<double>(d, "pull");
  cells.beams = d.contains("inertia");
  if (cells.beams) {
    cells.inertia = values_of<double>(d, "inertia");
    cells.shear = values_of<double>(d, "shear");
    cells.torsion = values_of<double>(d, "torsion");
    cells.shear_area = values_of<double>(d, "shear_area");
    const std::vector<double> up = values_of<double>(d, "up");
    std::copy_n(up.begin(), 3, cells.up.begin());
    cells.clamped = values_of<std::int32_t>(d, "clamped");
  }
  return std::make_shared<FrameModel>(std::move(cells));
}

// Returns forces (dofs), values of the fitted triangle, error text or None, energy. begin: displacements at the begin
// of the step where forces derive from energy, or None.
py::tuple evaluate(FrameModel& frame, const Input<double>& u, std::int64_t values, const py::object& begin) {
  py::array_t<double> force(u.size()), tangent(values);
  std::fill_n(tangent.mutable_data(), values, 0.0);
  cairn::MeshMotion at{u.data(), u.data()};
  Input<double> from;
  if (!begin.is_none()) from = py::cast<Input<double>>(begin), at.begin = from.data();
  const cairn::BulkResult found = frame.evaluate(at, force.mutable_data(), tangent.mutable_data());
  if (!found.ok()) return py::make_tuple(py::none(), py::none(), frame.describe(found), 0.0);
  return py::make_tuple(force, tangent, py::none(), found.energy);
}

// Cell forces at given displacements, starting from the rotations of the last step, which are kept. Returns forces on
// the second ends and for beams moments on both (m, 3 | 9), and rotations of nodes (nodes, 3, 3), columns first.
py::tuple borne(FrameModel& frame, const Input<double>& u) {
  const auto other = std::dynamic_pointer_cast<FrameModel>(frame.another());
  other->take_history(frame.history());
  std::vector<double> force(std::size_t(u.size()));
  const cairn::BulkResult found = other->evaluate({u.data(), u.data()}, force.data(), nullptr);
  if (!found.ok()) throw cairn::Error(other->describe(found));
  other->commit();
  const std::vector<double>&f = other->cell_forces(), &r = other->rotations();
  const auto cells = std::int64_t(other->count());
  return py::make_tuple(py::array_t<double>({cells, std::int64_t(f.size()) / cells}, f.data()),
                        py::array_t<double>({std::int64_t(r.size()) / 9, std::int64_t(3), std::int64_t(3)}, r.data()));
}

} // namespace

void bind_frames(py::module_& m) {
  py::class_<FrameModel, cairn::InternalForces, std::shared_ptr<FrameModel>>(m, "FrameModel")
      .def(py::init(&frame_of))
      .def("lower",
           [](const FrameModel& f) {
             const cairn::SparseMatrix a = f.lower();
             return py::make_tuple(py::array_t<std::int64_t>(py::ssize_t(a.start.size()), a.start.data()),
                                   py::array_t<std::int32_t>(py::ssize_t(a.row.size()), a.row.data()));
           })
      .def("fit",
           [](FrameModel& f, const Input<std::int64_t>& start, const Input<std::int32_t>& row) {
             cairn::SparseMatrix a;
             a.n = start.size() - 1;
             a.start.assign(start.data(), start.data() + start.size());
             a.row.assign(row.data(), row.data() + row.size());
             f.fit(a);
           })
      .def("evaluate", &evaluate, py::arg("u"), py::arg("values"), py::arg("begin") = py::none())
      .def("commit", &FrameModel::commit)
      .def("borne", &borne)
      .def("rotations", [](const FrameModel& f) { // (nodes, 3, 3), columns first
        const std::vector<double>& r = f.rotations();
        return py::array_t<double>({py::ssize_t(r.size() / 9), py::ssize_t(3), py::ssize_t(3)}, r.data());
      });
}
