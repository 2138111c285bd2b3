// The C API of a liquid (cairn/fluids.h).
#include "cairn/fluids.h"

#include <algorithm>
#include <limits>

#include "../fluid/fluid.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

struct NamedRule {
  const char* name;
  std::int8_t kind;
};
constexpr NamedRule rules[] = {{"none", 0},      {"no_slip", 1}, {"free_slip", 2},
                               {"di_felice", 3}, {"ergun", 4},   {"gidaspow", 5}}; // as fluid_grains.f90 has drags

cairn::FluidMaterials names_of(const cairn_matter& matter) { return {matter.materials, matter.groups}; }

cairn::Fluid& fluid_of(cairn_simulation* simulation) {
  require(simulation, "simulation");
  if (!simulation->simulation.fluid)
    throw Error("the scene of this simulation has no liquid: call cairn_scene_set_fluid before it is made");
  return *simulation->simulation.fluid;
}

// Calls gauge(place (3) relative to the origin) for n places (dim, n).
template <class Gauge>
void at_places(cairn_simulation* simulation, std::int64_t n, const double* place, double* out, Gauge&& gauge) {
  const cairn::Scene& scene = simulation->simulation.scene;
  if (counted(n) == 0) return;
  require(place, "place");
  require(out, "values");
  check_finite("place", place, n * scene.dim);
  for (std::int64_t i = 0; i < n; ++i) {
    double at[3] = {};
    for (int c = 0; c < scene.dim; ++c) at[c] = place[scene.dim * i + c] - scene.origin[std::size_t(c)];
    out[i] = gauge(scene, at);
  }
}

template <class T>
std::vector<double> numbers(const std::vector<T>& from) {
  return {from.begin(), from.end()};
}

// Columns (dim, n) of values (3, n), with a shift added to each.
std::vector<double> flat(int dim, const std::vector<double>& from, const std::array<double, 3>& more) {
  std::vector<double> out;
  out.reserve(from.size());
  for (std::size_t i = 0; i < from.size(); ++i)
    if (int(i % 3) < dim) out.push_back(from[i] + more[i % 3]);
  return out;
}

std::vector<double> field_named(const cairn::Fluid& f, const cairn::Scene& scene, const std::string& name) {
  if (name == "position") return flat(scene.dim, f.position(), scene.origin);
  if (name == "velocity") return flat(scene.dim, f.velocity(), {});
  if (name == "pressure") return f.pressure();
  if (name == "density") return f.density();
  if (name == "porosity") return f.porosity();
  if (name == "open") return numbers(f.at_surface());
  if (name == "end") return numbers(f.ends());
  if (name != "mass")
    throw Error("a liquid has no field '" + name +
                "'; it has position, velocity, pressure, density, mass, porosity, open, end");
  std::vector<double> masses = f.masses();
  for (double& m : masses) m *= scene.dim == 2 ? f.settings.depth : 1.0;
  return masses;
}

// A box of an open end along an axis, in a scene of dim dimensions.
template <class Box>
void set_box(Box& to, int dim, const double* low, const double* high, std::int32_t axis) {
  require(low, "low");
  require(high, "high");
  check_finite("low", low, dim);
  check_finite("high", high, dim);
  for (int c = 0; c < dim; ++c)
    if (!(low[c] < high[c]))
      throw Error("high[" + std::to_string(c) +
                  "] is not above low: give the lowest corner of the box, then its "
                  "highest one");
  if (axis < 0 || axis >= dim)
    throw Error("axis is " + std::to_string(axis) + ": give one of 0 to " + std::to_string(dim - 1));
  std::copy_n(low, dim, to.low.begin());
  std::copy_n(high, dim, to.high.begin());
  to.axis = axis;
}

// Values (dim, n) as (3, n).
void append_wide(int dim, std::int64_t n, const double* from, std::vector<double>& to) {
  for (std::int64_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) to.push_back(c < dim ? from[dim * i + c] : 0.0);
}

} // namespace

namespace cairn::api {

void start_fluid(cairn_simulation& s) {
  if (s.fluid.position.empty()) {
    if (!s.fluid.ends.empty())
      throw Error("inflows and outflows are ends of a liquid, and the scene has none: call cairn_scene_set_fluid");
    return;
  }
  s.simulation.fluid = made_fluid(s.fluid, s.simulation.scene, names_of(s.matter));
  for (auto* values : {&s.fluid.position, &s.fluid.velocity, &s.fluid.pressure}) values->clear(); // rules stay
  s.fluid.ends = {};
}

void check_fluid(const cairn_simulation& s, const char* shape, std::int64_t n, const std::int64_t* body,
                 const std::int32_t* material, const double* radius) {
  require(shape, "shape");
  if (s.simulation.fluid && body)
    check_contactors(s.fluid, names_of(s.matter), shape, {body, std::size_t(counted(n))}, material, radius);
}

void renew_fluid(cairn_simulation& s) {
  if (s.simulation.fluid) give_surfaces(*s.simulation.fluid, s.fluid, s.simulation.scene, names_of(s.matter));
}

} // namespace cairn::api

extern "C" {

void cairn_fluid_defaults(cairn_fluid_settings* settings) {
  if (settings) *settings = {0, 1000, 0, 0, 0, 1.5, 0, 1, 0};
}

int32_t cairn_scene_set_fluid(cairn_scene* scene, const cairn_fluid_settings* settings, int64_t n,
                              const double* position, const double* velocity, const double* pressure,
                              cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(settings, "settings");
    if (counted(n) > 0) require(position, "position");
    const std::int64_t numbers = n * scene->scene.dim;
    if (n > 0) check_finite("position", position, numbers);
    if (n > 0 && velocity) check_speed("velocity", velocity, numbers);
    if (n > 0 && pressure) check_finite("pressure", pressure, n);
    cairn::FluidSettings chosen;
    chosen.spacing = settings->spacing;
    chosen.density = settings->density;
    chosen.viscosity = settings->viscosity;
    chosen.sound_speed = settings->sound_speed;
    chosen.surface_tension = settings->surface_tension;
    chosen.smoothing = settings->smoothing;
    chosen.artificial = settings->artificial;
    chosen.depth = settings->depth;
    chosen.incompressible = settings->incompressible != 0;
    if (n > 0) cairn::check_settings(chosen);
    const auto copied = [](const double* from, std::int64_t count) {
      return from ? std::vector<double>(from, from + count) : std::vector<double>();
    };
    scene->fluid.settings = chosen;
    scene->fluid.position = copied(position, numbers);
    scene->fluid.velocity = copied(velocity, numbers);
    scene->fluid.pressure = copied(pressure, n);
  });
}

int32_t cairn_scene_set_fluid_rule(cairn_scene* scene, const char* name, const char* rule, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(name, "name");
    require(rule, "rule");
    check_word(*scene, name);
    const auto* found = std::find_if(std::begin(rules), std::end(rules),
                                     [&](const NamedRule& r) { return std::string(rule) == r.name; });
    if (found == std::end(rules))
      throw Error(std::string("a liquid meets bodies by no rule '") + rule +
                  "': give no_slip, free_slip, none, di_felice, ergun or gidaspow");
    scene->fluid.rules.push_back({name, found->kind});
  });
}

int32_t cairn_scene_add_fluid_points(cairn_scene* scene, int64_t body, int64_t n, const double* offset,
                                     const double* normal, const double* depth, const double* volume,
                                     cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    const int dim = scene->scene.dim;
    scene->scene.internal(body);
    if (counted(n) == 0) return;
    const std::int64_t sizes[] = {n * dim, n * dim, n, n};
    const char* const names[] = {"offset", "normal", "depth", "volume"};
    const double* const values[] = {offset, normal, depth, volume};
    for (int k = 0; k < 4; ++k) {
      require(values[k], names[k]);
      check_finite(names[k], values[k], sizes[k]);
    }
    for (std::int64_t i = 0; i < n; ++i) {
      double square = 0;
      for (int c = 0; c < dim; ++c) square += normal[dim * i + c] * normal[dim * i + c];
      if (!(std::abs(square - 1) < 1e-6))
        throw Error("normal[" + std::to_string(i) + "] is " + std::to_string(std::sqrt(square)) +
                    " long: give a unit vector out of the body");
      if (!(depth[i] > 0) || !(volume[i] > 0))
        throw Error("depth or volume of point " + std::to_string(i) +
                    " is not above 0: points stand below the surface");
    }
    cairn::FluidSurface& to = scene->fluid.points;
    append_wide(dim, n, offset, to.offset);
    append_wide(dim, n, normal, to.normal);
    to.body.insert(to.body.end(), std::size_t(n), body);
    to.depth.insert(to.depth.end(), depth, depth + n);
    to.volume.insert(to.volume.end(), volume, volume + n);
  });
}

int32_t cairn_scene_add_inflow(cairn_scene* scene, const double* low, const double* high, int32_t axis, int64_t rows,
                               const double* speed, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(speed, "speed");
    if (counted(rows) == 0) throw Error("rows is 0: give a speed for each row of particles, or one for all");
    check_speed("speed", speed, rows);
    cairn::FluidInflow box;
    set_box(box, scene->scene.dim, low, high, axis);
    box.speed.assign(speed, speed + rows);
    scene->fluid.ends.inflows.push_back(std::move(box));
  });
}

int32_t cairn_scene_add_outflow(cairn_scene* scene, const double* low, const double* high, int32_t axis, int32_t sign,
                                double pressure, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    if (sign != 1 && sign != -1) throw Error("sign is " + std::to_string(sign) + ": give 1, up the axis, or -1");
    if (std::isinf(pressure)) throw Error("pressure of an outflow is not finite: give a number, or NaN");
    cairn::FluidOutflow box;
    set_box(box, scene->scene.dim, low, high, axis);
    box.sign = sign;
    box.pressure = pressure;
    scene->fluid.ends.outflows.push_back(box);
  });
}

int64_t cairn_simulation_particles(const cairn_simulation* simulation) {
  return simulation && simulation->simulation.fluid ? simulation->simulation.fluid->count() : 0;
}

int32_t cairn_simulation_fluid_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                     int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Fluid& f = fluid_of(simulation);
    require(name, "name");
    const std::vector<double> found = field_named(f, simulation->simulation.scene, name);
    if (count) *count = std::int64_t(found.size());
    if (values && std::int64_t(found.size()) <= capacity) std::copy(found.begin(), found.end(), values);
  });
}

int32_t cairn_simulation_fluid_number(cairn_simulation* simulation, const char* name, double* value,
                                      cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Fluid& f = fluid_of(simulation);
    require(name, "name");
    require(value, "value");
    const cairn::Fluid::Report& r = f.report;
    const std::pair<const char*, double> known[] = {{"sub_steps", r.sub_steps},
                                                    {"passes", r.passes},
                                                    {"products", r.products},
                                                    {"residual", r.residual},
                                                    {"misfit", r.misfit},
                                                    {"speed", r.speed},
                                                    {"compression", r.compression},
                                                    {"volume", r.volume},
                                                    {"drag_loss", r.drag_loss},
                                                    {"came_in", f.passed()[0]},
                                                    {"left", f.passed()[1]},
                                                    {"back_flow", double(f.back_flow())},
                                                    {"sound_speed", f.settings.sound_speed},
                                                    {"stable_step", f.stable_step(simulation->simulation.scene)}};
    std::string all;
    for (const auto& [row, number] : known) {
      if (std::string(name) == row) {
        *value = number;
        return;
      }
      all += std::string(all.empty() ? "" : ", ") + row;
    }
    throw Error(std::string("a liquid has no number '") + name + "'; it has " + all);
  });
}

int32_t cairn_simulation_fluid_force(cairn_simulation* simulation, int64_t body, double* force, cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Fluid& f = fluid_of(simulation);
    require(force, "force");
    simulation->simulation.scene.internal(body);
    const std::array<double, 6> found = f.force_on(body);
    if (simulation->simulation.scene.dim == 3)
      std::copy(found.begin(), found.end(), force);
    else
      for (int c = 0; c < 3; ++c) force[c] = found[std::size_t(c == 2 ? 5 : c)];
  });
}

int32_t cairn_simulation_fluid_pressure(cairn_simulation* simulation, int64_t n, const double* place, double* pressure,
                                        cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Fluid& f = fluid_of(simulation);
    at_places(simulation, n, place, pressure,
              [&](const cairn::Scene& scene, const double* at) { return f.pressure_at(scene, at); });
  });
}

int32_t cairn_simulation_fluid_level(cairn_simulation* simulation, int64_t n, const double* place, double* level,
                                     cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Fluid& f = fluid_of(simulation);
    at_places(simulation, n, place, level, [&](const cairn::Scene& scene, const double* at) {
      double below = 0, pull = 0; // height of the origin
      for (const double g : scene.gravity) pull += g * g;
      for (int c = 0; c < scene.dim; ++c)
        below += scene.origin[std::size_t(c)] *
                 (pull > 0 ? -scene.gravity[std::size_t(c)] / std::sqrt(pull) : c == scene.dim - 1);
      return f.level_at(scene, at) + below;
    });
  });
}

} // extern "C"
