// Newton's method of deformable bodies whose stresses are not linear, round the solution of contacts: the first pass is
// that of every step; each further one has a free velocity and a compliance of contact nodes of its own.
#include <cstdio>

#include "../../base/call.hpp"
#include "nscd.hpp"

namespace cairn {

void Nscd::newton_passes(Simulation& s) {
  const ContactMemory at_begin = s.interactions.memory();
  const auto back = [&] { s.interactions.restore(at_begin); };
  s.report.newton_error = 0;
  try {
    for (int pass = 1;; ++pass) {
      s.interactions.give_meshes();
      s.report.newton_passes = pass;
      s.report.newton_error = 0;
      bool whole = true;
      const MeshBody* worst = nullptr;
      NewtonError of_worst;
      for (MeshBody& mesh : s.meshes.meshes) {
        if (mesh.linear()) continue;
        const NewtonError found = mesh.judge(settings.newton_tolerance);
        if (!found.fault.ok())
          mesh.fail(found.fault, " in step " + std::to_string(s.steps + 1),
                    ": " + mesh.model.bulk->remedy_of(found.fault));
        whole = whole && found.whole;
        if (worst && !(found.error > s.report.newton_error)) continue;
        s.report.newton_error = found.error;
        worst = &mesh;
        of_worst = found;
      }
      if (whole && s.report.newton_error <= settings.newton_tolerance) return back();
      if (pass >= settings.newton_passes) {
        back();
        if (!whole)
          throw StepTooLong("the mesh '" + worst->model.name + "' finds no balance in step " +
                            std::to_string(s.steps + 1) + " within " + std::to_string(pass) + " passes, near " +
                            worst->model.bulk->place_of_node(of_worst.node) + ": " + worst->remedy());
        char text[160];
        std::snprintf(text, sizeof text, "%.2g of the balance of the mesh '%.40s' is left after %d passes, most at ",
                      s.report.newton_error, worst->model.name.c_str(), pass);
        const std::string hint = text + worst->model.bulk->place_of_node(of_worst.node) + ": " + worst->remedy();
        if (in_parts_) throw StepTooLong(hint);
        if (s.report.solve.status == SolveStatus::converged) s.report.solve.status = SolveStatus::newton_limit;
        s.report.solve.hint = hint;
        return;
      }
      for (MeshBody& mesh : s.meshes.meshes)
        if (!mesh.linear()) mesh.linearise(s.scene.nodes);
      s.interactions.keep_impulses();
      prepare_contacts(s);
      solve_contacts(s);
    }
  } catch (...) {
    back();
    throw;
  }
}

} // namespace cairn
