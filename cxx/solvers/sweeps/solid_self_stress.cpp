// Removal of self-stress. Closed loops of bonds carry self-equilibrated impulses (null space of H), which move nothing
// and are not determined: passes of Newton's method fill them with rounding and with the small misfits of rings. Beside
// them errors look small. Of all impulses with equal momentum of bodies the smallest are taken, each measured by the
// block of its contact, like bonds that yield by a share of it.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "../../base/small_matrices.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"
#include "light_error.hpp"
#include "solid_self_stress.hpp"
#include "step_error.hpp"

namespace cairn {

namespace {

constexpr int most = 6, turns = 16;
// The share by which bonds give way beside masses, whose part turns take away; changes that end them.
constexpr double soft = 0x1p-30, exact = 0x1p-40, enough = 0x1p-24;

// Share of yielding under heavy bodies, whose remaining momentum would move light ones.
double finer(double share, double ratio) { return std::max(share / std::max(ratio, 1.0), 0x1p-50); }

bool bears(const cairn_batch& b, int lane) { return b.bonds && b.state[lane] > 0; }

} // namespace

// True if bonds close a ring, fixed bodies included.
bool SelfStress::bonds_close_rings() const {
  if (!solid_.system.condensed.empty()) return false;
  std::vector<std::int32_t> of(std::size_t(solid_.system.bodies) + 1);
  std::iota(of.begin(), of.end(), 0);
  const auto root = [&](std::int32_t i) {
    while (of[std::size_t(i)] != i) i = of[std::size_t(i)] = of[std::size_t(of[std::size_t(i)])];
    return i;
  };
  for (const Contact& contact : solid_.contacts()) {
    const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
    if (!bears(b, contact.lane)) continue;
    const auto end = [&](int side) {
      const std::int32_t body = (side ? b.body_b : b.body_a)[contact.lane];
      return root(moves_rigid(b, side) && solid_.unknown_of(body) >= 0 ? body : std::int32_t(solid_.system.bodies));
    };
    const std::int32_t one = end(0), other = end(1);
    if (one == other) return true;
    of[std::size_t(one)] = other;
  }
  return false;
}

// Answers of bonds that give way by a share of their block, of all others none.
void SelfStress::answer_by_blocks(double share) {
  std::size_t at = 0;
  std::fill(solid_.known.begin(), solid_.known.end(), 0.0);
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    tangent_.open_batch(std::int32_t(k), share);
    const cairn_batch& b = solid_.system.batches[k];
    const int c = b.components, n = b.count;
    for (int lane = 0; lane < b.contacts; ++lane) {
      double block[most][most];
      for (int i = 0; i < c; ++i)
        for (int j = 0; j < c; ++j) block[i][j] = tangent_.w[std::size_t((j * c + i) * n + lane)];
      const bool asks = bears(b, lane) && tangent_.bias[std::size_t(lane)] < never();
      if (asks) invert_symmetric(std::size_t(c), block, 1e-12);
      for (int j = 0; j < c; ++j)
        for (int i = 0; i < c; ++i) solid_.answer[at++] = asks ? block[i][j] : 0;
    }
  }
}

void SelfStress::drop() {
  size_ = std::sqrt(total(solid_.system.sums, solid_.system.batches.size(), 6, 1));
  if (!bonds_close_rings()) return;
  const std::vector<double> step = solid_.velocity; // of the pass, whose size is asked for afterwards
  if (find_smallest()) solid_.refresh();
  solid_.velocity = step;
}

void SelfStress::velocities_at_contacts(std::vector<double>& u) const {
  for (const Contact& contact : solid_.contacts()) solid_.relative_velocity(contact, &u[contact.known]);
}

// Impulses by which bonds answer velocities.
void SelfStress::answers_to(const std::vector<double>& u, std::vector<double>& impulse) const {
  for (const Contact& contact : solid_.contacts()) {
    const std::size_t c = std::size_t(contact.components);
    for (std::size_t k = 0; k < c; ++k) {
      double sum = 0;
      for (std::size_t l = 0; l < c; ++l) sum += solid_.answer[contact.answer + c * l + k] * u[contact.known + l];
      impulse[contact.known + k] = sum;
    }
  }
}

// Limits biases of bonds in rings that do not close, as after a turn, which is exact to its square: their gaps cannot
// all be undone in the step. The part that no velocities undo is removed, by least squares measured by the blocks. The
// gaps stay, and show it.
void SelfStress::limit_biases() {
  if (!bonds_close_rings()) return;
  tangent_.size_columns();
  answer_by_blocks(soft);
  std::vector<double> missed(solid_.known.size(), 0.0), u(solid_.known.size()), pull(solid_.known.size());
  const auto each = [&](auto&& take) {
    for (const Contact& contact : solid_.contacts()) {
      const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
      const bool asks = bears(b, contact.lane) && b.bias[contact.lane] < never() && b.pack == 0;
      for (int k = 0; asks && k < contact.components; ++k)
        take(b.bias[k * b.count + contact.lane], missed[contact.known + std::size_t(k)]);
    }
  };
  double largest = 0, last = 0;
  each([&](const double& bias, double& to) { largest = std::max(largest, std::abs(to = bias)); });
  if (!(largest > 0)) return;
  for (int turn = 0; turn < turns; ++turn) {
    std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
    answers_to(missed, pull);
    solid_.add_momentum(pull, -1, solid_.velocity);
    if (turn == 0 && !solid_.factor()) return;
    if (turn > 0) solid_.solve();
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

void SelfStress::drop_within(double tolerance, const std::function<double()>& measure) {
  if (!bonds_close_rings()) return;
  solid_.keep_impulses();
  drop();
  if (std::sqrt(measure()) <= tolerance) return;
  solid_.restore_impulses();
  solid_.refresh();
  measure(); // for the report
}

// Impulses of bonds, in the place of those that they have. Where they are not found in some turns all stay.
bool SelfStress::find_smallest() {
  const double ratio = mass_ratio(solid_.system);
  tangent_.size_columns();
  answer_by_blocks(soft);
  std::vector<double> begun(solid_.known.size(), 0.0), found(solid_.known.size(), 0.0), change(solid_.known.size()),
      pull(solid_.known.size());
  for (const Contact& contact : solid_.contacts()) {
    const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
    for (int k = 0; bears(b, contact.lane) && k < contact.components; ++k)
      begun[contact.known + std::size_t(k)] = at(b, b.r, contact.lane, k);
  }
  std::vector<double> left(solid_.velocity.size(), 0.0);
  solid_.add_momentum(begun, 1, left);
  solid_.velocity = left;
  double last = 0;
  for (int turn = 0; turn < turns; ++turn) {
    if (turn == 0 && !solid_.factor()) return false;
    if (turn > 0) solid_.solve();
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
    solid_.add_momentum(pull, -1, left);
    solid_.velocity = left;
  }
  if (!(last <= finer(enough, ratio))) return false;
  for (const Contact& contact : solid_.contacts()) {
    const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
    for (int k = 0; bears(b, contact.lane) && k < contact.components; ++k)
      at(b, b.r, contact.lane, k) = found[contact.known + std::size_t(k)];
  }
  return true;
}

} // namespace cairn
