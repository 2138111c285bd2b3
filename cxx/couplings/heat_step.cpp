// Temperatures of a step: d(enthalpy)/dt = heat over branches, from sources and from contacts, by the theta-method. The
// balance takes heat from the residual, so that it closes to the residual of the equation itself.
#include "../networks/heat_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "../networks/network.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/contact_fields.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

namespace {

constexpr double stefan_boltzmann = 5.670374419e-8; // [W/(m2 K4)], exact since 2019

double fourth(double t) { return t * t * t * t; }

// Adds heat flows out of each body over its branches [W]; positive out. Temperatures come in two parts, high and low.
void add_branches(const std::vector<std::int32_t>& a, const std::vector<std::int32_t>& b,
                  const std::vector<double>& value, const std::vector<double>& t, const std::vector<double>& low,
                  std::vector<double>& out) {
  for (std::size_t e = 0; e < value.size(); ++e) {
    if (std::isinf(value[e])) continue; // infinite conductance: both ends have one temperature, see join_perfectly
    const double q = value[e] * ((t[a[e]] - t[b[e]]) + (low[a[e]] - low[b[e]]));
    out[a[e]] += q;
    out[b[e]] -= q;
  }
}

} // namespace

// By the rise itself where capacities are constant: temperatures lose digits that a balance needs.
double HeatStep::stored(std::size_t i, const NetworkInput& in) const {
  double sum = rows_.capacity[i] * rise_[i];
  if (!(rows_.mass[i] > 0) || !std::isfinite(rows_.mass[i]) || rows_.material[i] < 0) return sum;
  const NetworkMaterial& m = in.materials[rows_.material[i]];
  if (m.capacity.constant() && !(m.latent > 0)) return sum + rows_.mass[i] * m.capacity.at(0) * rise_[i];
  return sum + rows_.mass[i] * (m.enthalpy(now_[i]) - m.enthalpy(begin_[i]));
}

// Heat that contacts make in the step [J]: friction by the mean of the velocities before and after, so that it is what
// the balance of energy loses, and what currents dissipate; to both sides by their shares.
void HeatStep::contact_heat(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out,
                            const std::vector<double>* joule) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  const auto n = std::size_t(c.count);
  contact_heat_.assign(std::size_t(unknowns(s.scene)), 0.0);
  const auto effusivity = [&](std::int32_t contactor) {
    const NetworkMaterial& m = in.materials[*k.material[contactor]];
    const double t = value_at(s, now_.data(), contactor);
    return std::sqrt(m.conductivity.at(t) * m.density * m.capacity.at(t));
  };
  const auto give = [&](const std::vector<double>& heat, double factor, NetworkInput::Split split, double& sum) {
    std::int64_t e = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
      double share = 0.5;
      if (split == NetworkInput::Split::effusivity) {
        const double one = effusivity(a), other = effusivity(b);
        if (one + other > 0) share = one / (one + other);
      }
      for (; e < branches_.of_contacts && branches_.of_contact[e] == std::int32_t(i); ++e) {
        contact_heat_[branches_.a[e]] += factor * branches_.weight[e] * share * heat[i];
        contact_heat_[branches_.b[e]] += factor * branches_.weight[e] * (1 - share) * heat[i];
      }
      sum += factor * heat[i];
    }
  };
  if (in.friction != NetworkInput::Split::none && s.strategy().has(contact_field_info("dissipated"))) {
    fit(local_, n);
    s.strategy().read(s, "dissipated", 1, local_.data());
    give(local_, 1, in.friction, out.balance.friction);
  }
  if (in.joule != NetworkInput::Split::none && joule) give(*joule, h, in.joule, out.balance.joule);
  for (const auto& [id, heat] : owed_) contact_heat_[std::size_t(unknown_of_id(s.scene, id))] += heat;
  out.balance.friction += owed_friction_;
}

void HeatStep::keep_impact_heat(Simulation& s, const NetworkInput& in, NetworkOutput& out) {
  const double before = out.balance.friction;
  begin_heat(s, in);
  branches_.lay(s);
  contact_heat(s, 0, in, out, nullptr);
  owed_friction_ = out.balance.friction - before;
  out.balance.friction = before;
  for (std::size_t i = 0; i < std::size_t(s.scene.bodies.count); ++i)
    if (std::abs(contact_heat_[i]) > 0) owed_.emplace_back(*s.scene.bodies.id[std::int64_t(i)], contact_heat_[i]);
}

// Temperatures given, reservoirs, powers, and flows at the start.
void HeatStep::begin_heat(const Simulation& s, const NetworkInput& in) {
  const auto n = std::size_t(unknowns(s.scene));
  copy_to(begin_, s.scene.bodies.temperature, s.scene.nodes.temperature);
  now_ = begin_;
  given_.assign(n, 0.0);
  for (auto* v : {&rise_, &rise_low_, &now_low_}) v->assign(n, 0.0);
  held_.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    if (std::isinf(rows_.mass[i]) && !in.steady) held_[i] = 1; // takes any heat
  for (std::size_t i = 0; i < std::size_t(s.scene.bodies.count); ++i)
    if (rows_.material[i] < 0) held_[i] = 1; // the mark of a joint in the world, which has no heat
  out_begin_.assign(n, 0.0);
  for (std::size_t j = 0; j < in.sources.size(); ++j)
    take_source(in.sources[j], rows_.source_body[j], held_.data(), now_.data(), given_.data());
}

// source_: residual of the equation of each body at now_ [W]; returns the largest relative to the largest flow.
double HeatStep::residual(double h, const NetworkInput& in) {
  const auto n = source_.size();
  const double late = in.steady ? 1 : in.theta, early = 1 - late;
  out_now_.assign(n, 0.0);
  add_branches(branches_.a, branches_.b, late_, now_, now_low_, out_now_);
  double largest = 0;
  for (std::size_t j = 0; j < in.sources.size(); ++j) {
    const NetworkSource& from = in.sources[j];
    for (std::size_t i = 0; i < from.ids.size(); ++i) {
      const std::int32_t body = rows_.source_body[j][i];
      if (body < 0) continue;
      if (from.kind == NetworkSource::convection) out_now_[body] += from.coefficient[i] * (now_[body] - from.value[i]);
      if (from.kind == NetworkSource::radiation)
        out_now_[body] += stefan_boltzmann * from.coefficient[i] * (fourth(now_[body]) - fourth(from.value[i]));
    }
  }
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = in.steady || std::isinf(rows_.mass[i]) ? 0 : stored(i, in) / h;
    const double leaves = late * out_now_[i] + early * out_begin_[i], comes = given_[i] + contact_heat_[i] / h;
    source_[i] = comes - leaves - kept;
    largest = std::max({largest, std::abs(kept), std::abs(leaves), std::abs(comes)});
  }
  for (std::size_t j = 0; j < in.branch_capacity.size() && !in.steady; ++j) { // consistent capacities couple rates
    const std::int32_t a = branches_.a[branches_.of_contacts + j], b = branches_.b[branches_.of_contacts + j];
    const double q = in.branch_capacity[j] / h * (rise_[a] - rise_[b]);
    source_[a] -= q;
    source_[b] += q;
  }
  if (!joined_.empty()) { // one answers for all
    lack_ = source_;
    for (std::size_t i = 0; i < n; ++i) {
      const auto by = std::size_t(joined_[i]);
      if (by == i) continue;
      source_[by] += source_[i];
      source_[i] = 0;
    }
  }
  for (std::size_t i = 0; i < n; ++i)
    if (!held_[i]) worst = std::max(worst, std::abs(source_[i]));
  return largest > 0 ? worst / largest : 0;
}

// Gives bodies joined by perfect conductors a common temperature from the begin of the step on: that of a held body,
// else the mean weighted by heat capacity. Increments preserve it. False if two held temperatures differ.
bool HeatStep::join_perfectly(const NetworkInput& in) {
  bool possible = true;
  const auto root = [&](std::int32_t i) {
    while (joined_[i] != i) i = joined_[i] = joined_[joined_[i]];
    return i;
  };
  for (std::size_t e = 0; e < branches_.value.size(); ++e) {
    if (!std::isinf(branches_.value[e])) continue;
    if (joined_.empty()) {
      joined_.resize(now_.size());
      std::iota(joined_.begin(), joined_.end(), 0);
    }
    std::int32_t a = root(branches_.a[e]), b = root(branches_.b[e]);
    possible = possible && !(held_[a] && held_[b] && (now_[a] < now_[b] || now_[a] > now_[b]));
    if (held_[a] < held_[b] || (held_[a] == held_[b] && b < a)) std::swap(a, b);
    joined_[b] = a; // held ones lead, then the first
  }
  if (joined_.empty()) return true;
  std::vector<double> heat(now_.size(), 0.0), store(now_.size(), 0.0);
  holders_.assign(now_.size(), 0);
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const std::int32_t by = joined_[i] = root(std::int32_t(i));
    holders_[by] += held_[i];
    double c = in.steady ? 1 : rows_.capacity[i];
    if (!in.steady && rows_.mass[i] > 0 && std::isfinite(rows_.mass[i]) && rows_.material[i] >= 0)
      c += rows_.mass[i] * in.materials[rows_.material[i]].enthalpy_slope(now_[i]);
    heat[by] += c * now_[i];
    store[by] += c;
  }
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const std::int32_t by = joined_[i];
    if (held_[by])
      now_[i] = now_[by];
    else if (store[by] > 0)
      now_[i] = heat[by] / store[by];
  }
  return possible;
}

double HeatStep::held_power(std::size_t unknown) const {
  if (unknown >= source_.size() || !held_[unknown]) return 0;
  if (!joined_.empty() && holders_[joined_[unknown]] > 1) return std::numeric_limits<double>::quiet_NaN();
  return -source_[unknown];
}

// Distributes heat flows over perfect conductors such that the balance closes at their ends.
void HeatStep::share_perfectly(double h, const NetworkInput& in, NetworkOutput& out) {
  if (joined_.empty()) return;
  slopes(h, in);
  x_.assign(source_.size(), 0.0);
  lack_.swap(source_);
  branches_.solve(in, source_, leak_, held_, x_.data(), out.report);
  lack_.swap(source_);
  perfect_ = branches_.through;
}

// Derivatives of the residual: leaks and branches.
void HeatStep::slopes(double h, const NetworkInput& in) {
  const double late = in.steady ? 1 : in.theta;
  leak_.assign(source_.size(), 0.0);
  for (std::size_t i = 0; i < leak_.size() && !in.steady; ++i) {
    leak_[i] = rows_.capacity[i] / h;
    if (rows_.mass[i] > 0 && std::isfinite(rows_.mass[i]) && rows_.material[i] >= 0)
      leak_[i] += rows_.mass[i] * in.materials[rows_.material[i]].enthalpy_slope(now_[i]) / h;
  }
  for (std::size_t j = 0; j < in.sources.size(); ++j)
    for (std::size_t i = 0; i < in.sources[j].ids.size(); ++i) {
      const std::int32_t body = rows_.source_body[j][i];
      if (body < 0) continue;
      const double c = in.sources[j].coefficient.empty() ? 0 : in.sources[j].coefficient[i], t = std::abs(now_[body]);
      if (in.sources[j].kind == NetworkSource::convection) leak_[body] += late * c;
      if (in.sources[j].kind == NetworkSource::radiation) leak_[body] += late * 4 * stefan_boltzmann * c * t * t * t;
    }
  for (std::size_t e = 0; e < branches_.value.size(); ++e) branches_.value[e] = late * late_[e];
  for (std::size_t j = 0; j < in.branch_capacity.size() && !in.steady; ++j)
    branches_.value[branches_.of_contacts + j] += in.branch_capacity[j] / h;
}

// Adds a correction of temperatures.
void HeatStep::move(double factor) {
  for (std::size_t i = 0; i < source_.size(); ++i)
    if (std::isfinite(x_[i])) {
      // what sums lose, differences along branches need where conductances are far apart (Knuth 1969)
      const double d = factor * x_[i], r = rise_[i], rise = r + d, back = rise - r;
      rise_low_[i] += (r - (rise - back)) + (d - back);
      const double t = begin_[i] + rise, part = t - begin_[i];
      rise_[i] = rise;
      now_[i] = t;
      now_low_[i] = ((begin_[i] - (t - part)) + (rise - part)) + rise_low_[i];
    }
}

// One solution where all is linear, else Newton's steps, halved where one makes things worse. Conductances lag by a
// step of Newton, which keeps the equations symmetric.
void HeatStep::solve_step(const Simulation& s, double h, const NetworkInput& in, NetworkOutput& out) {
  bool linear = true;
  for (const NetworkMaterial& m : in.materials)
    linear &= m.conductivity.constant() && m.capacity.constant() && !(m.latent > 0);
  for (const NetworkSource& from : in.sources) linear &= from.kind != NetworkSource::radiation;
  const auto n = source_.size();
  double before = std::numeric_limits<double>::infinity();
  int halvings = 0;
  for (out.report.rounds = 0;; ++out.report.rounds) {
    if (out.report.rounds > 0 && !linear) {
      spots_.conduct(s, in, now_.data(), clean_);
      branches_.weigh(clean_, in);
      late_ = branches_.value;
    }
    out.report.residual = residual(h, in);
    if (out.report.rounds > 0 && out.report.residual <= in.options.tolerance) break;
    if (out.report.rounds > 0 && linear && (out.report.rounds > 3 || !(out.report.residual < before / 2))) break;
    if (!std::isfinite(out.report.residual) || out.report.rounds > in.most_rounds) {
      out.report.status = std::isfinite(out.report.residual) ? "iteration_limit" : "not_finite";
      break;
    }
    const bool worse = !(out.report.residual < before);
    // below this nothing but rounding of temperatures is left
    if (worse && out.report.residual < 1e-9) break;
    if (worse && halvings < 8) {
      ++halvings;
      move(-std::pow(0.5, halvings));
      continue;
    }
    halvings = 0;
    before = out.report.residual;
    slopes(h, in);
    x_.assign(n, 0.0);
    out.report.solve = branches_.solve(in, source_, leak_, held_, x_.data(), out.report);
    if (out.report.solve.status != ConductionReport::converged) {
      out.report.status = "iteration_limit";
      break;
    }
    move(1);
  }
  if (linear) out.report.residual = out.report.solve.residual;
}

void HeatStep::settle(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out) const {
  const Candidates& c = s.candidates;
  const auto n = source_.size();
  const double late = in.steady ? 1 : in.theta, early = 1 - late;
  NetworkBalance step;
  double contact = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = in.steady || std::isinf(rows_.mass[i]) ? 0 : stored(i, in),
                 held = held_[i] ? -h * source_[i] : 0;
    step.stored += kept;
    step.given += h * given_[i];
    contact += contact_heat_[i];
    step.held += held; // heat that keeps the held temperature
    step.in_play += std::abs(kept) + h * std::abs(given_[i]) + std::abs(contact_heat_[i]) + std::abs(held);
  }
  for (std::size_t j = 0; j < in.sources.size(); ++j)
    for (std::size_t i = 0; i < in.sources[j].ids.size(); ++i) {
      const std::int32_t body = rows_.source_body[j][i];
      const NetworkSource& from = in.sources[j];
      if (body < 0) continue;
      const auto leaving = [&](const auto& of) {
        return h * from.coefficient[i] * (late * of(now_) + early * of(begin_));
      };
      if (from.kind == NetworkSource::convection)
        step.convection += leaving([&](const std::vector<double>& t) { return t[body] - from.value[i]; });
      if (from.kind == NetworkSource::radiation)
        step.radiation += leaving(
            [&](const std::vector<double>& t) { return stefan_boltzmann * (fourth(t[body]) - fourth(from.value[i])); });
    }
  const double closure = step.stored - step.given - step.held - contact + step.convection + step.radiation;
  step.in_play += std::abs(step.convection) + std::abs(step.radiation);
  out.balance.stored += step.stored;
  out.balance.given += step.given;
  out.balance.held += step.held;
  out.balance.convection += step.convection;
  out.balance.radiation += step.radiation;
  out.balance.closure += closure;
  out.balance.in_play += step.in_play;
  out.report.closure = step.in_play > 0 ? closure / step.in_play : 0;
  out.report.power = contact / h;
  out.report.flow = (step.given + step.held) / h;
  std::copy_n(clean_.begin(), c.count, out.conductance.begin());
  std::fill_n(out.flow.begin(), c.count, 0.0);
  for (std::int64_t e = 0; e < branches_.of_contacts; ++e) {
    double& through = out.flow[branches_.of_contact[e]];
    if (std::isinf(late_[e]) || std::isinf(early_[e])) {
      through += std::isinf(late_[e]) ? perfect_[e] : late * late_[e] * (now_[branches_.a[e]] - now_[branches_.b[e]]);
      continue;
    }
    through += late * late_[e] * (now_[branches_.a[e]] - now_[branches_.b[e]]) +
               early * early_[e] * (begin_[branches_.a[e]] - begin_[branches_.b[e]]);
  }
  std::fill_n(out.power.begin(), c.count, 0.0);
  out.report.branches = std::count_if(clean_.begin(), clean_.end(), [](double g) { return g > 0; });
  out.report.unfit = spots_.unfit;
}

void HeatStep::advance(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out,
                       const std::vector<double>* joule) {
  source_.assign(std::size_t(unknowns(s.scene)), 0.0);
  begin_heat(s, in);
  joined_.clear();
  branches_.lay(s);
  contact_heat(s, h, in, out, joule);
  fit(clean_, std::size_t(s.candidates.count));
  spots_.conduct(s, in, begin_.data(), clean_);
  branches_.weigh(clean_, in);
  early_ = late_ = branches_.value;
  if (!in.steady && in.theta < 1) { // flows at the start
    now_.swap(begin_);
    residual(h, in);
    now_.swap(begin_);
    out_begin_ = out_now_;
  }
  const bool possible = join_perfectly(in);
  for (std::size_t i = 0; i < now_.size(); ++i) rise_[i] = now_[i] - begin_[i];
  out.report.status = "converged";
  solve_step(s, h, in, out);
  share_perfectly(h, in, out);
  if (out.report.solve.open > 0) out.report.status = "open";
  if (!possible) out.report.status = "not_finite";
  give_back(now_, s.scene.bodies.temperature, s.scene.nodes.temperature);
  settle(s, h, in, out);
}

std::int64_t HeatStep::bytes() const {
  std::int64_t sum = 0;
  for (const auto* v : {&x_, &source_, &leak_, &begin_, &now_, &rise_, &given_, &out_begin_, &out_now_, &late_, &early_,
                        &contact_heat_, &clean_, &local_})
    sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
