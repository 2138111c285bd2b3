// Newton's method of deformable bodies whose stresses are not linear, round the solution of contacts: the first pass is
// that of every step; each further one has a free velocity and a compliance of contact nodes of its own.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>

#include "../../base/call.hpp"
#include "../../fluid/fluid.hpp"
#include "newton.hpp"

namespace cairn {
namespace {

// Contact tolerance within Newton's method. The residual that contacts leave is a force on the body, which a long step
// or a soft body turns into a displacement that the next pass finds again. Where passes no longer halve the error,
// contacts are solved a hundred times tighter until the end of the step.
class TightenedContacts {
public:
  explicit TightenedContacts(SolverOptions& options) : options_(options), given_(options.tolerance) {}
  ~TightenedContacts() { options_.tolerance = given_; }
  TightenedContacts(const TightenedContacts&) = delete;
  TightenedContacts& operator=(const TightenedContacts&) = delete;

  void after(int pass, double error, double newton_tolerance) {
    constexpr int patience = 2;
    constexpr double gained = 0.5, tenth = 0.1, step = 0.01;
    const double least = std::min(given_, tenth * newton_tolerance);
    if (error <= gained * best_) {
      best_ = error;
      since_ = pass;
    } else if (pass - since_ >= patience && options_.tolerance > least) {
      options_.tolerance = std::max(least, step * options_.tolerance);
      since_ = pass;
    }
  }
  // Accepts a solution that meets the given tolerance but not the tightened one; other failures remain.
  void judge(SolveReport& report) const {
    const double error = std::max({report.error, report.light_error, report.joint_error});
    if (report.status != SolveStatus::iteration_limit || std::isfinite(options_.accuracy)) return;
    if (!(error <= given_ && error > options_.tolerance)) return;
    report.status = SolveStatus::converged;
    report.hint.clear();
    report.joint_hint.clear();
  }

private:
  SolverOptions& options_;
  double given_, best_ = std::numeric_limits<double>::infinity();
  int since_ = 1;
};

// Passes of a step without ranks.
class OwnPasses final : public ContactPasses {
public:
  OwnPasses(Nscd& nscd, Simulation& s) : nscd_(nscd), s_(s), at_begin_(s.interactions.memory()) {}
  void give() override { s_.interactions.give_meshes(); }
  void again(const SolverOptions&) override {
    const bool liquid = s_.fluid && s_.fluid->incompressible(); // contacts push its bodies anew
    if (liquid) s_.fluid->press(s_.scene, true);
    s_.interactions.keep_impulses();
    nscd_.prepare_contacts(s_);
    nscd_.solve_contacts(s_);
    if (liquid) nscd_.fluid_passes(s_);
  }
  void end() override { s_.interactions.restore(at_begin_); }

private:
  Nscd& nscd_;
  Simulation& s_;
  ContactMemory at_begin_;
};

// Errors of the meshes that are not linear, and the worst of them.
struct JudgedMeshes {
  bool whole = true;
  const MeshBody* worst = nullptr;
  NewtonError of_worst;
};

JudgedMeshes judge_meshes(Simulation& s, double tolerance) {
  JudgedMeshes judged;
  s.report.newton_error = 0;
  for (MeshBody& mesh : s.meshes.meshes) {
    if (mesh.linear()) continue;
    const NewtonError found = mesh.judge(tolerance);
    if (!found.fault.ok())
      mesh.fail(found.fault, " in step " + std::to_string(s.steps + 1), ": " + mesh.model.bulk->remedy_of(found.fault));
    judged.whole = judged.whole && found.whole;
    if (judged.worst && !(found.error > s.report.newton_error)) continue;
    s.report.newton_error = found.error;
    judged.worst = &mesh;
    judged.of_worst = found;
  }
  return judged;
}

// f(), which may call functions of the user: an error of one process is one of all.
template <class F>
void met_by_all(ContactPasses& passes, F&& f) {
  std::exception_ptr own;
  std::string fault;
  try {
    f();
  } catch (const std::exception& e) {
    own = std::current_exception();
    fault = e.what();
  }
  passes.agree(fault);
  if (own) std::rethrow_exception(own);
}

} // namespace

void Nscd::newton_passes(Simulation& s) {
  OwnPasses passes(*this, s);
  newton_passes(s, passes);
}

void Nscd::newton_passes(Simulation& s, ContactPasses& passes) {
  const auto back = [&] { passes.end(); };
  s.report.newton_error = 0;
  TightenedContacts contacts(settings.solver);
  try {
    for (int pass = 1;; ++pass) {
      passes.give();
      s.report.newton_passes = pass;
      JudgedMeshes judged;
      met_by_all(passes, [&] { judged = judge_meshes(s, settings.newton_tolerance); });
      const auto& [whole, worst, of_worst] = judged;
      contacts.judge(s.report.solve);
      if (whole && s.report.newton_error <= settings.newton_tolerance) return back();
      contacts.after(pass, s.report.newton_error, settings.newton_tolerance);
      if (pass >= settings.newton_passes) {
        back();
        if (!whole)
          throw StepTooLong("the mesh '" + worst->model.name + "' finds no balance in step " +
                            std::to_string(s.steps + 1) + " within " + std::to_string(pass) + " passes, near " +
                            worst->model.bulk->place_of_node(of_worst.node) + ": " + worst->remedy() +
                            (s.candidates.count > 0 ? ", or a smaller tol of the contact solver" : ""));
        char text[160];
        std::snprintf(text, sizeof text, "%.2g of the balance of the mesh '%.40s' is left after %d passes, most at ",
                      s.report.newton_error, worst->model.name.c_str(), pass);
        const std::string hint = text + worst->model.bulk->place_of_node(of_worst.node) + ": " + worst->remedy();
        if (attempt_ == Attempt::in_parts) throw StepTooLong(hint);
        if (s.report.solve.status == SolveStatus::converged) s.report.solve.status = SolveStatus::newton_limit;
        s.report.solve.hint = hint;
        return;
      }
      met_by_all(passes, [&] {
        for (MeshBody& mesh : s.meshes.meshes)
          if (!mesh.linear()) mesh.linearise(s.scene.nodes);
      });
      passes.again(settings.solver);
    }
  } catch (...) {
    back();
    throw;
  }
}

} // namespace cairn
