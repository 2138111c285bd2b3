// Memory of arrays whose numbers are zero.
#pragma once
#include <cstddef>

namespace cairn {

// Gives long runs of pages that hold zeros alone back to the operating system, within the bytes from `first` on: they
// read as zeros, and take memory again once they are written. On Linux; elsewhere it does nothing.
void give_back_zero_pages(const void* first, std::size_t bytes);

} // namespace cairn
