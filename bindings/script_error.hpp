// Exceptions of the script's functions that the core calls.
#pragma once
#include <pybind11/pybind11.h>

#include "base/call.hpp"

// Within the core it is an Error, which may pass on all ranks alike; Python gets the exception itself.
struct ScriptError : cairn::Error {
  explicit ScriptError(const pybind11::error_already_set& from) : Error(from.what()), raised(from) {}
  pybind11::error_already_set raised;
};

// f(), which calls Python and holds its lock.
template <class F>
decltype(auto) by_script(F&& f) {
  try {
    return f();
  } catch (const pybind11::error_already_set& raised) {
    throw ScriptError(raised);
  } catch (const pybind11::cast_error& e) {
    throw cairn::Error(std::string("a function of the script gives a value of another type than is expected: ") +
                       e.what());
  }
}
