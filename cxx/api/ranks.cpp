// The C API of ranks (cairn/ranks.h).
#include "cairn/ranks.h"

#include "../ranks/over_ranks.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

void give_to(cairn_simulation* simulation, const char* call, std::shared_ptr<cairn::Exchange> exchange, bool once) {
  cairn::Simulation& s = between_steps(simulation, call).simulation;
  s.use(cairn::over_ranks(s.strategy().fresh(), std::move(exchange),
                          once ? cairn::Rhythm::sweep : cairn::Rhythm::colour));
  s.strategy().check_laws(s);
}

cairn::OverRanks& ranked(cairn_simulation* simulation) {
  require(simulation, "simulation");
  if (auto* found = dynamic_cast<cairn::OverRanks*>(&simulation->simulation.strategy())) return *found;
  throw Error("the simulation does not run over ranks: call cairn_simulation_over_mpi");
}

} // namespace

extern "C" {

int32_t cairn_simulation_over_mpi(cairn_simulation* simulation, int32_t communicator, const char* library,
                                  int32_t once_a_sweep, cairn_error* error) {
  return guarded(error, [&] {
    give_to(simulation, "cairn_simulation_over_mpi",
            cairn::mpi_ranks(library && *library ? library : "libcairn_mpi.so", communicator), once_a_sweep != 0);
  });
}

int32_t cairn_simulation_over_ranks(cairn_simulation* simulation, int32_t ranks, int32_t once_a_sweep,
                                    cairn_error* error) {
  return guarded(error, [&] {
    give_to(simulation, "cairn_simulation_over_ranks", cairn::virtual_ranks(ranks), once_a_sweep != 0);
  });
}

int32_t cairn_simulation_ranks(cairn_simulation* simulation, int32_t* rank, int32_t* ranks, cairn_error* error) {
  return guarded(error, [&] {
    const auto& exchange = ranked(simulation).shared_exchange();
    if (rank) *rank = exchange->local().front();
    if (ranks) *ranks = exchange->ranks();
  });
}

int32_t cairn_simulation_gather(cairn_simulation* simulation, cairn_error* error) {
  return guarded(error,
                 [&] { ranked(simulation).gather(between_steps(simulation, "cairn_simulation_gather").simulation); });
}

} // extern "C"
