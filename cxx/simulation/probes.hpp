// Numbers that are read from a run every so many steps.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../base/field.hpp"

namespace cairn {

class Simulation;

// "NAME.COMPONENT" of rigid bodies, a field as "position.z", "velocity.wy", "temperature", or "contact_force.x", the
// force of contacts on a body [N]; of the run "energy.TERM", "report.NUMBER", and of its periodic cell "stress.xx"
// [Pa], compression positive, "cell.xx", a component of its vectors [m].
class Probes {
public:
  // ids: of bodies, none: of all. take: "mean", "sum", "min" or "max" of them. keeps: all rows stay until clear().
  // Returns its number. Throws Error for a quantity that the scene has not.
  int add(const Simulation& s, const std::string& quantity, std::span<const std::int64_t> ids, const std::string& take,
          int every, bool keeps);
  void clear() { probes_.clear(); }
  void record(Simulation& s); // after each step
  bool reads_contacts() const;
  bool reads_bodies(std::int64_t step) const; // at the end of that step
  int count() const { return int(probes_.size()); }
  double last(int probe) const { return probes_[std::size_t(probe)].last; } // of the last step; no number: none was due
  const std::vector<double>& times(int probe) const { return probes_[std::size_t(probe)].time; }
  const std::vector<double>& values(int probe) const { return probes_[std::size_t(probe)].value; }

private:
  enum class Kind { field, contact_force, energy, report, stress, cell };
  enum class Take { mean, sum, least, most };
  struct Probe {
    Kind kind = Kind::field;
    std::string name;
    int component = 0;
    std::vector<std::int64_t> ids;
    Take take = Take::mean;
    int every = 1;
    bool keeps = false;
    double last = 0;
    std::vector<double> time, value;
  };
  double value_of(Simulation& s, const Probe& probe);
  const double* body_value(const Simulation& s, const Probe& probe, std::int32_t body) const;
  void mark_contactors(const Simulation& s);
  void find_contact_forces(Simulation& s);

  std::vector<Probe> probes_;
  std::vector<double> impulse_, contact_force_;      // (dim, contacts), (dim, bodies): of bodies that are asked for
  std::vector<std::uint8_t> of_body_, of_contactor_; // 1: asked for
  std::int64_t forces_of_ = -1;                      // the step
};

} // namespace cairn
