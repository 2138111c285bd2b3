// Works of loads, drag and prescribed motions over a step, at the mean of their values at both of its ends. Taken at
// the integrator's own time, their sum over steps would be of first order under varying loads even where the motion is
// of second: h/2 of the change of each load times the displacement is the integrator's work.
#include "mesh_works.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace cairn {

bool MeshWorks::weighs_an_end() const {
  return std::abs(step_.scheme.end_share - 0.5) > 4 * std::numeric_limits<double>::epsilon();
}

// The mean of loads at both ends of a step along `way` beyond those that the scheme took, into beyond_; empty: none
// act.
void MeshWorks::find_loads_beyond(const std::vector<double>& way) {
  const std::size_t n = loads_.end.empty() && loads_.pressed.empty() ? 0 : way.size();
  const double late = 0.5 - step_.scheme.end_share;
  beyond_.assign(n, 0.0);
  for (std::size_t i = 0; i < n && !loads_.end.empty(); ++i) beyond_[i] = late * (loads_.end[i] - loads_.begin[i]);
  if (loads_.pressed.empty()) return;
  std::vector<double>& x = mean;
  x.resize(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = model_.reference[i] + step_.q[i];
  for (PressedSides& sides : loads_.pressed)
    sides.press(model_.dim, x.data(), -late * sides.begin, beyond_.data(), model_.mass, 0, nullptr);
  for (std::size_t i = 0; i < n; ++i) x[i] += way[i];
  for (PressedSides& sides : loads_.pressed)
    sides.press(model_.dim, x.data(), late * sides.end, beyond_.data(), model_.mass, 0, nullptr);
}

// With elastic forces mean_ and drag drag_ in the mean of both ends, and taken_ as the scheme has their sum.
void MeshWorks::account_means(const std::vector<double>& way) {
  work_.drag = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    work_.drag += way[i] * drag[i];
    if (model_.held[i]) {
      const double more = way[i] * (mean[i] + drag[i] - taken[i]);
      work_.beyond += more;
      work_.driven += more;
    } else if (!beyond_.empty())
      work_.beyond += way[i] * beyond_[i];
  }
}

namespace {

// Moves constraint forces of slave dofs to their masters (transpose of the ties).
void to_leaders(const MeshTies& ties, std::vector<double>& force) {
  for (std::size_t t = 0; t < ties.dof.size(); ++t) {
    double& own = force[std::size_t(ties.dof[t])];
    for (auto e = std::size_t(ties.first[t]); e < std::size_t(ties.first[t + 1]); ++e)
      force[std::size_t(ties.master[e])] += ties.weight[e] * own;
    own = 0;
  }
}

} // namespace

// Counts binding work as driven work where a held dof is tied as well, since its support acts through the tie; then
// moves reactions of slave dofs to their masters.
void MeshWorks::account_ties() {
  for (std::int64_t i = 0; i < model_.dofs(); ++i)
    if (model_.held[i] && model_.ties.bound(i)) work_.driven += std::exchange(work_.binding, 0.0);
  to_leaders(model_.ties, reaction_);
}

} // namespace cairn
