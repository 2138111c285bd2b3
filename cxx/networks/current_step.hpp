// Step of an electrical network.
#pragma once
#include "network_branches.hpp"
#include "oxide_films.hpp"

namespace cairn {

class CurrentStep {
public:
  CurrentStep(const NetworkUnknowns& rows, ContactSpots& spots, OxideFilms& films, NetworkBranches& branches)
      : rows_(rows), spots_(spots), films_(films), branches_(branches) {}
  // temperature: of the unknowns; null: the scene has none.
  void advance(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out, const double* temperature);
  std::int64_t bytes() const;

private:
  void begin(const Simulation& s, const NetworkInput& in);
  void solve(std::int64_t contacts, const NetworkInput& in, NetworkOutput& out);
  void settle(const Simulation& s, double h, NetworkOutput& out);

  const NetworkUnknowns& rows_;
  ContactSpots& spots_;
  OxideFilms& films_;
  NetworkBranches& branches_;
  // of unknowns: potential [V], current given and net current out [A], leak, held potentials
  std::vector<double> potential_, source_, net_, leak_;
  std::vector<std::uint8_t> held_;
  std::vector<double> clean_; // conductances of contacts without films
};

} // namespace cairn
