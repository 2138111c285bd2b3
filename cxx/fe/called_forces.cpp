#include "called_forces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"

namespace cairn {
namespace {

enum { refused = 5, force_fault, tangent_fault, energy_fault, dissipation_fault }; // of BulkResult

void expect(const std::string& from, const char* what, std::int64_t have, std::int64_t want, const char* remedy) {
  if (have != want)
    throw Error(from + ": " + what + " is " + std::to_string(have) + ", and " + std::to_string(want) +
                " was expected: " + remedy);
}

bool by_places(const SparseMatrix& pattern) { // whether an entry stands above the diagonal
  for (std::int64_t c = 0; c < pattern.n; ++c)
    for (std::int64_t e = pattern.start[std::size_t(c)]; e < pattern.start[std::size_t(c + 1)]; ++e)
      if (pattern.row[std::size_t(e)] < c) return true;
  return false;
}

void check_pattern(const std::string& from, const SparseMatrix& p) {
  const auto entries = std::int64_t(p.row.size());
  if (std::int64_t(p.start.size()) != p.n + 1 || p.start.front() != 0 || p.start.back() != entries)
    throw Error(from + ": start of the pattern has " + std::to_string(p.start.size()) + " numbers, from " +
                std::to_string(p.start.empty() ? 0 : p.start.front()) + " to " +
                std::to_string(p.start.empty() ? 0 : p.start.back()) + ": give dofs + 1, " + std::to_string(p.n + 1) +
                ", from 0 to the number of rows, " + std::to_string(entries));
  for (std::int64_t c = 0; c < p.n; ++c) {
    if (p.start[std::size_t(c + 1)] < p.start[std::size_t(c)])
      throw Error(from + ": start[" + std::to_string(c + 1) + "] of the pattern is below start[" + std::to_string(c) +
                  "]: give the columns one after the other");
    for (std::int64_t e = p.start[std::size_t(c)]; e < p.start[std::size_t(c + 1)]; ++e) {
      const std::int32_t row = p.row[std::size_t(e)];
      if (row < 0 || row >= p.n || (e > p.start[std::size_t(c)] && row <= p.row[std::size_t(e - 1)]))
        throw Error(from + ": row[" + std::to_string(e) + "] of the pattern is " + std::to_string(row) + " in column " +
                    std::to_string(c) + ": rows rise in a column, from 0 to below " + std::to_string(p.n));
    }
  }
}

} // namespace

CalledForces::CalledForces(std::string from, int dim, SparseMatrix pattern)
    : from_(std::move(from)), dim_(dim), pattern_(std::move(pattern)) {
  check_pattern(from_, pattern_);
  whole_ = by_places(pattern_);
  value_.resize(pattern_.row.size());
}

CalledForces::~CalledForces() = default;

std::shared_ptr<CalledForces> CalledForces::make(std::string from, int dim, SparseMatrix pattern, Open open) {
  std::shared_ptr<CalledForces> made(new CalledForces(std::move(from), dim, std::move(pattern)));
  made->open_ = std::move(open);
  const cairn_body_calls calls = made->open_();
  if (calls.destroy) made->context_ = {calls.context, calls.destroy};
  made->take(calls);
  return made;
}

std::shared_ptr<CalledForces> CalledForces::make(std::string from, int dim, SparseMatrix pattern,
                                                 const cairn_body_calls& calls) {
  std::shared_ptr<CalledForces> made(new CalledForces(std::move(from), dim, std::move(pattern)));
  made->take(calls);
  return made;
}

void CalledForces::take(const cairn_body_calls& c) {
  const char* header = "compile the code with the body_calls.h, or the Fortran module, of this Cairn";
  expect(from_, "ABI version of the calls", c.abi, CAIRN_BODY_CALLS_ABI, header);
  expect(from_, "size of the calls", c.size, sizeof(cairn_body_calls), header);
  expect(from_, "dofs of the calls", c.dofs, pattern_.n, "give the nodes that the code has");
  expect(from_, "entries of the calls", c.entries, std::int64_t(pattern_.row.size()),
         "give the pattern of the tangent that the code fills");
  if (!c.forces) throw Error(from_ + ": forces of the calls is NULL: give the function that finds them");
  if (!c.save != !c.load || !c.save != !c.state_size)
    throw Error(from_ + ": of state_size, save and load some are NULL: give all of them, or none");
  if (c.save && !c.commit)
    throw Error(from_ + ": there is a save and no commit: what is kept between steps needs both");
  calls_ = c;
  if (c.save) start_ = history();
}

std::string CalledForces::complaint() const {
  const char* text = calls_.complaint ? calls_.complaint(calls_.context) : nullptr;
  return text && *text ? ": " + std::string(text) : std::string();
}

// Adds the name of the mesh to exceptions of another code.
template <class Call>
void CalledForces::guarded(const char* what, const Call& call) const {
  try {
    call();
  } catch (const Error&) { throw; } catch (const std::exception& e) {
    if (throws_its_own) throw;
    throw Error("the mesh '" + mesh + "': " + what + " of " + from_ + " threw " + e.what());
  }
}

SparseMatrix CalledForces::lower() const {
  SparseMatrix out;
  out.n = pattern_.n;
  std::vector<std::vector<std::int32_t>> rows(static_cast<std::size_t>(out.n));
  for (std::int64_t c = 0; c < out.n; ++c) {
    rows[std::size_t(c)].push_back(std::int32_t(c));
    for (std::int64_t e = pattern_.start[std::size_t(c)]; e < pattern_.start[std::size_t(c + 1)]; ++e) {
      const std::int32_t r = pattern_.row[std::size_t(e)];
      rows[std::size_t(std::min<std::int64_t>(r, c))].push_back(std::int32_t(std::max<std::int64_t>(r, c)));
    }
  }
  for (std::vector<std::int32_t>& r : rows) {
    std::sort(r.begin(), r.end());
    r.erase(std::unique(r.begin(), r.end()), r.end());
    out.row.insert(out.row.end(), r.begin(), r.end());
    out.start.push_back(std::int64_t(out.row.size()));
  }
  out.value.assign(out.row.size(), 0.0);
  return out;
}

void CalledForces::fit(const SparseMatrix& lower) {
  if (lower.n != pattern_.n)
    throw Error(from_ + ": the tangent has " + std::to_string(pattern_.n) + " columns, the mass " +
                std::to_string(lower.n) + ": give those of one mesh");
  place_.resize(pattern_.row.size());
  for (std::int64_t c = 0; c < pattern_.n; ++c)
    for (std::int64_t e = pattern_.start[std::size_t(c)]; e < pattern_.start[std::size_t(c + 1)]; ++e) {
      const std::int64_t r = pattern_.row[std::size_t(e)];
      place_[std::size_t(e)] = place_of(lower, std::max(r, c), std::min(r, c));
      if (place_[std::size_t(e)] < 0)
        throw Error(from_ + ": entry (" + std::to_string(r) + ", " + std::to_string(c) +
                    ") of the tangent is not in the matrices of the mesh: give their common pattern");
    }
}

void CalledForces::add(const double* value, double* to) const {
  std::size_t e = 0;
  for (std::int64_t c = 0; c < pattern_.n; ++c)
    for (const auto end = std::size_t(pattern_.start[std::size_t(c + 1)]); e < end; ++e)
      to[place_[e]] += whole_ && pattern_.row[e] != c ? 0.5 * value[e] : value[e];
}

BulkResult CalledForces::evaluate(const MeshMotion& at, double* force, double* tangent) {
  if (!broken_.empty()) throw Error("the mesh '" + mesh + "': " + broken_);
  constexpr double none = std::numeric_limits<double>::quiet_NaN(); // marks entries that were not written
  double energy = none, dissipated = none;
  std::fill_n(force, pattern_.n, none);
  if (tangent) std::fill(value_.begin(), value_.end(), none);
  BulkResult out;
  guarded("forces", [&] {
    out.cell = calls_.forces(calls_.context, pattern_.n, std::int64_t(value_.size()), at.time, at.h, at.rate, at.u,
                             at.v, force, tangent ? value_.data() : nullptr, &energy, &dissipated);
  });
  const auto first_bad = [](const double* x, std::int64_t n) {
    return std::find_if_not(x, x + n, [](double a) { return std::isfinite(a); }) - x;
  };
  if (out.cell != 0) {
    out.fault = refused;
    return out;
  }
  if ((out.cell = first_bad(force, pattern_.n)) < pattern_.n) {
    out.fault = force_fault;
    return out;
  }
  const auto entries = std::int64_t(value_.size());
  if (tangent && (out.cell = first_bad(value_.data(), entries)) < entries) {
    out.fault = tangent_fault;
    return out;
  }
  out.cell = -1;
  if (calls_.gives_energy && !std::isfinite(energy)) out.fault = energy_fault;
  if (calls_.gives_dissipation && !std::isfinite(dissipated)) out.fault = dissipation_fault;
  if (!out.ok()) return out;
  if (calls_.gives_energy) out.energy = energy;
  if (calls_.gives_dissipation) out.dissipated = dissipated;
  if (tangent) add(value_.data(), tangent);
  return out;
}

void CalledForces::find_stiffness(SparseMatrix& lower) {
  const std::vector<double> none(std::size_t(pattern_.n), 0.0);
  std::vector<double> force(none.size());
  const BulkResult found = evaluate({none.data(), none.data()}, force.data(), lower.value.data());
  rollback();
  if (!found.ok()) throw Error(describe(found) + ", at displacements of zero");
}

std::string CalledForces::describe(const BulkResult& r) const {
  const auto dof = [&](std::int64_t i) {
    return "node " + std::to_string(i / dim_) + " along " + std::string(1, "xyz"[i % dim_]);
  };
  if (r.fault == force_fault) return "the force of " + from_ + " on " + dof(r.cell) + " is not finite, or not written";
  if (r.fault == tangent_fault) {
    const auto column = std::upper_bound(pattern_.start.begin(), pattern_.start.end(), r.cell) - pattern_.start.begin();
    return "entry " + std::to_string(r.cell) + " of the tangent of " + from_ + ", of " +
           dof(pattern_.row[std::size_t(r.cell)]) + " by " + dof(column - 1) + ", is not finite, or not written";
  }
  if (r.fault == energy_fault) return "the energy of " + from_ + " is not finite, or not written";
  if (r.fault == dissipation_fault) return "the dissipation of " + from_ + " is not finite, or not written";
  return from_ + " finds no forces (" + std::to_string(r.cell) + ")" + complaint();
}

std::string CalledForces::place_of_node(std::int64_t node) const {
  return "node " + std::to_string(node) + ", by forces and tangent of " + from_;
}

std::string CalledForces::remedy() const {
  return "compare the tangent with differences of the forces, " + InternalForces::remedy();
}

std::string CalledForces::not_by_energy(const std::string& name) const {
  return "the forces of the mesh '" + name + "' are of " + from_ + ", whose energy along a step is not known";
}

void CalledForces::commit() {
  if (!calls_.commit) return;
  std::int32_t code = 0;
  broken_ = from_ + " did not commit a step"; // until it did
  guarded("commit", [&] { code = calls_.commit(calls_.context); });
  if (code != 0)
    broken_ += " (" + std::to_string(code) + ")" + complaint();
  else
    broken_.clear();
  if (code == 0) return;
  throw Error("the mesh '" + mesh + "': " + broken_ +
              "; the step stands, and what the code keeps of it is not known: go back to a checkpoint");
}

// Called while another error propagates: a failure here is reported by the next call.
void CalledForces::rollback() {
  if (!calls_.rollback) return;
  try {
    std::int32_t code = 0;
    guarded("rollback", [&] { code = calls_.rollback(calls_.context); });
    if (code != 0) broken_ = from_ + " did not take a step back (" + std::to_string(code) + ")" + complaint();
  } catch (const std::exception& e) { broken_ = from_ + " did not take a step back: " + e.what(); }
}

std::vector<double> CalledForces::history() const {
  if (!calls_.save) return {};
  if (!broken_.empty())
    throw Error("the mesh '" + mesh + "': " + broken_ +
                "; what the code keeps is not known: go back to a checkpoint or a state from before");
  std::vector<double> out;
  guarded("save", [&] {
    const std::int64_t size = calls_.state_size(calls_.context);
    if (size < 0) throw Error(from_ + ": its history has " + std::to_string(size) + " numbers: give a count >= 0");
    out.resize(std::size_t(size));
    if (const std::int32_t code = calls_.save(calls_.context, size, out.data()); code != 0)
      throw Error(from_ + " did not give its history (" + std::to_string(code) + ")" + complaint());
  });
  return out;
}

void CalledForces::take_history(std::span<const double> history) {
  if (!calls_.load) {
    if (!history.empty())
      throw Error("the mesh '" + mesh + "': a history of " + std::to_string(history.size()) + " numbers is given to " +
                  from_ + ", which takes none: give the file of this scene");
    return;
  }
  guarded("load", [&] {
    const std::int32_t code = calls_.load(calls_.context, std::int64_t(history.size()), history.data());
    if (code != 0)
      throw Error("the mesh '" + mesh + "': " + from_ + " did not take a history of " + std::to_string(history.size()) +
                  " numbers (" + std::to_string(code) + ")" + complaint());
  });
  broken_.clear();
}

void CalledForces::forget_history() {
  if (calls_.load) take_history(start_);
}

std::shared_ptr<InternalForces> CalledForces::another() {
  if (!taken_) { // the first simulation
    taken_ = true;
    return shared_from_this();
  }
  if (!open_ && !calls_.create && calls_.commit)
    throw Error("the mesh '" + mesh + "': what " + from_ +
                " keeps between steps is of one simulation, which it has: give `create`, or each a mesh of its own");
  std::shared_ptr<CalledForces> made;
  if (open_) {
    made = make(from_, dim_, pattern_, open_);
  } else {
    cairn_body_calls calls = calls_; // the same context, where nothing is kept
    if (calls_.create)
      guarded("create", [&] {
        if (const std::int32_t code = calls_.create(calls_.context, &calls.context); code != 0)
          throw Error(from_ + " made no context for another simulation (" + std::to_string(code) + ")" + complaint());
      });
    made = std::shared_ptr<CalledForces>(new CalledForces(from_, dim_, pattern_));
    if (calls_.create && calls.destroy) made->context_ = {calls.context, calls.destroy};
    made->take(calls);
  }
  made->throws_its_own = throws_its_own;
  made->place_ = place_;
  made->taken_ = true;
  return made;
}

std::int64_t CalledForces::bytes() const {
  return std::int64_t(8 * (pattern_.start.capacity() + place_.capacity() + value_.capacity() + start_.capacity()) +
                      4 * pattern_.row.capacity());
}

} // namespace cairn
