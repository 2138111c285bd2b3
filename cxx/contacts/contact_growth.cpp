// Bodies that grow push each other apart: laws that leave an overlap alone would not see it come from growth.
#include "contact_growth.hpp"

#include <algorithm>

#include "../solvers/sweeps/batch.hpp"

namespace cairn {

// How far the surfaces of a contact came together by what its bodies grew in a step [m].
double ContactGrowth::grown_at(const cairn_batch& b, int lane, const Field<double>& stretch,
                               const Field<double>& bend) const {
  const int d = in_.dim();
  const auto side = [&](bool mapped, std::int32_t body, std::int32_t kind, double* lever) {
    if (mapped) return 0.0;
    if (is_radial(kind)) return *stretch[body] * at(b, lever, lane, 0);
    double across = 0, square = 0, along = 0, normal = 0; // (b.l) l.n - b.n l.l/2 of what bent by b
    for (int k = 0; k < d; ++k) {
      const double l = at(b, lever, lane, k), n = at(b, b.frame, lane, k), by = bend.active ? bend[body][k] : 0;
      across += l * n;
      square += l * l;
      along += by * l;
      normal += by * n;
    }
    return *stretch[body] * across + (along * across - normal * square / 2);
  };
  return side(b.mapped_b, b.body_b[lane], b.side_b, b.lever_b) - side(b.mapped_a, b.body_a[lane], b.side_a, b.lever_a);
}

// Undoes within this step the overlap made by growth in the last step, and no more. Laws whose bias corrects overlaps
// have done so; laws that close gaps close those left by shrinking.
void ContactGrowth::add(const cairn_batch& b, const double* gap, double* bias) const {
  const BatchStorage::LawColumns& own = storage_.columns_of(b);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t here = b.first + lane;
    const double grown = grown_at(b, lane, in_.bodies->stretch, in_.bodies->bend);
    storage_.parted[here] = std::clamp(grown, std::min(0.0, -gap[lane]), std::max(0.0, -gap[lane])) / in_.h;
    if (!(storage_.parted[here] > 0) || bias[lane] < 0) continue;
    bias[lane] -= storage_.parted[here];
    if (own.flight) own.flight[lane] -= storage_.parted[here]; // no opening of what the law keeps, either
  }
}

// Growing surfaces act as moving carriers. Their work on the bodies is heat's, the rest of a contact's work is
// dissipated or created. It goes by the mean of velocities before and after the step; before it contacts under pressure
// moved at the growth of that time.
double ContactGrowth::work_at(const cairn_batch& b, int lane) const {
  const int kept = memory_.impulse_components;
  const double push = at(b, b.r, lane, 0);
  if (push < 0 && law_infos()[b.law].energy) return 0; // springs in tension tell their stored energy
  double speed = storage_.parted[b.first + lane];
  if (const std::int32_t was = matcher_.place[b.first + lane]; was >= 0 && memory_.h > 0) {
    const double* r = &memory_.impulses[std::size_t(was) * kept];
    const bool pressed = std::any_of(r, r + kept, [](double p) { return p < 0 || p > 0; });
    // an overlap that laws left alone takes up what shrank
    const double left = in_.candidates->gap[system_.candidate[b.first + lane]] +
                        grown_at(b, lane, in_.bodies->stretch, in_.bodies->bend);
    const double was_grown = grown_at(b, lane, in_.bodies->stretch_before, in_.bodies->bend_before);
    if (pressed) speed += (was_grown < 0 ? std::min(0.0, was_grown - std::min(0.0, left)) : was_grown) / memory_.h;
  }
  return 0.5 * push * speed;
}

void ContactGrowth::count() const {
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const double given = 0.5 * b.scale[lane], work = work_at(b, lane);
      if (!(work < 0 || work > 0)) continue;
      b.scale[lane] -= 2 * work;
      energy_.grown += work;
      energy_.normal += work;
      energy_.created += std::max(0.0, given - work) - std::max(0.0, given);
      energy_.turned_over += std::abs(given - work) + std::abs(work) - std::abs(given);
    }
}

} // namespace cairn
