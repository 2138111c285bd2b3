// Open ends: particles that come in along lanes of an inflow, and those that leave by an outflow. In both buffers a
// particle has a given velocity, as in Tafuni et al. (2018); their pressure is that of the liquid beside an inflow.
// In an outflow it is given, or goes on from that with which each came, as its density changes.
#include <algorithm>
#include <cmath>
#include <string>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "fluid.hpp"
#include "wendland.hpp"

namespace cairn {

struct Fluid::Ends {
  FluidLanes lanes;
  std::vector<FluidOutflow> outflows;
  std::vector<std::int32_t> front; // the particle of each lane that is farthest on; -1: none
  std::vector<double> density;     // before each lane [kg/m3]
  struct Buffer {                  // lanes that end on one plane, and what they fill across it
    std::int32_t axis;
    double sign, face, length;
    std::array<double, 3> low, high;
  };
  std::vector<Buffer> buffers;
};

namespace {
// A particle beyond a side of a periodic cell, as it may be until the next list is made, is as far within on the other.
bool within(const FluidOutflow& o, const double* x, int dim, const std::array<double, 3>& period,
            const std::array<double, 3>& corner) {
  for (std::size_t c = 0; c < std::size_t(dim); ++c) {
    double at = x[c];
    if (period[c] > 0) at -= period[c] * std::floor((at - corner[c]) / period[c]);
    if (at < o.low[c] || at > o.high[c]) return false;
  }
  return true;
}
} // namespace

void Fluid::set_ends(FluidLanes lanes, std::vector<FluidOutflow> outflows, std::vector<std::int32_t> lane_of) {
  if (settings.incompressible || granular_)
    throw Error(
        "open ends are those of the weakly compressible fluid without grains: leave out incompressible, the drag "
        "of grains, or inflows and outflows");
  ends_ = std::make_shared<Ends>();
  ends_->lanes = std::move(lanes);
  ends_->outflows = std::move(outflows);
  end_.assign(density_.size(), 0);
  for (std::size_t i = 0; i < lane_of.size() && i < end_.size(); ++i) end_[i] = lane_of[i] + 1;
  passed_.assign(2, 0.0);
  const FluidLanes& l = ends_->lanes;
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (end_[i] <= 0) continue;
    const auto lane = std::size_t(end_[i] - 1);
    auto of = std::find_if(ends_->buffers.begin(), ends_->buffers.end(), [&](const Ends::Buffer& b) {
      return b.axis == l.axis[lane] && b.sign == l.sign[lane] && b.face == l.face[lane];
    });
    const std::array<double, 3> x = {position_[3 * i], position_[3 * i + 1], position_[3 * i + 2]};
    if (of == ends_->buffers.end())
      of = ends_->buffers.insert(of, {l.axis[lane], l.sign[lane], l.face[lane], l.length[lane], x, x});
    for (std::size_t c = 0; c < 3; ++c) {
      of->low[c] = std::min(of->low[c], x[c]);
      of->high[c] = std::max(of->high[c], x[c]);
    }
  }
}

std::int64_t Fluid::back_flow() const {
  std::int64_t many = 0;
  if (!ends_) return many;
  const double dx = settings.spacing;
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (end_[i] != 0) continue;
    for (const Ends::Buffer& b : ends_->buffers) {
      const double behind = b.face - b.sign * position_[3 * i + std::size_t(b.axis)];
      bool beside = behind < dx || behind > b.length;
      for (std::size_t c = 0; c < std::size_t(dim_); ++c) {
        const double x = position_[3 * i + c];
        beside = beside || (std::int32_t(c) != b.axis && (x < b.low[c] - 0.5 * dx || x > b.high[c] + 0.5 * dx));
      }
      many += !beside;
    }
  }
  return many;
}

// Before a step, which would otherwise be made in part: one particle at most comes in along a lane.
void Fluid::check_ends(double h) const {
  for (const std::int32_t end : end_) {
    if (end <= 0) continue;
    const double speed = ends_->lanes.speed[std::size_t(end - 1)];
    if (!(speed * h < settings.spacing))
      throw Error("a step of " + number_text(h) + " s moves an inflow of " + number_text(speed) +
                  " m/s by more than its spacing: give a dt of " + number_text(0.5 * settings.spacing / speed) + " s");
  }
}

// Particles in buffers keep their velocity, and the back of a buffer is no free surface.
void Fluid::hold_ends() {
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (end_[i] == 0) continue;
    std::fill_n(&acceleration_[3 * i], 3, 0.0);
    std::fill_n(&drift_[3 * i], 3, 0.0);
    open_[i] = 0;
  }
}

// A lane has the pressure of the liquid about its foremost particle, less what gravity adds between.
void Fluid::fill_ends(const Scene& scene) {
  Ends& s = *ends_;
  const FluidLanes& l = s.lanes;
  const auto along = [&](std::size_t i, std::size_t lane) {
    return l.sign[lane] * position_[3 * i + std::size_t(l.axis[lane])];
  };
  s.front.assign(l.axis.size(), -1);
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (end_[i] <= 0) continue;
    const auto lane = std::size_t(end_[i] - 1);
    std::int32_t& first = s.front[lane];
    if (first < 0 || along(i, lane) > along(std::size_t(first), lane)) first = std::int32_t(i);
  }
  const double reach2 = reach() * reach(), c2 = settings.sound_speed * settings.sound_speed;
  std::vector<double>& density = s.density;
  density.assign(l.axis.size(), settings.density);
  for (std::size_t lane = 0; lane < density.size(); ++lane) {
    if (s.front[lane] < 0) continue;
    const auto i = std::size_t(s.front[lane]);
    double sum = 0, weights = 0;
    for (std::int64_t k = list_.first[i]; k < list_.first[i + 1]; ++k) {
      const auto j = std::size_t(list_.neighbour[std::size_t(k)]);
      if (end_[j] != 0) continue;
      double square = 0, rest = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        double d = position_[3 * i + c] - position_[3 * j + c];
        if (period_[c] > 0)
          d -= period_[c] * std::round(d / period_[c]);
        else
          rest += scene.gravity[c] * d;
        square += d * d;
      }
      if (!(square < reach2)) continue;
      const double weight = wendland(2 * std::sqrt(square / reach2));
      sum += weight * (density_[j] + settings.density * rest / c2);
      weights += weight;
    }
    density[lane] = weights > 0 ? sum / weights : density_[i];
  }
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (end_[i] > 0) density_[i] = density[std::size_t(end_[i] - 1)];
    if (end_[i] >= 0) continue;
    const FluidOutflow& o = s.outflows[std::size_t(-end_[i] - 1)];
    if (std::isfinite(o.pressure)) density_[i] = settings.density + o.pressure / c2;
  }
}

// After the step of the liquid: particles pass from an inflow into the liquid, others come in behind them, and
// particles pass into outflows and beyond.
void Fluid::pass_ends() {
  Ends& s = *ends_;
  const FluidLanes& l = s.lanes;
  const std::size_t before = end_.size();
  bool changed = false;
  for (std::size_t i = 0; i < before; ++i) {
    const double* x = &position_[3 * i];
    if (end_[i] > 0) {
      const auto lane = std::size_t(end_[i] - 1), axis = std::size_t(l.axis[lane]);
      if (!(l.sign[lane] * x[axis] > l.face[lane])) continue;
      const std::int32_t of = end_[i];
      end_[i] = 0;
      double place[3] = {x[0], x[1], x[2]};
      place[axis] -= l.sign[lane] * l.length[lane];
      add_particle(place, &velocity_[3 * i], density_[i], of);
      passed_[0] += 1;
      changed = true;
      continue;
    }
    std::int32_t now = 0;
    for (std::size_t k = 0; k < s.outflows.size(); ++k)
      if (within(s.outflows[k], x, dim_, period_, corner_)) now = -std::int32_t(k) - 1;
    if (end_[i] < 0 && now == 0) {
      const FluidOutflow& o = s.outflows[std::size_t(-end_[i] - 1)];
      const double at = x[o.axis];
      if (o.sign > 0 ? at > o.high[std::size_t(o.axis)] : at < o.low[std::size_t(o.axis)]) now = gone;
    }
    if (now != end_[i] && now < 0 && now != gone) { // it leaves along the way out alone, and does not turn back
      const FluidOutflow& o = s.outflows[std::size_t(-now - 1)];
      for (int c = 0; c < 3; ++c) velocity_[3 * i + std::size_t(c)] *= c == o.axis;
      double& v = velocity_[3 * i + std::size_t(o.axis)];
      if (o.sign * v < 0) v = 0;
      std::fill_n(&acceleration_[3 * i], 3, 0.0);
    }
    if (now == gone) passed_[1] += 1;
    changed = changed || now == gone;
    end_[i] = now;
  }
  if (!changed) return;
  drop_gone();
  list_known_ = known_ = false;
  list_.at.clear();
  raised_ = 0; // as after a state was restored
}

void Fluid::add_particle(const double* place, const double* velocity, double density, std::int32_t end) {
  const double at[3] = {place[0], place[1], place[2]}, speed[3] = {velocity[0], velocity[1], velocity[2]};
  position_.insert(position_.end(), at, at + 3);
  velocity_.insert(velocity_.end(), speed, speed + 3);
  acceleration_.insert(acceleration_.end(), 3, 0.0);
  density_.push_back(density);
  number_.push_back(std::int32_t(number_.size()));
  open_.push_back(0);
  end_.push_back(end);
}

// Numbers close up, so that particles keep their order.
void Fluid::drop_gone() {
  const std::size_t n = end_.size();
  std::vector<std::int32_t> left(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i)
    if (end_[i] == gone) left[std::size_t(number_[i]) + 1] = 1;
  for (std::size_t i = 0; i < n; ++i) left[i + 1] += left[i];
  std::size_t to = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (end_[i] == gone) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      position_[3 * to + c] = position_[3 * i + c];
      velocity_[3 * to + c] = velocity_[3 * i + c];
      acceleration_[3 * to + c] = acceleration_[3 * i + c];
    }
    density_[to] = density_[i];
    number_[to] = number_[i] - left[std::size_t(number_[i])];
    open_[to] = open_[i];
    end_[to] = end_[i];
    ++to;
  }
  for (auto* v : {&position_, &velocity_, &acceleration_}) v->resize(3 * to);
  density_.resize(to);
  number_.resize(to);
  open_.resize(to);
  end_.resize(to);
  rate_.clear();
}

std::array<double, 2> Fluid::passed() const {
  if (!ends_) return {0, 0};
  const double one = mass() * settings.depth;
  return {one * passed_[0], one * passed_[1]};
}

std::vector<std::int32_t> Fluid::ends() const {
  std::vector<std::int32_t> out(density_.size(), 0);
  for (std::size_t i = 0; i < end_.size(); ++i) out[std::size_t(number_[i])] = end_[i];
  return out;
}

} // namespace cairn
