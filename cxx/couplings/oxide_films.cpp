#include "../networks/oxide_films.hpp"

#include "../detection/key_search.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

void OxideFilms::recall(const Simulation& s, const NetworkInput& in, const ContactSpots& spots,
                        const std::vector<ContactKey>& broken_keys) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  broken.assign(std::size_t(c.count), std::int8_t(0));
  if (!in.film) return;
  scratch_.begin();
  const auto key_of = [&](std::int64_t i) {
    return ContactKey{*k.id[c.contactor_a[i]], *k.id[c.contactor_b[i]], c.feature[i], c.image[i]};
  };
  auto* place = scratch_.take<std::int32_t>(c.count);
  find_keys(broken_keys, c.count, key_of, 1, scratch_, place);
  for (std::int64_t i = 0; i < c.count; ++i)
    broken[i] = spots.force[i] > 0 && (place[i] >= 0 || spots.sliding[i] > in.film->sliding);
}

void OxideFilms::remember(const Simulation& s, const NetworkInput& in, std::vector<ContactKey>& broken_keys) const {
  if (!in.film) return;
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  broken_keys.clear();
  for (std::int64_t i = 0; i < c.count; ++i)
    if (broken[i]) broken_keys.push_back({*k.id[c.contactor_a[i]], *k.id[c.contactor_b[i]], c.feature[i], c.image[i]});
}

} // namespace cairn
