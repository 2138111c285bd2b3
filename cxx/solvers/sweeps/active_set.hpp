// Newton's method on the natural map with its active set, for few contacts whose sweeps converge too slowly: masses of
// very different size, walls that squeeze, tall stacks (Alart & Curnier 1991, Strategy of Christensen et al. 1998).
#pragma once
#include <functional>
#include <vector>

#include "contact_system.hpp"

namespace cairn {

// Room that one solve leaves to the next.
struct ActiveSetMemory {
  struct Unknown {
    double* r;       // impulse it stands for: the normal one where it slips
    const double* u; // relative velocity that must vanish, bias included
    double* slip[2]; // tangential impulses that follow it, or null
    double along[2]; // how
    double scale;    // diagonal of W
  };
  std::vector<Unknown> unknowns;
  std::vector<double> u, matrix, right, kept, best;
  std::vector<int> row, column;
};

// Newton's method on the active set. Blocks of W lose the light part beside the heavy one, so W only gives directions:
// the residual is always read from the velocities of bodies, and the same matrix corrects it. Redundant unknowns
// (hyperstatic contacts) keep their impulse: complete pivoting finds them.
class ActiveSet {
public:
  // measure: square of the error of the impulses at hand, records up to date
  ActiveSet(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
            std::function<double()> measure)
      : system_(system), schedule_(schedule), velocity_free_(velocity_free), measure_(std::move(measure)),
        memory_(room(system)) {}

  // Impulses of a smaller error than `error`, which is returned; untouched, and `error` itself, if there are none or
  // there are more unknowns than `most`.
  static constexpr int most_unknowns = 256;
  double improve(double error, double wanted, int most = most_unknowns);

private:
  using Unknown = ActiveSetMemory::Unknown;
  static ActiveSetMemory& room(ContactSystem& system);
  bool
  choose(int most); // what sticks, slips and is open, from the impulses at hand; false if there are too many unknowns
  void choose_contact(const cairn_batch& b, int lane, double* u);
  void read_velocities();
  void refresh(); // records and relative velocities from the impulses
  void assemble();
  void factor();
  bool correct(); // one correction; false when it changed nothing
  void apply(const Unknown& unknown, double change);
  void keep(std::vector<double>& impulses) const;
  void set(const std::vector<double>& impulses);

  ContactSystem& system_;
  const cairn_schedule& schedule_;
  Velocities velocity_free_;
  std::function<double()> measure_;
  ActiveSetMemory& memory_;
  int rank_ = 0;
};

} // namespace cairn
