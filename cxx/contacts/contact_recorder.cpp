#include "contact_recorder.hpp"

#include <algorithm>
#include <limits>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

void ContactRecorder::keep_anchors() {
  if (anchors_.all_held().empty()) return memory_.anchors.clear();
  fit(memory_.anchors, memory_.keys.size());
  std::size_t to = 0;
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int32_t which = anchors_.number_of(system_.candidate[b.first + lane]);
      memory_.anchors[to++] = which >= 0 ? anchors_.all_held()[std::size_t(which)] : Anchor{};
    }
}

void ContactRecorder::record() {
  ContactMemory& m = memory_;
  m.h = in_.h;
  m.impulse_components = classes_.impulse_components;
  m.state_components = classes_.state_components;
  std::size_t kept = 0; // without an impulse, too: the order is what finds the others
  for (const cairn_batch& b : system_.batches) kept += std::size_t(b.contacts);
  fit(m.keys, kept);
  fit(m.impulses, kept * classes_.impulse_components);
  fit(m.states, kept * classes_.state_components);
  fit(m.forces, storage_.given ? kept * in_.dim() : 0);
  std::int64_t to = 0;
  for (const cairn_batch& b : system_.batches) {
    if (b.pack && classes_.state_components == 0 && classes_.impulse_components == in_.dim() && !storage_.given)
      to = in_.dim() == 2 ? record_packed<2>(b, to) : record_packed<3>(b, to);
    else
      to = record(b, to);
  }
  for (std::int64_t c = 0; c < in_.contactors->count; ++c)
    m.contactors_seen = std::max(m.contactors_seen, *in_.contactors->id[c] + 1);
  m.seen_besides.clear();
  m.seats.clear();
  for (const RimSeat& seat : in_.candidates->seats)
    m.seats.push_back({*in_.contactors->id[seat.node], *in_.contactors->id[seat.side], seat.face});
  matcher_.note_order(kept);
  keep_anchors();
}

template <int d>
std::int64_t ContactRecorder::record_packed(const cairn_batch& b, std::int64_t to) {
  const int lines = 8 * b.pack;
  for (int first = 0; first < b.contacts; first += 8) {
    const double* pack = b.frame + first / 8 * lines;
    const double* r = pack + 8 * (d + 4);
    double p[d][8];
    for (int i = 0; i < 8; ++i) {
      if constexpr (d == 2) {
        p[0][i] = r[i];
        p[1][i] = r[8 + i];
      } else {
        const double n[3] = {pack[i], pack[8 + i], pack[16 + i]};
        double t[3], s[3];
        tangent_of(n, t);
        cross(n, t, s);
        for (int k = 0; k < 3; ++k) { p[k][i] = n[k] * r[i] + t[k] * r[8 + i] + s[k] * r[16 + i]; }
      }
    }
    const int some = std::min(8, b.contacts - first);
    for (int i = 0; i < some; ++i) {
      memory_.keys[to] = in_.key(system_.candidate[b.first + first + i]);
      for (int k = 0; k < d; ++k) memory_.impulses[d * to + k] = p[k][i];
      ++to;
    }
  }
  return to;
}

// States of a contact, vectors in space axes, of an anchored one in those of B; huge where it has none.
void ContactRecorder::keep_states(const cairn_batch& b, int lane, double* to) const {
  const LawInfo& law = law_infos()[b.law];
  const double *from = b.state ? b.state + lane : nullptr, *end = to + classes_.state_components;
  for (const std::string& name : law.state) {
    if (!from) break; // a law without states
    if (name.back() != '*' || in_.dim() == 2) {
      *to++ = *from;
      from += b.count;
      continue;
    }
    double axes[3][3];
    axes_of(b, 3, lane, axes);
    double x[3];
    for (int k = 0; k < 3; ++k) x[k] = axes[1][k] * from[0] + axes[2][k] * from[b.count];
    if (!b.mapped_b && anchors_.is_anchored(system_.candidate[b.first + lane]))
      to_body_axes(*in_.bodies, 3, b.body_b[lane], x, x);
    to = std::copy_n(x, 3, to);
    from += 2 * b.count;
  }
  while (to < end) *to++ = std::numeric_limits<double>::max();
}

std::int64_t ContactRecorder::record(const cairn_batch& b, std::int64_t to) {
  const int n = b.count;
  for (int lane = 0; lane < b.contacts; ++lane) {
    memory_.keys[to] = in_.key(system_.candidate[b.first + lane]);
    double p[6] = {};
    if (in_.dim() == 2)
      for (int k = 0; k < b.components; ++k) p[k] = at(b, b.r, lane, k);
    else
      space_impulse(in_.dim(), b, lane, p, p + 3);
    for (int k = 0; k < classes_.impulse_components; ++k) memory_.impulses[to * classes_.impulse_components + k] = p[k];
    if (storage_.given) { // the solver's unknown is h theta times the force at the end
      double f[6] = {};
      cairn_batch of_force = b;
      of_force.components = in_.dim();
      double force[3 * 128];
      for (int k = 0; k < in_.dim(); ++k)
        force[k * n + lane] = (b.r[k * n + lane] - storage_.given_of(b)[k * n + lane]) / (in_.h * in_.theta);
      of_force.r = force;
      if (in_.dim() == 2)
        for (int k = 0; k < 2; ++k) f[k] = force[k * n + lane];
      else
        space_impulse(in_.dim(), of_force, lane, f, f + 3);
      std::copy_n(f, in_.dim(), &memory_.forces[to * in_.dim()]);
    }
    if (classes_.state_components > 0) keep_states(b, lane, &memory_.states[to * classes_.state_components]);
    ++to;
  }
  return to;
}

} // namespace cairn
