#include "step_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"

namespace cairn {

std::string StepProblem::obstacle(const ContactSystem& system) {
  for (const cairn_batch& b : system.batches)
    if (law_infos()[b.law].has_solve)
      return "contacts of law " + law_infos()[b.law].python_name +
             " have a local solution of their own, and a problem holds Coulomb's cones alone";
  return {};
}

StepProblem::StepProblem(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free)
    : system_(system) {
  problem_.dim = system.dim;
  problem_.bodies = std::make_shared<ContactBodies>();
  problem_.bodies->dofs = system.velocities();
  choose_contacts();
  number_bodies();
  fill_rows();
  system.load(velocity_free);
  fill_velocities(schedule);
  keep_diagonal();
}

void StepProblem::choose_contacts() {
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    for (int lane = 0; lane < b.contacts; ++lane)
      if (at(b, b.bias, lane, 0) < never()) places_.push_back({std::int32_t(k), lane});
  }
  problem_.contacts = std::int64_t(places_.size());
}

void StepProblem::number_bodies() {
  ContactBodies& bodies = *problem_.bodies;
  number_.assign(std::size_t(system_.bodies) + 1, -1);
  bodies.body.resize(2 * places_.size());
  const std::size_t size = std::size_t(bodies.dofs) * bodies.dofs;
  for (std::size_t a = 0; a < places_.size(); ++a) {
    const cairn_batch& b = system_.batches[places_[a].batch];
    const int lane = places_[a].lane;
    const std::int32_t who[2] = {b.body_a[lane], b.body_b[lane]};
    // condensed bodies are not numbered: their coupling is added to W
    const bool moves[2] = {b.moves_a != 0 && b.mapped_a == 0, b.moves_b != 0 && b.mapped_b == 0};
    for (int side = 0; side < 2; ++side) {
      if (moves[side] && number_[who[side]] < 0) {
        number_[who[side]] = std::int32_t(bodies.count++);
        bodies.mass.resize(size * bodies.count);
        bodies.inverse.resize(size * bodies.count);
        const std::size_t first = size * (bodies.count - 1);
        body_mass(system_, who[side], &bodies.mass[first], &bodies.inverse[first]);
      }
      bodies.body[2 * a + side] = moves[side] ? number_[who[side]] : -1;
    }
  }
  bodies.velocity.resize(std::size_t(bodies.dofs) * bodies.count);
}

void StepProblem::fill_rows() {
  ContactBodies& bodies = *problem_.bodies;
  const int d = system_.dim, n = bodies.dofs;
  bodies.rows.assign(std::size_t(2) * d * n * places_.size(), 0.0);
  problem_.mu.resize(places_.size());
  for (std::size_t a = 0; a < places_.size(); ++a) {
    const cairn_batch& b = system_.batches[places_[a].batch];
    const int lane = places_[a].lane;
    problem_.mu[a] = at(b, b.params, lane, 0);
    for (int side = 0; side < 2; ++side)
      if (const std::int32_t who = bodies.body[2 * a + side]; who >= 0)
        rigid_rows(system_, b, lane, side, d, &bodies.inverse[std::size_t(n) * n * who],
                   &bodies.rows[(2 * a + side) * d * n]);
  }
}

void StepProblem::fill_velocities(const cairn_schedule& schedule) {
  const int d = system_.dim;
  problem_.q.resize(std::size_t(d) * places_.size());
  std::int32_t batch = -1;
  double u[6 * 128];
  for (std::size_t a = 0; a < places_.size(); ++a) {
    const cairn_batch& b = system_.batches[places_[a].batch];
    const int lane = places_[a].lane;
    if (places_[a].batch != batch) cairn_relative_velocities(&schedule, batch = places_[a].batch, 0, u);
    for (int c = 0; c < d; ++c)
      problem_.q[d * a + c] = u[c * b.count + lane] + (b.pack && c > 0 ? 0 : at(b, b.bias, lane, c));
  }
}

void StepProblem::keep_diagonal() {
  const std::int64_t n = problem_.contacts;
  problem_.row_start.resize(n + 1);
  problem_.column.resize(n);
  for (std::int64_t a = 0; a < n; ++a) {
    problem_.row_start[a + 1] = a + 1;
    problem_.column[a] = std::int32_t(a);
  }
  const ContactBodies& b = *problem_.bodies;
  problem_.block.resize(std::size_t(problem_.dim) * problem_.dim * n);
  cairn_body_blocks(problem_.dim, b.dofs, n, b.count, b.body.data(), b.rows.data(), b.inverse.data(),
                    problem_.row_start.data(), problem_.column.data(), problem_.block.data());
  add_condensed();
}

std::int32_t StepProblem::group(std::int64_t contact, int side) const {
  const Place& place = places_[contact];
  const cairn_batch& b = system_.batches[place.batch];
  if (side ? b.mapped_b : b.mapped_a)
    return std::int32_t(problem_.bodies->count) + (side ? b.body_b : b.body_a)[place.lane];
  return problem_.bodies->body[2 * contact + side];
}

std::vector<std::vector<std::int32_t>> StepProblem::contacts_of_bodies() const {
  std::vector<std::vector<std::int32_t>> of(problem_.bodies->count + system_.condensed.size());
  for (std::int64_t a = 0; a < problem_.contacts; ++a)
    for (int side = 0; side < 2; ++side) {
      const std::int32_t who = group(a, side);
      if (who >= 0) of[who].push_back(std::int32_t(a));
    }
  return of;
}

double StepProblem::bytes() const {
  if (system_.reaches) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const auto& contacts : contacts_of_bodies()) sum += double(contacts.size()) * double(contacts.size());
  return 8.0 * system_.dim * system_.dim * sum;
}

// The diagonal gets the compliance of contacts; block (a, b) gets e_a' C e_b, C the compliance between the two points
// of the body, weighted over their nodes.
void StepProblem::add_condensed() {
  const int d = system_.dim;
  for (std::int64_t a = 0; a < problem_.contacts && system_.compliant; ++a) {
    const cairn_batch& b = system_.batches[places_[a].batch];
    const auto first = problem_.column.begin();
    const auto own =
        std::find(first + problem_.row_start[a], first + problem_.row_start[a + 1], std::int32_t(a)) - first;
    for (int k = 0; k < d && b.compliance; ++k)
      problem_.block[std::size_t(d) * d * own + (d + 1) * k] += b.compliance[k * b.count + places_[a].lane];
  }
  if (system_.condensed.empty()) return;
  const auto mapped = [&](std::int64_t contact, int side) {
    const cairn_batch& b = system_.batches[places_[contact].batch];
    return (side ? b.mapped_b : b.mapped_a) != 0;
  };
  for (std::int64_t a = 0; a < problem_.contacts; ++a)
    for (std::int64_t e = problem_.row_start[a]; e < problem_.row_start[a + 1]; ++e) {
      const std::int64_t other = problem_.column[e];
      for (int side = 0; side < 4; ++side) {
        const int of_a = side & 1, of_b = side >> 1;
        if (!mapped(a, of_a) || !mapped(other, of_b) || group(a, of_a) != group(other, of_b)) continue;
        const Place &here = places_[a], &there = places_[other];
        const cairn_batch &b = system_.batches[here.batch], &c = system_.batches[there.batch];
        const cairn_condensed& body = system_.condensed_dofs[(of_a ? b.body_b : b.body_a)[here.lane]];
        double axes[3][3], axes_other[3][3], between[3][3] = {};
        axes_of(b, d, here.lane, axes);
        axes_of(c, d, there.lane, axes_other);
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j < 4; ++j) {
            const double weight = (of_a ? b.lever_b : b.lever_a)[i * b.count + here.lane] *
                                  (of_b ? c.lever_b : c.lever_a)[j * c.count + there.lane];
            if (!(weight > 0 || weight < 0)) continue;
            double of_nodes[9]; // by columns
            cairn_condensed_block(d, &body, (of_a ? b.node_b : b.node_a)[i * b.count + here.lane],
                                  (of_b ? c.node_b : c.node_a)[j * c.count + there.lane], of_nodes);
            for (int k = 0; k < d; ++k)
              for (int l = 0; l < d; ++l) between[k][l] += weight * of_nodes[d * l + k];
          }
        double* block = &problem_.block[std::size_t(d) * d * e];
        const double sign = of_a == of_b ? 1 : -1;
        for (int k = 0; k < d; ++k)
          for (int l = 0; l < d; ++l)
            for (int p = 0; p < d; ++p)
              for (int q = 0; q < d; ++q) block[d * l + k] += sign * axes[k][p] * between[p][q] * axes_other[l][q];
      }
    }
}

void StepProblem::form_blocks() {
  const auto of = contacts_of_bodies();
  std::vector<std::int32_t> row;
  problem_.column.clear();
  for (std::int64_t a = 0; a < problem_.contacts; ++a) {
    row.assign(1, std::int32_t(a));
    for (int side = 0; side < 2; ++side) {
      const std::int32_t who = group(a, side);
      if (who >= 0) row.insert(row.end(), of[who].begin(), of[who].end());
    }
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    problem_.column.insert(problem_.column.end(), row.begin(), row.end());
    problem_.row_start[a + 1] = std::int64_t(problem_.column.size());
  }
  const ContactBodies& b = *problem_.bodies;
  problem_.block.resize(std::size_t(problem_.dim) * problem_.dim * problem_.column.size());
  cairn_body_blocks(problem_.dim, b.dofs, problem_.contacts, b.count, b.body.data(), b.rows.data(), b.inverse.data(),
                    problem_.row_start.data(), problem_.column.data(), problem_.block.data());
  add_condensed();
  problem_.bodies.reset();
}

void StepProblem::read(double* r) const {
  for (const Place& place : places_) {
    const cairn_batch& b = system_.batches[place.batch];
    for (int c = 0; c < system_.dim; ++c) *r++ = at(b, b.r, place.lane, c);
  }
}

void StepProblem::write(const double* r) {
  for (const Place& place : places_) {
    const cairn_batch& b = system_.batches[place.batch];
    for (int c = 0; c < system_.dim; ++c) at(b, b.r, place.lane, c) = *r++;
  }
}

void StepProblem::write_velocities(const Velocities& velocity_free, const Array<double>& change) {
  const int n = system_.velocities();
  if (change.empty()) return;
  for (std::int64_t b = 0; b < system_.bodies; ++b)
    for (int k = 0; k < n && number_[b] >= 0; ++k)
      system_.record[b].x[k] = velocity_free.bodies[b][k] + change[std::size_t(n) * number_[b] + k];
}

} // namespace cairn
