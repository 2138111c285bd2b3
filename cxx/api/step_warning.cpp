#include "step_warning.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "../contactors/shapes.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {
namespace {

constexpr double deep = 0.5; // of the size of the smaller body, as cairn.OverlapWarning has it

std::string id_of(const Simulation& s, std::int32_t contactor) {
  return std::to_string(*s.scene.bodies.id[*s.scene.contactors.body[contactor]]);
}

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

std::string overlap(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  double most = 0;
  std::int64_t worst = -1;
  for (std::int64_t i = 0; i < s.candidates.count; ++i) {
    const std::int32_t a = s.candidates.contactor_a[std::size_t(i)], b = s.candidates.contactor_b[std::size_t(i)];
    if (*c.body[a] < 0 || *c.body[b] < 0) continue;
    const double of_a = c.size(a), of_b = c.size(b);
    const double size = of_a > 0 && of_b > 0 ? std::min(of_a, of_b) : std::max(of_a, of_b);
    if (const double gap = s.candidates.gap[std::size_t(i)]; size > 0 && -gap > most * size)
      most = -gap / size, worst = i;
  }
  if (!(most > deep)) return {};
  return "bodies " + id_of(s, s.candidates.contactor_a[std::size_t(worst)]) + " and " +
         id_of(s, s.candidates.contactor_b[std::size_t(worst)]) + " overlap by " + number(most) +
         " of the smaller one's size; ";
}

std::string way(const Simulation& s) {
  if (!(s.report.way > 1)) return {};
  const std::string size = s.report.stable_step > 0 ? " times the size of the smallest" : " times its size";
  return "a body moved by " + number(s.report.way) + size + ", and may have passed through others; ";
}

// Pairs of shapes in the order of the first contactors that have them.
std::string unmet(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  const Bodies& b = s.scene.bodies;
  struct Kind {
    int shape, material;
    std::int32_t first, other; // contactors of two bodies, first that of a free body; -1: a single body
  };
  const auto free = [&](std::int32_t contactor) {
    const double* inverse = b.inverse_mass[*c.body[contactor]];
    return std::any_of(inverse, inverse + b.dofs(), [](double x) { return x > 0; });
  };
  std::vector<Kind> kinds;
  for (std::int32_t k = 0; k < std::int32_t(c.count); ++k) {
    if (*c.body[k] < 0) continue;
    const int shape = int(*c.shape[k]), material = int(*c.material[k]);
    const auto at = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const Kind& of) { return of.shape == shape && of.material == material; });
    if (at == kinds.end()) {
      kinds.push_back({shape, material, k, -1});
      continue;
    }
    if (*c.body[k] == *c.body[at->first] || (at->other >= 0 && free(at->first))) continue;
    if (at->other < 0) at->other = k;
    if (!free(at->first) && free(k)) at->other = at->first, at->first = k;
  }
  const auto known = pairs_of_shapes();
  std::string told;
  for (std::size_t i = 0; i < kinds.size(); ++i)
    for (std::size_t j = i; j < kinds.size(); ++j) {
      const Kind &one = kinds[i], &two = kinds[j];
      const std::string a = shape_table[one.shape].name, of = shape_table[two.shape].name;
      const std::int32_t other = i == j || *c.body[one.first] == *c.body[two.first] ? two.other : two.first;
      if (other < 0 || !(free(one.first) || free(other)) || s.laws.find(one.material, two.material) < 0) continue;
      if (!shape_table[one.shape].bounded && !shape_table[two.shape].bounded) continue; // these always cross
      const bool meets = std::any_of(known.begin(), known.end(), [&](const auto& pair) {
        return (pair.first == a && pair.second == of) || (pair.first == of && pair.second == a);
      });
      std::string text = "there is no contact between shapes ";
      text.append(a).append(" and ").append(of).append(": bodies such as ");
      if (meets || told.find(text) != std::string::npos) continue;
      told.append(text).append(id_of(s, one.first)).append(" and ");
      told.append(id_of(s, other)).append(" pass through each other; ");
    }
  return told;
}

} // namespace

std::string warning_of(const Simulation& s) {
  std::string all = overlap(s) + way(s) + unmet(s);
  if (!all.empty()) all.resize(all.size() - 2);
  return all;
}

} // namespace cairn
