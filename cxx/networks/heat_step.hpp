// Step of a network of heat.
#pragma once
#include <utility>

#include "contact_spots.hpp"
#include "network_branches.hpp"

namespace cairn {

class HeatStep {
public:
  HeatStep(const NetworkUnknowns& rows, ContactSpots& spots, NetworkBranches& branches)
      : rows_(rows), spots_(spots), branches_(branches) {}
  // joule: powers that currents dissipate in contacts [W]; null: none. Time of flight before contacts is part of h.
  void advance(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out, const std::vector<double>* joule);
  void keep_impact_heat(Simulation& s, const NetworkInput& in, NetworkOutput& out);
  void forget_impacts() { owed_friction_ = 0, owed_.clear(); }

  // Temperatures of the unknowns at both ends of the last step [K].
  const std::vector<double>& begin() const { return begin_; }
  const std::vector<double>& end() const { return now_; }
  // Power that kept an unknown at its temperature in the last step [W]; 0 where nothing holds it. Undetermined, NaN,
  // where perfect conductors join several held ones: their sum alone follows from the balance.
  double held_power(std::size_t unknown) const;
  std::int64_t bytes() const;

private:
  void contact_heat(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out,
                    const std::vector<double>* joule);
  void begin_heat(const Simulation& s, const NetworkInput& in);
  double residual(double h, const NetworkInput& in);
  void slopes(double h, const NetworkInput& in);
  void solve_step(const Simulation& s, double h, const NetworkInput& in, NetworkOutput& out);
  void move(double factor);
  bool join_perfectly(const NetworkInput& in);
  void share_perfectly(double h, const NetworkInput& in, NetworkOutput& out);
  void settle(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out) const;
  double stored(std::size_t i, const NetworkInput& in) const; // by a body in the step [J]

  const NetworkUnknowns& rows_;
  ContactSpots& spots_;
  NetworkBranches& branches_;
  // of unknowns
  std::vector<double> begin_, now_, rise_;   // temperatures, and how they rise [K]
  std::vector<double> rise_low_, now_low_;   // what the sums beside lost
  std::vector<double> given_, contact_heat_; // [W], [J]
  std::vector<double> out_begin_, out_now_;  // flows out over branches [W]
  std::vector<double> x_, source_, leak_;
  std::vector<std::uint8_t> held_;
  // of branches: conductances at the begin and now; flows through perfect conductors [W]
  std::vector<double> early_, late_, perfect_;
  std::vector<double> clean_, local_;                 // of contacts: conductance, heat
  std::vector<std::pair<std::int64_t, double>> owed_; // heat of impacts, by ids of bodies [J]
  double owed_friction_ = 0;
  std::vector<std::int32_t> joined_;  // who stands for a body among those that perfect conductors join; empty: none
  std::vector<std::int32_t> holders_; // held unknowns among those that a root stands for; sized as joined_
  std::vector<double> lack_;          // of each body before its joined ones answer for it [W]
};

} // namespace cairn
