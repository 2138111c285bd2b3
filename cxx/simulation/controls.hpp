// Controls of a run by functions of time that are compiled once: velocities of bodies, walls under a stress, the
// shape of a periodic cell, growth of bodies.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "../base/expression.hpp"

namespace cairn {

class Simulation;

// The loaded area of a servo wall: a number, the extent of the grains across its normal, or the distance of the walls
// that face each other across it; along the axes of a periodic cell these are its length. In 2D times a depth.
enum class ServoArea { given, grains, walls };

struct Servo {
  std::int64_t body = 0;          // id
  std::array<double, 3> normal{}; // unit vector out of the solid, to which its force is parallel
  Expression stress;              // [Pa]
  ServoArea kind = ServoArea::grains;
  Expression area;  // [m2]
  double depth = 1; // [m], in 2D
};

class Controls {
public:
  // From now on the velocity of a dof of these bodies is a function of time [m/s, rad/s]. It takes the place of what
  // drove the dof before.
  void drive(Simulation& s, std::span<const std::int64_t> ids, int dof, Expression velocity);
  // The force of a body is that of the stress, and nothing else.
  void press(Simulation& s, Servo servo);
  // Component "xx", "yy", "xy", ... of the velocity gradient of the cell [1/s], upper triangle alone, or of the stress
  // that it follows, compression positive [Pa].
  void drive_cell(Simulation& s, const std::string& component, Expression rate);
  void press_cell(Simulation& s, const std::string& component, Expression pressure);
  // The diagonal components that nothing drives keep the volume.
  void keep_volume(Simulation& s, bool keep);
  double kept_volume() const { return keeps_volume_ ? volume_ : 0; } // [m3]; 0: none is kept
  void set_kept_volume(double volume) { volume_ = volume; }          // that of a run before
  // From now on bodies grow by d(ln size)/dt = rate [1/s], shapes and densities kept, in the place of what they grew by
  // before; body_growth.cpp. Throws Error for bodies whose mass is not finite, that expand with their temperature, or
  // that a law holds at points of theirs.
  void grow(Simulation& s, std::span<const std::int64_t> ids, Expression rate);
  void stop_growth(std::span<const std::int64_t> ids);
  // Growth of a step of h [s] that was made: sizes, masses, inertia, and the kinetic energy that comes with them.
  void grow_bodies(Simulation& s, double h);
  // Inertia of the cell over the mass of the bodies that move [-], thickness in 2D [m].
  void weigh_cell(Simulation& s, double share, double depth);
  void release_bodies() { drives_.clear(), servos_.clear(); }
  void release(std::span<const std::int64_t> ids); // no function drives them any more
  void release_cell(Simulation& s);                // components that something drove stay from now on
  bool has_cell() const { return !components_.empty() || keeps_volume_; }
  bool reads_state() const { return !servos_.empty() || !growths_.empty() || has_cell(); } // of bodies

  // Writes velocities at the end of a step of h [s], forces and pressures in the mean of both ends by the share of the
  // end, rates of the cell. Throws Error where a function gives no number, or the cell is to follow a stress where the
  // strategy does not let it.
  void apply(Simulation& s, double h, double end_share, bool cell_may_follow);
  void apply_to_bodies(Simulation& s, double h, double end_share); // that part alone
  template <class F>
  void each_pressed_body(F&& f) const { // f(id), of those whose force is that of a stress
    for (const Servo& one : servos_) f(one.body);
  }

private:
  struct Drive {
    std::vector<std::int64_t> ids;
    int dof;
    Expression velocity;
    std::vector<std::int32_t> place; // internal numbers, of those that are there
  };
  struct Growth {
    std::vector<std::int64_t> ids;
    Expression rate;
    std::vector<std::int32_t> place;
  };
  struct Component {
    int i, j;
    bool follows; // the stress
    Expression value;
  };
  void find_places(Simulation& s);
  void apply_to_cell(Simulation& s, double h, double end_share);
  void add_component(Simulation& s, const std::string& name, bool follows, Expression value);

  std::vector<Drive> drives_;
  std::vector<Servo> servos_;
  std::vector<Growth> growths_;
  std::vector<Component> components_;
  bool keeps_volume_ = false;
  double volume_ = 0;    // to be kept [m3]
  double cell_mass_ = 1; // over that of the bodies
  double depth_ = 1;
  double begin_ = 0;                      // of the step at hand [s]
  std::int64_t order_ = -1, bodies_ = -1; // that the places are of
};

// Loaded area of a servo wall now [m2]; servo_area.cpp. Throws Error where walls are missing.
double loaded_area(const Simulation& s, const Servo& servo);

} // namespace cairn
