// Oxide films of contacts: which are gone.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/scratch.hpp"
#include "contact_spots.hpp"
#include "network_output.hpp"

namespace cairn {

class OxideFilms {
public:
  std::vector<std::int8_t> broken; // of each contact

  // Films that were gone stay so while their contacts live; sliding takes further ones.
  void recall(const Simulation& s, const NetworkInput& in, const ContactSpots& spots,
              const std::vector<ContactKey>& broken_keys);
  void remember(const Simulation& s, const NetworkInput& in, std::vector<ContactKey>& broken_keys) const;
  std::int64_t bytes() const { return scratch_.bytes(); }

private:
  Scratch scratch_;
};

} // namespace cairn
