// Temperatures of a step: d(enthalpy)/dt = heat over branches, from sources and from contacts, by the theta-method. The
// balance takes heat from the residual, so that it closes to the residual of the equation itself.
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

} // namespace

// By the rise itself where capacities are constant: temperatures lose digits that a balance needs.
double Network::stored(std::size_t i) const {
  double sum = capacity_[i] * rise_[i];
  if (!(mass_[i] > 0) || !std::isfinite(mass_[i]) || material_[i] < 0) return sum;
  const NetworkMaterial& m = materials[material_[i]];
  if (m.capacity.constant() && !(m.latent > 0)) return sum + mass_[i] * m.capacity.at(0) * rise_[i];
  return sum + mass_[i] * (m.enthalpy(now_[i]) - m.enthalpy(begin_[i]));
}

// Heat that contacts make in the step [J]: friction by the mean of the velocities before and after, so that it is what
// the balance of energy loses, and what currents dissipate; to both sides by their shares.
void Network::contact_heat(Simulation& s, double h, const Network* electrical) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  const auto n = std::size_t(c.count);
  contact_heat_.assign(std::size_t(unknowns(s.scene)), 0.0);
  const auto effusivity = [&](std::int32_t contactor) {
    const NetworkMaterial& m = materials[*k.material[contactor]];
    const double t = value_at(s, now_.data(), contactor);
    return std::sqrt(m.conductivity.at(t) * m.density * m.capacity.at(t));
  };
  const auto give = [&](const std::vector<double>& heat, double factor, Split split, double& sum) {
    std::int64_t e = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
      double share = 0.5;
      if (split == Split::effusivity) {
        const double one = effusivity(a), other = effusivity(b);
        if (one + other > 0) share = one / (one + other);
      }
      for (; e < contact_branches_ && of_contact_[e] == std::int32_t(i); ++e) {
        contact_heat_[a_[e]] += factor * weight_[e] * share * heat[i];
        contact_heat_[b_[e]] += factor * weight_[e] * (1 - share) * heat[i];
      }
      sum += factor * heat[i];
    }
  };
  if (friction != Split::none && s.strategy().has(contact_field_info("dissipated"))) {
    fit(local_, n);
    s.strategy().read(s, "dissipated", 1, local_.data());
    give(local_, 1, friction, balance.friction);
  }
  if (joule != Split::none && electrical) give(electrical->power, h, joule, balance.joule);
  for (const auto& [id, heat] : owed_) contact_heat_[std::size_t(unknown_of_id(s.scene, id))] += heat;
  balance.friction += owed_friction_;
}

void Network::keep_impact_heat(Simulation& s) {
  const double before = balance.friction;
  place(s);
  begin_heat(s);
  lay_branches(s);
  contact_heat(s, 0, nullptr);
  owed_friction_ = balance.friction - before;
  balance.friction = before;
  for (std::size_t i = 0; i < std::size_t(s.scene.bodies.count); ++i)
    if (std::abs(contact_heat_[i]) > 0) owed_.emplace_back(*s.scene.bodies.id[std::int64_t(i)], contact_heat_[i]);
}

// Adds heat flows out of each body over its branches [W]; positive out. Temperatures come in two parts, high and low.
static void add_branches(const std::vector<std::int32_t>& a, const std::vector<std::int32_t>& b,
                         const std::vector<double>& value, const std::vector<double>& t, const std::vector<double>& low,
                         std::vector<double>& out) {
  for (std::size_t e = 0; e < value.size(); ++e) {
    if (std::isinf(value[e])) continue; // infinite conductance: both ends have one temperature, see join_perfectly
    const double q = value[e] * ((t[a[e]] - t[b[e]]) + (low[a[e]] - low[b[e]]));
    out[a[e]] += q;
    out[b[e]] -= q;
  }
}

// Temperatures given, reservoirs, powers, and flows at the start.
void Network::begin_heat(const Simulation& s) {
  const auto n = std::size_t(unknowns(s.scene));
  copy_to(begin_, s.scene.bodies.temperature, s.scene.nodes.temperature);
  now_ = begin_;
  given_.assign(n, 0.0);
  for (auto* v : {&rise_, &rise_low_, &now_low_}) v->assign(n, 0.0);
  held_.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    if (std::isinf(mass_[i]) && !steady) held_[i] = 1; // takes any heat
  for (std::size_t i = 0; i < std::size_t(s.scene.bodies.count); ++i)
    if (material_[i] < 0) held_[i] = 1; // the mark of a joint in the world, which has no heat
  out_begin_.assign(n, 0.0);
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const NetworkSource& from = sources[j];
    bool first = true;
    for (std::size_t i = 0; i < from.ids.size(); ++i) {
      const std::int32_t body = source_body_[j][i];
      if (body < 0) continue;
      if (from.kind == NetworkSource::held) {
        held_[body] = 1;
        now_[body] = from.value[i];
      } else if (from.kind == NetworkSource::flow && (!from.electrode || first)) {
        given_[body] += from.value[i];
      }
      first = false;
    }
  }
}

// source_: residual of the equation of each body at now_ [W]; returns the largest relative to the largest flow.
double Network::heat_residual(double h) {
  const auto n = source_.size();
  const double late = steady ? 1 : theta, early = 1 - late;
  out_now_.assign(n, 0.0);
  add_branches(a_, b_, late_, now_, now_low_, out_now_);
  double largest = 0;
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const NetworkSource& from = sources[j];
    for (std::size_t i = 0; i < from.ids.size(); ++i) {
      const std::int32_t body = source_body_[j][i];
      if (body < 0) continue;
      if (from.kind == NetworkSource::convection) out_now_[body] += from.coefficient[i] * (now_[body] - from.value[i]);
      if (from.kind == NetworkSource::radiation)
        out_now_[body] += stefan_boltzmann * from.coefficient[i] * (fourth(now_[body]) - fourth(from.value[i]));
    }
  }
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = steady || std::isinf(mass_[i]) ? 0 : stored(i) / h;
    const double out = late * out_now_[i] + early * out_begin_[i], in = given_[i] + contact_heat_[i] / h;
    source_[i] = in - out - kept;
    largest = std::max({largest, std::abs(kept), std::abs(out), std::abs(in)});
  }
  for (std::size_t j = 0; j < branch_capacity.size() && !steady; ++j) { // consistent capacities couple rates
    const std::int32_t a = a_[contact_branches_ + j], b = b_[contact_branches_ + j];
    const double q = branch_capacity[j] / h * (rise_[a] - rise_[b]);
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
bool Network::join_perfectly() {
  bool possible = true;
  const auto root = [&](std::int32_t i) {
    while (joined_[i] != i) i = joined_[i] = joined_[joined_[i]];
    return i;
  };
  for (std::size_t e = 0; e < value_.size(); ++e) {
    if (!std::isinf(value_[e])) continue;
    if (joined_.empty()) {
      joined_.resize(now_.size());
      std::iota(joined_.begin(), joined_.end(), 0);
    }
    std::int32_t a = root(a_[e]), b = root(b_[e]);
    possible = possible && !(held_[a] && held_[b] && (now_[a] < now_[b] || now_[a] > now_[b]));
    if (held_[a] < held_[b] || (held_[a] == held_[b] && b < a)) std::swap(a, b);
    joined_[b] = a; // held ones lead, then the first
  }
  if (joined_.empty()) return true;
  std::vector<double> heat(now_.size(), 0.0), store(now_.size(), 0.0);
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const std::int32_t by = joined_[i] = root(std::int32_t(i));
    double c = steady ? 1 : capacity_[i];
    if (!steady && mass_[i] > 0 && std::isfinite(mass_[i]) && material_[i] >= 0)
      c += mass_[i] * materials[material_[i]].enthalpy_slope(now_[i]);
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

// Distributes heat flows over perfect conductors such that the balance closes at their ends.
void Network::share_perfectly(double h) {
  if (joined_.empty()) return;
  slopes(h);
  x_.assign(source_.size(), 0.0);
  lack_.swap(source_);
  solve(x_.data());
  lack_.swap(source_);
  perfect_ = through_;
}

// Derivatives of the residual: leaks and branches.
void Network::slopes(double h) {
  const double late = steady ? 1 : theta;
  leak_.assign(source_.size(), 0.0);
  for (std::size_t i = 0; i < leak_.size() && !steady; ++i) {
    leak_[i] = capacity_[i] / h;
    if (mass_[i] > 0 && std::isfinite(mass_[i]) && material_[i] >= 0)
      leak_[i] += mass_[i] * materials[material_[i]].enthalpy_slope(now_[i]) / h;
  }
  for (std::size_t j = 0; j < sources.size(); ++j)
    for (std::size_t i = 0; i < sources[j].ids.size(); ++i) {
      const std::int32_t body = source_body_[j][i];
      if (body < 0) continue;
      const double c = sources[j].coefficient.empty() ? 0 : sources[j].coefficient[i], t = std::abs(now_[body]);
      if (sources[j].kind == NetworkSource::convection) leak_[body] += late * c;
      if (sources[j].kind == NetworkSource::radiation) leak_[body] += late * 4 * stefan_boltzmann * c * t * t * t;
    }
  for (std::size_t e = 0; e < value_.size(); ++e) value_[e] = late * late_[e];
  for (std::size_t j = 0; j < branch_capacity.size() && !steady; ++j)
    value_[contact_branches_ + j] += branch_capacity[j] / h;
}

void Network::advance_temperature(Simulation& s, double h, const Network* electrical) {
  place(s);
  gather(s, h);
  report = {};
  source_.assign(std::size_t(unknowns(s.scene)), 0.0);
  begin_heat(s);
  joined_.clear();
  lay_branches(s);
  h += flown;
  contact_heat(s, h, electrical);
  conduct(s, begin_.data(), clean_);
  weigh_branches(clean_);
  early_ = late_ = value_;
  if (!steady && theta < 1) { // flows at the start
    now_.swap(begin_);
    heat_residual(h);
    now_.swap(begin_);
    out_begin_ = out_now_;
  }
  const bool possible = join_perfectly();
  for (std::size_t i = 0; i < now_.size(); ++i) rise_[i] = now_[i] - begin_[i];
  report.status = "converged";
  step_heat(s, h);
  share_perfectly(h);
  if (report.solve.open > 0) report.status = "open";
  if (!possible) report.status = "not_finite";
  give_back(now_, s.scene.bodies.temperature, s.scene.nodes.temperature);
  settle_heat(s, h);
  report.coupling = coupling(s);
  grow(s);
}

// One solution where all is linear, else Newton's steps, halved where one makes things worse. Conductances lag by a
// step of Newton, which keeps the equations symmetric.
void Network::step_heat(const Simulation& s, double h) {
  bool linear = true;
  for (const NetworkMaterial& m : materials)
    linear &= m.conductivity.constant() && m.capacity.constant() && !(m.latent > 0);
  for (const NetworkSource& from : sources) linear &= from.kind != NetworkSource::radiation;
  const auto n = source_.size();
  const auto move = [&](double factor) {
    for (std::size_t i = 0; i < n; ++i)
      if (std::isfinite(x_[i])) {
        // what sums lose, differences along branches need where conductances are far apart (Knuth 1969)
        const double d = factor * x_[i], r = rise_[i], rise = r + d, back = rise - r;
        rise_low_[i] += (r - (rise - back)) + (d - back);
        const double t = begin_[i] + rise, part = t - begin_[i];
        rise_[i] = rise;
        now_[i] = t;
        now_low_[i] = ((begin_[i] - (t - part)) + (rise - part)) + rise_low_[i];
      }
  };
  double before = std::numeric_limits<double>::infinity();
  int halvings = 0;
  for (report.rounds = 0;; ++report.rounds) {
    if (report.rounds > 0 && !linear) {
      conduct(s, now_.data(), clean_);
      weigh_branches(clean_);
      late_ = value_;
    }
    report.residual = heat_residual(h);
    if (report.rounds > 0 && report.residual <= options.tolerance) break;
    if (report.rounds > 0 && linear && (report.rounds > 3 || !(report.residual < before / 2))) break;
    if (!std::isfinite(report.residual) || report.rounds > most_rounds) {
      report.status = std::isfinite(report.residual) ? "iteration_limit" : "not_finite";
      break;
    }
    const bool worse = !(report.residual < before);
    // below this nothing but rounding of temperatures is left
    if (worse && report.residual < 1e-9) break;
    if (worse && halvings < 8) {
      ++halvings;
      move(-std::pow(0.5, halvings));
      continue;
    }
    halvings = 0;
    before = report.residual;
    slopes(h);
    x_.assign(n, 0.0);
    report.solve = solve(x_.data());
    if (report.solve.status != ConductionReport::converged) {
      report.status = "iteration_limit";
      break;
    }
    move(1);
  }
  if (linear) report.residual = report.solve.residual;
}

void Network::settle_heat(Simulation& s, double h) {
  const Candidates& c = s.candidates;
  const auto n = source_.size();
  const double late = steady ? 1 : theta, early = 1 - late;
  NetworkBalance step;
  double contact = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = steady || std::isinf(mass_[i]) ? 0 : stored(i), held = held_[i] ? -h * source_[i] : 0;
    step.stored += kept;
    step.given += h * given_[i];
    contact += contact_heat_[i];
    step.held += held; // heat that keeps the held temperature
    step.in_play += std::abs(kept) + h * std::abs(given_[i]) + std::abs(contact_heat_[i]) + std::abs(held);
  }
  for (std::size_t j = 0; j < sources.size(); ++j)
    for (std::size_t i = 0; i < sources[j].ids.size(); ++i) {
      const std::int32_t body = source_body_[j][i];
      const NetworkSource& from = sources[j];
      if (body < 0) continue;
      const auto out = [&](const auto& of) { return h * from.coefficient[i] * (late * of(now_) + early * of(begin_)); };
      if (from.kind == NetworkSource::convection)
        step.convection += out([&](const std::vector<double>& t) { return t[body] - from.value[i]; });
      if (from.kind == NetworkSource::radiation)
        step.radiation += out(
            [&](const std::vector<double>& t) { return stefan_boltzmann * (fourth(t[body]) - fourth(from.value[i])); });
    }
  const double closure = step.stored - step.given - step.held - contact + step.convection + step.radiation;
  step.in_play += std::abs(step.convection) + std::abs(step.radiation);
  balance.stored += step.stored;
  balance.given += step.given;
  balance.held += step.held;
  balance.convection += step.convection;
  balance.radiation += step.radiation;
  balance.closure += closure;
  balance.in_play += step.in_play;
  report.closure = step.in_play > 0 ? closure / step.in_play : 0;
  report.power = contact / h;
  report.flow = (step.given + step.held) / h;
  std::copy_n(clean_.begin(), c.count, conductance.begin());
  std::fill_n(flow.begin(), c.count, 0.0);
  for (std::int64_t e = 0; e < contact_branches_; ++e) {
    double& through = flow[of_contact_[e]];
    if (std::isinf(late_[e]) || std::isinf(early_[e])) {
      through += std::isinf(late_[e]) ? perfect_[e] : late * late_[e] * (now_[a_[e]] - now_[b_[e]]);
      continue;
    }
    through += late * late_[e] * (now_[a_[e]] - now_[b_[e]]) + early * early_[e] * (begin_[a_[e]] - begin_[b_[e]]);
  }
  std::fill_n(power.begin(), c.count, 0.0);
  report.branches = std::count_if(clean_.begin(), clean_.end(), [](double g) { return g > 0; });
  report.unfit = unfit_;
}

} // namespace cairn
