#include "fe/elements.hpp"

#include "arrays.hpp"
#include "base/call.hpp"

namespace {

const cairn::ElementInfo& element_of(const std::string& cell, const Input<double>& x, const Input<double>& elasticity) {
  for (const cairn::ElementInfo& e : cairn::element_infos) {
    if (cell != e.cell) continue;
    const py::ssize_t strains = 3 * e.dim - 3;
    if (x.ndim() != 3 || x.shape(1) != e.nodes || x.shape(2) != e.dim)
      throw cairn::Error("places of the nodes of " + cell + " cells must be (n, " + std::to_string(e.nodes) + ", " +
                         std::to_string(e.dim) + ")");
    if (elasticity.ndim() != 2 || elasticity.shape(0) != strains || elasticity.shape(1) != strains)
      throw cairn::Error("elasticity of " + cell + " cells must be square of size " + std::to_string(strains));
    return e;
  }
  throw cairn::Error("there is no element for cells of kind " + cell);
}

py::tuple matrices(const std::string& cell, const Input<double>& x, double density, const Input<double>& elasticity) {
  const cairn::ElementInfo& e = element_of(cell, x, elasticity);
  const py::ssize_t n = x.shape(0), dofs = e.nodes * e.dim;
  py::array_t<double> stiffness({n, dofs, dofs}), mass({n, dofs, dofs});
  py::array_t<std::int32_t> wrong(n);
  const cairn::ElementShape shape(e);
  cairn_elastic_matrices(e.dim, e.nodes, e.points, shape.value.data(), shape.gradient.data(), shape.weight.data(), n,
                         x.data(), density, elasticity.data(), stiffness.mutable_data(), mass.mutable_data(),
                         wrong.mutable_data());
  return py::make_tuple(stiffness, mass, wrong);
}

py::array_t<double> stress(const std::string& cell, const Input<double>& x, const Input<double>& elasticity,
                           const Input<double>& displacement) {
  const cairn::ElementInfo& e = element_of(cell, x, elasticity);
  if (displacement.size() != x.size()) throw cairn::Error("displacements must be as many as places of nodes");
  py::array_t<double> out({x.shape(0), py::ssize_t(3 * e.dim - 3)});
  cairn_elastic_stress(e.dim, e.nodes, cairn::ElementShape(e).middle.data(), x.shape(0), x.data(), elasticity.data(),
                       displacement.data(), out.mutable_data());
  return out;
}

} // namespace

void bind_elements(py::module_& m) {
  m.def("elements", [] {
    py::list rows;
    for (const cairn::ElementInfo& e : cairn::element_infos) {
      py::dict row;
      row["name"] = e.name;
      row["cell"] = e.cell;
      row["dim"] = e.dim;
      row["nodes"] = e.nodes;
      rows.append(row);
    }
    return rows;
  });
  m.def("element_matrices", &matrices);
  m.def("element_stress", &stress);
}
