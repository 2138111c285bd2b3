// Views of the last step that the next one overwrites: reactions, impulses and stresses of meshes, and contacts. An
// undone step restores them, both for loads of its parts and for whoever catches its error. Contacts are kept where
// steps may be made in parts or have Newton's method of a body, at a small share of the cost of the step; in other
// scenes a step is hardly ever undone.
#include <algorithm>
#include <utility>

#include "../../simulation/contact_fields.hpp"
#include "nscd.hpp"

namespace cairn {
namespace {

// Rows of contact_fields.def that interactions provide; all other fields are recomputed from the candidates.
constexpr std::pair<const char*, int> kept_fields[] = { // components at most
    {"impulse", 3},    {"impulse_local", 3}, {"moment", 3}, {"relative_velocity", 3},
    {"dissipated", 1}, {"beta", 1},          {"stored", 1}, {"released", 1}};

} // namespace

void Nscd::keep_shown(Simulation& s) {
  shown_.reaction = s.scene.bodies.reaction.values;
  shown_.meshes.resize(s.meshes.meshes.size());
  for (std::size_t k = 0; k < shown_.meshes.size(); ++k) s.meshes.meshes[k].keep(shown_.meshes[k]);
  if (!s.contacts_known) { // an undone step: keep the views of the step before
    shown_.contacts_known = shown_.contacts_known && shows_kept_;
    return;
  }
  shown_.contacts_known = settings.cut_back > 0 || !s.meshes.linear();
  if (!shown_.contacts_known) return;
  const Candidates& c = s.candidates;
  const auto n = std::size_t(c.count);
  shown_.contacts = c;
  shown_.contactors.resize(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    shown_.contactors[2 * i] = *s.scene.contactors.id[c.contactor_a[i]];
    shown_.contactors[2 * i + 1] = *s.scene.contactors.id[c.contactor_b[i]];
  }
  shown_.fields.resize(std::size(kept_fields));
  for (std::size_t k = 0; k < shown_.fields.size(); ++k) {
    shown_.fields[k].resize(std::size_t(kept_fields[k].second) * n);
    read_known(s, kept_fields[k].first, shown_.fields[k].data());
  }
  shown_.status.resize(n);
  s.interactions.status(shown_.status.data());
}

void Nscd::show_again(Simulation& s, const Shown& from) {
  s.scene.bodies.reaction.values = from.reaction;
  for (std::size_t k = 0; k < from.meshes.size(); ++k) s.meshes.meshes[k].put_back(from.meshes[k]);
  if (!from.contacts_known) return;
  s.candidates = from.contacts;
  for (std::size_t i = 0; i < std::size_t(s.candidates.count); ++i) { // they may have got other numbers
    s.candidates.contactor_a[i] = s.contactor(from.contactors[2 * i]);
    s.candidates.contactor_b[i] = s.contactor(from.contactors[2 * i + 1]);
  }
  shows_kept_ = true;
}

void Nscd::read(Simulation& s, std::string_view field, int components, double* out) {
  if (s.contacts_known) return read_known(s, field, out);
  const std::int64_t n = components * s.candidates.count;
  for (std::size_t k = 0; k < std::size(kept_fields) && shows_kept_; ++k)
    if (field == kept_fields[k].first) {
      std::copy_n(shown_.fields[k].begin(), n, out);
      return;
    }
  std::fill_n(out, n, 0.0);
}

void Nscd::read_known(Simulation& s, std::string_view field, double* out) const {
  if (field == "impulse")
    s.interactions.impulse_space(out);
  else if (field == "impulse_local")
    s.interactions.impulse_local(out);
  else if (field == "moment")
    s.interactions.moment_space(out);
  else if (field == "relative_velocity")
    s.interactions.relative_velocity(out);
  else if (field == "dissipated")
    s.interactions.dissipated(out);
  else if (field == "beta")
    s.interactions.kept(out);
  else if (field == "stored")
    s.interactions.stored(out);
  else
    s.interactions.law_state(std::string(field), out);
}

void Nscd::status(Simulation& s, std::int32_t* out) {
  if (s.contacts_known)
    s.interactions.status(out);
  else if (shows_kept_)
    std::copy_n(shown_.status.begin(), s.candidates.count, out);
}

} // namespace cairn
