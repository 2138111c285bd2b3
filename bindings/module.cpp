#include "arrays.hpp"
#include "cairn/build.h"
#include "detection/interaction_handler.hpp"

PYBIND11_MODULE(_core, m) {
  m.doc() = "Cairn's object layer; defaults and checks of a user's words are in the Python package.";
  py::register_exception<cairn::Error>(m, "Error", PyExc_ValueError);
  m.def("build_info", [] {
    py::dict info;
    info["version"] = CAIRN_VERSION;
    info["compiler"] = CAIRN_CXX_COMPILER ", " CAIRN_FORTRAN_COMPILER;
    info["flags"] = CAIRN_FLAGS;
    return info;
  });
  bind_elements(m);
  bind_laws(m);
  bind_problems(m);
  bind_reference(m);
  bind_scene(m);
  bind_simulation(m);
}
