// Trees of named values, the form of checkpoints and scenes in files.
#pragma once
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "stored_array.hpp"

namespace cairn {

struct StoredMember;

// kind: the meaning of an array: "array", "number" (of an array's type), "float", "flags" and "flag" (true and false),
// "bytes", "json" and "texts" (JSON in bytes); empty: a tree.
struct StoredValue {
  std::string kind;
  StoredArray array;
  std::vector<StoredMember> members;
  std::shared_ptr<const unsigned char> mapped = nullptr; // numbers of an array that stays in its file: it has no bytes

  bool is_tree() const { return kind.empty(); }
  const StoredValue* find(const std::string& name) const; // null: none
  // Throw std::invalid_argument naming a value that is missing or of another kind.
  const StoredValue& at(const std::string& name) const;
  const StoredValue& tree(const std::string& name) const;
  std::int64_t whole(const std::string& name, std::int64_t most = std::int64_t(1) << 62) const; // from 0 to most - 1
  double real(const std::string& name) const;
  std::string text(const std::string& name) const;
  std::vector<bool> flags(const std::string& name) const;

  void add(const std::string& name, StoredValue value);
  template <class T>
  void add_array(const std::string& name, const T* values, std::vector<std::int64_t> shape);
  void add_whole(const std::string& name, std::int64_t value);
  void add_real(const std::string& name, double value);
  void add_text(const std::string& name, const std::string& value);
  void add_flags(const std::string& name, const std::vector<bool>& values);
};

// A value under its name: no pair, whose constructors ask for a whole StoredValue before there is one.
struct StoredMember {
  std::string name;
  StoredValue value;
};

template <class T>
void StoredValue::add_array(const std::string& name, const T* values, std::vector<std::int64_t> shape) {
  add(name, {"array", StoredArray::of(values, std::move(shape)), {}});
}

// Numbers of an array as T. Throws std::invalid_argument where they are of another kind: real numbers for whole ones.
template <class T>
std::vector<T> numbers_of(const StoredArray& array, const std::string& name);

// Writes a file "cairn-checkpoint" with a checksum over names, types, shapes and bytes; load_tree refuses a damaged
// file. Bits are preserved: NaN with their payload, -0.0, subnormal numbers.
void save_tree(const std::string& path, const StoredValue& tree);
// what, given: words for messages ("a checkpoint", ".checkpoint.h5"). Arrays of at least `stays_from` bytes stay in the
// file, if they lie there as in memory.
StoredValue load_tree(const std::string& path, const std::string& what, const std::string& given,
                      std::uint64_t stays_from = std::numeric_limits<std::uint64_t>::max());

} // namespace cairn
