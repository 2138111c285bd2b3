// The contacts of one law as plain columns, and what any law makes of them, each contact by itself.
#pragma once
#include <cstdint>
#include <vector>

#include "contact_views.hpp"

namespace cairn {

// Columns over n contacts, (n, columns) with the contacts first.
struct LawRows {
  int components = 0;
  double h = 0, theta = 0;
  std::int32_t over_bodies = 0;        // see cairn_law_context
  std::vector<std::int64_t> candidate; // (n)
  std::vector<double> gap;             // (n) [m]
  std::vector<double> velocity;        // (n, c) at the end of the step, as laws commit by it [m/s]
  std::vector<double> velocity_free;   // (n, c) without the impulse of the contact itself, bias included [m/s]
  std::vector<double> bias;            // (n, c) [m/s]
  std::vector<double> delassus;        // (n, c, c) as the solver has it [1/kg]
  std::vector<double> impulse;         // (n, c) [N s]
  std::vector<double> params;          // (n, p)
  std::vector<double> geometry;        // (n, 3 or 6), see laws/law_geometry.hpp [m2, m, kg, m]
  std::vector<double> fields;          // (n, 4) of both sides, empty: the scene has none
  std::vector<double> state;           // (n, s), before commit that of the begin of the step
};

struct LawAnswer {
  std::vector<double> impulse, state; // (n, c) [N s], (n, s) of the law that was asked
};

// Impulses by which a law with a solution of its own would obey itself, and the states that it would commit. params:
// its own, (n, p); state (n, s): its own at the begin of the step. rows.impulse is where its search begins.
LawAnswer answer_of(Law law, int dim, const LawRows& rows, const std::vector<double>& params,
                    const std::vector<double>& state);

} // namespace cairn
