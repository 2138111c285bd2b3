// The plain loops of core_f90/reference, for comparisons.
#include "arrays.hpp"
#include "cairn/core.h"

namespace {

// Sweeps of the textbook's Gauss-Seidel; v (bodies, 3 or 6) and r (contacts, dim) in and out.
void plain_sweeps(int dim, int sweeps, const Input<std::int32_t>& body, const Input<double>& frame,
                  const Input<double>& lever, const Input<double>& mu, const Input<double>& bias,
                  const Input<double>& inverse_mass, const Input<double>& inverse_inertia, py::array_t<double> v,
                  py::array_t<double> r) {
  const std::int64_t n = mu.size();
  if (body.size() != 2 * n || lever.size() != 2 * n || bias.size() != n || r.size() != dim * n ||
      frame.size() != (dim == 2 ? 2 : 6) * n)
    throw cairn::Error("plain_sweeps: arrays do not agree in the number of contacts");
  const auto sweep = dim == 2 ? cairn_plain_sweep2 : cairn_plain_sweep3;
  for (int k = 0; k < sweeps; ++k)
    sweep(n, body.data(), frame.data(), lever.data(), mu.data(), bias.data(), inverse_mass.data(),
          inverse_inertia.data(), v.mutable_data(), r.mutable_data());
}

} // namespace

void bind_reference(py::module_& m) { m.def("plain_sweeps", &plain_sweeps); }
