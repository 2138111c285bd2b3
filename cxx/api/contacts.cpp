// The C API of the contacts of the last step (cairn/cairn.h).
#include <utility>

#include "../simulation/contact_fields.hpp"
#include "objects.hpp"

using namespace cairn::api;

extern "C" {

int64_t cairn_simulation_contacts(const cairn_simulation* simulation) {
  if (!simulation) return 0;
  // smooth contacts are first placed at the bodies, without effect on the simulation, hence the const_cast
  try {
    return cairn::contacts_to_read(const_cast<cairn_simulation*>(simulation)->simulation);
  } catch (...) { return -1; }
}

int32_t cairn_simulation_contact_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                       int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    cairn::Simulation& s = simulation->simulation;
    const cairn::ContactFieldInfo& field = cairn::contact_field_info(name);
    if (!cairn::has_contact_field(s, name))
      throw cairn::Error(std::string("smooth contacts have no field '") + name +
                         "'; the sums are among the terms of energy");
    const std::int64_t numbers = cairn::contacts_to_read(s) * field.components(s.scene.dim);
    if (count) *count = numbers;
    if (numbers == 0 || numbers > capacity) return;
    require(values, "values");
    cairn::read_contact_field(s, field, values);
  });
}

int32_t cairn_simulation_contact_arrays(cairn_simulation* simulation, int64_t* bodies, double* gap, double* normal,
                                        double* point, double* impulse, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    cairn::Simulation& s = simulation->simulation;
    cairn::contacts_to_read(s);
    if (bodies) cairn::read_contact_field(s, cairn::contact_field_info("bodies"), bodies);
    const std::pair<const char*, double*> asked[] = {
        {"gap", gap}, {"normal", normal}, {"point", point}, {"impulse", impulse}};
    for (const auto& [name, values] : asked)
      if (values) cairn::read_contact_field(s, cairn::contact_field_info(name), values);
  });
}

} // extern "C"
