// Removal of self-stress. Closed loops of bonds carry self-equilibrated impulses (null space of H), which move nothing
// and are not determined: passes of Newton's method fill them with rounding and with the small misfits of rings. Beside
// them errors look small. Of all impulses with equal momentum of bodies the smallest are taken, each measured by the
// block of its contact, like bonds that yield by a share of it.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "batch.hpp"
#include "contact_rows.hpp"
#include "light_error.hpp"
#include "solid_correction.hpp"
#include "step_error.hpp"

namespace cairn {

namespace {

constexpr int most = 6, turns = 16;
// The share by which bonds give way beside masses, whose part turns take away; changes that end them.
constexpr double soft = 0x1p-30, exact = 0x1p-40, enough = 0x1p-24;

// Share of yielding under heavy bodies, whose remaining momentum would move light ones.
double finer(double share, double ratio) { return std::max(share / std::max(ratio, 1.0), 0x1p-50); }

// Inverts in place, c by c; rows without a pivot become zero. Masses and inertias have different units: each pivot is
// compared with its own diagonal.
void invert(int c, double (&a)[most][most]) {
  double whole[most];
  for (int k = 0; k < c; ++k) whole[k] = std::abs(a[k][k]);
  for (int k = 0; k < c; ++k) {
    const double pivot = a[k][k];
    if (!(pivot > 1e-12 * whole[k])) {
      for (int i = 0; i < c; ++i) a[i][k] = a[k][i] = 0;
      continue;
    }
    a[k][k] = 1;
    for (int j = 0; j < c; ++j) a[k][j] /= pivot;
    for (int i = 0; i < c; ++i) {
      const double factor = a[i][k];
      if (i == k || factor == 0) continue;
      a[i][k] = 0;
      for (int j = 0; j < c; ++j) a[i][j] -= factor * a[k][j];
    }
  }
}

bool bears(const cairn_batch& b, int lane) { return b.bonds && b.state[lane] > 0; }

} // namespace

// True if bonds close a ring, fixed bodies included.
bool SolidCorrection::bonds_close_rings() const {
  if (!system_.condensed.empty()) return false;
  std::vector<std::int32_t> of(std::size_t(system_.bodies) + 1);
  std::iota(of.begin(), of.end(), 0);
  const auto root = [&](std::int32_t i) {
    while (of[std::size_t(i)] != i) i = of[std::size_t(i)] = of[std::size_t(of[std::size_t(i)])];
    return i;
  };
  for (const Contact& contact : contacts_) {
    const cairn_batch& b = system_.batches[std::size_t(contact.batch)];
    if (!bears(b, contact.lane)) continue;
    const auto end = [&](int side) {
      const std::int32_t body = (side ? b.body_b : b.body_a)[contact.lane];
      return root(moves_rigid(b, side) && rigid_[std::size_t(body)] >= 0 ? body : std::int32_t(system_.bodies));
    };
    const std::int32_t one = end(0), other = end(1);
    if (one == other) return true;
    of[std::size_t(one)] = other;
  }
  return false;
}

// Answers of bonds that give way by a share of their block, of all others none.
void SolidCorrection::answer_by_blocks(double share) {
  std::size_t at = 0;
  std::fill(known_.begin(), known_.end(), 0.0);
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    open_batch(std::int32_t(k), share);
    const cairn_batch& b = system_.batches[k];
    const int c = b.components, n = b.count;
    for (int lane = 0; lane < b.contacts; ++lane) {
      double block[most][most];
      for (int i = 0; i < c; ++i)
        for (int j = 0; j < c; ++j) block[i][j] = w_[std::size_t((j * c + i) * n + lane)];
      const bool asks = bears(b, lane) && bias_[std::size_t(lane)] < never();
      if (asks) invert(c, block);
      for (int j = 0; j < c; ++j)
        for (int i = 0; i < c; ++i) answer_[at++] = asks ? block[i][j] : 0;
    }
  }
}

// Momentum of bodies by impulses of bonds is added to `momentum`, or taken from it.
void SolidCorrection::add_momentum(const std::vector<double>& impulse, double sign,
                                   std::vector<double>& momentum) const {
  std::size_t clique = std::size_t(clique_start_[clique_start_.size() - 1 - contacts_.size()]);
  for (const Contact& contact : contacts_) {
    const std::size_t c = std::size_t(contact.components);
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j)
      for (std::size_t k = 0; k < c; ++k)
        momentum[std::size_t(clique_[clique + j])] +=
            sign * rows_[contact.rows + c * j + k] * impulse[contact.known + k];
    clique += std::size_t(contact.unknowns);
  }
}

void SolidCorrection::drop_self_stress() {
  stressed_ = std::sqrt(total(system_.sums, system_.batches.size(), 6, 1));
  if (!bonds_close_rings()) return;
  const std::vector<double> step = velocity_; // of the pass, whose size is asked for afterwards
  if (find_smallest()) refresh();
  velocity_ = step;
}

// Relative velocities at contacts by the velocities at hand.
void SolidCorrection::velocities_at_contacts(std::vector<double>& u) const {
  std::size_t clique = std::size_t(clique_start_[clique_start_.size() - 1 - contacts_.size()]);
  for (const Contact& contact : contacts_) {
    const std::size_t c = std::size_t(contact.components);
    std::fill_n(&u[contact.known], c, 0.0);
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j)
      for (std::size_t k = 0; k < c; ++k)
        u[contact.known + k] += rows_[contact.rows + c * j + k] * velocity_[std::size_t(clique_[clique + j])];
    clique += std::size_t(contact.unknowns);
  }
}

// Impulses by which bonds answer velocities.
void SolidCorrection::answers_to(const std::vector<double>& u, std::vector<double>& impulse) const {
  for (const Contact& contact : contacts_) {
    const std::size_t c = std::size_t(contact.components);
    for (std::size_t k = 0; k < c; ++k) {
      double sum = 0;
      for (std::size_t l = 0; l < c; ++l) sum += answer_[contact.answer + c * l + k] * u[contact.known + l];
      impulse[contact.known + k] = sum;
    }
  }
}

// Limits biases of bonds in rings that do not close, as after a turn, which is exact to its square: their gaps cannot
// all be undone in the step. The part that no velocities undo is removed, by least squares measured by the blocks. The
// gaps stay, and show it.
void SolidCorrection::ask_for_what_rings_can() {
  if (!bonds_close_rings()) return;
  size_columns();
  answer_by_blocks(soft);
  std::vector<double> missed(known_.size(), 0.0), u(known_.size()), pull(known_.size());
  const auto each = [&](auto&& take) {
    for (const Contact& contact : contacts_) {
      const cairn_batch& b = system_.batches[std::size_t(contact.batch)];
      const bool asks = bears(b, contact.lane) && b.bias[contact.lane] < never() && b.pack == 0;
      for (int k = 0; asks && k < contact.components; ++k)
        take(b.bias[k * b.count + contact.lane], missed[contact.known + std::size_t(k)]);
    }
  };
  double largest = 0, last = 0;
  each([&](const double& bias, double& to) { largest = std::max(largest, std::abs(to = bias)); });
  if (!(largest > 0)) return;
  for (int turn = 0; turn < turns; ++turn) {
    std::fill(velocity_.begin(), velocity_.end(), 0.0);
    answers_to(missed, pull);
    add_momentum(pull, -1, velocity_);
    if (turn == 0 && !factor()) return;
    if (turn > 0) memory_.soe->solve(velocity_.data());
    velocities_at_contacts(u);
    last = 0;
    each([&](double, double& to) {
      const double more = u[std::size_t(&to - missed.data())];
      last = std::max(last, std::abs(more));
      to += more;
    });
    if (!(last > exact * largest)) break;
  }
  if (!(last <= enough * largest)) return;
  each([](double& bias, double& by) { bias -= by; });
}

bool SolidCorrection::has_bonds(const ContactSystem& system) {
  return system.condensed.empty() && std::any_of(system.batches.begin(), system.batches.end(),
                                                 [](const cairn_batch& b) { return b.bonds && b.contacts > 0; });
}

void SolidCorrection::drop_self_stress_within(double tolerance, const std::function<double()>& measure) {
  if (!bonds_close_rings()) return;
  kept_.resize(known_.size());
  copy_impulses(false);
  drop_self_stress();
  if (std::sqrt(measure()) <= tolerance) return;
  copy_impulses(true);
  refresh();
  measure(); // for the report
}

// Impulses of bonds, in the place of those that they have. Where they are not found in some turns all stay.
bool SolidCorrection::find_smallest() {
  const double ratio = mass_ratio(system_);
  size_columns();
  answer_by_blocks(soft);
  std::vector<double> begun(known_.size(), 0.0), found(known_.size(), 0.0), change(known_.size()), pull(known_.size());
  for (const Contact& contact : contacts_) {
    const cairn_batch& b = system_.batches[std::size_t(contact.batch)];
    for (int k = 0; bears(b, contact.lane) && k < contact.components; ++k)
      begun[contact.known + std::size_t(k)] = at(b, b.r, contact.lane, k);
  }
  std::vector<double> left(velocity_.size(), 0.0);
  add_momentum(begun, 1, left);
  velocity_ = left;
  double last = 0;
  for (int turn = 0; turn < turns; ++turn) {
    if (turn == 0 && !factor()) return false;
    if (turn > 0) memory_.soe->solve(velocity_.data());
    velocities_at_contacts(change);
    answers_to(change, pull);
    double size = 0, all = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i] += pull[i];
      size = std::max(size, std::abs(pull[i]));
      all = std::max(all, std::abs(found[i]));
    }
    last = all > 0 ? size / all : 0;
    if (!(last > finer(exact, ratio))) break;
    add_momentum(pull, -1, left);
    velocity_ = left;
  }
  if (!(last <= finer(enough, ratio))) return false;
  for (const Contact& contact : contacts_) {
    const cairn_batch& b = system_.batches[std::size_t(contact.batch)];
    for (int k = 0; bears(b, contact.lane) && k < contact.components; ++k)
      at(b, b.r, contact.lane, k) = found[contact.known + std::size_t(k)];
  }
  return true;
}

} // namespace cairn
