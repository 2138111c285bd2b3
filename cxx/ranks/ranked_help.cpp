#include "ranked_help.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "../base/call.hpp"
#include "../contacts/body_speeds.hpp"
#include "../laws/law_info.hpp"
#include "../solvers/nlgs/nlgs.hpp"
#include "../solvers/policy.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/jointed_problem.hpp"
#include "../solvers/sweeps/light_error.hpp"
#include "../solvers/sweeps/solid_correction.hpp"
#include "../solvers/sweeps/solid_system.hpp"
#include "../solvers/sweeps/step_solver.hpp"
#include "exact_sum.hpp"
#include "gathered_meshes.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {
namespace {

// Speeds of own bodies, and of nodes with the rank that has contacts on them.
void add_speeds(const Part& part, bool nodes, int dim, std::span<ExactSum> sums) {
  const Bodies& b = part.simulation->scene.bodies;
  for (std::int64_t i = 0; i < b.count; ++i)
    if (part.own[std::size_t(i)])
      each_speed(b, i, dim, [&](double by_loads, double at_begin) {
        sums[0].add(by_loads);
        sums[1].add(at_begin);
      });
  const Nodes& n = part.simulation->scene.nodes;
  for (std::int64_t i = 0; i < n.count && nodes; ++i)
    for (int k = 0; k < dim; ++k) {
      const double v = n.velocity_free[i][k], change = v - n.velocity_begin[i][k];
      sums[0].add(*n.mass[i] * change * change);
      sums[2].add(*n.mass[i] * v * v);
    }
}

const std::array<const char*, 3> solvers = {"nlgs", "ppa_newton", "newton_over_bodies"};

} // namespace

// What all ranks ask of the one that solves.
struct RankedHelp::Request {
  int iterations = 0;
  bool anyway = false; // whatever it costs
};
struct RankedHelp::Answer {
  std::int32_t taken = 0, converged = 0, diverged = 0, iterations = 0, solver = 0, given_up = 0;
  double operations = 0, velocity_error = 0;
  char hint[500] = ""; // of a solver of problems
};

RankedHelp::RankedHelp(std::vector<Part>& parts, const std::vector<ColourShare>& colours, Exchange& exchange,
                       const SolverOptions& options, double mass_ratio, GatheredMemory& memory)
    : parts_(parts), colours_(colours), exchange_(exchange), options_(options), memory_(memory),
      forecast_(options.tolerance), mass_ratio_(mass_ratio), dim_(parts[0].simulation->scene.dim),
      by_newton_(options.solver == "auto"), alone_(options.solver != "auto" && options.solver != "nlgs"),
      exact_(std::isfinite(options.accuracy)) {
  count();
  keep_start();
  const double contacts = packed_ + full_;
  cost_ = solid_ ? SolidCorrection::operations(dim_, dofs_, contacts)
                 : policy().newton_iterations * policy().newton_contact * contacts;
  asked_ = solid_;
  // a gathering costs some sweeps, and errors of the first extrapolated sweeps foretell too many
  patience_ = !solid_ ? policy().newton_patience_uneven : options.again == 2 ? 1 : policy().passes_patience;
  few_from_ = policy().active_set_first;
}

// Figures of all ranks.
void RankedHelp::count() {
  std::int64_t counts[] = {0, 0, 0, 0, 0}; // contacts of packs, others; bytes; bodies that move; dofs of nodes
  // own solutions, deformable bodies, components, growth, bonds of solids, joints, bonds or joints of any kind, zones
  // over bodies
  double any[] = {0, 0, 0, 0, 0, 0, 0, 0};
  ExactSum speeds[3];
  for (Part& part : parts_) {
    const ContactSystem& system = part.simulation->interactions.system();
    if (part.simulation->scene.bodies.stretch.active) any[3] = 1;
    if (SolidCorrection::makes_solid(system, exact_, options_.tolerance)) any[4] = 1;
    if (JointedProblem::needed(system)) any[5] = 1;
    if (system.may_hold()) any[6] = 1;
    counts[2] += std::int64_t(ContactParcel::bytes_of(system));
    for (std::size_t i = 0; i < part.bodies.size(); ++i) counts[3] += part.own[i] && !part.fixed[i];
    if (part.rank == memory_.rank && !system.condensed.empty()) { // other processes have meshes, too
      any[1] = 1;
      for (const CondensedBody& body : system.condensed) counts[4] += body.dofs.dofs;
    }
    for (const cairn_batch& b : system.batches) {
      counts[b.pack ? 0 : 1] += b.contacts;
      if (law_infos()[std::size_t(b.law)].has_solve) any[0] = 1;
      any[2] = std::max(any[2], double(b.components));
      any[7] = std::max(any[7], double(b.context->over_bodies));
    }
  }
  exchange_.sum(counts);
  exchange_.largest(any);
  solid_ = any[0] > 0;
  grows_ = any[3] > 0;
  adds_up_ = (any[4] > 0 && !(any[1] > 0)) || any[5] > 0; // parts without meshes do not know of these
  if (solid_ || exact_ || any[6] > 0) {                   // as in Interactions::solve
    for (const Part& part : parts_) add_speeds(part, part.has_meshes && part.rank == memory_.rank, dim_, speeds);
    add_over_ranks(speeds, exchange_);
  }
  packed_ = double(counts[0]);
  full_ = double(counts[1]);
  by_loads_ = speeds[0].value();
  at_begin_ = speeds[1].value();
  of_nodes_ = speeds[2].value();
  bytes_ = double(counts[2]);
  dofs_ = (dim_ == 2 ? 3.0 : 6.0) * double(counts[3]) + double(counts[4]);
  bends_ = any[1] > 0;
  components_ = int(any[2]);
  zones_ = any[7] > 0 && by_newton_;
  char text[200];
  std::snprintf(text, sizeof text, "contacts would take %.2g bytes on one rank, the limit is %.2g", bytes_,
                options_.max_bytes);
  if (bytes_ > options_.max_bytes) obstacle_ = text;
}

// Passes over bodies that zones join begin with the impulses of the last step, which sweeps change.
void RankedHelp::keep_start() {
  start_.resize(parts_.size());
  for (std::size_t l = 0; l < parts_.size() && zones_; ++l)
    for (const cairn_batch& b : parts_[l].simulation->interactions.system().batches)
      for (int lane = 0; lane < b.contacts; ++lane)
        for (int k = 0; k < b.components; ++k) start_[l].push_back(at(b, b.r, lane, k));
}

double RankedHelp::sweep_operations() const {
  const bool plane = dim_ == 2;
  return packed_ * (plane ? policy().sweep_packed_plane : policy().sweep_packed) +
         full_ * (plane ? policy().sweep_full_plane : policy().sweep_full);
}

int RankedHelp::last_call() const { return std::max(options_.max_iterations - policy().gathered_last, 1); }

// The rules of newton_help.cpp and solid_help.cpp, with figures of all ranks.
bool RankedHelp::pays(int iterations, double error) {
  if (!possible() || !by_newton_) return false;
  errors_.emplace_back(iterations, error);
  const double foreseen = forecast_.sweeps_to_come(iterations, error),
               to_come = std::min(foreseen, policy().newton_believed * iterations), sweep = sweep_operations();
  if (!called_last_ && iterations >= last_call()) return true;
  if (zones_ && bends_) return true; // sweeps over nodes that zones join seldom end by themselves
  if (iterations < patience_) return false;
  if ((packed_ + full_) * components_ <= policy().gathered_unknowns && iterations >= few_from_) return true;
  if (solid_) {
    const double passes = failures_ > 0 ? policy().passes_price_failed : policy().passes_price;
    const bool again = failures_ == 0 && (options_.again == 2 || (options_.again == 1 && iterations * sweep >= cost_));
    return again || foreseen * sweep >= passes * cost_;
  }
  const double price = dim_ == 2 ? policy().newton_price_plane : policy().newton_price,
               asking =
                   policy().newton_asking * policy().newton_asking_contact * (dim_ == 2 ? 3 : 6) * (packed_ + full_);
  return to_come * sweep >= price * cost_ && (asked_ || (iterations + to_come) * sweep >= asking);
}

bool RankedHelp::accepts(int iterations, double light) {
  if (possible() && exact_) return false;
  if (!possible() || !by_newton_ || iterations < light_from_) return true;
  if (solid_) return light <= options_.tolerance || refinements_ >= policy().passes_refinements;
  if (light <= light_enough(options_.tolerance, mass_ratio_, bends_) || refinements_ >= policy().light_refinements)
    return true;
  const bool urgent = light > policy().light_urgent;
  if (urgent) return false;
  if (packed_ + full_ > policy().light_contacts) return true;
  return asked_ && policy().light_cost * cost_ > std::max(policy().light_sweeps, 2.0 * iterations) * sweep_operations();
}

// As in solid_help.cpp, but that self-stress alone is no reason to gather.
bool RankedHelp::refines(int iterations, double velocities) {
  if (!possible() || !by_newton_ || !adds_up_ || refined_ || std::isfinite(options_.accuracy)) return false;
  const double cost = cost_ / (std::max(iterations, 1) * sweep_operations());
  refined_ =
      velocities > std::clamp(cost / policy().refinement_share, 1.0, policy().refinement_dearest) * options_.tolerance;
  return refined_;
}

RankedHelp::Answer RankedHelp::solve(const std::vector<Bytes>& parcels, const Request& request) {
  GatheredContacts& gathered = memory_.contacts;
  gathered.lay_out(parcels);
  ContactSystem& system = gathered.system();
  system.weight_speed_square = by_loads_;
  system.begin_speed_square = at_begin_;
  system.mesh_speed_square = of_nodes_;
  system.grows = grows_;
  SolverOptions options = options_;
  options.enough = 0;
  options.threads = 1;
  options.tolerance *= 1 - 0x1p-10; // errors of both orders of contacts differ by rounding
  const Velocities free = gathered.velocity_free();
  SolverOptions of_help = options;
  if (masses_differ(mass_ratio_, true))
    of_help.tolerance *= 0.5; // light errors of problems are not quite those of steps
  if (request.iterations >= last_call()) of_help.max_iterations = 0; // rather than fail
  std::unique_ptr<SweepHelp> help;
  if (by_newton_) help = solid_ ? solid_help(system, free, of_help, zones_) : newton_help(system, free, of_help);
  if (zones_) SolidMemory::of(system).start = gathered.start();
  Answer answer;
  if (alone_) {
    std::string hint;
    const SolveReport report = solve_step(system, free, options, &hint);
    answer.taken = 1;
    answer.iterations = report.iterations;
    answer.diverged = report.status == SolveStatus::diverged;
    std::snprintf(answer.hint, sizeof answer.hint, "%s", hint.c_str());
    return answer;
  }
  bool wants = request.anyway;
  if (!wants) {
    const cairn_schedule schedule = system.schedule(1);
    system.load(free);
    cairn_add_impulses(&schedule);
    for (const auto& [sweeps, error] : errors_) wants = help->pays(sweeps, error);
  }
  if (wants) {
    options.done = request.iterations;
    options.max_iterations = std::max(options_.max_iterations, request.iterations + 1);
    if (!exact_)
      options.max_iterations =
          std::min(options.max_iterations, request.iterations + std::max(policy().gathered_sweeps, request.iterations));
    const SolveReport report = solve_nlgs(system, free, options, help.get());
    answer.taken = report.status != SolveStatus::diverged;
    answer.converged = report.status == SolveStatus::converged;
    answer.iterations = report.iterations - request.iterations;
    answer.velocity_error = report.velocity_error;
    for (std::size_t k = 0; k < solvers.size(); ++k)
      if (solvers[k] == std::string_view(report.solver)) answer.solver = std::int32_t(k);
  }
  answer.operations = help ? help->operations() : cost_;
  answer.given_up = help && help->given_up();
  return answer;
}

// Place of the rank that solves among those of this process; their number: it is of another one.
std::size_t RankedHelp::local() const {
  const std::vector<int>& here = exchange_.local();
  return std::size_t(std::ranges::find(here, memory_.rank) - here.begin());
}

RankedHelp::Outcome RankedHelp::improve(int iterations, bool small) {
  const bool few = (packed_ + full_) * components_ <= policy().gathered_unknowns;
  const Request request{iterations, alone_ || few || small || (zones_ && bends_) || iterations >= last_call()};
  std::vector<ContactParcel> parcels;
  std::vector<std::vector<Parcel>> out(parts_.size());
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    Simulation& s = *parts_[l].simulation;
    parcels.emplace_back(s.interactions.system(), s.scene.bodies, colours_[l], parts_[l].own);
    out[l].push_back({memory_.rank, parcels.back().pack(start_[l])});
  }
  const std::size_t here = local();
  std::optional<BorrowedRows> rows;
  if (here < parts_.size() && parts_[here].has_meshes) {
    Simulation& s = *parts_[here].simulation;
    rows.emplace(s.interactions.system(), s.scene.nodes, memory_.contacts);
  }
  std::vector<std::vector<Parcel>> in = exchange_.deliver(std::move(out));
  std::vector<std::string> fault(parts_.size());
  std::vector<std::vector<Parcel>> back(parts_.size());
  if (here < parts_.size()) try {
      std::vector<Bytes> all;
      for (Parcel& parcel : in[here]) all.push_back(std::move(parcel.bytes));
      const Answer answer = solve(all, request);
      std::vector<Bytes> answers = answer.taken ? memory_.contacts.answers() : std::vector<Bytes>(all.size());
      for (std::size_t rank = 0; rank < answers.size(); ++rank) {
        Packer head;
        head.put(answer);
        head.bytes.insert(head.bytes.end(), answers[rank].begin(), answers[rank].end());
        back[here].push_back({int(rank), std::move(head.bytes)});
      }
    } catch (const std::exception& e) { fault[here] = e.what(); }
  if (const std::string told = exchange_.agree(fault); !told.empty()) throw Error(told);
  in = exchange_.deliver(std::move(back));
  Answer answer;
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    Unpacker from(in[l][0].bytes);
    answer = from.get<Answer>();
    if (answer.taken) parcels[l].unpack(from);
  }
  if (rows && answer.taken) rows->keep_velocities();
  rows.reset();
  memory_.bytes = bytes_;
  ++memory_.calls;
  if (small) ++refinements_;
  learn(answer, iterations);
  Outcome outcome;
  outcome.taken = answer.taken != 0;
  outcome.iterations = answer.iterations;
  outcome.solver = solvers[std::size_t(answer.solver)];
  outcome.velocity_error = answer.velocity_error;
  outcome.proven = answer.converged;
  outcome.diverged = answer.diverged != 0;
  outcome.hint = answer.hint;
  exact_ = exact_ && !small && !answer.converged;
  return outcome;
}

void RankedHelp::learn(const Answer& answer, int iterations) {
  constexpr int later = 4;
  if (iterations >= last_call()) called_last_ = true;
  cost_ = answer.operations;
  asked_ = true;
  if (answer.given_up) obstacle_ = "the other solver gave up";
  light_from_ = 2 * iterations;
  if (answer.taken) zones_ = false; // one try a step: sweeps and other passes go on from its end
  few_from_ = later * iterations;
  if (answer.converged || !answer.taken) return;
  ++failures_;
  patience_ = std::max(patience_, double(iterations)) * (solid_ ? 2 : later);
}

} // namespace cairn
