#include "solid_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "batch.hpp"
#include "contact_rows.hpp"

namespace cairn {

SolidMemory& SolidMemory::of(ContactSystem& system) {
  if (!system.solid) system.solid = std::make_shared<SolidMemory>();
  return *system.solid;
}

SolidSystem::SolidSystem(ContactSystem& of, const cairn_schedule& its_schedule, const Velocities& velocity_free)
    : system(of), schedule(its_schedule), velocity_free_(velocity_free), memory_(SolidMemory::of(of)) {
  number_unknowns();
  if (!possible_ || unknowns_ == 0) {
    possible_ = false;
    return;
  }
  place_contacts();
  place_entries();
  velocity.resize(std::size_t(unknowns_));
}

void SolidSystem::place_entries() {
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
}

void SolidSystem::number_unknowns() {
  rigid_.assign(std::size_t(system.bodies) + 1, -1);
  condensed_.assign(system.condensed.size(), -1);
  first_dof_.assign(1, 0);
  for (const CondensedBody& body : system.condensed) first_dof_.push_back(first_dof_.back() + body.dofs.dofs);
  dof_unknown_.assign(first_dof_.back(), -1);
  for (const cairn_batch& b : system.batches)
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

void SolidSystem::add_clique(const std::int32_t* unknown, int count) {
  clique_.insert(clique_.end(), unknown, unknown + count);
  clique_start_.push_back(std::int64_t(clique_.size()));
}

std::int32_t SolidSystem::number_rigid(std::int32_t body) {
  const int n = system.velocities();
  const std::int32_t first = unknowns_;
  std::int32_t own[6];
  for (int k = 0; k < n; ++k) own[k] = unknowns_++;
  add_clique(own, n);
  double mass[36], inverse[36];
  body_mass(system, body, mass, inverse);
  clique_matrix_.insert(clique_matrix_.end(), mass, mass + n * n);
  inverse_.resize(std::max(inverse_.size(), std::size_t(n) * std::size_t(first + n)));
  std::copy_n(inverse, n * n, &inverse_[std::size_t(n) * std::size_t(first)]);
  return first;
}

// Its mass matrix is the inverse of its compliance between the dofs that move.
void SolidSystem::number_condensed(std::int32_t body) {
  if (condensed_[body] >= 0) return;
  condensed_[body] = unknowns_;
  const cairn_condensed& given = system.condensed_dofs[body];
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

void SolidSystem::place_contacts() {
  contacts_begin_ = clique_matrix_.size();
  std::size_t matrix = contacts_begin_, answers = 0, impulses = 0;
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::size_t begin = clique_.size();
      Contact contact{std::int32_t(k), lane, b.components, 0, rows_.size(), answers, impulses, begin};
      for (int side = 0; side < 2; ++side) contact.unknowns += add_side(b, lane, side, b.components);
      if (b.rope) contact.unknowns += add_rope(b, lane, b.components, begin);
      clique_start_.push_back(std::int64_t(clique_.size()));
      matrix += std::size_t(contact.unknowns) * std::size_t(contact.unknowns);
      answers += std::size_t(b.components) * std::size_t(b.components);
      impulses += std::size_t(b.components);
      contacts_.push_back(contact);
    }
  }
  clique_matrix_.resize(matrix);
  answer.resize(answers);
  known.resize(impulses);
}

// Unknowns of one side of a contact and their columns of H'; how many.
int SolidSystem::add_side(const cairn_batch& b, int lane, int side, int components) {
  const std::int32_t body = (side ? b.body_b : b.body_a)[lane];
  const int n = system.velocities(), d = system.dim;
  if (!is_mapped(b, side)) {
    if (!moves_rigid(b, side)) return 0;
    const std::int32_t first = rigid_[body];
    double rows[36];
    rigid_rows(system, b, lane, side, components, &inverse_[std::size_t(n) * std::size_t(first)], rows);
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
int SolidSystem::add_rope(const cairn_batch& b, int lane, int components, std::size_t begin) {
  const int n = system.velocities();
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

bool SolidSystem::factor() {
  std::size_t to = contacts_begin_;
  double product[most_components * (2 * most_dofs)];
  for (const Contact& contact : contacts_) {
    const int c = contact.components, m = contact.unknowns;
    const std::int32_t* unknown = &clique_[contact.clique];
    const double *rows = &rows_[contact.rows], *response = &answer[contact.answer], *given = &known[contact.known];
    for (int j = 0; j < m; ++j) {
      double pull = 0;
      for (int k = 0; k < c; ++k) {
        double sum = 0;
        for (int l = 0; l < c; ++l) sum += response[c * l + k] * rows[c * j + l];
        product[c * j + k] = sum;
        pull += rows[c * j + k] * given[k];
      }
      velocity[std::size_t(unknown[j])] += pull;
    }
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i) {
        double sum = 0;
        for (int k = 0; k < c; ++k) sum += rows[c * i + k] * product[c * j + k];
        clique_matrix_[to++] = sum;
      }
  }
  std::vector<double>& value = memory_.matrix.value;
  std::fill(value.begin(), value.end(), 0.0);
  for (std::size_t k = 0; k < entry_.size(); ++k)
    if (entry_[k] >= 0) value[std::size_t(entry_[k])] += clique_matrix_[k];
  if (!memory_.soe->factor(value.data())) return false;
  memory_.soe->solve(velocity.data());
  return true;
}

void SolidSystem::refresh() {
  system.load(velocity_free_);
  cairn_add_impulses(&schedule);
}

bool SolidSystem::moves(const Contact& contact) const {
  constexpr double rounding = 256 * std::numeric_limits<double>::epsilon();
  const std::size_t c = std::size_t(contact.components), n = std::size_t(contact.unknowns);
  const double* rows = &rows_[contact.rows];
  const std::int32_t* unknown = &clique_[contact.clique];
  double size = 0, most = 0;
  for (std::size_t j = 0; j < n; ++j) {
    double sum = 0; // over both sides
    for (std::size_t i = 0; i < n; ++i) sum += unknown[i] == unknown[j] ? rows[c * i] : 0;
    size = std::max(size, std::abs(rows[c * j]));
    most = std::max(most, std::abs(sum));
  }
  return most > rounding * size;
}

void SolidSystem::add_momentum(const std::vector<double>& impulse, double sign, std::vector<double>& momentum) const {
  for (const Contact& contact : contacts_) {
    const std::size_t c = std::size_t(contact.components);
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j)
      for (std::size_t k = 0; k < c; ++k)
        momentum[std::size_t(clique_[contact.clique + j])] +=
            sign * rows_[contact.rows + c * j + k] * impulse[contact.known + k];
  }
}

void SolidSystem::mass_times(const std::vector<double>& x, std::vector<double>& y) const {
  std::fill(y.begin(), y.end(), 0.0);
  const double* matrix = clique_matrix_.data();
  for (std::size_t c = 0; c + 1 + contacts_.size() < clique_start_.size(); ++c) {
    const std::int32_t* unknown = &clique_[std::size_t(clique_start_[c])];
    const std::int64_t m = clique_start_[c + 1] - clique_start_[c];
    for (std::int64_t j = 0; j < m; ++j)
      for (std::int64_t i = 0; i < m; ++i) y[std::size_t(unknown[i])] += matrix[m * j + i] * x[std::size_t(unknown[j])];
    matrix += m * m;
  }
}

double SolidSystem::size_of_step() const {
  const int d = system.dim, n = system.velocities();
  double sum = 0;
  for (std::int64_t body = 0; body < system.bodies; ++body) {
    if (rigid_[std::size_t(body)] < 0) continue;
    const double *x = system.record[body].x, *change = &velocity[std::size_t(rigid_[std::size_t(body)])];
    for (int k = 0; k < n; ++k) {
      const double inverse = d == 2 ? x[3 + k] : x[k < 3 ? 6 : 7];
      if (inverse > 0 && (k < d || system.general.empty())) sum += change[k] * change[k] / inverse;
    }
  }
  return std::sqrt(sum);
}

void SolidSystem::change_impulses() {
  for (const Contact& contact : contacts_) {
    const int c = contact.components;
    const cairn_batch& b = system.batches[contact.batch];
    double du[most_components];
    relative_velocity(contact, du);
    for (int k = 0; k < c; ++k) {
      double change = known[contact.known + std::size_t(k)];
      for (int l = 0; l < c; ++l) change -= answer[contact.answer + std::size_t(c * l + k)] * du[l];
      at(b, b.r, contact.lane, k) += change;
    }
  }
}

void SolidSystem::keep_impulses() {
  kept_.resize(known.size());
  for (const Contact& contact : contacts_) {
    const cairn_batch& b = system.batches[contact.batch];
    for (int k = 0; k < contact.components; ++k) kept_[contact.known + std::size_t(k)] = at(b, b.r, contact.lane, k);
  }
}

void SolidSystem::restore_impulses() {
  for (const Contact& contact : contacts_) {
    const cairn_batch& b = system.batches[contact.batch];
    for (int k = 0; k < contact.components; ++k) at(b, b.r, contact.lane, k) = kept_[contact.known + std::size_t(k)];
  }
}

} // namespace cairn
