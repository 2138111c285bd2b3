#include "meetings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "../base/call.hpp"

namespace cairn {
namespace {

constexpr std::string_view end_of_program = "the end of its program";
constexpr int wishes = 4;       // numbers for each simulation
constexpr double failure = 2.0; // the value that a rank tells after an error

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

// Arguments of a call as messages show them; empty: it has none.
std::string_view arguments_of(std::string_view call) {
  const std::size_t first = call.find('\n');
  if (first == std::string_view::npos) return {};
  return call.substr(first + 1, call.find('\n', first + 1) - first - 1);
}

// "0, 2 to 4".
std::string listed(const std::vector<int>& ranks) {
  std::string told;
  for (std::size_t k = 0; k < ranks.size(); ++k) {
    std::size_t last = k;
    while (last + 1 < ranks.size() && ranks[last + 1] == ranks[last] + 1) ++last;
    told += (k > 0 ? ", " : "") + std::to_string(ranks[k]);
    if (last > k) told += (last > k + 1 ? " to " : ", ") + std::to_string(ranks[last]);
    k = last;
  }
  return told;
}

// "rank 0 <one> step, ranks 1 to 3 <many> checkpoint" of the ranks by text, in the order of their first ones; those
// whose program has ended come last.
std::string told_by_rank(const std::map<std::string, std::vector<int>>& ranks, const char* one, const char* many) {
  std::vector<std::pair<std::vector<int>, std::string>> ordered;
  for (const auto& [text, of] : ranks)
    if (text != end_of_program) ordered.emplace_back(of, text);
  std::ranges::sort(ordered);
  std::string told;
  const auto name = [&](const std::vector<int>& of) {
    told += (told.empty() ? "" : ", ") + std::string(of.size() > 1 ? "ranks " : "rank ") + listed(of);
  };
  for (const auto& [of, text] : ordered) {
    name(of);
    told += (of.size() > 1 ? many : one) + text;
  }
  if (const auto last = ranks.find(std::string(end_of_program)); last != ranks.end()) {
    name(last->second);
    told += last->second.size() > 1 ? " end their program" : " ends its program";
  }
  return told;
}

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
  Told found{told[0] > 0, told[2] != -told[3], told[0] >= failure, -1, 0};
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
    if (told.failed) tell_of_fault({});
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
    if (told.failed) tell_of_fault({});
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
      if (told.number >= 0 && !told.failed) {
        serve(told);
        continue;
      }
      if (told.failed || told.unlike) texts_of_all(end_of_program); // the others refuse their calls
      break;
    }
  } catch (...) {} // nobody is left to be told
  ended_ = true;
}

// A text of each rank.
std::vector<std::string> Meetings::texts_of_all(std::string_view text) {
  Packer packer;
  packer.put_all(std::span<const char>(text.data(), text.size()));
  const Bytes& mine = packer.bytes;
  std::vector<std::int64_t> counts(std::size_t(ranks_), 0);
  counts[std::size_t(me_)] = std::int64_t(mine.size());
  check(calls_->sum(counts.data(), ranks_));
  std::int64_t total = 0;
  for (const std::int64_t n : counts) total += n;
  Bytes bytes(static_cast<std::size_t>(total));
  check(calls_->gather(mine.data(), std::int64_t(mine.size()), counts.data(), bytes.data()));
  Unpacker from(bytes);
  std::vector<std::string> texts;
  for (int rank = 0; rank < ranks_; ++rank) {
    const std::vector<char> of_rank = from.get_all<char>();
    texts.emplace_back(of_rank.begin(), of_rank.end());
  }
  return texts;
}

void Meetings::fail(std::string_view error) {
  if (ended_) throw Error(std::string(error));
  const double none = -std::numeric_limits<double>::infinity();
  double told[] = {failure, none, none, none}; // it makes no call, which the others would be compared with
  check(calls_->largest(told, 4));
  tell_of_fault(error);
}

// The error of the lowest rank that has one.
void Meetings::tell_of_fault(std::string_view error) {
  const std::vector<std::string> texts = texts_of_all(error);
  ended_ = std::ranges::find(texts, end_of_program) != texts.end();
  for (std::size_t rank = 0; rank < texts.size(); ++rank)
    if (!texts[rank].empty() && texts[rank] != end_of_program)
      throw Error("rank " + std::to_string(rank) + " of " + std::to_string(ranks_) + ": " + texts[rank]);
  throw Error("a rank failed without a message");
}

void Meetings::refuse(std::string_view call) {
  std::map<std::string, std::vector<int>> names, arguments;
  const std::vector<std::string> texts = texts_of_all(call);
  for (std::size_t rank = 0; rank < texts.size(); ++rank) {
    names[std::string(name_of(texts[rank]))].push_back(int(rank));
    arguments[std::string(arguments_of(texts[rank]))].push_back(int(rank));
  }
  if (names.count(std::string(end_of_program)) > 0) ended_ = true;
  const std::string name(name_of(call));
  if (names.size() > 1)
    throw Error("ranks make unlike calls: " + told_by_rank(names, " makes ", " make ") +
                "; make each call of a simulation on all ranks, but for what reads bodies and contacts");
  const std::string given = arguments.size() > 1 ? " (" + told_by_rank(arguments, " gives ", " give ") + ")"
                                                 : std::string(", or make it of unlike simulations");
  throw Error("ranks were given unlike values for " + name + given +
              ": every process has to run the same script to the same values (give seeds to random numbers, take no "
              "time of a clock)");
}

} // namespace cairn
