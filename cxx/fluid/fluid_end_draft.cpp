#include "fluid_end_draft.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "../base/call.hpp"
#include "../base/number_text.hpp"

namespace cairn {

namespace {

// Where particle x stands beside a box: along the axis from the begin of the box on, over its length, and the distance
// from it across [m].
struct Beside {
  double along, across;
};

template <class Box>
Beside beside(int dim, const Box& box, double sign, const double* x) {
  const auto a = std::size_t(box.axis);
  Beside out{sign > 0 ? x[a] - box.low[a] : box.high[a] - x[a], 0};
  for (std::size_t c = 0; c < std::size_t(dim); ++c)
    if (c != a) out.across = std::hypot(out.across, std::max({0.0, box.low[c] - x[c], x[c] - box.high[c]}));
  return out;
}

template <class Box>
double length_of(const Box& box) {
  return box.high[std::size_t(box.axis)] - box.low[std::size_t(box.axis)];
}

// Particles of an inflow along an axis.
std::int64_t many_along(const FluidInflow& box, std::size_t axis, double spacing) {
  return std::llrint((box.high[axis] - box.low[axis]) / spacing);
}

std::string way(double sign, int axis) { return (sign > 0 ? "up axis " : "down axis ") + std::to_string(axis); }

std::string place(int dim, const double* x) {
  std::string out;
  for (int c = 0; c < dim; ++c) out += (c ? ", " : "") + number_text(x[c]);
  return "(" + out + ")";
}

void check_length(const char* what, double length, double reach, int axis, const std::array<bool, 3>& periodic) {
  if (!(length >= reach * (1 - 1e-9)))
    throw Error(std::string(what) + " is " + number_text(length) + " m long, and particles reach over " +
                number_text(reach) + " m: give it that length");
  if (periodic[std::size_t(axis)])
    throw Error("axis " + std::to_string(axis) + " is periodic, and an " + what +
                " leads along it: leave out one of both");
}

double sign_of(const FluidInflow& box) {
  const auto [least, most] = std::minmax_element(box.speed.begin(), box.speed.end());
  if (!(*least >= 0 || *most <= 0) || (*least == 0 && *most == 0))
    throw Error("speed of an inflow leads both ways or nowhere: give numbers of one sign");
  return *most > 0 ? 1 : -1;
}

void check_inflow(int dim, const FluidInflow& box, double sign, double spacing, double reach,
                  std::span<const double> position) {
  for (std::size_t i = 0; i < position.size(); i += std::size_t(dim)) {
    const Beside at = beside(dim, box, sign, &position[i]);
    if (at.across > 0 || !(at.along > -reach) || !(at.along < length_of(box) - 0.25 * spacing)) continue;
    throw Error("an inflow leads " + way(sign, box.axis) + ", and the liquid stands " +
                (at.along < 0 ? "behind" : "within") + " its box, at " + place(dim, &position[i]) +
                ": give a speed towards the liquid, or a box beside it");
  }
}

void check_outflow(int dim, const FluidOutflow& box, double spacing, std::span<const double> position) {
  const double* wrong = nullptr;
  for (std::size_t i = 0; i < position.size(); i += std::size_t(dim)) {
    const Beside at = beside(dim, box, box.sign, &position[i]);
    const bool ahead = at.along > length_of(box);
    if (at.across == 0 && !ahead) return;
    if (at.across == 0 || (at.across < spacing && at.along > 0 && !ahead)) wrong = &position[i];
  }
  if (wrong)
    throw Error("an outflow leads " + way(box.sign, box.axis) + ", towards the liquid or along its side, at " +
                place(dim, wrong) + ", so that none of it finds the way out: give a way that leads away from it");
}

// Rows along the axis, in the order of the other axes, the last of them fastest.
void fill(int dim, const FluidInflow& box, double sign, double spacing, FluidRows& out) {
  std::array<std::int64_t, 3> many{1, 1, 1};
  const auto a = std::size_t(box.axis);
  std::int64_t rows = 1;
  for (std::size_t c = 0; c < std::size_t(dim); ++c) {
    many[c] = many_along(box, c, spacing);
    if (many[c] < 1)
      throw Error("an inflow is narrower than the spacing of the liquid, " + number_text(spacing) +
                  " m: give a wider box");
    if (c != a) rows *= many[c];
  }
  if (box.speed.size() != 1 && std::int64_t(box.speed.size()) != rows)
    throw Error("an inflow has " + std::to_string(rows) + " rows of particles and " + std::to_string(box.speed.size()) +
                " speeds: give one for each, or one for all");
  for (std::int64_t row = 0; row < rows; ++row) {
    const double speed = box.speed[box.speed.size() == 1 ? 0 : std::size_t(row)];
    std::array<double, 3> x{};
    for (std::int64_t c = dim - 1, left = row; c >= 0; --c)
      if (std::size_t(c) != a) {
        x[std::size_t(c)] = box.low[std::size_t(c)] + (double(left % many[std::size_t(c)]) + 0.5) * spacing;
        left /= many[std::size_t(c)];
      }
    const auto lane = std::int32_t(out.lanes.axis.size());
    out.lanes.axis.push_back(box.axis);
    out.lanes.sign.push_back(sign);
    out.lanes.face.push_back(sign > 0 ? box.high[a] : -box.low[a]);
    out.lanes.length.push_back(double(many[a]) * spacing);
    out.lanes.speed.push_back(std::abs(speed));
    for (std::int64_t k = 0; k < many[a]; ++k) {
      const double back = (double(k) + 0.5) * spacing; // whole spacings from the liquid on
      x[a] = sign > 0 ? box.high[a] - back : box.low[a] + back;
      for (std::size_t c = 0; c < std::size_t(dim); ++c) {
        out.position.push_back(x[c]);
        out.velocity.push_back(c == a ? speed : 0.0);
      }
      out.lane.push_back(lane);
    }
  }
}

} // namespace

FluidRows rows_of_ends(int dim, const FluidEndDraft& ends, const FluidSettings& settings,
                       const std::array<bool, 3>& periodic, std::span<const double> position) {
  const double reach = 2 * settings.smoothing * settings.spacing;
  FluidRows out;
  if (!ends.empty() && settings.incompressible)
    throw Error("inflows and outflows are those of the weakly compressible form: leave out incompressible");
  for (const FluidInflow& box : ends.inflows) {
    const double sign = sign_of(box);
    const double row = double(many_along(box, std::size_t(box.axis), settings.spacing)) * settings.spacing;
    check_length("inflow", row, reach, box.axis, periodic); // the box may be longer by less than half a spacing
    check_inflow(dim, box, sign, settings.spacing, reach, position);
    fill(dim, box, sign, settings.spacing, out);
  }
  for (const FluidOutflow& box : ends.outflows) {
    check_length("outflow", length_of(box), reach, box.axis, periodic);
    check_outflow(dim, box, settings.spacing, position);
  }
  return out;
}

} // namespace cairn
