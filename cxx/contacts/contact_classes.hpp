// Classes of contacts that one kernel takes together.
#pragma once
#include <cstdint>

#include "../base/scratch.hpp"
#include "assembly_input.hpp"

namespace cairn {

// Sorts candidates by their law, with the kinds of both their sides.
class ContactClasses {
public:
  ContactClasses(const AssemblyInput& in, Scratch& scratch) : in_(in), scratch_(scratch) {}

  static constexpr int radial = 1, moving = 2, mapped = 4; // bits of a kind of side
  static constexpr int kinds = 8;                          // that three bits make
  std::uint8_t* kind = nullptr;                            // per contactor
  std::int32_t* entry = nullptr;                           // per candidate: the rule of its pair of materials
  std::uint16_t* contact_class = nullptr; // (place of the law in the table * kinds + kind of A) * kinds + kind of B
  std::int32_t* degree = nullptr;         // contacts per body, then per mesh, whose contacts all see each other
  int impulse_components = 0, state_components = 0; // largest of this step's laws
  bool laws_commit = false;                         // a law of the step has a slot commit or energy
  bool serial = false;                              // a law must not be called by two threads at once
  bool asks_area = false;                           // a law of the step reads the area of its contact

  void take_columns();    // of the scratch, to be kept until the contacts are gone
  void take_degrees();    // of the scratch, for planning alone
  void classify();        // throws std::invalid_argument if a pair of materials has no law (names both)
  void mark_mapped();     // kinds of contactors where nothing but that counts
  bool all_balls() const; // all moving contactors are balls, alone or in clumps

  static int kind_a(int contact_class) { return contact_class / kinds % kinds; }
  static int kind_b(int contact_class) { return contact_class % kinds; }
  bool moves_a(std::int64_t i) const { return kind_a(contact_class[i]) & moving; }
  bool moves_b(std::int64_t i) const { return kind_b(contact_class[i]) & moving; }
  bool moves(std::int64_t i) const { return moves_a(i) || moves_b(i); }
  bool is_mapped(std::int32_t contactor) const { return (kind[contactor] & mapped) != 0; }
  const LawTable::Entry& rule(std::int64_t i) const { return in_.laws->entry(entry[i]); }
  const LawInfo& law(std::int64_t i) const { return law_infos()[std::size_t(rule(i).law)]; }
  // Parameters of a contact, n apart, that depend on temperature.
  void vary(std::int64_t contact, std::int64_t n, double* params) const;

private:
  const AssemblyInput& in_;
  Scratch& scratch_;
};

} // namespace cairn
