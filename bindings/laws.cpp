#include "arrays.hpp"
#include "interaction.hpp"

void bind_laws(py::module_& m) {
  m.def("laws", [] {
    py::list rows;
    for (const cairn::LawInfo& law : cairn::law_infos()) {
      py::dict row;
      row["name"] = law.name;
      row["python_name"] = law.python_name;
      row["components"] = py::make_tuple(law.components2, law.components3);
      row["state"] = law.state;
      py::list parameters;
      for (const cairn::LawParameter& p : law.parameters)
        parameters.append(py::make_tuple(
            p.name, p.required ? py::object(py::none()) : py::object(py::float_(p.standard)), p.smallest, p.largest));
      row["parameters"] = parameters;
      rows.append(row);
    }
    return rows;
  });

  py::class_<cairn::LawTable>(m, "LawTable")
      .def(py::init<std::vector<std::string>>(), py::arg("material_names"))
      .def("set", [](cairn::LawTable& t, int a, int b, int law,
                     const std::vector<double>& params) { t.set(a, b, cairn::Law(law), params); })
      .def("set_default", [](cairn::LawTable& t, int law,
                             const std::vector<double>& params) { t.set_default(cairn::Law(law), params); })
      .def("find", &cairn::LawTable::find);
}
