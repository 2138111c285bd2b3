#include "law_tangent.hpp"

#include <algorithm>
#include <cmath>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"

namespace cairn {

namespace {

constexpr int most_lanes = 128;
// Share of its own block with which the law of a contact is asked. A law that softens faster than the mass of a body
// resists has several solutions for the full block, although the solid has only one. With any block, an impulse that
// reproduces itself is a solution.
constexpr double stiffer = 0.25;

bool bond_holds(const cairn_batch& b, int lane) { return b.bonds && b.state[lane] > 0; }

} // namespace

LawTangent::LawTangent(SolidSystem& of) : solid_(of) {}

void LawTangent::size_columns() {
  constexpr std::size_t lanes = most_lanes, c = SolidSystem::most_components;
  for (std::vector<double>* columns : {&u_, &q, &r, &bias, &target, &nudges_, &begun_, &told_, &found_})
    columns->resize(c * lanes);
  for (std::vector<double>* blocks : {&w, &w_true_, &nudged_}) blocks->resize(c * c * lanes);
  params.resize(lanes);
  held_.resize(lanes);
}

void LawTangent::open_batch(std::int32_t batch, double share) {
  const cairn_batch& b = solid_.system.batches[batch];
  const int n = b.count, c = b.components;
  cairn_delassus(&solid_.schedule, batch, 0, w.data(), w_true_.data(), u_.data());
  if (b.hub) std::copy_n(w_true_.data(), c * c * n, w.data());
  for (int k = 0; k < c; ++k)
    for (int lane = 0; lane < n; ++lane) {
      const int i = k * n + lane;
      r[i] = at(b, b.r, lane, k);
      bias[i] = b.pack && k > 0 ? 0 : at(b, b.bias, lane, k);
      q[i] = u_[i] + bias[i];
      if (b.compliance) q[i] += b.compliance[i] * r[i];      // which u does not have in it
      if (b.compliance) w[k * c * n + i] += b.compliance[i]; // (lane, k, k)
    }
  for (int i = 0; i < c * c * n; ++i) w[i] *= share;
  for (int l = 0; l < c; ++l)
    for (int k = 0; k < c; ++k)
      for (int lane = 0; lane < n; ++lane) q[k * n + lane] -= w[(l * c + k) * n + lane] * r[l * n + lane];
  for (double* column : {q.data(), r.data(), bias.data()}) repeat_last(b, column, c);
  repeat_last(b, w.data(), c * c);
  for (int lane = 0; lane < n; ++lane) params[lane] = law_infos()[b.law].has_solve ? 0 : at(b, b.params, lane, 0);
  repeat_last(b, params.data(), 1);
}

double LawTangent::fastest() {
  double speed = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    open_batch(std::int32_t(k), stiffer);
    for (int c = 0; c < std::min(solid_.system.dim, b.components); ++c)
      for (int lane = 0; lane < b.contacts; ++lane)
        if (bias[lane] < never()) speed = std::max(speed, std::abs(q[c * b.count + lane]));
  }
  return speed;
}

void LawTangent::linearise(double yielding) {
  size_columns();
  const double speed = fastest();
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    open_batch(std::int32_t(k), stiffer);
    const cairn_batch& b = solid_.system.batches[k];
    // velocities of the solid move a law beside its compliance, whose part in q goes with the impulse
    eliminated_ = w;
    for (int i = 0; b.compliance && i < b.components * b.count; ++i)
      eliminated_[std::size_t(i / b.count) * std::size_t(b.components * b.count) + std::size_t(i)] -= b.compliance[i];
    respond(std::int32_t(k), {w.data(), q.data(), r.data(), bias.data(), params.data()}, speed, eliminated_.data(),
            yielding);
  }
}

void LawTangent::ask(const cairn_batch& b, const Question& with, double* impulse) const {
  const bool own = law_infos()[b.law].has_solve;
  std::copy_n(with.begun, b.components * b.count, impulse);
  (own                      ? b.solve
   : solid_.system.dim == 2 ? cairn_cone_full2
                            : cairn_cone_full3)(b.count, b.components, with.block, with.velocity, with.bias,
                                                own ? b.params : with.params, b.state, impulse, nullptr);
}

void LawTangent::respond(std::int32_t batch, Question with, double speed, const double* eliminated, double yielding) {
  const cairn_batch& b = solid_.system.batches[batch];
  const int n = b.count, c = b.components, d = solid_.system.dim;
  ask(b, with, target.data());
  cairn_contact_nudges(n, c, std::min(c, d), with.block, with.velocity, with.begun, speed, nudges_.data());
  // bonds that hold fast are asked at rest, so that their response has only rounding errors
  for (int lane = 0; lane < n; ++lane) held_[lane] = yielding > 0 && bond_holds(b, lane);
  for (int i = 0; i < c * n; ++i) begun_[i] = held_[i % n] ? 0 : with.velocity[i];
  std::copy_n(begun_.data(), c * n, told_.data());
  with.velocity = told_.data();
  for (int l = 0; l < c; ++l) {
    for (int i = l * n; i < (l + 1) * n; ++i) told_[i] = begun_[i] + nudges_[i], nudges_[i] = told_[i] - begun_[i];
    ask(b, with, nudged_.data() + std::size_t(l) * std::size_t(c * n));
    std::copy_n(&begun_[l * n], n, &told_[l * n]);
  }
  const std::vector<SolidSystem::Contact>& contacts = solid_.contacts();
  const auto begins = std::lower_bound(contacts.begin(), contacts.end(), batch,
                                       [](const SolidSystem::Contact& x, std::int32_t y) { return x.batch < y; });
  const std::size_t first = std::size_t(begins - contacts.begin());
  found_.resize(std::size_t(c) * std::size_t((c + 1) * n));
  cairn_contact_responses(n, c, b.contacts, yielding, held_.data(), eliminated, with.begun, target.data(),
                          nudged_.data(), nudges_.data(), found_.data(), found_.data() + c * c * n);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const SolidSystem::Contact& contact = contacts[first + std::size_t(lane)];
    const bool moves = with.bias[lane] < never();
    for (int k = 0; k < c * c; ++k)
      solid_.answer[contact.answer + std::size_t(k)] = moves ? found_[c * c * lane + k] : 0;
    for (int k = 0; k < c; ++k)
      solid_.known[contact.known + std::size_t(k)] = moves ? found_[c * c * n + c * lane + k] : 0;
    // Friction of a contact that gives way follows its normal force a pass later; elsewhere sweeps find it as fast.
    const double* answer = &found_[c * c * lane];
    if (!(yielding > 0 && moves && b.compliance && b.compliance[lane] > 0 && answer[0] > 0)) continue;
    if (std::any_of(answer + 1, answer + c * c, [](double x) { return x != 0; })) continue;
    for (int k = 1; k < c; ++k)
      solid_.known[contact.known + std::size_t(k)] = target[k * n + lane] - with.begun[k * n + lane];
  }
}

} // namespace cairn
