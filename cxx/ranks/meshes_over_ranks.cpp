// Deformable bodies over ranks: one rank has all contacts on them. Each process makes their steps, from the same
// impulses to the same bits, so that all of them are whole everywhere and no factors travel.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../laws/law_info.hpp"
#include "../strategies/nscd/newton.hpp"
#include "ranked_nscd.hpp"

namespace cairn {

// True if meshes are those of the last partition.
bool OverRanks::knows_meshes(const Simulation& s) const {
  return std::ranges::equal(s.meshes.meshes, meshes_seen_,
                            [](const MeshBody& mesh, const MeshBody* seen) { return &mesh == seen; });
}

OverRanks::MeshBalls OverRanks::balls_of_meshes(const Simulation& s) {
  MeshBalls balls;
  const Contactors& c = s.scene.contactors;
  const Nodes& nodes = s.scene.nodes;
  const auto dim = std::size_t(s.scene.dim);
  for (std::int64_t k = 0; k < c.count && !s.meshes.empty(); ++k) {
    if (*c.body[k] >= 0) continue;
    const MeshSet::Middle& middle = s.meshes.middle(std::int32_t(k));
    double centre[3] = {0, 0, 0}, farthest = 0;
    int corners = 0;
    while (corners < 4 && middle.node[corners] >= 0) ++corners;
    for (int j = 0; j < corners; ++j)
      for (std::size_t d = 0; d < dim; ++d) centre[d] += nodes.position[middle.node[j]][d] / corners;
    for (int j = 0; j < corners; ++j) {
      double square = 0;
      for (std::size_t d = 0; d < dim; ++d) {
        const double between = nodes.position[middle.node[j]][d] - centre[d];
        square += between * between;
      }
      farthest = std::max(farthest, square);
    }
    balls.position.insert(balls.position.end(), centre, centre + dim);
    const bool facet = info(Shape(*c.shape[k])).is_hull();
    balls.radius.push_back(std::sqrt(farthest) + (facet ? 0 : *c.radius[k]));
    balls.widest = std::max(balls.widest, balls.radius.back());
  }
  for (const MeshBody& mesh : s.meshes.meshes) balls.widest = std::max(balls.widest, mesh.size());
  for (std::int64_t i = 0; i < nodes.count; ++i) {
    double square = 0;
    for (std::size_t d = 0; d < dim; ++d) square += nodes.velocity[i][d] * nodes.velocity[i][d];
    balls.fastest = std::max(balls.fastest, square);
  }
  return balls;
}

// The body whose rank has the meshes: of those that roam the nearest to the first node.
std::int64_t OverRanks::body_beside_meshes(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  std::int64_t nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::int64_t i = 0; i < b.count && s.scene.nodes.count > 0; ++i) {
    if (everywhere_[std::size_t(i)]) continue;
    double square = 0;
    for (int k = 0; k < s.scene.dim; ++k) {
      const double between = b.position[i][k] - s.scene.nodes.position[0][k];
      square += between * between;
    }
    if (square < least) least = square, nearest = i;
  }
  return nearest;
}

// Joints may hold nodes: then all are there.
void OverRanks::choose_mesh_rank(Simulation& s, std::int64_t beside) {
  const int before = mesh_rank_;
  int now = -1;
  if (!s.meshes.empty()) now = joint_rank_ >= 0 ? joint_rank_ : beside >= 0 ? owner_[std::size_t(beside)] : 0;
  if (before >= 0 && before != now) share_touched(s);
  mesh_rank_ = now;
  const Contactors& c = s.scene.contactors;
  for (std::int64_t k = 0; k < c.count && now >= 0 && joint_rank_ < 0; ++k) {
    const int material = *c.material[k], entry = *c.body[k] < 0 ? s.laws.find(material, material) : -1;
    if (entry >= 0 && law_infos()[std::size_t(s.laws.entry(entry).law)].joins) joint_rank_ = now;
  }
}

std::vector<std::vector<std::int32_t>> OverRanks::ghosts_of(const Surroundings& around, const MeshBalls& meshes) const {
  if (meshes.radius.empty()) return find_ghosts(around, exchange_->local());
  const auto n = std::size_t(around.count), more = meshes.radius.size();
  std::vector<double> position(around.position, around.position + std::size_t(around.dim) * n);
  std::vector<double> radius(around.radius, around.radius + n);
  position.insert(position.end(), meshes.position.begin(), meshes.position.end());
  radius.insert(radius.end(), meshes.radius.begin(), meshes.radius.end());
  std::vector<std::uint8_t> everywhere = everywhere_;
  std::vector<std::int32_t> owner = owner_;
  everywhere.resize(n + more, 0);
  owner.resize(n + more, mesh_rank_);
  Surroundings both = around;
  both.count = std::int64_t(n + more);
  both.position = position.data();
  both.radius = radius.data();
  both.everywhere = everywhere.data();
  both.owner = owner.data();
  auto ghosts = find_ghosts(both, exchange_->local());
  for (auto& of_rank : ghosts) // other ranks have no contactors of meshes
    of_rank.erase(std::lower_bound(of_rank.begin(), of_rank.end(), std::int32_t(n)), of_rank.end());
  return ghosts;
}

MeshShare OverRanks::share_of_meshes(std::size_t local) const {
  if (mesh_rank_ < 0) return MeshShare::none;
  const std::vector<int>& here = exchange_->local();
  if (here[local] == mesh_rank_) return MeshShare::all;
  const bool elsewhere = !std::ranges::binary_search(here, mesh_rank_);
  return local == 0 && elsewhere ? MeshShare::nodes : MeshShare::none;
}

// The order in which nodes came to touch, where rounding depends on it, from the rank that knows it.
void OverRanks::share_touched(Simulation& s) const {
  if (mesh_rank_ < 0 || exchange_->whole()) return;
  Packer mine;
  const bool knows = std::ranges::binary_search(exchange_->local(), mesh_rank_);
  for (std::size_t m = 0; m < s.meshes.meshes.size() && knows; ++m)
    mine.put_all(std::span<const double>(s.meshes.meshes[m].touched()));
  for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) {
    if (bytes.empty() || knows) continue;
    Unpacker from(bytes);
    for (MeshBody& mesh : s.meshes.meshes)
      if (const std::vector<double> told = from.get_all<double>(); told != mesh.touched()) mesh.restore_touched(told);
  }
}

// The part of this process that makes the step of meshes; null: there are none.
Part* RankedNscd::mesh_part() {
  const auto found = std::ranges::find(parts_, true, &Part::has_meshes);
  return found == parts_.end() ? nullptr : &*found;
}

// The largest way of a node since the partition, with the largest margin of a mesh contactor [m].
double RankedNscd::way_of_meshes() {
  Part* part = mesh_part();
  if (!part || part->rank != mesh_rank_) return 0;
  const Simulation& s = *part->simulation;
  const auto dim = std::size_t(s.scene.dim);
  double way = 0, margin = 0;
  for (std::int64_t i = 0; i < s.scene.nodes.count; ++i)
    way = std::max(way, way_since(s.scene, s.scene.nodes.position[i], &part->node_then[dim * std::size_t(i)]));
  const double constant = settings().margin / 2;
  for (std::int64_t k = 0; k < s.scene.contactors.count; ++k)
    if (*s.scene.contactors.body[k] < 0)
      margin = std::max(margin, std::isnan(constant) ? of(*part).margins()[std::size_t(k)] : constant);
  return way + margin;
}

// Impulses of contacts to the nodes, in every process.
void RankedNscd::give_meshes() {
  Part* part = mesh_part();
  if (!part) return;
  MeshList& meshes = part->simulation->meshes.meshes;
  const bool knows = part->rank == mesh_rank_;
  if (knows) part->simulation->interactions.give_meshes();
  if (exchange_->whole()) return;
  Packer mine;
  for (std::size_t m = 0; m < meshes.size() && knows; ++m) mine.put_all(std::span<const double>(meshes[m].impulse));
  for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) {
    if (bytes.empty() || knows) continue;
    Unpacker from(bytes);
    for (MeshBody& mesh : meshes) {
      const std::vector<double> told = from.get_all<double>();
      mesh.impulse.assign(told.begin(), told.end());
    }
  }
}

void RankedNscd::push_meshes() {
  give_meshes();
  Part* part = mesh_part();
  if (!part) return;
  Nodes& nodes = part->simulation->scene.nodes;
  std::swap(nodes.velocity_begin.values, nodes.velocity.values);
  for (MeshBody& mesh : part->simulation->meshes.meshes) mesh.push(nodes);
}

// Newton's method of bodies whose stresses are not linear, where ranks share contacts.
class PassesOfRanks final : public ContactPasses {
public:
  PassesOfRanks(RankedNscd& ranks, Simulation& whole, double h) : ranks_(ranks), whole_(whole), h_(h) {
    for (const Part& part : ranks.parts_) at_begin_.push_back(part.simulation->interactions.memory());
    told();
  }
  void give() override { ranks_.give_meshes(); }
  void again(const SolverOptions& options) override {
    ranks_.press_fluid_again(whole_);
    ranks_.on_ranks(whole_, "prepare_contacts", [](Part& part) {
      part.simulation->interactions.keep_impulses();
      RankedNscd::of(part).prepare_contacts(*part.simulation);
    });
    ranks_.solve_step(whole_, options, h_);
    ranks_.fluid_passes(whole_, options, h_);
    told();
  }
  void agree(const std::string& fault) override {
    if (!ranks_.exchange_->whole()) ranks_.end_by_fault({fault}); // a process has one rank
  }
  void end() override {
    for (std::size_t l = 0; l < at_begin_.size(); ++l) ranks_.parts_[l].simulation->interactions.restore(at_begin_[l]);
  }

private:
  void told() {
    for (Part& part : ranks_.parts_) part.simulation->report.solve = whole_.report.solve;
  }
  RankedNscd& ranks_;
  Simulation& whole_;
  double h_;
  std::vector<ContactMemory> at_begin_;
};

void RankedNscd::newton_passes(Simulation& s, Part& mesh, double h) {
  PassesOfRanks passes(*this, s, h);
  try { // all processes make the same passes, and meet the same faults
    of(mesh).newton_passes(*mesh.simulation, passes);
  } catch (...) {
    undo();
    throw;
  }
  const StepReport& found = mesh.simulation->report;
  s.report.solve = found.solve;
  s.report.newton_passes = found.newton_passes;
  s.report.newton_error = found.newton_error;
}

// Energy of nodes as points of mass, from the process that has the contacts of meshes.
void RankedNscd::add_energy_of_nodes(const cairn_scheme& scheme, double h, std::span<ExactSum> sums) {
  Part* part = mesh_part();
  if (!part) return;
  Simulation& s = *part->simulation;
  Nodes& nodes = s.scene.nodes;
  for (MeshBody& mesh : s.meshes.meshes) mesh.account(nodes, s.scene.gravity.data());
  if (part->rank != mesh_rank_ || nodes.count == 0) return;
  double terms[8];
  cairn_energy_terms(nodes.dim, nodes.dim, nodes.count, h, scheme.share, s.scene.gravity.data(),
                     nodes.mass.values.data(), nullptr, nodes.velocity_begin.values.data(),
                     nodes.velocity.values.data(), terms, nodes.force.values.data(), nullptr, nullptr, nullptr, nullptr,
                     nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr);
  for (std::size_t k = 0; k < std::size(terms); ++k) sums[k].add(terms[k]);
}

// State of nodes, and what the step told of meshes, to the whole.
void RankedNscd::collect_meshes(Simulation& s) {
  Part* part = mesh_part();
  if (!part) return;
  take_nodes(*part, s);
  s.follow_meshes();
  StepReport& report = part->simulation->report;
  if (!exchange_->whole()) { // contacts are known on one rank
    Packer mine;
    if (part->rank == mesh_rank_) {
      mine.put(report.mesh_depth);
      mine.put(report.mesh_way);
      for (const std::string* text : {&report.mesh_hint, &report.mesh_within})
        mine.put_all(std::span<const char>(text->data(), text->size()));
    }
    for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) {
      if (bytes.empty()) continue;
      Unpacker from(bytes);
      report.mesh_depth = from.get<double>();
      report.mesh_way = from.get<double>();
      for (std::string* text : {&report.mesh_hint, &report.mesh_within}) {
        const std::vector<char> told = from.get_all<char>();
        text->assign(told.begin(), told.end());
      }
    }
  }
  s.report.mesh_depth = report.mesh_depth;
  s.report.mesh_way = report.mesh_way;
  s.report.mesh_hint = report.mesh_hint;
  s.report.mesh_within = report.mesh_within;
  s.report.mesh_turned = report.mesh_turned;
}

} // namespace cairn
