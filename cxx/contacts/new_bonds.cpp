// Pairs that laws keep begin at the positions in which bodies come in, before anything moves.
#include "new_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

void widen(std::vector<double>& values, int& has, int wants, std::size_t keys, double fill) {
  if (has >= wants) return;
  std::vector<double> wider(keys * std::size_t(wants), fill);
  for (std::size_t k = 0; k < keys; ++k)
    std::copy_n(values.data() + k * std::size_t(has), has, wider.data() + k * std::size_t(wants));
  values = std::move(wider);
  has = wants;
}

bool NewBonds::came_in_touching(std::int64_t i) const {
  const ContactKey k = in_.key(i);
  if (memory_.has_seen(k.contactor_a) && memory_.has_seen(k.contactor_b)) return false;
  const LawTable::Entry& e = classes_.rule(i);
  if (law_infos()[std::size_t(e.law)].joins) return !(e.params[joint_pulley] > 0) || ropes_.is_rope(i);
  const int within = law_infos()[std::size_t(e.law)].within;
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
  if (classes_.is_mapped(ca) && classes_.is_mapped(cb) && in_.meshes->parted_warped(ca, cb)) return true;
  double furthest = 0; // from the origin of those who gave places, which rounded them
  for (int k = 0; k < in_.dim(); ++k)
    furthest = std::max(furthest, std::abs(in_.candidates->point[in_.dim() * i + k]) +
                                      std::abs(in_.options.origin[std::size_t(k)]));
  const double radius = curvature_.effective_radius(i), coarse = std::min(rounding_of_gaps(furthest), radius / 64);
  return in_.candidates->gap[i] <= std::max(touch * radius, within < 0 ? 0 : e.params[within]) + coarse;
}

// Bonds of bodies that came in since the last step and touch, for laws that keep pairs: the result of the
// law's prepare is their first memory. Returns a warning about bonds without an area.
std::string NewBonds::begin(double h, double theta) {
  const Candidates& candidates = *in_.candidates;
  const LawTable& laws = *in_.laws;
  ContactMemory& m = memory_;
  for (const Law law : laws.laws()) {
    const LawInfo& info = law_infos()[std::size_t(law)];
    if (!info.keeps) continue;
    widen(m.impulses, m.impulse_components, info.components(in_.dim()), m.keys.size(), 0);
    widen(m.states, m.state_components, info.state_kept(in_.dim()), m.keys.size(), no_state);
  }
  const std::size_t first = m.keys.size();
  std::vector<std::int32_t> beginning;
  for (std::int64_t i = 0; i < candidates.count; ++i) {
    const auto material = [&](std::int32_t contactor) { return *in_.contactors->material[contactor]; };
    classes_.entry[i] = laws.find(material(candidates.contactor_a[i]), material(candidates.contactor_b[i]));
    if (classes_.entry[i] < 0 || !classes_.law(i).keeps || !came_in_touching(i)) continue;
    beginning.push_back(std::int32_t(i));
  }
  std::vector<std::int32_t> joined, bare, remainder;
  mesh_areas_.leave_out_corners(beginning);
  redundant_.leave_out(beginning, remainder);
  std::vector<MeshBondAreas::BondArea> shared = mesh_areas_.share_mesh_faces(beginning, remainder);
  mesh_areas_.share_mesh_pairs(beginning, remainder, shared);
  auto next = shared.begin(); // both rise
  for (const std::int32_t i : beginning) {
    const bool here = next != shared.end() && next->first == i;
    const Begun begun = begin_kept(i, h, theta, here ? (next++)->second : areas_.area_of(i));
    if (begun == Begun::joined) joined.push_back(i);
    if (begun == Begun::without_area) bare.push_back(i);
  }
  space_anchors(first);
  return warn_of_unjoined(joined, bare);
}

// One contact, as eight that are the same.
NewBonds::Begun NewBonds::begin_kept(std::int64_t i, double with_h, double with_theta, double area) {
  constexpr int n = 8;
  const LawTable::Entry& e = classes_.rule(i);
  const LawInfo& law = law_infos()[std::size_t(e.law)];
  const int c = law.components(in_.dim());
  const bool by_area = law.anchored || std::ranges::find(law.state, "area") != law.state.end();
  for (const std::int32_t contactor : {in_.candidates->contactor_a[i], in_.candidates->contactor_b[i]})
    if (classes_.is_mapped(contactor) && by_area && !law.joins &&
        info(Shape(*in_.contactors->shape[contactor])).ball() && !(in_.meshes->area(contactor) > 0))
      throw std::invalid_argument("law " + law.python_name + " joins a node or point of the mesh '" +
                                  in_.meshes->meshes[in_.meshes->mesh_of(contactor)].model.name +
                                  "', whose part of the surface is not known: give the sides that it lies on too, "
                                  "edges= in 2D, faces= in 3D");
  double gap[n], geometry[3 * n], u[6 * n] = {}, params[(LawTable::max_parameters + 4) * n] = {};
  double state[LawTable::max_states * n] = {}, bias[6 * n], compliance[6 * n], mu[n];
  const auto fill = [](double* column, double value) { std::fill_n(column, n, value); };
  fill(gap, in_.candidates->gap[i]);
  fill(geometry, area);
  fill(geometry + n, curvature_.effective_radius(i));
  fill(geometry + 2 * n, 0);
  for (std::size_t p = 0; p < law.parameters.size(); ++p) fill(params + p * n, e.params[p]);
  double fields[4 * n] = {};
  for (int lane = 0; lane < n; ++lane) {
    if (in_.temperature) classes_.vary(i, n, params + lane);
    if (in_.has_fields()) in_.fields_of(i, n, fields + lane);
  }
  int column = 0;
  for (std::size_t k = 0; k < law.state.size(); ++k)
    for (int v = law.state[k].back() == '*' ? in_.dim() - 1 : 1; v > 0; --v)
      fill(state + n * column++, law.state_begin[k]);
  fill(state, 1);
  const cairn_law_context context{with_h, with_theta, geometry, in_.has_fields() ? fields : nullptr, 0};
  law.prepare(n, c, &context, gap, u, params, state, bias, compliance, mu);
  if (law.spans && !(state[0] > 0)) {
    const auto name = [&](std::int32_t contactor) {
      return in_.body(contactor) < 0 ? std::string("a mesh")
                                     : "body " + std::to_string(*in_.bodies->id[in_.body(contactor)]);
    };
    throw std::invalid_argument("law " + law.python_name + " joins " + name(in_.candidates->contactor_a[i]) + " and " +
                                name(in_.candidates->contactor_b[i]) + " at a gap of " + std::to_string(gap[0]) +
                                " m, and has no length to strain: leave a gap between them, or give Bonded or a law "
                                "of a cohesive zone to what touches");
  }
  memory_.keys.push_back(in_.key(i));
  if (law.anchored) anchor(i, law);
  memory_.impulses.insert(memory_.impulses.end(), std::size_t(memory_.impulse_components), 0.0);
  const std::size_t end = memory_.states.size() + std::size_t(memory_.state_components);
  column = 0;
  for (const std::string& name : law.state) {
    if (name.back() == '*' && in_.dim() == 3)
      memory_.states.insert(memory_.states.end(), 3, 0.0);
    else
      memory_.states.push_back(state[n * column]);
    column += name.back() == '*' ? in_.dim() - 1 : 1;
  }
  memory_.states.resize(end, no_state);
  if (state[0] > 0) return Begun::joined;
  return law.anchored && !(geometry[0] > 0) ? Begun::without_area : Begun::loose; // bonds by sintering join later
}

} // namespace cairn
