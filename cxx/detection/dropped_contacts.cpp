#include "dropped_contacts.hpp"

namespace cairn::detection {

void move_contacts(Candidates& out, int dim, std::int64_t from, std::int64_t count, std::int64_t to) {
  const auto move = [&](auto& array, std::int64_t width) {
    std::copy(array.begin() + from * width, array.begin() + (from + count) * width, array.begin() + to * width);
  };
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) move(*array, 1);
  move(out.gap, 1);
  move(out.normal, dim);
  move(out.point, dim);
}

void trim_contacts(Candidates& out, int dim, std::int64_t count) {
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) array->resize(count);
  out.gap.resize(count);
  out.normal.resize(count * dim);
  out.point.resize(count * dim);
  out.count = count;
}

void DroppedContacts::spare(DeclaredPairs& declared, const PlacedScene& scene, const Candidates& out) {
  if (declared.pairs.empty()) return;
  declared.sort();
  for (std::int64_t i = 0; i < out.count; ++i)
    if (marks_[std::size_t(i)] && declared.has(scene, out, i)) marks_[std::size_t(i)] = 0;
}

void DroppedContacts::remove(Candidates& out, int dim) const {
  std::int64_t to = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (marks_[std::size_t(i)]) continue;
    if (to != i) move_contacts(out, dim, i, 1, to);
    ++to;
  }
  trim_contacts(out, dim, to);
}

} // namespace cairn::detection
