// An HDF5 file that grows, and is a complete HDF5 file at every instant.
//
// The HDF5 library changes its structures in place, so a program killed while it writes leaves a file that no reader
// may open. In its mode for a single writer with many readers, too, the flag "open for writing" stays behind, and plain
// readers (VTK's among them) refuse the file until a repair. Here nothing that the file on disk refers to is changed:
//
// - new rows of data go behind all others, or into space of the last chunk that no reader knows of yet;
// - `commit` writes new copies of the changed headers and index nodes behind the data, then replaces the superblock
//   (48 bytes in one write), which points to the new root. A program killed before that leaves the old file, one killed
//   after it the new file.
//
// Space of replaced headers is reused some commits later, so that a reader which opened the file in between still finds
// its data. A commit that syncs also withstands a loss of power, and leaves a second copy of the superblock, from which
// `restore_superblock` can go back to that commit. Arrays carry "crc32", the checksum of their rows.
#pragma once
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "file_error.hpp"
#include "hdf5_bytes.hpp"

namespace cairn {

class GrowingFile;
class Hdf5Node;

// An array that grows along its first axis.
class Series {
public:
  Series(GrowingFile& file, StoredType type, std::vector<std::int64_t> row_shape, std::int64_t rows_per_chunk,
         hdf5::Attributes attributes);
  // Rows (n, row_shape) one after the other; returns the number of the first.
  std::int64_t append(const void* values, std::int64_t n);
  template <class T>
  std::int64_t append_one(T value) {
    return append(&value, 1);
  }
  std::int64_t rows() const { return rows_; }
  StoredType type() const { return type_; }
  const std::vector<std::int64_t>& row_shape() const { return row_shape_; }
  std::int64_t rows_per_chunk() const { return per_chunk_; }
  std::int64_t row_bytes() const { return row_bytes_; }
  void cut(std::int64_t rows); // forgets the rows after the first so many

private:
  friend class Group;
  std::uint64_t place();
  std::uint64_t index();

  GrowingFile* file_;
  StoredType type_;
  std::vector<std::int64_t> row_shape_;
  std::int64_t per_chunk_, rows_ = 0, row_bytes_;
  std::uint32_t checksum_ = 0;
  hdf5::Attributes attributes_;
  std::vector<std::vector<std::uint64_t>> levels_{1}; // addresses: of chunks, of the nodes over them, of those over ...
  std::int64_t indexed_ = 0;                          // chunks that the nodes know
  std::uint64_t address_ = hdf5::undefined;
  std::size_t size_ = 0;
  bool changed_ = true;
};

// Named members, in the order in which they were made, and attributes.
class Group {
public:
  explicit Group(GrowingFile& file) : file_(&file) {}
  Group(const Group&) = delete;
  Group& group(const std::string& name); // made if it is not there
  void array(const std::string& name, const StoredArray& value, hdf5::Attributes attributes = {}); // once and for all
  Series& series(const std::string& name, StoredType type, std::vector<std::int64_t> row_shape = {},
                 std::int64_t rows_per_chunk = 512, hdf5::Attributes attributes = {});
  void soft_link(const std::string& name, const std::string& path);
  void set_attribute(const std::string& name, StoredArray value);
  const StoredArray* attribute(const std::string& name) const; // null: none
  bool contains(const std::string& name) const;
  // Throws FileError where there is none.
  Series& series_at(const std::string& name);
  Group& group_at(const std::string& name);
  std::vector<std::string> names() const;

private:
  friend class GrowingFile;
  // a header that stays where it is is an address alone
  using Member = std::variant<std::unique_ptr<Group>, std::unique_ptr<Series>, std::uint64_t, std::string>;
  Member& add(const std::string& name, Member member);
  Member* find(const std::string& name);
  void take_over(const Hdf5Node& old, int depth);
  std::uint64_t place();

  GrowingFile* file_;
  std::vector<std::pair<std::string, Member>> members_;
  std::map<std::string, std::size_t> places_;
  hdf5::Attributes attributes_;
  std::uint64_t address_ = hdf5::undefined;
  std::size_t size_ = 0;
  std::vector<std::pair<std::string, hdf5::Target>> targets_;
  bool changed_ = true;
};

// A file that appears under its name with the first commit. Throws FileError if a file is there (unless it may be
// replaced), if the folder cannot be written to, or later if the disk is full; committed rows stay.
class GrowingFile {
public:
  enum class If { new_file, replace, go_on };
  GrowingFile(std::string path, If mode);
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;

  // Atomic replacement: the file is written under another name, synced, and renamed by the first commit, so that at
  // every instant the path holds either the old file or the complete new one.
  static std::unique_ptr<GrowingFile> whole(std::string path);

  Group& root() { return *root_; }
  const std::string& path() const { return path_; }
  // All that was written so far becomes part of the file. sync: wait until it is on the disk itself; not given: from
  // time to time.
  void commit(std::optional<bool> sync = {});
  void close(); // commits, unless writing has failed before
  std::int64_t size() const { return std::int64_t(end_); }
  bool failed() const { return failure_ != nullptr; }

  // For tests: called with address and bytes before each write; a result other than 0 is the errno of the write.
  static std::function<int(std::uint64_t, std::span<const unsigned char>)> watch;

private:
  friend class Group;
  friend class Series;
  GrowingFile() = default;
  void reopen();
  void abandon();
  [[noreturn]] void fail(int number);
  void write(std::uint64_t address, const void* data, std::size_t size);
  std::uint64_t allocate(std::size_t size);
  // Writes a header or node anew and gives up its old space; returns its address.
  std::uint64_t replace(std::uint64_t old, std::size_t old_size, const hdf5::Bytes& data);

  std::string path_, part_;
  bool whole_ = false;
  int fd_ = -1;
  std::uint64_t end_ = 512;
  std::int64_t commits_ = 0, durable_ = 0, wasted_ = 0;
  std::map<std::size_t, std::deque<std::pair<std::int64_t, std::uint64_t>>> freed_; // by size: commit, address
  std::unique_ptr<FileError> failure_;
  std::chrono::steady_clock::time_point synced_at_ = std::chrono::steady_clock::now();
  std::unique_ptr<Group> root_;
};

// Goes back to the last commit that the disk was known to hold; for a file that lost power while it was written. True
// if that changed the file.
bool restore_superblock(const std::string& path);

} // namespace cairn
