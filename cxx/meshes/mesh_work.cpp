// Works of loads, drag and prescribed motions over a step, at the mean of their values at both of its ends. Taken at
// the integrator's own time, their sum over steps would be of first order under varying loads even where the motion is
// of second: h/2 of the change of each load times the displacement is the integrator's work.
#include "mesh_body.hpp"

#include <cmath>
#include <limits>

namespace cairn {

bool MeshBody::weighs_an_end() const {
  return std::abs(scheme_.end_share - 0.5) > 4 * std::numeric_limits<double>::epsilon();
}

// The mean of loads at both ends of a step along `way` beyond those that the scheme took, into loads_; empty: none act.
void MeshBody::find_loads_beyond(const std::vector<double>& way) {
  const std::size_t n = load_end.empty() && pressed.empty() ? 0 : way.size();
  const double late = 0.5 - scheme_.end_share;
  loads_.assign(n, 0.0);
  for (std::size_t i = 0; i < n && !load_end.empty(); ++i) loads_[i] = late * (load_end[i] - load_begin[i]);
  if (pressed.empty()) return;
  std::vector<double>& x = mean_;
  x.resize(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = model.reference[i] + q_[i];
  for (PressedSides& sides : pressed)
    sides.press(model.dim, x.data(), -late * sides.begin, loads_.data(), model.mass, 0, nullptr);
  for (std::size_t i = 0; i < n; ++i) x[i] += way[i];
  for (PressedSides& sides : pressed)
    sides.press(model.dim, x.data(), late * sides.end, loads_.data(), model.mass, 0, nullptr);
}

// With elastic forces mean_ and drag drag_ in the mean of both ends, and taken_ as the scheme has their sum.
void MeshBody::account_means(const std::vector<double>& way) {
  work.drag = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    work.drag += way[i] * drag_[i];
    if (model.held[i]) {
      const double more = way[i] * (mean_[i] + drag_[i] - taken_[i]);
      work.beyond += more;
      work.driven += more;
    } else if (!loads_.empty())
      work.beyond += way[i] * loads_[i];
  }
}

// Works of a body with linear forces; `pull` is K `way`.
void MeshBody::account_linear_means(const std::vector<double>& way, const std::vector<double>& pull) {
  work.drag = work.damping;
  if (!weighs_an_end()) return;
  find_loads_beyond(way);
  mean_.resize(way.size());
  drag_.resize(way.size());
  for (std::size_t i = 0; i < way.size(); ++i) {
    mean_[i] = stiff_q_[i] + 0.5 * pull[i];
    drag_[i] = 0.5 * (damped_begin_[i] + damped_[i]);
  }
  account_means(way);
}

// Works of a non-linear body, with internal forces at both ends.
void MeshBody::account_bulk_means(const std::vector<double>& end) {
  work.drag = work.damping;
  if (!weighs_an_end()) return;
  const std::size_t n = end.size();
  way_.resize(n);
  for (std::size_t i = 0; i < n; ++i) way_[i] = way_of(i, end[i]);
  find_loads_beyond(way_);
  mean_.resize(n);
  drag_.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) mean_[i] = 0.5 * (v_[i] + end[i]);
  if (damps_) damping_times(mean_.data(), drag_.data());
  for (std::size_t i = 0; i < n; ++i) mean_[i] = 0.5 * (force_begin_[i] + force_end_[i]);
  account_means(way_);
}

} // namespace cairn
