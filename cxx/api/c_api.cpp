// The public C API (cairn/cairn.h) over Scene and Simulation: checks pointers, turns exceptions into codes, decides
// nothing else.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>

#include "../base/call.hpp"
#include "../laws/plug.hpp"
#include "../strategies/simulation.hpp"
#include "cairn/build.h"
#include "cairn/cairn.h"

using cairn::Error;

struct cairn_scene {
  struct PairLaw {
    int a, b;
    cairn::Law law;
    std::vector<double> parameters;
  };
  explicit cairn_scene(int dim) : scene(dim) {}
  cairn::Scene scene;
  std::vector<std::string> materials;
  std::vector<PairLaw> laws;
};

struct cairn_simulation {
  cairn::Simulation simulation;
};

namespace {

int32_t failed(cairn_error* error, int32_t code, const char* message) {
  if (error) {
    error->code = code;
    error->item = -1;
    std::snprintf(error->message, sizeof error->message, "%s", message);
  }
  return code;
}

// Runs body(); what it throws becomes a code and a message.
template <class Body>
int32_t guarded(cairn_error* error, Body&& body) {
  try {
    body();
  } catch (const std::bad_alloc&) {
    return failed(error, cairn_out_of_memory, "out of memory");
  } catch (const Error& e) {
    return failed(error, cairn_wrong_input, e.what());
  } catch (const std::invalid_argument& e) {
    return failed(error, cairn_wrong_input, e.what());
  } catch (const std::exception& e) { return failed(error, cairn_internal_error, e.what()); } catch (...) {
    return failed(error, cairn_internal_error, "an exception of unknown type");
  }
  if (error) *error = cairn_error{};
  return cairn_ok;
}

void require(const void* pointer, const char* name) {
  if (!pointer) throw Error(std::string(name) + " is NULL; it has no default");
}

std::int64_t counted(std::int64_t n) {
  if (n < 0) throw Error("n is " + std::to_string(n) + "; it must be at least 0");
  return n;
}

template <class T>
std::span<const T> span_of(const T* values, std::int64_t n) {
  return values ? std::span<const T>(values, std::size_t(n)) : std::span<const T>();
}

cairn::Shape shape_named(const char* name) {
  std::string known;
  for (int i = 0; i < cairn::shapes; ++i) {
    if (std::strcmp(name, cairn::shape_infos[i].name) == 0) return cairn::Shape(i);
    known += std::string(i ? ", " : "") + cairn::shape_infos[i].name;
  }
  throw Error(std::string("there is no shape '") + name + "'; there are " + known);
}

cairn::Law law_named(const char* name) {
  const auto& infos = cairn::law_infos();
  std::string known;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].name == name || infos[i].python_name == name) return cairn::Law(i);
    known += (i ? ", " : "") + infos[i].python_name;
  }
  throw Error(std::string("there is no law '") + name + "'; there are " + known);
}

cairn::LawTable table_of(const cairn_scene& s) {
  cairn::LawTable table(s.materials);
  for (const auto& pair : s.laws) {
    if (pair.a < 0)
      table.set_default(pair.law, pair.parameters);
    else
      table.set(pair.a, pair.b, pair.law, pair.parameters);
  }
  return table;
}

cairn::Nscd strategy_of(const cairn_nscd& options) {
  if (!(options.tolerance > 0))
    throw Error("tolerance is " + std::to_string(options.tolerance) + "; it must be above 0");
  if (options.min_iterations < 0 || options.max_iterations < std::max(options.min_iterations, 1))
    throw Error("iterations are " + std::to_string(options.min_iterations) + " to " +
                std::to_string(options.max_iterations) + "; at least 0 and 1, and in this order");
  cairn::Nscd strategy;
  strategy.theta = options.theta;
  strategy.solver = {options.tolerance, options.min_iterations, options.max_iterations, options.threads};
  if (options.margin >= 0) strategy.margin = options.margin;
  strategy.project_positions = options.project_positions != 0;
  strategy.warm_start = options.warm_start != 0;
  return strategy;
}

void drive(cairn::Scene& scene, std::int64_t n, const std::int64_t* bodies, std::uint8_t mask, const double* velocity) {
  require(bodies, "bodies");
  scene.drive(span_of(bodies, counted(n)), mask, span_of(velocity, n * scene.bodies.dofs()));
}

// Internal order to the order of insertion, positions from relative to absolute.
template <class FieldOfNumbers>
void copy_field(const cairn::Scene& scene, const FieldOfNumbers& field, double* values) {
  const bool place = field.name == "position";
  const auto& order = scene.insertion_order();
  for (std::size_t i = 0; i < order.size(); ++i)
    for (int c = 0; c < field.components; ++c)
      values[i * field.components + c] = double(field[order[i]][c]) + (place ? scene.origin[c] : 0.0);
}

} // namespace

extern "C" {

const char* cairn_version(void) { return CAIRN_VERSION; }

int32_t cairn_plug_contact_law(const char* library, const char* law, int32_t replace, cairn_error* error) {
  return guarded(error, [&] {
    require(library, "library");
    require(law, "law");
    cairn::plug_law(library, law, {replace != 0, false});
  });
}

int32_t cairn_scene_create(int32_t dim, cairn_scene** scene, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    if (dim != 2 && dim != 3) throw Error("dim is " + std::to_string(dim) + "; it must be 2 or 3");
    *scene = new cairn_scene(dim);
  });
}

void cairn_scene_destroy(cairn_scene* scene) { delete scene; }

int32_t cairn_scene_set_gravity(cairn_scene* scene, const double* gravity, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(gravity, "gravity");
    for (int c = 0; c < scene->scene.dim; ++c)
      if (!std::isfinite(gravity[c])) throw Error("gravity[" + std::to_string(c) + "] is not a finite number");
    std::copy_n(gravity, scene->scene.dim, scene->scene.gravity.begin());
  });
}

int32_t cairn_scene_set_origin(cairn_scene* scene, const double* origin, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(origin, "origin");
    if (scene->scene.bodies.count > 0) throw Error("the origin is set before the first body is added");
    for (int c = 0; c < scene->scene.dim; ++c)
      if (!std::isfinite(origin[c])) throw Error("origin[" + std::to_string(c) + "] is not a finite number");
    std::copy_n(origin, scene->scene.dim, scene->scene.origin.begin());
  });
}

int32_t cairn_scene_add_material(cairn_scene* scene, const char* name, int32_t* material, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(name, "name");
    require(material, "material");
    auto& names = scene->materials;
    if (std::find(names.begin(), names.end(), name) != names.end())
      throw Error(std::string("there is a material '") + name + "' already; give it another name");
    names.emplace_back(name);
    *material = int32_t(names.size()) - 1;
  });
}

int32_t cairn_scene_set_law(cairn_scene* scene, int32_t material_a, int32_t material_b, const char* law,
                            int32_t parameters, const double* parameter, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(law, "law");
    if (parameters > 0) require(parameter, "parameter");
    const int known = int(scene->materials.size());
    const bool standard = material_a == -1 && material_b == -1;
    for (int m : {material_a, material_b})
      if (!standard && (m < 0 || m >= known))
        throw Error("there is no material " + std::to_string(m) + "; there are " + std::to_string(known) +
                    ", counted from 0");
    cairn_scene::PairLaw pair{material_a, material_b, law_named(law), {parameter, parameter + counted(parameters)}};
    cairn::LawTable({""}).set_default(pair.law, pair.parameters); // a wrong parameter must leave the scene as it was
    scene->laws.push_back(std::move(pair));
  });
}

int32_t cairn_scene_add_bodies(cairn_scene* scene, int64_t n, const double* position, const double* rotation,
                               const double* velocity, const double* mass, const double* inertia, int64_t* first,
                               cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(position, "position");
    require(mass, "mass");
    require(inertia, "inertia");
    const int dim = scene->scene.dim;
    counted(n);
    const auto id = scene->scene.add_bodies({n, span_of(position, n * dim), span_of(rotation, n * (dim == 2 ? 1 : 4)),
                                             span_of(velocity, n * scene->scene.bodies.dofs()), span_of(mass, n),
                                             span_of(inertia, n * (dim == 2 ? 1 : 3))});
    if (first) *first = id;
  });
}

int32_t cairn_scene_add_contactors(cairn_scene* scene, const char* shape, int64_t n, const int64_t* body,
                                   const int32_t* material, const double* radius, const double* offset,
                                   const double* direction, int64_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(shape, "shape");
    require(body, "body");
    require(material, "material");
    const int known = int(scene->materials.size());
    for (int64_t i = 0; i < counted(n); ++i)
      if (material[i] < 0 || material[i] >= known)
        throw Error("material[" + std::to_string(i) + "] is " + std::to_string(material[i]) + "; there are " +
                    std::to_string(known) + ", counted from 0");
    const int dim = scene->scene.dim;
    const auto id =
        scene->scene.add_contactors({n, shape_named(shape), span_of(body, n), span_of(material, n), span_of(radius, n),
                                     span_of(offset, n * dim), span_of(direction, n * (dim + 1))});
    if (first) *first = id;
  });
}

int32_t cairn_scene_drive(cairn_scene* scene, int64_t n, const int64_t* bodies, uint8_t mask, const double* velocity,
                          cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    drive(scene->scene, n, bodies, mask, velocity);
  });
}

void cairn_nscd_defaults(cairn_nscd* options) {
  if (options) *options = {0.5, 1e-4, 1, 1000, 0, 1, 0, -1.0};
}

int32_t cairn_simulation_create(const cairn_scene* scene, const cairn_nscd* options, cairn_simulation** simulation,
                                cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(simulation, "simulation");
    cairn_nscd chosen;
    cairn_nscd_defaults(&chosen);
    if (options) chosen = *options;
    *simulation = new cairn_simulation{{scene->scene, table_of(*scene), strategy_of(chosen)}};
  });
}

void cairn_simulation_destroy(cairn_simulation* simulation) { delete simulation; }

int32_t cairn_simulation_step(cairn_simulation* simulation, double h, cairn_report* report, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    const cairn::StepReport& r = simulation->simulation.step(h);
    if (!report) return;
    *report = {r.step,           r.contacts,       int32_t(r.solve.status), r.solve.iterations,
               r.time,           r.solve.error,    r.solve.worst_error,     r.solve.penetration,
               r.energy.kinetic, r.energy.closure, r.energy.in_play};
  });
}

int32_t cairn_simulation_drive(cairn_simulation* simulation, int64_t n, const int64_t* bodies, uint8_t mask,
                               const double* velocity, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    drive(simulation->simulation.scene, n, bodies, mask, velocity);
  });
}

int64_t cairn_simulation_bodies(const cairn_simulation* simulation) {
  return simulation ? simulation->simulation.scene.bodies.count : 0;
}

int64_t cairn_simulation_contacts(const cairn_simulation* simulation) {
  return simulation ? simulation->simulation.interactions.count() : 0;
}

int32_t cairn_simulation_body_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    cairn::Scene& scene = simulation->simulation.scene;
    bool found = false;
    scene.bodies.for_each_field([&](auto& field) {
      if (field.name != name) return;
      found = true;
      const std::int64_t numbers = field.active ? scene.bodies.count * field.components : 0;
      if (count) *count = numbers;
      if (numbers == 0 || numbers > capacity) return;
      require(values, "values");
      copy_field(scene, field, values);
    });
    if (!found) throw Error(std::string("bodies have no field '") + name + "'; see fields.def");
  });
}

int32_t cairn_simulation_contact_arrays(cairn_simulation* simulation, int64_t* bodies, double* gap, double* normal,
                                        double* point, double* impulse, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    cairn::Simulation& s = simulation->simulation;
    const cairn::Candidates& candidates = s.candidates;
    const std::int64_t n = s.interactions.count();
    const int dim = s.scene.dim;
    for (std::int64_t i = 0; bodies && i < n; ++i) {
      bodies[2 * i] = *s.scene.bodies.id[*s.scene.contactors.body[candidates.contactor_a[i]]];
      bodies[2 * i + 1] = *s.scene.bodies.id[*s.scene.contactors.body[candidates.contactor_b[i]]];
    }
    if (gap) std::copy_n(candidates.gap.data(), n, gap);
    if (normal) std::copy_n(candidates.normal.data(), n * dim, normal);
    for (std::int64_t i = 0; point && i < n * dim; ++i) point[i] = candidates.point[i] + s.scene.origin[i % dim];
    if (impulse) s.interactions.impulse_space(impulse);
  });
}

} // extern "C"
