// Systems of linear equations, as python/cairn/run/soe.py gives them: compressed columns of scipy.
#include "soe/soe.hpp"

#include "arrays.hpp"

namespace {

using cairn::Soe;
using cairn::SoeStatus;

template <class Choice>
Choice choice_of(const char* what, const std::string& name, const std::vector<std::string>& names) {
  std::string all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return Choice(i);
    all += (i == 0 ? "" : ", ") + names[i];
  }
  throw cairn::Error(std::string(what) + " is '" + name + "': give " + all);
}

std::string refusal(const Soe& soe, const SoeStatus& status, bool symmetric) {
  const std::string what = "a matrix of " + std::to_string(soe.size()) + " unknowns",
                    at = status.row < 0 ? "" : "; it shows at unknown " + std::to_string(status.row);
  if (status.kind == SoeStatus::not_finite)
    return "the matrix holds a number that is not finite: check stiffness, mass and step" + at;
  if (status.kind == SoeStatus::too_large) return what + " has factors too large for this machine";
  if (!symmetric) return what + " is singular" + at;
  return what + " is not positive definite: a mass, a stiffness or a held dof is missing" + at;
}

// The matrix of a system, factorised. Values of a symmetric one are those of its lower triangle.
class BoundSoe {
public:
  BoundSoe(std::int64_t n, const Input<std::int64_t>& indptr, const Input<std::int32_t>& indices,
           const Input<double>& data, const std::string& storage, const std::string& order, const std::string& blocks,
           const std::optional<Input<bool>>& held) {
    cairn::SparseMatrix a;
    a.n = n;
    a.start.assign(indptr.data(), indptr.data() + indptr.size());
    a.row.assign(indices.data(), indices.data() + indices.size());
    cairn::SoeOptions options;
    options.storage = choice_of<cairn::SoeStorage>(
        "storage", storage, {"automatic", "diagonal", "banded", "dense", "sparse", "unsymmetric"});
    options.order = choice_of<cairn::SoeOrder>("order", order, {"automatic", "amd", "metis", "natural"});
    options.blocks = choice_of<cairn::SoeBlocks>("blocks", blocks, {"automatic", "simplicial", "supernodal", "own"});
    if (held) options.held.assign(held->data(), held->data() + held->size());
    entries_ = a.row.size();
    symmetric_ = options.storage != cairn::SoeStorage::unsymmetric;
    soe_ = Soe::make(a, options);
    factor(data);
  }

  void factor(const Input<double>& data) {
    if (std::size_t(data.size()) != entries_)
      throw cairn::Error("the matrix has " + std::to_string(data.size()) + " values for " + std::to_string(entries_) +
                         " entries");
    SoeStatus status;
    {
      const py::gil_scoped_release release;
      status = soe_->factor(data.data());
    }
    if (!status) throw cairn::Error(refusal(*soe_, status, symmetric_));
  }

  py::array_t<double> solve(const Input<double>& b, int threads) const {
    const std::int64_t n = soe_->size();
    if ((b.ndim() != 1 && b.ndim() != 2) || b.shape(b.ndim() - 1) != n)
      throw cairn::Error("right sides must be (" + std::to_string(n) + ",) or (m, " + std::to_string(n) + ")");
    py::array_t<double> x(std::vector<py::ssize_t>(b.shape(), b.shape() + b.ndim()));
    std::copy(b.data(), b.data() + b.size(), x.mutable_data());
    double* const data = x.mutable_data();
    const std::int64_t columns = b.ndim() == 1 ? 1 : b.shape(0);
    const py::gil_scoped_release release;
    soe_->solve(data, columns, threads);
    return x;
  }

  py::array_t<double> solve_units(const Input<std::int32_t>& indices, int threads) const {
    const py::ssize_t m = indices.size();
    py::array_t<double> out({m, m});
    soe_->solve_units({indices.data(), std::size_t(m)}, out.mutable_data(), threads);
    return out;
  }

  const Soe& soe() const { return *soe_; }

private:
  std::unique_ptr<Soe> soe_;
  std::size_t entries_ = 0;
  bool symmetric_ = true;
};

} // namespace

void bind_soe(py::module_& m) {
  m.attr("suitesparse") = cairn::soe_licence();
  py::class_<BoundSoe>(m, "Soe",
                       "Equations of one pattern (compressed columns; of a symmetric matrix the lower triangle), "
                       "factorised when made; right sides (m, n), one a row.")
      .def(py::init<std::int64_t, const Input<std::int64_t>&, const Input<std::int32_t>&, const Input<double>&,
                    const std::string&, const std::string&, const std::string&, const std::optional<Input<bool>>&>(),
           py::arg("n"), py::arg("indptr"), py::arg("indices"), py::arg("data"), py::arg("storage") = "automatic",
           py::arg("order") = "automatic", py::arg("blocks") = "automatic", py::arg("held") = py::none())
      .def("factor", &BoundSoe::factor, py::arg("data"))
      .def("solve", &BoundSoe::solve, py::arg("b"), py::arg("threads") = 1)
      .def("solve_units", &BoundSoe::solve_units, py::arg("indices"), py::arg("threads") = 1)
      .def_property_readonly("storage", [](const BoundSoe& s) { return s.soe().storage(); })
      .def_property_readonly("library", [](const BoundSoe& s) { return s.soe().library(); })
      .def_property_readonly("bytes", [](const BoundSoe& s) { return s.soe().bytes(); })
      .def_property_readonly("entries", [](const BoundSoe& s) { return s.soe().entries(); });
}
