// The numbers of batches: frames, levers, blocks, biases, and the impulses that the last step left.
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "../laws/law_geometry.hpp"
#include "../laws/law_names.hpp"
#include "../solvers/sweeps/contact_rows.hpp"
#include "body_axes.hpp"
#include "interaction_state.hpp"
#include "singular_blocks.hpp"

namespace cairn {

namespace {

cairn_law_solve* solver_of(const cairn_batch& b, int dim) {
  if (law_infos()[b.law].solve) return law_infos()[b.law].solve;
  if (b.block) return dim == 2 ? cairn_cone_full2 : cairn_cone_full3;
  return dim == 2 ? cairn_cone_isotropic2 : cairn_cone_isotropic3;
}

// flight_of_round for a batch, in eights like the normals of its pack; 0 for lanes without motion. Its roots and
// quotients take a fifth of the time in vectors.
template <int d>
void flights_of_round(int n, const double* pack, int lines, const double (&speed)[d][128], const double* apart,
                      double h, double* flight) {
  for (int first = 0; first < n; first += 8) {
    const double* normal = pack + first / 8 * lines;
#pragma omp simd
    for (int i = 0; i < 8; ++i) {
      const int lane = first + i;
      const double reach = h / apart[lane];
      double along = 0, square = 0;
      for (int k = 0; k < d; ++k) along += speed[k][lane] * normal[8 * k + i];
      for (int k = 0; k < d; ++k) {
        const double across = (speed[k][lane] - along * normal[8 * k + i]) * reach;
        square += across * across;
      }
      const double bounded = square < 1 ? square : 1, way = bounded / (reach * (1 + std::sqrt(1 - bounded)));
      flight[lane] = square > 0 && apart[lane] > 0 ? way : 0;
    }
  }
}

} // namespace

void axes_of(const cairn_batch& b, int dim, int lane, double axes[3][3]) {
  for (int k = 0; k < dim; ++k) axes[0][k] = at(b, b.frame, lane, k);
  if (dim == 2) {
    axes[1][0] = -axes[0][1];
    axes[1][1] = axes[0][0];
    return;
  }
  if (b.pack)
    tangent_of(axes[0], axes[1]);
  else
    for (int k = 0; k < 3; ++k) axes[1][k] = at(b, b.frame, lane, 3 + k);
  for (int k = 0; k < 3; ++k)
    axes[2][k] = axes[0][(k + 1) % 3] * axes[1][(k + 2) % 3] - axes[0][(k + 2) % 3] * axes[1][(k + 1) % 3];
}

void Interactions::State::fill() {
  const int n = int(system.batches.size()), threads = system.schedule(omp_get_max_threads()).threads;
  double deepest = 0;
  fault = {};
#pragma omp parallel for num_threads(threads) schedule(static) reduction(max : deepest) if (threads > 1)
  for (int b = 0; b < n; ++b) fill_batch(b, omp_get_thread_num(), deepest);
  system.penetration = deepest;
  system.clumps = all_balls();
  system.drift = deepest > overlap_limit ? deepest_drift() : 0;
  if (fault.batch >= 0) refuse_fault();
}

void Interactions::State::fill_batch(int which, int thread, double& deepest) {
  cairn_batch& batch = system.batches[which];
  batch.solve = solver_of(batch, dim());
  // of a bond, a dummy would pull: it would count in how much a sweep changes, and in the size of the impulses
  batch.repeats = law_infos()[batch.law].has_solve && batch.contacts < batch.count;
  if (batch.pack) {
    dim() == 2 ? fill_packed<2>(batch, deepest) : fill_packed<3>(batch, deepest);
    if (law_infos()[batch.law].plugged()) forget_open(batch);
    return;
  }
  cairn_schedule schedule{};
  schedule.batches = 1;
  schedule.threads = thread + 1;
  schedule.first_task = system.first_task.data();
  schedule.first_batch = system.first_batch.data();
  schedule.batch = &batch;
  schedule.side = sides();
  schedule.record = system.record.data();
  schedule.general = system.general.empty() ? system.record.data() : system.general.data();
  schedule.work = system.work.data();
  fill_geometry(batch, deepest);
  fill_ropes(batch);
  if (batch.stride_a || batch.stride_b) cairn_mapped_responses(&batch, dim());
  fill_impulses(batch);
  if (law_infos()[batch.law].joins) fill_drags(batch);
  fill_law(schedule, batch, thread);
}

// Keeps columns for `commit` of a packed batch: flights along the normal (null: none), geometry, fields.
void Interactions::State::keep_for_commit(cairn_batch& b, const double* flight, int d) {
  const LawColumns& own = of_law[std::size_t(&b - system.batches.data())];
  if (!own.flight) return;
  const int n = b.count;
  const std::int32_t* who = &system.candidate[b.first];
  std::fill_n(own.flight, n * d, 0.0);
  std::copy_n(flight, flight ? n : 0, own.flight);
  for (int lane = 0; lane < b.contacts; ++lane) {
    own.geometry[lane] = area_of(who[lane]);
    own.geometry[n + lane] = effective_radius(who[lane]);
    own.geometry[2 * n + lane] = b.rho[lane];
    if (own.fields) fields_of(who[lane], n, own.fields + lane);
  }
  if (own.fields) repeat_last(b, own.fields, 4);
  repeat_last(b, own.flight, d);
  repeat_last(b, own.geometry, 3);
}

// Two round bodies that move, a bias along the normal: everything at once.
template <int d>
void Interactions::State::fill_packed(cairn_batch& b, double& deepest) {
  const Candidates& c = *candidates;
  const LawInfo& law = law_infos()[b.law];
  const int n = b.count, lines = 8 * b.pack, parameters = int(law.parameters.size());
  alignas(64) double gap[128], params[LawTable::max_parameters * 128], bias[3 * 128], compliance[3 * 128], mu[128];
  alignas(64) double flight[128], speed[d][128], apart[128], mass[128], smaller[128];
  std::fill_n(mass, n, 1.0);
  const bool flying = flies_as_round(), one_rule = laws->entries() == 1 && !temperature;
  const auto& radius = contactors->radius.values;
  const auto& record = system.record;
  if (one_rule)
    for (int k = 0; k < parameters; ++k) std::fill_n(params + k * n, n, laws->entry(0).params[k]);
  const std::int32_t* who = &system.candidate[b.first];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = who[lane];
    if (lane + 24 < b.contacts) { // contacts, then their bodies, lie far apart
      const std::int64_t far = who[lane + 24], near = who[lane + 12];
      __builtin_prefetch(&c.contactor_a[far]);
      __builtin_prefetch(&c.contactor_b[far]);
      __builtin_prefetch(&c.gap[far]);
      __builtin_prefetch(&c.normal[d * far]);
      __builtin_prefetch(&record[std::size_t(body(c.contactor_a[near]))]);
      __builtin_prefetch(&record[std::size_t(body(c.contactor_b[near]))]);
    }
    const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i], A = body(ca), B = body(cb);
    double* to = b.frame + lane / 8 * lines + lane % 8;
    const double *normal = &c.normal[std::size_t(d * i)], now = c.gap[std::size_t(i)];
    const double ra = radius[std::size_t(ca)], rb = radius[std::size_t(cb)];
    const cairn_record &of_a = record[std::size_t(A)], &of_b = record[std::size_t(B)];
    for (int k = 0; k < d; ++k) to[8 * k] = normal[k];
    to[8 * d] = -(ra + gap_share * now);
    to[8 * d + 8] = rb + gap_share * now;
    gap[lane] = now;
    smaller[lane] = std::min(ra, rb);
    b.body_a[lane] = A;
    b.body_b[lane] = B;
    mass[lane] = of_a.x[d == 2 ? 3 : 6] + of_b.x[d == 2 ? 3 : 6];
    for (int k = 0; k < d; ++k) speed[k][lane] = of_a.x[k] - of_b.x[k];
    apart[lane] = ra + rb + std::min(now, 0.0);
    if (one_rule) continue;
    const double* given = laws->entry(entry[i]).params;
    for (int k = 0; k < parameters; ++k) params[k * n + lane] = given[k];
    if (temperature) vary(i, n, params + lane);
  }
  for (int lane = b.contacts; lane < n; ++lane) {
    double* to = b.frame + lane / 8 * lines + lane % 8;
    for (int k = 0; k < d + 2; ++k) to[8 * k] = 0;
    for (int k = 0; k < d; ++k) speed[k][lane] = 0;
    apart[lane] = smaller[lane] = 1;
    gap[lane] = 0;
    b.body_a[lane] = b.body_b[lane] = std::int32_t(system.bodies);
  }
  double deep = deepest;
#pragma omp simd reduction(max : deep)
  for (int lane = 0; lane < n; ++lane) {
    b.rho[lane] = 1 / mass[lane];
    const double overlap = gap[lane] < 0 ? -gap[lane] / smaller[lane] : 0;
    deep = overlap > deep ? overlap : deep;
  }
  deepest = deep;
  if (flying) flights_of_round<d>(n, b.frame, lines, speed, apart, h, flight);
  repeat_last(b, gap, 1);
  if (!one_rule) repeat_last(b, params, parameters);
  keep_for_commit(b, flying ? flight : nullptr, d);
  const cairn_law_context context{h, theta, nullptr, nullptr};
  law.prepare(n, d, &context, gap, nullptr, params, nullptr, bias, compliance, mu);
  std::fill(bias + b.contacts, bias + n, 0.0);
  std::fill(mu + b.contacts, mu + n, 0.0);
  if (law.plugged()) check_prepared(b, bias, compliance, mu);
  if (bodies->stretch.active) add_growth(b, gap, bias);
  for (int lane = 0; flying && lane < b.contacts; ++lane) bias[lane] += flight[lane];
  inherit_packed<d>(b);
  for (int first = 0; first < n; first += 8) {
    double* to = b.frame + first / 8 * lines + 8 * (d + 2);
    std::copy_n(bias + first, 8, to);
    std::copy_n(mu + first, 8, to + 8);
  }
}

// Impulses of the last step, from space axes to those of the contacts.
template <int d>
void Interactions::State::inherit_packed(cairn_batch& b) const {
  const double scale = memory.h > 0 ? h / memory.h : 1;
  const int n = b.count, lines = 8 * b.pack, kept = memory.impulse_components;
  const std::int32_t* found = place + b.first;
  for (int first = 0; first < n; first += 8) {
    double *pack = b.frame + first / 8 * lines, *r = pack + 8 * (d + 4), p[d][8] = {};
    for (int i = 0; i < 8; ++i) {
      const std::int32_t where = first + i < b.contacts ? found[first + i] : -1;
      if (where < 0) continue;
      const double* from = &memory.impulses[std::size_t(where) * kept];
      for (int k = 0; k < d; ++k) p[k][i] = scale * from[k];
    }
    for (int i = 0; i < 8; ++i) {
      if constexpr (d == 2) {
        r[i] = p[0][i];
        r[8 + i] = p[1][i];
      } else {
        const double normal[3] = {pack[i], pack[8 + i], pack[16 + i]};
        double t[3], sum[3] = {0, 0, 0};
        tangent_of(normal, t);
        for (int k = 0; k < 3; ++k) {
          const int l = (k + 1) % 3, m = (k + 2) % 3;
          sum[0] += normal[k] * p[k][i];
          sum[1] += t[k] * p[k][i];
          sum[2] += (normal[l] * t[m] - normal[m] * t[l]) * p[k][i];
        }
        for (int k = 0; k < 3; ++k) r[8 * k + i] = sum[k];
      }
    }
  }
}

void Interactions::State::fill_geometry(cairn_batch& b, double& deepest) {
  const Candidates& c = *candidates;
  const int n = b.count, d = dim();
  const bool image = cell->any(), hulls = d == 2 && contactors->hull.active;
  const auto polygon = [&](std::int32_t contactor) { return hulls && *contactors->hull[contactor] >= 0; };
  // LMGC90's impulses between a rigid body and a mesh act on the surface of the mesh for both.
  const double share = b.mapped_a || b.mapped_b ? 1 - gap_share : gap_share;
  const auto lever = [&](double* out, bool radial, std::int64_t i, std::int32_t contactor, double side, int lane) {
    if (radial) {
      out[lane] = side * (*contactors->radius[contactor] + share * c.gap[i]);
      return;
    }
    double shift[3] = {0, 0, 0};
    if (image && side > 0) image_shift(*cell, c.image[i], shift);
    const double *x = bodies->position[body(contactor)], *p = &c.point[d * i];
    const double* normal = &c.normal[d * i];
    // LMGC90's impulses on surfaces: between two polygons it has them in the middle
    const double beyond = polygon(c.contactor_a[i]) && polygon(c.contactor_b[i]) ? 0 : side * (0.5 - share) * c.gap[i];
    for (int k = 0; k < d; ++k) out[k * n + lane] = p[k] - (x[k] + shift[k]) - beyond * normal[k];
  };
  const bool radial_a = is_radial(b.side_a), radial_b = is_radial(b.side_b);
  const std::int32_t* who = &system.candidate[b.first];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = who[lane];
    const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
    b.body_a[lane] = body(ca);
    b.body_b[lane] = body(cb);
    const double* normal = &c.normal[d * i];
    for (int k = 0; k < d; ++k) b.frame[k * n + lane] = normal[k];
    if (d == 3) {
      double t[3];
      tangent_of(normal, t);
      for (int k = 0; k < 3; ++k) b.frame[(3 + k) * n + lane] = t[k];
    }
    b.mapped_a ? fill_mapping(b, 0, lane, i) : lever(b.lever_a, radial_a, i, ca, -1, lane);
    b.mapped_b ? fill_mapping(b, 1, lane, i) : lever(b.lever_b, radial_b, i, cb, 1, lane);
    if (c.gap[i] < 0 && !law_infos()[b.law].joins) {
      const double ra = contactors->size(ca), rb = contactors->size(cb);
      const double size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
      if (size > 0) deepest = std::max(deepest, -c.gap[i] / size);
    }
  }
  // dummies rest on the spare record and touch nothing
  const auto pad = [&](double* column, int columns, double value) {
    for (int k = 0; k < columns; ++k) std::fill(column + k * n + b.contacts, column + (k + 1) * n, value);
  };
  pad(b.frame, d == 2 ? 2 : 6, 0);
  pad(b.lever_a, sides()[b.side_a].lever, 0);
  pad(b.lever_b, sides()[b.side_b].lever, 0);
  const auto spare = std::int32_t(system.bodies);
  std::fill(b.body_a + b.contacts, b.body_a + n, b.mapped_a ? 0 : spare);
  std::fill(b.body_b + b.contacts, b.body_b + n, b.mapped_b ? 0 : spare);
}

// Nodes of a condensed body that a contact moves with, and their weights where other sides have a lever.
void Interactions::State::fill_mapping(cairn_batch& b, int side, int lane, std::int64_t i) {
  const Candidates& c = *candidates;
  double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0};
  if (cell->any() && side) image_shift(*cell, c.image[i], shift);
  const int d = dim() == 2 ? 2 : 3;
  for (int k = 0; k < d; ++k) point[k] = c.point[d * i + k] - shift[k];
  const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
  const Mapping m = meshes->mapping(*nodes, side ? two : one, point, side ? one : two);
  const CondensedBody& body = system.condensed[m.mesh];
  const cairn_condensed& of = system.condensed_dofs[m.mesh];
  const auto first = std::int32_t(of.velocity - system.condensed_velocity.data());
  std::int32_t *const node = side ? b.node_b : b.node_a, *const dof = side ? b.dof_b : b.dof_a;
  std::int32_t& nodes = side ? b.nodes_b : b.nodes_a;
  (side ? b.body_b : b.body_a)[lane] = m.mesh;
  const auto row = [&](std::int32_t n) {
    return body.row.empty() ? meshes->meshes[m.mesh].place(n) : body.row[std::size_t(n)];
  };
  for (int j = 0; j < 4; ++j) {
    const bool rests = m.mean >= 0 ? j == 0 : m.node[j] >= 0; // a mean is one row
    const std::int32_t place = !rests ? 0 : m.mean >= 0 ? meshes->row_of_mean(m.mean) : row(m.node[j]);
    node[j * b.count + lane] = place;
    dof[j * b.count + lane] = first + dim() * place;
    (side ? b.lever_b : b.lever_a)[j * b.count + lane] = !rests ? 0 : m.mean >= 0 ? 1 : m.weight[j];
    if (rests) nodes = std::max(nodes, j + 1);
  }
  dof[4 * b.count + lane] = first;
  dof[5 * b.count + lane] = std::int32_t(condensed_rows(of.dofs));
  if (b.turns) fill_spin(b, side, lane, i, m);
}

void Interactions::State::fill_impulses(cairn_batch& b) {
  const int n = b.count, d = dim(), kept = memory.impulse_components, rotations = b.components - d;
  std::fill(b.r, b.r + std::size_t(n) * b.components, 0.0);
  const double scale = memory.h > 0 ? h / memory.h : 1;
  if (b.state) fill_states(b);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int32_t where = place[b.first + lane];
    if (where < 0) continue;
    const double* p = &memory.impulses[std::size_t(where) * kept];
    if (d == 2) {
      for (int c = 0; c < std::min(kept, b.components); ++c) b.r[c * n + lane] = scale * p[c];
      continue;
    }
    double axes[3][3];
    for (int c = 0; c < 3; ++c) {
      axes[0][c] = b.frame[c * n + lane];
      axes[1][c] = b.frame[(3 + c) * n + lane];
    }
    for (int c = 0; c < 3; ++c)
      axes[2][c] = axes[0][(c + 1) % 3] * axes[1][(c + 2) % 3] - axes[0][(c + 2) % 3] * axes[1][(c + 1) % 3];
    for (int c = 0; c < 3; ++c) {
      b.r[c * n + lane] = scale * (axes[c][0] * p[0] + axes[c][1] * p[1] + axes[c][2] * p[2]);
      if (rotations && kept == 6)
        b.r[(3 + c) * n + lane] = scale * (axes[c][0] * p[3] + axes[c][1] * p[4] + axes[c][2] * p[5]);
    }
  }
}

// States from the last step, or the initial values of the law. Contacts without a state have huge values in the memory.
// Vectors in the tangent plane keep their length where the plane turns.
void Interactions::State::fill_states(const cairn_batch& b) const {
  const LawInfo& law = law_infos()[b.law];
  const int n = b.count, columns = law.state_columns(dim());
  constexpr double huge = std::numeric_limits<double>::max();
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int32_t where = place[b.first + lane];
    const double* found = where < 0 ? nullptr : &memory.states[std::size_t(where) * memory.state_components];
    int from = 0, to = 0;
    const auto known = [&](int numbers) {
      return found && from + numbers <= memory.state_components && !(std::abs(found[from]) >= huge);
    };
    for (std::size_t s = 0; s < law.state.size(); ++s) {
      if (law.state[s].back() != '*' || dim() == 2) {
        double value = law.state_begin[s];
        if (known(1))
          value = found[from];
        else if (s == 0 && law.keeps && came_in_touching(system.candidate[b.first + lane]))
          value = 1;
        b.state[to++ * n + lane] = value;
        ++from;
        continue;
      }
      double t[2] = {law.state_begin[s], law.state_begin[s]};
      if (known(3)) {
        double x[3];
        std::copy_n(found + from, 3, x);
        lay_into_plane(b, lane, where, x, t);
      }
      b.state[to++ * n + lane] = t[0];
      b.state[to++ * n + lane] = t[1];
      from += 3;
    }
  }
  repeat_last(b, b.state, columns);
}

// u += factor * relative velocity that the image of B lends to its contact
void Interactions::State::add_image_jump(const cairn_batch& b, int lane, double factor, double* u) const {
  double v[3];
  image_velocity(*cell, candidates->image[system.candidate[b.first + lane]], v);
  const int n = b.count;
  const double* f = b.frame + lane;
  if (dim() == 2) {
    u[lane] -= factor * (f[0] * v[0] + f[n] * v[1]);
    u[n + lane] -= factor * (f[0] * v[1] - f[n] * v[0]);
    return;
  }
  const double nx = f[0], ny = f[n], nz = f[2 * n], tx = f[3 * n], ty = f[4 * n], tz = f[5 * n];
  u[lane] -= factor * (nx * v[0] + ny * v[1] + nz * v[2]);
  u[n + lane] -= factor * (tx * v[0] + ty * v[1] + tz * v[2]);
  u[2 * n + lane] -= factor * ((ny * tz - nz * ty) * v[0] + (nz * tx - nx * tz) * v[1] + (nx * ty - ny * tx) * v[2]);
}

// The velocity along the normal without impulses; where a side is of a mesh, that at the begin of the step.
double Interactions::State::free_opening(const cairn_batch& b, int lane, double begin) const {
  if (b.mapped_a || b.mapped_b) return begin;
  double inverse[36] = {}, rows[36], sum = 0;
  const int n = system.velocities();
  for (int k = 0; k < n; ++k) inverse[(n + 1) * k] = 1;
  for (int side = 0; side < 2; ++side) {
    rigid_rows(system, b, lane, side, b.components, inverse, rows);
    const double* velocity = bodies->velocity[(side ? b.body_b : b.body_a)[lane]];
    for (int k = 0; k < n; ++k) sum += rows[b.components * k] * velocity[k];
  }
  return sum;
}

// A bond that is broken, or that never was, bears no stress any more.
bool Interactions::State::wants_area(const cairn_batch& b, int lane) const {
  const LawInfo& law = law_infos()[b.law];
  const bool bonds = law.anchored && !law.plugged() && Law(b.law) != Law::plastic_expo; // which has springs besides
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

} // namespace

void Interactions::State::fill_law(const cairn_schedule& schedule, cairn_batch& b, int thread) {
  const int n = b.count, c = b.components, parameters = int(law_infos()[b.law].parameters.size()),
            shape = geometry_columns(law_infos()[b.law]);
  alignas(64) double w[36 * 128], w_true[36 * 128], u[6 * 128], gap[128], params[(LawTable::max_parameters + 7) * 128];
  alignas(64) double compliance[6 * 128], mu[128], geometry[6 * 128], flight[6 * 128], fields[4 * 128];
  LawColumns& own = of_law[std::size_t(&b - system.batches.data())];
  const bool asks = own.geometry || law_infos()[b.law].plugged();
  cairn_delassus(&schedule, 0, thread, w, w_true, u);
  if (sheared)
    for (int lane = 0; lane < b.contacts; ++lane) add_image_jump(b, lane, 1, u);
  // the law sees velocities in the middle of the flights before and after
  const bool flying = fill_flight(b, flight);
  for (int k = 0; flying && k < n * c; ++k) u[k] -= flight[k];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = system.candidate[b.first + lane];
    gap[lane] = candidates->gap[i];
    const LawTable::Entry& e = laws->entry(entry[i]);
    // an infinite friction times no impulse shall be none
    for (int k = 0; k < parameters; ++k)
      params[k * n + lane] = std::min(e.params[k], std::numeric_limits<double>::max());
    if (temperature) vary(i, n, params + lane);
    if (has_fields()) fields_of(i, n, fields + lane);
    geometry[lane] = asks && wants_area(b, lane) ? area_of(i) : 0;
    geometry[n + lane] = effective_radius(i);
    geometry[2 * n + lane] = 1 / w[lane];
    if (shape > 3) rolling_radii(b, lane, geometry + lane);
  }
  repeat_last(b, gap, 1);
  repeat_last(b, params, parameters);
  repeat_last(b, geometry, shape);
  repeat_last(b, u, c);
  if (has_fields()) repeat_last(b, fields, 4);
  if (law_infos()[b.law].joins) measure_joints(b);
  const cairn_law_context context{h, theta_of(law_infos()[b.law]), geometry, has_fields() ? fields : nullptr};
  if (own.fields) std::copy_n(fields, 4 * n, own.fields);
  if (own.geometry) {
    std::copy_n(geometry, shape * n, own.geometry);
    std::copy_n(flight, flying ? n * c : 0, own.flight);
    std::fill_n(own.flight, flying ? 0 : n * c, 0.0);
    std::fill_n(params + parameters * n, n, h);
    std::copy_n(geometry, shape * n, params + (parameters + 1) * n);
  }
  law_infos()[b.law].prepare(n, c, &context, gap, u, params, b.state, b.bias, compliance, mu);
  if (law_infos()[b.law].plugged()) check_prepared(b, b.bias, compliance, mu);
  if (law_infos()[b.law].plugged() && pose.kernel) check_posed(b, gap);
  if (law_infos()[b.law].holds && !anchor_of.empty()) hold_places(b);
  if ((b.mapped_a || b.mapped_b) && (law_infos()[b.law].joins || law_infos()[b.law].holds))
    for (int k = 0; k < n * c; ++k) b.bias[k] *= correction;
  if (bodies->stretch.active) add_growth(b, gap, b.bias);
  for (int k = 0; flying && k < n * c; ++k) b.bias[k] += flight[k];
  if (pose.kernel) apply_pose(b, gap, u, compliance);
  add_compliance(b, b.hub ? w_true : w, w, compliance, mu);
  if (b.compliance) std::copy_n(compliance, std::size_t(n) * c, b.compliance);
  const auto opening = [&](int lane) { return b.bias[lane] + free_opening(b, lane, u[lane]); };
  const auto held = [&](int lane) { // inverse mass of both sides as if nothing drove them [1/kg]
    const auto of = [&](bool mesh, std::int32_t which) {
      const double mass = mesh ? system.condensed[std::size_t(which)].mass : *bodies->mass[which];
      return mass > 0 ? 1 / mass : 0;
    };
    return of(b.mapped_a, b.body_a[lane]) + of(b.mapped_b, b.body_b[lane]);
  };
  // by reference: copies of the functions would allocate
  settle_singular_blocks(b, dim(), w, std::cref(opening), std::cref(held));
  if (b.repeats) repeat_last(b, w, c * c);
  if (b.block)
    std::copy_n(w, std::size_t(n) * c * c, b.delassus);
  else
    for (int lane = 0; lane < n; ++lane) b.delassus[lane] = w[lane], b.delassus[n + lane] = w[n * (c + 1) + lane];
  if (law_infos()[b.law].has_solve && !has_params_of_pair(b))
    std::copy_n(params, std::size_t(n) * (parameters + 1 + shape), b.params);
  else if (!law_infos()[b.law].has_solve)
    std::copy_n(mu, n, b.params);
  if (sheared)
    for (int lane = 0; lane < b.contacts; ++lane) add_image_jump(b, lane, 1, b.bias);
  else if (packable(b) && !given && !acts_along_tangents(b, compliance)) // impulses of a pose need columns
    dim() == 2 ? pack_columns<2>(b) : pack_columns<3>(b);
  if (!law_infos()[b.law].has_solve) forget_open(b);
}

// A contact that its law holds open begins without the impulse of the last step: whoever leaves it out would keep that.
void Interactions::State::forget_open(cairn_batch& b) {
  for (int lane = 0; lane < b.contacts; ++lane)
    for (int k = 0; k < b.components && !(at(b, b.bias, lane, 0) < never()); ++k) at(b, b.r, lane, k) = 0;
}

// Applies the pose of the strategy in place of the prepared law, with the contact forces at the end of the last step.
void Interactions::State::apply_pose(const cairn_batch& b, const double* gap, const double* u, double* compliance) {
  const int n = b.count, d = dim();
  alignas(64) double force[6 * 128], impulses[6 * 128];
  std::fill_n(force, std::size_t(n) * b.components, 0.0);
  for (int lane = 0; lane < b.contacts && !memory.forces.empty(); ++lane) {
    const std::int32_t where = place[b.first + lane];
    if (where < 0) continue;
    const double* f = &memory.forces[std::size_t(where) * d];
    double axes[3][3];
    axes_of(b, d, lane, axes);
    for (int k = 0; k < d; ++k) {
      double along = d == 2 ? f[k] : 0;
      for (int l = 0; l < d && d == 3; ++l) along += axes[k][l] * f[l];
      force[k * n + lane] = along;
    }
  }
  pose.kernel(n, b.components, h, theta, pose.params, gap, u, force, b.bias, compliance, impulses);
  std::copy_n(impulses, std::size_t(n) * d, given + std::size_t(d) * b.first);
}

// True if the law set a column that a pack has no line for: a bias of tangential velocities, a compliance.
bool Interactions::State::acts_along_tangents(const cairn_batch& b, const double* compliance) {
  const auto something = [&](const double* column, int columns) {
    bool some = false;
    for (int k = 0; k < columns; ++k)
      for (int lane = 0; lane < b.contacts; ++lane) some |= !(std::abs(column[k * b.count + lane]) <= 0);
    return some;
  };
  return something(b.bias + b.count, b.components - 1) || something(compliance, b.components);
}

// From columns to a pack, in the same memory: for this step the law is as good as one with a bias along the normal
// alone.
template <int d>
void Interactions::State::pack_columns(cairn_batch& b) const {
  constexpr int lines = 2 * d + 4;
  const int n = b.count;
  alignas(64) double old[(d + 4) * 128];
  for (int k = 0; k < d; ++k) std::copy_n(b.frame + k * n, n, old + k * n);
  std::copy_n(b.lever_a, n, old + d * n);
  std::copy_n(b.lever_b, n, old + (d + 1) * n);
  std::copy_n(b.bias, n, old + (d + 2) * n);
  std::copy_n(b.params, n, old + (d + 3) * n);
  for (int lane = 0; lane < n; ++lane) {
    double* to = b.frame + lane / 8 * 8 * lines + lane % 8;
    for (int k = 0; k < d + 4; ++k) to[8 * k] = old[k * n + lane];
    constexpr int mass = d == 2 ? 3 : 6; // equal to the bit to batches packed from the start
    if (lane < b.contacts)
      b.rho[lane] = 1 / (system.record[b.body_a[lane]].x[mass] + system.record[b.body_b[lane]].x[mass]);
  }
  b.delassus = nullptr;
  place_pack(b, d);
  inherit_packed<d>(b);
}

} // namespace cairn
