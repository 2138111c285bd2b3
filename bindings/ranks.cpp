#include "ranks/exact_sum.hpp"
#include "ranks/growth.hpp"
#include "ranks/meetings.hpp"
#include "ranks/over_ranks.hpp"

#include "alone.hpp"
#include "arrays.hpp"

using cairn::Simulation;

namespace {

cairn::OverRanks& ranked(Simulation& s) {
  if (auto* found = dynamic_cast<cairn::OverRanks*>(&s.strategy())) return *found;
  throw cairn::Error("the simulation does not run over ranks: give ranks to cairn.Simulation");
}

template <class T>
py::array_t<T> array_of(const std::vector<T>& v) {
  return py::array_t<T>(py::ssize_t(v.size()), v.data());
}

py::dict counts_over_ranks(const Input<double>& position, const Input<double>& radius,
                           const Input<std::int64_t>& contacts, double reach, int ranks) {
  const auto span = [](const auto& a) { return std::span(a.data(), std::size_t(a.size())); };
  if (position.ndim() != 2) throw cairn::Error("position: give an array (n, dim)");
  const cairn::RankCounts found =
      cairn::count_over_ranks(int(position.shape(1)), span(position), span(radius), span(contacts), reach, ranks);
  py::dict out;
  out["colours"] = found.colours;
  out["bodies"] = array_of(found.bodies);
  out["ghosts"] = array_of(found.ghosts);
  out["contacts"] = array_of(found.contacts);
  out["neighbours"] = array_of(found.neighbours);
  out["messages"] = array_of(found.messages);
  out["bytes"] = array_of(found.bytes);
  out["ghost_bytes"] = array_of(found.ghost_bytes);
  return out;
}

} // namespace

void bind_ranks(py::module_& m) {
  py::class_<cairn::Exchange, std::shared_ptr<cairn::Exchange>>(m, "Exchange")
      .def_property_readonly("name", &cairn::Exchange::name)
      .def_property_readonly("ranks", &cairn::Exchange::ranks)
      .def_property_readonly("local", &cairn::Exchange::local)
      .def("differ", // for each value, true if ranks have unlike ones
           [](cairn::Exchange& e, const std::vector<double>& values) {
             std::vector<double> both = values;
             for (const double value : values) both.push_back(-value);
             e.largest(both);
             std::vector<bool> unlike;
             for (std::size_t i = 0; i < values.size(); ++i) unlike.push_back(both[i] != -both[values.size() + i]);
             return unlike;
           })
      .def("meet", [](cairn::Exchange& e, const std::string& call) { e.meet(call); })
      .def("fail", [](cairn::Exchange& e, const std::string& error) { e.fail(error); })
      .def("abort", [](cairn::Exchange& e, int code) { e.abort(code); });
  m.def("virtual_ranks", [](int ranks) { return std::shared_ptr<cairn::Exchange>(cairn::virtual_ranks(ranks)); });
  m.def(
      "mpi_ranks",
      [](const std::string& path, std::optional<std::int64_t> communicator) { // None: MPI_COMM_WORLD
        return std::shared_ptr<cairn::Exchange>(cairn::mpi_ranks(path, communicator.value_or(cairn::mpi_world)));
      },
      py::arg("path"), py::arg("communicator") = py::none());
  m.def("over_ranks", [](Simulation& s, const std::shared_ptr<cairn::Exchange>& exchange, bool once_a_sweep) {
    s.use(
        cairn::over_ranks(s.strategy().fresh(), exchange, once_a_sweep ? cairn::Rhythm::sweep : cairn::Rhythm::colour));
    s.strategy().check_laws(s);
  });
  m.def("release_workspace", &cairn::release_workspace);     // of a step, which parts have
  m.def("return_freed_memory", &cairn::return_freed_memory); // to the operating system
  m.def("gather_ranks", [](Simulation& s) { ranked(s).gather(s); });
  m.def("leave_state_with_ranks", [](Simulation& s, bool leave) { ranked(s).leave_state(leave); });
  m.def("end_ranks", [] { cairn::Meetings::all().end(); }); // at the end of the program
  m.def("any_rank", [](Simulation& s, bool value, const std::string& call) { return ranked(s).any(value, call); });
  m.def("hold_whole", [](Simulation& s) { // arrays of it are shown without a copy
    if (auto* found = dynamic_cast<cairn::OverRanks*>(&s.strategy())) found->hold_whole();
  });
  m.def("owners_of_bodies", [](Simulation& s) { return array_of(ranked(s).owners(s)); });
  m.def("bytes_of_ranks", [](Simulation& s) { return array_of(ranked(s).bytes_of_ranks()); });
  m.def("counts_over_ranks", &counts_over_ranks);
  m.def("exact_sum", [](const Input<double>& values) {
    cairn::ExactSum sum;
    for (py::ssize_t i = 0; i < values.size(); ++i) sum.add(values.data()[i]);
    return sum.value();
  });
}
