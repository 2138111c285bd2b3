// Branches of a network: those of contacts, those that are given, those between the bodies of an electrode.
#pragma once
#include <cstdint>
#include <vector>

#include "network_output.hpp"
#include "network_unknowns.hpp"

namespace cairn {

class NetworkBranches {
public:
  std::vector<std::int32_t> a, b;             // unknowns at both ends
  std::vector<std::int32_t> of_contact;       // contact of each of the first branches
  std::int64_t of_contacts = 0;               // as many are of contacts
  std::vector<double> weight, value, through; // share of its contact; conductance; flow from a to b

  explicit NetworkBranches(const NetworkUnknowns& rows) : rows_(rows) {}
  void lay(const Simulation& s);
  // Conductances from those of contacts and from those that are given.
  void weigh(const std::vector<double>& of_contact_values, const NetworkInput& in);
  void join_electrodes(const NetworkInput& in);
  // Solves the balances of the unknowns: sources, leaks to 0, held values; x: in, start; out, values.
  ConductionReport solve(const NetworkInput& in, const std::vector<double>& source, const std::vector<double>& leak,
                         const std::vector<std::uint8_t>& held, double* x, NetworkReport& report);
  std::int64_t bytes() const;

private:
  const NetworkUnknowns& rows_;
  Conduction conduction_;
};

} // namespace cairn
