// Numbers in messages: six digits, and a power of ten where they are far from 1.
#pragma once
#include <cstdio>
#include <string>

namespace cairn {

inline std::string number_text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

} // namespace cairn
