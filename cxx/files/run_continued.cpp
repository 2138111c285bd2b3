#include "run_continued.hpp"

#include <algorithm>
#include <cstdio>
#include <map>

#include "../simulation/report.hpp"
#include "file_error.hpp"
#include "run_reader.hpp"

namespace cairn {
namespace {

std::string at(std::int64_t step, double time) {
  char text[64];
  std::snprintf(text, sizeof text, "step %lld (t = %g s)", static_cast<long long>(step), time);
  return text;
}

std::string apart(const std::string& path) {
  return "give another name than " + path + ": several files are read as one";
}

// True if the bodies (or nodes) common to an output and the simulation have the same positions, to the bit; counts
// them.
template <class Set>
bool stand_there(const RunReader& run, std::int64_t output, const std::string& what, const Set& now,
                 const std::array<double, 3>& origin, std::int64_t& common) {
  const std::vector<std::string> known = run.fields(what);
  if (std::find(known.begin(), known.end(), "id") == known.end()) return true;
  const std::vector<double> id = run.field(output, what, "id"), x = run.field(output, what, "position");
  std::map<std::int64_t, std::size_t> row;
  for (std::size_t i = 0; i < id.size(); ++i) row.emplace(std::int64_t(id[i]), i);
  const auto dim = std::size_t(run.dim());
  for (std::int64_t i = 0; i < now.count; ++i) {
    const auto found = row.find(*now.id[i]);
    if (found == row.end()) continue;
    ++common;
    for (std::size_t k = 0; k < dim; ++k)
      if (!(x[dim * found->second + k] == now.position[i][k] + origin[k])) return false;
  }
  return true;
}

bool stand_there(const RunReader& run, std::int64_t output, const Simulation& s) {
  std::int64_t common = 0;
  const bool same = stand_there(run, output, "bodies", s.scene.bodies, s.scene.origin, common) &&
                    stand_there(run, output, "nodes", s.scene.nodes, s.scene.origin, common);
  return same && (common > 0 || s.scene.bodies.count + s.scene.nodes.count == 0);
}

// True if the run went through the present state: by the positions of an output at this step, else by time and energy
// in the history, else by times of the outputs before and after.
bool went_through(const RunReader& run, const Simulation& s) {
  const std::vector<std::int64_t>& steps = run.steps();
  const auto next = std::lower_bound(steps.begin(), steps.end(), s.steps);
  const auto k = next - steps.begin();
  const std::vector<double>& times = run.times();
  if (*next == s.steps) return times[std::size_t(k)] == s.time && stand_there(run, k, s);
  if (times[std::size_t(k)] <= s.time || (k > 0 && times[std::size_t(k - 1)] >= s.time)) return false;
  if (!run.has_history()) return true;
  const std::vector<double> taken = run.history("step");
  const auto row = std::find(taken.begin(), taken.end(), double(s.steps)) - taken.begin();
  if (row == std::ssize(taken)) return true;
  if (run.history("time")[std::size_t(row)] != s.time) return false;
  for (const char* term : {"energy_kinetic", "energy_potential"})
    for (const auto& [name, member] : energy_terms())
      if (term == std::string("energy_") + name && run.has_history(term) &&
          run.history(term)[std::size_t(row)] != s.energy.*member)
        return false;
  return true;
}

} // namespace

void refuse_other_run(const std::string& path, Simulation& s, const RunOrigin& origin) {
  const RunReader run(path);
  const auto refuse = [&](const std::string& why, const std::string& remedy) { throw FileError(path, why, remedy); };
  const std::string other = "this run is of another scene, and cannot be gone on with";
  if (run.dim() != s.scene.dim) refuse(other, apart(path));
  if (run.outputs() == 0) return;
  const std::int64_t last = run.steps().back();
  const double end = run.times().back();
  if (origin.last_output == last && s.steps >= last) return; // changes since then were made on purpose
  for (const auto& [name, mark] : origin.marks)
    if (const auto theirs = run.scene_text(name); theirs && *theirs != mark)
      refuse(other, apart(path) + ", or restore a checkpoint of the simulation that wrote it");
  if (s.steps == last && (s.time != end || !stand_there(run, run.outputs() - 1, s)))
    refuse("its bodies stand elsewhere at " + at(last, end) + " than those of the simulation: this run is another one",
           apart(path));
  const std::string reaches = "this run reaches " + at(last, end) + ", and the simulation is at " + at(s.steps, s.time);
  const std::string restore = "restore a checkpoint of it first (--restart of cairn run), or " + apart(path);
  if (s.steps > last && (origin.from == RunOrigin::steps || !(s.time > end)))
    refuse(reaches + " without having come from there", restore);
  if (s.steps < last && origin.from != RunOrigin::checkpoint) refuse(reaches + ": outputs would be lost", restore);
  if (s.steps < last && !went_through(run, s))
    refuse(reaches + ", where this run did not pass: outputs would be lost", apart(path));
}

} // namespace cairn
