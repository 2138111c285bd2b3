#include "arrays.hpp"
#include "contacts/law_rows.hpp"
#include "laws/law_table.hpp"
#include "plugs/plug.hpp"
#include "scene/joint_parts.hpp"

namespace {

py::dict described(const cairn::LawInfo& law) {
  py::dict row;
  row["name"] = law.name;
  row["python_name"] = law.python_name;
  row["components"] = py::make_tuple(law.components2, law.components3);
  row["state"] = law.state;
  row["library"] = law.library;
  row["solves"] = law.has_solve;
  row["bonds"] = law.has_solve && law.anchored;
  py::list parameters;
  for (const cairn::LawParameter& p : law.parameters)
    parameters.append(py::make_tuple(p.name, p.required ? py::object(py::none()) : py::object(py::float_(p.standard)),
                                     p.smallest, p.largest));
  row["parameters"] = parameters;
  return row;
}

py::array_t<double> column(const std::vector<double>& values, std::int64_t contacts) {
  const auto n = py::ssize_t(contacts), columns = n > 0 ? py::ssize_t(values.size()) / n : 0;
  return py::array_t<double>({columns, n}, values.data());
}

// Contacts of one law, (columns, n) each, and what a law makes of them.
void bind_law_rows(py::module_& m) {
  using cairn::LawRows;
  py::class_<LawRows> rows(m, "LawRows");
  rows.def_readonly("components", &LawRows::components)
      .def_readonly("h", &LawRows::h)
      .def_readonly("theta", &LawRows::theta)
      .def_property_readonly("candidate", [](const LawRows& r) {
        return py::array_t<std::int64_t>(py::ssize_t(r.candidate.size()), r.candidate.data());
      });
  for (const auto& [name, member] : {std::pair{"gap", &LawRows::gap},
                                     {"velocity", &LawRows::velocity},
                                     {"velocity_free", &LawRows::velocity_free},
                                     {"bias", &LawRows::bias},
                                     {"delassus", &LawRows::delassus},
                                     {"impulse", &LawRows::impulse},
                                     {"params", &LawRows::params},
                                     {"geometry", &LawRows::geometry},
                                     {"state", &LawRows::state}})
    rows.def_property_readonly(
        name, [member = member](const LawRows& r) { return column(r.*member, std::int64_t(r.candidate.size())); });
  rows.def("answer", [](const LawRows& r, int law, int dim, const Input<double>& params, const Input<double>& state) {
    const auto all = [](const Input<double>& a) { return std::vector<double>(a.data(), a.data() + a.size()); };
    const cairn::LawAnswer found = cairn::answer_of(cairn::Law(law), dim, r, all(params), all(state));
    const auto n = std::int64_t(r.candidate.size());
    return py::make_tuple(column(found.impulse, n), column(found.state, n));
  });
}

} // namespace

void bind_laws(py::module_& m) {
  bind_law_rows(m);
  m.def("laws", [] {
    py::list rows;
    for (const cairn::LawInfo& law : cairn::law_infos()) rows.append(described(law));
    return rows;
  });
  m.def("joint_kinds", [] {
    py::dict kinds;
    for (const cairn::JointKind& kind : cairn::joint_kinds()) {
      py::dict row;
      row["blocked"] = py::make_tuple(kind.blocked[0], kind.blocked[1]);
      row["coordinate"] = py::make_tuple(kind.coordinate[0], kind.coordinate[1]);
      row["points"] = kind.points;
      row["turns"] = kind.turns;
      row["instead"] = kind.instead;
      kinds[kind.name] = row;
    }
    return kinds;
  });
  m.def("plug_law", [](const std::string& library, const std::string& name, bool replace, bool serial) {
    const cairn::Law law = cairn::plug_law(library, name, {replace, serial});
    return py::make_tuple(int(law), described(cairn::law_infos()[std::size_t(law)]));
  });
  py::class_<cairn::PluggedRoutine>(m, "PluggedRoutine")
      .def(py::init(&cairn::open_routine))
      .def("described", [](const cairn::PluggedRoutine& r) { return described(r.declared); })
      .def("plug_solver",
           [](const cairn::PluggedRoutine& r, const std::vector<double>& p) { cairn::plug_solver(r, p); })
      .def("plug_pair", [](const cairn::PluggedRoutine& r, const std::string& pair) { cairn::plug_pair(r, pair); });
  m.def("unplug_pair", [](const std::string& pair) { cairn::plug_pair({}, pair); });

  py::class_<cairn::LawTable>(m, "LawTable")
      .def(py::init<std::vector<std::string>, const std::vector<std::string>&>(), py::arg("materials"),
           py::arg("groups"))
      .def("rule",
           [](cairn::LawTable& t, const std::string& a, const std::string& b, int law,
              const std::vector<double>& params,
              const std::vector<std::tuple<int, std::vector<double>, std::vector<double>>>& of_temperature) {
             std::vector<cairn::LawTable::Curve> curves;
             for (const auto& [parameter, temperature, value] : of_temperature)
               curves.push_back({parameter, temperature, value});
             t.rule(a, b, cairn::Law(law), params, curves);
           })
      .def("pass_through", &cairn::LawTable::pass_through)
      .def("keep_apart",
           [](cairn::LawTable& t, const std::vector<std::int32_t>& materials) { t.keep_apart(materials); })
      .def("settle", &cairn::LawTable::settle)
      .def("find", &cairn::LawTable::find)
      .def("meet", [](const cairn::LawTable& t, int a, int b) { return t.rules().meets(t.rules().between(a, b)); });
}
