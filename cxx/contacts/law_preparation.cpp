#include "law_preparation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "../laws/law_geometry.hpp"
#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"
#include "body_axes.hpp"
#include "singular_blocks.hpp"
#include "surface_motion.hpp"

namespace cairn {

// The velocity along the normal without impulses; where a side is of a mesh, that at the begin of the step.
double LawPreparation::free_opening(const cairn_batch& b, int lane, double begin) const {
  if (b.mapped_a || b.mapped_b) return begin;
  double inverse[36] = {}, rows[36], sum = 0;
  const int n = system_.velocities();
  for (int k = 0; k < n; ++k) inverse[(n + 1) * k] = 1;
  for (int side = 0; side < 2; ++side) {
    rigid_rows(system_, b, lane, side, b.components, inverse, rows);
    const double* velocity = in_.bodies->velocity[(side ? b.body_b : b.body_a)[lane]];
    for (int k = 0; k < n; ++k) sum += rows[b.components * k] * velocity[k];
  }
  return sum;
}

// A bond that is broken, or that never was, bears no stress any more.
bool LawPreparation::wants_area(const cairn_batch& b, int lane) const {
  const LawInfo& law = law_infos()[b.law];
  const bool bonds = law.anchored && !law.plugged() && !law.holds_broken;
  return !bonds || !b.state || b.state[lane] > 0;
}

namespace {

// W with what laws give way by; dummies touch nothing.
void add_compliance(const cairn_batch& b, const double* exact, double* w, double* compliance, double* mu) {
  const int n = b.count, c = b.components;
  for (int lane = 0; lane < n; ++lane) {
    const bool real = lane < b.contacts;
    b.rho[lane] = real ? 1 / (exact[lane] + compliance[lane]) : 1;
    for (int k = 0; k < c; ++k) {
      w[n * (k * c + k) + lane] += compliance[k * n + lane];
      if (!real) w[n * (k * c + k) + lane] = 1;
    }
    if (!real)
      for (int k = 0; k < c; ++k) b.bias[k * n + lane] = compliance[k * n + lane] = 0;
    if (!real) mu[lane] = 0;
  }
}

// True if the law set a column that a pack has no line for: a bias of tangential velocities, a compliance.
bool acts_along_tangents(const cairn_batch& b, const double* compliance) {
  const auto something = [&](const double* column, int columns) {
    bool some = false;
    for (int k = 0; k < columns; ++k)
      for (int lane = 0; lane < b.contacts; ++lane) some |= !(std::abs(column[k * b.count + lane]) <= 0);
    return some;
  };
  return something(b.bias + b.count, b.components - 1) || something(compliance, b.components);
}

} // namespace

void LawPreparation::fill(const cairn_schedule& schedule, cairn_batch& b, int thread) const {
  const int n = b.count, c = b.components, parameters = int(law_infos()[b.law].parameters.size()),
            shape = geometry_columns(law_infos()[b.law]);
  alignas(64) double w[36 * 128], w_true[36 * 128], u[6 * 128], gap[128], params[(LawTable::max_parameters + 7) * 128];
  alignas(64) double compliance[6 * 128], mu[128], geometry[6 * 128], flight[6 * 128], fields[4 * 128];
  const BatchStorage::LawColumns& own = storage_.columns_of(b);
  const bool asks = own.geometry || law_infos()[b.law].plugged();
  cairn_delassus(&schedule, 0, thread, w, w_true, u);
  const bool jumps = has_jumps(in_, &system_.candidate[b.first], b.contacts);
  if (jumps)
    for (int lane = 0; lane < b.contacts; ++lane) add_jump(in_, system_, b, lane, u);
  // the law sees velocities in the middle of the flights before and after
  const bool flying = motion_.fill(b, flight);
  for (int k = 0; flying && k < n * c; ++k) u[k] -= flight[k];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = system_.candidate[b.first + lane];
    gap[lane] = in_.candidates->gap[i];
    const LawTable::Entry& e = classes_.rule(i);
    // an infinite friction times no impulse shall be none
    for (int k = 0; k < parameters; ++k)
      params[k * n + lane] = std::min(e.params[k], std::numeric_limits<double>::max());
    if (in_.temperature) classes_.vary(i, n, params + lane);
    if (in_.has_fields()) in_.fields_of(i, n, fields + lane);
    geometry[lane] = asks && wants_area(b, lane) ? areas_.area_of(i) : 0;
    geometry[n + lane] = curvature_.effective_radius(i);
    geometry[2 * n + lane] = 1 / w[lane];
    if (shape > 3) curvature_.rolling_radii(b, lane, geometry + lane);
  }
  repeat_last(b, gap, 1);
  repeat_last(b, params, parameters);
  repeat_last(b, geometry, shape);
  repeat_last(b, u, c);
  if (in_.has_fields()) repeat_last(b, fields, 4);
  if (law_infos()[b.law].joins) frames_.measure(b);
  const cairn_law_context context{in_.h, in_.theta_of(law_infos()[b.law]), geometry,
                                  in_.has_fields() ? fields : nullptr, 0};
  if (own.fields) std::copy_n(fields, 4 * n, own.fields);
  if (own.geometry) {
    std::copy_n(geometry, shape * n, own.geometry);
    std::copy_n(flight, flying ? n * c : 0, own.flight);
    std::fill_n(own.flight, flying ? 0 : n * c, 0.0);
    std::fill_n(params + parameters * n, n, in_.h);
    std::copy_n(geometry, shape * n, params + (parameters + 1) * n);
  }
  law_infos()[b.law].prepare(n, c, &context, gap, u, params, b.state, b.bias, compliance, mu);
  if (law_infos()[b.law].plugged()) plugged_.check_prepared(b, b.bias, compliance, mu);
  if (law_infos()[b.law].plugged() && in_.options.pose.kernel) plugged_.check_posed(b, gap);
  if (law_infos()[b.law].holds && anchors_.any()) frames_.hold_places(b);
  if ((b.mapped_a || b.mapped_b) && (law_infos()[b.law].joins || law_infos()[b.law].holds))
    for (int k = 0; k < n * c; ++k) b.bias[k] *= in_.options.mesh_correction;
  if (in_.bodies->stretch.active) growth_.add(b, gap, b.bias);
  for (int k = 0; flying && k < n * c; ++k) b.bias[k] += flight[k];
  if (in_.options.pose.kernel) pose_.apply(b, gap, u, compliance);
  add_compliance(b, b.hub ? w_true : w, w, compliance, mu);
  if (b.compliance) std::copy_n(compliance, std::size_t(n) * c, b.compliance);
  const auto opening = [&](int lane) { return b.bias[lane] + free_opening(b, lane, u[lane]); };
  const auto held = [&](int lane) { // inverse mass of both sides as if nothing drove them [1/kg]
    const auto of = [&](bool mesh, std::int32_t which) {
      const double mass = mesh ? system_.condensed[std::size_t(which)].mass : *in_.bodies->mass[which];
      return mass > 0 ? 1 / mass : 0;
    };
    return of(b.mapped_a, b.body_a[lane]) + of(b.mapped_b, b.body_b[lane]);
  };
  // by reference: copies of the functions would allocate
  settle_singular_blocks(b, in_.dim(), w, std::cref(opening), std::cref(held));
  if (b.repeats) repeat_last(b, w, c * c);
  if (b.block)
    std::copy_n(w, std::size_t(n) * c * c, b.delassus);
  else
    for (int lane = 0; lane < n; ++lane) b.delassus[lane] = w[lane], b.delassus[n + lane] = w[n * (c + 1) + lane];
  if (law_infos()[b.law].has_solve && !storage_.has_params_of_pair(b))
    std::copy_n(params, std::size_t(n) * (parameters + 1 + shape), b.params);
  else if (!law_infos()[b.law].has_solve)
    std::copy_n(mu, n, b.params);
  if (jumps)
    for (int lane = 0; lane < b.contacts; ++lane) add_jump(in_, system_, b, lane, b.bias);
  else if (packable(b) && !storage_.given && !acts_along_tangents(b, compliance)) // impulses of a pose need columns
    in_.dim() == 2 ? packs_.pack_columns<2>(b) : packs_.pack_columns<3>(b);
  if (!law_infos()[b.law].has_solve) forget_open(b);
}

// A contact that its law holds open begins without the impulse of the last step: whoever leaves it out would keep that.
void LawPreparation::forget_open(cairn_batch& b) {
  for (int lane = 0; lane < b.contacts; ++lane)
    for (int k = 0; k < b.components && !(at(b, b.bias, lane, 0) < never()); ++k) at(b, b.r, lane, k) = 0;
}

} // namespace cairn
