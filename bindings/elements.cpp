#include "fe/elements.hpp"

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "base/call.hpp"
#include "soe/soe.hpp"

namespace {

const cairn::ElementInfo& element_of(const std::string& cell, const Input<double>& x, const Input<double>& elasticity) {
  for (const cairn::ElementInfo& e : cairn::element_infos()) {
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

// Masses (m, nodes) of the nodes of cells of second order from their consistent masses (m, k, k).
py::array_t<double> lumped(const std::string& cell, const Input<double>& mass) {
  for (const cairn::ElementInfo& e : cairn::element_infos()) {
    if (cell != e.cell) continue;
    const py::ssize_t dofs = e.dim * e.nodes;
    if (mass.ndim() != 3 || mass.shape(1) != dofs || mass.shape(2) != dofs)
      throw cairn::Error("masses of " + cell + " cells must be (n, k, k)");
    py::array_t<double> out({mass.shape(0), py::ssize_t(e.nodes)});
    for (py::ssize_t c = 0; c < mass.shape(0); ++c)
      cairn::lump_by_diagonal(e, mass.data() + c * dofs * dofs, out.mutable_data() + c * e.nodes);
    return out;
  }
  throw cairn::Error("there is no element for cells of kind " + cell);
}

py::array_t<double> ring_masses(const std::string& cell, const Input<double>& x, double density) {
  for (const cairn::ElementInfo& e : cairn::element_infos()) {
    if (cell != e.cell || e.dim != 2) continue;
    const py::ssize_t n = x.size() / (2 * e.nodes), dofs = 2 * e.nodes;
    py::array_t<double> out({n, dofs, dofs});
    for (py::ssize_t c = 0; c < n; ++c)
      cairn::ring_mass(e, x.data() + c * dofs, density, out.mutable_data() + c * dofs * dofs);
    return out;
  }
  throw cairn::Error("there is no flat element for cells of kind " + cell);
}

// Stiffness of bars (n, 2 dim, 2 dim) and beams (n, 6 | 12, 6 | 12). x: end points (n, 2, dim); properties: (n,).
py::array_t<double> bars(const Input<double>& x, const Input<double>& young, const Input<double>& area) {
  const py::ssize_t n = x.shape(0), dim = x.shape(2);
  if (young.size() != n || area.size() != n) throw cairn::Error("bars need one modulus and one area each");
  py::array_t<double> out({n, 2 * dim, 2 * dim});
  cairn_bar_stiffness(std::int32_t(dim), n, x.data(), young.data(), area.data(), out.mutable_data());
  return out;
}

py::array_t<double> beams(const Input<double>& x, const Input<double>& up, const Input<double>& young,
                          const Input<double>& shear, const Input<double>& area, const Input<double>& inertia,
                          const Input<double>& torsion, const Input<double>& shear_area) {
  const py::ssize_t n = x.shape(0), dim = x.shape(2), dofs = 6 * dim - 6;
  for (const Input<double>* a : {&young, &shear, &area, &torsion, &shear_area})
    if (a->size() != n) throw cairn::Error("beams need one number of each property each");
  if (inertia.size() != 2 * n || up.size() != 3) throw cairn::Error("beams need two moments of inertia each");
  py::array_t<double> out({n, dofs, dofs});
  cairn_beam_stiffness(std::int32_t(dim), n, x.data(), up.data(), young.data(), shear.data(), area.data(),
                       inertia.data(), torsion.data(), shear_area.data(), out.mutable_data());
  return out;
}

// Lower triangles (start, row, [values, ...]) on one pattern of n unknowns. Of each kind of cells: unknowns (m, k) and
// matrices (m, k, k), as many as there are values.
py::tuple assembled(std::int64_t n, const std::vector<Input<std::int32_t>>& unknown,
                    const std::vector<std::vector<Input<double>>>& matrices) {
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> all;
  for (const auto& of : unknown) {
    if (of.ndim() != 2) throw cairn::Error("unknowns of cells must be (m, k)");
    for (py::ssize_t c = 0; c < of.shape(0); ++c) start.push_back(start.back() + of.shape(1));
    all.insert(all.end(), of.data(), of.data() + of.size());
  }
  const cairn::SparseMatrix pattern = cairn::lower_pattern(n, start, all);
  const std::size_t entries = pattern.row.size();
  py::list values;
  for (const auto& of_kinds : matrices) {
    py::array_t<double> value(entries);
    std::fill_n(value.mutable_data(), entries, 0.0);
    std::size_t first = 0, kind = 0;
    for (const auto& of : unknown) {
      const auto cells = std::size_t(of.shape(0)), size = std::size_t(of.shape(1));
      const Input<double>& matrix = of_kinds.at(kind++);
      if (matrix.size() != py::ssize_t(cells * size * size)) throw cairn::Error("matrices of cells must be (m, k, k)");
      cairn::add_cliques(pattern, std::span(start).subspan(first, cells + 1), all, matrix.data(),
                         {value.mutable_data(), entries});
      first += cells;
    }
    values.append(value);
  }
  return py::make_tuple(py::array_t<std::int64_t>(pattern.start.size(), pattern.start.data()),
                        py::array_t<std::int32_t>(entries, pattern.row.data()), values);
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

// Shape functions (points, nodes) at the points where stresses of materials of solids are.
py::array_t<double> bulk_shapes(const cairn::ElementInfo& e) {
  std::vector<double> xi(std::size_t(e.dim * e.bulk_points)), weight(std::size_t(e.bulk_points)),
      unused(std::size_t(e.dim * e.nodes));
  e.bulk_rule(xi.data(), weight.data());
  py::array_t<double> out({py::ssize_t(e.bulk_points), py::ssize_t(e.nodes)});
  for (int p = 0; p < e.bulk_points; ++p)
    e.shape(&xi[std::size_t(p * e.dim)], out.mutable_data() + p * e.nodes, unused.data());
  return out;
}

} // namespace

void bind_elements(py::module_& m) {
  m.def("elements", [] {
    py::list rows;
    for (const cairn::ElementInfo& e : cairn::element_infos()) {
      py::dict row;
      row["name"] = e.name;
      row["cell"] = e.cell;
      row["dim"] = e.dim;
      row["nodes"] = e.nodes;
      row["order"] = e.order;
      py::list sides;
      for (const cairn::CellSide& side : cairn::sides_of(e)) sides.append(py::cast(side));
      row["sides"] = sides;
      py::list wholes;
      for (const cairn::WholeSide& side : cairn::whole_sides_of(e))
        wholes.append(py::make_tuple(side.node, side.pieces));
      row["whole_sides"] = wholes;
      row["bulk_shapes"] = bulk_shapes(e);
      rows.append(row);
    }
    return rows;
  });
  m.def("element_matrices", &matrices);
  m.def("assembled", &assembled);
  m.def("bar_stiffness", &bars);
  m.def("beam_stiffness", &beams);
  m.def("ring_masses", &ring_masses);
  m.def("lumped_masses", &lumped);
  m.def("element_stress", &stress);
}
