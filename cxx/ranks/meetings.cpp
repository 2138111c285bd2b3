#include "meetings.hpp"

#include <cmath>
#include <limits>
#include <map>

#include "../base/call.hpp"

namespace cairn {
namespace {

constexpr std::string_view end_of_program = "the end of its program";
constexpr int wishes = 4; // numbers for each simulation

void check(std::int32_t code) {
  if (code != 0) throw Error("a call of MPI failed with code " + std::to_string(code));
}

// A number for a text that doubles hold as it is.
double code_of(std::string_view text, int number) {
  std::uint64_t hash = 14695981039346656037u + std::uint64_t(number); // FNV-1a
  for (const char c : text) hash = (hash ^ std::uint8_t(c)) * 1099511628211u;
  return double(hash >> 12);
}

std::string_view name_of(std::string_view call) { return call.substr(0, call.find('\n')); }

} // namespace

Meetings& Meetings::all() {
  static Meetings* const one = new Meetings; // MPI ends after static objects have gone
  return *one;
}

int Meetings::add(Exchange& simulation, const cairn_mpi_calls& calls) {
  if (!calls_) {
    calls_ = &calls;
    calls.before_end([] { Meetings::all().end(); });
  }
  me_ = simulation.local().front();
  ranks_ = simulation.ranks();
  simulations_.push_back(&simulation);
  return int(simulations_.size()) - 1;
}

// number, wish: of the simulation that this process reads alone; wish 0: it makes a call.
Meetings::Told Meetings::compare(std::string_view call, int number, int wish, bool value) {
  if (ended_)
    throw Error("rank " + std::to_string(me_) + " of " + std::to_string(ranks_) + " makes the call " +
                std::string(name_of(call)) + " after another rank has ended its program: all ranks have to make it");
  const double none = -std::numeric_limits<double>::infinity();
  const double code = code_of(call, number);
  double told[] = {value ? 1.0 : 0.0, wish ? double(wishes * number + wish) : none, wish ? none : code,
                   wish ? none : -code};
  check(calls_->largest(told, 4));
  Told found{told[0] > 0, told[2] != -told[3], -1, 0};
  if (std::isfinite(told[1])) {
    found.number = int(told[1]) / wishes;
    found.wish = int(told[1]) % wishes;
  }
  return found;
}

// False: a process has that simulation no more.
bool Meetings::serve(const Told& told) {
  Exchange* const of =
      std::size_t(told.number) < simulations_.size() ? simulations_[std::size_t(told.number)] : nullptr;
  double gone[] = {of && of->serve ? 0.0 : 1.0};
  check(calls_->largest(gone, 1));
  if (gone[0] > 0) return false;
  of->serve(told.wish);
  return true;
}

bool Meetings::meet(int number, std::string_view call, bool value) {
  for (;;) {
    const Told told = compare(call, number, 0, value);
    if (told.number >= 0) {
      serve(told);
      continue;
    }
    if (told.unlike) refuse(call);
    return told.value;
  }
}

void Meetings::ask(int number, Exchange::Wish wish) {
  for (;;) {
    const Told told = compare("sim.bodies or sim.contacts", number, wish, false);
    const bool served = serve(told);
    if (told.number != number || (told.wish != wish && wish != Exchange::state)) continue;
    if (served) return;
    throw Error("rank " + std::to_string(me_) + " of " + std::to_string(ranks_) +
                " reads a simulation that another rank has no more: keep it on all ranks, or read it on all of them "
                "before");
  }
}

void Meetings::end() noexcept {
  if (ended_ || !calls_) return;
  try {
    for (;;) {
      const Told told = compare(end_of_program, 0, 0, false);
      if (told.number >= 0) {
        serve(told);
        continue;
      }
      bool one_ended = true;
      if (told.unlike) calls_of_all(end_of_program, one_ended); // the others refuse their calls
      break;
    }
  } catch (...) {} // nobody is left to be told
  ended_ = true;
}

// "rank 0 step, ranks 1 to 3 checkpoint".
std::string Meetings::calls_of_all(std::string_view call, bool& one_ended) {
  const Bytes mine = [&] {
    Packer packer;
    packer.put_all(std::span<const char>(call.data(), call.size()));
    return packer.bytes;
  }();
  std::vector<std::int64_t> counts(std::size_t(ranks_), 0);
  counts[std::size_t(me_)] = std::int64_t(mine.size());
  check(calls_->sum(counts.data(), ranks_));
  std::int64_t total = 0;
  for (const std::int64_t n : counts) total += n;
  Bytes bytes(static_cast<std::size_t>(total));
  check(calls_->gather(mine.data(), std::int64_t(mine.size()), counts.data(), bytes.data()));
  Unpacker from(bytes);
  std::map<std::string, std::vector<int>> ranks; // by call
  for (int rank = 0; rank < ranks_; ++rank) {
    const std::vector<char> text = from.get_all<char>();
    ranks[std::string(name_of({text.data(), text.size()}))].push_back(rank);
  }
  one_ended = ranks.count(std::string(end_of_program)) > 0;
  if (ranks.size() == 1) return {};
  std::string told;
  for (const auto& [name, of] : ranks) {
    told += told.empty() ? "" : ", ";
    told += of.size() > 1 ? "ranks " : "rank ";
    for (std::size_t k = 0; k < of.size(); ++k) {
      std::size_t last = k;
      while (last + 1 < of.size() && of[last + 1] == of[last] + 1) ++last;
      told += (k > 0 ? ", " : "") + std::to_string(of[k]);
      if (last > k) told += (last > k + 1 ? " to " : ", ") + std::to_string(of[last]);
      k = last;
    }
    told += (of.size() > 1 ? " make " : " makes ") + name;
  }
  return told;
}

void Meetings::refuse(std::string_view call) {
  bool one_ended = false;
  const std::string told = calls_of_all(call, one_ended);
  if (one_ended) ended_ = true;
  const std::string name(name_of(call));
  if (told.empty())
    throw Error("ranks were given unlike values for " + name +
                ", or make it of unlike simulations: every process has to run the same script to the same values");
  throw Error("rank " + std::to_string(me_) + " of " + std::to_string(ranks_) + " makes the call " + name + ", where " +
              told + ": all ranks have to make each call of a simulation, but for what reads bodies and contacts");
}

} // namespace cairn
