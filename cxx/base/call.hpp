// The one place where the error of a kernel becomes a C++ exception.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>

#include "cairn/core.h"

namespace cairn {

// A call that was wrong; the message names field, index, value and remedy.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Error of a step that is too long for a moving body: a shorter step may be made from the same state.
struct StepTooLong : Error {
  using Error::Error;
};

// call(kernel, arguments...) for a kernel whose last argument is a cairn_error.
template <class Kernel, class... Arguments>
void call(Kernel&& kernel, Arguments&&... arguments) {
  cairn_error error{};
  kernel(std::forward<Arguments>(arguments)..., &error);
  if (error.code != 0) {
    error.message[sizeof error.message - 1] = '\0';
    throw Error(error.message);
  }
}

} // namespace cairn
