#include "../networks/network.hpp"

#include <algorithm>

#include "../networks/network_parts.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

double PropertyTable::at(double t) const {
  if (value.empty()) return 0;
  if (value.size() == 1 || !(t > temperature.front())) return value.front();
  if (!(t < temperature.back())) return value.back();
  const auto k = std::size_t(std::upper_bound(temperature.begin(), temperature.end(), t) - temperature.begin());
  const double share = (t - temperature[k - 1]) / (temperature[k] - temperature[k - 1]);
  return value[k - 1] + share * (value[k] - value[k - 1]);
}

double PropertyTable::integral(double t) const {
  if (value.size() <= 1) return value.empty() ? 0 : value[0] * t;
  if (t <= temperature.front()) return value.front() * (t - temperature.front());
  double sum = 0;
  for (std::size_t k = 1; k < value.size(); ++k) {
    const double end = std::min(t, temperature[k]);
    sum += 0.5 * (value[k - 1] + at(end)) * (end - temperature[k - 1]);
    if (t <= temperature[k]) return sum;
  }
  return sum + value.back() * (t - temperature.back());
}

double NetworkMaterial::enthalpy(double t) const {
  const double taken = latent > 0 ? latent * std::clamp((t - melts) / (molten - melts), 0.0, 1.0) : 0;
  return capacity.integral(t) + taken;
}

double NetworkMaterial::enthalpy_slope(double t) const {
  return capacity.at(t) + (latent > 0 && t >= melts && t < molten ? latent / (molten - melts) : 0);
}

Network::Network() : parts_(std::make_unique<Parts>()) {}
Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

void Network::keep_impact_heat(Simulation& s) {
  parts_->rows.place(s, *this);
  parts_->heat.keep_impact_heat(s, *this, *this);
}

void Network::forget_flight() {
  flown = 0;
  parts_->heat.forget_impacts();
}

// Makes room for results of the contacts of a step, and reads the contacts.
static void begin_step(Simulation& s, double h, Network& network, NetworkUnknowns& rows, ContactSpots& spots) {
  rows.place(s, network);
  for (auto* v : {&network.conductance, &network.flow, &network.power}) fit(*v, std::size_t(s.candidates.count));
  spots.gather(s, h, network);
  network.report = {};
}

void Network::advance_potential(Simulation& s, double h, const Network* thermal) {
  begin_step(s, h, *this, parts_->rows, parts_->spots);
  const double* warm = values_of(s.scene.bodies.temperature, s.scene.nodes.temperature, parts_->warm);
  parts_->current.advance(s, h + flown, *this, *this, thermal ? thermal->seen(warm) : warm);
}

void Network::advance_temperature(Simulation& s, double h, const Network* electrical) {
  begin_step(s, h, *this, parts_->rows, parts_->spots);
  HeatStep& heat = parts_->heat;
  heat.advance(s, h + flown, *this, *this, electrical ? &electrical->power : nullptr);
  report.coupling = parts_->loads.coupling(s, *this, heat.begin(), heat.end());
  parts_->growth.grow(s, *this, heat.begin(), heat.end());
}

void Network::load_meshes(Simulation& s) { parts_->loads.load_meshes(s, *this); }
void Network::separate_hulls(Scene& scene) { parts_->growth.separate_hulls(scene, *this); }
void Network::remember_shapes(const Scene& scene, const Network* before) {
  parts_->growth.remember_shapes(scene, before ? &before->parts_->growth : nullptr);
}
const double* Network::seen(const double* at_begin) const { return parts_->loads.seen(at_begin); }
void Network::expect(std::vector<double> end) { parts_->loads.expect(std::move(end)); }
void Network::changed() { parts_->rows.order = -1; }
double Network::held_power(std::size_t unknown) const { return parts_->heat.held_power(unknown); }

std::int64_t Network::bytes() const {
  std::int64_t sum = parts_->rows.bytes() + parts_->spots.bytes() + parts_->films.bytes() + parts_->branches.bytes() +
                     parts_->current.bytes() + parts_->heat.bytes();
  for (const auto* v : {&conductance, &flow, &power}) sum += std::int64_t(8 * v->capacity());
  return sum + std::int64_t(sizeof(ContactKey) * broken_keys.capacity());
}

// Value of the body that carries a contactor; value: per unknown; for a mesh contactor the mean over its nodes.
double value_at(const Simulation& s, const double* value, std::int32_t contactor) {
  const std::int32_t body = *s.scene.contactors.body[contactor];
  if (body >= 0) return value[body];
  const MeshSet::Middle& middle = s.meshes.middle(contactor);
  double sum = 0;
  for (int j = 0; j < 4 && middle.node[j] >= 0; ++j)
    sum += middle.weight[j] * value[unknown_of_node(s.scene, middle.node[j])];
  return sum;
}

void Networks::advance(Simulation& s, double h) {
  s.strategy().view(s);
  if (electrical) electrical->advance_potential(s, h, thermal ? &*thermal : nullptr);
  if (thermal) thermal->advance_temperature(s, h, electrical ? &*electrical : nullptr);
  forget_flight();
}

void Networks::keep_flight(Simulation& s, double time) {
  if (electrical) electrical->flown = time;
  if (!thermal) return;
  thermal->flown = time;
  thermal->keep_impact_heat(s);
}

void Networks::forget_flight() {
  if (electrical) electrical->forget_flight();
  if (thermal) thermal->forget_flight();
}

std::int64_t Networks::bytes() const {
  return (electrical ? electrical->bytes() : 0) + (thermal ? thermal->bytes() : 0);
}

} // namespace cairn
