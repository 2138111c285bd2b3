// Reads HDF5 files, after the HDF5 File Format Specification, version 3.0: what Cairn writes, and what the HDF5 library
// writes without compression. Nothing is taken as the file has it: checksums of headers, addresses, sizes, counts and
// loops are looked at first, so that a damaged file ends in FileError, not in a crash or without end.
#pragma once
#include <memory>
#include <optional>
#include <set>

#include "file_error.hpp"
#include "hdf5_bytes.hpp"

namespace cairn {

// A sound file may hold it; this reader does not know it.
struct UnknownStructure : FileError {
  using FileError::FileError;
};

namespace hdf5 {
class Image;
struct Chunk {
  std::vector<std::int64_t> offset; // of its first number along each axis
  std::uint64_t address;
};
struct Layout {
  enum { none, compact, contiguous, chunked } kind = none;
  std::uint64_t address = undefined, size = 0; // of data, or of the B-tree over chunks
  Bytes inside;
  std::vector<std::int64_t> chunk;
};
struct Datatype {
  StoredType type;
  bool big_endian = false, variable = false; // variable: texts in the global heap
  std::uint32_t size = 0;                    // in the file
};
} // namespace hdf5

// A group or an array of a file.
class Hdf5Node {
public:
  static Hdf5Node open(const std::string& path); // the root
  const std::string& path() const;               // of the file
  const std::string& name() const { return name_; }

  bool is_group() const { return group_; }
  std::vector<std::string> names() const; // in the order in which they were made where that is kept, else by letters
  bool contains(const std::string& path) const;
  std::optional<std::string> soft_link(const std::string& name) const;
  Hdf5Node child(const std::string& name) const;
  Hdf5Node at(const std::string& path) const; // "a/b", from the root if it begins with "/"

  std::vector<std::string> attribute_names() const;
  std::optional<StoredArray> attribute(const std::string& name) const; // none, too, of kinds that are not read

  StoredType type() const; // throws for kinds that are not read
  const std::vector<std::int64_t>& shape() const { return shape_; }
  StoredArray read() const;
  StoredArray rows(std::int64_t first, std::int64_t count) const;
  // Numbers of an array that stand in the file one after the other as in memory, which reads them when they are looked
  // at; null: they do not.
  std::shared_ptr<const unsigned char> mapped() const;

  std::uint64_t address() const { return address_; }
  bool is_chunked() const { return layout_.kind == hdf5::Layout::chunked; }
  std::int64_t chunk_rows() const { return layout_.chunk.empty() ? 0 : layout_.chunk[0]; }
  std::vector<std::uint64_t> chunk_addresses() const; // of an array that Cairn grows, by rising rows
  std::uint32_t data_checksum() const;

private:
  struct LinkTo {
    std::string name;
    hdf5::Target target;
    std::uint64_t order;
  };
  Hdf5Node(std::shared_ptr<hdf5::Image> image, std::uint64_t address, std::string name, int depth);
  void take(int type, const hdf5::Bytes& data);
  void read_symbols(std::uint64_t tree, std::uint64_t heap);
  void symbols_of(std::uint64_t address, const hdf5::Bytes& heap, std::set<std::uint64_t>& seen, int level);
  Hdf5Node followed(const std::string& path, int links) const;
  const std::vector<hdf5::Chunk>& chunks() const;
  void gather(std::uint64_t address, int level, std::set<std::uint64_t>& seen) const;
  void check_size() const;

  std::shared_ptr<hdf5::Image> image_;
  std::uint64_t address_;
  std::string name_;
  int depth_;
  bool group_ = false, filtered_ = false, sorted_ = true;
  std::vector<LinkTo> links_;
  std::vector<std::pair<std::string, hdf5::Bytes>> attributes_; // messages
  std::optional<hdf5::Datatype> datatype_;
  std::string no_datatype_;
  std::vector<std::int64_t> shape_;
  hdf5::Layout layout_;
  mutable std::shared_ptr<std::vector<hdf5::Chunk>> chunks_;
};

} // namespace cairn
