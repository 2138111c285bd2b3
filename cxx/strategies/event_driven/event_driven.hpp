// Event-driven dynamics: see event_driven.cpp in the folder above.
#pragma once
#include "../nscd/nscd.hpp"

namespace cairn::events {

struct Pair {
  std::int32_t a, b, body_a, body_b, image;
  int kind, impacts; // in this step
};

// Predicted impact of a pair, or the time at which a body (pair -1) may leave its neighbours; void when the event
// number of either has changed since.
struct Event {
  double time;
  std::int32_t pair, body, number_a, number_b;
};
bool later(const Event& one, const Event& other);

struct Contact {
  double gap = 0, normal[3] = {0, 0, 0}, point[3] = {0, 0, 0}; // point from the centre of A
  double speed = 0, push = 0; // of opening: its velocity, 0 to rounding, and acceleration
  double blur = 0;            // rounding of the gap [m]
  double still = 0;           // and of that velocity [m/s]
};

struct EventSettings {
  double tol = 1e-10, skin = std::numeric_limits<double>::quiet_NaN();
  int max_iter = 1000, impacts = 100, renumber_every = 1000;
};

class EventDriven final : public Strategy {
public:
  const StepReport& step(Simulation& s, double h) override;
  std::vector<std::string_view> stages(const Simulation&) const override { return {"fly", "persist"}; }
  std::vector<Option> options() override;
  std::unique_ptr<Strategy> fresh() const override;
  bool take_settings(Simulation& s, const Strategy& other) override;
  void check_scene(const Simulation& s) const override;
  void check_laws(const Simulation& s) const override;
  // Bodies in flight feel no law: none that keeps pairs, or acts across a gap.
  bool serves(const LawInfo& law) const override { return law.prepare != nullptr && !law.keeps && law.reach < 0; }
  ContactMemory memory(const Simulation& s) const override { return s.interactions.memory(); }
  void restore(Simulation& s, ContactMemory memory) override { s.interactions.restore(std::move(memory)); }
  bool has(const ContactFieldInfo&) const override { return true; }
  void read(Simulation& s, std::string_view field, int components, double* out) override;
  void status(Simulation& s, std::int32_t* out) override;
  std::int64_t body_bytes() const override { return std::int64_t(8 * (acceleration_.capacity() + at_.capacity())); }

private:
  void begin(Simulation& s, double h);
  void check_bodies(const Simulation& s) const;
  bool fly(Simulation& s); // false: it ended before the step
  void find_neighbours(Simulation& s);
  void advance(Simulation& s, std::int32_t body, double time);
  void advance_all(Simulation& s, double time);
  Contact look(const Simulation& s, const Pair& p, double time) const;
  double time_of_impact(const Simulation& s, const Pair& p, double from) const;
  void expect(const Simulation& s, std::int32_t pair, double from);
  void expect_to_leave(const Simulation& s, std::int32_t body, double from);
  void push(const Event& e);
  void gather(Simulation& s, std::int32_t pair, double time);
  bool impact(Simulation& s, std::int32_t pair, double time);
  void settle(Simulation& s);
  void solve_impacts(Simulation& s, bool plastic);
  void finish(Simulation& s);

  EventSettings settings_;
  Nscd persistent_; // makes the rest of a step whose flight ended
  double h_ = 0, now_ = 0, begin_kinetic_ = 0, potential_ = 0, external_ = 0;
  bool persists_ = false; // the last step ended so: contacts are those of NSCD
  Array<double> acceleration_, at_, room_, offset_, direction_, kept_position_, kept_velocity_, kept_rotation_;
  Array<std::int32_t> number_, first_pair_, place_, pair_of_, group_, bodies_;
  std::vector<std::pair<std::array<std::int32_t, 3>, int>> had_;
  int searches_ = 0; // of neighbours in the step
  std::vector<Pair> pairs_;
  std::vector<Event> queue_;
  Candidates found_, hit_;
  Array<double> impulse_, local_, after_, dissipated_;
  Array<std::int32_t> status_;
};

} // namespace cairn::events
