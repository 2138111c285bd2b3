#include "solid_correction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"
#include "light_error.hpp"

namespace cairn {

namespace {

constexpr int most_components = 6, most_lanes = 128;
// Share of its own block with which the law of a contact is asked. A law that softens faster than the mass of a body
// resists has several solutions for the full block, although the solid has only one. With any block, an impulse that
// reproduces itself is a solution.
constexpr double stiffer = 0.25;
constexpr std::int64_t most_dofs = 96; // of a condensed body, whose matrix is full

// Yielding of bonds that hold fast, as a share of their own block. Under heavy bodies their stiffness must exceed the
// effect of that mass, which costs digits.
double proximal(double mass_ratio) { return std::clamp(0x1p-10 / mass_ratio, 0x1p-30, 0x1p-20); }

bool bond_holds(const cairn_batch& b, int lane) { return b.bonds && b.state[lane] > 0; }

} // namespace

SolidMemory& SolidMemory::of(ContactSystem& system) {
  if (!system.solid) system.solid = std::make_shared<SolidMemory>();
  return *system.solid;
}

std::string SolidCorrection::obstacle(const ContactSystem& system) {
  bool own = false;
  for (const cairn_batch& b : system.batches) {
    const LawInfo& law = law_infos()[b.law];
    if (law.has_solve && law.plugged()) return "law " + law.python_name + " is a library's, which may count its calls";
    own |= law.has_solve;
  }
  if (!own) return "no law has a local solution of its own";
  for (const CondensedBody& body : system.condensed)
    if (body.dofs.dofs > most_dofs) return "a body that deforms has many nodes that contacts rest on";
  return {};
}

SolidCorrection::SolidCorrection(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free)
    : system_(system), schedule_(schedule), velocity_free_(velocity_free), memory_(SolidMemory::of(system)),
      proximal_(proximal(mass_ratio(system))) {
  number_unknowns();
  if (!possible_ || unknowns_ == 0) {
    possible_ = false;
    return;
  }
  place_contacts();
  SparseMatrix pattern = lower_pattern(unknowns_, clique_start_, clique_);
  if (!memory_.soe || pattern.start != memory_.matrix.start || pattern.row != memory_.matrix.row) {
    memory_.matrix = std::move(pattern);
    SoeOptions options;
    options.blocks = SoeBlocks::own;
    memory_.soe = Soe::make(memory_.matrix, options);
  }
  entry_.reserve(clique_matrix_.size());
  for (std::size_t c = 0; c + 1 < clique_start_.size(); ++c)
    for (std::int64_t j = clique_start_[c]; j < clique_start_[c + 1]; ++j)
      for (std::int64_t i = clique_start_[c]; i < clique_start_[c + 1]; ++i)
        entry_.push_back(clique_[i] < clique_[j] ? -1 : place_of(memory_.matrix, clique_[i], clique_[j]));
  velocity_.resize(std::size_t(unknowns_));
}

double SolidCorrection::operations(const ContactSystem& system) {
  // nested dissection in the plane, and in space
  double contacts = 0;
  for (const cairn_batch& b : system.batches) contacts += b.contacts;
  double n = double(system.velocities()) * double(system.bodies);
  for (const CondensedBody& body : system.condensed) n += double(body.dofs.dofs);
  const double factors = system.dim == 2 ? 30 * n * std::sqrt(n) : 15 * n * n;
  return factors + 4000.0 * contacts;
}

void SolidCorrection::number_unknowns() {
  rigid_.assign(std::size_t(system_.bodies) + 1, -1);
  condensed_.assign(system_.condensed.size(), -1);
  first_dof_.assign(1, 0);
  for (const CondensedBody& body : system_.condensed) first_dof_.push_back(first_dof_.back() + body.dofs.dofs);
  dof_unknown_.assign(first_dof_.back(), -1);
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && possible_; ++lane)
      for (int side = 0; side < 2; ++side) {
        const std::int32_t body = (side ? b.body_b : b.body_a)[lane];
        if (is_mapped(b, side))
          number_condensed(body);
        else if (moves_rigid(b, side) && rigid_[body] < 0)
          rigid_[body] = number_rigid(body);
        // side 0: the far end of a rope, side 1: its pulley
        if (!b.rope || !moves_by_rope(b, lane, side)) continue;
        if (const std::int32_t far = b.rope_body[2 * lane + side]; rigid_[far] < 0) rigid_[far] = number_rigid(far);
      }
}

void SolidCorrection::add_clique(const std::int32_t* unknown, int count) {
  clique_.insert(clique_.end(), unknown, unknown + count);
  clique_start_.push_back(std::int64_t(clique_.size()));
}

std::int32_t SolidCorrection::number_rigid(std::int32_t body) {
  const int n = system_.velocities();
  const std::int32_t first = unknowns_;
  std::int32_t own[6];
  for (int k = 0; k < n; ++k) own[k] = unknowns_++;
  add_clique(own, n);
  double mass[36], inverse[36];
  body_mass(system_, body, mass, inverse);
  clique_matrix_.insert(clique_matrix_.end(), mass, mass + n * n);
  inverse_.resize(std::max(inverse_.size(), std::size_t(n) * std::size_t(first + n)));
  std::copy_n(inverse, n * n, &inverse_[std::size_t(n) * std::size_t(first)]);
  return first;
}

// Its mass matrix is the inverse of its compliance between the dofs that move.
void SolidCorrection::number_condensed(std::int32_t body) {
  if (condensed_[body] >= 0) return;
  condensed_[body] = unknowns_;
  const cairn_condensed& given = system_.condensed_dofs[body];
  std::int32_t own[most_dofs], dof[most_dofs];
  int count = 0;
  for (std::int64_t k = 0; k < given.dofs; ++k) {
    if (!(given.compliance[given.leading * k + k] > 0)) continue;
    dof[count] = std::int32_t(k);
    own[count++] = dof_unknown_[first_dof_[body] + std::size_t(k)] = unknowns_++;
  }
  if (count == 0) return;
  add_clique(own, count);
  // one matrix of the eight that the kernel takes
  std::vector<double> lanes(std::size_t(8 * count * count), 0.0), mass(lanes.size());
  for (int j = 0; j < count; ++j)
    for (int i = 0; i < count; ++i)
      for (int lane = 0; lane < 8; ++lane)
        lanes[std::size_t(8 * (count * j + i) + lane)] = given.compliance[given.leading * dof[j] + dof[i]];
  std::int32_t failed[8];
  double pivot[8];
  cairn_small_factor(1, count, 0x1p-49, lanes.data(), failed, pivot);
  possible_ = possible_ && failed[0] == 0;
  cairn_small_inverse(1, count, lanes.data(), mass.data());
  for (int j = 0; j < count; ++j)
    for (int i = 0; i < count; ++i) clique_matrix_.push_back(mass[std::size_t(8 * (count * j + i))]);
}

void SolidCorrection::place_contacts() {
  contacts_begin_ = clique_matrix_.size();
  std::size_t matrix = contacts_begin_, answer = 0, known = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    for (int lane = 0; lane < b.contacts; ++lane) {
      Contact contact{std::int32_t(k), lane, b.components, 0, rows_.size(), answer, known};
      const std::size_t begin = clique_.size();
      for (int side = 0; side < 2; ++side) contact.unknowns += add_side(b, lane, side, b.components);
      if (b.rope) contact.unknowns += add_rope(b, lane, b.components, begin);
      clique_start_.push_back(std::int64_t(clique_.size()));
      matrix += std::size_t(contact.unknowns) * std::size_t(contact.unknowns);
      answer += std::size_t(b.components) * std::size_t(b.components);
      known += std::size_t(b.components);
      contacts_.push_back(contact);
    }
  }
  clique_matrix_.resize(matrix);
  answer_.resize(answer);
  known_.resize(known);
}

// Unknowns of one side of a contact and their columns of H'; how many.
int SolidCorrection::add_side(const cairn_batch& b, int lane, int side, int components) {
  const std::int32_t body = (side ? b.body_b : b.body_a)[lane];
  const int n = system_.velocities(), d = system_.dim;
  if (!is_mapped(b, side)) {
    if (!moves_rigid(b, side)) return 0;
    const std::int32_t first = rigid_[body];
    double rows[36];
    rigid_rows(system_, b, lane, side, components, &inverse_[std::size_t(n) * std::size_t(first)], rows);
    if ((b.mapped_a || b.mapped_b) && !(b.turns && b.turns[lane])) // relative to a node nothing turns
      for (int k = 0; k < n; ++k) std::fill_n(rows + components * k + d, components - d, 0.0);
    for (int k = 0; k < n; ++k) clique_.push_back(first + k);
    rows_.insert(rows_.end(), rows, rows + components * n);
    return n;
  }
  double axes[3][3];
  axes_of(b, d, lane, axes);
  int count = 0;
  const double *weights = side ? b.lever_b : b.lever_a, sign = side ? -1 : 1;
  const std::int32_t* nodes = side ? b.node_b : b.node_a;
  for (int node = 0; node < (side ? b.nodes_b : b.nodes_a); ++node) {
    const double weight = weights[node * b.count + lane];
    const bool turns = b.turns && b.turns[lane];
    if (weight == 0 && !turns) continue;
    for (int k = 0; k < d; ++k) {
      const std::size_t dof = first_dof_[body] + std::size_t(d * nodes[node * b.count + lane] + k);
      if (dof_unknown_[dof] < 0) continue;
      clique_.push_back(dof_unknown_[dof]);
      for (int c = 0; c < d; ++c) rows_.push_back(sign * weight * axes[c][k]);
      for (int c = d; c < components; ++c)
        rows_.push_back(turns ? sign * spin_of(b, d, side, lane, node, k, c - d) : 0);
      ++count;
    }
  }
  return count;
}

// The far part of a rope, which may move a body that the sides have moved already; how many unknowns are new.
int SolidCorrection::add_rope(const cairn_batch& b, int lane, int components, std::size_t begin) {
  const int n = system_.velocities();
  int more = 0;
  for (int end = 0; end < 2; ++end) {
    if (!moves_by_rope(b, lane, end)) continue;
    const std::int32_t first = rigid_[b.rope_body[2 * lane + end]];
    const double *row = b.rope + 26 * lane + 2 + 12 * end, *inverse = &inverse_[std::size_t(n) * std::size_t(first)];
    const auto seen = std::find(clique_.begin() + std::ptrdiff_t(begin), clique_.end(), first);
    std::size_t at = rows_.size() - std::size_t(clique_.end() - seen) * std::size_t(components);
    if (seen == clique_.end()) {
      for (int k = 0; k < n; ++k) clique_.push_back(first + k);
      rows_.resize(at + std::size_t(components * n), 0.0);
      more += n;
    }
    for (int k = 0; k < n; ++k, at += std::size_t(components))
      if (inverse[(n + 1) * k] > 0) rows_[at] += row[k];
  }
  return more;
}

// Blocks, of which a share is taken, velocities and impulses of a batch as its law has them.
void SolidCorrection::open_batch(std::int32_t batch, double share) {
  const cairn_batch& b = system_.batches[batch];
  const int n = b.count, c = b.components;
  cairn_delassus(&schedule_, batch, 0, w_.data(), w_true_.data(), u_.data());
  if (b.hub) std::copy_n(w_true_.data(), c * c * n, w_.data());
  for (int k = 0; k < c; ++k)
    for (int lane = 0; lane < n; ++lane) {
      const int i = k * n + lane;
      r_[i] = at(b, b.r, lane, k);
      bias_[i] = b.pack && k > 0 ? 0 : at(b, b.bias, lane, k);
      q_[i] = u_[i] + bias_[i];
      if (b.compliance) q_[i] += b.compliance[i] * r_[i];     // which u does not have in it
      if (b.compliance) w_[k * c * n + i] += b.compliance[i]; // (lane, k, k)
    }
  for (int i = 0; i < c * c * n; ++i) w_[i] *= share;
  for (int l = 0; l < c; ++l)
    for (int k = 0; k < c; ++k)
      for (int lane = 0; lane < n; ++lane) q_[k * n + lane] -= w_[(l * c + k) * n + lane] * r_[l * n + lane];
  for (double* column : {q_.data(), r_.data(), bias_.data()}) repeat_last(b, column, c);
  repeat_last(b, w_.data(), c * c);
  for (int lane = 0; lane < n; ++lane) params_[lane] = law_infos()[b.law].has_solve ? 0 : at(b, b.params, lane, 0);
  repeat_last(b, params_.data(), 1);
}

double SolidCorrection::fastest() {
  double speed = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    open_batch(std::int32_t(k), stiffer);
    for (int c = 0; c < std::min(system_.dim, b.components); ++c)
      for (int lane = 0; lane < b.contacts; ++lane)
        if (bias_[lane] < never()) speed = std::max(speed, std::abs(q_[c * b.count + lane]));
  }
  return speed;
}

void SolidCorrection::size_columns() {
  constexpr std::size_t lanes = most_lanes, c = most_components;
  for (std::vector<double>* columns : {&u_, &q_, &r_, &bias_, &target_, &nudges_, &begun_, &told_, &found_})
    columns->resize(c * lanes);
  for (std::vector<double>* blocks : {&w_, &w_true_, &nudged_}) blocks->resize(c * c * lanes);
  params_.resize(lanes);
  held_.resize(lanes);
}

void SolidCorrection::linearise() {
  size_columns();
  const double speed = fastest();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    open_batch(std::int32_t(k), stiffer);
    respond(std::int32_t(k), {w_.data(), q_.data(), r_.data(), bias_.data(), params_.data()}, speed, w_.data(),
            proximal_);
  }
}

// Impulses that the law of a batch wants.
void SolidCorrection::ask(const cairn_batch& b, const Question& with, double* r) const {
  const bool own = law_infos()[b.law].has_solve;
  std::copy_n(with.begun, b.components * b.count, r);
  (own                ? b.solve
   : system_.dim == 2 ? cairn_cone_full2
                      : cairn_cone_full3)(b.count, b.components, with.block, with.velocity, with.bias,
                                          own ? b.params : with.params, b.state, r, nullptr);
}

// Answers of the contacts of a batch: of the law beside its block, or of both where the block is eliminated.
void SolidCorrection::respond(std::int32_t batch, Question with, double speed, const double* eliminated,
                              double proximal) {
  const cairn_batch& b = system_.batches[batch];
  const int n = b.count, c = b.components, d = system_.dim;
  ask(b, with, target_.data());
  cairn_contact_nudges(n, c, std::min(c, d), with.block, with.velocity, with.begun, speed, nudges_.data());
  // bonds that hold fast are asked at rest, so that their response has only rounding errors
  for (int lane = 0; lane < n; ++lane) held_[lane] = proximal > 0 && bond_holds(b, lane);
  for (int i = 0; i < c * n; ++i) begun_[i] = held_[i % n] ? 0 : with.velocity[i];
  std::copy_n(begun_.data(), c * n, told_.data());
  with.velocity = told_.data();
  for (int l = 0; l < c; ++l) {
    for (int i = l * n; i < (l + 1) * n; ++i) told_[i] = begun_[i] + nudges_[i], nudges_[i] = told_[i] - begun_[i];
    ask(b, with, nudged_.data() + std::size_t(l) * std::size_t(c * n));
    std::copy_n(&begun_[l * n], n, &told_[l * n]);
  }
  const auto begins = std::lower_bound(contacts_.begin(), contacts_.end(), batch,
                                       [](const Contact& x, std::int32_t y) { return x.batch < y; });
  const std::size_t first = std::size_t(begins - contacts_.begin());
  found_.resize(std::size_t(c) * std::size_t((c + 1) * n));
  cairn_contact_responses(n, c, b.contacts, proximal, held_.data(), eliminated, with.begun, target_.data(),
                          nudged_.data(), nudges_.data(), found_.data(), found_.data() + c * c * n);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const Contact& contact = contacts_[first + std::size_t(lane)];
    const bool moves = with.bias[lane] < never();
    for (int k = 0; k < c * c; ++k) answer_[contact.answer + std::size_t(k)] = moves ? found_[c * c * lane + k] : 0;
    for (int k = 0; k < c; ++k) known_[contact.known + std::size_t(k)] = moves ? found_[c * c * n + c * lane + k] : 0;
  }
}

// A + H answer H' dv = H known, to which the right side at hand is added.
bool SolidCorrection::factor() {
  std::size_t to = contacts_begin_;
  std::int64_t clique = clique_start_[clique_start_.size() - 1 - contacts_.size()];
  double product[most_components * (2 * most_dofs)];
  for (const Contact& contact : contacts_) {
    const int c = contact.components, m = contact.unknowns;
    const double *rows = &rows_[contact.rows], *answer = &answer_[contact.answer], *known = &known_[contact.known];
    for (int j = 0; j < m; ++j) {
      double pull = 0;
      for (int k = 0; k < c; ++k) {
        double sum = 0;
        for (int l = 0; l < c; ++l) sum += answer[c * l + k] * rows[c * j + l];
        product[c * j + k] = sum;
        pull += rows[c * j + k] * known[k];
      }
      velocity_[std::size_t(clique_[std::size_t(clique + j)])] += pull;
    }
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i) {
        double sum = 0;
        for (int k = 0; k < c; ++k) sum += rows[c * i + k] * product[c * j + k];
        clique_matrix_[to++] = sum;
      }
    clique += m;
  }
  std::vector<double>& value = memory_.matrix.value;
  std::fill(value.begin(), value.end(), 0.0);
  for (std::size_t k = 0; k < entry_.size(); ++k)
    if (entry_[k] >= 0) value[std::size_t(entry_[k])] += clique_matrix_[k];
  if (!memory_.soe->factor(value.data())) return false;
  memory_.soe->solve(velocity_.data());
  return true;
}

// dr = known - answer H'dv
void SolidCorrection::change_impulses() {
  std::int64_t clique = clique_start_[clique_start_.size() - 1 - contacts_.size()];
  for (const Contact& contact : contacts_) {
    const int c = contact.components;
    const cairn_batch& b = system_.batches[contact.batch];
    double du[most_components] = {};
    for (int j = 0; j < contact.unknowns; ++j)
      for (int k = 0; k < c; ++k)
        du[k] +=
            rows_[contact.rows + std::size_t(c * j + k)] * velocity_[std::size_t(clique_[std::size_t(clique + j)])];
    clique += contact.unknowns;
    for (int k = 0; k < c; ++k) {
      double change = known_[contact.known + std::size_t(k)];
      for (int l = 0; l < c; ++l) change -= answer_[contact.answer + std::size_t(c * l + k)] * du[l];
      at(b, b.r, contact.lane, k) += change;
    }
  }
}

void SolidCorrection::refresh() {
  system_.load(velocity_free_);
  cairn_add_impulses(&schedule_);
}

// From the impulses of contacts, or back to them.
void SolidCorrection::copy_impulses(bool back) {
  for (const Contact& contact : contacts_)
    for (int k = 0; k < contact.components; ++k) {
      double &there = kept_[contact.known + std::size_t(k)],
             &here = at(system_.batches[contact.batch], system_.batches[contact.batch].r, contact.lane, k);
      (back ? here : there) = back ? there : here;
    }
}

// A whole step of Newton's method; false: there is none.
bool SolidCorrection::take_pass() {
  linearise();
  std::fill(velocity_.begin(), velocity_.end(), 0.0);
  if (!factor()) return false;
  change_impulses();
  refresh();
  drop_self_stress();
  return true;
}

int SolidCorrection::improve(double error_square, double wanted_square, const std::function<double()>& measure) {
  constexpr int most = 12, patient = 3; // passes; those that may follow each other without a smaller error
  kept_.resize(known_.size());
  copy_impulses(false);
  int best = 0, pass = 0;
  double now = error_square;
  // whole steps: which springs are drawn and which contacts pressed may take some of them to find, with larger errors
  while (pass < most && pass < best + patient && now > wanted_square && take_pass()) {
    ++pass;
    now = measure();
    if (!std::isfinite(now)) break;
    if (!(now < error_square)) continue;
    error_square = now;
    best = pass;
    copy_impulses(false);
  }
  const auto go_back = [&] {
    copy_impulses(true);
    refresh();
    measure(); // for the report
  };
  if (best < pass) go_back();
  if (error_square > wanted_square) {
    if (const int more = improve_by_proximal_points(error_square, wanted_square, measure)) best = pass + more;
    go_back();
  }
  return best;
}

} // namespace cairn
