// Contacts of a smooth scene as a reader sees them: made when they are asked for.
#include <algorithm>
#include <cmath>

#include "../../base/call.hpp"
#include "../../contacts/surface_motion.hpp"
#include "../../simulation/contact_fields.hpp"
#include "../../solvers/sweeps/batch.hpp"
#include "lanes.hpp"

namespace cairn {

void SmoothDem::view(Simulation& s) {
  dim_ = s.scene.dim;
  if (s.contacts_known) return;
  Candidates& out = s.candidates;
  if (list_is_old(s)) {
    s.handler.declared().clear();
    make_list(s);
  }
  if (lanes_.empty()) lanes_.push_back(std::make_unique<Lanes>());
  Lanes& w = *lanes_[0];
  place_contactors(s);
  viewed_.clear();
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) array->clear();
  for (auto* array : {&out.gap, &out.normal, &out.point}) array->clear();
  std::int64_t number = 0; // of the first pair of the list
  each_list([&](NeighbourList& list) {
    for (const NeighbourList::Batch& batch : list.batches) view_batch(s, list, batch, number, w);
    number += list.pairs;
  });
  out.count = std::int64_t(viewed_.size());
  s.contacts_known = true;
}

void SmoothDem::view_batch(Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                           std::int64_t number, Lanes& w) {
  Candidates& out = s.candidates;
  batch_geometry(s, list, batch, w);
  for (int i = 0; i < batch.count; ++i) {
    const std::int64_t p = batch.first + i;
    if (w.gap[i] >= entries_[batch.entry].reach || w.status[i] == cairn_apart) continue;
    viewed_.push_back(std::int32_t(number + p));
    out.contactor_a.push_back(list.a[p]);
    out.contactor_b.push_back(list.b[p]);
    out.image.push_back(list.image[p]);
    out.feature.push_back(key_of(list, p).feature);
    out.gap.push_back(w.gap[i]);
    const double* centre =
        centred_ ? s.scene.bodies.position[list.body_a[p]] : &centre_[std::int64_t(list.a[p]) * dim_];
    for (int k = 0; k < dim_; ++k) {
      out.normal.push_back(w.normal[k * batch.count + i]);
      out.point.push_back(centre[k] + w.point[k * batch.count + i]);
    }
  }
}

// The list of a pair that is viewed, and its place there.
std::pair<const NeighbourList*, std::int64_t> SmoothDem::viewed(std::size_t i) const {
  const std::int64_t p = viewed_[i];
  return p < list_.pairs ? std::pair(&list_, p) : std::pair(&shaped_, p - list_.pairs);
}

bool SmoothDem::has(const ContactFieldInfo& field) const {
  return field.smooth && (counts_loss_ || std::string_view(field.name) != "dissipated");
}

// Forces of smooth contacts count for a step, as impulses do.
void SmoothDem::read(Simulation& s, std::string_view field, int components, double* out) {
  const std::int64_t n = components * s.candidates.count;
  if (field == "relative_velocity") return relative_velocity(s, out);
  if (field == "moment") {
    std::fill_n(out, n, 0.0);
    for (std::size_t i = 0; turns_ && i < viewed_.size(); ++i) {
      const auto [list, p] = viewed(i);
      for (int k = 0; k < components; ++k) out[i * components + k] = s.report.h * list->moment[p * components + k];
    }
    return;
  }
  if (field == "dissipated") {
    for (std::size_t i = 0; i < viewed_.size(); ++i) out[i] = viewed(i).first->loss[viewed(i).second];
    return;
  }
  if (field == "impulse_local")
    force_local(s, out);
  else if (field == "impulse")
    force_space(out);
  else if (field == "attraction" || field == "state.beta" || field == "state.area")
    std::fill_n(out, n, 0.0); // networks ask for what laws of NSCD remember
  else
    throw Error("contacts of SmoothDEM have no '" + std::string(field) + "'");
  for (std::int64_t i = 0; i < n; ++i) out[i] *= s.report.h;
}

void SmoothDem::force_space(double* out) const {
  for (std::size_t i = 0; i < viewed_.size(); ++i) out = std::copy_n(force_of(i), dim_, out);
}

void SmoothDem::moment_space(double* out) const {
  const int n = 2 * dim_ - 3;
  for (std::size_t i = 0; i < viewed_.size(); ++i) {
    const auto [list, p] = viewed(i);
    out = std::copy_n(&list->moment[p * n], n, out);
  }
}

void SmoothDem::force_local(const Simulation& s, double* out) const {
  for (std::size_t i = 0; i < viewed_.size(); ++i) {
    const double *n = &s.candidates.normal[i * dim_], *f = force_of(i);
    to_local(n, f, out + i * dim_);
  }
}

void SmoothDem::to_local(const double* n, const double* v, double* out) const {
  if (dim_ == 2) {
    out[0] = n[0] * v[0] + n[1] * v[1];
    out[1] = n[0] * v[1] - n[1] * v[0];
    return;
  }
  double t[3];
  tangent_of(n, t);
  for (int k = 0; k < 3; ++k) out[k] = 0;
  for (int k = 0; k < 3; ++k) {
    out[0] += n[k] * v[k];
    out[1] += t[k] * v[k];
    out[2] += (n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3]) * v[k];
  }
}

void SmoothDem::relative_velocity(const Simulation& s, double* out) const {
  const Bodies& b = s.scene.bodies;
  for (std::size_t i = 0; i < viewed_.size(); ++i) {
    const auto [list, p] = viewed(i);
    double u[3] = {0, 0, 0}, shift[3] = {0, 0, 0}, jump[3] = {0, 0, 0};
    if (s.scene.cell.any()) {
      image_shift(s.scene.cell, list->image[p], shift);
      image_velocity(s.scene.cell, list->image[p], jump);
    }
    for (const int side : {1, -1}) {
      const std::int32_t body = side > 0 ? list->body_a[p] : list->body_b[p];
      const double *v = b.velocity[body], *x = b.position[body];
      double arm[3] = {0, 0, 0};
      for (int k = 0; k < dim_; ++k) arm[k] = s.candidates.point[i * dim_ + k] - x[k] - (side < 0 ? shift[k] : 0);
      double own[3];
      if (belt_velocity(b, dim_, body, arm, &s.candidates.normal[i * dim_], own))
        for (int k = 0; k < dim_; ++k) u[k] += side * own[k];
      if (dim_ == 2) {
        u[0] += side * (v[0] - v[2] * arm[1]);
        u[1] += side * (v[1] + v[2] * arm[0]);
      } else {
        for (int k = 0; k < 3; ++k)
          u[k] += side * (v[k] + v[3 + (k + 1) % 3] * arm[(k + 2) % 3] - v[3 + (k + 2) % 3] * arm[(k + 1) % 3]);
      }
    }
    for (int k = 0; k < dim_; ++k) u[k] -= jump[k];
    to_local(&s.candidates.normal[i * dim_], u, out + i * dim_);
  }
}

// A contact slips where its tangential force is as large as the law's friction allows.
void SmoothDem::status(Simulation& s, std::int32_t* out) {
  for (std::size_t i = 0; i < viewed_.size(); ++i) {
    const auto [list, p] = viewed(i);
    const int entry = s.laws.find(*s.scene.contactors.material[list->a[p]], *s.scene.contactors.material[list->b[p]]);
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
    double local[3] = {0, 0, 0}, mu = 0;
    to_local(&s.candidates.normal[i * dim_], &list->force[p * dim_], local);
    for (std::size_t k = 0; k < law.parameters.size(); ++k)
      if (law.parameters[k].name == "mu") mu = s.laws.entry(entry).params[k];
    const double tangential = std::hypot(local[1], local[2]);
    out[i] = !(std::abs(local[0]) > 0 || tangential > 0) ? cairn_open
             : tangential < mu * local[0] * (1 - 1e-12)  ? cairn_stick
                                                         : cairn_slip;
  }
}

} // namespace cairn
