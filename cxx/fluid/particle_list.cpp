#include "particle_list.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "../base/call.hpp"
#include "../base/number_text.hpp"

namespace cairn {

// Cells no narrower than `reach`; a periodic axis has a whole number of them, three at least.
void ParticleList::lay_grid(const std::vector<double>& x, double reach) {
  const std::size_t n = x.size() / 3;
  for (std::size_t k = 0; k < 3; ++k) {
    double least = 0, high = 0;
    for (std::size_t i = 0; i < n; ++i) {
      least = i == 0 ? x[k] : std::min(least, x[3 * i + k]);
      high = i == 0 ? x[k] : std::max(high, x[3 * i + k]);
    }
    if (period[k] > 0) {
      cells_[k] = std::int64_t(period[k] / reach);
      width_[k] = period[k] / double(cells_[k]);
      corner_[k] = low[k];
      continue;
    }
    const double cells = (high - least) / reach;
    if (!(cells < 1e6))
      throw Error("the particles of the fluid are spread over " + number_text(high - least) + " m along axis " +
                  std::to_string(k) + ", a million times their reach: give walls that hold it");
    corner_[k] = least - reach; // points of surfaces may lie a cell below
    width_[k] = reach;
    cells_[k] = std::int64_t(cells) + 3;
  }
}

std::array<std::int64_t, 3> ParticleList::cell_of(const double* x) const {
  std::array<std::int64_t, 3> cell{};
  for (std::size_t k = 0; k < 3; ++k) {
    cell[k] = std::int64_t(std::floor((x[k] - corner_[k]) / width_[k]));
    if (period[k] > 0) {
      cell[k] %= cells_[k];
      if (cell[k] < 0) cell[k] += cells_[k];
    }
  }
  return cell;
}

std::vector<std::int32_t> ParticleList::order(const std::vector<double>& x, double reach) {
  lay_grid(x, reach);
  const std::size_t n = x.size() / 3;
  keys_.resize(n);
  for (std::size_t i = 0; i < n; ++i) keys_[i] = key_of(cell_of(&x[3 * i]));
  std::vector<std::int32_t> out(n);
  std::iota(out.begin(), out.end(), 0);
  std::sort(out.begin(), out.end(), [&](std::int32_t a, std::int32_t b) {
    return keys_[std::size_t(a)] != keys_[std::size_t(b)] ? keys_[std::size_t(a)] < keys_[std::size_t(b)] : a < b;
  });
  return out;
}

// f(first, last, shift): particles of each of the cells about a cell, and the way to the image of the cell.
template <class F>
void ParticleList::each_near(const std::array<std::int64_t, 3>& cell, F&& f) const {
  for (std::int64_t dz = -1; dz <= 1; ++dz)
    for (std::int64_t dy = -1; dy <= 1; ++dy)
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        std::array<std::int64_t, 3> at = {cell[0] + dx, cell[1] + dy, cell[2] + dz};
        bool within = true;
        std::array<double, 3> shift{};
        for (std::size_t k = 0; k < 3; ++k) {
          if (period[k] > 0 && (at[k] < 0 || at[k] >= cells_[k])) {
            shift[k] = at[k] < 0 ? -period[k] : period[k];
            at[k] = (at[k] + cells_[k]) % cells_[k];
          }
          within = within && at[k] >= 0 && at[k] < cells_[k];
        }
        if (!within) continue;
        const std::int64_t key = key_of(at);
        const auto found = std::lower_bound(cell_keys_.begin(), cell_keys_.end(), key);
        if (found == cell_keys_.end() || *found != key) continue;
        const auto c = std::size_t(found - cell_keys_.begin());
        f(cell_first_[c], cell_first_[c + 1], shift);
      }
}

void ParticleList::make(double reach, const double* points, std::int64_t count, int stride) {
  lay_grid(at, reach);
  const auto n = std::int64_t(at.size() / 3);
  keys_.resize(std::size_t(n));
  cell_keys_.clear();
  cell_first_.clear();
  for (std::int64_t i = 0; i < n; ++i) {
    keys_[std::size_t(i)] = key_of(cell_of(&at[std::size_t(3 * i)]));
    if (cell_keys_.empty() || cell_keys_.back() != keys_[std::size_t(i)]) {
      cell_keys_.push_back(keys_[std::size_t(i)]);
      cell_first_.push_back(i);
    }
  }
  cell_first_.push_back(n);
  first.assign(std::size_t(n + 1), 0);
  const auto cells = std::int64_t(cell_keys_.size());
  for (const bool count_alone : {true, false}) {
#pragma omp parallel for schedule(dynamic, 16)
    for (std::int64_t c = 0; c < cells; ++c) {
      struct Range {
        std::int64_t first, last;
        std::array<double, 3> shift;
      };
      std::array<Range, 27> ranges;
      std::size_t many = 0;
      each_near(cell_of(&at[std::size_t(3 * cell_first_[std::size_t(c)])]),
                [&](std::int64_t a, std::int64_t b, const std::array<double, 3>& shift) {
                  ranges[many++] = {a, b, shift};
                });
      for (std::int64_t i = cell_first_[std::size_t(c)]; i < cell_first_[std::size_t(c + 1)]; ++i) {
        std::int64_t found = count_alone ? 0 : first[std::size_t(i)];
        for (std::size_t r = 0; r < many; ++r) {
          const Range& range = ranges[r];
          const double x = at[std::size_t(3 * i)] - range.shift[0], y = at[std::size_t(3 * i + 1)] - range.shift[1],
                       z = at[std::size_t(3 * i + 2)] - range.shift[2];
          for (std::int64_t j = range.first; j < range.last; ++j) {
            const double* other = &at[std::size_t(3 * j)];
            const double dx = x - other[0], dy = y - other[1], dz = z - other[2];
            if (j == i || !(dx * dx + dy * dy + dz * dz < reach * reach)) continue;
            if (!count_alone) neighbour[std::size_t(found)] = std::int32_t(j);
            ++found;
          }
        }
        if (count_alone) first[std::size_t(i + 1)] = found;
      }
    }
    if (!count_alone) break;
    for (std::int64_t i = 0; i < n; ++i) first[std::size_t(i + 1)] += first[std::size_t(i)];
    neighbour.resize(std::size_t(first.back()));
  }
  // Points ask for the particles about them; particles then have theirs by rising number.
  about(reach, points, count, stride, first_of_point, particle);
  first_point.assign(std::size_t(n + 1), 0);
  for (const std::int32_t i : particle) ++first_point[std::size_t(i + 1)];
  for (std::int64_t i = 0; i < n; ++i) first_point[std::size_t(i + 1)] += first_point[std::size_t(i)];
  point.resize(particle.size());
  std::vector<std::int64_t> next(first_point.begin(), first_point.end() - 1);
  for (std::int64_t b = 0; b < count; ++b)
    for (std::int64_t k = first_of_point[std::size_t(b)]; k < first_of_point[std::size_t(b + 1)]; ++k)
      point[std::size_t(next[std::size_t(particle[std::size_t(k)])]++)] = std::int32_t(b);
}

void ParticleList::about(double reach, const double* points, std::int64_t count, int stride,
                         std::vector<std::int64_t>& first_of, std::vector<std::int32_t>& particles) const {
  const auto near = [&](const double* a, const double* b) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      double d = a[k] - b[k];
      if (period[k] > 0) d -= period[k] * std::round(d / period[k]);
      square += d * d;
    }
    return square < reach * reach;
  };
  first_of.assign(std::size_t(count + 1), 0);
  particles.clear();
  for (std::int64_t b = 0; b < count; ++b) {
    const double* x = points + stride * b;
    bool there = std::isfinite(x[0]);
    const std::array<std::int64_t, 3> cell = there ? cell_of(x) : std::array<std::int64_t, 3>{};
    for (std::size_t k = 0; k < 3; ++k)
      there = there && (period[k] > 0 || (x[k] >= corner_[k] - width_[k] && cell[k] <= cells_[k]));
    if (there)
      each_near(cell, [&](std::int64_t a, std::int64_t e, const std::array<double, 3>&) {
        for (std::int64_t i = a; i < e; ++i)
          if (near(x, &at[std::size_t(3 * i)])) particles.push_back(std::int32_t(i));
      });
    first_of[std::size_t(b + 1)] = std::int64_t(particles.size());
  }
}

std::int64_t ParticleList::bytes() const {
  const auto of = [](const auto& v) { return std::int64_t(v.capacity() * sizeof(v[0])); };
  return of(at) + of(first) + of(neighbour) + of(first_point) + of(point) + of(first_of_point) + of(particle) +
         of(keys_) + of(cell_keys_) + of(cell_first_);
}

} // namespace cairn
