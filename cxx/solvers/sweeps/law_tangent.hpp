// Linearised laws of contacts: how impulses answer small changes of velocity.
#pragma once
#include <vector>

#include "solid_system.hpp"

namespace cairn {

class LawTangent {
public:
  explicit LawTangent(SolidSystem&);

  // Arguments of a law.
  struct Question {
    const double *block, *velocity, *begun, *bias, *params; // (n, c, c), (n, c), (n, c), (n, c), (n)
  };
  std::vector<double> w, q, r, bias, params; // columns of the batch that was opened last, as a Question has them
  std::vector<double> target;                // impulses by its law

  void size_columns(); // before the first batch is opened
  // Blocks, of which a share is taken, velocities and impulses of a batch.
  void open_batch(std::int32_t batch, double share);
  double fastest(); // the largest relative velocity [m/s]
  // Impulses (n, c) by the law of a batch [N s].
  void ask(const cairn_batch& b, const Question& with, double* impulse) const;
  // Responses and given changes of the contacts of a batch go to the system: of the law beside its block, or of both
  // where the block is eliminated. yielding: share of their block by which bonds that hold fast give way.
  void respond(std::int32_t batch, Question with, double speed, const double* eliminated, double yielding);
  // Responses of all contacts at the velocities at hand.
  void linearise(double yielding);

private:
  SolidSystem& solid_;
  std::vector<double> w_true_, u_, eliminated_, nudged_, nudges_, found_, begun_, told_;
  std::vector<std::int32_t> held_; // of a batch, as those before
};

} // namespace cairn
