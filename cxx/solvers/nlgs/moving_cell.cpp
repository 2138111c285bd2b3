// Sweeps over a cell whose shape follows the stress: its rates follow each sweep, and the impulses that are given back.
#include "../sweeps/moving_cell.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class CellSweeps final : public NlgsPart {
public:
  explicit CellSweeps(NlgsState& s) : s_(s) {}

  void prepare(SweepPass& pass) override { pass.by = this; }

  int sweep(int sweeps) override {
    for (int k = 0; k < sweeps; ++k) {
      cairn_nlgs_sweep(1, &s_.schedule, s_.system.change.data());
      s_.system.cell->follow(s_.system);
    }
    return sweeps;
  }

  void end(StepError& end, SolverOptions&) override {
    s_.system.cell->follow(s_.system);
    end = s_.measure(true);
  }

private:
  NlgsState& s_;
};

} // namespace

void add_moving_cell(NlgsState& s, NlgsParts& parts) {
  if (s.system.cell) parts.add<CellSweeps>(s);
}

} // namespace cairn
