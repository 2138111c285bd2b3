#include "contact_classes.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "../contactors/shapes.hpp"
#include "face_moments.hpp"

namespace cairn {

void ContactClasses::take_columns() {
  kind = scratch_.take<std::uint8_t>(in_.contactors->count);
  entry = scratch_.take<std::int32_t>(in_.candidates->count);
  contact_class = scratch_.take<std::uint16_t>(in_.candidates->count);
}

void ContactClasses::take_degrees() { degree = scratch_.take<std::int32_t>(in_.units()); }

void ContactClasses::mark_mapped() {
  take_columns();
  for (std::int64_t c = 0; c < in_.contactors->count; ++c) kind[c] = in_.body(std::int32_t(c)) < 0 ? mapped : 0;
}

void ContactClasses::vary(std::int64_t contact, std::int64_t n, double* params) const {
  const LawTable::Entry& e = rule(contact);
  for (int k = e.first_curve; k < e.first_curve + e.curves; ++k) {
    const LawTable::Curve& curve = in_.laws->curves()[std::size_t(k)];
    const double t = 0.5 * (in_.value_at(in_.temperature, in_.candidates->contactor_a[contact]) +
                            in_.value_at(in_.temperature, in_.candidates->contactor_b[contact]));
    params[n * curve.parameter] = std::min(curve.at(t), std::numeric_limits<double>::max());
  }
}

void ContactClasses::classify() {
  const Candidates& c = *in_.candidates;
  const std::int64_t n = c.count;
  std::fill_n(degree, in_.units(), 0);
  impulse_components = in_.dim();
  state_components = 0;
  int known_a = -1, known_b = -1, e = -1, law = 0; // many contacts in a row are of the same materials
  bool resists = false;
  const auto& material = in_.contactors->material.values;
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    const int ma = material[std::size_t(a)], mb = material[std::size_t(b)];
    if (ma != known_a || mb != known_b) {
      e = in_.laws->find(ma, mb);
      law = e < 0 ? 0 : in_.laws->entry(e).place;
      resists = e >= 0 && in_.meshes && resists_turning(in_, in_.laws->entry(e));
      known_a = ma;
      known_b = mb;
    }
    if (e < 0)
      throw std::invalid_argument("no law for contacts between materials '" + in_.laws->name(ma) + "' and '" +
                                  in_.laws->name(mb) + "': declare one for this pair, or a default");
    const int kind_of_a = kind[a], kind_of_b = kind[b];
    entry[i] = e;
    if (resists && ((kind_of_a | kind_of_b) & mapped)) refuse_moment(in_, *this, i);
    contact_class[i] = std::uint16_t((law * kinds + kind_of_a) * kinds + kind_of_b);
    if (kind_of_a & moving) ++degree[in_.unit_of(a)];
    if (kind_of_b & moving) ++degree[in_.unit_of(b)];
  }
  serial = laws_commit = asks_area = false;
  for (Law law : in_.laws->laws()) {
    const LawInfo& info = law_infos()[std::size_t(law)];
    impulse_components = std::max(impulse_components, info.components(in_.dim()));
    state_components = std::max(state_components, info.state_kept(in_.dim()));
    laws_commit |= info.commit || info.energy;
    asks_area |= info.has_solve || info.commit || info.energy || info.plugged();
    serial |= !info.thread_safe;
    if (info.components(in_.dim()) == 0)
      throw std::invalid_argument(
          "law " + info.name + (info.plugged() ? " of " + info.library : std::string()) + " has no form in " +
          std::to_string(in_.dim()) + "D" +
          (info.plugged() ? ": give it components" + std::to_string(in_.dim()) : std::string()));
  }
}

// True if all moving contactors are balls, alone or in clumps.
bool ContactClasses::all_balls() const {
  if (in_.meshes) return false;
  for (std::int64_t k = 0; k < in_.contactors->count; ++k)
    if ((kind[k] & moving) && !info(Shape(*in_.contactors->shape[k])).ball()) return false;
  return true;
}

} // namespace cairn
