// Growth of rigid bodies at given rates: the packing of grains without gravity (Lubachevsky & Stillinger 1990, J. Stat.
// Phys. 60:561). Contacts take the growth of the last step as that of bodies which expand: NSCD parts what overlaps by
// it, smooth laws see the smaller gap.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "../base/call.hpp"
#include "../networks/network.hpp"
#include "controls.hpp"
#include "simulation.hpp"

namespace cairn {
namespace {

// Contactors that grow get a hull of their own each.
void part_hulls(Contactors& k, const std::vector<std::uint8_t>& grows) {
  if (!k.hull.active) return;
  std::vector<std::int32_t> uses(std::size_t(k.hulls.count()), 0);
  for (std::int64_t c = 0; c < k.count; ++c)
    if (*k.hull[c] >= 0) ++uses[std::size_t(*k.hull[c])];
  for (std::int64_t c = 0; c < k.count; ++c) {
    const std::int32_t hull = *k.hull[c];
    if (hull < 0 || *k.body[c] < 0 || !grows[std::size_t(*k.body[c])] || uses[std::size_t(hull)] < 2) continue;
    --uses[std::size_t(hull)];
    *k.hull[c] = k.hulls.copy(hull);
  }
}

// Throws Error if a law holds bodies of a material at points that would not grow with them.
void refuse_anchors(const Simulation& s, std::int32_t material) {
  for (std::int32_t other = 0; other < s.laws.materials(); ++other) {
    const int entry = s.laws.find(material, other);
    if (entry < 0) continue;
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
    if (law.anchored || law.joins)
      throw Error("law " + law.python_name + " holds bodies of material " + s.laws.name(material) +
                  " at points that do not grow with them: let them grow first, and give that law then");
  }
}

// Twice the kinetic energy of a body.
double twice_kinetic(const Bodies& b, std::int64_t i) {
  double twice = 0;
  for (int k = 0; k < b.dim; ++k) twice += *b.mass[i] * b.velocity[i][k] * b.velocity[i][k];
  for (int k = b.dim; k < b.dofs(); ++k) {
    const double spin = b.velocity[i][k];
    twice += spin * (b.angular_momentum.active ? b.angular_momentum[i][k - b.dim] : b.inertia[i][0] * spin);
  }
  return twice;
}

void scale_body(Bodies& b, std::int64_t i, double factor) {
  double mass = 1;
  for (int k = 0; k < b.dim; ++k) mass *= factor;
  *b.mass[i] *= mass;
  for (int k = 0; k < b.inertia.components; ++k) b.inertia[i][k] *= mass * factor * factor;
  for (int k = 0; b.angular_momentum.active && k < b.angular_momentum.components; ++k)
    b.angular_momentum[i][k] *= mass * factor * factor;
}

void scale_contactor(Contactors& k, int dim, std::int64_t c, double factor) {
  *k.radius[c] *= factor;
  for (int d = 0; k.offset.active && d < dim; ++d) k.offset[c][d] *= factor;
  if (k.direction.active) k.direction[c][dim] *= factor;
  if (k.hull.active && *k.hull[c] >= 0) k.hulls.scale(*k.hull[c], factor);
}

} // namespace

bool Simulation::expands() const {
  if (!networks || !networks->thermal) return false;
  const auto& materials = networks->thermal->materials;
  return std::any_of(materials.begin(), materials.end(),
                     [](const NetworkMaterial& m) { return m.expansion < 0 || m.expansion > 0; });
}

void Controls::grow(Simulation& s, std::span<const std::int64_t> ids, Expression rate) {
  Scene& scene = s.scene;
  if (s.expands()) throw Error("bodies grow with their temperature: no rate can be given beside that");
  Growth made{{ids.begin(), ids.end()}, std::move(rate), {}};
  std::vector<std::uint8_t> grows(std::size_t(scene.bodies.count), 0);
  for (const std::int64_t id : made.ids) {
    const std::int32_t i = scene.internal(id);
    if (!std::isfinite(*scene.bodies.mass[i]))
      throw Error("body " + std::to_string(id) + " has no finite mass, and cannot grow: name grains alone");
    grows[std::size_t(i)] = 1;
  }
  const Contactors& k = scene.contactors;
  std::vector<std::uint8_t> seen(std::size_t(s.laws.materials()), 0);
  for (std::int64_t c = 0; c < k.count; ++c) {
    const auto material = std::size_t(*k.material[c]);
    if (*k.body[c] < 0 || !grows[std::size_t(*k.body[c])] || seen[material]) continue;
    seen[material] = 1;
    refuse_anchors(s, std::int32_t(material));
  }
  stop_growth(ids);
  scene.activate(Need::growing);
  part_hulls(scene.contactors, grows);
  growths_.push_back(std::move(made));
  order_ = -1;
  s.forget_contacts();
}

void Controls::stop_growth(std::span<const std::int64_t> ids) {
  std::vector<std::int64_t> sorted(ids.begin(), ids.end());
  std::sort(sorted.begin(), sorted.end());
  for (Growth& g : growths_)
    std::erase_if(g.ids, [&](std::int64_t id) { return std::binary_search(sorted.begin(), sorted.end(), id); });
  std::erase_if(growths_, [](const Growth& g) { return g.ids.empty(); });
  order_ = -1;
}

void Controls::grow_bodies(Simulation& s, double h) {
  if (growths_.empty()) return;
  Bodies& b = s.scene.bodies;
  Contactors& k = s.scene.contactors;
  find_places(s);
  double gained = 0;
  for (const Growth& g : growths_) {
    const double rate = g.rate(begin_ + h / 2), factor = std::exp(h * rate);
    if (!std::isfinite(rate) || !(factor > 0) || !std::isfinite(factor))
      throw Error("the rate of growth of body " + std::to_string(g.ids.front()) + ", " + g.rate.text() + ", is " +
                  std::to_string(rate) + " 1/s at " + std::to_string(begin_ + h / 2) +
                  " s: give a function that is finite, and no more than a share of a size in a step");
    for (const std::int32_t i : g.place) {
      *b.stretch[i] = factor - 1;
      gained -= twice_kinetic(b, i) / 2;
      scale_body(b, i, factor);
      gained += twice_kinetic(b, i) / 2;
    }
  }
  for (std::int64_t c = 0; c < k.count; ++c)
    if (const std::int32_t body = *k.body[c]; body >= 0)
      if (const double share = *b.stretch[body]; share < 0 || share > 0) scale_contactor(k, s.scene.dim, c, 1 + share);
  s.energy.kinetic += gained;
  s.energy.work_growth += gained;
  s.energy.turned_over += std::abs(gained);
}

// After a step: what grew in it; nothing, if nothing drives growth any more.
void Simulation::grow_bodies(double h) {
  Bodies& b = scene.bodies;
  if (!b.stretch.active || expands()) return;
  b.stretch_before.values = b.stretch.values;
  std::fill(b.stretch.values.begin(), b.stretch.values.end(), 0.0);
  if (controls) controls->grow_bodies(*this, h);
}

} // namespace cairn
