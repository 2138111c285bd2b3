// Contacts that rest on bodies, as a solver over bodies of a script wants them: kernels of core_f90 on arrays.
#include <algorithm>

#include "arrays.hpp"
#include "cairn/core.h"

namespace {

using Bodies = Input<std::int32_t>;
using Places = Input<std::int64_t>;
using Numbers = Input<double>;

struct Sizes {
  std::int32_t dim, dofs;
  std::int64_t contacts;
};

// Sizes from rows (contacts, 2, dofs, dim), the maps from a contact to both of its bodies (contacts, 2); bodies count
// from 0, -1: fixed.
Sizes sizes_of(const Bodies& body, const Numbers& rows, std::int64_t bodies) {
  if (rows.ndim() != 4 || rows.shape(1) != 2 || body.ndim() != 2 || body.shape(1) != 2 ||
      body.shape(0) != rows.shape(0) || (rows.shape(3) != 2 && rows.shape(3) != 3) ||
      rows.shape(2) != 3 * rows.shape(3) - 3)
    throw cairn::Error("rows: give (contacts, 2, dofs, dim), and bodies (contacts, 2)");
  for (py::ssize_t i = 0; i < body.size(); ++i)
    if (body.data()[i] < -1 || body.data()[i] >= bodies)
      throw cairn::Error("rows: body " + std::to_string(body.data()[i]) + " of " + std::to_string(bodies));
  return {std::int32_t(rows.shape(3)), std::int32_t(rows.shape(2)), rows.shape(0)};
}

void check(bool fits, const char* what) {
  if (!fits) throw cairn::Error(std::string("rows: ") + what + " has another number of items");
}

// u = H'v + q, (contacts, dim).
py::array_t<double> velocities(const Bodies& body, const Numbers& rows, const Numbers& v, const Numbers& q) {
  const std::int64_t bodies = v.ndim() == 2 ? v.shape(0) : 0;
  const Sizes s = sizes_of(body, rows, bodies);
  check(v.size() == bodies * s.dofs, "v");
  check(q.size() == s.contacts * s.dim, "q");
  py::array_t<double> u({py::ssize_t(s.contacts), py::ssize_t(s.dim)});
  cairn_body_velocities(s.dim, s.dofs, s.contacts, bodies, body.data(), rows.data(), v.data(), q.data(),
                        u.mutable_data());
  return u;
}

// H r, (bodies, dofs).
py::array_t<double> impulses(const Bodies& body, const Numbers& rows, const Numbers& r, std::int64_t bodies) {
  const Sizes s = sizes_of(body, rows, bodies);
  check(r.size() == s.contacts * s.dim, "r");
  py::array_t<double> p({py::ssize_t(bodies), py::ssize_t(s.dofs)});
  cairn_body_impulses(s.dim, s.dofs, s.contacts, bodies, body.data(), rows.data(), r.data(), p.mutable_data());
  return p;
}

// Adds H answer H' to blocks (n, dofs, dofs) in place. diagonal: indices of the blocks of bodies; place (contacts, 2):
// of the blocks (B, A) and (A, B) of each contact, -1 where the pattern has none.
void add_stiffness(const Bodies& body, const Numbers& rows, const Numbers& answer, const Places& diagonal,
                   const Places& place, py::array_t<double, py::array::c_style> blocks) {
  const Sizes s = sizes_of(body, rows, diagonal.size());
  const std::int64_t count = blocks.size() / (s.dofs * s.dofs);
  check(answer.size() == s.contacts * s.dim * s.dim, "answer");
  check(place.size() == 2 * s.contacts, "place");
  const auto beyond = [&](const Places& of) {
    return std::any_of(of.data(), of.data() + of.size(), [&](std::int64_t at) { return at < -1 || at >= count; });
  };
  check(!beyond(diagonal) && !beyond(place), "blocks");
  cairn_newton_add_body_blocks(s.dim, s.dofs, s.contacts, diagonal.size(), body.data(), rows.data(), answer.data(),
                               diagonal.data(), place.data(), count, blocks.mutable_data());
}

// y = (D + L + L') x, (bodies, dofs), of a symmetric matrix that is kept as blocks (n, dofs, dofs) of D + L, the last
// of each row that of its body.
py::array_t<double> half_product(const Places& row_start, const Bodies& column, const Numbers& blocks,
                                 const Numbers& x) {
  check(x.ndim() == 2 && row_start.size() == x.shape(0) + 1, "x");
  const std::int64_t bodies = x.shape(0), dofs = x.shape(1);
  check((dofs == 3 || dofs == 6) && blocks.size() == column.size() * dofs * dofs &&
            row_start.data()[bodies] == column.size(),
        "blocks");
  py::array_t<double> y({x.shape(0), x.shape(1)});
  cairn_half_product(std::int32_t(dofs), bodies, row_start.data(), column.data(), blocks.data(), x.data(),
                     y.mutable_data());
  return y;
}

// The nearest points of Coulomb's cones to r (contacts, dim), with mu (contacts).
py::array_t<double> on_cones(const Numbers& r, const Numbers& mu) {
  check(r.ndim() == 2 && (r.shape(1) == 2 || r.shape(1) == 3) && mu.size() == r.shape(0), "mu");
  py::array_t<double> out({r.shape(0), r.shape(1)});
  std::copy_n(r.data(), r.size(), out.mutable_data());
  cairn_project_cones(std::int32_t(r.shape(1)), mu.size(), mu.data(), out.mutable_data());
  return out;
}

// The derivatives (contacts, dim, dim) of these points by r, times weights (contacts).
py::array_t<double> cone_derivatives(const Numbers& r, const Numbers& mu, const Numbers& weight) {
  check(r.ndim() == 2 && (r.shape(1) == 2 || r.shape(1) == 3) && mu.size() == r.shape(0), "mu");
  check(weight.size() == mu.size(), "weight");
  py::array_t<double> out({r.shape(0), r.shape(1), r.shape(1)});
  cairn_cone_derivatives(std::int32_t(r.shape(1)), mu.size(), mu.data(), weight.data(), r.data(), out.mutable_data());
  return out;
}

} // namespace

void bind_body_rows(py::module_& m) {
  m.def("rows_velocities", &velocities);
  m.def("rows_impulses", &impulses);
  m.def("rows_add_stiffness", &add_stiffness);
  m.def("half_product", &half_product);
  m.def("project_on_cones", &on_cones);
  m.def("cone_derivatives", &cone_derivatives);
}
