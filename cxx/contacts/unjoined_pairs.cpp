// Bodies that came in touching under a law that joins by the area of a contact, where there is none: nothing holds
// them, and nobody would see it.
#include "new_bonds.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace cairn {

namespace {

// Bodies that joints hold together, each by the number of one of them.
class Pieces {
public:
  explicit Pieces(std::int64_t count) : of_(std::size_t(count)) { std::iota(of_.begin(), of_.end(), 0); }
  std::int64_t find(std::int64_t i) {
    while (of_[std::size_t(i)] != i) i = of_[std::size_t(i)] = of_[std::size_t(of_[std::size_t(i)])];
    return i;
  }
  void join(std::int64_t i, std::int64_t j) { of_[std::size_t(find(i))] = find(j); }

private:
  std::vector<std::int64_t> of_;
};

} // namespace

// Warning about joined candidates without an area. Corners in a wall of bricks touch, too: pairs held together by other
// joints are left out, and all fixed bodies count as one piece.
std::string NewBonds::warn_of_unjoined(std::span<const std::int32_t> joined, std::span<const std::int32_t> bare) const {
  if (bare.empty()) return {};
  const std::int64_t meshes_there = in_.meshes ? std::int64_t(in_.meshes->meshes.size()) : 0, n = in_.bodies->count;
  const auto unit = [&](std::int32_t contactor) -> std::int64_t {
    const std::int32_t carrier = in_.body(contactor);
    if (carrier < 0) return n + in_.meshes->mesh_of(contactor);
    const double* mass = in_.bodies->inverse_mass[carrier];
    return std::any_of(mass, mass + 3 * (in_.dim() - 1), [](double m) { return m > 0; }) ? carrier : n + meshes_there;
  };
  Pieces pieces(n + meshes_there + 1);
  for (const std::int32_t i : joined)
    pieces.join(unit(in_.candidates->contactor_a[i]), unit(in_.candidates->contactor_b[i]));
  std::vector<std::pair<std::int64_t, std::int64_t>> told;
  std::int32_t first = -1;
  for (const std::int32_t i : bare) {
    const std::int32_t a = in_.candidates->contactor_a[i], b = in_.candidates->contactor_b[i];
    if (pieces.find(unit(a)) == pieces.find(unit(b))) continue;
    if (first < 0) first = i;
    told.push_back(std::minmax<std::int64_t>(in_.body(a), in_.body(b)));
  }
  if (first < 0) return {};
  std::sort(told.begin(), told.end());
  const std::int64_t others = std::unique(told.begin(), told.end()) - told.begin() - 1;
  const std::int32_t a = in_.candidates->contactor_a[first], b = in_.candidates->contactor_b[first];
  const auto name = [&](std::int32_t contactor) {
    const std::int32_t carrier = in_.body(contactor);
    return (carrier < 0 ? "the mesh '" + in_.meshes->meshes[in_.meshes->mesh_of(contactor)].model.name + "'"
                        : "body " + std::to_string(*in_.bodies->id[carrier])) +
           " of '" + in_.laws->name(*in_.contactors->material[contactor]) + "'";
  };
  return "law " + classes_.law(first).python_name + " does not join " + name(a) + " and " + name(b) +
         (others > 0 ? ", nor " + std::to_string(others) + " more pairs of bodies" : "") +
         ": they touch along a line, at a corner or on a side of no known curvature, where there is no area for its "
         "stresses; give Bonded, or ParallelBond with a radius, to what is to hold there";
}

} // namespace cairn
