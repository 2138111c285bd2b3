// How a scene moves: the interface behind Simulation::step. Each strategy is a page of cxx/strategies and a row of
// strategies.def.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "../contacts/interaction.hpp"

namespace cairn {

class ParticleShares;
class Simulation;
struct ContactFieldInfo;
struct StepReport;

// A setting that callers give by name.
struct OptionInfo {
  std::string_view name, kind, ends, meaning; // kind: number, whole, flag, text; ends: [ and ], ( and )
  double smallest = 0, largest = 0;
};
struct Option {
  OptionInfo info;
  std::variant<bool*, int*, double*, std::string*> member;
  bool may_lack = false; // NaN: found from the scene
};

class Strategy {
public:
  virtual ~Strategy() = default;

  virtual const StepReport& step(Simulation& s, double h) = 0;
  // Names of its stages, as the seconds that each took are kept.
  virtual std::vector<std::string_view> stages(const Simulation& s) const = 0;

  // Settings, each with the place where it is kept. check_options() throws Error if they contradict each other.
  virtual std::vector<Option> options() = 0;
  virtual void check_options() const {}
  virtual std::vector<std::string> texts_of(std::string_view option) const; // that a text may be
  // New strategy of the same class and settings, without memory.
  virtual std::unique_ptr<Strategy> fresh() const = 0;
  // Takes over the settings of another strategy of the same class and goes on; false if the class differs.
  virtual bool take_settings(Simulation& s, const Strategy& other) = 0;

  // Throw Error naming bodies and routines that the strategy cannot move, as soon as it is chosen, and laws, when it
  // steps.
  virtual void check_scene(const Simulation&) const {}
  virtual void check_laws(const Simulation& s) const = 0;
  // The law has the slots that this strategy calls.
  virtual bool serves(const LawInfo& law) const = 0;

  // Bodies, laws or numbers changed from outside; places: so did positions or velocities, and forces are not those of
  // the last step.
  virtual void changed(Simulation&, bool places) { (void)places; }
  // `call` is made of the simulation: over ranks, all have to make it. Throws Error with the calls if they do not.
  virtual void meet(std::string_view call) const { (void)call; }
  // Contact memory between steps, for a checkpoint.
  virtual ContactMemory memory(const Simulation& s) const = 0;
  virtual void restore(Simulation& s, ContactMemory memory) = 0;
  virtual ContactMemory projection_memory() const { return {}; }
  virtual void restore_projection(const Simulation&, const ContactMemory&) {}
  // Keys of contacts follow bodies that went over into another image of the cell, and a cell that leans less.
  virtual void move_images(const Simulation&, const std::vector<std::array<int, 3>>&) {}
  virtual void lean_images(int, int, int) {}

  // Contacts of the last step become readable in Simulation::candidates.
  virtual void view(Simulation&) {}
  virtual bool has(const ContactFieldInfo&) const { return true; }
  // A field that is neither of detection nor of scene: out (components, contacts).
  virtual void read(Simulation& s, std::string_view field, int components, double* out) = 0;
  virtual void status(Simulation& s, std::int32_t* out) = 0; // see cairn_contact_status

  // The largest step that is stable where contacts are as they stand [s]; inf: any.
  virtual double stable_step(Simulation&) { return std::numeric_limits<double>::infinity(); }
  // Scheme of a step, where deformable bodies may move beside a weakly compressible liquid; false: they may not.
  virtual bool scheme_beside_fluid(double, cairn_scheme&) const { return false; }
  // Share of the end of a step of h [s] in the mean of loads over it.
  virtual double end_share(double) const { return 0.5; }
  // Ranks that share the sums over the particles of a liquid in the step that begins; null: there are none.
  virtual std::shared_ptr<ParticleShares> share_particles(Simulation&, double) { return nullptr; }
  // Makes work whose results all ranks share: an error of one process alone ends the others, which wait for it.
  virtual void together(const std::function<void()>& work) { work(); }
  // Numbers that it found from the scene, by name, for explain().
  virtual std::vector<std::pair<std::string_view, double>> figures(Simulation&) { return {}; }
  virtual std::int64_t body_bytes() const { return 0; }
  virtual std::int64_t contact_bytes() const { return 0; }

  std::string name; // of its row
};

struct StrategyInfo {
  std::string_view name, python_name, meaning;
  std::unique_ptr<Strategy> (*make)();
};
const std::vector<StrategyInfo>& strategy_infos();
// With the settings of its page. Throws Error with the names that there are.
std::unique_ptr<Strategy> make_strategy(const std::string& name);

} // namespace cairn
