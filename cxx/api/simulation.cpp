// The C API of simulations (cairn/cairn.h): steps, options by name, reads and changes between steps.
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <typeinfo>

#include "../fe/called_forces.hpp"
#include "../files/simulation_state.hpp"
#include "../simulation/controls.hpp"
#include "../simulation/report.hpp"
#include "../strategies/nscd/nscd_options.hpp"
#include "objects.hpp"
#include "step_warning.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

cairn::NscdOptions strategy_of(const cairn_nscd& options) {
  if (!(options.tolerance > 0))
    throw Error("tolerance is " + std::to_string(options.tolerance) + "; it must be above 0");
  if (options.min_iterations < 0 || options.max_iterations < std::max(options.min_iterations, 1))
    throw Error("iterations are " + std::to_string(options.min_iterations) + " to " +
                std::to_string(options.max_iterations) + "; at least 0 and 1, and in this order");
  auto strategy = cairn::standard_options<cairn::NscdOptions>();
  strategy.integrator.parameter("theta", 0) = options.theta;
  strategy.solver = {options.tolerance, options.min_iterations, options.max_iterations, options.threads};
  if (options.margin >= 0) strategy.margin = options.margin;
  strategy.project_positions = options.project_positions != 0;
  strategy.warm_start = options.warm_start != 0;
  return strategy;
}

// Forces of another code that keep a history are of one simulation; if that does not come to be, of none.
class GivenForces {
public:
  GivenForces() = default;
  GivenForces(const GivenForces&) = delete;
  GivenForces& operator=(const GivenForces&) = delete;
  ~GivenForces() {
    for (cairn::CalledForces* forces : taken_) forces->give_back();
  }
  std::shared_ptr<cairn::InternalForces> of(const std::shared_ptr<cairn::InternalForces>& forces) {
    auto own = forces->another();
    if (own == forces)
      if (auto* called = dynamic_cast<cairn::CalledForces*>(own.get())) taken_.push_back(called);
    return own;
  }
  void stay() { taken_.clear(); }

private:
  std::vector<cairn::CalledForces*> taken_;
};

// Calls change(strategy) on a copy of the one in use, which stays as it was if that throws.
template <class Change>
void change_option(cairn_simulation& s, Change&& change) {
  auto changed = s.simulation.strategy().fresh();
  change(*changed);
  s.simulation.use(std::move(changed));
}

template <class Place>
bool same(Place a, Place b) {
  if constexpr (std::is_floating_point_v<std::decay_t<decltype(*a)>>)
    return *a == *b || (std::isnan(*a) && std::isnan(*b));
  else
    return *a == *b;
}

// Copies the options that the caller changed from their defaults to options of the same name of another strategy.
void hand_on(cairn::Strategy& from, cairn::Strategy& to) {
  const auto begin = cairn::make_strategy(from.name);
  const auto find = [](const std::vector<cairn::Option>& rows, const cairn::Option& wanted) {
    const auto found = std::find_if(rows.begin(), rows.end(), [&](const cairn::Option& o) {
      return o.info.name == wanted.info.name && o.member.index() == wanted.member.index();
    });
    return found == rows.end() ? nullptr : &*found;
  };
  const auto before = begin->options(), now = from.options();
  for (const bool texts : {true, false}) // a text may bring in options of its own
    for (cairn::Option& o : to.options())
      std::visit(
          [&](auto* member) {
            using Place = decltype(member);
            if (std::is_same_v<Place, std::string*> != texts) return;
            const cairn::Option *is = find(now, o), *was = find(before, o);
            if (!is || (was && same(std::get<Place>(is->member), std::get<Place>(was->member)))) return;
            if constexpr (std::is_same_v<Place, std::string*>) {
              const auto known = to.texts_of(o.info.name);
              if (std::find(known.begin(), known.end(), *std::get<Place>(is->member)) == known.end()) return;
            }
            *member = *std::get<Place>(is->member);
          },
          o.member);
}

// A strategy begins with the settings that it, or one of its class, was left with.
void choose_strategy(cairn_simulation& s, const std::string& name) {
  auto next = cairn::make_strategy(name);
  auto present = s.simulation.strategy().fresh();
  for (const auto& known : s.left)
    if (typeid(*known) == typeid(*next)) hand_on(*known, *next);
  hand_on(*present, *next);
  s.simulation.use(std::move(next));
  std::erase_if(s.left, [&](const auto& known) { return typeid(*known) == typeid(*present); });
  s.left.push_back(std::move(present));
}

// Internal order to the order of insertion, positions from relative to absolute.
template <class FieldOfNumbers>
void copy_field(const cairn::Scene& scene, const FieldOfNumbers& field, const std::vector<std::int32_t>& order,
                double* values) {
  const bool place = field.name == "position";
  for (std::size_t i = 0; i < order.size(); ++i)
    for (int c = 0; c < field.components; ++c)
      values[i * field.components + c] = double(field[order[i]][c]) + (place ? scene.origin[c] : 0.0);
}

template <class Holder>
void read_field(const cairn::Scene& scene, Holder& holder, const std::vector<std::int32_t>& order, const char* what,
                const char* name, std::int64_t capacity, double* values, std::int64_t* count) {
  bool found = false;
  std::string known;
  holder.for_each_field([&](auto& field) {
    if (field.active) known += (known.empty() ? "" : ", ") + std::string(field.name);
    if (field.name != name) return;
    found = true;
    const std::int64_t numbers = field.active ? holder.count * field.components : 0;
    if (count) *count = numbers;
    if (numbers == 0 || numbers > capacity) return;
    require(values, "values");
    copy_field(scene, field, order, values);
  });
  if (!found) throw Error(std::string(what) + " have no field '" + name + "'; they have " + known);
}

} // namespace

extern "C" {

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
    const cairn::NscdOptions strategy = strategy_of(chosen);
    auto made = std::make_unique<cairn_simulation>(
        cairn::Simulation(scene->scene, table_of(scene->matter, scene->scene.dim), strategy));
    made->matter = scene->matter;
    made->fingerprint = cairn::fingerprint(made->simulation.scene);
    GivenForces given;
    for (cairn::MeshModel mesh : scene->meshes) {
      if (mesh.bulk) { // history variables belong to a single simulation
        mesh.bulk->mesh = mesh.name;
        mesh.bulk = given.of(mesh.bulk);
      }
      made->simulation.add_mesh(std::move(mesh));
    }
    made->simulation.strategy().check_scene(made->simulation);
    made->transforms.came_in(made->simulation.scene);
    made->fluid = scene->fluid;
    made->fluid.settings.threads = chosen.threads;
    start_fluid(*made);
    given.stay();
    *simulation = made.release();
  });
}

void cairn_simulation_destroy(cairn_simulation* simulation) { delete simulation; }

int32_t cairn_simulation_step(cairn_simulation* simulation, double h, cairn_report* report, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_step");
    const AtWork work(*simulation, cairn_simulation::step);
    if (h > 0) simulation->transforms.load(simulation->simulation, h);
    const cairn::StepReport& r = simulation->simulation.step(h);
    if (report)
      *report = {r.step,           r.contacts,       int32_t(r.solve.status), r.solve.iterations,
                 r.time,           r.solve.error,    r.solve.worst_error,     r.solve.penetration,
                 r.energy.kinetic, r.energy.closure, r.energy.in_play};
    try {
      simulation->watches.look(simulation->simulation, simulation->transforms);
    } catch (const std::exception& e) {
      throw Error("the step was made, cairn_simulation_reshape_when could not reshape after it: " +
                  std::string(e.what()));
    }
  });
}

int32_t cairn_simulation_before_parts(cairn_simulation* simulation,
                                      void (*function)(cairn_simulation* simulation, double time, double h,
                                                       void* context),
                                      void* context, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_before_parts");
    simulation->simulation.before_part = nullptr;
    if (function)
      simulation->simulation.before_part = [=](double h) {
        const AtWork loads(*simulation, cairn_simulation::loads);
        function(simulation, simulation->simulation.time, h, context);
      };
  });
}

// ------------------------------------------------------------------ options

int32_t cairn_simulation_set_option(cairn_simulation* simulation, const char* name, const char* text,
                                    cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_option");
    require(name, "name");
    require(text, "text");
    if (std::string(name) == "strategy")
      choose_strategy(*simulation, text);
    else
      change_option(*simulation, [&](auto& strategy) { cairn::set_option(strategy, name, std::string(text)); });
  });
}

int32_t cairn_simulation_set_number(cairn_simulation* simulation, const char* name, double value, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_number");
    require(name, "name");
    change_option(*simulation, [&](auto& strategy) { cairn::set_option(strategy, name, value); });
  });
}

int32_t cairn_simulation_get_option(const cairn_simulation* simulation, const char* name, int64_t capacity, char* text,
                                    cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    const cairn::Simulation& s = simulation->simulation;
    if (std::string(name) == "strategy") return copy_text(s.strategy().name, capacity, text);
    copy_text(cairn::option_text(s.strategy(), name), capacity, text);
  });
}

int32_t cairn_simulation_get_number(const cairn_simulation* simulation, const char* name, double* value,
                                    cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    require(value, "value");
    *value = cairn::option_number(simulation->simulation.strategy(), name);
  });
}

// ------------------------------------------------------------------ what is changed between steps

int32_t cairn_simulation_set_gravity(cairn_simulation* simulation, const double* gravity, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_gravity", true);
    require(gravity, "gravity");
    cairn::Scene& scene = simulation->simulation.scene;
    for (int c = 0; c < scene.dim; ++c)
      if (!std::isfinite(gravity[c])) throw Error("gravity[" + std::to_string(c) + "] is not a finite number");
    std::copy_n(gravity, scene.dim, scene.gravity.begin());
  });
}

int32_t cairn_simulation_drive(cairn_simulation* simulation, int64_t n, const int64_t* bodies, uint8_t mask,
                               const double* velocity, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_drive", true);
    drive(simulation->simulation.scene, n, bodies, mask, velocity);
    if (simulation->simulation.controls) simulation->simulation.controls->release(span_of(bodies, n));
  });
}

int32_t cairn_simulation_set_body_field(cairn_simulation* simulation, const char* name, int64_t n,
                                        const int64_t* bodies, const double* values, cairn_error* error) {
  return guarded(error, [&] {
    require(name, "name");
    const std::string field = name;
    cairn::Simulation& s = between_steps(simulation, "cairn_simulation_set_body_field", is_load(field)).simulation;
    set_body_field(s.scene, field, n, bodies, values);
    if (!is_load(field)) s.strategy().changed(s, true);
  });
}

int32_t cairn_simulation_set_node_field(cairn_simulation* simulation, const char* name, int64_t n, const int64_t* nodes,
                                        const double* values, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_node_field");
    require(name, "name");
    require(values, "values");
    cairn::Simulation& s = simulation->simulation;
    const std::string field = name;
    if (field != "position" && field != "velocity")
      throw Error("the field '" + field + "' of nodes cannot be given; give position or velocity");
    if (!nodes && n != s.scene.nodes.count)
      throw Error("n is " + std::to_string(n) + " without numbers of nodes; there are " +
                  std::to_string(s.scene.nodes.count));
    const int dim = s.scene.dim;
    (field == "velocity" ? check_speed : check_finite)(name, values, counted(n) * dim);
    std::vector<std::int32_t> items = s.scene.node_insertion_order();
    if (nodes) items.clear();
    for (std::int64_t i = 0; nodes && i < n; ++i) items.push_back(s.scene.node(nodes[i]));
    for (std::int64_t i = 0; i < n * dim; ++i) {
      auto& to = field == "position" ? s.scene.nodes.position : s.scene.nodes.velocity;
      to[items[std::size_t(i / dim)]][i % dim] =
          values[i] - (field == "position" ? s.scene.origin[std::size_t(i % dim)] : 0.0);
    }
    s.strategy().changed(s, true);
  });
}

int32_t cairn_simulation_add_bodies(cairn_simulation* simulation, int64_t n, const double* position,
                                    const double* rotation, const double* velocity, const double* mass,
                                    const double* inertia, int64_t* first, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_bodies");
    const auto id = add_bodies(simulation->simulation.scene, n, position, rotation, velocity, mass, inertia);
    simulation->transforms.came_in(simulation->simulation.scene, id);
    if (first) *first = id;
  });
}

int32_t cairn_simulation_add_contactors(cairn_simulation* simulation, const char* shape, int64_t n, const int64_t* body,
                                        const int32_t* material, const double* radius, const double* offset,
                                        const double* direction, const int32_t* hull, int64_t* first,
                                        cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_contactors");
    require(material, "material");
    check_materials(n, material, simulation->matter.materials.size());
    check_fluid(*simulation, shape, n, body, material, radius);
    const auto id =
        add_contactors(simulation->simulation.scene, shape, n, body, material, radius, offset, direction, hull);
    renew_fluid(*simulation);
    if (first) *first = id;
  });
}

int32_t cairn_simulation_remove_bodies(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                       cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_remove_bodies");
    require(bodies, "bodies");
    simulation->simulation.remove_bodies(span_of(bodies, counted(n)));
  });
}

// ------------------------------------------------------------------ what is read

int64_t cairn_simulation_bodies(const cairn_simulation* simulation) {
  return simulation ? simulation->simulation.scene.bodies.count : 0;
}

int32_t cairn_simulation_body_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    cairn::Scene& scene = simulation->simulation.scene;
    read_field(scene, scene.bodies, scene.insertion_order(), "bodies", name, capacity, values, count);
  });
}

int64_t cairn_simulation_nodes(const cairn_simulation* simulation) {
  return simulation ? simulation->simulation.scene.nodes.count : 0;
}

int32_t cairn_simulation_node_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    cairn::Scene& scene = simulation->simulation.scene;
    read_field(scene, scene.nodes, scene.node_insertion_order(), "nodes", name, capacity, values, count);
  });
}

int32_t cairn_simulation_energy(const cairn_simulation* simulation, const char* term, double* value,
                                cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(term, "term");
    require(value, "value");
    // before the first step the energy is measured from the bodies, without effect on the simulation; not within a
    // step, in which bodies are already asked for their forces
    const cairn::Energy energy = simulation->work == cairn_simulation::nothing
                                     ? cairn::told_energy(const_cast<cairn_simulation*>(simulation)->simulation)
                                     : simulation->simulation.energy;
    std::string known;
    for (const auto& [name, member] : cairn::energy_terms()) {
      if (std::string(term) == name) {
        *value = energy.*member;
        return;
      }
      known += std::string(known.empty() ? "" : ", ") + name;
    }
    throw Error(std::string("the energy has no term '") + term + "'; it has " + known);
  });
}

int32_t cairn_simulation_report(const cairn_simulation* simulation, const char* name, double* value,
                                cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    require(value, "value");
    const cairn::StepReport& report = simulation->simulation.report;
    std::string known;
    for (const auto& [row, number] : cairn::report_numbers(report)) {
      if (std::string(name) == row) {
        *value = number;
        return;
      }
      known += std::string(known.empty() ? "" : ", ") + row;
    }
    throw Error(std::string("a step reports no number '") + name + "'; it reports " + known);
  });
}

int32_t cairn_simulation_report_text(const cairn_simulation* simulation, const char* name, int64_t capacity, char* text,
                                     cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    const cairn::StepReport& report = simulation->simulation.report;
    const char* const statuses[] = {"converged", "iteration_limit", "diverged", "newton_limit"};
    const std::string what = name;
    if (what == "status")
      copy_text(report.stable_step > 0 && report.solve.status == cairn::SolveStatus::converged
                    ? "explicit"
                    : statuses[int(report.solve.status)],
                capacity, text);
    else if (what == "solver")
      copy_text(report.solve.solver, capacity, text);
    else if (what == "hint")
      copy_text(report.solve.hint, capacity, text);
    else if (what == "warning")
      copy_text(cairn::warning_of(simulation->simulation), capacity, text);
    else
      throw Error("a step reports no text '" + what + "'; it reports status, solver, hint, warning");
  });
}

} // extern "C"
