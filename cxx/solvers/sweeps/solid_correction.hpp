// Newton's method over the bodies of a step with laws of local solutions: where bonds join many bodies to a solid,
// sweeps carry an impulse only from one body to the next, and factors of the whole carry it at once. Whole steps
// converge soon where most contacts in pressure and tension are known. Otherwise they stray, and proximal points are
// found one after the other, each by steps cut where the energy along them begins to rise (Rockafellar 1976; like
// Coulomb's cones in ppa_newton.cpp).
#pragma once
#include <functional>
#include <string>

#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "law_tangent.hpp"
#include "refinement.hpp"
#include "solid_proximal.hpp"
#include "solid_self_stress.hpp"
#include "solid_system.hpp"
#include "solid_zones.hpp"

namespace cairn {

class SolidCorrection {
public:
  // Reason why passes cannot be made over these contacts; empty if they can.
  static std::string obstacle(const ContactSystem&);
  SolidCorrection(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);
  SolidCorrection(const SolidCorrection&) = delete; // parts refer to each other
  SolidCorrection& operator=(const SolidCorrection&) = delete;
  // False: a body cannot be written as a matrix, or nothing moves.
  bool possible() const { return solid_.possible(); }
  // Approximate cost of one pass, in operations at the rate of factors; known before lists are made.
  static double operations(const ContactSystem&);
  static double operations(int dim, double dofs, double contacts);
  // Impulses of a smaller error, in a few passes; records up to date before and after.
  // measure: square of the error of the impulses at hand. Returns how many passes led to it, 0: none did.
  int improve(double error_square, double wanted_square, const std::function<double()>& measure);
  // True if bonds, or springs too, join bodies so that passes can tell the accuracy of velocities.
  static bool makes_solid(const ContactSystem&, bool springs, double tolerance);
  // How far velocities may be off, |dv|_M over the error of the impulses at hand: see solid_refinement.cpp.
  static double amplification(const ContactSystem&);
  static bool has_bonds(const ContactSystem&);
  // Passes until velocities change by no more than `wanted` of the speed of all, to impulses whose error is within the
  // tolerance; else these are as they were. Records up to date before and after.
  Refinement refine(double error, double wanted, double tolerance, const std::function<double()>& measure);
  // Passes until velocities change by little beside the tolerance; kept if the error stays within it.
  void settle_joints(double tolerance, const std::function<double()>& measure);

  SelfStress& self_stress() { return self_stress_; }
  SolidZones& zones() { return zones_; }

private:
  bool take_pass();
  void go_back(const std::function<double()>& measure); // to the impulses that were kept

  ContactSystem& system_;
  SolidSystem solid_;
  LawTangent tangent_{solid_};
  SelfStress self_stress_{solid_, tangent_};
  ProximalPoints proximal_points_{solid_, tangent_, self_stress_};
  SolidZones zones_{solid_};
  double yielding_; // of bonds that hold fast, as a share of their block
};

} // namespace cairn
