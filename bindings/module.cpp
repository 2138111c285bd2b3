#include "arrays.hpp"
#include "cairn/build.h"
#include "detection/interaction_handler.hpp"
#include "script_error.hpp"

void bind_ranks(py::module_& m);

PYBIND11_MODULE(_core, m) {
  m.doc() = "Cairn's object layer; defaults and checks of a user's words are in the Python package.";
  static const py::handle error = py::register_exception<cairn::Error>(m, "Error", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (ScriptError& of_script) { of_script.raised.restore(); }
  });
  py::register_exception_translator([](std::exception_ptr thrown) { // std::invalid_argument of the core: an Error
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const std::invalid_argument& refused) { PyErr_SetString(error.ptr(), refused.what()); }
  });
  m.def("build_info", [] {
    py::dict info;
    info["version"] = CAIRN_VERSION;
    info["compiler"] = CAIRN_CXX_COMPILER ", " CAIRN_FORTRAN_COMPILER;
    info["flags"] = CAIRN_FLAGS;
    return info;
  });
  bind_elements(m);
  bind_expressions(m);
  bind_body_rows(m);
  bind_bulk(m);
  bind_files(m);
  bind_laws(m);
  bind_called(m);
  bind_frames(m);
  bind_problems(m);
  bind_reference(m);
  bind_scene(m);
  bind_simulation(m);
  bind_fluid(m);
  bind_ranks(m);
  bind_soe(m);
  bind_meshes(m);
  bind_networks(m);
}
