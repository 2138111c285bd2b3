// Communication between the ranks of a scene. A step over ranks is written once, as passes over the ranks of a process
// with these calls between them: for one rank, for several in turns in one process, for one rank a process of MPI.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "../base/call.hpp"

namespace cairn {

using Bytes = std::vector<std::byte>;
using Piece = std::span<const std::byte>; // of what was received

// Bytes for a rank, or from one.
struct Parcel {
  int rank;
  Bytes bytes;
};

// Numbers that a rank and another one exchange again and again, in parts: part k of `out` is from out_first[k] to
// out_first[k + 1].
struct Link {
  int rank;        // the other one
  int mirror = -1; // place of this link among those of the other rank, where one process makes both
  std::vector<double> out, in;
  std::vector<std::int32_t> out_first, in_first;
};
using Links = std::vector<std::vector<Link>>; // of each rank that the process makes, by rising rank

// What all processes gave, in one array, and the piece of each, by rising rank.
struct Gathered {
  Bytes all;
  std::vector<Piece> pieces;
  auto begin() const { return pieces.begin(); }
  auto end() const { return pieces.end(); }
};

struct Traffic {
  std::int64_t messages = 0, bytes = 0; // from rank to rank
  std::int64_t sums = 0;                // over all ranks
  Traffic& operator+=(const Traffic& more) {
    messages += more.messages;
    bytes += more.bytes;
    sums += more.sums;
    return *this;
  }
  Traffic operator-(const Traffic& less) const {
    return {messages - less.messages, bytes - less.bytes, sums - less.sums};
  }
};

// An error of one rank within work that all of them do together: the others wait for it, and cannot be told.
class Disagreement : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

class Exchange {
public:
  virtual ~Exchange() = default;
  virtual std::string name() const = 0;
  virtual int ranks() const = 0;
  const std::vector<int>& local() const { return local_; } // that this process makes, rising
  bool whole() const { return int(local_.size()) == ranks(); }

  // Parcels of each local rank; those that arrive come by rising rank of their senders.
  virtual std::vector<std::vector<Parcel>> deliver(std::vector<std::vector<Parcel>> out) = 0;
  // Part `part` of all links.
  virtual void pass(Links& links, int part) = 0;
  // Over processes, number by number.
  virtual void sum(std::span<std::int64_t> values) = 0;
  virtual void largest(std::span<double> values) = 0;
  // Items of `size` bytes, of which rank r knows those from first[r] to first[r + 1]: all become known to each.
  virtual void share(void* items, std::size_t size, std::span<const std::int64_t> first) = 0;
  // Gathers the bytes of all processes on each, by rising rank.
  virtual Gathered gather(Bytes mine) = 0;

  // A meeting of all ranks, with which each call that all of them make begins. `call`: its name; arguments that have to
  // be the same on all ranks, as messages show them, in a second line, and their digest in a third one. If a rank makes
  // another call, or has ended its program, all throw Error with ranks and calls. Gives true if `value` is true on any
  // rank.
  virtual bool meet(std::string_view call, bool value = false) {
    (void)call;
    return value;
  }
  // An error of this process between two calls: all ranks throw Error with it at their next meeting, as this one does.
  // Returns where there is one process.
  virtual void fail(std::string_view error) { (void)error; }
  // Work of all ranks together, for which a single one may ask: the others do it at their next meeting.
  enum Wish { state = 1, contacts = 2, workspace = 3 };
  virtual void ask(Wish wish) { serve(wish); }
  std::function<void(int wish)> serve;

  // Work of all ranks together, within a call. Errors that all of them throw pass. One that this process has alone,
  // memory that is missing or a Disagreement, ends all processes with a message: others wait for it in their work.
  template <class F>
  decltype(auto) together(F&& work) {
    try {
      return work();
    } catch (const Error&) { throw; } catch (const std::exception& e) {
      lose(e.what());
      throw;
    }
  }
  // This process cannot go on with the others. Returns where there is one process.
  virtual void lose(std::string_view error) { (void)error; }
  // Ends all processes at once.
  [[noreturn]] virtual void abort(int code) = 0;

  // The message of the lowest rank that has one, with its number; empty: none has. fault: of each local rank.
  std::string agree(const std::vector<std::string>& fault);
  // Finds the mirror of each link, after they were made.
  void match(Links& links) const;

  Traffic traffic;

protected:
  std::vector<int> local_;
};

// Serialisation of the content of parcels.
class Packer {
public:
  template <class T>
  void put(const T& value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof(T));
    std::memcpy(bytes.data() + at, &value, sizeof(T));
  }
  template <class T>
  void put_all(std::span<const T> values) {
    put(std::int64_t(values.size()));
    const std::size_t at = bytes.size();
    bytes.resize(at + values.size_bytes());
    if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), values.size_bytes());
  }
  Bytes bytes;
};
class Unpacker {
public:
  explicit Unpacker(Piece from) : from_(from) {}
  bool more() const { return at_ < from_.size(); }
  template <class T>
  T get() {
    T value;
    std::memcpy(&value, from_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <class T>
  std::vector<T> get_all() {
    std::vector<T> values(std::size_t(get<std::int64_t>()));
    if (!values.empty()) std::memcpy(values.data(), from_.data() + at_, values.size() * sizeof(T));
    at_ += values.size() * sizeof(T);
    return values;
  }
  // The bytes of put_all() without a copy, at any address; n: their items of `size` bytes.
  const std::byte* pass_over(std::size_t size, std::size_t& n) {
    n = std::size_t(get<std::int64_t>());
    const std::byte* first = from_.data() + at_;
    at_ += n * size;
    return first;
  }

private:
  Piece from_;
  std::size_t at_ = 0;
};

// Ranks in turns in this process; one rank is the serial form.
std::unique_ptr<Exchange> virtual_ranks(int ranks);
// One rank a process of MPI, by the library at `path` (cairn_mpi), which is loaded now. communicator: as Fortran has it
// (MPI_Fint), the same for all ranks of a process. Throws Error if there is no such library.
inline constexpr std::int64_t mpi_world = std::numeric_limits<std::int64_t>::min(); // MPI_COMM_WORLD
std::unique_ptr<Exchange> mpi_ranks(const std::string& path, std::int64_t communicator);

} // namespace cairn
