// Contacts of the last step, found by their keys.
#pragma once
#include <cstdint>

#include "../base/scratch.hpp"
#include "anchored_contacts.hpp"
#include "contact_classes.hpp"

namespace cairn {

// Finds where the memory has the contacts of this step.
class ContactMatcher {
public:
  ContactMatcher(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
                 const ContactMemory& memory, const ContactSystem& system, Scratch& scratch)
      : in_(in), classes_(classes), anchors_(anchors), memory_(memory), system_(system), scratch_(scratch) {}

  // Per place of contacts, until batches are filled: its key in the memory, -1 if it was not there.
  std::int32_t* place = nullptr;

  void match(int threads);
  void note_order(std::size_t keys); // the memory has the contacts of this step in their order
  void forget_order() { in_order_ = false; }
  std::int64_t bytes() const;

private:
  bool follow_order();
  void number_places(std::int64_t places, bool known);
  template <class KeyOf>
  void find_others(std::int64_t places, const KeyOf& key_of);
  void follow_across_facets();
  void follow_bonds_across_sides();
  void hand_on_broken();

  // By which candidates of this step are found among those of the last: contactors A and B, feature and image.
  struct CandidateName {
    std::uint64_t pair, which;
    bool operator==(const CandidateName&) const = default;
  };
  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const ContactMemory& memory_;
  const ContactSystem& system_;
  Scratch& scratch_;
  Array<CandidateName> names_, names_of_last_;
  Array<std::int32_t> kept_at_;              // per candidate of the last step: where the memory has it, -1: nowhere
  Array<std::int32_t> found_at_, left_over_; // of candidates of this step; what none of them met
  Array<std::int64_t> ids_in_order_;         // of contactors then
  std::size_t keys_in_order_ = 0;            // of the memory then
  bool in_order_ = false;                    // the memory stands as note_order saw it
};

} // namespace cairn
