// Record of contacts for the next step.
#pragma once
#include "batch_storage.hpp"
#include "contact_matcher.hpp"

namespace cairn {

// Writes the contacts of a step into the memory.
class ContactRecorder {
public:
  ContactRecorder(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
                  const BatchStorage& storage, ContactMatcher& matcher, ContactMemory& memory,
                  const ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), storage_(storage), matcher_(matcher), memory_(memory),
        system_(system) {}
  void record();

private:
  std::int64_t record(const cairn_batch& b, std::int64_t to);
  template <int d>
  std::int64_t record_packed(const cairn_batch& b, std::int64_t to);
  void keep_states(const cairn_batch& b, int lane, double* to) const;
  void keep_anchors();

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const BatchStorage& storage_;
  ContactMatcher& matcher_;
  ContactMemory& memory_;
  const ContactSystem& system_;
};

} // namespace cairn
