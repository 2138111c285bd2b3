// What callers ask of the strategy over ranks: refusals by name, settings, contacts that can be read.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "../base/call.hpp"
#include "../networks/network.hpp"
#include "../simulation/contact_fields.hpp"
#include "ranked_nscd.hpp"

namespace cairn {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw Error(what + ", which does not run over ranks: leave out ranks, or that");
}

// Fields of contacts that are kept for readers, with their components in 2D and 3D.
struct KeptField {
  const char* name;
  int in_plane, in_space;
};
constexpr KeptField kept_fields[] = {
    {"impulse", 2, 3}, {"impulse_local", 2, 3}, {"moment", 1, 3}, {"relative_velocity", 2, 3}, {"dissipated", 1, 1}};

} // namespace

struct RankedNscd::Shown {
  std::vector<ContactKey> key;
  std::vector<double> gap, normal, point;
  std::vector<double> field[std::size(kept_fields)];
  std::vector<std::int32_t> status;

  template <class F>
  void each_numbers(int dim, F&& f) {
    f(gap, 1);
    f(normal, dim);
    f(point, dim);
    for (std::size_t k = 0; k < std::size(kept_fields); ++k)
      f(field[k], dim == 2 ? kept_fields[k].in_plane : kept_fields[k].in_space);
  }
};

void RankedNscd::check_scene(const Simulation& s) const {
  const NscdOptions& o = model_->settings;
  if (o.solver.solver != "nlgs") refuse("the contact solver is " + o.solver.solver + ", and not nlgs");
  if (std::isfinite(o.solver.accuracy)) refuse("accuracy of velocities is asked for");
  if (o.solver.associated_start) refuse("associated_start is asked for");
  if (o.integrator.name != "theta") refuse("the integrator is " + o.integrator.name + ", and not theta");
  if (o.pose.kernel) refuse("the strategy is " + name);
  if (std::isfinite(o.overlap)) refuse("overlap is limited, to " + std::to_string(o.overlap));
  if (o.project_positions) refuse("project_positions is asked for");
  if (o.cut_back > 0) refuse("cut_back is asked for");
  if (!s.meshes.empty()) refuse("the scene has the mesh '" + s.meshes.meshes[0].model.name + "'");
  if (s.networks) refuse("the scene has a network of heat or current");
  if (!s.forces.empty()) refuse("the plugged force " + s.forces[0].name + " acts on bodies");
  if (s.free_velocity) refuse("the plugged free velocity " + s.free_velocity->name + " moves bodies");
  if (s.scene.has(Need::belts)) refuse("surfaces of bodies move along them");
  if (s.scene.has(Need::thermal) || s.scene.has(Need::growing)) refuse("bodies have temperatures");
  for (const double g : s.scene.cell.velocity_gradient)
    if (s.scene.cell.any() && (g < 0 || g > 0)) refuse("the periodic cell changes its shape");
}

void RankedNscd::check_laws(const Simulation& s) const {
  model_->check_laws(s);
  if (!s.laws.curves().empty()) refuse("a parameter of a law depends on temperature");
  for (int e = 0; e < s.laws.entries(); ++e) {
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)];
    if (law.joins) refuse("the scene has joints");
    if (law.keeps || law.holds || law.spans) refuse("law " + law.python_name + " holds pairs of bodies");
    if (law.energy) refuse("law " + law.python_name + " stores energy in contacts");
    if (law.plugged()) refuse("law " + law.name + " is of a user's library");
  }
}

std::vector<std::string_view> RankedNscd::stages(const Simulation&) const {
  return {"predict_configuration", "compute_free_velocity", "detect_contacts",  "colour_contacts",
          "prepare_contacts",      "solve_contacts",        "update_velocity",  "commit_contacts",
          "account",               "update_configuration",  "gather"};
}

std::unique_ptr<Strategy> RankedNscd::fresh() const {
  auto model = model_->fresh();
  return std::make_unique<RankedNscd>(std::unique_ptr<Nscd>(static_cast<Nscd*>(model.release())), exchange_);
}

// Another count of ranks too: contacts keep what they remember.
bool RankedNscd::take_settings(Simulation& s, const Strategy& other) {
  const auto* same = dynamic_cast<const RankedNscd*>(&other);
  if (!same) return false;
  ContactMemory kept = memory(s);
  auto model = same->model_->fresh();
  model_.reset(static_cast<Nscd*>(model.release()));
  name = model_->name;
  exchange_ = same->exchange_;
  restore(s, std::move(kept));
  return true;
}

void RankedNscd::changed(Simulation& s, bool places) {
  (void)places;
  s.contacts_known = false;
  shown_.reset();
  for (Part& part : parts_) part.simulation->laws = s.laws;
}

bool RankedNscd::has(const ContactFieldInfo& field) const {
  return std::string_view(field.name) == "status" || field.whole || std::string_view(field.name) == "gap" ||
         std::string_view(field.name) == "normal" || std::string_view(field.name) == "point" ||
         std::any_of(std::begin(kept_fields), std::end(kept_fields),
                     [&](const KeptField& kept) { return std::string_view(kept.name) == field.name; });
}

// Contacts of the ranks of this process, unless those of all were gathered.
void RankedNscd::view(Simulation& s) {
  if (s.contacts_known) return;
  if (!shown_) {
    auto shown = std::make_shared<Shown>();
    for (const Part& part : parts_) {
      Simulation& own = *part.simulation;
      const Candidates& c = own.candidates;
      if (!own.contacts_known) continue;
      const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
      const auto& id = own.scene.contactors.id;
      for (std::size_t i = 0; i < std::size_t(c.count); ++i)
        shown->key.push_back({*id[c.contactor_a[i]], *id[c.contactor_b[i]], c.feature[i], c.image[i]});
      append(shown->gap, c.gap);
      append(shown->normal, c.normal);
      append(shown->point, c.point);
      for (std::size_t k = 0; k < std::size(kept_fields); ++k) {
        const int n = s.scene.dim == 2 ? kept_fields[k].in_plane : kept_fields[k].in_space;
        std::vector<double> numbers(std::size_t(n * c.count));
        part.nscd->read(own, kept_fields[k].name, n, numbers.data());
        append(shown->field[k], numbers);
      }
      std::vector<std::int32_t> status(std::size_t(c.count), 0);
      part.nscd->status(own, status.data());
      append(shown->status, status);
    }
    shown_ = std::move(shown);
  }
  show(s);
}

// In the order of their keys, by the numbers of the whole.
void RankedNscd::show(Simulation& s) {
  Shown& shown = *shown_;
  const std::size_t n = shown.key.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return shown.key[a] < shown.key[b]; });
  const auto put_in_order = [&](auto& values, int components) {
    auto before = values;
    for (std::size_t i = 0; i < n; ++i)
      std::copy_n(before.begin() + std::ptrdiff_t(order[i]) * components, components,
                  values.begin() + std::ptrdiff_t(i) * components);
  };
  shown.each_numbers(s.scene.dim, put_in_order);
  put_in_order(shown.status, 1);
  put_in_order(shown.key, 1);
  Candidates& c = s.candidates;
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) array->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    c.contactor_a[i] = s.contactor(shown.key[i].contactor_a);
    c.contactor_b[i] = s.contactor(shown.key[i].contactor_b);
    c.feature[i] = shown.key[i].feature;
    c.image[i] = shown.key[i].image;
  }
  c.gap.assign(shown.gap.begin(), shown.gap.end());
  c.normal.assign(shown.normal.begin(), shown.normal.end());
  c.point.assign(shown.point.begin(), shown.point.end());
  c.seats.clear();
  c.count = std::int64_t(n);
  s.contacts_known = true;
}

void RankedNscd::gather(Simulation& s) {
  if (exchange_->whole()) return view(s);
  s.contacts_known = false;
  shown_.reset();
  view(s);
  Packer mine;
  mine.put_all(std::span<const ContactKey>(shown_->key));
  mine.put_all(std::span<const std::int32_t>(shown_->status));
  shown_->each_numbers(s.scene.dim, [&](auto& numbers, int) { mine.put_all(std::span<const double>(numbers)); });
  auto all = std::make_shared<Shown>();
  for (const Bytes& bytes : exchange_->gather(mine.bytes)) {
    Unpacker from(bytes);
    const auto append = [](auto& to, const auto& some) { to.insert(to.end(), some.begin(), some.end()); };
    append(all->key, from.get_all<ContactKey>());
    append(all->status, from.get_all<std::int32_t>());
    all->each_numbers(s.scene.dim, [&](auto& numbers, int) { append(numbers, from.get_all<double>()); });
  }
  shown_ = std::move(all);
  show(s);
}

void RankedNscd::read(Simulation& s, std::string_view field, int components, double* out) {
  for (std::size_t k = 0; k < std::size(kept_fields) && s.contacts_known && shown_; ++k)
    if (field == kept_fields[k].name) {
      std::copy(shown_->field[k].begin(), shown_->field[k].end(), out);
      return;
    }
  std::fill_n(out, components * s.candidates.count, 0.0);
}

void RankedNscd::status(Simulation& s, std::int32_t* out) {
  if (s.contacts_known && shown_) std::copy(shown_->status.begin(), shown_->status.end(), out);
}

std::vector<std::pair<std::string_view, double>> RankedNscd::figures(Simulation&) {
  double ghosts = 0;
  for (const Part& part : parts_) ghosts += double(std::count(part.own.begin(), part.own.end(), 0));
  return {{"ranks", exchange_->ranks()},
          {"colours", colours_},
          {"ghosts", ghosts},
          {"messages", double(last_.messages)},
          {"message_bytes", double(last_.bytes)},
          {"sums", double(last_.sums)},
          {"imbalance", imbalance_},
          {"partitions", double(partitions_)}};
}

std::unique_ptr<Strategy> over_ranks(std::unique_ptr<Strategy> strategy, std::shared_ptr<Exchange> exchange) {
  auto* nscd = dynamic_cast<Nscd*>(strategy.get());
  if (!nscd) refuse("the strategy is " + strategy->name);
  strategy.release();
  return std::make_unique<RankedNscd>(std::unique_ptr<Nscd>(nscd), std::move(exchange));
}

} // namespace cairn
