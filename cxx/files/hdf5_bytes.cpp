#include "hdf5_bytes.hpp"

#include <algorithm>
#include <stdexcept>

#include "checksums.hpp"

namespace cairn::hdf5 {

namespace {

enum Message : std::uint8_t {
  dataspace_message = 1,
  link_info = 2,
  datatype_message = 3,
  fill_value = 5,
  link = 6,
  layout = 8,
  group_info = 10,
  attribute_message = 12
};

struct Out {
  Bytes bytes;
  template <class T>
  Out& put(T value) {
    return put(&value, sizeof value);
  }
  [[gnu::noinline]] Out& put(const void* data, std::size_t n) { // inlined, GCC 12 sees overflows that there are not
    const std::size_t at = bytes.size();
    bytes.resize(at + n);
    if (n > 0) std::memcpy(bytes.data() + at, data, n);
    return *this;
  }
  template <class... T>
  Out& u8(T... values) {
    (put(std::uint8_t(values)), ...);
    return *this;
  }
};

Bytes datatype(StoredType t, bool ascii = false) {
  Out out;
  const auto bits = std::uint16_t(8 * t.item);
  switch (t.kind) {
  case 'b':
  case 'i':
  case 'u': out.u8(0x10, t.kind == 'i' ? 8 : 0, 0, 0).put(t.item).put(std::uint16_t(0)).put(bits); break;
  case 'f': {
    if (t.item != 4 && t.item != 8) throw std::invalid_argument("a file holds real numbers of 4 or 8 bytes");
    const bool twice = t.item == 8;
    out.u8(0x11, 0x20, bits - 1, 0).put(t.item).put(std::uint16_t(0)).put(bits);
    out.u8(twice ? 52 : 23, twice ? 11 : 8, 0, twice ? 52 : 23).put(std::uint32_t(twice ? 1023 : 127));
    break;
  }
  case 'S': out.u8(0x13, ascii ? 1 : 0x11, 0, 0).put(t.item); break; // nought-padded
  default: throw std::invalid_argument("a file holds whole and real numbers and texts");
  }
  return out.bytes;
}

Bytes dataspace(const std::vector<std::int64_t>& shape, bool extendable) {
  Out out;
  out.u8(2, shape.size(), extendable ? 1 : 0, shape.empty() ? 0 : 1);
  for (const std::int64_t n : shape) out.put(std::uint64_t(n));
  if (extendable) {
    out.put(undefined);
    for (std::size_t i = 1; i < shape.size(); ++i) out.put(std::uint64_t(shape[i]));
  }
  return out.bytes;
}

Bytes attribute(const std::string& name, const StoredArray& value) {
  const bool ascii = std::all_of(value.bytes.begin(), value.bytes.end(), [](unsigned char c) { return c < 128; });
  const Bytes kind = datatype(value.type, ascii), space = dataspace(value.shape, false); // VTK before 9.5 refuses UTF-8
  Out out;
  out.u8(3, 0);
  for (const std::size_t size : {name.size() + 1, kind.size(), space.size()}) out.put(std::uint16_t(size));
  out.u8(1).put(name.c_str(), name.size() + 1).put(kind.data(), kind.size()).put(space.data(), space.size());
  return out.put(value.bytes.data(), value.bytes.size()).bytes;
}

class Header {
public:
  void add(Message kind, const Bytes& data) {
    if (data.size() > 0xFFFF)
      throw std::invalid_argument("a header message of " + std::to_string(data.size()) +
                                  " bytes is too long; store it as a dataset");
    body_.put(std::uint8_t(kind)).put(std::uint16_t(data.size())).u8(0).put(data.data(), data.size());
  }
  void add(const Attributes& attributes) {
    for (const auto& [name, value] : attributes) add(attribute_message, attribute(name, value));
  }
  Bytes whole() const {
    Out out;
    out.put("OHDR", 4).u8(2, 2).put(std::uint32_t(body_.bytes.size())).put(body_.bytes.data(), body_.bytes.size());
    return out.put(lookup3(out.bytes.data(), out.bytes.size())).bytes;
  }

private:
  Out body_;
};

} // namespace

Bytes superblock(std::uint64_t root, std::uint64_t end) {
  Out out;
  out.put(signature, 8).u8(2, 8, 8, 0).put(std::uint64_t(0)).put(undefined).put(end).put(root);
  return out.put(lookup3(out.bytes.data(), out.bytes.size())).bytes;
}

Bytes group_header(const std::vector<std::pair<std::string, Target>>& links, const Attributes& attributes) {
  Header header;
  header.add(link_info,
             Out().u8(0, 3).put(std::uint64_t(links.size())).put(undefined).put(undefined).put(undefined).bytes);
  header.add(group_info, Out().u8(0, 0).bytes);
  std::uint64_t order = 0;
  for (const auto& [name, target] : links) {
    const auto* path = std::get_if<std::string>(&target);
    Out out; // flags: length of the name in 2 bytes, creation order, type of link, character set
    out.u8(1, 0x1D, path ? 1 : 0).put(order++).u8(1).put(std::uint16_t(name.size())).put(name.data(), name.size());
    if (path)
      out.put(std::uint16_t(path->size())).put(path->data(), path->size());
    else
      out.put(std::get<std::uint64_t>(target));
    header.add(link, out.bytes);
  }
  header.add(attributes);
  return header.whole();
}

Bytes dataset_header(StoredType type, const std::vector<std::int64_t>& shape, std::uint64_t address, std::uint64_t size,
                     const Attributes& attributes) {
  Header header;
  header.add(datatype_message, datatype(type));
  header.add(fill_value, Out().u8(3, 0x0A).bytes);
  header.add(attributes);
  header.add(dataspace_message, dataspace(shape, false));
  header.add(layout, Out().u8(3, 1).put(address).put(size).bytes);
  return header.whole();
}

Bytes series_header(StoredType type, std::int64_t rows, const std::vector<std::int64_t>& row_shape,
                    std::int64_t rows_per_chunk, std::uint64_t index, const Attributes& attributes) {
  std::vector<std::int64_t> shape = {rows};
  shape.insert(shape.end(), row_shape.begin(), row_shape.end());
  Out chunks;
  chunks.u8(3, 2, shape.size() + 1).put(index).put(std::uint32_t(rows_per_chunk));
  for (const std::int64_t n : row_shape) chunks.put(std::uint32_t(n));
  chunks.put(type.item);
  Header header;
  header.add(datatype_message, datatype(type));
  header.add(fill_value, Out().u8(3, 0x0A).bytes);
  header.add(attributes);
  header.add(dataspace_message, dataspace(shape, true));
  header.add(layout, chunks.bytes);
  return header.whole();
}

Bytes tree_node(const TreeNode& n) {
  Out out;
  const auto key = [&](std::uint32_t bytes, std::int64_t row) {
    out.put(bytes).put(std::uint32_t(0)).put(std::uint64_t(row));
    for (int k = 0; k < n.rank; ++k) out.put(std::uint64_t(0)); // other axes, and the element
  };
  out.put("TREE", 4).u8(1, n.level).put(std::uint16_t(n.count)).put(undefined).put(undefined);
  for (std::int64_t i = 0; i < n.count; ++i) {
    key(n.chunk_bytes, n.first_row + i * n.rows_per_child);
    out.put(n.child[i]);
  }
  key(0, n.last_row);
  out.bytes.resize(24 + children * 8 + (children + 1) * std::size_t(8 + 8 * (n.rank + 1)));
  return out.bytes;
}

} // namespace cairn::hdf5
