// Newton's method over bodies that cohesive zones join, with multipliers of the contacts beside them.
#pragma once
#include <functional>
#include <vector>

#include "solid_system.hpp"

namespace cairn {

class SolidZones {
public:
  explicit SolidZones(SolidSystem& solid) : solid_(solid) {}
  struct Kinds {         // of contacts
    bool zones = false;  // cohesive ones
    bool others = false; // neither zones nor cones beside them
    bool alone() const { return zones && !others; }
  };
  static Kinds kinds(const ContactSystem&);
  // True if all contacts are cohesive zones, or cones beside them.
  static bool alone(const ContactSystem& system) { return kinds(system).alone(); }
  static void keep_start(ContactSystem&); // impulses before a sweep changes them
  // Impulses of such contacts, from those of the last step, if their error is smaller; returns after how many passes.
  int solve(double error_square, double wanted_square, const std::function<double()>& measure);

private:
  // Stiffness of a pass: at the start by the damage and the pressed contacts of the last step, then tangents; secants
  // where the factors of tangents do not exist.
  enum class Stiffness { start, tangent, secant };
  void read(const cairn_batch& b, const double* u, bool slopes);
  void begin();
  void go_to_start();
  void find_velocities();
  void bear_contact(const double* u, const double* multiplier, int n, int c, double rho, double shift, double mu,
                    Stiffness by, double* bears, double* answer) const;
  void bear_springs(std::size_t k, const double* u, Stiffness by, double* bears, double* answer);
  void linearise(Stiffness by);
  void follow_step();
  double slope(double step);
  double slope_at_begin() const;
  double step_length(double begin);
  void move(double step);
  void multiply();
  void extrapolate_multipliers();
  void renew_multipliers();
  bool stands_free(const SolidSystem::Contact& contact) const;
  void begin_inside(double barrier);
  void bear_inside(const double* u, double* multiplier, int n, int c, double rho, double distance, double mu,
                   double barrier, double* bears, double* answer) const;
  void linearise_inside(double barrier, Stiffness by);
  double room_of_step() const;
  double mean_inside(double step) const;
  void correct_inside(double barrier, double mean);
  void move_inside(double step);
  // Passes of interior points: how many; lowers `error_square` to the error of the impulses that were kept.
  int go_inside(double& error_square, double wanted_square, const std::function<double()>& measure, bool& reached);
  // Likewise by multipliers of an augmented Lagrangian, after other passes or from the start.
  int go_by_multipliers(bool follows, double& error_square, double wanted_square,
                        const std::function<double()>& measure, bool& reached);

  SolidSystem& solid_;
  std::vector<std::size_t> place_; // where the columns of each batch begin
  std::vector<double> velocity_, moving_, bears_, change_, multiplier_, presses_, pressed_, shift_; // columns
  std::vector<double> last_multiplier_, last_change_; // columns: multipliers before, their change
  int renewals_ = 0;                                  // of multipliers
  std::vector<double> u_, target_, none_;             // of a batch
  std::vector<double> stiffness_;                     // of contacts, laid out as the responses of the system
  std::vector<std::uint8_t> moves_;                   // of contacts: SolidSystem::moves
  bool meshes_ = false;
  double softer_ = 1; // factor of the penalty
  double slack_ = 0;  // of velocities that count as none, times the root of the mass of a contact
  double stays_[36];
  double spring_[6 * 128], pull_[6 * 128], fall_[6 * 128], rise_[6 * 128], still_[6 * 128], mu_[128],
      beta_[128]; // of a batch
};

} // namespace cairn
