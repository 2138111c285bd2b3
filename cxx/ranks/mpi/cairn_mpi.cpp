// The library cairn_mpi: see cairn_mpi.h.
#include "cairn_mpi.h"

#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <vector>

namespace {

constexpr std::int64_t most_bytes = std::int64_t(1) << 30; // of a message: counts of MPI are 32 bits wide
MPI_Comm communicator = MPI_COMM_NULL;
int my_rank = 0, all_ranks = 1;

void end_with_program() {
  int ended = 0;
  MPI_Finalized(&ended);
  if (!ended) MPI_Finalize();
}

std::int32_t open(std::int64_t given, std::int32_t* rank, std::int32_t* ranks) {
  int started = 0;
  MPI_Initialized(&started);
  if (!started) {
    int provided = 0;
    if (const int code = MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided)) return code;
    std::atexit(end_with_program);
  }
  const MPI_Comm from = given < INT32_MIN ? MPI_COMM_WORLD : MPI_Comm_f2c(MPI_Fint(given));
  if (communicator != MPI_COMM_NULL) { // simulations of a process share one
    int same = MPI_UNEQUAL;
    if (const int code = MPI_Comm_compare(from, communicator, &same)) return code;
    if (same != MPI_IDENT && same != MPI_CONGRUENT) return MPI_ERR_COMM;
    *rank = my_rank;
    *ranks = all_ranks;
    return 0;
  }
  if (const int code = MPI_Comm_dup(from, &communicator)) return code;
  MPI_Comm_rank(communicator, &my_rank);
  MPI_Comm_size(communicator, &all_ranks);
  *rank = my_rank;
  *ranks = all_ranks;
  return 0;
}

std::int32_t sum(std::int64_t* values, std::int64_t n) {
  return MPI_Allreduce(MPI_IN_PLACE, values, int(n), MPI_INT64_T, MPI_SUM, communicator);
}

std::int32_t largest(double* values, std::int64_t n) {
  return MPI_Allreduce(MPI_IN_PLACE, values, int(n), MPI_DOUBLE, MPI_MAX, communicator);
}

std::int32_t share_counts(const std::int64_t* to, std::int64_t* from) {
  return MPI_Alltoall(to, 1, MPI_INT64_T, from, 1, MPI_INT64_T, communicator);
}

// Long messages go in pieces of the same tag, which arrive in their order.
std::int32_t exchange(const cairn_mpi_message* out, std::int64_t n_out, const cairn_mpi_message* in,
                      std::int64_t n_in) {
  std::vector<MPI_Request> requests;
  const auto each_piece = [](const cairn_mpi_message& m, auto&& f) {
    int code = 0;
    for (std::int64_t first = 0; first < m.count && code == 0; first += most_bytes)
      code = f(static_cast<char*>(m.bytes) + first, int(std::min(most_bytes, m.count - first)));
    return code;
  };
  int code = 0;
  for (std::int64_t k = 0; k < n_in && code == 0; ++k)
    code = each_piece(in[k], [&](char* bytes, int count) {
      requests.emplace_back();
      return MPI_Irecv(bytes, count, MPI_BYTE, in[k].rank, in[k].tag, communicator, &requests.back());
    });
  for (std::int64_t k = 0; k < n_out && code == 0; ++k)
    code = each_piece(out[k], [&](char* bytes, int count) {
      requests.emplace_back();
      return MPI_Isend(bytes, count, MPI_BYTE, out[k].rank, out[k].tag, communicator, &requests.back());
    });
  if (code != 0) return code;
  return MPI_Waitall(int(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
}

std::int32_t gather(const void* mine, std::int64_t n, const std::int64_t* counts, void* all) {
  std::vector<cairn_mpi_message> in, out;
  char* to = static_cast<char*>(all);
  bool small = true;
  for (int rank = 0; rank < all_ranks; ++rank) small = small && counts[rank] < most_bytes / all_ranks;
  if (small) {
    const auto n_ranks = static_cast<std::size_t>(all_ranks);
    std::vector<int> count(n_ranks, 0), first(n_ranks, 0);
    int at = 0;
    for (int rank = 0; rank < all_ranks; ++rank) {
      count[std::size_t(rank)] = int(counts[rank]);
      first[std::size_t(rank)] = at;
      at += int(counts[rank]);
    }
    return MPI_Allgatherv(mine ? mine : MPI_IN_PLACE, int(n), MPI_BYTE, all, count.data(), first.data(), MPI_BYTE,
                          communicator);
  }
  char* own = to;
  for (int rank = 0; rank < my_rank; ++rank) own += counts[rank];
  if (mine) std::copy_n(static_cast<const char*>(mine), n, own);
  for (int rank = 0; rank < all_ranks; ++rank) {
    if (rank != my_rank) {
      in.push_back({rank, 3, to, counts[rank]});
      out.push_back({rank, 3, own, n});
    }
    to += counts[rank];
  }
  return exchange(out.data(), std::int64_t(out.size()), in.data(), std::int64_t(in.size()));
}

void abort_all(std::int32_t code) {
  int ended = 0, started = 0;
  MPI_Initialized(&started);
  MPI_Finalized(&ended);
  if (started && !ended) MPI_Abort(communicator == MPI_COMM_NULL ? MPI_COMM_WORLD : communicator, code);
  std::_Exit(code);
}

void (*call_before_end)() = nullptr;

int ends(MPI_Comm, int, void*, void*) {
  if (call_before_end) call_before_end();
  return MPI_SUCCESS;
}

// MPI_Finalize deletes the attributes of MPI_COMM_SELF before all else (MPI 4.0, section 11.2.4).
std::int32_t before_end(void (*call)()) {
  call_before_end = call;
  int key = MPI_KEYVAL_INVALID;
  if (const int code = MPI_Comm_create_keyval(MPI_COMM_NULL_COPY_FN, ends, &key, nullptr)) return code;
  return MPI_Comm_set_attr(MPI_COMM_SELF, key, nullptr);
}

} // namespace

const cairn_mpi_calls* cairn_mpi_table() {
  static const cairn_mpi_calls table = {cairn_mpi_version, open,   sum,       largest,   share_counts,
                                        exchange,          gather, abort_all, before_end};
  return &table;
}
