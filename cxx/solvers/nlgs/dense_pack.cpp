// Early end of steps of dense packs: their force chains build up over several steps, each of which begins with the
// impulses of the last, so that later steps reduce the residual of this one.
#include <algorithm>

#include "../policy.hpp"
#include "../sweeps/batch.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

// Notes in their status, which is written at the end, which contacts begin with an impulse.
void mark_loaded(const ContactSystem& system) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) b.status[lane] = at(b, b.r, lane, 0) > 0;
}

// Full blocks of cones in space are refined from the sweep before, in less than half of the time of their solution.
void refine_cones(ContactSystem& system) {
  for (cairn_batch& b : system.batches)
    if (b.solve == cairn_cone_full3 && b.relaxes == 1 && b.components == 3) b.relaxes = 2;
}

// True of a dense pack: many contacts press, and most of them did in the last step. In impacts most of them are new.
bool persists(const ContactSystem& system) {
  std::int64_t press = 0, persist = 0;
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const bool presses = at(b, b.r, lane, 0) > 0;
      press += presses;
      persist += presses && b.status[lane] != 0;
    }
  return press >= policy().pack_contacts && 2 * persist > press;
}

class DensePack final : public NlgsPart {
public:
  explicit DensePack(NlgsState& s) : s_(s) {
    mark_loaded(s_.system);
    if (s_.system.clumps) refine_cones(s_.system);
  }

  void swept() override {
    const double enough = s_.options.enough;
    if (early_ || s_.report.iterations < s_.options.patience || !persists(s_.system)) return;
    early_ = true;
    s_.wanted = enough * enough;
    s_.ends_at = enough;
    if (s_.help) s_.help->aim(enough);
  }

  // Sweeps go on alone as long as the larger error does not count yet.
  void measured(StepError&) override {
    s_.help_waits = s_.help && !early_ &&
                    s_.report.iterations < std::min(s_.options.patience, s_.options.max_iterations) &&
                    persists(s_.system);
  }

private:
  NlgsState& s_;
  bool early_ = false; // the larger error counts
};

} // namespace

void add_dense_pack(NlgsState& s, NlgsParts& parts) {
  if (s.options.enough > s.options.tolerance && !s.asks_for_accuracy()) parts.add<DensePack>(s);
}

} // namespace cairn
