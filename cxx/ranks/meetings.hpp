// Meetings of the processes of MPI, at which each learns the calls of the others.
#pragma once
#include <string>
#include <string_view>

#include "exchange.hpp"
#include "mpi/cairn_mpi.h"

namespace cairn {

// All simulations of a process share one communicator, and so their meetings.
class Meetings {
public:
  // The only instance of this process; it lives until the program has ended.
  static Meetings& all();

  // Simulations have the same number on all processes: they are made in the same order.
  int add(Exchange& simulation, const cairn_mpi_calls& calls);
  void remove(int number) { simulations_[std::size_t(number)] = nullptr; }

  bool meet(int number, std::string_view call, bool value);
  [[noreturn]] void fail(std::string_view error);
  void ask(int number, Exchange::Wish wish);
  // At the end of the program: serves what others still read, until all are there.
  void end() noexcept;

private:
  struct Told {
    bool value, unlike, failed;
    int number; // of the simulation that one reads alone; -1: none
    int wish;
  };
  Told compare(std::string_view call, int number, int wish, bool value);
  bool serve(const Told& told);
  [[noreturn]] void refuse(std::string_view call);
  std::vector<std::string> texts_of_all(std::string_view text);
  [[noreturn]] void tell_of_fault(std::string_view error);

  const cairn_mpi_calls* calls_ = nullptr;
  std::vector<Exchange*> simulations_;
  int me_ = 0, ranks_ = 1;
  bool ended_ = false; // on this process, or on another one
};

} // namespace cairn
