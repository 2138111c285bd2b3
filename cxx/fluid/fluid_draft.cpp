#include "fluid_draft.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../bodies/rigid_motion.hpp"
#include "../contactors/shapes.hpp"

namespace cairn {

namespace {

constexpr double pi = std::numbers::pi;

double ball_volume(int dim, double radius) {
  return dim == 2 ? pi * radius * radius : 4.0 / 3 * pi * radius * radius * radius;
}

// Direction k of n, evenly spread: on a circle, or on Fibonacci's spiral.
std::array<double, 3> direction(int dim, std::int64_t k, std::int64_t n) {
  if (dim == 2) {
    const double angle = 2 * pi * (double(k) + 0.5) / double(n);
    return {std::cos(angle), std::sin(angle), 0.0};
  }
  const double z = 1 - 2 * (double(k) + 0.5) / double(n), angle = pi * (1 + std::sqrt(5.0)) * double(k);
  const double flat = std::sqrt(std::max(0.0, 1 - z * z));
  return {flat * std::cos(angle), flat * std::sin(angle), z};
}

bool has_points(const FluidDraft& draft, std::int64_t body) {
  return std::find(draft.points.body.begin(), draft.points.body.end(), body) != draft.points.body.end();
}

void refuse_grain(const FluidDraft& draft, const ShapeInfo& shape, std::int64_t body, double radius) {
  const std::string who = "body " + std::to_string(body);
  if (!shape.ball())
    throw Error(who + " is a " + shape.name + ": drag is that of disks and spheres here, give \"no_slip\"");
  if (2 * radius > draft.settings.spacing)
    throw Error(who + " is " + number_text(2 * radius) + " m wide, and grains are at most a spacing, " +
                number_text(draft.settings.spacing) + " m: give \"no_slip\", with which the fluid flows round it");
  if (draft.settings.incompressible || draft.settings.surface_tension > 0)
    throw Error("drag of grains is that of the weakly compressible fluid without surface_tension: leave out "
                "incompressible and surface_tension, or the rule of drag");
}

// Throws Error if the liquid cannot meet a contactor.
void refuse(const FluidDraft& draft, const ShapeInfo& shape, std::int64_t body, double radius, std::int8_t kind) {
  if (kind > std::int8_t(Slip::slides)) return refuse_grain(draft, shape, body, radius);
  if (kind == std::int8_t(Slip::none) || shape.half_space() || has_points(draft, body)) return;
  const std::string who = "body " + std::to_string(body) + " has a " + shape.name;
  if (!(shape.ball() || (shape.hollow() && !shape.directed)))
    throw Error(who +
                ", whose points below its surface are not known: give them by cairn_scene_add_fluid_points before "
                "the start, or the rule \"none\" for its material, and the fluid flows through");
  if (radius < draft.settings.spacing)
    throw Error(who + " of radius " + number_text(radius) + " m, less than the spacing of the fluid, " +
                number_text(draft.settings.spacing) + " m: give a smaller spacing, a larger body, or a rule of drag");
}

// Points, half-spaces and grains of the contactors that the liquid meets.
class Surfaces {
public:
  Surfaces(const FluidDraft& draft, const Scene& scene) : draft_(draft), scene_(scene) {}

  void add(std::int32_t k, std::int8_t kind) {
    const Contactors& all = scene_.contactors;
    const ShapeInfo& shape = info(Shape(all.shape[k][0]));
    const std::int64_t body = scene_.bodies.id[all.body[k][0]][0];
    refuse(draft_, shape, body, all.radius.active ? all.radius[k][0] : 0.0, kind);
    if (kind > std::int8_t(Slip::slides)) return add_grain(k, body, kind);
    if (shape.half_space()) return add_plane(k, body, kind);
    if (has_points(draft_, body)) return;
    const double radius = all.radius[k][0];
    const double reach = 2 * draft_.settings.smoothing;
    const SurfacePoints made =
        points_in_ball(scene_.dim, radius, draft_.settings.spacing, int(std::ceil(reach)), shape.hollow());
    for (std::size_t i = 0; i < made.count(); ++i) {
      for (int c = 0; c < 3; ++c) points.offset.push_back(made.place[3 * i + std::size_t(c)] + offset(k, c));
      points.normal.insert(points.normal.end(), &made.normal[3 * i], &made.normal[3 * i] + 3);
      points.centre.push_back(made.centre[i]);
      append(points, body, made.depth[i], made.volume[i], kind);
    }
  }

  void add_given(const FluidSurface& from, const std::vector<std::int8_t>& kind) {
    points.offset.insert(points.offset.end(), from.offset.begin(), from.offset.end());
    points.normal.insert(points.normal.end(), from.normal.begin(), from.normal.end());
    points.centre.resize(points.normal.size() / 3, 0.0); // pressure acts at the points
    for (std::size_t i = 0; i < from.body.size(); ++i)
      append(points, from.body[i], from.depth[i], from.volume[i], kind[i]);
  }

  FluidSurface points, planes;
  FluidGrains grains;

private:
  static void append(FluidSurface& to, std::int64_t body, double depth, double volume, std::int8_t kind) {
    to.body.push_back(body);
    to.depth.push_back(depth);
    to.volume.push_back(volume);
    to.slip.push_back(kind);
  }
  double offset(std::int32_t k, int c) const {
    return c < scene_.dim && scene_.contactors.offset.active ? scene_.contactors.offset[k][c] : 0.0;
  }
  void add_plane(std::int32_t k, std::int64_t body, std::int8_t kind) {
    for (int c = 0; c < 3; ++c) {
      planes.offset.push_back(offset(k, c));
      planes.normal.push_back(c < scene_.dim ? scene_.contactors.direction[k][c] : 0.0);
    }
    append(planes, body, 0.0, 0.0, kind);
  }
  void add_grain(std::int32_t k, std::int64_t body, std::int8_t kind) {
    const double radius = scene_.contactors.radius[k][0];
    grains.body.push_back(body);
    grains.diameter.push_back(2 * radius);
    grains.volume.push_back(ball_volume(scene_.dim, radius));
    grains.law.push_back(kind);
  }

  const FluidDraft& draft_;
  const Scene& scene_;
};

// A material and group by the number that contactors have.
std::int8_t kind_of(const FluidDraft& draft, const FluidMaterials& names, std::int32_t material) {
  return draft.kind_of(names.materials[std::size_t(material)], names.groups[std::size_t(material)]);
}

// position: absolute places (dim, n) of the particles of the draft, followed by those in rows of inflows [m].
void refuse_inside(const FluidDraft& draft, std::span<const double> position, const Scene& scene,
                   const FluidMaterials& names) {
  const std::size_t given = draft.position.size() / std::size_t(scene.dim);
  const Contactors& all = scene.contactors;
  const int dim = scene.dim;
  const std::size_t n = position.size() / std::size_t(dim);
  for (const std::int32_t k : scene.contactor_insertion_order()) {
    const std::int32_t body = all.body[k][0];
    const ShapeInfo& shape = info(Shape(all.shape[k][0]));
    const std::int8_t kind = kind_of(draft, names, all.material[k][0]);
    if (body < 0 || kind == 0 || kind > std::int8_t(Slip::slides) || !(shape.half_space() || shape.ball())) continue;
    const Rotation turn = scene.bodies.rotation.active ? rotation_of(dim, scene.bodies.rotation[body]) : upright;
    double centre[3] = {}, out[3] = {};
    for (int r = 0; r < dim; ++r) {
      centre[r] = double(scene.bodies.position[body][r]) + scene.origin[std::size_t(r)];
      for (int c = 0; c < dim; ++c) {
        if (all.offset.active) centre[r] += turn[std::size_t(3 * r + c)] * all.offset[k][c];
        if (shape.half_space()) out[r] += turn[std::size_t(3 * r + c)] * all.direction[k][c];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      double along = 0, square = 0;
      for (int c = 0; c < dim; ++c) {
        const double away = position[std::size_t(dim) * i + std::size_t(c)] - centre[c];
        along += away * out[c];
        square += away * away;
      }
      const double inside = shape.half_space() ? -along : all.radius[k][0] - std::sqrt(square);
      if (!(inside > 0)) continue;
      const std::string deep = number_text(inside) + " m deep in body " + std::to_string(scene.bodies.id[body][0]);
      if (i >= given) throw Error("a row of an inflow lies " + deep + ": give a box beside it");
      throw Error("particle " + std::to_string(i) + " of the fluid lies " + deep +
                  ": give places outside bodies and walls");
    }
  }
}

// (dim, n) to (3, n), less what is subtracted from each.
std::vector<double> in_space(int dim, const std::vector<double>& values, const std::array<double, 3>& less) {
  std::vector<double> out(values.size() / std::size_t(dim) * 3, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t c = i % std::size_t(dim);
    out[3 * (i / std::size_t(dim)) + c] = values[i] - less[c];
  }
  return out;
}

// Pressure of rest below the highest particle [Pa].
std::vector<double> pressure_of_rest(int dim, const FluidSettings& s, const std::vector<double>& position,
                                     std::span<const double> gravity) {
  std::vector<double> out(position.size() / std::size_t(dim), 0.0);
  double square = 0;
  for (const double g : gravity) square += g * g;
  if (!(square > 0)) return out;
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t c = 0; c < std::size_t(dim); ++c)
      out[i] += s.density * gravity[c] * position[std::size_t(dim) * i + c];
  const double least = *std::min_element(out.begin(), out.end());
  for (double& p : out) p += 0.5 * s.density * std::sqrt(square) * s.spacing - least;
  return out;
}

} // namespace

void check_settings(const FluidSettings& s) {
  const auto refuse = [](const char* name, double value, const char* due) {
    throw Error(std::string(name) + " of the fluid is " + number_text(value) + ": give " + due);
  };
  const auto finite = [](double x) { return std::isfinite(x); };
  for (const auto& [name, value] :
       {std::pair{"spacing", s.spacing}, std::pair{"density", s.density}, std::pair{"depth", s.depth}})
    if (!(value > 0) || !finite(value)) refuse(name, value, "a finite number above 0");
  for (const auto& [name, value] :
       {std::pair{"viscosity", s.viscosity}, std::pair{"sound_speed", s.sound_speed},
        std::pair{"surface_tension", s.surface_tension}, std::pair{"artificial", s.artificial}})
    if (!(value >= 0) || !finite(value)) refuse(name, value, "a finite number of 0 or more");
  if (!(s.smoothing >= 1 && s.smoothing <= 3)) refuse("smoothing", s.smoothing, "a value in [1, 3]");
  if (s.incompressible && s.artificial > 0)
    refuse("artificial", s.artificial, "0 beside incompressible, which has no sound");
  if (s.incompressible && s.surface_tension > 0)
    refuse("surface_tension", s.surface_tension, "0 beside incompressible, or leave that out");
}

SurfacePoints points_in_ball(int dim, double radius, double spacing, int layers, bool hollow) {
  SurfacePoints out;
  for (int k = 0; k < layers; ++k) {
    const double inner = hollow ? radius + k * spacing : radius - (k + 1) * spacing;
    const double low = std::max(inner, 0.0), high = inner + spacing;
    if (high <= 0) break;
    const double volume = ball_volume(dim, high) - ball_volume(dim, low);
    const auto n = std::max<std::int64_t>(1, std::llrint(volume / std::pow(spacing, dim)));
    const double at = n == 1 ? 0.0 : 0.5 * (low + high);
    for (std::int64_t i = 0; i < n; ++i) {
      const auto way = direction(dim, i, n);
      for (const double w : way) {
        out.place.push_back(at * w);
        out.normal.push_back(hollow ? -w : w);
      }
      out.depth.push_back(hollow ? at - radius : radius - at);
      out.centre.push_back(hollow ? -at : at);
      out.volume.push_back(volume / double(n));
    }
  }
  return out;
}

double natural_sound_speed(int dim, const FluidSettings& settings, std::span<const double> position,
                           std::span<const double> velocity, std::span<const double> gravity) {
  const auto wide = std::size_t(dim);
  double pull = 0, fast = 0, width = std::numeric_limits<double>::infinity();
  for (const double g : gravity) pull += g * g;
  pull = std::sqrt(pull);
  double low = std::numeric_limits<double>::infinity(), high = -low; // along gravity
  for (std::size_t i = 0; pull > 0 && i < position.size(); i += wide) {
    double along = 0;
    for (std::size_t c = 0; c < wide; ++c) along += position[i + c] * (gravity[c] / pull);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  for (std::size_t c = 0; c < wide && !position.empty(); ++c) {
    double first = position[c], last = first;
    for (std::size_t i = c; i < position.size(); i += wide) {
      first = std::min(first, position[i]);
      last = std::max(last, position[i]);
    }
    width = std::min(width, last - first);
  }
  for (std::size_t i = 0; i < velocity.size(); i += wide) {
    double square = 0;
    for (std::size_t c = 0; c < wide; ++c) square += velocity[i + c] * velocity[i + c];
    fast = std::max(fast, square);
  }
  const double height = pull > 0 && !position.empty() ? high - low + settings.spacing : 0.0;
  const double half = 0.5 * std::max(position.empty() ? 0.0 : width, settings.spacing); // radius of a drop of that size
  return 10 * std::sqrt(2 * pull * height + fast + 2 * settings.surface_tension / (settings.density * half));
}

std::int8_t FluidDraft::kind_of(const std::string& material, const std::string& group) const {
  int best = -1;
  std::int8_t found = std::int8_t(Slip::holds);
  for (const FluidRule& rule : rules) {
    const int weight = !group.empty() && rule.word == group ? 3 : rule.word == material ? 1 : rule.word == "*" ? 0 : -1;
    if (weight < 0 || weight < best) continue;
    best = weight;
    found = rule.kind;
  }
  return found;
}

void give_surfaces(Fluid& fluid, const FluidDraft& draft, const Scene& scene, const FluidMaterials& names) {
  const Contactors& all = scene.contactors;
  Surfaces surfaces(draft, scene);
  std::vector<std::int8_t> kind(draft.points.body.size(), std::int8_t(Slip::none));
  for (const std::int32_t k : scene.contactor_insertion_order()) {
    const std::int8_t met = kind_of(draft, names, all.material[k][0]);
    if (met == std::int8_t(Slip::none)) continue;
    if (all.body[k][0] < 0)
      throw Error("a deformable body meets the fluid in Python alone: give the rule \"none\" for its name and its "
                  "sides, and the fluid flows through");
    surfaces.add(k, met);
    for (std::size_t i = 0; i < kind.size() && met <= std::int8_t(Slip::slides); ++i) // grains have no points
      if (draft.points.body[i] == scene.bodies.id[all.body[k][0]][0]) kind[i] = met;
  }
  surfaces.add_given(draft.points, kind);
  fluid.set_surfaces(std::move(surfaces.points), std::move(surfaces.planes), std::move(surfaces.grains));
}

void check_contactors(const FluidDraft& draft, const FluidMaterials& names, const std::string& shape,
                      std::span<const std::int64_t> body, const std::int32_t* material, const double* radius) {
  const auto all = shape_infos();
  const auto row = std::find_if(all.begin(), all.end(), [&](const ShapeInfo& s) { return shape == s.name; });
  for (std::size_t i = 0; i < body.size() && row != all.end(); ++i)
    refuse(draft, *row, body[i], radius ? radius[i] : 0.0, kind_of(draft, names, material[i]));
}

namespace {

// Gives the liquid its open ends, whose particles follow the others. particles: how many those are.
void give_ends(Fluid& fluid, const FluidDraft& draft, FluidRows rows, std::size_t particles, const Scene& scene) {
  if (draft.ends.empty()) return;
  for (std::size_t k = 0; k < rows.lanes.face.size(); ++k)
    rows.lanes.face[k] -= rows.lanes.sign[k] * scene.origin[std::size_t(rows.lanes.axis[k])];
  std::vector<FluidOutflow> outflows = draft.ends.outflows;
  for (FluidOutflow& o : outflows)
    for (std::size_t c = 0; c < 3; ++c) {
      o.low[c] -= scene.origin[c];
      o.high[c] -= scene.origin[c];
    }
  std::vector<std::int32_t> lane(particles, -1);
  lane.insert(lane.end(), rows.lane.begin(), rows.lane.end());
  fluid.set_ends(std::move(rows.lanes), std::move(outflows), std::move(lane));
}

} // namespace

std::unique_ptr<Fluid> made_fluid(const FluidDraft& draft, const Scene& scene, const FluidMaterials& names) {
  const int dim = scene.dim;
  check_settings(draft.settings);
  std::array<bool, 3> periodic{};
  FluidSettings settings = draft.settings;
  std::vector<double> gravity(scene.gravity.begin(), scene.gravity.begin() + dim);
  for (std::size_t c = 0; c < std::size_t(dim); ++c) {
    periodic[c] = scene.cell.periodic[c];
    if (periodic[c]) gravity[c] = 0;
  }
  FluidRows rows = rows_of_ends(dim, draft.ends, settings, periodic, draft.position);
  std::vector<double> position = draft.position, velocity = draft.velocity;
  velocity.resize(position.size(), 0.0);
  position.insert(position.end(), rows.position.begin(), rows.position.end());
  velocity.insert(velocity.end(), rows.velocity.begin(), rows.velocity.end());
  refuse_inside(draft, position, scene, names);
  if (!settings.incompressible && !(settings.sound_speed > 0)) {
    settings.sound_speed = natural_sound_speed(dim, settings, draft.position, velocity, gravity);
    if (!(settings.sound_speed > 0))
      throw Error(
          "sound_speed of the fluid is 0, and neither gravity across the liquid nor a velocity at the start tells how "
          "fast it will flow: give ten times the greatest speed [m/s]");
  }
  auto fluid = std::make_unique<Fluid>(dim, settings);
  std::vector<double> pressure =
      draft.pressure.empty() ? pressure_of_rest(dim, settings, draft.position, gravity) : draft.pressure;
  const std::size_t particles = pressure.size();
  pressure.resize(position.size() / std::size_t(dim), 0.0);
  fluid->set_particles(in_space(dim, position, scene.origin), in_space(dim, velocity, {}), pressure);
  give_surfaces(*fluid, draft, scene, names);
  give_ends(*fluid, draft, std::move(rows), particles, scene);
  return fluid;
}

} // namespace cairn
