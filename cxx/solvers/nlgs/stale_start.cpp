// Impulses of the last step that are a worse start than none, where masses differ: those of an impact would throw apart
// bodies that already part. Sweeps change an impulse by about the momentum of its lighter body, so that they would take
// as many of them as the ratio of masses to take back what a heavy body brought in.
#include "../sweeps/start_work.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class StaleStart final : public NlgsPart {
public:
  explicit StaleStart(NlgsState& s) : s_(s) {}

  bool begin() override {
    double sum = 0;
    s_.system.load(s_.velocity_free);
    add_start_work(s_.system, s_.schedule, [&](double work) { sum += work; });
    if (sum > 0) {
      give_none(s_.system, s_.velocity_free);
      s_.changed = true;
    } else {
      cairn_add_impulses(&s_.schedule);
    }
    return false;
  }

private:
  NlgsState& s_;
};

} // namespace

void add_stale_start(NlgsState& s, NlgsParts& parts) {
  if (s.uneven && s.options.done == 0 && !s.system.cell && all_cones(s.system)) parts.add<StaleStart>(s);
}

} // namespace cairn
