// Another solver that NLGS in steps asks where sweeps alone take too long.
#pragma once
#include <functional>

#include "../sweeps/contact_system.hpp"
#include "../sweeps/refinement.hpp"

namespace cairn {

class SweepHelp {
public:
  virtual ~SweepHelp() = default;
  // Told of each error; true: it wants to be called.
  virtual bool pays(int iterations, double error) = 0;
  // The error is small enough, that of light bodies (see LightError) is this: whether that is all. False: it wants to
  // be called.
  virtual bool accepts(int iterations, double light) = 0;
  // Impulses of a smaller error, or of one within the tolerance, and records to go with them. False: they stay as they
  // were. measure: square of the error of the impulses at hand, records up to date.
  virtual bool improve(const cairn_schedule& schedule, double error, const std::function<double()>& measure) = 0;
  // Impulses whose error is `wanted` at most, of contacts that stand still, and records to go with them. False: they
  // stay as they were, as where that would take much longer than sweeps.
  virtual bool settles(const cairn_schedule& schedule, double error, double wanted,
                       const std::function<double()>& measure) {
    (void)schedule, (void)error, (void)wanted, (void)measure;
    return false;
  }
  // True if velocities may err by much more than impulses, whose error is small enough.
  virtual bool refines(int iterations, double error) {
    (void)iterations, (void)error;
    return false;
  }
  // Impulses of more exact velocities. measure: as above.
  virtual Refinement refine(double error, const std::function<double()>& measure) {
    (void)error, (void)measure;
    return {};
  }
  // The error has to be smaller than was asked for.
  virtual void aim(double error) = 0;
  // It is asked no more: sweeps have to do alone.
  virtual bool given_up() const = 0;
  // Expected cost of a call, as far as it is known.
  virtual double operations() const = 0;
  virtual const char* name() const = 0;
  // Up to so many unknowns an active set costs less than its first iterations.
  virtual int few_unknowns() const = 0;
};

} // namespace cairn
