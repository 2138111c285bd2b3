#include "contact_fields.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "../base/call.hpp"
#include "simulation.hpp"

namespace cairn {
namespace {

constexpr ContactFieldInfo fields[] = {
#define CAIRN_CONTACT_FIELD(name, c2, c3, whole, unit, smooth, meaning)                                                \
  {#name, c2, c3, whole != 0, unit, smooth != 0, meaning},
#include "../contacts/contact_fields.def"
#undef CAIRN_CONTACT_FIELD
};

} // namespace

const ContactFieldInfo& contact_field_info(const std::string& name) {
  std::string known;
  for (const ContactFieldInfo& f : fields) {
    if (name == f.name) return f;
    known += std::string(known.empty() ? "" : ", ") + f.name;
  }
  throw Error("there is no contact field '" + name + "'; there are " + known);
}

bool has_contact_field(const Simulation& s, const std::string& name) {
  for (const ContactFieldInfo& f : fields)
    if (name == f.name) return s.strategy().has(f);
  return false;
}

std::int64_t contacts_to_read(Simulation& s) {
  if (s.steps > 0) s.strategy().view(s);
  return s.candidates.count;
}

void read_contact_field(Simulation& s, const ContactFieldInfo& field, double* out) {
  const std::string_view name = field.name;
  const std::int64_t n = s.candidates.count;
  const int components = field.components(s.scene.dim);
  if (field.whole) {
    std::vector<std::int64_t> whole(std::size_t(n * components));
    read_contact_field(s, field, whole.data());
    std::copy(whole.begin(), whole.end(), out);
    return;
  }
  if (name == "gap") {
    std::copy_n(s.candidates.gap.data(), n, out);
  } else if (name == "normal") {
    std::copy_n(s.candidates.normal.data(), n * components, out);
  } else if (name == "point") {
    for (std::int64_t i = 0; i < n * components; ++i) out[i] = s.candidates.point[i] + s.scene.origin[i % components];
  } else {
    s.strategy().read(s, name, components, out);
  }
}

void read_contact_field(Simulation& s, const ContactFieldInfo& field, std::int64_t* out) {
  const std::string_view name = field.name;
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  if (name == "status") {
    std::vector<std::int32_t> status(std::size_t(c.count), 0);
    s.strategy().status(s, status.data());
    std::copy(status.begin(), status.end(), out);
    return;
  }
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    if (name == "bodies") {
      *out++ = *s.scene.bodies.id[*k.body[a]];
      *out++ = *s.scene.bodies.id[*k.body[b]];
    } else {
      *out++ = *k.id[a];
      *out++ = *k.id[b];
      *out++ = c.feature[i];
      *out++ = c.image[i];
    }
  }
}

} // namespace cairn
