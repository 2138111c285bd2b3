// The bytes of HDF5 structures that Cairn writes, after the HDF5 File Format Specification, version 3.0: superblock 2,
// object headers 2, compact links, contiguous and chunked storage with a version 1 B-tree. All of it is read by HDF5
// 1.8 and later. Sizes of offsets and lengths are 8 bytes, little endian.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "stored_array.hpp"

namespace cairn::hdf5 {

using Bytes = std::vector<unsigned char>;
using Attributes = std::vector<std::pair<std::string, StoredArray>>;

inline constexpr std::uint64_t undefined = ~std::uint64_t(0);
inline constexpr std::size_t superblock_size = 48;
inline constexpr std::int64_t children =
    64; // of a B-tree node: twice the K that a superblock without extension implies
inline constexpr unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};

// Superblock of a file; root: address of the root group's header, end: end of the last byte.
Bytes superblock(std::uint64_t root, std::uint64_t end);

// A link of a group: to the header at an address, or a path.
using Target = std::variant<std::uint64_t, std::string>;
// The order of creation is kept, because VTK reads the blocks of an assembly in that order.
Bytes group_header(const std::vector<std::pair<std::string, Target>>& links, const Attributes& attributes);

// Header of a dataset of `size` bytes in one piece.
Bytes dataset_header(StoredType type, const std::vector<std::int64_t>& shape, std::uint64_t address, std::uint64_t size,
                     const Attributes& attributes);
// Header of a dataset that grows along its first axis, whose chunks the B-tree at `index` finds.
Bytes series_header(StoredType type, std::int64_t rows, const std::vector<std::int64_t>& row_shape,
                    std::int64_t rows_per_chunk, std::uint64_t index, const Attributes& attributes);

// Node of a B-tree over the chunks of an array cut along its first axis; always of its full size. Keys bound the
// children: key i is the first row of child i, the last key the row after all.
struct TreeNode {
  int level;
  const std::uint64_t* child;
  std::int64_t count, first_row, rows_per_child, last_row;
  int rank;
  std::uint32_t chunk_bytes;
};
Bytes tree_node(const TreeNode& node);

} // namespace cairn::hdf5
