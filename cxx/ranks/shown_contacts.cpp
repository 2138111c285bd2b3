#include "shown_contacts.hpp"

#include <algorithm>
#include <numeric>

#include "../simulation/contact_fields.hpp"

namespace cairn {
namespace {

// Fields of contacts that are kept for readers, with their components in 2D and 3D.
struct KeptField {
  const char* name;
  int in_plane, in_space;
};
constexpr KeptField kept_fields[] = {
    {"impulse", 2, 3},    {"impulse_local", 2, 3}, {"moment", 1, 3},    {"relative_velocity", 2, 3},
    {"dissipated", 1, 1}, {"beta", 1, 1},          {"stored", 1, 1},    {"released", 1, 1},
    {"attraction", 1, 1}, {"state.beta", 1, 1},    {"state.area", 1, 1}};
constexpr std::size_t of_networks = 8; // the first that networks alone read

} // namespace

ShownContacts::ShownContacts(bool networks) : networks_(networks), field_(std::size(kept_fields)) {}

template <class F>
void ShownContacts::each_numbers(int dim, F&& f) {
  f(gap_, 1);
  f(normal_, dim);
  f(point_, dim);
  for (std::size_t k = 0; k < std::size(kept_fields); ++k)
    if (k < of_networks || networks_) f(field_[k], dim == 2 ? kept_fields[k].in_plane : kept_fields[k].in_space);
}

void ShownContacts::add_rows(Part& part, const std::vector<std::size_t>& rows) {
  const Simulation& own = *part.simulation;
  const int dim = own.scene.dim;
  const Candidates& c = own.candidates;
  const auto append = [&](auto& to, const auto& from, int n) {
    for (const std::size_t i : rows)
      to.insert(to.end(), from.begin() + std::ptrdiff_t(i) * n, from.begin() + std::ptrdiff_t(i + 1) * n);
  };
  const auto& id = own.scene.contactors.id;
  for (const std::size_t i : rows)
    key_.push_back({*id[c.contactor_a[i]], *id[c.contactor_b[i]], c.feature[i], c.image[i]});
  append(gap_, c.gap, 1);
  append(normal_, c.normal, dim);
  append(point_, c.point, dim);
  for (std::size_t k = 0; k < std::size(kept_fields); ++k) {
    if (k >= of_networks && !networks_) break;
    const int n = dim == 2 ? kept_fields[k].in_plane : kept_fields[k].in_space;
    std::vector<double> numbers(std::size_t(n * c.count));
    if (k >= of_networks || has_contact_field(own, kept_fields[k].name))
      part.strategy->read(*part.simulation, kept_fields[k].name, n, numbers.data());
    append(field_[k], numbers, n);
  }
  std::vector<std::int32_t> status(std::size_t(c.count), 0);
  part.strategy->status(*part.simulation, status.data());
  append(status_, status, 1);
}

void ShownContacts::pack(int dim, Packer& packer) {
  packer.put_all(std::span<const ContactKey>(key_));
  packer.put_all(std::span<const std::int32_t>(status_));
  each_numbers(dim, [&](auto& numbers, int) { packer.put_all(std::span<const double>(numbers)); });
}

void ShownContacts::add_packed(Piece bytes, int dim) {
  Unpacker from(bytes);
  const auto append = [](auto& to, const auto& some) { to.insert(to.end(), some.begin(), some.end()); };
  append(key_, from.get_all<ContactKey>());
  append(status_, from.get_all<std::int32_t>());
  each_numbers(dim, [&](auto& numbers, int) { append(numbers, from.get_all<double>()); });
}

void ShownContacts::show(Simulation& s) {
  const std::size_t n = key_.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key_[a] < key_[b]; });
  const auto put_in_order = [&](auto& values, int components) {
    auto before = values;
    for (std::size_t i = 0; i < n; ++i)
      std::copy_n(before.begin() + std::ptrdiff_t(order[i]) * components, components,
                  values.begin() + std::ptrdiff_t(i) * components);
  };
  each_numbers(s.scene.dim, put_in_order);
  put_in_order(status_, 1);
  put_in_order(key_, 1);
  Candidates& c = s.candidates;
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) array->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    c.contactor_a[i] = s.contactor(key_[i].contactor_a);
    c.contactor_b[i] = s.contactor(key_[i].contactor_b);
    c.feature[i] = key_[i].feature;
    c.image[i] = key_[i].image;
  }
  c.gap.assign(gap_.begin(), gap_.end());
  c.normal.assign(normal_.begin(), normal_.end());
  c.point.assign(point_.begin(), point_.end());
  c.seats.clear();
  c.count = std::int64_t(n);
  s.contacts_known = true;
}

bool ShownContacts::keeps(std::string_view field) {
  return std::any_of(std::begin(kept_fields), std::end(kept_fields),
                     [&](const KeptField& kept) { return field == kept.name; });
}

const std::vector<double>* ShownContacts::numbers(std::string_view field) const {
  for (std::size_t k = 0; k < std::size(kept_fields); ++k)
    if (field == kept_fields[k].name) return &field_[k];
  return nullptr;
}

} // namespace cairn
