#include "declared_pairs.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "pair_kinds.hpp"

namespace cairn::detection {

namespace {

// Internal number by id: a table where ids are about as many as their range, as they are; a sorted list where they are
// not.
class IdIndex {
public:
  IdIndex(const std::int64_t* id, std::int64_t n, Array<std::int32_t>& storage) : id_(id), number_(storage) {
    for (std::int64_t i = 0; i < n; ++i) {
      low_ = i == 0 ? id[i] : std::min(low_, id[i]);
      high_ = i == 0 ? id[i] : std::max(high_, id[i]);
    }
    dense_ = n > 0 && std::uint64_t(high_) - std::uint64_t(low_) < std::uint64_t(8 * n + 1024);
    number_.assign(dense_ ? high_ - low_ + 1 : n, -1);
    for (std::int64_t i = 0; i < n; ++i) number_[dense_ ? id[i] - low_ : i] = std::int32_t(i);
    if (!dense_) std::sort(number_.begin(), number_.end(), [&](auto i, auto j) { return id[i] < id[j]; });
  }
  // -1: nobody has this id
  std::int32_t operator()(std::int64_t id) const {
    if (dense_) return id < low_ || id > high_ ? -1 : number_[id - low_];
    const auto at = std::lower_bound(number_.begin(), number_.end(), id, [&](auto i, auto v) { return id_[i] < v; });
    return at == number_.end() || id_[*at] != id ? -1 : *at;
  }

private:
  const std::int64_t* id_;
  Array<std::int32_t>& number_;
  std::int64_t low_ = 0, high_ = 0;
  bool dense_ = false;
};

// Periodic image of B that is nearest to A; -1 if none has a number.
std::int32_t nearest_image(const PlacedScene& s, std::int32_t a, std::int32_t b) {
  if (!s.any_periodic || !s.shape(a).bounded || !s.shape(b).bounded) return own_image;
  double d[3] = {0, 0, 0};
  for (int k = 0; k < s.dim; ++k) d[k] = s.centre[std::int64_t(a) * s.dim + k] - s.centre[std::int64_t(b) * s.dim + k];
  double base[3] = {0, 0, 0};
  for (int k = s.dim - 1; k >= 0; --k) {
    if (!s.periodic[k]) continue;
    base[k] = std::round(d[k] / s.cell->vectors[4 * k]);
    for (int i = 0; i <= k; ++i) d[i] -= base[k] * s.cell->vectors[i + 3 * k];
  }
  // a cell that leans by less than its width has the nearest image among the neighbours of this one
  double nearest = std::numeric_limits<double>::infinity();
  std::int32_t image = -1;
  for (int mz = -s.periodic[2]; mz <= s.periodic[2]; ++mz)
    for (int my = -s.periodic[1]; my <= s.periodic[1]; ++my)
      for (int mx = -s.periodic[0]; mx <= s.periodic[0]; ++mx) {
        const double m[3] = {base[0] + mx, base[1] + my, base[2] + mz};
        double distance = 0;
        for (int i = 0; i < 3; ++i) {
          double e = d[i];
          for (int k = 0; k < 3; ++k) e -= (m[k] - base[k]) * s.cell->vectors[i + 3 * k];
          distance += e * e;
        }
        if (distance >= nearest) continue;
        nearest = distance;
        const bool encodable = std::max({std::abs(m[0]), std::abs(m[1]), std::abs(m[2])}) <= 511;
        image = encodable ? encode_image(int(m[0]), int(m[1]), int(m[2])) : -1;
      }
  return image;
}

} // namespace

void DeclaredPairs::add_to(PairList& list, const PlacedScene& s) {
  if (pairs.empty()) return;
  const IdIndex number(s.contactors->id.values.data(), s.contactors->count, number_of_id_);
  list.reserve(list.count + std::int64_t(pairs.size()), *s.scratch);
  for (const auto& [first, second] : pairs) {
    std::int32_t a = number(std::min(first, second)), b = number(std::max(first, second));
    if (a < 0 || b < 0) continue;
    const int at = s.contactors->shape.values[a] + shapes * s.contactors->shape.values[b];
    if (kind_table.kind[at] < 0)
      throw Error("declared pair: " + name_of(*s.contactors, *s.bodies, a) + " and " +
                  name_of(*s.contactors, *s.bodies, b) + " have shapes between which no contact is defined");
    if (s.carrier[a] == s.carrier[b])
      throw Error("declared pair: " + name_of(*s.contactors, *s.bodies, a) + " and " +
                  name_of(*s.contactors, *s.bodies, b) + " are the same body; declare pairs of different bodies");
    if (kind_table.turn[at] == 1) std::swap(a, b);
    const std::int64_t i = list.count++;
    list.a[i] = a;
    list.b[i] = b;
    list.kind[i] = kind_table.kind[at];
    list.image[i] = nearest_image(s, a, b);
    if (list.image[i] >= 0) list.image[i] |= declared_bit;
  }
}

void DeclaredPairs::sort() {
  sorted_ = pairs;
  for (DeclaredPair& pair : sorted_) std::sort(pair.begin(), pair.end());
  std::sort(sorted_.begin(), sorted_.end());
}

bool DeclaredPairs::has(const PlacedScene& scene, const Candidates& out, std::int64_t i) const {
  const auto& id = scene.contactors->id.values;
  DeclaredPair pair{id[out.contactor_a[i]], id[out.contactor_b[i]]};
  std::sort(pair.begin(), pair.end());
  return std::binary_search(sorted_.begin(), sorted_.end(), pair);
}

} // namespace cairn::detection
