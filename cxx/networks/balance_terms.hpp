// Terms of the balance of a network, by name.
#pragma once
#include "network.hpp"

namespace cairn {

template <class Balance, class F>
void each_term(Balance& b, F&& f) {
  f("stored", b.stored);
  f("held", b.held);
  f("given", b.given);
  f("convection", b.convection);
  f("radiation", b.radiation);
  f("friction", b.friction);
  f("joule", b.joule);
  f("charge_in", b.charge_in);
  f("charge_out", b.charge_out);
  f("supplied", b.supplied);
  f("closure", b.closure);
  f("in_play", b.in_play);
}

} // namespace cairn
