#include "jointed_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"

namespace cairn {
namespace {

// Columns of parameters and state of the law, from 0: see joint.f90.
constexpr int p_lowest = 5, p_highest = 6, p_speed = 7, p_effort = 8, p_h = 16, s_along = 7, s_drag = 8, s_pull = 9,
              s_across = 11;
constexpr double machine_epsilon = std::numeric_limits<double>::epsilon();

bool joins(const cairn_batch& b) { return law_infos()[std::size_t(b.law)].joins; }

} // namespace

bool JointedProblem::needed(const ContactSystem& system) {
  return std::any_of(system.batches.begin(), system.batches.end(), joins);
}

std::string JointedProblem::obstacle(const ContactSystem& system) {
  for (const cairn_batch& b : system.batches)
    if (const LawInfo& law = law_infos()[std::size_t(b.law)]; law.has_solve && !law.joins)
      return "contacts of law " + law.python_name +
             " have a local solution of their own, and a problem holds Coulomb's cones and joints alone";
  return {};
}

JointedProblem::JointedProblem(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free)
    : system_(system), schedule_(schedule), of_body_(std::size_t(system.bodies) + 1 + system.condensed.size()),
      number_(std::size_t(system.bodies) + 1, -1) {
  problem_.dim = system.dim;
  take_contacts();
  for (std::size_t k = 0; k < system_.batches.size(); ++k)
    for (int lane = 0; joins(system_.batches[k]) && lane < system_.batches[k].contacts; ++lane)
      take_joint({std::int32_t(k), lane});
  system_.load(velocity_free);
  read_velocities(schedule, q_);
  for (Equality& e : blocked_) e.q = q_[std::size_t(e.row)];
  cairn_add_impulses(&schedule);
  pose_what_acts();
}

const cairn_batch& JointedProblem::batch(Place place) const { return system_.batches[std::size_t(place.batch)]; }

void JointedProblem::take_contacts() {
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    for (int lane = 0; !joins(b) && lane < b.contacts; ++lane) {
      if (!(at(b, b.bias, lane, 0) < never())) continue;
      contacts_.push_back({std::int32_t(k), lane});
      for (int c = 0; c < system_.dim; ++c) add_row(contacts_.back(), c);
    }
  }
}

void JointedProblem::take_joint(Place place) {
  const cairn_batch& b = batch(place);
  const int lane = place.lane, blocked = int(b.params[joint_blocked * b.count + lane]),
            coordinate = int(b.params[joint_coordinate * b.count + lane]) - 1;
  if (!(b.state[lane] > 0) || !(at(b, b.bias, lane, 0) < never())) return;
  const double across = b.params[joint_spans * b.count + lane] > 0 ? b.state[s_across * b.count + lane] : 0;
  for (int c = 0; c < b.components; ++c) {
    const bool drags = across > 0 && c > 0 && c < system_.dim, holds = drags || blocked >> c & 1;
    if (!holds && c != coordinate) continue;
    const std::int32_t row = add_row(place, c);
    gather(row);
    if (!(sum_[std::size_t(row)] > 0 && b.delassus[(c * b.components + c) * b.count + lane] > 0))
      continue; // nothing moves along it
    if (holds)
      blocked_.push_back({row, drags ? 1 / across : 0, 0, place, c});
    else
      take_coordinate(place, c, row);
  }
}

void JointedProblem::take_coordinate(Place place, int component, std::int32_t row) {
  const cairn_batch& b = batch(place);
  const auto param = [&](int k) { return b.params[k * b.count + place.lane]; };
  const auto state = [&](int k) { return b.state[k * b.count + place.lane]; };
  const double h = param(p_h), x = state(s_along);
  coordinates_.push_back({.place = place,
                          .component = component,
                          .row = row,
                          .low = (param(p_lowest) - x) / h,
                          .high = (param(p_highest) - x) / h,
                          .speed = param(p_speed),
                          .effort = h * param(p_effort),
                          .drag = state(s_drag),
                          .pull = state(s_pull)});
}

// One component of a contact or joint, by the bodies that move along it.
std::int32_t JointedProblem::add_row(Place place, int component) {
  row_place_.push_back({place, component});
  of_row_.emplace_back();
  sum_.push_back(0);
  ++rows_;
  const cairn_batch& b = batch(place);
  for (int side = 0; side < 2; ++side) {
    if (is_mapped(b, side))
      add_mapped(place, side, component);
    else if (moves_rigid(b, side))
      add_rigid(place, side, component);
  }
  if (b.rope && component == 0) add_rope(place);
  return rows_ - 1;
}

std::int32_t JointedProblem::rigid(std::int32_t body) {
  const auto n = std::size_t(system_.velocities());
  std::int32_t& number = number_[std::size_t(body)];
  if (number < 0) {
    number = std::int32_t(inverse_.size() / (n * n));
    double mass[36], inverse[36];
    body_mass(system_, body, mass, inverse);
    inverse_.insert(inverse_.end(), inverse, inverse + n * n);
  }
  return number;
}

// Room for so many numbers of the last row that is there.
double* JointedProblem::part_of(std::int32_t body, int dofs) {
  const Part part{rows_ - 1, dofs, value_.size()};
  of_body_[std::size_t(body)].push_back(part);
  of_row_.back().push_back({body, part});
  for (std::vector<double>* numbers : {&value_, &answer_}) numbers->resize(part.begin + std::size_t(dofs), 0.0);
  dof_.resize(part.begin + std::size_t(dofs), 0);
  return &value_[part.begin];
}

void JointedProblem::add_rigid(Place place, int side, int component) {
  const cairn_batch& b = batch(place);
  const int n = system_.velocities(), c = b.components;
  const std::int32_t body = (side ? b.body_b : b.body_a)[place.lane];
  const std::size_t first = std::size_t(n) * std::size_t(n) * std::size_t(rigid(body));
  const double* inverse = &inverse_[first];
  double rows[36];
  rigid_rows(system_, b, place.lane, side, c, inverse, rows);
  const std::size_t begin = std::size_t(part_of(body, n) - value_.data());
  for (int k = 0; k < n; ++k) value_[begin + std::size_t(k)] = rows[c * k + component];
  for (int k = 0; k < n; ++k)
    for (int l = 0; l < n; ++l) answer_[begin + std::size_t(k)] += inverse[n * l + k] * rows[c * l + component];
}

// A rope pulls the body at its far end (0) and that of its pulley by its far part (1).
void JointedProblem::add_rope(Place place) {
  const cairn_batch& b = batch(place);
  const int n = system_.velocities();
  for (int end = 0; end < 2; ++end) {
    if (!moves_by_rope(b, place.lane, end)) continue;
    const std::int32_t body = b.rope_body[2 * place.lane + end];
    const std::size_t first = std::size_t(n) * std::size_t(n) * std::size_t(rigid(body));
    const double *row = b.rope + rope_numbers * place.lane + 2 + 12 * end, *inverse = &inverse_[first];
    const std::size_t begin = std::size_t(part_of(body, n) - value_.data());
    for (int k = 0; k < n; ++k) {
      if (inverse[(n + 1) * k] > 0) value_[begin + std::size_t(k)] = row[k];
      answer_[begin + std::size_t(k)] = row[6 + k];
    }
  }
}

void JointedProblem::add_mapped(Place place, int side, int component) {
  const cairn_batch& b = batch(place);
  const int d = system_.dim, lane = place.lane;
  if (component >= d) return; // nodes do not turn
  double axes[3][3];
  axes_of(b, d, lane, axes);
  const double *weights = side ? b.lever_b : b.lever_a, sign = side ? -1 : 1;
  const std::int32_t *nodes = side ? b.node_b : b.node_a, body = (side ? b.body_b : b.body_a)[lane];
  const int count = side ? b.nodes_b : b.nodes_a;
  const std::size_t begin = std::size_t(part_of(std::int32_t(system_.bodies) + 1 + body, d * count) - value_.data());
  for (int node = 0; node < count; ++node)
    for (int k = 0; k < d; ++k) {
      dof_[begin + std::size_t(d * node + k)] = d * nodes[node * b.count + lane] + k;
      value_[begin + std::size_t(d * node + k)] = sign * weights[node * b.count + lane] * axes[component][k];
    }
}

// Velocity along the row of part a per unit impulse along the row of part b, through the same body.
double JointedProblem::between(std::int32_t body, const Part& a, const Part& b) const {
  double sum = 0;
  const double *one = &value_[a.begin], *other = &value_[b.begin];
  if (body <= system_.bodies) {
    for (std::int32_t k = 0; k < a.count; ++k) sum += one[k] * answer_[b.begin + std::size_t(k)];
    return sum;
  }
  const cairn_condensed& c = system_.condensed_dofs[std::size_t(body - system_.bodies - 1)];
  const int d = system_.dim;
  double block[9]; // between the nodes that were asked for last
  std::int32_t row = -1, column = -1;
  for (std::int32_t l = 0; l < b.count; ++l)
    for (std::int32_t k = 0; k < a.count && (other[l] < 0 || other[l] > 0); ++k) {
      const std::int32_t i = dof_[a.begin + std::size_t(k)], j = dof_[b.begin + std::size_t(l)];
      if (i / d != row || j / d != column) cairn_condensed_block(d, &c, row = i / d, column = j / d, block);
      sum += one[k] * other[l] * block[d * (j % d) + i % d];
    }
  return sum;
}

// W between a row and all others, in sum_ at those that are touched.
void JointedProblem::gather(std::int32_t row) {
  for (const std::int32_t other : touched_) sum_[std::size_t(other)] = 0;
  touched_.clear();
  for (const auto& [body, part] : of_row_[std::size_t(row)])
    for (const Part& other : of_body_[std::size_t(body)]) {
      touched_.push_back(other.row);
      sum_[std::size_t(other.row)] += between(body, part, other);
    }
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
}

void JointedProblem::read_velocities(const cairn_schedule& schedule, std::vector<double>& u) const {
  u.resize(std::size_t(rows_));
  std::int32_t now = -1;
  double of_batch[6 * 128];
  for (std::size_t row = 0; row < u.size(); ++row) {
    const auto& [place, c] = row_place_[row];
    const cairn_batch& b = batch(place);
    if (place.batch != now) cairn_relative_velocities(&schedule, now = place.batch, 0, of_batch);
    u[row] = of_batch[c * b.count + place.lane] + (b.pack && c > 0 ? 0 : at(b, b.bias, place.lane, c));
  }
}

void JointedProblem::pose(std::int32_t coordinate, Pose pose) {
  Coordinate& c = coordinates_[std::size_t(coordinate)];
  bool& posed = pose == Pose::motor ? c.motor_posed : pose == Pose::low ? c.low_posed : c.high_posed;
  const bool ends =
      pose == Pose::motor ? c.effort > 0 && std::isfinite(c.effort) : std::isfinite(pose == Pose::low ? c.low : c.high);
  if (posed || !ends || c.locked()) return;
  posed = true;
  posed_.push_back({coordinate, pose});
}

void JointedProblem::pose_all() {
  for (std::int32_t k = 0; k < std::int32_t(coordinates_.size()); ++k)
    for (const Pose one : {Pose::low, Pose::high, Pose::motor}) pose(k, one);
}

// Poses the motors and limits that the impulses at hand activate: an impulse beyond a motor's effort is a limit's.
void JointedProblem::pose_what_acts() {
  std::vector<double> u;
  read_velocities(schedule_, u);
  for (std::int32_t k = 0; k < std::int32_t(coordinates_.size()); ++k) {
    const Coordinate& c = coordinates_[std::size_t(k)];
    const cairn_batch& b = batch(c.place);
    const double r = at(b, b.r, c.place.lane, c.component);
    const double dragged = c.drag * u[std::size_t(c.row)], beside = r + dragged + c.pull;
    const double rounding = 64 * machine_epsilon * (std::abs(r) + std::abs(dragged) + std::abs(c.pull));
    if (c.driven() && c.overburdens(beside, 1 - 0x1p-30)) pose(k, Pose::motor);
    if (c.driven()) continue;
    if (beside > c.effort + rounding) pose(k, Pose::low);
    if (beside < -c.effort - rounding) pose(k, Pose::high);
  }
}

bool JointedProblem::amend() {
  constexpr double slack = 64 * machine_epsilon;
  std::vector<double> u;
  read_velocities(schedule_, u);
  const std::size_t before = posed_.size();
  double speed = 0; // which velocities are rounded by
  for (const double x : q_) speed = std::max(speed, std::abs(x) < never() ? std::abs(x) : 0);
  for (std::int32_t k = 0; k < std::int32_t(coordinates_.size()); ++k) {
    const Coordinate& c = coordinates_[std::size_t(k)];
    if (c.locked()) continue;
    if (c.driven()) {
      if (c.overburdens(impulse_[std::size_t(c.held)], 1 + slack)) pose(k, Pose::motor);
      continue;
    }
    const double now = u[std::size_t(c.row)], little = slack * (speed + std::abs(now));
    if (now > c.high + little + slack * std::abs(c.high)) pose(k, Pose::high);
    if (now < c.low - little - slack * std::abs(c.low)) pose(k, Pose::low);
  }
  return posed_.size() > before;
}

void JointedProblem::read(Array<double>& r) const {
  const int d = system_.dim;
  const std::size_t had = r.size();
  r.resize(std::size_t(d) * std::size_t(contacts()));
  for (std::size_t a = 0; had == 0 && a < contacts_.size(); ++a)
    for (int c = 0; c < d; ++c)
      r[std::size_t(d) * a + std::size_t(c)] = at(batch(contacts_[a]), batch(contacts_[a]).r, contacts_[a].lane, c);
  for (std::size_t k = 0; k < posed_.size(); ++k) {
    const std::size_t first = std::size_t(d) * (contacts_.size() + k);
    if (first < had) continue;
    std::fill_n(&r[first], d, 0.0);
    if (posed_[k].pose == Pose::motor) r[first] = coordinates_[std::size_t(posed_[k].coordinate)].effort;
  }
}

void JointedProblem::write(const double* r) {
  const auto d = std::size_t(system_.dim);
  for (std::size_t a = 0; a < contacts_.size(); ++a)
    for (std::size_t c = 0; c < d; ++c)
      at(batch(contacts_[a]), batch(contacts_[a]).r, contacts_[a].lane, int(c)) = r[d * a + c];
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; joins(b) && lane < b.contacts; ++lane)
      for (int c = 0; c < b.components; ++c) at(b, b.r, lane, c) = 0;
  impulse_.resize(equalities_.size());
  for (std::size_t e = 0; e < equalities_.size(); ++e) impulse_[e] = -equalities_[e].q;
  for (std::size_t i = 0; i < pulls_.size(); ++i)
    for (const auto& [e, pull] : pulls_[i]) impulse_[std::size_t(e)] -= pull * r[i];
  held_->solve(impulse_.data(), 1);
  for (std::size_t e = 0; e < equalities_.size(); ++e)
    at(batch(equalities_[e].place), batch(equalities_[e].place).r, equalities_[e].place.lane,
       equalities_[e].component) += impulse_[e];
  for (std::size_t k = 0; k < posed_.size(); ++k) {
    const Coordinate& c = coordinates_[std::size_t(posed_[k].coordinate)];
    const double* own = r + d * (contacts_.size() + k);
    at(batch(c.place), batch(c.place).r, c.place.lane, c.component) += posed_[k].pose == Pose::motor ? own[1]
                                                                       : posed_[k].pose == Pose::low ? own[0]
                                                                                                     : -own[0];
  }
}

} // namespace cairn
