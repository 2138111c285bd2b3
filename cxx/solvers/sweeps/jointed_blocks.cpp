// W and q of contacts among bodies that joints hold: the equalities of the joints are eliminated.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "batch.hpp"
#include "jointed_problem.hpp"

namespace cairn {

bool JointedProblem::hold() {
  problem_.contacts = contacts();
  problem_.q.assign(std::size_t(problem_.unknowns()), 0.0);
  list_equalities();
  list_uses();
  held_.emplace(form_held());
  return held_->factored();
}

bool JointedProblem::undo_errors(const std::function<bool(const cairn_batch&, int)>& moves,
                                 const std::function<double(const cairn_batch&, int)>& off) {
  equalities_.clear();
  uses_.assign(std::size_t(rows_), {});
  for (const Equality& e : blocked_) {
    if (e.compliance > 0) continue;
    const cairn_batch& b = batch(e.place);
    const int error = system_.dim == 2 && e.component == 2 ? 4 : 1 + e.component; // in the state: see joint.f90
    uses_[std::size_t(e.row)].push_back({std::int32_t(equalities_.size()), 1});
    equalities_.push_back(e);
    equalities_.back().q =
        moves(b, e.place.lane) ? b.state[error * b.count + e.place.lane] / b.params[16 * b.count + e.place.lane] : 0;
  }
  for (const Coordinate& c : coordinates_) {
    const cairn_batch& b = batch(c.place);
    const double q = off(b, c.place.lane) / b.params[16 * b.count + c.place.lane];
    if (!(std::abs(q) > 0) || !moves(b, c.place.lane)) continue;
    uses_[std::size_t(c.row)].push_back({std::int32_t(equalities_.size()), 1});
    equalities_.push_back({c.row, 0, q, c.place, c.component});
  }
  if (equalities_.empty()) return false;
  held_.emplace(form_held());
  if (!held_->factored()) return false;
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int c = 0; c < (b.pack ? system_.dim : b.components); ++c) at(b, b.r, lane, c) = 0;
  impulse_.resize(equalities_.size());
  for (std::size_t e = 0; e < equalities_.size(); ++e) impulse_[e] = -equalities_[e].q;
  held_->solve(impulse_.data(), 1);
  for (std::size_t e = 0; e < equalities_.size(); ++e)
    at(batch(equalities_[e].place), batch(equalities_[e].place).r, equalities_[e].place.lane,
       equalities_[e].component) = impulse_[e];
  return true;
}

void JointedProblem::form() {
  form_pattern();
  fill_blocks();
  eliminate();
  settle_diagonal();
}

// Springs are those of a compliance; a motor that has the power, and limits that leave no room, give a velocity.
void JointedProblem::list_equalities() {
  equalities_ = blocked_;
  for (Coordinate& c : coordinates_) {
    const double q = q_[std::size_t(c.row)];
    c.held = -1;
    if (c.drag > 0) equalities_.push_back({c.row, 1 / c.drag, q + c.pull / c.drag, c.place, c.component});
    if (!c.locked() && !c.driven()) continue;
    c.held = std::int32_t(equalities_.size());
    equalities_.push_back({c.row, 0, q - (c.locked() ? c.low : c.target()), c.place, c.component});
  }
}

void JointedProblem::list_uses() {
  const int d = system_.dim;
  uses_.assign(std::size_t(rows_), {});
  problem_.mu.assign(std::size_t(contacts()), 0.0);
  for (std::size_t a = 0; a < contacts_.size(); ++a) {
    const cairn_batch& b = batch(contacts_[a]);
    problem_.mu[a] = at(b, b.params, contacts_[a].lane, 0);
    for (int c = 0; c < d; ++c) {
      const std::size_t row = std::size_t(d) * a + std::size_t(c);
      uses_[row].push_back({std::int32_t(row), 1});
      problem_.q[row] = q_[row];
    }
  }
  for (std::size_t k = 0; k < posed_.size(); ++k) {
    const Coordinate& c = coordinates_[std::size_t(posed_[k].coordinate)];
    const std::size_t contact = contacts_.size() + k, row = std::size_t(d) * contact;
    const double q = q_[std::size_t(c.row)];
    if (posed_[k].pose == Pose::motor) {
      uses_[std::size_t(c.row)].push_back({std::int32_t(row + 1), 1});
      problem_.q[row + 1] = q - c.speed;
      problem_.mu[contact] = 1;
    } else {
      const bool low = posed_[k].pose == Pose::low;
      uses_[std::size_t(c.row)].push_back({std::int32_t(row), low ? 1.0 : -1.0});
      problem_.q[row] = low ? q - c.low : c.high - q;
    }
  }
  for (std::size_t e = 0; e < equalities_.size(); ++e)
    uses_[std::size_t(equalities_[e].row)].push_back({std::int32_t(problem_.unknowns()) + std::int32_t(e), 1});
}

// S, and what the rows of the problem have in common with the equalities.
HeldRows JointedProblem::form_held() {
  const auto m = std::int32_t(problem_.unknowns());
  pulls_.assign(std::size_t(m), {});
  SparseMatrix s;
  s.n = std::int64_t(equalities_.size());
  std::vector<std::pair<std::int32_t, double>> column;
  for (std::int32_t e = 0; e < std::int32_t(equalities_.size()); ++e) {
    gather(equalities_[std::size_t(e)].row);
    column.clear();
    for (const std::int32_t other : touched_)
      for (const Use& use : uses_[std::size_t(other)]) {
        const double w = use.sign * sum_[std::size_t(other)];
        if (use.at < m)
          pulls_[std::size_t(use.at)].push_back({e, w});
        else if (use.at - m >= e)
          column.push_back({use.at - m, w + (use.at - m == e ? equalities_[std::size_t(e)].compliance : 0)});
      }
    std::sort(column.begin(), column.end());
    for (const auto& [row, value] : column) {
      s.row.push_back(row);
      s.value.push_back(value);
    }
    s.start.push_back(std::int64_t(s.row.size()));
  }
  return HeldRows(std::move(s));
}

std::vector<std::vector<std::int32_t>> JointedProblem::groups() const {
  std::vector<std::vector<std::int32_t>> of(of_body_.size() + std::size_t(held_ ? held_->assemblies() : 0));
  const auto add = [&](std::size_t group, std::int32_t contact) {
    if (of[group].empty() || of[group].back() != contact) of[group].push_back(contact);
  };
  const int d = system_.dim;
  for (std::int32_t a = 0; a < contacts(); ++a) {
    const std::size_t beyond = std::size_t(a) < contacts_.size() ? 0 : std::size_t(a) - contacts_.size();
    const bool posed = std::size_t(a) >= contacts_.size();
    for (int c = 0; c < (posed ? 1 : d); ++c) {
      const auto row =
          posed ? std::size_t(coordinates_[std::size_t(posed_[beyond].coordinate)].row) : std::size_t(d * a + c);
      for (const auto& [body, part] : of_row_[row]) add(std::size_t(body), a);
    }
    for (int c = 0; c < d && held_; ++c)
      for (const auto& [e, pull] : pulls_[std::size_t(d * a + c)])
        add(of_body_.size() + std::size_t(held_->assembly(e)), a);
  }
  return of;
}

double JointedProblem::bytes() const {
  if (system_.reaches) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const auto& group : groups()) sum += double(group.size()) * double(group.size());
  return 8.0 * system_.dim * system_.dim * sum;
}

void JointedProblem::form_pattern() {
  const auto of = groups();
  std::vector<std::vector<std::int32_t>> in; // groups of each contact
  in.resize(std::size_t(contacts()));
  for (std::size_t g = 0; g < of.size(); ++g)
    for (const std::int32_t a : of[g]) in[std::size_t(a)].push_back(std::int32_t(g));
  problem_.row_start.assign(1, 0);
  problem_.column.clear();
  std::vector<std::int32_t> row;
  for (std::int32_t a = 0; a < contacts(); ++a) {
    row.assign(1, a);
    for (const std::int32_t g : in[std::size_t(a)])
      row.insert(row.end(), of[std::size_t(g)].begin(), of[std::size_t(g)].end());
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    problem_.column.insert(problem_.column.end(), row.begin(), row.end());
    problem_.row_start.push_back(std::int64_t(problem_.column.size()));
  }
  problem_.block.assign(std::size_t(system_.dim) * std::size_t(system_.dim) * problem_.column.size(), 0.0);
}

double& JointedProblem::entry(std::int32_t row, std::int32_t column) {
  const int d = system_.dim;
  const auto first = problem_.column.begin();
  const auto found = std::lower_bound(first + problem_.row_start[std::size_t(row / d)],
                                      first + problem_.row_start[std::size_t(row / d) + 1], column / d);
  return problem_
      .block[std::size_t(d) * std::size_t(d) * std::size_t(found - first) + std::size_t(d * (column % d) + row % d)];
}

void JointedProblem::fill_blocks() {
  const auto m = std::int32_t(problem_.unknowns());
  for (std::int32_t row = 0; row < rows_; ++row) {
    const bool used = std::any_of(uses_[std::size_t(row)].begin(), uses_[std::size_t(row)].end(),
                                  [&](const Use& use) { return use.at < m; });
    if (!used) continue;
    gather(row);
    for (const std::int32_t other : touched_)
      for (const Use& here : uses_[std::size_t(row)])
        for (const Use& there : uses_[std::size_t(other)])
          if (here.at < m && there.at < m)
            entry(here.at, there.at) += here.sign * there.sign * sum_[std::size_t(other)];
  }
  for (std::size_t a = 0; a < contacts_.size(); ++a) {
    const cairn_batch& b = batch(contacts_[a]);
    for (int c = 0; c < system_.dim && b.compliance; ++c) {
      const auto row = std::int32_t(a) * system_.dim + c;
      entry(row, row) += b.compliance[c * b.count + contacts_[a].lane];
    }
  }
  plain_diagonal_.resize(std::size_t(m));
  for (std::int32_t i = 0; i < m; ++i) plain_diagonal_[std::size_t(i)] = entry(i, i);
}

// W - Y S^-1 Y', q - Y S^-1 q_G. Rows of different assemblies share a solution with S.
void JointedProblem::eliminate() {
  constexpr std::size_t together = 8;
  const std::size_t n = equalities_.size(), assemblies = std::size_t(held_->assemblies());
  if (n == 0) return;
  std::vector<double> x(n);
  for (std::size_t e = 0; e < n; ++e) x[e] = equalities_[e].q;
  held_->solve(x.data(), 1);
  for (std::size_t i = 0; i < pulls_.size(); ++i)
    for (const auto& [e, pull] : pulls_[i]) problem_.q[i] -= pull * x[std::size_t(e)];
  std::vector<std::size_t> next(assemblies, 0);
  std::vector<std::vector<std::int32_t>> owner; // of each right side, by assembly
  std::vector<std::int32_t> own;
  for (std::size_t i = 0; i < pulls_.size(); ++i) {
    own.clear();
    std::size_t slot = 0;
    for (const auto& [e, pull] : pulls_[i]) own.push_back(held_->assembly(e));
    for (const std::int32_t a : own) slot = std::max(slot, next[std::size_t(a)]);
    for (const std::int32_t a : own) {
      next[std::size_t(a)] = slot + 1;
      if (owner.size() <= slot) owner.resize(slot + 1, std::vector<std::int32_t>(assemblies, -1));
      owner[slot][std::size_t(a)] = std::int32_t(i);
    }
  }
  for (std::size_t first = 0; first < owner.size(); first += together) {
    const std::size_t count = std::min(together, owner.size() - first);
    x.assign(n * count, 0.0);
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t a = 0; a < assemblies; ++a)
        if (const std::int32_t i = owner[first + k][a]; i >= 0)
          for (const auto& [e, pull] : pulls_[std::size_t(i)]) x[n * k + std::size_t(e)] = pull;
    held_->solve(x.data(), std::int64_t(count));
    for (std::size_t k = 0; k < count; ++k) eliminate_together(owner[first + k], &x[n * k]);
  }
}

void JointedProblem::eliminate_together(const std::vector<std::int32_t>& owner, const double* x) {
  for (std::int32_t row = 0; row < std::int32_t(pulls_.size()); ++row)
    for (const auto& [e, pull] : pulls_[std::size_t(row)])
      if (const std::int32_t column = owner[std::size_t(held_->assembly(e))]; column >= 0)
        entry(row, column) -= pull * x[e];
}

FrictionProblem JointedProblem::in_order() const {
  const std::size_t n = std::size_t(contacts()), size = std::size_t(system_.dim) * std::size_t(system_.dim);
  std::vector<std::int32_t> from(n), to(n); // old and new numbers
  std::iota(from.begin(), from.end(), 0);
  std::sort(from.begin(), from.begin() + std::ptrdiff_t(contacts_.size()), [&](std::int32_t a, std::int32_t b) {
    const auto candidate = [&](const Place& p) { return system_.candidate[std::size_t(batch(p).first + p.lane)]; };
    return candidate(contacts_[std::size_t(a)]) < candidate(contacts_[std::size_t(b)]);
  });
  for (std::size_t k = 0; k < n; ++k) to[std::size_t(from[k])] = std::int32_t(k);
  FrictionProblem made = problem_;
  made.row_start.assign(1, 0);
  std::vector<std::pair<std::int32_t, std::int64_t>> row; // columns and their blocks
  std::size_t at_block = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto a = std::size_t(from[k]);
    made.mu[k] = problem_.mu[a];
    std::copy_n(&problem_.q[std::size_t(system_.dim) * a], system_.dim, &made.q[std::size_t(system_.dim) * k]);
    row.clear();
    for (std::int64_t e = problem_.row_start[a]; e < problem_.row_start[a + 1]; ++e)
      row.push_back({to[std::size_t(problem_.column[std::size_t(e)])], e});
    std::sort(row.begin(), row.end());
    for (const auto& [column, e] : row) {
      made.column[at_block] = column;
      std::copy_n(&problem_.block[size * std::size_t(e)], size, &made.block[size * at_block++]);
    }
    made.row_start.push_back(std::int64_t(at_block));
  }
  return made;
}

// Sets the diagonal of W for contacts on bodies that joints hold fast, where only rounding is left: a share of the
// diagonal of the bodies alone, since impulses there have no effect. The remaining rows without a diagonal are those of
// a limit's friction, which it has not, and of the pressure on a motor.
void JointedProblem::settle_diagonal() {
  constexpr double share = 0x1p-27;
  const int d = system_.dim;
  for (std::int32_t a = 0; a < contacts(); ++a) {
    const std::int32_t row = d * a;
    double* own = &entry(row, row); // the block of the contact, by columns
    const double* plain = &plain_diagonal_[std::size_t(row)];
    double largest = 0;
    for (int c = 0; c < d; ++c) largest = std::max(largest, plain[c]);
    for (int c = 0; c < d; ++c)
      own[(d + 1) * c] = std::max(own[(d + 1) * c], share * (plain[c] > 0 ? plain[c] : largest));
    if (std::size_t(a) < contacts_.size()) continue;
    const Posed& posed = posed_[std::size_t(a) - contacts_.size()];
    const int moves = posed.pose == Pose::motor ? 1 : 0;
    for (int c = 0; c < d; ++c) own[(d + 1) * c] = own[(d + 1) * moves];
    if (posed.pose == Pose::motor)
      problem_.q[std::size_t(row)] = -own[0] * coordinates_[std::size_t(posed.coordinate)].effort;
  }
}

} // namespace cairn
