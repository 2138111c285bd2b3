#include "simulation.hpp"

#include <cmath>

#include "../base/call.hpp"
#include "../fluid/fluid.hpp"
#include "../networks/network.hpp"
#include "controls.hpp"
#include "probes.hpp"

namespace cairn {

Simulation::Simulation(Scene s, LawTable l, std::unique_ptr<Strategy> strategy)
    : scene(std::move(s)), laws(std::move(l)), interactions(scene.dim), strategy_(std::move(strategy)) {
  scene.renumber();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

void Simulation::use(std::unique_ptr<Strategy> next) {
  next->check_scene(*this);
  if (strategy_->take_settings(*this, *next)) return;
  interactions.restore({});
  strategy_ = std::move(next);
  report.events = -1;
  report.persistent = report.stable_step = 0;
  report.neighbour_lists = 0;
  forget_contacts();
}

void Simulation::use(LawTable table) {
  std::swap(laws, table);
  try {
    strategy_->check_laws(*this);
  } catch (...) {
    std::swap(laws, table);
    throw;
  }
  if (networks) // they have a row for each material, those of the ends of joints too
    for (auto* network : {&networks->electrical, &networks->thermal})
      if (*network && (*network)->materials.size() < std::size_t(laws.materials()))
        (*network)->materials.resize(std::size_t(laws.materials()));
  strategy_->changed(*this, false);
}

const StepReport& Simulation::step(double h) {
  if (!fluid) return step_of_bodies(h);
  fluid->use(strategy_->share_particles(*this, h));
  if (fluid->incompressible()) {              // within the step of the bodies
    if (!strategy_->name.starts_with("nscd")) // over ranks, too
      throw Error("the incompressible fluid is solved with the contacts of NSCD, and " + strategy_->name +
                  " has none: take NSCD, or leave out incompressible");
    if (cairn_scheme scheme; !strategy_->scheme_beside_fluid(h, scheme))
      throw Error(
          "the incompressible fluid moves by the theta-method of NSCD: leave out integrator, or incompressible");
    return step_of_bodies(h);
  }
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  FluidStep beside;
  if (fluid->meets_meshes()) {
    if (!strategy_->scheme_beside_fluid(h, beside.scheme))
      throw Error("deformable bodies move beside the fluid by the theta-method of NSCD: leave out integrator, or take "
                  "NSCD in the place of " +
                  strategy_->name);
    place_meshes();
    if (!held_motions.empty()) move_held(*this, h);
    beside.meshes = &meshes;
    beside.time = time;
  }
  if (controls) controls->apply_to_bodies(*this, h, strategy_->end_share(h)); // sub-steps have the loads of this step
  timed("move_fluid", [&] { strategy_->together([&] { fluid->advance(scene, h, beside); }); });
  try {
    step_of_bodies(h);
  } catch (...) {
    fluid->undo(scene);
    throw;
  }
  fluid->end(scene, h);
  if (const std::string& cause = fluid->report.too_fast; !cause.empty()) {
    report.solve.status = SolveStatus::diverged;
    report.solve.hint = cause;
  }
  return report;
}

const StepReport& Simulation::step_of_bodies(double h) {
  if (!held_motions.empty() && h > 0 && std::isfinite(h)) move_held(*this, h); // else the strategy refuses the step
  const StepReport& made = networks && networks->repeats() ? step_coupled(*this, h) : strategy_->step(*this, h);
  grow_bodies(h);
  if (probes) probes->record(*this);
  return made;
}

Controls& Simulation::controlled() {
  if (!controls) controls = std::make_unique<Controls>();
  return *controls;
}

void Simulation::apply_controls(double h, double end_share, bool cell_may_follow) {
  if (!controls) return;
  controls->apply(*this, h, end_share, cell_may_follow);
  if (fluid) controls->each_pressed_body([&](std::int64_t id) { fluid->add_force_again(scene, id); });
}

void Simulation::advance_networks(double h) {
  if (networks) timed("advance_networks", [&] { networks->advance(*this, h); });
}

void Simulation::forget_contacts() {
  candidates.count = 0;
  contacts_known = false;
  strategy_->changed(*this, false);
}

std::pair<std::int64_t, std::int64_t> Simulation::bytes() {
  std::int64_t bodies = 0;
  auto add = [&bodies](auto& field) { bodies += field.values.capacity() * sizeof(field.values[0]); };
  scene.bodies.for_each_field(add);
  scene.nodes.for_each_field(add);
  scene.contactors.for_each_field(add);
  bodies += strategy_->body_bytes() + handler.bytes() + interactions.body_bytes();
  for (const auto* order :
       {&scene.insertion_order(), &scene.node_insertion_order(), &scene.contactor_insertion_order()})
    bodies += 4 * std::int64_t(order->capacity());
  std::int64_t contacts = interactions.bytes() + strategy_->contact_bytes();
  contacts += 4 * (candidates.contactor_a.capacity() + candidates.contactor_b.capacity() +
                   candidates.feature.capacity() + candidates.image.capacity());
  contacts += 8 * (candidates.gap.capacity() + candidates.normal.capacity() + candidates.point.capacity());
  for (const MeshBody& mesh : meshes.meshes) bodies += mesh.bytes();
  if (networks) contacts += networks->bytes();
  if (fluid) bodies += fluid->bytes();
  return {bodies, contacts};
}

bool Simulation::laws_keep() const {
  return std::any_of(laws.laws().begin(), laws.laws().end(),
                     [](Law law) { return law_infos()[std::size_t(law)].keeps; });
}

} // namespace cairn
