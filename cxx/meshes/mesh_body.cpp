#include "mesh_body.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "../base/call.hpp"
#include "../bodies/nodes.hpp"

namespace cairn {

MeshBody::MeshBody(MeshModel m) : model(std::move(m)) {
  const auto n = std::size_t(model.dofs());
  const int dim = model.dim;
  if (model.bulk) model.bulk->mesh = model.name;
  lumped_.assign(n, 0);
  for (std::int64_t column = 0; column < model.mass.n; ++column)
    for (std::int64_t e = model.mass.start[column]; e < model.mass.start[column + 1]; ++e) {
      lumped_[model.mass.row[e]] += model.mass.value[e];
      if (model.mass.row[e] != column) lumped_[column] += model.mass.value[e];
    }
  for (std::size_t i = 0; i < n && !model.node_mass.empty(); ++i) lumped_[i] = model.node_mass[i / dim];
  for (const double mass : lumped_) mean_mass_ += mass / double(n);
  for (std::vector<double>* v :
       {&q_, &v_, &free_, &f_, &a_, &b_, &stiff_q_, &stiff_, &damped_, &momentum_, &stiff_begin_, &damped_begin_,
        &momentum_begin_, &known_, &stiff_known_, &damped_known_, &momentum_known_})
    v->assign(n, 0);
  impulse.assign(n, 0);
  reaction.assign(n, 0);
  lumped_mass_ = model.node_mass.empty();
  const auto vanishes = [](double x) { return !(x < 0 || x > 0); };
  for (std::int64_t column = 0; column < model.mass.n; ++column)
    for (std::int64_t e = model.mass.start[column]; e < model.mass.start[column + 1]; ++e)
      lumped_mass_ = lumped_mass_ && (model.mass.row[e] == column || vanishes(model.mass.value[e]));
  if (!model.mode_rates.empty()) find_modal_momentum();
  damps_ = model.times_damping || !model.mode_rates.empty() ||
           !std::all_of(model.damping.value.begin(), model.damping.value.end(), vanishes);
  find_rayleigh();
  double extents[3] = {0, 0, 0};
  for (int k = 0; k < dim; ++k) {
    double low = model.reference[k], high = low;
    for (std::size_t i = k; i < n; i += dim)
      low = std::min(low, model.reference[i]), high = std::max(high, model.reference[i]);
    extents[k] = high - low;
  }
  const double longest = std::max({extents[0], extents[1], extents[2]}); // of axes that are not there 0
  double extent = longest;
  for (const double e : extents) // a sheet, or a row of nodes, has none but rounding along some axes
    if (e > 1e-9 * longest) extent = std::min(extent, e);
  size_ = extent / std::pow(double(model.nodes()), 1.0 / dim);
  model.side_from.assign(std::size_t(dim == 2 ? model.nodes() : 0), -1);
  model.side_to = model.side_from;
  for (std::size_t s = 0; dim == 2 && s < model.side_nodes.size() / 4; ++s) {
    model.side_from[std::size_t(model.side_nodes[4 * s])] = std::int32_t(s);
    model.side_to[std::size_t(model.side_nodes[4 * s + 1])] = std::int32_t(s);
  }
  for (int k = 0; k < dim; ++k) {
    bool given = false;
    for (std::size_t i = k; i < n; i += dim) given = given || model.held[i];
    if (!given && mean_mass_ > 0) inverse_mass_ = dim / (mean_mass_ * double(n));
  }
  model.options.held = model.held;
  mark_contact_nodes();
  if (!model.ties.empty()) model.ties.start(dim, model.reference, model.mass, model.options);
}

// Nodes that contacts may rest on, now or later.
void MeshBody::mark_contact_nodes() {
  std::vector<std::uint8_t>& last = model.options.last;
  last.assign(std::size_t(model.dofs()), 0);
  for (const std::vector<std::int32_t>* nodes : {&model.contact_nodes, &model.point_nodes, &model.side_nodes})
    for (const std::int32_t node : *nodes)
      for (int k = 0; k < model.dim && node >= 0; ++k) last[model.dim * node + k] = 1;
  touching_ = std::max<std::int64_t>(1, std::count(last.begin(), last.end(), 1) / model.dim);
}

void MeshBody::multiply(const SparseMatrix& a, const double* x, double* out) const {
  std::fill_n(out, model.dofs(), 0.0);
  for (std::int64_t column = 0; column < a.n; ++column) {
    double sum = 0;
    for (std::int64_t e = a.start[column]; e < a.start[column + 1]; ++e) {
      const std::int32_t row = a.row[e];
      out[row] += a.value[e] * x[column];
      if (row != column) sum += a.value[e] * x[row];
    }
    out[column] += sum;
  }
}

void MeshBody::multiply_mass(const double* x, double* out) const {
  if (!lumped_mass_) return multiply(model.mass, x, out);
  for (std::int64_t i = 0; i < model.dofs(); ++i) out[i] = lumped_[i] * x[i];
}

void MeshBody::weigh(const double* gravity) {
  const auto dim = std::size_t(model.dim);
  if (!weight_.empty() && std::equal(weight_of_.begin(), weight_of_.end(), gravity)) return;
  weight_of_.assign(gravity, gravity + dim);
  weight_.resize(lumped_.size());
  for (std::size_t i = 0; i < lumped_.size(); ++i) a_[i] = gravity[i % dim];
  multiply_mass(a_.data(), weight_.data());
}

// The velocity that a step ended with is that which the next begins with, unless someone set it.
void MeshBody::times_velocity(const double* v) {
  const std::size_t n = lumped_.size();
  if (moving_.size() == n && std::equal(moving_.begin(), moving_.end(), v)) return;
  moving_.assign(v, v + n);
  stiffness_times(v, stiff_.data());
  if (damps_) damping_times(v, damped_.data());
  multiply_mass(v, momentum_.data());
}

void MeshBody::stiffness_times(const double* x, double* out) const {
  model.times_stiffness ? model.times_stiffness(x, out) : multiply(model.stiffness, x, out);
}

void MeshBody::damping_times(const double* x, double* out) const {
  model.times_damping ? model.times_damping(x, out) : multiply(model.damping, x, out);
  if (!model.mode_rates.empty()) damp_modes(x, out);
}

void MeshBody::gather(const Field<double>& field, double* out) const {
  std::copy_n(field[first_node], model.dofs(), out);
}

void MeshBody::scatter(const double* v, Field<double>& field) const { std::copy_n(v, model.dofs(), field[first_node]); }

// Diagonal entry of values on the pattern of A; 0 where the pattern has none.
double MeshBody::on_diagonal(const std::vector<double>& value, std::int64_t row) const {
  for (std::int64_t e = model.mass.start[row]; e < model.mass.start[row + 1]; ++e)
    if (model.mass.row[e] == row) return value[std::size_t(e)];
  return 0;
}

// True if the mass of a dof is below the rounding of the stiffness that A adds to it: such a mass cannot hold a mesh
// without supports.
bool MeshBody::lost_mass(std::int64_t row) const {
  return !model.stiffness.value.empty() &&
         on_diagonal(model.mass.value, row) < 1e-14 * scheme_.stiffness * on_diagonal(model.stiffness.value, row);
}

void MeshBody::refuse(const SoeStatus& status) const {
  std::string where;
  if (status.row >= model.dofs())
    where = " at a rigid part";
  else if (status.row >= 0)
    where =
        " at node " + std::to_string(status.row / model.dim) + ", dof " + std::string(1, "xyz"[status.row % model.dim]);
  if (status.kind == SoeStatus::not_finite)
    throw Error("the matrix of the mesh '" + model.name + "' holds a number that is not finite" + where +
                ": check stiffness, mass and step");
  if (status.kind == SoeStatus::too_large)
    throw Error("the matrix of the mesh '" + model.name + "' is too large for this build of its solver");
  if (status.row >= 0 && status.row < model.dofs() && lost_mass(status.row)) {
    char step[32];
    std::snprintf(step, sizeof step, "%g", scheme_.h);
    throw Error(
        "the mass of the mesh '" + model.name + "' is lost in rounding" + where + ": a step of " + step +
        " s is more than 1e7 times what a wave takes through a cell; give a shorter step, thicker cells, or hold "
        "the mesh");
  }
  throw Error("the matrix of the mesh '" + model.name + "' is not positive definite" + where +
              ": a mass, a stiffness or a held dof is missing");
}

// Factorises A for the step and the coefficients of a scheme; factors of an equal scheme are used again.
void MeshBody::factorise(const cairn_scheme& scheme, bool check) {
  const double mixed = jump_share(scheme);
  const auto known = std::find_if(factors_.begin(), factors_.end(), [&](const auto& f) { // the same step, to the bit
    return f->h == scheme.h && f->damping == scheme.damping && f->stiffness == scheme.stiffness &&
           f->largest == scheme.largest && f->mixed == mixed;
  });
  if (known != factors_.end() && (*known)->spare) { // as if they were new
    (*known)->spare = false;
    std::rotate(known, known + 1, factors_.end());
    return factorise(scheme, check);
  }
  if (known == factors_.end() || !(*known)->made()) {
    auto made = std::make_unique<Factors>();
    made->mixed = mixed;
    make_factors(*made, scheme, check);
    if (known != factors_.end()) {
      made->again = std::move((*known)->again);
      *known = std::move(made);
      now_ = known->get();
    } else {
      if (factors_.size() >= most_factors) factors_.erase(factors_.begin());
      factors_.push_back(std::move(made));
      now_ = factors_.back().get();
    }
  } else {
    now_ = known->get();
  }
  if (!now_->again.ends.empty()) touch_again();
}

void MeshBody::make_factors(Factors& made, const cairn_scheme& scheme, bool check) {
  const bool bare = !(scheme.damping > 0) && !(scheme.stiffness > 0);
  const bool theta_method = scheme.damping == scheme.h * scheme.share && scheme.histories == 0;
  if (model.make_solver && !bare && !theta_method)
    throw Error("the mesh '" + model.name +
                "' has a solver of its own, which knows the theta-method alone: leave the integrator out");
  if (check && std::isfinite(scheme.largest)) check_step(scheme);
  made.h = scheme.h;
  made.largest = scheme.largest;
  made.damping = scheme.damping;
  made.stiffness = scheme.stiffness;
  ++factorisations;
  made.forget(model.nodes());
  if (model.make_solver && !bare) {
    made.solver = model.make_solver(scheme.h, scheme.share);
    return;
  }
  made.value.resize(model.mass.value.size());
  for (std::size_t e = 0; e < made.value.size(); ++e) made.value[e] = model.mass.value[e];
  for (std::size_t e = 0; e < made.value.size() && !bare; ++e)
    made.value[e] =
        model.mass.value[e] + scheme.damping * model.damping.value[e] + scheme.stiffness * model.stiffness.value[e];
  made.soe = make_soe();
  if (const SoeStatus status = factor(*made.soe, made.value.data()); !status) refuse(status);
  if (!model.mode_rates.empty() && scheme.damping > 0) factorise_modes(made);
}

std::unique_ptr<Soe> MeshBody::make_soe() const {
  return model.ties.empty() ? Soe::make(model.mass, model.options) : model.ties.make_soe();
}

SoeStatus MeshBody::factor(Soe& soe, const double* value) {
  return soe.factor(model.ties.empty() ? value : model.ties.reduced(value));
}

void MeshBody::solve(double* b, std::int64_t columns) {
  constexpr std::int64_t together = 8; // that the factors are gone through for at once
  solves += (columns + together - 1) / together;
  if (now_->soe && model.ties.empty()) now_->soe->solve(b, columns);
  for (std::int64_t c = 0; c < columns && now_->soe && !model.ties.empty(); ++c)
    model.ties.solve(*now_->soe, b + c * model.dofs());
  if (!now_->modal_factor.empty()) solve_modes(b, columns);
  if (now_->soe) return;
  for (std::int64_t c = 0; c < columns; ++c) now_->solver(b + c * model.dofs());
}

// The derivatives that an integrator keeps, each with its factor.
void MeshBody::history_sum(Nodes& nodes, const double* factors, double* out) const {
  std::fill_n(out, model.dofs(), 0.0);
  for (int k = 0; k < scheme_.histories; ++k) {
    const double* derivative = nodes.history(k) + model.dim * first_node;
    for (std::int64_t i = 0; i < model.dofs(); ++i) out[i] += factors[k] * derivative[i];
  }
}

void MeshBody::times_history(Nodes& nodes) {
  for (std::vector<double>* v : {&stiff_known_, &damped_known_, &momentum_known_}) v->assign(v->size(), 0.0);
  if (scheme_.histories == 0) return;
  history_sum(nodes, scheme_.elastic, known_.data());
  stiffness_times(known_.data(), stiff_known_.data());
  history_sum(nodes, scheme_.damping_history, known_.data());
  if (damps_) damping_times(known_.data(), damped_known_.data());
  history_sum(nodes, scheme_.velocity, known_.data());
  multiply_mass(known_.data(), momentum_known_.data());
}

// Applies the ties to the stored derivatives of velocity as well: with several of them a part that violates the ties,
// even of rounding, grows from step to step; see cairn_smooth_change.
void MeshBody::follow_leaders(Nodes& nodes) {
  if (model.ties.empty() || model.ties.rigid_parts_turn()) return;
  for (int k = 0; k < cairn_most_history && nodes.history(k); ++k)
    model.ties.follow(nodes.history(k) + model.dim * first_node);
}

void MeshBody::free_velocity(Nodes& nodes, const double* gravity, const cairn_scheme& scheme, bool check) {
  const std::int64_t n = model.dofs();
  scheme_ = scheme;
  for (std::int64_t i = 0; i < n; ++i) q_[i] = nodes.position_begin[first_node][i] - model.reference[i];
  if (linear())
    factorise(scheme, check);
  else
    take_scheme(scheme, check);
  gather(nodes.velocity, v_.data());
  if (!model.ties.empty()) model.ties.follow(v_.data());
  if (scheme.histories > 1) follow_leaders(nodes);
  weigh(gravity);
  if (!linear()) {
    f_ = weight_;
    for (std::int64_t i = 0; i < n && !load_end.empty(); ++i)
      f_[i] += scheme.end_share * load_end[i] + (1 - scheme.end_share) * load_begin[i];
    start_newton(nodes);
    return scatter(free_.data(), nodes.velocity_free);
  }
  stiffness_times(q_.data(), stiff_q_.data());
  for (std::size_t i = 0; i < model.initial_force.size(); ++i) stiff_q_[i] += model.initial_force[i];
  times_velocity(v_.data());
  times_history(nodes);
  stiff_begin_ = stiff_;
  damped_begin_ = damped_;
  momentum_begin_ = momentum_;
  f_ = weight_;
  const double late = scheme.end_share, ahead = scheme.elastic_velocity;
  for (std::int64_t i = 0; i < n && !load_end.empty(); ++i) f_[i] += late * load_end[i] + (1 - late) * load_begin[i];
  for (std::int64_t i = 0; i < n && !thermal_load.empty(); ++i) f_[i] += thermal_load[i];
  start_jumps();
  if (!given_jump_.empty()) forces_of_jumps(given_jump_, known_.data()); // a given velocity is known before the step
  bool moved = false;
  for (std::int64_t i = 0; i < n; ++i) {
    const double damped = damped_begin_[i] + damped_known_[i];
    const double stiff = stiff_q_[i] + ahead * stiff_begin_[i] + stiff_known_[i];
    free_[i] = momentum_known_[i] + scheme.impulse * (f_[i] - damped - stiff);
    if (!model.held[i]) continue;
    free_[i] = (held_velocity.empty() ? 0 : held_velocity[i]) - v_[i];
    moved = moved || free_[i] < 0 || free_[i] > 0;
  }
  if (moved && !now_->soe)
    throw Error("held dofs of the mesh '" + model.name +
                "' change their velocity, which its own solver is not told of");
  solve(free_.data());
  for (std::int64_t i = 0; i < n; ++i) free_[i] += v_[i];
  scatter(free_.data(), nodes.velocity_free);
}

double MeshBody::stored(const Nodes& nodes) {
  gather(nodes.position, a_.data());
  for (std::int64_t i = 0; i < model.dofs(); ++i) a_[i] -= model.reference[i];
  stiffness_times(a_.data(), b_.data());
  double twice = 0;
  for (std::int64_t i = 0; i < model.dofs(); ++i) twice += a_[i] * b_[i];
  for (std::size_t i = 0; i < model.initial_force.size(); ++i) twice += 2 * a_[i] * model.initial_force[i];
  return twice / 2;
}

void MeshBody::push(Nodes& nodes) {
  bool any = false;
  for (std::int64_t i = 0; i < model.dofs(); ++i) {
    a_[i] = model.held[i] ? 0 : impulse[i];
    any = any || a_[i] < 0 || a_[i] > 0;
  }
  if (any) respond(a_.data());
  for (std::int64_t i = 0; i < model.dofs(); ++i) a_[i] += free_[i];
  if (!linear() && model.ties.rigid_parts_turn()) { // the last pass is linear in their spins as well
    iterate_ = a_;
    turn_iterate();
    return scatter(iterate_.data(), nodes.velocity);
  }
  scatter(a_.data(), nodes.velocity);
}

namespace {

// Moves constraint forces of slave dofs to their masters (transpose of the ties).
void to_leaders(const MeshTies& ties, std::vector<double>& force) {
  for (std::size_t t = 0; t < ties.dof.size(); ++t) {
    double& own = force[std::size_t(ties.dof[t])];
    for (auto e = std::size_t(ties.first[t]); e < std::size_t(ties.first[t + 1]); ++e)
      force[std::size_t(ties.master[e])] += ties.weight[e] * own;
    own = 0;
  }
}

} // namespace

// The scene keeps the balance of the nodes as points of mass: what else acts on them is a force on them here, and its
// work is taken apart again.
void MeshBody::account(Nodes& nodes, const double* gravity) {
  if (!linear()) {
    account_bulk(nodes, gravity);
    return account_ties();
  }
  const int dim = model.dim;
  const std::int64_t n = model.dofs();
  const cairn_scheme& s = scheme_;
  const double way_end = s.h * s.share, way_begin = s.h * (1 - s.share), ahead = s.elastic_velocity;
  const double stiff_more = s.stiffness / s.impulse, damped_more = s.damping / s.impulse;
  std::vector<double>&end = a_, &x = b_, &way = known_;
  gather(nodes.velocity, end.data());
  times_velocity(end.data());
  history_sum(nodes, s.position, way.data());
  for (std::int64_t i = 0; i < n; ++i) way[i] += way_end * end[i] + way_begin * v_[i];
  for (std::int64_t i = 0; i < n && s.histories > 0; ++i) way[i] += s.position[0] / s.h * jump_[i];
  if (!given_jump_.empty()) take_jumps(free_.data());
  taken_.resize(end.size());
  work = {};
  for (std::int64_t i = 0; i < n; ++i) {
    const double elastic =
        stiff_q_[i] + ahead * stiff_begin_[i] + stiff_known_[i] + stiff_more * (stiff_[i] - stiff_begin_[i]);
    const double damping = damped_begin_[i] + damped_known_[i] + damped_more * (damped_[i] - damped_begin_[i]);
    work.elastic += way[i] * elastic;
    work.damping += way[i] * damping;
    f_[i] -= elastic + damping;
    taken_[i] = elastic + damping;
  }
  history_sum(nodes, s.velocity, x.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double change = end[i] - v_[i], inertia = momentum_[i] - momentum_begin_[i];
    const double lumped = lumped_[i] * (change - x[i]); // what the points of mass take of the forces
    const double beyond = s.histories > 0 ? borne_[i] : 0;
    reaction[i] = (inertia - momentum_known_[i] - impulse[i]) / s.impulse - beyond - f_[i];
    const double extra = (inertia - momentum_known_[i] - lumped) / s.impulse, weight = lumped_[i] * gravity[i % dim];
    const double mean = 0.5 * (end[i] + v_[i]);
    work.inertia += way[i] * extra;
    work.kinetic_change += mean * (inertia - lumped_[i] * change);
    work.integrator += (way[i] - s.impulse * mean) * extra - mean * (momentum_known_[i] - lumped_[i] * x[i]);
    work.integrator -= s.impulse * mean * beyond;
    if (model.ties.bound(i))
      work.binding += way[i] * reaction[i];
    else if (model.held[i])
      work.driven += way[i] * reaction[i];
    const bool given = model.held[i] || model.ties.bound(i);
    const double force = given ? (lumped - impulse[i]) / s.impulse - beyond - weight : f_[i] - weight - extra;
    nodes.force[first_node][i] = force;
    work.kinetic += 0.5 * end[i] * (momentum_[i] - lumped_[i] * end[i]);
  }
  account_stored(nodes, end, way);
  account_linear_means(way, free_);
  account_ties();
}

// Counts binding work as driven work where a held dof is tied as well, since its support acts through the tie; then
// moves reactions of slave dofs to their masters.
void MeshBody::account_ties() {
  for (std::int64_t i = 0; i < model.dofs(); ++i)
    if (model.held[i] && model.ties.bound(i)) work.driven += std::exchange(work.binding, 0.0);
  to_leaders(model.ties, reaction);
}

// Stored energy at the begin and the end of a step along `way` [J], and work of the integrator's elastic forces K q_e
// beyond those at the midpoint q_m, (q_e - q_m).K way [J]: computed from increments and coefficients of the scheme,
// since a difference of energies would lose digits.
void MeshBody::account_stored(Nodes& nodes, const std::vector<double>& end, const std::vector<double>& way) {
  const std::int64_t n = model.dofs();
  const cairn_scheme& s = scheme_;
  const double way_end = s.h * s.share, way_begin = s.h * (1 - s.share);
  const double of_begin = s.elastic_velocity - 0.5 * s.h, of_change = s.stiffness / s.impulse - 0.5 * way_end;
  const bool keeps = s.histories > 0;
  std::vector<double>&pull = free_, &apart = b_; // K way, q_e - q_m
  double of_history[cairn_most_history];
  for (int k = 0; k < cairn_most_history; ++k) of_history[k] = s.elastic[k] - 0.5 * s.position[k];
  history_sum(nodes, of_history, apart.data());
  const double of_jump = (given_jump_.empty() ? -0.5 : s.end_share - 0.5) * s.position[0] / s.h;
  for (std::int64_t i = 0; i < n && keeps; ++i) apart[i] += of_jump * jump_[i];
  if (keeps) // K of the way is not that of the velocities alone
    stiffness_times(way.data(), pull.data());
  for (std::int64_t i = 0; i < n && !keeps; ++i) pull[i] = way_end * stiff_[i] + way_begin * stiff_begin_[i];
  double begin = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    work.integrator += (apart[i] + of_begin * v_[i] + of_change * (end[i] - v_[i])) * pull[i];
    begin += 0.5 * q_[i] * stiff_q_[i];
    work.stored += 0.5 * (q_[i] + way[i]) * (stiff_q_[i] + pull[i]);
  }
  const std::vector<double>& initial = model.initial_force; // half of whose work is in the products above
  for (std::size_t i = 0; i < initial.size(); ++i) {
    begin += 0.5 * q_[i] * initial[i];
    work.stored += 0.5 * (q_[i] + way[i]) * initial[i];
  }
  work.stored_change = work.stored - begin;
  work.stored += model.initial_energy;
}

void MeshBody::solve_mass(double* b) {
  for (std::int64_t i = 0; i < model.dofs(); ++i)
    if (model.held[i]) b[i] = 0;
  solve_bound_mass(b);
}

// Like solve_mass, except that held dofs bring their given x; rigid parts count where they stand now.
void MeshBody::solve_bound_mass(double* b) {
  if (lumped_mass_ && model.ties.empty()) { // each dof for itself
    for (std::int64_t i = 0; i < model.dofs(); ++i)
      if (!model.held[i]) b[i] /= lumped_[i];
    return;
  }
  if (!mass_ || model.ties.rigid_parts_turn()) {
    if (!mass_) mass_ = make_soe();
    if (const SoeStatus status = factor(*mass_, model.mass.value.data()); !status) refuse(status);
  }
  model.ties.empty() ? mass_->solve(b) : model.ties.solve(*mass_, b);
}

// M a = F - C v - K q, and the derivatives of that under constant loads.
void MeshBody::start_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme) {
  const std::int64_t n = model.dofs();
  weigh(gravity);
  gather(nodes.velocity, v_.data());
  for (std::int64_t i = 0; i < n; ++i) q_[i] = nodes.position[first_node][i] - model.reference[i];
  if (!linear()) return start_bulk_history(nodes, gravity, scheme);
  f_ = weight_;
  for (std::int64_t i = 0; i < n && !load_begin.empty(); ++i) f_[i] += load_begin[i];
  for (std::int64_t i = 0; i < n && !thermal_load.empty(); ++i) f_[i] += thermal_load[i];
  for (std::size_t i = 0; i < model.initial_force.size(); ++i) f_[i] -= model.initial_force[i];
  std::vector<double>&place = q_, &speed = v_, &next = a_, &stiff = b_, &damped = known_;
  for (int k = 0; k < cairn_most_history && nodes.history(k); ++k) {
    stiffness_times(place.data(), stiff.data());
    damping_times(speed.data(), damped.data());
    for (std::int64_t i = 0; i < n; ++i) next[i] = (k == 0 ? f_[i] : 0) - stiff[i] - damped[i];
    solve_mass(next.data());
    std::copy_n(next.begin(), n, nodes.history(k) + model.dim * first_node);
    place.swap(speed);
    speed = next;
  }
}

// Velocity jumps [m/s] by contact impulses and prescribed velocities, through the mass alone. Supports carry these
// impulses over the whole step h, not over the scheme's impulse of a force of 1 N.
void MeshBody::find_jump(const std::vector<double>& end) {
  const std::int64_t n = model.dofs();
  std::copy(impulse.begin(), impulse.end(), jump_.begin());
  for (std::int64_t i = 0; i < n; ++i)
    if (model.held[i]) jump_[i] = end[i] - v_[i];
  borne_.assign(std::size_t(n), 0.0);
  const auto any = [](const auto& of) {
    return std::any_of(of.begin(), of.end(), [](double x) { return x < 0 || x > 0; });
  };
  if (any(jump_)) solve_bound_mass(jump_.data());
  const bool turns = !linear() && model.ties.rigid_parts_turn();
  if (!turns && !any(jump_) && !any(impulse)) return;
  a_ = jump_;
  for (std::int64_t i = 0; i < n && turns; ++i) a_[i] = end[i] - v_[i]; // forces alone are kept, no motion of the mass
  multiply_mass(a_.data(), borne_.data());
  const double beyond = 1 / scheme_.impulse - 1 / scheme_.h;
  for (std::int64_t i = 0; i < n; ++i) {
    const bool given = model.held[i] || (model.ties.bound(i) && !turns);
    borne_[i] = given ? beyond * (borne_[i] - impulse[i]) : 0;
  }
}

void MeshBody::smooth_change(Nodes& nodes, double* change) {
  const std::int64_t n = model.dofs();
  const bool turns = !linear() && model.ties.rigid_parts_turn();
  gather(nodes.velocity, b_.data());
  jump_.resize(std::size_t(n));
  find_jump(b_);
  history_sum(nodes, scheme_.velocity, known_.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double all = b_[i] - v_[i] - known_[i];
    if (model.held[i]) { // an impulse, see cairn_smooth_change
      change[model.dim * first_node + i] = 0;
      continue;
    }
    if (turns) {
      const double load = pressed.empty() ? f_[i] : f_[i] + press_[i];
      change[model.dim * first_node + i] =
          scheme_.impulse * (load - c_[i] - force_of(std::size_t(i))) / force_weight(i);
      continue;
    }
    change[model.dim * first_node + i] = all - jump_[i];
  }
}

std::int64_t MeshBody::bytes() const {
  std::int64_t sum = model.bulk ? model.bulk->bytes() : 0;
  sum += std::int64_t(8 * (lumped_.capacity() * 21 + impulse.capacity()));
  for (const SparseMatrix* a : {&model.mass, &model.stiffness, &model.damping})
    sum += std::int64_t(8 * a->start.capacity() + 4 * a->row.capacity() + 8 * a->value.capacity());
  if (own_) sum += own_->bytes();
  for (const auto& f : factors_) sum += f->bytes();
  return sum;
}

} // namespace cairn
