#pragma once
// Products of vectors.
#include <array>
#include <cstdint>

namespace cairn {

inline double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) { return dot(a.data(), b.data()); }
inline double dot(const double* a, const double* b, std::int64_t n) {
  double sum = 0;
  for (std::int64_t i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}
template <class Values>
requires requires(const Values& values) { values.data() + values.size(); }
double dot(const Values& a, const Values& b) { return dot(a.data(), b.data(), std::int64_t(a.size())); }

inline void cross(const double* a, const double* b, double* out) {
  for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}
inline std::array<double, 3> cross(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  std::array<double, 3> out;
  cross(a.data(), b.data(), out.data());
  return out;
}
inline void add_cross(const double* a, const double* b, double* out) {
  double more[3];
  cross(a, b, more);
  for (int k = 0; k < 3; ++k) out[k] += more[k];
}

} // namespace cairn
