// Fields of the contacts of the last step, by the names of contact_fields.def.
#pragma once
#include <cstdint>
#include <string>

namespace cairn {

class Simulation;

struct ContactFieldInfo {
  const char* name;
  int components2, components3;
  bool whole; // numbers that are whole
  const char* unit;
  bool smooth; // smooth contacts have it
  const char* meaning;
  int components(int dim) const { return dim == 2 ? components2 : components3; }
};
// Throws Error with the names that there are.
const ContactFieldInfo& contact_field_info(const std::string& name);

// True if contacts of the simulation have the field under its strategy.
bool has_contact_field(const Simulation& s, const std::string& name);

// Contacts that can be read now; those of a smooth strategy are placed where bodies are.
std::int64_t contacts_to_read(Simulation& s);
// out (components, contacts), of a field that they have. Contacts that were detected and not yet solved have no
// impulses: zero.
void read_contact_field(Simulation& s, const ContactFieldInfo& field, double* out);
void read_contact_field(Simulation& s, const ContactFieldInfo& field, std::int64_t* out); // of whole numbers alone

// Energy stored in the contacts of a joint, found by its material, which meets itself alone [J].
double stored_between(Simulation& s, std::int32_t material);

} // namespace cairn
