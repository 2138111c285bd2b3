// Checks of laws from users' libraries.
#pragma once
#include <cstdint>

#include "contact_classes.hpp"

namespace cairn {

// First value, in the order of batches, that is not finite among the results of a law from a user's library.
struct PluggedFault {
  std::int32_t batch = -1, lane = 0, component = 0;
  const char* what = "";
  double value = 0;
  void note(std::int32_t at_batch, int at_lane, int at_component, const char* name, double found);
};

// Refuses results of users' laws that no solver can go on with.
class PluggedLawChecks {
public:
  PluggedLawChecks(const AssemblyInput& in, const ContactClasses& classes, ContactSystem& system)
      : in_(in), classes_(classes), system_(system) {}
  void begin() { fault_ = {}; }
  void check_prepared(const cairn_batch& b, const double* bias, const double* compliance, const double* mu);
  void check_posed(const cairn_batch& b, const double* gap);
  void note(std::int32_t batch, int lane, int component, const char* name, double found) {
    fault_.note(batch, lane, component, name, found);
  }
  void refuse_noted() const { // throws std::invalid_argument for a noted fault
    if (fault_.batch >= 0) refuse();
  }
  // Looks for the law that made a solution diverge.
  void find(const Bodies& with, int sweeps);

private:
  [[noreturn]] void refuse() const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  ContactSystem& system_;
  PluggedFault fault_;
};

} // namespace cairn
