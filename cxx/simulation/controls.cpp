#include "controls.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../base/call.hpp"
#include "simulation.hpp"

namespace cairn {

namespace {

// of: gives the name of the driven part, for a message alone, since a step allocates nothing.
template <class Name>
double number_at(const Expression& f, double t, const char* what, Name&& of) {
  const double value = f(t);
  if (!std::isfinite(value))
    throw Error(std::string(what) + " of " + of() + ", " + f.text() + ", is " + std::to_string(value) + " at " +
                std::to_string(t) + " s: give a function that is finite");
  return value;
}

std::string name_of_component(int i, int j) {
  std::string name(2, "xyz"[i]);
  name[1] = "xyz"[j];
  return name;
}

} // namespace

void Controls::release(std::span<const std::int64_t> ids) {
  std::vector<std::int64_t> sorted(ids.begin(), ids.end());
  std::sort(sorted.begin(), sorted.end());
  for (Drive& d : drives_)
    std::erase_if(d.ids, [&](std::int64_t id) { return std::binary_search(sorted.begin(), sorted.end(), id); });
  std::erase_if(drives_, [](const Drive& d) { return d.ids.empty(); });
  order_ = -1;
}

void Controls::release_cell(Simulation& s) {
  Cell& cell = s.scene.cell;
  for (const Component& c : components_) cell.velocity_gradient[c.i + 3 * c.j] = 0;
  for (int k = 0; keeps_volume_ && k < 3; ++k) cell.velocity_gradient[4 * k] = 0;
  std::fill(std::begin(cell.follows), std::end(cell.follows), false);
  components_.clear();
  keeps_volume_ = false;
}

void Controls::drive(Simulation& s, std::span<const std::int64_t> ids, int dof, Expression velocity) {
  Bodies& b = s.scene.bodies;
  if (dof < 0 || dof >= b.dofs())
    throw Error("dof is " + std::to_string(dof) + ": give 0 to " + std::to_string(b.dofs() - 1));
  Drive made{{ids.begin(), ids.end()}, dof, std::move(velocity), {}};
  for (const std::int64_t id : ids) made.place.push_back(s.scene.internal(id));
  std::vector<std::int64_t> sorted = made.ids;
  std::sort(sorted.begin(), sorted.end());
  for (Drive& other : drives_)
    if (other.dof == dof)
      std::erase_if(other.ids, [&](std::int64_t id) { return std::binary_search(sorted.begin(), sorted.end(), id); });
  std::erase_if(drives_, [](const Drive& d) { return d.ids.empty(); });
  s.scene.activate(Need::driven);
  for (const std::int32_t i : made.place) *b.driven[i] = std::uint8_t(*b.driven[i] | 1 << dof);
  drives_.push_back(std::move(made));
  order_ = -1;
}

void Controls::press(Simulation& s, Servo servo) {
  s.scene.internal(servo.body);
  double length = 0;
  for (int k = 0; k < s.scene.dim; ++k) length += servo.normal[std::size_t(k)] * servo.normal[std::size_t(k)];
  if (!(length > 0) || !std::isfinite(length)) throw Error("normal has no length: give a vector out of the solid");
  std::erase_if(servos_, [&](const Servo& other) { return other.body == servo.body; });
  servos_.push_back(std::move(servo));
}

void Controls::add_component(Simulation& s, const std::string& name, bool follows, Expression value) {
  const int dim = s.scene.dim, i = name.size() == 2 ? name[0] - 'x' : -1, j = name.size() == 2 ? name[1] - 'x' : -1;
  if (i < 0 || i > j || j >= dim)
    throw Error("component is '" + name + "': give " + (dim == 2 ? "xx, yy or xy" : "xx, yy, zz, xy, xz or yz"));
  const Cell& cell = s.scene.cell;
  bool periodic = cell.periodic[i] && cell.periodic[j];
  for (int k = 0; follows && k < dim; ++k) periodic = periodic && cell.periodic[k];
  if (!periodic)
    throw Error("component " + name + " of the cell is given, and the cell is not periodic along " +
                (follows ? "all axes, which a stress needs" : "its axes") + ": give its lengths, or leave it out");
  std::erase_if(components_, [&](const Component& c) { return c.i == i && c.j == j; });
  components_.push_back({i, j, follows, std::move(value)});
}

void Controls::drive_cell(Simulation& s, const std::string& component, Expression rate) {
  add_component(s, component, false, std::move(rate));
}

void Controls::press_cell(Simulation& s, const std::string& component, Expression pressure) {
  add_component(s, component, true, std::move(pressure));
}

void Controls::keep_volume(Simulation& s, bool keep) {
  const Cell& cell = s.scene.cell;
  for (int k = 0; keep && k < s.scene.dim; ++k)
    if (!cell.periodic[k]) throw Error("the volume of a cell is kept, and it is not periodic along all axes");
  keeps_volume_ = keep;
  volume_ = cell.vectors[0] * cell.vectors[4] * (s.scene.dim == 2 ? 1 : cell.vectors[8]);
}

void Controls::weigh_cell(Simulation& s, double share, double depth) {
  if (!(share > 0) || !std::isfinite(share))
    throw Error("inertia of the cell is " + std::to_string(share) + ": give a positive number");
  if (!(depth > 0) || !std::isfinite(depth))
    throw Error("depth is " + std::to_string(depth) + ": give a positive length [m]");
  cell_mass_ = share;
  s.scene.cell.depth = depth_ = depth;
}

void Controls::find_places(Simulation& s) {
  if (order_ == s.scene.order_version() && bodies_ == s.scene.bodies.count) return;
  for (Drive& d : drives_) {
    d.place.clear();
    std::erase_if(d.ids, [&](std::int64_t id) { return s.scene.find_body(id) < 0; });
    for (const std::int64_t id : d.ids) d.place.push_back(s.scene.find_body(id));
  }
  std::erase_if(drives_, [](const Drive& d) { return d.ids.empty(); });
  std::erase_if(servos_, [&](const Servo& one) { return s.scene.find_body(one.body) < 0; });
  for (Growth& g : growths_) {
    g.place.clear();
    std::erase_if(g.ids, [&](std::int64_t id) { return s.scene.find_body(id) < 0; });
    for (const std::int64_t id : g.ids) g.place.push_back(s.scene.find_body(id));
  }
  std::erase_if(growths_, [](const Growth& g) { return g.ids.empty(); });
  order_ = s.scene.order_version();
  bodies_ = s.scene.bodies.count;
}

void Controls::apply_to_bodies(Simulation& s, double h, double end_share) {
  Bodies& b = s.scene.bodies;
  find_places(s);
  for (const Drive& d : drives_) {
    const double v =
        number_at(d.velocity, s.time + h, "velocity", [&] { return "body " + std::to_string(d.ids.front()); });
    for (const std::int32_t i : d.place) b.driven_velocity[i][d.dof] = v;
  }
  for (const Servo& one : servos_) {
    const auto of = [&] { return "body " + std::to_string(one.body); };
    const double late = number_at(one.stress, s.time + h, "stress", of),
                 early = number_at(one.stress, s.time, "stress", of);
    const double area = one.kind == ServoArea::given ? number_at(one.area, s.time, "area", of) : loaded_area(s, one);
    if (!b.force.active) b.force.activate(b.count);
    double* force = b.force[s.scene.find_body(one.body)];
    std::fill_n(force, b.dofs(), 0.0);
    for (int k = 0; k < s.scene.dim; ++k) {
      const double n = one.normal[std::size_t(k)];
      force[k] += end_share * (late * area * n) + (1 - end_share) * (early * area * n);
    }
  }
}

void Controls::apply(Simulation& s, double h, double end_share, bool cell_may_follow) {
  if (!(h > 0) || !std::isfinite(h)) return; // the strategy refuses it
  apply_to_bodies(s, h, end_share);
  begin_ = s.time;
  if (!growths_.empty() && s.strategy().name == "event_driven")
    throw Error("bodies grow, and strategy event_driven lets none do so: take NSCD or SmoothDEM");
  if (!has_cell()) return;
  for (const Component& c : components_)
    if (c.follows && !cell_may_follow)
      throw Error("component " + name_of_component(c.i, c.j) + " of the cell follows a stress, and strategy " +
                  s.strategy().name + " lets no cell do so: take NSCD, or give a rate");
  apply_to_cell(s, h, end_share);
}

void Controls::apply_to_cell(Simulation& s, double h, double end_share) {
  Cell& cell = s.scene.cell;
  const int dim = s.scene.dim;
  std::fill(std::begin(cell.follows), std::end(cell.follows), false);
  bool given[3] = {};
  for (const Component& c : components_) {
    const int e = c.i + 3 * c.j;
    const auto of = [&] { return "component " + name_of_component(c.i, c.j) + " of the cell"; };
    const double late = number_at(c.value, s.time + h, c.follows ? "stress" : "rate", of);
    cell.follows[e] = c.follows;
    if (c.follows)
      cell.pressure[e] = end_share * late + (1 - end_share) * number_at(c.value, s.time, "stress", of);
    else
      cell.velocity_gradient[e] = late;
    if (c.i == c.j) given[c.i] = true;
  }
  if (cell.moves()) {
    double mass = 0;
    for (const double one : s.scene.bodies.mass.values)
      if (std::isfinite(one)) mass += one;
    cell.mass = cell_mass_ * mass;
  }
  if (!keeps_volume_) return;
  int left = 0;
  double now = volume_; // over that of the end, as far as driven components make it
  for (int k = 0; k < dim; ++k) {
    now /= cell.vectors[4 * k];
    if (given[k])
      now /= 1 + h * cell.velocity_gradient[4 * k];
    else
      ++left;
  }
  if (left == 0) throw Error("the volume of the cell is kept, and all its lengths are driven: leave one to the volume");
  const double rate = (std::pow(now, 1.0 / left) - 1) / h;
  if (!std::isfinite(rate)) throw Error("no rate keeps the volume of the cell: give smaller rates, or a smaller dt");
  for (int k = 0; k < dim; ++k)
    if (!given[k]) cell.velocity_gradient[4 * k] = rate;
}

} // namespace cairn
