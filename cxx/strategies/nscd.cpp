// Non-Smooth Contact Dynamics (Moreau 1988, Jean 1999): the step on one page, and the interface of a strategy.

#include "nscd/nscd.hpp"
#include <algorithm>

#include "../base/call.hpp"
#include "../base/stopwatch.hpp"
#include "../base/threads.hpp"
#include "../fluid/fluid.hpp"
#include "../networks/network.hpp"
#include "../solvers/problems/friction_problem.hpp"
#include "nscd/own_conditions.hpp"
#include "options.hpp"

namespace cairn {

const StepReport& Nscd::step(Simulation& s, double h) {
  if (attempt_ == Attempt::in_parts)
    throw Error("a step was asked for while a step is made in parts, by what gives its parts their loads: make it when "
                "this one is made");
  s.report.sub_steps = 1;
  if (settings.cut_back > 0) return step_in_parts(s, h);
  make_step(s, h);
  return s.report;
}

void Nscd::make_step(Simulation& s, double h) {
  const bool liquid = s.fluid && s.fluid->incompressible();
  begin_step(s, h);
  const Threads threads(settings.solver.threads, std::max(s.candidates.count, s.scene.bodies.count));
  try {
    // The configuration is predicted first: the free spin of a body depends on how it then stands.
    s.timed("predict_configuration", [&] { predict_configuration(s); });
    s.timed("compute_free_velocity", [&] { compute_free_velocity(s); });
    s.timed("detect_contacts", [&] { detect_contacts(s); });
    {
      const Stopwatch passes(s.meshes.linear() ? nullptr : &s.pass_seconds.all);
      if (liquid) s.timed("press_fluid", [&] { press_fluid(s); });
      s.timed("prepare_contacts", [&] { prepare_contacts(s); });
      s.timed("solve_contacts", [&] { solve_contacts(s); });
      if (liquid) s.timed("fluid_passes", [&] { fluid_passes(s); });
      if (!s.meshes.linear()) s.timed("newton_passes", [&] { newton_passes(s); });
    }
    if (attempt_ == Attempt::in_parts && s.report.solve.status == SolveStatus::diverged)
      throw StepTooLong("the contact solver diverged in step " + std::to_string(s.steps + 1) + ": give a smaller dt");
    s.timed("update_velocity", [&] { update_velocity(s); });
    s.timed("commit_contacts", [&] { commit_contacts(s); }); // refuses what a user's law gives back that is no number
  } catch (...) {
    if (liquid) s.fluid->undo(s.scene);
    undo_step(s);
    throw;
  }
  if (liquid) s.timed("finish_fluid", [&] { s.fluid->finish(s.scene); });
  s.timed("update_configuration", [&] { update_configuration(s); });
  if (parts_overlaps()) s.timed("part_overlaps", [&] { part_overlaps(s); });
  if (settings.project_positions) s.timed("project_positions", [&] { project_positions(s); });
}

std::vector<std::string_view> Nscd::stages(const Simulation& s) const {
  std::vector<std::string_view> names = {"predict_configuration", "compute_free_velocity", "detect_contacts",
                                         "prepare_contacts",      "solve_contacts",        "update_velocity",
                                         "commit_contacts",       "update_configuration"};
  if (!s.meshes.linear()) names.insert(names.begin() + 5, "newton_passes");
  if (s.fluid && s.fluid->incompressible()) {
    names.insert(names.begin() + 3, "press_fluid");
    names.insert(names.begin() + 6, "fluid_passes");
    names.insert(names.end() - 1, "finish_fluid");
  }
  if (parts_overlaps()) names.push_back("part_overlaps");
  if (settings.project_positions) names.push_back("project_positions");
  return names;
}

std::unique_ptr<Strategy> make_nscd() { return std::make_unique<Nscd>(); }

Nscd::Nscd() : Nscd(standard_options<NscdOptions>()) {}

Nscd::Nscd(const NscdOptions& options) : settings(options) {
  name = "nscd";
  const double theta = settings.integrator.parameter("theta", 0);
  if (!(theta >= 0.5 && theta <= 1))
    throw Error("theta is " + std::to_string(theta) + "; give a value in [1/2, 1], below 1/2 the method is unstable");
}

std::vector<Option> Nscd::options() {
  std::vector<Option> rows;
  settings.integrator.add_options(rows);
  for (const Option& row : rows_of(settings)) rows.push_back(row);
  return rows;
}

void Nscd::check_options() const {
  if (settings.project_positions && settings.pose.kernel && std::isfinite(settings.pose.params[0]))
    throw Error("project_positions takes back every overlap, and that of the springs of " + name +
                " gives their force: leave it out");
  if (settings.solver.min_iterations > settings.solver.max_iterations)
    throw Error("min_iter is " + std::to_string(settings.solver.min_iterations) + ", above max_iter, " +
                std::to_string(settings.solver.max_iterations) + ": give them in this order");
  const std::vector<std::string> known = texts_of("integrator");
  if (std::find(known.begin(), known.end(), settings.integrator.name) == known.end())
    throw Error("integrator is " + settings.integrator.name + ", which " + name + " does not take: give " + known[0]);
}

std::vector<std::string> Nscd::texts_of(std::string_view option) const {
  std::vector<std::string> names;
  if (option == "solver")
    for (const ProblemSolverInfo& s : problem_solvers()) names.push_back(s.name);
  if (option == "integrator") names = accepted;
  if (option == "integrator" && accepted.empty())
    for (const IntegratorInfo& i : integrator_infos()) names.push_back(i.name);
  return names;
}

std::unique_ptr<Strategy> Nscd::fresh() const {
  auto made = std::make_unique<Nscd>(settings);
  made->name = name;
  made->accepted = accepted;
  return made;
}

bool Nscd::scheme_beside_fluid(double h, cairn_scheme& out) const {
  if (!by_theta() || settings.pose.kernel) return false;
  out = settings.integrator.scheme(h);
  return true;
}

bool Nscd::take_settings(Simulation& s, const Strategy& other) {
  const auto* same = dynamic_cast<const Nscd*>(&other);
  if (!same) return false;
  if (settings.integrator != same->settings.integrator) changed(s, true);
  settings = same->settings;
  name = same->name;
  accepted = same->accepted;
  return true;
}

void Nscd::check_scene(const Simulation& s) const {
  if (settings.project_positions && !s.meshes.linear())
    throw Error(
        "project_positions moves deformable bodies that are linear: leave it out beside a material of solids, or a "
        "body of another code");
  if (settings.pose.kernel && settings.integrator.name == "theta" && !s.meshes.linear())
    throw Error("GranularElement moves deformable bodies that are linear: give NSCD to those of a material of solids");
  if (settings.cut_back > 0 && s.networks && s.networks->repeats())
    throw Error("cut_back is " + std::to_string(settings.cut_back) +
                ", and the network of heat repeats whole steps: leave out cut_back, or coupling of scene.thermal");
  for (const MeshBody& mesh : s.meshes.meshes)
    if (settings.cut_back > 0 && !mesh.linear() && !mesh.model.bulk->tells_history())
      throw Error("cut_back is " + std::to_string(settings.cut_back) + ", and the mesh '" + mesh.model.name +
                  "' is of a code that keeps a history and does not give it, so that no step of it can be made anew in "
                  "parts: leave out cut_back, or give the code state() and restore(), in C state_size, save and load");
}

// Springs that a strategy has in the place of contacts know their overlap and Coulomb's friction, but no place of
// their own to be drawn to, and no force of the last step along or about what a law adds.
std::string Nscd::not_by_springs(const LawInfo& law) const {
  if (!settings.pose.kernel || !std::isfinite(settings.pose.params[0])) return {};
  const std::string by = name + " with a stiffness has springs in the place of contacts, ";
  if (law.joins) return by + "and knows no joints: take NSCD, or leave them out";
  if (law.keeps) return by + "and law " + law.python_name + " holds bodies together: take NSCD";
  Integrator moved_by = settings.integrator;
  if (law.has_solve && moved_by.name == "theta" && !(moved_by.parameter("theta", 0) >= 1))
    return by + "and below theta=1 no law of moments, as " + law.python_name + " is: take theta=1, or NSCD";
  return {};
}

// Reason why the strategy cannot honour a law; empty if it can.
std::string Nscd::dropped(const LawTable::Entry& entry) const {
  const LawInfo& law = law_infos()[std::size_t(entry.law)];
  if (std::string told = not_by_springs(law); !told.empty()) return told;
  if (const std::string own = settings.pose.kernel ? own_condition(entry) : ""; !own.empty())
    return name + " imposes the gap between surfaces at contacts, in the place of what a law says there, and law " +
           law.python_name + " has " + own + ": take NSCD, or give Coulomb or the like";
  if (const std::string own = settings.project_positions ? own_overlap(entry) : ""; !own.empty())
    return "project_positions takes back every overlap, and law " + law.python_name + " has " + own + ": leave it out";
  return {};
}

void Nscd::check_laws(const Simulation& s) const {
  for (int e = 0; e < s.laws.entries(); ++e)
    if (const std::string told = dropped(s.laws.entry(e)); !told.empty()) throw Error(told);
  for (int e = 0; e < s.laws.entries(); ++e)
    if (const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)]; !serves(law))
      throw Error("law " + law.python_name +
                  " gives a force and no condition on impulses, which NSCD needs; give Coulomb, Restitution or the "
                  "like, or use SmoothDEM");
}

ContactMemory Nscd::memory(const Simulation& s) const { return s.interactions.memory(); }
void Nscd::restore(Simulation& s, ContactMemory memory) {
  if (memory.gaps_of_bonds) read_gaps_of_bonds(s, memory);
  s.interactions.restore(std::move(memory));
}

Nscd& stages_of(Simulation& s, const std::string& call) {
  if (auto* nscd = dynamic_cast<Nscd*>(&s.strategy())) return *nscd;
  throw Error(call + " needs the stages of NSCD, and the strategy is " + s.strategy().name +
              ": give the scene to a simulation of NSCD, without ranks");
}

Simulation::Simulation(Scene s, LawTable l, const NscdOptions& options)
    : Simulation(std::move(s), std::move(l), std::make_unique<Nscd>(options)) {}

} // namespace cairn
