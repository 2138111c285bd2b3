#include "mesh_factors.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/stopwatch.hpp"

namespace cairn {

// Factorises A for the step and the coefficients of a scheme; factors of an equal scheme are used again.
void MeshFactors::factorise(const cairn_scheme& scheme, bool check) {
  const double mixed = jump_share(scheme);
  const auto known = std::find_if(kept.begin(), kept.end(), [&](const auto& f) { // the same step, to the bit
    return f->h == scheme.h && f->damping == scheme.damping && f->stiffness == scheme.stiffness &&
           f->largest == scheme.largest && f->mixed == mixed;
  });
  if (known != kept.end() && (*known)->undone) { // as if they were new
    (*known)->undone = false;
    std::rotate(known, known + 1, kept.end());
    return factorise(scheme, check);
  }
  if (known == kept.end() || !(*known)->made()) {
    auto made = std::make_unique<IterationFactors>();
    made->mixed = mixed;
    make_factors(*made, scheme, check);
    if (known != kept.end()) {
      made->contact.again = std::move((*known)->contact.again);
      *known = std::move(made);
      now = known->get();
    } else {
      if (kept.size() >= most) kept.erase(kept.begin());
      kept.push_back(std::move(made));
      now = kept.back().get();
    }
  } else {
    now = known->get();
  }
}

void MeshFactors::make_factors(IterationFactors& made, const cairn_scheme& scheme, bool check) {
  const bool bare = !(scheme.damping > 0) && !(scheme.stiffness > 0);
  const bool theta_method = scheme.damping == scheme.h * scheme.share && scheme.histories == 0;
  if (model_.make_solver && !bare && !theta_method)
    throw Error("the mesh '" + model_.name +
                "' has a solver of its own, which knows the theta-method alone: leave the integrator out");
  if (check && std::isfinite(scheme.largest)) stability_.check_step(scheme);
  made.h = scheme.h;
  made.largest = scheme.largest;
  made.damping = scheme.damping;
  made.stiffness = scheme.stiffness;
  ++factorisations;
  made.contact.forget(model_.nodes());
  if (model_.make_solver && !bare) {
    made.solver = model_.make_solver(scheme.h, scheme.share);
    return;
  }
  made.value.resize(model_.mass.value.size());
  for (std::size_t e = 0; e < made.value.size(); ++e) made.value[e] = model_.mass.value[e];
  for (std::size_t e = 0; e < made.value.size() && !bare; ++e)
    made.value[e] =
        model_.mass.value[e] + scheme.damping * model_.damping.value[e] + scheme.stiffness * model_.stiffness.value[e];
  made.soe = equations_.make_soe();
  if (const SoeStatus status = equations_.factor(*made.soe, made.value.data()); !status) equations_.refuse(status);
  if (!model_.mode_rates.empty() && scheme.damping > 0) factorise_modes(made);
}

void MeshFactors::solve(double* b, std::int64_t columns) {
  constexpr std::int64_t together = 8; // that the factors are gone through for at once
  solves += (columns + together - 1) / together;
  if (now->soe && model_.ties.empty()) now->soe->solve(b, columns);
  for (std::int64_t c = 0; c < columns && now->soe && !model_.ties.empty(); ++c)
    model_.ties.solve(*now->soe, b + c * model_.dofs());
  if (!now->modal_factor.empty()) solve_modes(b, columns);
  if (now->soe) return;
  for (std::int64_t c = 0; c < columns; ++c) now->solver(b + c * model_.dofs());
}

double MeshFactors::jump_share(const cairn_scheme& scheme) const {
  if (scheme.histories == 0 || !(scheme.stiffness > 0) || (!model_.linear() && model_.ties.rigid_parts_turn()))
    return 0;
  return -scheme.position[0] / (scheme.h * scheme.h * scheme.share);
}

// Weights of the inverse of M and of the inverse of A in the answer of velocities to impulses.
ImpulseAnswer MeshFactors::answer() const {
  const double share = jump_share(step_.scheme);
  if (!has_part(share)) return {0, 1};
  if (!matrices_.by_rayleigh) return {share, 1 - share};
  const double mass =
      share * step_.scheme.stiffness / (step_.scheme.stiffness + matrices_.rayleigh[1] * step_.scheme.damping);
  return {mass, 1 - mass * (1 + matrices_.rayleigh[0] * step_.scheme.damping)};
}

// Changes of velocities by impulses b, zero at held dofs.
void MeshFactors::respond(double* b, std::int64_t columns) {
  const ImpulseAnswer by = answer();
  if (!has_part(by.mass)) return solve(b, columns);
  const std::int64_t n = model_.dofs();
  responding_.assign(b, b + n * columns);
  for (std::int64_t c = 0; c < columns; ++c) equations_.solve_mass(&responding_[std::size_t(n * c)]);
  solve(b, columns);
  for (std::int64_t i = 0; i < n * columns; ++i) b[i] = by.mass * responding_[std::size_t(i)] + by.rest * b[i];
}

void MeshFactors::factorise_tangent(const std::vector<double>& tangent, bool first) {
  const Stopwatch watch(&seconds_.factorisation);
  if (!tangent_) {
    tangent_ = std::make_unique<IterationFactors>();
    tangent_->soe = equations_.make_soe();
    tangent_->value.resize(model_.mass.value.size());
  }
  now = tangent_.get();
  if (const double share = jump_share(step_.scheme); has_part(share - now->mixed)) {
    now->contact.forget(model_.nodes());
    now->mixed = share;
  }
  const bool fresh = now->contact.place.empty();
  if (fresh || (!by_units(*now) && (first || !model_.ties.empty()))) // bits depend on when nodes were touched
    now->contact.forget(model_.nodes());
  const auto with = [&](const std::vector<double>& stiffness) {
    bool same = now->known && !model_.ties.rigid_parts_turn();
    for (std::size_t e = 0; e < now->value.size(); ++e) {
      const double a = step_.is_explicit() ? model_.mass.value[e] + step_.scheme.damping * model_.damping.value[e]
                                           : model_.mass.value[e] + step_.scheme.damping * model_.damping.value[e] +
                                                 step_.scheme.stiffness * stiffness[e];
      same = same && a == now->value[e];
      now->value[e] = a;
    }
    if (same) return SoeStatus{}; // to the bit, as of Hooke's law at small strains, or an explicit integrator
    ++factorisations;
    now->contact.forget(model_.nodes());
    const SoeStatus found = equations_.factor(*now->soe, now->value.data());
    now->known = bool(found);
    return found;
  };
  SoeStatus status = with(step_.is_explicit() ? model_.stiffness.value : tangent);
  // where the material softens, the stiffness at the start is a direction that goes down
  if (!status && !step_.is_explicit()) status = with(model_.stiffness.value);
  if (status) return;
  try {
    equations_.refuse(status);
  } catch (const Error& error) { throw StepTooLong(error.what()); }
}

bool MeshFactors::by_units(const IterationFactors& f) const {
  return f.soe && model_.ties.empty() && f.modal_factor.empty() && !has_part(f.mixed);
}

std::int64_t MeshFactors::bytes() const {
  std::int64_t sum = tangent_ ? tangent_->bytes() : 0;
  for (const auto& f : kept) sum += f->bytes();
  return sum;
}

std::int64_t IterationFactors::bytes() const {
  return (soe ? soe->bytes() : 0) + contact.reaches.bytes() +
         std::int64_t(8 * (value.capacity() + contact.compliance.capacity()));
}

void ContactNodes::forget(std::int64_t nodes) {
  active.clear();
  order.clear();
  again = {};
  place.assign(std::size_t(nodes), -1);
  leading = 0;
  if (reached) reaches.clear();
}

} // namespace cairn
