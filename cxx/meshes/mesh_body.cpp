#include "mesh_body.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../base/call.hpp"
#include "../bodies/nodes.hpp"

namespace cairn {

MeshBody::MeshBody(MeshModel m) : model(std::move(m)) {
  const auto n = std::size_t(model.dofs());
  const int dim = model.dim;
  if (model.bulk) model.bulk->mesh = model.name;
  matrices_.start();
  linear_step_.start();
  for (std::vector<double>* v : {&step_.q, &step_.v, &step_.free, &step_.f, &step_.a, &step_.b, &step_.scratch,
                                 &history_.stiff, &history_.damped, &history_.momentum})
    v->assign(n, 0);
  impulse.assign(n, 0);
  reaction.assign(n, 0);
  find_sizes();
  model.side_from.assign(std::size_t(dim == 2 ? model.nodes() : 0), -1);
  model.side_to = model.side_from;
  for (std::size_t s = 0; dim == 2 && s < model.side_nodes.size() / 4; ++s) {
    model.side_from[std::size_t(model.side_nodes[4 * s])] = std::int32_t(s);
    model.side_to[std::size_t(model.side_nodes[4 * s + 1])] = std::int32_t(s);
  }
  model.options.held = model.held;
  mark_contact_nodes();
  if (!model.ties.empty()) model.ties.start(dim, model.reference, model.mass, model.options);
}

void MeshBody::find_sizes() {
  const auto n = std::size_t(model.dofs());
  const int dim = model.dim;
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
  for (int k = 0; k < dim; ++k) {
    bool given = false;
    for (std::size_t i = k; i < n; i += dim) given = given || model.held[i];
    if (!given && matrices_.mean_mass > 0) inverse_mass_ = dim / (matrices_.mean_mass * double(n));
  }
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

double MeshBody::stable_step(double rate_share, const Nodes& nodes) {
  return stability_.stable_step(rate_share, nodes.position);
}

void MeshBody::free_velocity(Nodes& nodes, const double* gravity, const cairn_scheme& scheme, bool check) {
  const std::int64_t n = model.dofs(), first = step_.first_node;
  step_.scheme = scheme;
  for (std::int64_t i = 0; i < n; ++i) step_.q[i] = nodes.position_begin[first][i] - model.reference[i];
  if (linear()) {
    factors_.factorise(scheme, check);
    compliance_.touch_again();
  } else {
    stresses_.take_scheme(check);
  }
  step_.gather(nodes.velocity, step_.v.data());
  if (!model.ties.empty()) model.ties.follow(step_.v.data());
  if (scheme.histories > 1) history_.follow_leaders(nodes);
  step_.weigh(gravity);
  step_.f = step_.weight;
  for (std::int64_t i = 0; i < n && !loads.end.empty(); ++i)
    step_.f[i] += scheme.end_share * loads.end[i] + (1 - scheme.end_share) * loads.begin[i];
  linear() ? linear_step_.find_free_velocity(nodes) : newton_.start(nodes, size_);
  step_.scatter(step_.free.data(), nodes.velocity_free);
}

void MeshBody::account(Nodes& nodes, const double* gravity) {
  linear() ? linear_step_.account(nodes, gravity) : newton_.account(nodes, gravity);
  works_.account_ties();
}

void MeshBody::start_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme) {
  step_.weigh(gravity);
  step_.gather(nodes.velocity, step_.v.data());
  for (std::int64_t i = 0; i < model.dofs(); ++i) step_.q[i] = nodes.position[step_.first_node][i] - model.reference[i];
  linear() ? linear_step_.start_history(nodes) : newton_.start_history(nodes, scheme);
}

void MeshBody::push(Nodes& nodes) {
  bool any = false;
  for (std::int64_t i = 0; i < model.dofs(); ++i) {
    step_.a[i] = model.held[i] ? 0 : impulse[i];
    any = any || step_.a[i] < 0 || step_.a[i] > 0;
  }
  if (any) factors_.respond(step_.a.data());
  for (std::int64_t i = 0; i < model.dofs(); ++i) step_.a[i] += step_.free[i];
  if (!linear() && model.ties.rigid_parts_turn()) { // the last pass is linear in their spins as well
    step_.iterate = step_.a;
    newton_.turn_iterate();
    return step_.scatter(step_.iterate.data(), nodes.velocity);
  }
  step_.scatter(step_.a.data(), nodes.velocity);
}

void MeshBody::answer(const double* force, std::int64_t n, double* change) {
  std::vector<double>& all = step_.a;
  std::fill(all.begin(), all.end(), 0.0);
  bool any = false;
  for (std::int64_t i = 0; i < n; ++i) {
    all[i] = model.held[i] ? 0 : force[i];
    any = any || all[i] < 0 || all[i] > 0;
  }
  if (any) factors_.respond(all.data());
  std::copy_n(all.begin(), n, change);
}

void MeshBody::add_load(const double* force, std::int64_t n, Nodes& nodes) {
  std::vector<double>& change = step_.a;
  std::fill(change.begin(), change.end(), 0.0);
  for (std::int64_t i = 0; i < n; ++i) {
    step_.f[i] += force[i];
    change[i] = model.held[i] ? 0 : step_.scheme.impulse * force[i];
  }
  factors_.respond(change.data());
  for (std::int64_t i = 0; i < model.dofs(); ++i) step_.free[i] += change[i];
  step_.scatter(step_.free.data(), nodes.velocity_free);
}

void MeshBody::smooth_change(Nodes& nodes, double* change) {
  const std::int64_t n = model.dofs();
  const bool turns = !linear() && model.ties.rigid_parts_turn();
  step_.gather(nodes.velocity, step_.b.data());
  jumps_.all.resize(std::size_t(n));
  jumps_.find(step_.b);
  history_.sum(nodes, step_.scheme.velocity, step_.scratch.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double all = step_.b[i] - step_.v[i] - step_.scratch[i];
    if (model.held[i]) { // an impulse, see cairn_smooth_change
      change[model.dim * step_.first_node + i] = 0;
      continue;
    }
    if (turns) {
      change[model.dim * step_.first_node + i] = newton_.smooth_change(i);
      continue;
    }
    change[model.dim * step_.first_node + i] = all - jumps_.all[i];
  }
}

std::int64_t MeshBody::bytes() const {
  std::int64_t sum = model.bulk ? model.bulk->bytes() : 0;
  sum += std::int64_t(8 * (matrices_.lumped.capacity() * 21 + impulse.capacity()));
  for (const SparseMatrix* a : {&model.mass, &model.stiffness, &model.damping})
    sum += std::int64_t(8 * a->start.capacity() + 4 * a->row.capacity() + 8 * a->value.capacity());
  return sum + factors_.bytes();
}

void MeshBody::commit() {
  if (!linear()) newton_.commit();
}

void MeshBody::roll_back() {
  if (!linear()) model.bulk->rollback();
}

void MeshBody::keep(Results& to) const {
  to.impulse = impulse;
  to.reaction = reaction;
  if (linear()) return;
  const std::span<const double> stress = model.bulk->shown();
  to.stress.assign(stress.begin(), stress.end());
}

void MeshBody::put_back(const Results& from) {
  impulse = from.impulse;
  reaction = from.reaction;
  if (!linear()) std::copy(from.stress.begin(), from.stress.end(), model.bulk->shown().begin());
}

} // namespace cairn
