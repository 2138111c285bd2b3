#include "plug.hpp"

#include <dlfcn.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "../base/call.hpp"
#include "../detection/pair_kinds.hpp"
#include "../solvers/problems/problem_monitor.hpp"
#include "cairn/plug.h"

namespace cairn {

namespace {

[[noreturn]] void refuse_library(const std::string& library, const std::string& text) {
  throw std::invalid_argument(library + ": " + text);
}

// A library of a later header may write more than this one knows.
union PlugDescriptor {
  cairn_plug_descriptor known;
  char room[16384];
};

void expect(const std::string& library, const char* what, int have, int want) {
  if (have != want)
    refuse_library(library, std::string(what) + " is " + std::to_string(have) + ", this Cairn has " +
                                std::to_string(want) +
                                ": compile the library with the cairn_plug.f90 or cairn/plug.h of this Cairn");
}

std::string text_of(const std::string& library, const char* what, const char* text, std::size_t room) {
  if (!std::memchr(text, '\0', room))
    refuse_library(library, std::string(what) + " has no end: shorten it, and end it with a null");
  return text;
}

void check(const std::string& library, const std::string& name, int kind, const cairn_plug_descriptor& d) {
  const bool first = d.abi == 1;
  if (!first) expect(library, "ABI version of the descriptor", d.abi, CAIRN_PLUG_ABI);
  expect(library, "size of the descriptor", d.size,
         first ? offsetof(cairn_plug_descriptor, residual) : sizeof(cairn_plug_descriptor));
  if (std::size_t(d.context_size) !=
      offsetof(cairn_law_context, over_bodies)) // the last field is read by laws of the list alone
    expect(library, "size of cairn_law_context", d.context_size, sizeof(cairn_law_context));
  static const char* const kinds[] = {
      "", "contact law", "contact solver", "detection pair", "free velocity", "body force", "deformable body"};
  if (d.kind != kind)
    refuse_library(library, name + " is of kind " + std::to_string(d.kind) + ", not a " + kinds[kind] + " (" +
                                std::to_string(kind) + ")");
  if (text_of(library, "name", d.name, sizeof d.name) != name)
    refuse_library(library, "cairn_describe_" + name + " describes '" + d.name + "': its name must be " + name);
  if (kind != cairn_plug_law) return;
  const auto one_of = [&](const char* what, int have, int few, int many) {
    if (have != 0 && have != few && have != many)
      refuse_library(library, name + ": " + what + " is " + std::to_string(have) + ", must be " + std::to_string(few) +
                                  ", " + std::to_string(many) + " (with rotations) or 0 (not in this dimension)");
  };
  one_of("components2", d.components2, 2, 3);
  one_of("components3", d.components3, 3, 6);
  if (d.components2 == 0 && d.components3 == 0) refuse_library(library, name + " has no components in 2D nor in 3D");
  if (!d.prepare) refuse_library(library, name + " has no prepare: every law needs one, for bias and friction");
  if (d.normal_bias && (d.solve || d.components2 == 3 || d.components3 == 6))
    refuse_library(library, name + " says normal_bias, which a law with its own solve or with rotations cannot");
  if (d.residual && !d.solve) refuse_library(library, name + " has a residual and no solve: a cone has one already");
  if (d.keeps != 0 && d.keeps != 1)
    refuse_library(library, name + ": keeps is " + std::to_string(d.keeps) + ", must be 0 or 1");
  if (!d.solve && (d.components2 == 3 || d.components3 == 6))
    refuse_library(library, name + " has rotations among its components and no solve: the cone knows none");
}

} // namespace

namespace {

// Opens the library, reads and checks the descriptor.
void describe(const std::string& library, const std::string& name, int kind, PlugDescriptor& filled) {
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* why = dlerror();
    refuse_library(library, std::string("cannot be loaded as a library: ") + (why ? why : "no reason given"));
  }
  const std::string symbol = "cairn_describe_" + name;
  auto* describe = reinterpret_cast<cairn_plug_describe*>(dlsym(handle, symbol.c_str()));
  if (!describe) {
    dlclose(handle);
    refuse_library(library,
                   "has no " + symbol + ": the library must export a descriptor under that name (Fortran: bind(c))");
  }
  describe(&filled.known);
  check(library, name, kind, filled.known);
}

LawInfo declared(const std::string& library, const std::string& name, const cairn_plug_descriptor& d) {
  LawInfo law;
  law.name = law.python_name = name;
  law.library = library;
  law.components2 = d.components2;
  law.components3 = d.components3;
  law.keeps = law.anchored = d.keeps != 0;
  const std::string parameters = text_of(library, "parameters", d.parameters, sizeof d.parameters);
  const std::string state = text_of(library, "state", d.state, sizeof d.state);
  try {
    declare_law(law, parameters, state);
  } catch (const std::invalid_argument& wrong) { refuse_library(library, name + ": " + wrong.what()); }
  return law;
}

} // namespace

PluggedRoutine open_routine(const std::string& library, const std::string& name, int kind) {
  PlugDescriptor filled{};
  describe(library, name, kind, filled);
  PluggedRoutine found{name, library, declared(library, name, filled.known), nullptr};
  found.routine = reinterpret_cast<cairn_plug_slot*>(filled.known.prepare);
  if (!found.routine) refuse_library(library, name + " has no routine: the descriptor must hold it in `prepare`");
  return found;
}

void plug_solver(const PluggedRoutine& r, const std::vector<double>& params) {
  auto* solve = reinterpret_cast<cairn_plug_solve*>(r.routine);
  const auto driver = [solve, params, name = r.name](const FrictionProblem& p, const ProblemOptions& o, double* best) {
    ProblemMonitor monitor(p, o, best);
    Array<double> impulses(best, best + p.unknowns());
    if (!o.warm_start) std::fill(impulses.begin(), impulses.end(), 0.0);
    std::int32_t iterations = 0;
    solve(p.dim, p.contacts, p.row_start.data(), p.column.data(), p.block.data(), p.q.data(), p.mu.data(), o.tolerance,
          o.max_iterations, params.data(), impulses.data(), &iterations);
    for (std::int64_t i = 0; i < p.unknowns(); ++i)
      if (!std::isfinite(impulses[i]))
        throw Error("the plugged solver " + name + " gave the impulse " + std::to_string(impulses[i]) + " to contact " +
                    std::to_string(i / p.dim) + ": look at its input by Simulation.problem, or give another solver");
    if (monitor.error_of(impulses.data()) > o.tolerance)
      monitor.give_up(ProblemStatus::iteration_limit, "the plugged solver " + name + " ended above the tolerance");
    monitor.ended(iterations);
    return monitor.finish(name, iterations);
  };
  register_problem_solver({r.name, r.name, "from " + r.library, driver});
}

std::shared_ptr<CalledForces> plug_body(const PluggedRoutine& r, std::vector<double> params, int dim,
                                        std::vector<double> position, SparseMatrix pattern) {
  auto* open = reinterpret_cast<cairn_plug_open_body*>(r.routine);
  const std::string from = r.library + ": " + r.name;
  if (params.size() != r.declared.parameters.size())
    refuse_library(r.library, r.name + " takes " + std::to_string(r.declared.parameters.size()) + " parameters, and " +
                                  std::to_string(params.size()) + " are given");
  for (std::size_t k = 0; k < params.size(); ++k)
    if (const LawParameter& p = r.declared.parameters[k]; !(params[k] >= p.smallest && params[k] <= p.largest))
      refuse_library(r.library, p.name + " is " + std::to_string(params[k]) + ": " + r.name + " takes " +
                                    std::to_string(p.smallest) + " to " + std::to_string(p.largest));
  const auto opened = [open, from, params = std::move(params), dim, position = std::move(position),
                       pattern]() -> cairn_body_calls {
    cairn_body_calls calls{};
    calls.abi = CAIRN_BODY_CALLS_ABI;
    calls.size = sizeof calls;
    calls.dofs = pattern.n;
    calls.entries = std::int64_t(pattern.row.size());
    const std::int32_t code =
        open(dim, pattern.n / dim, position.data(), pattern.start.data(), pattern.row.data(), params.data(), &calls);
    if (code == 0) return calls;
    const char* why = calls.complaint ? calls.complaint(calls.context) : nullptr;
    throw Error(from + " does not take the mesh (" + std::to_string(code) + ")" + (why ? ": " + std::string(why) : ""));
  };
  return CalledForces::make(from, dim, std::move(pattern), opened);
}

void plug_pair(const PluggedRoutine& r, const std::string& pair) {
  std::string known;
  for (detection::PairKind& kind : detection::pair_kinds) {
    if (!kind.built_in) continue;
    known += (known.empty() ? "" : ", ") + std::string(kind.name);
    if (kind.name != pair) continue;
    kind.contact = r.routine ? reinterpret_cast<cairn_pair_contact*>(r.routine) : kind.built_in;
    return;
  }
  refuse_library(r.library, "there is no pair '" + pair + "' that a routine may replace: give one of " + known);
}

Law plug_law(const std::string& library, const std::string& name, const PlugOptions& options) {
  PlugDescriptor filled{};
  describe(library, name, cairn_plug_law, filled);
  const cairn_plug_descriptor& d = filled.known;
  LawInfo law = declared(library, name, d);
  for (std::size_t k = 0; k < law.state.size(); ++k)
    if (!std::isfinite(law.state_begin[k]))
      refuse_library(library, "state variable '" + law.state[k] + "' of " + name +
                                  " has no value for a new contact: write " + law.state[k] + ":0");
  law.has_prepare = true;
  law.has_solve = d.solve != nullptr;
  law.has_commit = d.commit != nullptr;
  law.normal_bias = d.normal_bias != 0 && law.state.empty();
  law.yields = true; // nothing says whether it does
  law.thread_safe = d.thread_unsafe == 0 && !options.serial;
  law.prepare = d.prepare;
  law.solve = d.solve;
  law.commit = d.commit;
  law.residual = d.residual;
  law.energy = d.energy;
  law.complaint = d.complaint;
  return register_law(std::move(law), options.replace);
}

} // namespace cairn
