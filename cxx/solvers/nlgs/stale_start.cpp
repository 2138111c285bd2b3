// Impulses of the last step that are a worse start than none, where masses differ: those of an impact would throw apart
// bodies that already part. Sweeps change an impulse by about the momentum of its lighter body, so that they would take
// as many of them as the ratio of masses to take back what a heavy body brought in.
#include <algorithm>

#include "../sweeps/batch.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class StaleStart final : public NlgsPart {
public:
  explicit StaleStart(NlgsState& s) : s_(s) {}

  // Contacts without friction take the impulses of the least 1/2 r.W r + r.(u_free + bias), the energy that they put
  // into bodies beyond what the law asks: 0 without impulses. A start that exceeds the energy of the free velocities of
  // contacts is stale; sweeps mend a lesser one.
  bool begin() override {
    s_.system.load(s_.velocity_free);
    double gained = work();
    cairn_add_impulses(&s_.schedule);
    gained += work();
    if (!(0.5 * gained > s_.free.energy)) return false;
    for (const cairn_batch& b : s_.system.batches)
      for (int lane = 0; lane < b.contacts; ++lane)
        for (int k = 0; k < b.components; ++k) at(b, b.r, lane, k) = 0;
    s_.system.load(s_.velocity_free);
    s_.changed = true;
    return false;
  }

private:
  // Work of the impulses over the present velocities, with half of that in their compliance [J].
  double work() const {
    double u[6 * 128], sum = 0;
    for (std::size_t k = 0; k < s_.system.batches.size(); ++k) {
      const cairn_batch& b = s_.system.batches[k];
      cairn_relative_velocities(&s_.schedule, std::int32_t(k), 0, u);
      for (int c = 0; c < b.components; ++c)
        for (int lane = 0; lane < b.contacts; ++lane) {
          const double r = at(b, b.r, lane, c);
          if (!(r > 0 || r < 0)) continue; // its bias may be none
          const double bias = b.pack && c > 0 ? 0 : at(b, b.bias, lane, c);
          const double given = b.compliance ? 0.5 * b.compliance[c * b.count + lane] * r : 0;
          sum += r * (u[c * b.count + lane] + bias + given);
        }
    }
    return sum;
  }

  NlgsState& s_;
};

} // namespace

void add_stale_start(NlgsState& s, NlgsParts& parts) {
  const auto is_cone = [](const cairn_batch& b) { return b.relaxes != 0 && b.bonds == 0; };
  if (s.uneven && !s.system.cell && std::all_of(s.system.batches.begin(), s.system.batches.end(), is_cone))
    parts.add<StaleStart>(s);
}

} // namespace cairn
