#include "problem_reader.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "hdf5_node.hpp"

namespace cairn {

namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw FileError(path, what, "cairn.problems.write makes such files");
}

std::vector<double> numbers(const Hdf5Node& group, const std::string& name) {
  if (!group.contains(name)) refuse(group.path(), "lacks " + name);
  const StoredArray a = group.at(name).read();
  std::vector<double> out(std::size_t(a.size()));
  const auto take = [&]<class T>(T) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      T value;
      std::memcpy(&value, &a.bytes[i * sizeof(T)], sizeof(T));
      out[i] = double(value);
    }
  };
  const char kind = a.type.kind;
  const std::uint32_t item = a.type.item;
  if (kind == 'f' && item == 8)
    take(double());
  else if (kind == 'f' && item == 4)
    take(float());
  else if (kind == 'i' && item == 8)
    take(std::int64_t());
  else if (kind == 'i' && item == 4)
    take(std::int32_t());
  else
    refuse(group.path(), name + " holds no numbers that a problem has");
  return out;
}

std::int64_t whole(const Hdf5Node& group, const std::string& name) {
  const std::vector<double> value = numbers(group, name);
  if (value.size() != 1 || !(std::abs(value[0]) < 0x1p52) || value[0] != std::floor(value[0]))
    refuse(group.path(), name + " is no whole number");
  return std::int64_t(value[0]);
}

struct Entry {
  std::int64_t row, column;
  double value;
};

// Entries of W in SuiteSparse's format: nz = -1 by columns, -2 by rows, else the number of triplets.
std::vector<Entry> entries(const Hdf5Node& w, std::int64_t size) {
  if (whole(w, "m") != size || whole(w, "n") != size)
    refuse(w.path(), "W is no square matrix with dim rows for each contact");
  const std::int64_t nz = whole(w, "nz");
  const std::vector<double> p = numbers(w, "p"), i = numbers(w, "i"), x = numbers(w, "x");
  const bool listed = nz >= 0;
  const double count = listed ? double(nz) : p.size() == std::size_t(size + 1) ? p.back() : -1;
  if (!(count >= 0 && count <= double(std::min(i.size(), x.size())) && (!listed || count <= double(p.size()))))
    refuse(w.path(), "p, i and x of W do not fit each other");
  std::vector<Entry> out;
  out.reserve(std::size_t(count));
  const auto add = [&](double row, double column, double value) {
    if (!(row >= 0 && row < double(size) && column >= 0 && column < double(size)))
      refuse(w.path(), "W has an entry outside of it");
    out.push_back(nz == -1 ? Entry{std::int64_t(column), std::int64_t(row), value}
                           : Entry{std::int64_t(row), std::int64_t(column), value});
  };
  if (listed)
    for (std::int64_t k = 0; k < nz; ++k) add(i[std::size_t(k)], p[std::size_t(k)], x[std::size_t(k)]);
  else
    for (std::int64_t a = 0; a < size; ++a) {
      const double first = p[std::size_t(a)], last = p[std::size_t(a) + 1];
      if (!(first >= 0 && first <= last && last <= count)) refuse(w.path(), "p of W does not rise");
      for (auto k = std::size_t(first); k < std::size_t(last); ++k) add(double(a), i[k], x[k]);
    }
  return out;
}

} // namespace

FrictionProblem read_problem(const std::string& path) {
  const Hdf5Node root = Hdf5Node::open(path);
  if (!root.contains("fclib_local"))
    refuse(path, root.contains("fclib_global") ? "holds a global problem: reduce it in Python, by cairn.problems.read"
                                               : "has no fclib_local: it is no problem in the layout of FCLIB");
  const Hdf5Node local = root.at("fclib_local"), w = local.at("W");
  if (local.contains("V") && whole(local.at("V"), "n") > 0) refuse(path, "has equality constraints (V, R)");
  FrictionProblem problem;
  problem.dim = int(whole(local, "spacedim"));
  if (problem.dim != 2 && problem.dim != 3) refuse(path, "spacedim is " + std::to_string(problem.dim) + ", not 2 or 3");
  const std::vector<double> q = numbers(local, "vectors/q"), mu = numbers(local, "vectors/mu");
  const int d = problem.dim;
  problem.contacts = std::int64_t(mu.size());
  if (std::int64_t(q.size()) != problem.unknowns()) refuse(path, "q has not dim numbers for each contact");
  problem.q.assign(q.data(), q.data() + q.size());
  problem.mu.assign(mu.data(), mu.data() + mu.size());
  std::vector<Entry> entry = entries(w, problem.unknowns());
  const auto place = [&](const Entry& e) { return std::tuple(e.row / d, e.column / d); };
  std::stable_sort(entry.begin(), entry.end(), [&](const Entry& a, const Entry& b) { return place(a) < place(b); });
  problem.row_start.assign(std::size_t(problem.contacts) + 1, 0);
  for (std::size_t k = 0; k < entry.size(); ++k)
    if (k == 0 || place(entry[k]) != place(entry[k - 1])) {
      problem.column.push_back(std::int32_t(entry[k].column / d));
      ++problem.row_start[std::size_t(entry[k].row / d) + 1];
    }
  for (std::int64_t a = 0; a < problem.contacts; ++a) problem.row_start[a + 1] += problem.row_start[a];
  problem.block.assign(problem.column.size() * std::size_t(d * d), 0.0);
  std::size_t block = 0;
  for (std::size_t k = 0; k < entry.size(); ++k) {
    if (k > 0 && place(entry[k]) != place(entry[k - 1])) ++block;
    problem.block[(block * d + std::size_t(entry[k].column % d)) * d + std::size_t(entry[k].row % d)] += entry[k].value;
  }
  return problem;
}

} // namespace cairn
