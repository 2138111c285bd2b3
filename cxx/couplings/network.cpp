// Branches of a network from the contacts of a step.
#include "../networks/network.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../detection/key_search.hpp"
#include "../laws/law_info.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/contact_fields.hpp"
#include "../simulation/simulation.hpp"
#include "cairn/rows/conductance.h"

namespace cairn {
namespace {

constexpr int lanes = 128; // contacts that a kernel sees at once
constexpr double infinite = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();

} // namespace

const std::vector<ConductanceInfo>& conductance_infos() {
  static const std::vector<ConductanceInfo> rows = {
#define CAIRN_CONDUCTANCE(name, python, parameters, reads, meaning)                                                    \
  {#name, #python, parameters, reads, meaning, cairn_conductance_##name},
#include "../../core_f90/networks/networks.def"
  };
  return rows;
}

double PropertyTable::at(double t) const {
  if (value.empty()) return 0;
  if (value.size() == 1 || !(t > temperature.front())) return value.front();
  if (!(t < temperature.back())) return value.back();
  const auto k = std::size_t(std::upper_bound(temperature.begin(), temperature.end(), t) - temperature.begin());
  const double share = (t - temperature[k - 1]) / (temperature[k] - temperature[k - 1]);
  return value[k - 1] + share * (value[k] - value[k - 1]);
}

double PropertyTable::integral(double t) const {
  if (value.size() <= 1) return value.empty() ? 0 : value[0] * t;
  if (t <= temperature.front()) return value.front() * (t - temperature.front());
  double sum = 0;
  for (std::size_t k = 1; k < value.size(); ++k) {
    const double end = std::min(t, temperature[k]);
    sum += 0.5 * (value[k - 1] + at(end)) * (end - temperature[k - 1]);
    if (t <= temperature[k]) return sum;
  }
  return sum + value.back() * (t - temperature.back());
}

double NetworkMaterial::enthalpy(double t) const {
  const double taken = latent > 0 ? latent * std::clamp((t - melts) / (molten - melts), 0.0, 1.0) : 0;
  return capacity.integral(t) + taken;
}

double NetworkMaterial::enthalpy_slope(double t) const {
  return capacity.at(t) + (latent > 0 && t >= melts && t < molten ? latent / (molten - melts) : 0);
}

// Data of bodies, renewed when their order changes.
void Network::place(const Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const Contactors& k = s.scene.contactors;
  if (order_ == s.scene.order_version()) return;
  order_ = s.scene.order_version();
  const auto n = std::size_t(unknowns(s.scene));
  for (std::int64_t c = 0; c < k.count; ++c)
    if (std::size_t(*k.material[c]) >= materials.size()) materials.resize(std::size_t(*k.material[c]) + 1);
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const int entry = s.laws.find(int(m), int(m));
    materials[m].joint |= entry >= 0 && law_infos()[std::size_t(s.laws.entry(entry).law)].joins;
  }
  material_.assign(n, -1);
  for (std::int64_t c = k.count - 1; c >= 0; --c)
    if (*k.body[c] >= 0 && !materials[*k.material[c]].joint) material_[*k.body[c]] = *k.material[c];
  capacity_.assign(n, 0.0);
  mass_.assign(b.mass.values.begin(), b.mass.values.end());
  mass_.resize(n, 0.0); // nodes have the heat of their elements
  const auto row = [&](std::int64_t id) { return unknown_of_id(s.scene, id); };
  for (std::size_t i = 0; i < node.size(); ++i)
    if (const std::int32_t at = row(node[i]); at >= 0) capacity_[at] += node_capacity[i];
  fixed_a_.resize(branch_a.size());
  fixed_b_.resize(branch_b.size());
  for (std::size_t i = 0; i < branch_a.size(); ++i) {
    fixed_a_[i] = row(branch_a[i]);
    fixed_b_[i] = row(branch_b[i]);
  }
  source_body_.resize(sources.size());
  for (std::size_t j = 0; j < sources.size(); ++j) {
    source_body_[j].resize(sources[j].ids.size());
    std::transform(sources[j].ids.begin(), sources[j].ids.end(), source_body_[j].begin(), row);
  }
}

// Adds the capillary attraction to the contact force, since it presses the spot as well.
void Network::attract(Simulation& s) {
  bool any = false;
  for (int e = 0; e < s.laws.entries(); ++e) any |= law_infos()[std::size_t(s.laws.entry(e).law)].attracts;
  if (!any || !s.contacts_known || !s.strategy().has(contact_field_info("beta"))) return;
  fit(drawn_, std::size_t(s.candidates.count));
  s.strategy().read(s, "attraction", 1, drawn_.data());
  for (std::int64_t i = 0; i < s.candidates.count; ++i) force_[i] += drawn_[i];
}

// Forces, radii, moduli and speeds of sliding of all contacts.
void Network::gather(Simulation& s, double h) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  const auto n = std::size_t(c.count);
  fit(local_, n * dim);
  for (auto* v : {&force_, &radius_, &clean_, &sliding_}) fit(*v, n);
  for (auto* v : {&conductance, &flow, &power}) fit(*v, n);
  fit(broken_, n);
  s.strategy().read(s, "impulse_local", dim, local_.data());
  unfit_ = 0;
  for (std::size_t i = 0; i < n; ++i) force_[i] = local_[dim * i] / h;
  attract(s);
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    // for balls alone: bars touch along their sides, and the radius of a hull is that of its bounding ball
    const auto curvature = [&](std::int32_t at) {
      const double r = *k.radius[at];
      const auto& shape = info(Shape(*k.shape[at]));
      return !(r > 0) ? 0 : shape.hollow() ? -1 / r : shape.ball() ? 1 / r : 0;
    };
    const double sum = curvature(a) + curvature(b);
    radius_[i] = sum > 0 ? 1 / sum : none;
    if (materials[*k.material[a]].joint) force_[i] = 0;
    unfit_ += needs_radius && !(sum > 0) && force_[i] > 0;
  }
  if (needs_bond) {
    for (auto* v : {&intact_, &area_}) v->assign(n, 0.0);
    // smooth contacts keep no bonds, and impacts of a flight none
    if (s.contacts_known && s.strategy().has(contact_field_info("beta"))) {
      s.strategy().read(s, "state.beta", 1, intact_.data());
      s.strategy().read(s, "state.area", 1, area_.data());
    }
  }
  if (!film || !(film->sliding < infinite)) return;
  s.strategy().read(s, "relative_velocity", dim, local_.data());
  for (std::size_t i = 0; i < n; ++i) {
    double square = 0;
    for (int d = 1; d < dim; ++d) square += local_[dim * i + d] * local_[dim * i + d];
    sliding_[i] = std::sqrt(square);
  }
}

// Conductances of all contacts by the kernels, at temperatures (bodies), or null.
void Network::conduct(const Simulation& s, const double* temperature, std::vector<double>& out) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  fit(columns_, std::size_t(lanes) * cairn_contact_columns);
  fit(lane_out_, lanes);
  for (std::int64_t first = 0; first < c.count; first += lanes) {
    const auto n = std::int32_t(std::min<std::int64_t>(lanes, c.count - first));
    const auto column = [&](int which, int lane) -> double& { return columns_[std::size_t(which) * n + lane]; };
    for (int lane = 0; lane < n; ++lane) {
      const std::int64_t i = first + lane;
      const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
      const NetworkMaterial &ma = materials[*k.material[a]], &mb = materials[*k.material[b]];
      const auto at = [&](std::int32_t contactor) { return temperature ? value_at(s, temperature, contactor) : 0.0; };
      const auto soft = [](const NetworkMaterial& m) { return (1 - m.poisson * m.poisson) / m.young; };
      column(cairn_column_gap, lane) = c.gap[i];
      column(cairn_column_force, lane) = force_[i];
      column(cairn_column_radius, lane) = radius_[i];
      column(cairn_column_modulus, lane) = 1 / (soft(ma) + soft(mb));
      column(cairn_column_conductivity_a, lane) = ma.conductivity.at(at(a));
      column(cairn_column_conductivity_b, lane) = mb.conductivity.at(at(b));
      column(cairn_column_hardness, lane) =
          ma.hardness > 0 && mb.hardness > 0 ? std::min(ma.hardness, mb.hardness) : std::max(ma.hardness, mb.hardness);
      column(cairn_column_area, lane) = needs_bond ? area_[i] : 0;
      column(cairn_column_intact, lane) = needs_bond ? std::clamp(intact_[i], 0.0, 1.0) : 0;
      column(cairn_column_depth, lane) = depth;
      out[i] = 0;
    }
    for (const Use& use : kernels) {
      use.kernel(n, columns_.data(), std::int32_t(use.params.size()), use.params.data(), lane_out_.data());
      for (int lane = 0; lane < n; ++lane) out[first + lane] += lane_out_[lane];
    }
  }
  for (std::int64_t i = 0; i < c.count; ++i) // of a user's kernel, or of a contact without size
    if (!(out[i] >= 0) || materials[*k.material[c.contactor_a[i]]].joint) out[i] = 0;
}

// Value of the body that carries a contactor; value: per unknown; for a mesh contactor the mean over its nodes.
double value_at(const Simulation& s, const double* value, std::int32_t contactor) {
  const std::int32_t body = *s.scene.contactors.body[contactor];
  if (body >= 0) return value[body];
  const MeshSet::Middle& middle = s.meshes.middle(contactor);
  double sum = 0;
  for (int j = 0; j < 4 && middle.node[j] >= 0; ++j)
    sum += middle.weight[j] * value[unknown_of_node(s.scene, middle.node[j])];
  return sum;
}

// Films that were gone stay so while their contacts live; sliding takes further ones.
void Network::recall_films(const Simulation& s) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  std::fill(broken_.begin(), broken_.end(), std::int8_t(0));
  if (!film) return;
  scratch_.begin();
  const auto key_of = [&](std::int64_t i) {
    return ContactKey{*k.id[c.contactor_a[i]], *k.id[c.contactor_b[i]], c.feature[i], c.image[i]};
  };
  auto* place = scratch_.take<std::int32_t>(c.count);
  find_keys(broken_keys, c.count, key_of, 1, scratch_, place);
  for (std::int64_t i = 0; i < c.count; ++i)
    broken_[i] = force_[i] > 0 && (place[i] >= 0 || sliding_[i] > film->sliding);
}

void Network::remember_films(const Simulation& s) {
  if (!film) return;
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  broken_keys.clear();
  for (std::int64_t i = 0; i < c.count; ++i)
    if (broken_[i]) broken_keys.push_back({*k.id[c.contactor_a[i]], *k.id[c.contactor_b[i]], c.feature[i], c.image[i]});
}

// Branches of contacts. One on a mesh goes to the nodes that carry its point, each by its weight.
void Network::lay_branches(const Simulation& s) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  a_.clear();
  b_.clear();
  of_contact_.clear();
  weight_.clear();
  struct Carried {
    std::int32_t body[4];
    double weight[4];
    int count = 0;
  };
  const auto carry = [&](std::int32_t contactor, std::int64_t i, bool other) {
    Carried out;
    if (const std::int32_t body = *k.body[contactor]; body >= 0) {
      out.body[0] = body;
      out.weight[0] = 1;
      out.count = 1;
      return out;
    }
    double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0}, sum = 0;
    if (s.scene.cell.any() && other) image_shift(s.scene.cell, c.image[i], shift);
    for (int d = 0; d < std::min(s.scene.dim, 3); ++d) point[d] = c.point[s.scene.dim * i + d] - shift[d];
    const Mapping m = s.meshes.mapping(s.scene.nodes, contactor, point, other ? c.contactor_a[i] : c.contactor_b[i]);
    for (int j = 0; j < 4; ++j) {
      if (m.node[j] < 0 || !(m.weight[j] > 0)) continue;
      out.body[out.count] = std::int32_t(unknown_of_node(s.scene, s.meshes.meshes[m.mesh].node(m.node[j])));
      sum += out.weight[out.count++] = m.weight[j];
    }
    for (int j = 0; j < out.count; ++j) out.weight[j] /= sum;
    return out;
  };
  for (std::int64_t i = 0; i < c.count; ++i) {
    const Carried one = carry(c.contactor_a[i], i, false), other = carry(c.contactor_b[i], i, true);
    for (int p = 0; p < one.count; ++p)
      for (int q = 0; q < other.count; ++q) {
        a_.push_back(one.body[p]);
        b_.push_back(other.body[q]);
        of_contact_.push_back(std::int32_t(i));
        weight_.push_back(one.weight[p] * other.weight[q]);
      }
  }
  contact_branches_ = std::int64_t(a_.size());
  for (std::size_t j = 0; j < fixed_a_.size(); ++j) {
    const bool there = fixed_a_[j] >= 0 && fixed_b_[j] >= 0;
    a_.push_back(there ? fixed_a_[j] : 0);
    b_.push_back(there ? fixed_b_[j] : 0);
  }
  value_.resize(a_.size());
}

void Network::weigh_branches(const std::vector<double>& of_contact) {
  for (std::int64_t e = 0; e < contact_branches_; ++e) value_[e] = weight_[e] * of_contact[of_contact_[e]];
  for (std::size_t j = 0; j < fixed_a_.size(); ++j) value_[contact_branches_ + j] = branch_conductance[j];
}

// Bodies of an electrode one after the other, joined perfectly.
void Network::electrodes() {
  for (std::size_t j = 0; j < sources.size(); ++j) {
    if (!sources[j].electrode) continue;
    std::int32_t before = -1;
    for (const std::int32_t i : source_body_[j]) {
      if (i < 0) continue;
      if (before >= 0) {
        a_.push_back(before);
        b_.push_back(i);
        value_.push_back(infinite);
      }
      before = i;
    }
  }
}

ConductionReport Network::solve(double* x) {
  through_.resize(a_.size());
  ConductionGraph g;
  g.n = std::int64_t(source_.size());
  g.branches = std::int64_t(a_.size());
  g.a = a_.data();
  g.b = b_.data();
  g.conductance = value_.data();
  g.leak = leak_.data();
  g.held = held_.data();
  const ConductionReport r = conduction_.solve(g, source_.data(), x, through_.data(), options);
  report.factorisations += r.factorisations;
  report.iterations += r.iterations;
  return r;
}

std::int64_t Network::bytes() const {
  std::int64_t sum = conduction_.bytes() + scratch_.bytes();
  for (const auto* v : {&conductance,   &flow,      &power,   &columns_,   &lane_out_,  &force_,   &radius_, &clean_,
                        &local_,        &sliding_,  &weight_, &value_,     &through_,   &x_,       &source_, &leak_,
                        &begin_,        &now_,      &rise_,   &given_,     &out_begin_, &out_now_, &late_,   &early_,
                        &contact_heat_, &capacity_, &mass_,   &potential_, &warm_})
    sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&a_, &b_, &of_contact_, &material_, &fixed_a_, &fixed_b_})
    sum += std::int64_t(4 * v->capacity());
  return sum + std::int64_t(sizeof(ContactKey) * broken_keys.capacity());
}

void Networks::advance(Simulation& s, double h) {
  s.strategy().view(s);
  if (electrical) electrical->advance_potential(s, h, thermal ? &*thermal : nullptr);
  if (thermal) thermal->advance_temperature(s, h, electrical ? &*electrical : nullptr);
  forget_flight();
}

void Networks::keep_flight(Simulation& s, double time) {
  if (electrical) electrical->flown = time;
  if (!thermal) return;
  thermal->flown = time;
  thermal->keep_impact_heat(s);
}

void Networks::forget_flight() {
  if (electrical) electrical->forget_flight();
  if (thermal) thermal->forget_flight();
}

std::int64_t Networks::bytes() const {
  return (electrical ? electrical->bytes() : 0) + (thermal ? thermal->bytes() : 0);
}

} // namespace cairn
