// Numbers of bodies between ranks, where the whole has none of them: places for a new order and a new cut, and rows
// for new parts.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "../contactors/shapes.hpp"
#include "over_ranks.hpp"

namespace cairn {

std::vector<double> radii_of(const Simulation& s) {
  std::vector<double> radius(std::size_t(s.scene.bodies.count), 0);
  const Contactors& c = s.scene.contactors;
  const int dim = s.scene.dim;
  for (std::int64_t k = 0; k < c.count; ++k) {
    const Shape shape = Shape(*c.shape[k]);
    double size = info(shape).bounded ? *c.radius[k] : std::numeric_limits<double>::infinity();
    if (shape == Shape::segment) size += c.direction[k][dim];
    double square = 0;
    for (int d = 0; d < dim && c.offset.active; ++d) square += c.offset[k][d] * c.offset[k][d];
    if (*c.body[k] < 0) continue; // of a mesh
    double& of_body = radius[std::size_t(*c.body[k])];
    of_body = std::max(of_body, size + std::sqrt(square));
  }
  return radius;
}

std::vector<std::uint8_t> fixed_bodies(const Simulation& s) {
  const Bodies& b = s.scene.bodies;
  std::vector<std::uint8_t> fixed(std::size_t(b.count), 0);
  for (std::int64_t i = 0; i < b.count; ++i) {
    const unsigned driven = b.driven.active ? *b.driven[i] : 0;
    bool moves = false;
    for (int k = 0; k < b.dofs(); ++k) {
      if (driven >> k & 1) continue;
      const bool turns = k >= s.scene.dim;
      const double inertia = turns ? b.inertia[i][b.inertia.components == 1 ? 0 : k - s.scene.dim] : *b.mass[i];
      moves = moves || std::isfinite(inertia);
    }
    fixed[std::size_t(i)] = !moves;
  }
  return fixed;
}

namespace {

// Numbers of the bodies that each rank owns, `n` of a body, in the order of the whole, of which owner tells the ranks.
// f(part, row, out): those of a body of a part.
template <class T, class F>
std::vector<T> numbers_of_all(const std::vector<Part>& parts, Exchange& exchange,
                              const std::vector<std::int32_t>& owner, int n, F&& f) {
  std::vector<T> all(owner.size() * std::size_t(n));
  if (exchange.whole()) {
    for (const Part& part : parts)
      for (std::size_t i = 0; i < part.bodies.size(); ++i)
        if (part.own[i]) f(part, std::int64_t(i), &all[std::size_t(part.bodies[i]) * std::size_t(n)]);
    return all;
  }
  Bytes mine;
  for (const Part& part : parts) {
    std::vector<std::int32_t> rows; // by the order of the whole, in which the others have owners
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (part.own[i]) rows.push_back(std::int32_t(i));
    std::sort(rows.begin(), rows.end(), [&](std::int32_t i, std::int32_t j) {
      return part.bodies[std::size_t(i)] < part.bodies[std::size_t(j)];
    });
    std::vector<T> numbers(rows.size() * std::size_t(n));
    for (std::size_t i = 0; i < rows.size(); ++i) f(part, rows[i], &numbers[i * std::size_t(n)]);
    const auto bytes = std::as_bytes(std::span<const T>(numbers));
    mine.insert(mine.end(), bytes.begin(), bytes.end());
  }
  const Gathered gathered = exchange.gather(std::move(mine));
  std::vector<std::size_t> next(gathered.pieces.size(), 0);
  const std::size_t size = std::size_t(n) * sizeof(T);
  for (std::size_t i = 0; i < owner.size(); ++i) {
    const auto rank = std::size_t(owner[i]);
    std::memcpy(&all[i * std::size_t(n)], gathered.pieces[rank].data() + next[rank], size);
    next[rank] += size;
  }
  return all;
}

void copy_place(const Part& part, std::int64_t row, double* out) {
  const Field<double>& position = part.simulation->scene.bodies.position;
  std::copy_n(position[row], position.components, out);
}

} // namespace

OverRanks::Outline OverRanks::outline(const Simulation& s) const {
  if (!numbers_are_apart(s)) return {s.scene.bodies.position.values.data(), radii_of(s), fixed_bodies(s), {}};
  std::vector<std::vector<double>> radius;
  std::vector<std::vector<std::uint8_t>> fixed;
  for (const Part& part : parts_) {
    radius.push_back(radii_of(*part.simulation));
    fixed.push_back(fixed_bodies(*part.simulation));
  }
  const auto of = [&](const Part& part) { return std::size_t(&part - parts_.data()); };
  Outline all;
  all.places = numbers_of_all<double>(parts_, *exchange_, owner_, s.scene.dim, copy_place);
  all.radius =
      numbers_of_all<double>(parts_, *exchange_, owner_, 1, [&](const Part& part, std::int64_t row, double* out) {
        *out = radius[of(part)][std::size_t(row)];
      });
  all.fixed = numbers_of_all<std::uint8_t>(
      parts_, *exchange_, owner_, 1,
      [&](const Part& part, std::int64_t row, std::uint8_t* out) { *out = fixed[of(part)][std::size_t(row)]; });
  all.position = all.places.data();
  return all;
}

double OverRanks::fastest_square(const Simulation& s) const {
  const int dim = s.scene.dim;
  double most[] = {0};
  const auto look = [&](const Bodies& bodies, std::int64_t row) {
    double square = 0;
    for (int k = 0; k < dim; ++k) square += bodies.velocity[row][k] * bodies.velocity[row][k];
    most[0] = std::max(most[0], square);
  };
  if (!numbers_are_apart(s)) {
    for (std::int64_t i = 0; i < s.scene.bodies.count; ++i)
      if (!everywhere_[std::size_t(i)]) look(s.scene.bodies, i);
    return most[0];
  }
  for (const Part& part : parts_)
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (part.own[i] && !everywhere_[std::size_t(part.bodies[i])])
        look(part.simulation->scene.bodies, std::int64_t(i));
  exchange_->largest(most);
  return most[0];
}

void OverRanks::renumber(Simulation& s) {
  if (!numbers_are_apart(s)) {
    fetch(s);
    s.scene.renumber();
    return;
  }
  if (s.scene.bodies.count < 2) return;
  const std::vector<std::int32_t> order =
      s.scene.renumber(numbers_of_all<double>(parts_, *exchange_, owner_, s.scene.dim, copy_place));
  const auto follow = [&order](auto& of_bodies) {
    auto before = of_bodies;
    for (std::size_t i = 0; i < before.size(); ++i) of_bodies[i] = before[std::size_t(order[i])];
  };
  follow(owner_);
  for (auto* marks : {&everywhere_, &fixed_, &jointed_}) follow(*marks);
  std::vector<std::int32_t> now(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) now[std::size_t(order[i])] = std::int32_t(i);
  for (Part& part : parts_) {
    for (std::int32_t& body : part.bodies) body = now[std::size_t(body)];
    find_runs(part);
  }
}

std::vector<Arrived> OverRanks::pass_rows(Simulation& s, const std::vector<std::int32_t>& owner_before,
                                          const std::vector<std::vector<std::int32_t>>& wanted) const {
  const Arrays arrays = arrays_of_parts(s);
  std::vector<std::vector<Parcel>> out;
  for (const std::vector<std::int32_t>& bodies : wanted) {
    std::map<int, std::vector<std::int32_t>> of_owner;
    for (const std::int32_t body : bodies) of_owner[owner_before[std::size_t(body)]].push_back(body);
    auto& parcels = out.emplace_back();
    for (const auto& [rank, asked] : of_owner) {
      Packer packer;
      packer.put_all(std::span<const std::int32_t>(asked));
      parcels.push_back({rank, std::move(packer.bytes)});
    }
  }
  const auto asked = exchange_->deliver(std::move(out));
  out.clear();
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    std::vector<std::pair<std::int32_t, std::int32_t>> row_of; // of bodies of the whole, rising
    for (std::size_t i = 0; i < parts_[l].bodies.size(); ++i) row_of.emplace_back(parts_[l].bodies[i], std::int32_t(i));
    std::sort(row_of.begin(), row_of.end());
    auto& parcels = out.emplace_back();
    for (const Parcel& parcel : asked[l]) {
      std::vector<std::int32_t> rows = Unpacker(parcel.bytes).get_all<std::int32_t>();
      for (std::int32_t& body : rows) body = std::ranges::lower_bound(row_of, std::pair(body, std::int32_t(0)))->second;
      Packer packer;
      pack_rows(parts_[l], rows, s, arrays, packer);
      parcels.push_back({parcel.rank, std::move(packer.bytes)});
    }
  }
  std::vector<Arrived> arrived;
  for (auto& rows : exchange_->deliver(std::move(out))) arrived.push_back({arrays, std::move(rows)});
  return arrived;
}

} // namespace cairn
