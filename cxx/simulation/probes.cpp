#include "probes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "contact_fields.hpp"
#include "report.hpp"
#include "simulation.hpp"

namespace cairn {

namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

// Index of a component by its letters, -1: there is none.
int component_of(std::string_view word, int dim, int components) {
  static constexpr std::string_view plane[] = {"x", "y", "w"}, space[] = {"x", "y", "z", "wx", "wy", "wz"};
  for (int k = 0; k < std::min(components, dim == 2 ? 3 : 6); ++k)
    if (word == (dim == 2 ? plane[k] : space[k])) return k;
  return word.empty() && components == 1 ? 0 : -1;
}

} // namespace

int Probes::add(const Simulation& s, const std::string& quantity, std::span<const std::int64_t> ids,
                const std::string& take, int every, bool keeps) {
  Probe made;
  const std::size_t dot = quantity.find('.');
  made.name = quantity.substr(0, dot);
  const std::string part = dot == std::string::npos ? "" : quantity.substr(dot + 1);
  const int dim = s.scene.dim;
  const auto refuse = [&](const std::string& due) {
    throw Error("the quantity of a probe is '" + quantity + "': give " + due);
  };
  made.component = -1;
  if (made.name == "energy" || made.name == "report") {
    made.kind = made.name == "energy" ? Kind::energy : Kind::report;
    std::string known;
    int k = 0;
    const auto look = [&](const char* name) {
      known += std::string(known.empty() ? "" : ", ") + name;
      if (part == name) made.component = k;
      ++k;
    };
    if (made.kind == Kind::energy)
      for (const EnergyTerm& term : energy_terms()) look(term.name);
    else
      for (const auto& row : report_numbers(s.report)) look(row.first);
    if (made.component < 0) refuse(made.name + ". and one of " + known);
  } else if (made.name == "stress" || made.name == "cell") {
    made.kind = made.name == "stress" ? Kind::stress : Kind::cell;
    const int i = part.size() == 2 ? part[0] - 'x' : -1, j = part.size() == 2 ? part[1] - 'x' : -1;
    if (i < 0 || j < i || j >= dim)
      refuse(made.name + (dim == 2 ? ".xx, .yy or .xy" : ".xx, .yy, .zz, .xy, .xz or .yz"));
    if (!s.scene.cell.any()) throw Error("a probe asks for '" + quantity + "' of a scene that is not periodic");
    made.component = i + 3 * j;
  } else if (made.name == "contact_force") {
    made.kind = Kind::contact_force;
    made.component = component_of(part, dim, dim);
    if (made.component < 0) refuse(dim == 2 ? "contact_force.x or .y" : "contact_force.x, .y or .z");
  } else {
    std::string known;
    bool found = false;
    const_cast<Bodies&>(s.scene.bodies).for_each_field([&](auto& field) {
      if constexpr (std::is_same_v<std::decay_t<decltype(field.values[0])>, double>) {
        known += std::string(known.empty() ? "" : ", ") + std::string(field.name);
        if (made.name != field.name) return;
        found = true;
        made.component = component_of(part, dim, field.components);
      }
    });
    if (!found) refuse("contact_force, energy, report, stress, cell or a field of bodies: " + known);
    if (made.component < 0)
      refuse(made.name + (dim == 2 ? ".x, .y or .w" : ".x, .y, .z, .wx, .wy or .wz") +
             std::string(", as many as it has components, nothing if it is one number"));
  }
  for (const std::int64_t id : ids) s.scene.internal(id);
  made.ids.assign(ids.begin(), ids.end());
  if (take == "mean")
    made.take = Take::mean;
  else if (take == "sum")
    made.take = Take::sum;
  else if (take == "min")
    made.take = Take::least;
  else if (take == "max")
    made.take = Take::most;
  else
    throw Error("take is '" + take + "': give mean, sum, min or max");
  if (every < 1) throw Error("every is " + std::to_string(every) + ": give a number of steps of at least 1");
  made.every = every;
  made.keeps = keeps;
  made.last = none;
  probes_.push_back(std::move(made));
  return count() - 1;
}

const double* Probes::body_value(const Simulation& s, const Probe& probe, std::int32_t body) const {
  if (probe.kind == Kind::contact_force) return &contact_force_[std::size_t(s.scene.dim * body + probe.component)];
  const double* found = nullptr;
  const_cast<Bodies&>(s.scene.bodies).for_each_field([&](auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(field.values[0])>, double>)
      if (field.active && probe.name == field.name) found = field[body] + probe.component;
  });
  return found;
}

bool Probes::reads_contacts() const {
  return std::any_of(probes_.begin(), probes_.end(), [](const Probe& p) { return p.kind == Kind::contact_force; });
}

bool Probes::reads_bodies(std::int64_t step) const {
  return std::any_of(probes_.begin(), probes_.end(), [step](const Probe& p) {
    return (p.kind == Kind::contact_force || p.kind == Kind::field) && step % p.every == 0;
  });
}

// Marks the contactors of bodies whose contact forces are asked for, and clears these forces.
void Probes::mark_contactors(const Simulation& s) {
  const Field<std::int32_t>& body = s.scene.contactors.body;
  const auto asked = [](const Probe& p) { return p.kind == Kind::contact_force; };
  const bool all =
      std::any_of(probes_.begin(), probes_.end(), [&](const Probe& p) { return asked(p) && p.ids.empty(); });
  of_body_.assign(std::size_t(s.scene.bodies.count), all ? 1 : 0);
  for (const Probe& probe : probes_)
    for (const std::int64_t id : probe.ids)
      if (const std::int32_t found = asked(probe) ? s.scene.find_body(id) : -1; found >= 0)
        of_body_[std::size_t(found)] = 1;
  fit(of_contactor_, std::size_t(s.scene.contactors.count));
  for (std::int64_t k = 0; k < s.scene.contactors.count; ++k)
    of_contactor_[std::size_t(k)] = *body[k] >= 0 ? of_body_[std::size_t(*body[k])] : 0;
  const auto dim = std::size_t(s.scene.dim);
  fit(contact_force_, dim * of_body_.size());
  for (std::size_t b = 0; b < of_body_.size(); ++b)
    if (of_body_[b]) std::fill_n(&contact_force_[dim * b], dim, 0.0);
}

void Probes::find_contact_forces(Simulation& s) {
  if (forces_of_ == s.steps) return;
  forces_of_ = s.steps;
  const std::int64_t n = contacts_to_read(s);
  const int dim = s.scene.dim;
  const bool by_impulse = has_contact_field(s, "impulse");
  fit(impulse_, std::size_t(dim * n));
  mark_contactors(s);
  if (n == 0) return;
  read_contact_field(s, contact_field_info(by_impulse ? "impulse" : "force"), impulse_.data());
  const double over = by_impulse ? 1 / s.report.h : 1;
  for (std::int64_t i = 0; i < n; ++i) {
    const auto a = std::size_t(s.candidates.contactor_a[i]), b = std::size_t(s.candidates.contactor_b[i]);
    if (!(of_contactor_[a] | of_contactor_[b])) continue;
    double* const on_a = of_contactor_[a] ? &contact_force_[std::size_t(dim * *s.scene.contactors.body[a])] : nullptr;
    double* const on_b = of_contactor_[b] ? &contact_force_[std::size_t(dim * *s.scene.contactors.body[b])] : nullptr;
    for (int k = 0; k < dim; ++k) {
      const double force = over * impulse_[std::size_t(dim * i + k)];
      if (on_a) on_a[k] += force;
      if (on_b) on_b[k] -= force;
    }
  }
}

double Probes::value_of(Simulation& s, const Probe& probe) {
  switch (probe.kind) {
  case Kind::energy: return s.energy.*energy_terms()[std::size_t(probe.component)].member;
  case Kind::report: return report_numbers(s.report)[std::size_t(probe.component)].second;
  case Kind::stress: return s.scene.cell.stress[probe.component];
  case Kind::cell: return s.scene.cell.vectors[probe.component];
  case Kind::contact_force: find_contact_forces(s); break;
  case Kind::field: break;
  }
  const Bodies& b = s.scene.bodies;
  if (b.count == 0) return none;
  const double* first = body_value(s, probe, 0); // components of a body stand beside each other
  if (!first) return none;
  std::ptrdiff_t stride = 0;
  if (b.count > 1) stride = body_value(s, probe, 1) - first;
  const double origin =
      probe.kind == Kind::field && probe.name == "position" ? s.scene.origin[std::size_t(probe.component)] : 0;
  double sum = 0, least = std::numeric_limits<double>::infinity(), most = -least;
  std::int64_t counted = 0;
  const auto add = [&](std::int32_t body) {
    if (body < 0) return;
    const double value = first[stride * body] + origin;
    sum += value;
    least = std::min(least, value);
    most = std::max(most, value);
    ++counted;
  };
  for (const std::int64_t id : probe.ids) add(s.scene.find_body(id));
  if (probe.ids.empty())
    for (const std::int32_t body : s.scene.insertion_order()) add(body);
  if (counted == 0) return none;
  switch (probe.take) {
  case Take::mean: return sum / double(counted);
  case Take::sum: return sum;
  case Take::least: return least;
  default: return most;
  }
}

void Probes::record(Simulation& s) {
  forces_of_ = -1;
  for (Probe& probe : probes_) {
    probe.last = none;
    if (s.steps % probe.every != 0) continue;
    probe.last = value_of(s, probe);
    if (!probe.keeps) continue;
    probe.time.push_back(s.time);
    probe.value.push_back(probe.last);
  }
}

} // namespace cairn
