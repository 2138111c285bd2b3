// The C API of drives, servo walls and cells by functions of time, and of probes.
#include "../simulation/controls.hpp"
#include "../simulation/probes.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

cairn::Expression expression_of(const char* text, const char* name) {
  require(text, name);
  return cairn::Expression(text);
}

int dof_of(const char* name, int dim) {
  static constexpr const char *plane[] = {"vx", "vy", "w"}, *space[] = {"vx", "vy", "vz", "wx", "wy", "wz"};
  require(name, "dof");
  for (int k = 0; k < (dim == 2 ? 3 : 6); ++k)
    if (std::string(name) == (dim == 2 ? plane[k] : space[k])) return k;
  throw Error("dof is '" + std::string(name) + "': give " + (dim == 2 ? "vx, vy or w" : "vx, vy, vz, wx, wy or wz"));
}

} // namespace

extern "C" {

int32_t cairn_simulation_drive_by(cairn_simulation* simulation, int64_t n, const int64_t* bodies, const char* dof,
                                  const char* velocity, cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_drive_by").simulation;
    if (counted(n) > 0) require(bodies, "bodies");
    s.controlled().drive(s, span_of(bodies, n), dof_of(dof, s.scene.dim), expression_of(velocity, "velocity"));
  });
}

int32_t cairn_simulation_set_servo(cairn_simulation* simulation, int64_t body, const double* normal, const char* stress,
                                   const char* area, double depth, cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_set_servo").simulation;
    require(normal, "normal");
    cairn::Servo servo;
    servo.body = body;
    double length = 0;
    for (int k = 0; k < s.scene.dim; ++k) length += normal[k] * normal[k];
    for (int k = 0; k < s.scene.dim; ++k) servo.normal[std::size_t(k)] = normal[k] / std::sqrt(length);
    servo.stress = expression_of(stress, "stress");
    const std::string kind = area ? area : "grains";
    if (kind == "walls") servo.kind = cairn::ServoArea::walls;
    if (kind != "walls" && kind != "grains") {
      servo.kind = cairn::ServoArea::given;
      servo.area = cairn::Expression(kind);
    }
    if (!(depth > 0)) throw Error("depth is " + std::to_string(depth) + ": give a positive length [m], 1 as a rule");
    servo.depth = depth;
    s.controlled().press(s, std::move(servo));
  });
}

int32_t cairn_simulation_grow(cairn_simulation* simulation, int64_t n, const int64_t* bodies, const char* rate,
                              cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_grow").simulation;
    if (counted(n) > 0) require(bodies, "bodies");
    if (rate)
      s.controlled().grow(s, span_of(bodies, n), cairn::Expression(rate));
    else
      s.controlled().stop_growth(span_of(bodies, n));
  });
}

int32_t cairn_simulation_drive_cell(cairn_simulation* simulation, const char* component, const char* rate,
                                    cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_drive_cell").simulation;
    require(component, "component");
    s.controlled().drive_cell(s, component, expression_of(rate, "rate"));
  });
}

int32_t cairn_simulation_press_cell(cairn_simulation* simulation, const char* component, const char* stress,
                                    cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_press_cell").simulation;
    require(component, "component");
    s.controlled().press_cell(s, component, expression_of(stress, "stress"));
  });
}

int32_t cairn_simulation_weigh_cell(cairn_simulation* simulation, double inertia, double depth, int32_t keeps_volume,
                                    cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_weigh_cell").simulation;
    s.controlled().weigh_cell(s, inertia, depth);
    s.controlled().keep_volume(s, keeps_volume != 0);
  });
}

int32_t cairn_simulation_cell(const cairn_simulation* simulation, double* vectors, double* rate, double* stress,
                              cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    const cairn::Cell& cell = simulation->simulation.scene.cell;
    const int dim = simulation->simulation.scene.dim;
    for (int j = 0; j < dim; ++j)
      for (int i = 0; i < dim; ++i) {
        if (vectors) vectors[i + dim * j] = cell.vectors[i + 3 * j];
        if (rate) rate[i + dim * j] = cell.velocity_gradient[i + 3 * j];
        if (stress) stress[i + dim * j] = cell.stress[i + 3 * j];
      }
  });
}

int32_t cairn_simulation_add_probe(cairn_simulation* simulation, const char* quantity, int64_t n, const int64_t* bodies,
                                   const char* take, int32_t every, int32_t* probe, cairn_error* error) {
  return guarded(error, [&] {
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_add_probe").simulation;
    require(quantity, "quantity");
    require(probe, "probe");
    if (counted(n) > 0) require(bodies, "bodies");
    if (!s.probes) s.probes = std::make_unique<cairn::Probes>();
    *probe = s.probes->add(s, quantity, span_of(bodies, n), take ? take : "mean", every, true);
  });
}

int32_t cairn_simulation_read_probe(const cairn_simulation* simulation, int32_t probe, int64_t capacity, double* times,
                                    double* values, int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    const cairn::Probes* probes = simulation->simulation.probes.get();
    if (!probes || probe < 0 || probe >= probes->count())
      throw Error("there is no probe " + std::to_string(probe) + "; there are " +
                  std::to_string(probes ? probes->count() : 0));
    const auto rows = std::int64_t(probes->times(probe).size());
    if (count) *count = rows;
    if (rows > capacity) return;
    if (times) std::copy_n(probes->times(probe).data(), rows, times);
    if (values) std::copy_n(probes->values(probe).data(), rows, values);
  });
}

} // extern "C"
