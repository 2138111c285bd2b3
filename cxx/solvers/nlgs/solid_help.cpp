#include <algorithm>
#include <cmath>
#include <optional>

#include "../../laws/law_info.hpp"
#include "../policy.hpp"
#include "../sweeps/active_set.hpp"
#include "../sweeps/error_forecast.hpp"
#include "../sweeps/jointed_problem.hpp"
#include "../sweeps/newton_correction.hpp"
#include "../sweeps/solid_correction.hpp"
#include "../sweeps/solid_self_stress.hpp"
#include "../sweeps/solid_zones.hpp"
#include "../sweeps/step_error.hpp"
#include "nlgs.hpp"

namespace cairn {

namespace {

// True if no law beside the joints has a local solution of its own.
bool joints_alone(const ContactSystem& system) {
  return std::none_of(system.batches.begin(), system.batches.end(), [](const cairn_batch& b) {
    const LawInfo& law = law_infos()[std::size_t(b.law)];
    return law.has_solve && !law.joins;
  });
}

// Newton's method over bodies, where laws have a local solution of their own.
class SolidHelp : public SweepHelp {
public:
  SolidHelp(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options, bool zones = true)
      : system_(system), velocity_free_(velocity_free), options_(options), forecast_(options.tolerance),
        tolerance_(options.tolerance),
        solid_bonds_(SolidCorrection::makes_solid(system, std::isfinite(options.accuracy), options.tolerance)),
        jointed_(!solid_bonds_ && JointedProblem::needed(system)), beside_joints_(jointed_ && !joints_alone(system)),
        zones_(zones && SolidZones::alone(system)) {
    if (zones_) SolidZones::keep_start(system);
  }

  bool pays(int iterations, double error) override {
    double to_come = forecast_.sweeps_to_come(iterations, error);
    // beside contacts that press and rub, errors may stand still for a while
    if (beside_joints_) to_come = std::min(to_come, policy().newton_believed * iterations);
    const bool last = iterations >= options_.max_iterations;
    // sweeps over nodes of meshes that zones join cost as much as passes, and seldom end by themselves
    if (zones_ && !given_up_ && !system_.condensed.empty()) return possible();
    if (given_up_ || (iterations < patience_ && !last)) return false;
    const double passes = failures_ > 0 ? policy().passes_price_failed : policy().passes_price;
    const double sweep = sweep_operations(system_), pass = SolidCorrection::operations(system_);
    // Errors of joints move whole chains, where errors fall fast at first and then stand: work done by sweeps counts,
    // too; but passes seldom end where laws beside the joints have a local solution of their own.
    const bool chains = options_.again == 1 && !beside_joints_;
    const bool again = failures_ == 0 && (options_.again == 2 || (chains && iterations * sweep >= pass));
    if (!again && !last && !(to_come * sweep >= passes * pass)) return false;
    return possible();
  }

  // True if the light error is accepted. Under heavy bodies the error of the whole does not show light bodies: passes
  // go on to a smaller error for their sake.
  bool accepts(int, double light) override {
    const double margin = policy().passes_margin;
    if (light <= options_.tolerance || given_up_ || refinements_ >= policy().passes_refinements || !possible())
      return true;
    finer_ *= margin * std::max(options_.tolerance / light, 0x1p-20);
    ++refinements_;
    return false;
  }

  bool improve(const cairn_schedule&, double error, const std::function<double()>& measure) override {
    const double fall = policy().passes_fall;
    const double wanted = finer_ * options_.tolerance;
    if (zones_) {
      const int passes = solid_->zones().solve(error * error, wanted * wanted, measure);
      zones_ = false; // one try a step: other passes and sweeps go on from its end
      if (passes > 0) return true;
    }
    const int passes = solid_->improve(error * error, wanted * wanted, measure);
    const double now = std::sqrt(measure());
    // in short steps inertia exceeds springs, and sweeps find contacts in pressure and tension sooner
    if (!(now <= options_.tolerance || now * fall <= error)) given_up_ = ++failures_ > 1;
    patience_ *= 2;
    return passes > 0;
  }

  // The more a pass costs beside the sweeps until now, the more it has to be worth.
  bool refines(int iterations, double error) override {
    const double most = policy().refinement_dearest, share = policy().refinement_share;
    if (!(solid_bonds_ || jointed_) || given_up_ || refined_ > 0 || !(error > 0)) return false;
    if (std::isfinite(options_.accuracy) && solid_bonds_) return true;
    const double cost = SolidCorrection::operations(system_) / (std::max(iterations, 1) * sweep_operations(system_));
    const bool wanted =
        SolidCorrection::amplification(system_) * error_of_speed() > std::clamp(cost / share, 1.0, most) * tolerance_;
    // Self-stress of rings by sweeps stays from step to step: it is dropped after several sweeps, and in small solids.
    const bool cheap = cost <= share || SolidCorrection::operations(system_) < policy().refinement_small;
    only_rings_ = !wanted && iterations > 1 && cheap && SolidCorrection::has_bonds(system_);
    return wanted || only_rings_;
  }

  Refinement refine(double error, const std::function<double()>& measure) override {
    if (++refined_; !possible()) return {};
    if (jointed_) {
      solid_->settle_joints(tolerance_, measure);
      return {};
    }
    if (only_rings_) {
      solid_->self_stress().drop_within(tolerance_, measure);
      return {};
    }
    return solid_->refine(error, std::min(tolerance_, options_.accuracy), tolerance_, measure);
  }

  void aim(double error) override {
    options_.tolerance = error;
    forecast_.aim(error);
  }
  bool given_up() const override { return given_up_; }
  double operations() const override { return SolidCorrection::operations(system_); }
  const char* name() const override { return "newton_over_bodies"; }
  int few_unknowns() const override { return ActiveSet::most_unknowns; }

private:
  // Beside the velocities, however much impulses in balance are.
  double error_of_speed() const {
    return std::sqrt(total(system_.sums, system_.batches.size(), 6, 0)) / system_.speed();
  }

  bool possible() {
    if (!solid_) {
      schedule_ = system_.schedule(1);
      solid_.emplace(system_, schedule_, velocity_free_);
      given_up_ = !solid_->possible();
      if (!given_up_) solid_->self_stress().limit_biases();
    }
    return !given_up_;
  }

  ContactSystem& system_;
  const Velocities& velocity_free_;
  SolverOptions options_;
  ErrorForecast forecast_;
  cairn_schedule schedule_{};
  std::optional<SolidCorrection> solid_;
  std::int64_t patience_ = options_.again == 2 ? 1 : policy().passes_patience; // sweeps
  int failures_ = 0, refinements_ = 0;
  double finer_ = 1; // share of the tolerance that passes aim at
  double tolerance_; // that was asked for
  int refined_ = 0;
  bool only_rings_ = false;
  bool solid_bonds_, jointed_, beside_joints_, zones_;
  bool given_up_ = false;
};

} // namespace

SolveReport solve_nlgs_and_bodies(ContactSystem& system, const Velocities& velocity_free,
                                  const SolverOptions& options) {
  SolidHelp help(system, velocity_free, options);
  return solve_nlgs(system, velocity_free, options, &help);
}

std::unique_ptr<SweepHelp> solid_help(ContactSystem& system, const Velocities& velocity_free,
                                      const SolverOptions& options, bool zones) {
  return std::make_unique<SolidHelp>(system, velocity_free, options, zones);
}

} // namespace cairn
