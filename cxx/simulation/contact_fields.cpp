#include "contact_fields.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "../base/call.hpp"
#include "../networks/network.hpp"
#include "simulation.hpp"

namespace cairn {
namespace {

constexpr ContactFieldInfo fields[] = {
#define CAIRN_CONTACT_FIELD(name, c2, c3, whole, unit, smooth, meaning)                                                \
  {#name, c2, c3, whole != 0, unit, smooth != 0, meaning},
#include "../contacts/contact_fields.def"
#undef CAIRN_CONTACT_FIELD
};

// Null for what no network gives.
const std::vector<double>* network_field(const Simulation& s, std::string_view name) {
  if (!s.networks) return nullptr;
  const auto &electrical = s.networks->electrical, &thermal = s.networks->thermal;
  if (electrical && name == "electrical_conductance") return &electrical->conductance;
  if (electrical && name == "current") return &electrical->flow;
  if (electrical && name == "joule_heat") return &electrical->power;
  if (thermal && name == "thermal_conductance") return &thermal->conductance;
  if (thermal && name == "heat_flux") return &thermal->flow;
  return nullptr;
}
bool of_networks(std::string_view name) {
  return name == "electrical_conductance" || name == "current" || name == "joule_heat" ||
         name == "thermal_conductance" || name == "heat_flux";
}

// Id of the rigid body of a side, or of the node that bears most of a contact on a mesh.
std::int64_t body_of(const Simulation& s, std::int64_t contact, std::int32_t contactor, bool other) {
  if (const std::int32_t body = *s.scene.contactors.body[contactor]; body >= 0) return *s.scene.bodies.id[body];
  double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0};
  if (s.scene.cell.any() && other) image_shift(s.scene.cell, s.candidates.image[contact], shift);
  const int dim = s.scene.dim;
  for (int d = 0; d < dim; ++d) point[d] = s.candidates.point[dim * contact + d] - shift[d];
  const std::int32_t beside = other ? s.candidates.contactor_a[contact] : s.candidates.contactor_b[contact];
  const Mapping m = s.meshes.mapping(s.scene.nodes, contactor, point, beside);
  const auto most = std::max_element(std::begin(m.weight), std::end(m.weight)) - std::begin(m.weight);
  return *s.scene.nodes.id[s.meshes.meshes[std::size_t(m.mesh)].node(m.node[most])];
}

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
    if (name == f.name) return of_networks(name) ? network_field(s, name) != nullptr : s.strategy().has(f);
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
  if (of_networks(name)) {
    const std::vector<double>* known = network_field(s, name);
    std::fill_n(out, n, 0.0);
    if (known && std::int64_t(known->size()) == n) std::copy_n(known->begin(), n, out);
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

double stored_between(Simulation& s, std::int32_t material) {
  const std::int64_t n = contacts_to_read(s);
  if (n == 0 || !has_contact_field(s, "stored")) return 0;
  std::vector<double> stored(static_cast<std::size_t>(n));
  read_contact_field(s, contact_field_info("stored"), stored.data());
  const Field<std::int32_t>& of = s.scene.contactors.material;
  double sum = 0;
  for (std::int64_t i = 0; i < n; ++i)
    if (*of[s.candidates.contactor_a[i]] == material && *of[s.candidates.contactor_b[i]] == material)
      sum += stored[std::size_t(i)];
  return sum;
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
      *out++ = body_of(s, i, a, false);
      *out++ = body_of(s, i, b, true);
    } else {
      *out++ = *k.id[a];
      *out++ = *k.id[b];
      *out++ = c.feature[i];
      *out++ = c.image[i];
    }
  }
}

} // namespace cairn
