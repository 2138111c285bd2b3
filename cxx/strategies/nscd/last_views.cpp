// Contacts are kept where steps may be made in parts or have Newton's method of a body, at a small share of the cost of
// the step; in other scenes a step is hardly ever undone.
#include "last_views.hpp"

#include <algorithm>
#include <utility>

#include "../../simulation/contact_fields.hpp"

namespace cairn {
namespace {

// Rows of contact_fields.def that interactions provide; all other fields are recomputed from the candidates.
constexpr std::pair<const char*, int> kept_fields[] = { // components at most
    {"impulse", 3},    {"impulse_local", 3}, {"moment", 3}, {"relative_velocity", 3},
    {"dissipated", 1}, {"beta", 1},          {"stored", 1}, {"released", 1}};

void read_known(const Simulation& s, std::string_view field, double* out) {
  if (field == "impulse")
    s.interactions.views().impulse_space(out);
  else if (field == "impulse_local")
    s.interactions.views().impulse_local(out);
  else if (field == "moment")
    s.interactions.views().moment_space(out);
  else if (field == "relative_velocity")
    s.interactions.views().relative_velocity(out);
  else if (field == "dissipated")
    s.interactions.views().dissipated(out);
  else if (field == "beta")
    s.interactions.views().soundness(out);
  else if (field == "stored")
    s.interactions.views().stored(out);
  else if (field == "attraction")
    s.interactions.views().attraction(out);
  else // "state." before it: as the law has it
    s.interactions.views().law_state(std::string(field.substr(field.starts_with("state.") ? 6 : 0)), out);
}

} // namespace

void LastViews::keep(Simulation& s, bool contacts_too) {
  reaction_ = s.scene.bodies.reaction.values;
  meshes_.resize(s.meshes.meshes.size());
  for (std::size_t k = 0; k < meshes_.size(); ++k) s.meshes.meshes[k].keep(meshes_[k]);
  if (!s.contacts_known) { // an undone step: keep the views of the step before
    if (contacts_ != Contacts::read) contacts_ = Contacts::none;
    return;
  }
  contacts_ = contacts_too ? Contacts::kept : Contacts::none;
  if (!contacts_too) return;
  const Candidates& c = s.candidates;
  const auto n = std::size_t(c.count);
  candidates_ = c;
  contactors_.resize(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    contactors_[2 * i] = *s.scene.contactors.id[c.contactor_a[i]];
    contactors_[2 * i + 1] = *s.scene.contactors.id[c.contactor_b[i]];
  }
  fields_.resize(std::size(kept_fields));
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    fields_[k].resize(std::size_t(kept_fields[k].second) * n);
    read_known(s, kept_fields[k].first, fields_[k].data());
  }
  status_.resize(n);
  s.interactions.views().status(status_.data());
}

void LastViews::put_back_meshes(Simulation& s) const {
  for (std::size_t k = 0; k < s.meshes.meshes.size(); ++k) s.meshes.meshes[k].put_back(meshes_[k]);
}

void LastViews::show(Simulation& s) {
  s.scene.bodies.reaction.values = reaction_;
  for (std::size_t k = 0; k < meshes_.size(); ++k) s.meshes.meshes[k].put_back(meshes_[k]);
  if (contacts_ == Contacts::none) return;
  s.candidates = candidates_;
  for (std::size_t i = 0; i < std::size_t(s.candidates.count); ++i) { // they may have got other numbers
    s.candidates.contactor_a[i] = s.contactor(contactors_[2 * i]);
    s.candidates.contactor_b[i] = s.contactor(contactors_[2 * i + 1]);
  }
  contacts_ = Contacts::read;
}

void LastViews::read(Simulation& s, std::string_view field, int components, double* out) const {
  if (s.contacts_known) return read_known(s, field, out);
  const std::int64_t n = components * s.candidates.count;
  for (std::size_t k = 0; k < std::size(kept_fields) && contacts_ == Contacts::read; ++k)
    if (field == kept_fields[k].first) {
      std::copy_n(fields_[k].begin(), n, out);
      return;
    }
  std::fill_n(out, n, 0.0);
}

void LastViews::status(Simulation& s, std::int32_t* out) const {
  if (s.contacts_known)
    s.interactions.views().status(out);
  else if (contacts_ == Contacts::read)
    std::copy_n(status_.begin(), s.candidates.count, out);
}

} // namespace cairn
