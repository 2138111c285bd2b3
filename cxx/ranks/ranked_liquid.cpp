#include "ranked_liquid.hpp"

#include <algorithm>

#include "../fluid/fluid.hpp"
#include "../solvers/sweeps/contact_system.hpp"
#include "../strategies/nscd/contacts_beside_fluid.hpp"
#include "ranked_nscd.hpp"

namespace cairn {

void MeshesInLiquid::change() {
  if (!from_) return;
  std::swap(from_->simulation->meshes.meshes, to_.meshes.meshes);
  std::swap(from_->simulation->scene.nodes, to_.scene.nodes);
}

RankedLiquid::RankedLiquid() = default;
RankedLiquid::~RankedLiquid() = default;

bool RankedLiquid::flows_in(const Simulation& whole) { return whole.fluid && whole.fluid->incompressible(); }

bool RankedLiquid::is_of(const Simulation& whole, std::int64_t partition) const {
  if (partition != partition_) return false;
  bool same = true;
  std::size_t k = 0;
  whole.fluid->each_met_body([&](std::int64_t id) {
    same = same && k < met_.size() && met_[k] == id;
    ++k;
  });
  return same && k == met_.size();
}

void RankedLiquid::take(Simulation& whole, const Strategy& model, const std::vector<Part>& parts,
                        const std::vector<std::int32_t>& owner, int ranks, std::int64_t partition) {
  if (!whole.scene.bodies.force.active) whole.scene.activate(whole.scene.bodies.force.need); // the liquid's are added
  if (!is_of(whole, partition)) make(whole, model, parts, owner, ranks);
  partition_ = partition;
  bring(whole, copy_, Known::whole);
  pressed_ = false;
  copy_.simulation->fluid = std::move(whole.fluid);
}

void RankedLiquid::give_back(Simulation& whole) {
  if (copy_.simulation && copy_.simulation->fluid) whole.fluid = std::move(copy_.simulation->fluid);
}

void RankedLiquid::make(Simulation& whole, const Strategy& model, const std::vector<Part>& parts,
                        const std::vector<std::int32_t>& owner, int ranks) {
  met_.clear();
  whole.fluid->each_met_body([&](std::int64_t id) { met_.push_back(id); });
  std::vector<std::int32_t> bodies;
  for (const std::int64_t id : met_)
    if (const std::int32_t at = whole.scene.find_body(id); at >= 0) bodies.push_back(at);
  std::sort(bodies.begin(), bodies.end());
  copy_ = make_part(whole, model, 0, std::move(bodies));
  copy_.own.assign(copy_.bodies.size(), 1);
  find_runs(copy_);
  const auto row_of = [&](std::int32_t body) {
    const auto found = std::lower_bound(copy_.bodies.begin(), copy_.bodies.end(), body);
    return found != copy_.bodies.end() && *found == body ? std::int32_t(found - copy_.bodies.begin()) : -1;
  };
  all_.assign(parts.size(), {});
  own_.assign(parts.size(), {});
  for (std::size_t l = 0; l < parts.size(); ++l)
    for (std::size_t i = 0; i < parts[l].bodies.size(); ++i) {
      const std::int32_t row = row_of(parts[l].bodies[i]);
      if (row < 0) continue;
      all_[l].push_back({std::int32_t(i), row});
      if (parts[l].own[i]) own_[l].push_back({std::int32_t(i), row});
    }
  first_.assign(std::size_t(ranks) + 1, 0);
  in_turn_.clear();
  for (int rank = 0; rank < ranks; ++rank) {
    for (std::size_t row = 0; row < copy_.bodies.size(); ++row)
      if (owner[std::size_t(copy_.bodies[row])] == rank) in_turn_.push_back(std::int32_t(row));
    first_[std::size_t(rank) + 1] = std::int64_t(in_turn_.size());
  }
}

void RankedLiquid::press(double h, std::vector<Part>& parts, Part* meshes) {
  Simulation& s = beside();
  stages().begin_step(s, h);
  stages().predict_configuration(s);
  stages().compute_free_velocity(s);
  pressed_ = true;
  {
    const MeshesInLiquid lent(meshes, s); // whose free velocities the part has found
    stages().press_fluid(s);
  }
  give_free(parts);
}

void RankedLiquid::press_again(std::vector<Part>& parts, Part* meshes) {
  {
    const MeshesInLiquid lent(meshes, beside());
    beside().fluid->press(beside().scene, true);
  }
  give_free(parts);
}

void RankedLiquid::give(Field<double> Bodies::*field, std::vector<Part>& parts) const {
  const Field<double>& from = copy_.simulation->scene.bodies.*field;
  if (!from.active) return;
  for (std::size_t l = 0; l < parts.size(); ++l) {
    Field<double>& to = parts[l].simulation->scene.bodies.*field;
    for (const auto& [body, row] : all_[l]) std::copy_n(from[row], from.components, to[body]);
  }
}

void RankedLiquid::give_free(std::vector<Part>& parts) const {
  for (Field<double> Bodies::*field : {&Bodies::velocity_free, &Bodies::inverse_mass, &Bodies::inverse_inertia})
    give(field, parts);
}

// velocity_of(part, body): of an own body.
template <class F>
void RankedLiquid::fetch(const std::vector<Part>& parts, Exchange& exchange, F&& velocity_of) {
  const auto n = std::size_t(copy_.simulation->scene.bodies.dofs());
  velocity_.resize(n * copy_.bodies.size());
  for (std::size_t l = 0; l < parts.size(); ++l)
    for (const auto& [body, row] : own_[l])
      std::copy_n(velocity_of(parts[l], body), n, &velocity_[n * std::size_t(row)]);
  if (exchange.ranks() == 1) return;
  sent_.resize(velocity_.size());
  for (std::size_t k = 0; k < in_turn_.size(); ++k)
    std::copy_n(&velocity_[n * std::size_t(in_turn_[k])], n, &sent_[n * k]);
  exchange.share(sent_.data(), n * sizeof(double), first_);
  for (std::size_t k = 0; k < in_turn_.size(); ++k)
    std::copy_n(&sent_[n * k], n, &velocity_[n * std::size_t(in_turn_[k])]);
}

const Array<double>& RankedLiquid::velocities(const std::vector<Part>& parts, Exchange& exchange) {
  fetch(parts, exchange, [](const Part& part, std::int32_t body) -> const double* {
    return part.simulation->interactions.system().record[std::size_t(body)].x;
  });
  return velocity_;
}

void RankedLiquid::settle(std::vector<Part>& parts, Exchange& exchange, Part* meshes) {
  fetch(parts, exchange, [](const Part& part, std::int32_t body) -> const double* {
    return part.simulation->scene.bodies.velocity[body];
  });
  Simulation& s = beside();
  s.scene.bodies.velocity.values = velocity_;
  {
    const MeshesInLiquid lent(meshes, s);
    s.fluid->settle(s.scene);
  }
  for (Field<double> Bodies::*field :
       {&Bodies::velocity, &Bodies::inverse_mass, &Bodies::inverse_inertia, &Bodies::force})
    give(field, parts);
}

void RankedLiquid::finish() {
  beside().fluid->finish(beside().scene);
  pressed_ = false;
}

void RankedLiquid::undo() {
  if (pressed_) beside().fluid->undo(beside().scene);
  pressed_ = false;
}

std::int64_t RankedLiquid::bytes() const { return copy_.simulation ? copy_.simulation->bytes().first : 0; }

// Contacts of all ranks beside the liquid.
class LiquidContactsOfRanks final : public ContactsBesideFluid {
public:
  LiquidContactsOfRanks(RankedNscd& ranks, Simulation& whole, const SolverOptions& options, double h)
      : ranks_(ranks), whole_(whole), options_(options), h_(h), meshes_(ranks.mesh_part(), ranks.liquid_.beside()) {}
  const Array<double>& velocities() override {
    meshes_.with_contacts([&] { ranks_.give_meshes(); });
    return ranks_.liquid_.velocities(ranks_.parts_, *ranks_.exchange_);
  }
  void keep() override {
    for (const Part& part : ranks_.parts_) at_begin_.push_back(part.simulation->interactions.memory());
  }
  void again() override {
    meshes_.with_contacts([&] { solve_again(); });
    ranks_.liquid_.beside().report.solve = whole_.report.solve;
  }
  void restore() override {
    for (std::size_t l = 0; l < at_begin_.size(); ++l) ranks_.parts_[l].simulation->interactions.restore(at_begin_[l]);
  }

private:
  void solve_again() {
    ranks_.liquid_.give_free(ranks_.parts_);
    ranks_.on_ranks(whole_, "prepare_contacts", [](Part& part) {
      part.simulation->interactions.keep_impulses();
      RankedNscd::of(part).prepare_contacts(*part.simulation);
    });
    ranks_.solve_step(whole_, options_, h_);
  }
  RankedNscd& ranks_;
  Simulation& whole_;
  const SolverOptions& options_;
  double h_;
  MeshesInLiquid meshes_;
  std::vector<ContactMemory> at_begin_;
};

// All processes make these calls of the liquid with the same numbers: an Error of one is one of all, and each takes the
// step back.
template <class F>
void RankedNscd::with_liquid(Simulation& s, const char* stage, F&& f) {
  if (!liquid_.taken()) return;
  try {
    s.timed(stage, f);
  } catch (...) {
    undo();
    throw;
  }
}

void RankedNscd::press_fluid(Simulation& s, double h) {
  with_liquid(s, "press_fluid", [&] { liquid_.press(h, parts_, mesh_part()); });
}

void RankedNscd::press_fluid_again(Simulation& s) {
  with_liquid(s, "press_fluid", [&] { liquid_.press_again(parts_, mesh_part()); });
}

void RankedNscd::fluid_passes(Simulation& s, const SolverOptions& options, double h) {
  with_liquid(s, "fluid_passes", [&] {
    LiquidContactsOfRanks contacts(*this, s, options, h);
    Simulation& beside = liquid_.beside();
    beside.report.solve = s.report.solve;
    liquid_.stages().fluid_passes(beside, contacts);
    s.report.solve = beside.report.solve;
  });
}

void RankedNscd::finish_fluid(Simulation& s) {
  with_liquid(s, "finish_fluid", [&] { liquid_.finish(); });
}

} // namespace cairn
