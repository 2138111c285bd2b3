#include "../networks/contact_spots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../laws/law_info.hpp"
#include "../networks/network.hpp"
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

// Adds the capillary attraction to the contact force, since it presses the spot as well.
void ContactSpots::attract(Simulation& s) {
  bool any = false;
  for (int e = 0; e < s.laws.entries(); ++e) any |= law_infos()[std::size_t(s.laws.entry(e).law)].attracts;
  if (!any || !s.contacts_known || !s.strategy().has(contact_field_info("beta"))) return;
  fit(drawn_, std::size_t(s.candidates.count));
  s.strategy().read(s, "attraction", 1, drawn_.data());
  for (std::int64_t i = 0; i < s.candidates.count; ++i) force[i] += drawn_[i];
}

// Intact share and area of bonds, of laws that remember them.
void ContactSpots::gather_bonds(Simulation& s) {
  for (auto* v : {&intact_, &area_}) v->assign(std::size_t(s.candidates.count), 0.0);
  // smooth contacts keep no bonds, and impacts of a flight none
  if (!s.contacts_known || !s.strategy().has(contact_field_info("beta"))) return;
  s.strategy().read(s, "state.beta", 1, intact_.data());
  s.strategy().read(s, "state.area", 1, area_.data());
}

void ContactSpots::gather_sliding(Simulation& s) {
  const int dim = s.scene.dim;
  s.strategy().read(s, "relative_velocity", dim, local_.data());
  for (std::size_t i = 0; i < std::size_t(s.candidates.count); ++i) {
    double square = 0;
    for (int d = 1; d < dim; ++d) square += local_[dim * i + d] * local_[dim * i + d];
    sliding[i] = std::sqrt(square);
  }
}

// Forces, radii, moduli and speeds of sliding of all contacts.
void ContactSpots::gather(Simulation& s, double h, const NetworkInput& in) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  const auto n = std::size_t(c.count);
  fit(local_, n * dim);
  for (auto* v : {&force, &radius, &sliding}) fit(*v, n);
  s.strategy().read(s, "impulse_local", dim, local_.data());
  unfit = 0;
  for (std::size_t i = 0; i < n; ++i) force[i] = local_[dim * i] / h;
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
    radius[i] = sum > 0 ? 1 / sum : none;
    if (in.materials[*k.material[a]].joint) force[i] = 0;
    unfit += in.needs_radius && !(sum > 0) && force[i] > 0;
  }
  if (in.needs_bond) gather_bonds(s);
  if (in.film && in.film->sliding < infinite) gather_sliding(s);
}

// Conductances of all contacts by the kernels, at temperatures (bodies), or null.
void ContactSpots::conduct(const Simulation& s, const NetworkInput& in, const double* temperature,
                           std::vector<double>& out) {
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
      const NetworkMaterial &ma = in.materials[*k.material[a]], &mb = in.materials[*k.material[b]];
      const auto at = [&](std::int32_t contactor) { return temperature ? value_at(s, temperature, contactor) : 0.0; };
      const auto soft = [](const NetworkMaterial& m) { return (1 - m.poisson * m.poisson) / m.young; };
      column(cairn_column_gap, lane) = c.gap[i];
      column(cairn_column_force, lane) = force[i];
      column(cairn_column_radius, lane) = radius[i];
      column(cairn_column_modulus, lane) = 1 / (soft(ma) + soft(mb));
      column(cairn_column_conductivity_a, lane) = ma.conductivity.at(at(a));
      column(cairn_column_conductivity_b, lane) = mb.conductivity.at(at(b));
      column(cairn_column_hardness, lane) =
          ma.hardness > 0 && mb.hardness > 0 ? std::min(ma.hardness, mb.hardness) : std::max(ma.hardness, mb.hardness);
      column(cairn_column_area, lane) = in.needs_bond ? area_[i] : 0;
      column(cairn_column_intact, lane) = in.needs_bond ? std::clamp(intact_[i], 0.0, 1.0) : 0;
      column(cairn_column_depth, lane) = in.depth;
      out[i] = 0;
    }
    for (const NetworkInput::Use& use : in.kernels) {
      use.kernel(n, columns_.data(), std::int32_t(use.params.size()), use.params.data(), lane_out_.data());
      for (int lane = 0; lane < n; ++lane) out[first + lane] += lane_out_[lane];
    }
  }
  for (std::int64_t i = 0; i < c.count; ++i) // of a user's kernel, or of a contact without size
    if (!(out[i] >= 0) || in.materials[*k.material[c.contactor_a[i]]].joint) out[i] = 0;
}

std::int64_t ContactSpots::bytes() const {
  std::int64_t sum = 0;
  for (const auto* v : {&columns_, &lane_out_, &force, &radius, &local_, &sliding})
    sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
