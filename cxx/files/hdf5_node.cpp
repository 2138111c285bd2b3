#include "hdf5_node.hpp"

#include <algorithm>

#include "checksums.hpp"
#include "hdf5_image.hpp"

namespace cairn {

using namespace hdf5;

namespace {

constexpr int deepest = 40; // groups within groups
constexpr int most_links = 40;

// Copies the part of a chunk that is within rows [first, first + count) of an array; axis by axis.
struct PartCopy {
  const std::vector<std::int64_t>&shape, &chunk, &offset;
  std::int64_t first, count;
  std::size_t item;
  const unsigned char* from;
  unsigned char* to;

  void along(std::size_t axis, std::int64_t source, std::int64_t target) const {
    const bool rows = axis == 0;
    const std::int64_t low = rows ? std::max(first, offset[axis]) : offset[axis];
    const std::int64_t limit = rows ? std::min(first + count, shape[0]) : shape[axis];
    const std::int64_t high = std::min(limit, offset[axis] + chunk[axis]);
    if (low >= high) return;
    const std::int64_t source_at = source * chunk[axis] + (low - offset[axis]);
    const std::int64_t target_at = target * (rows ? count : shape[axis]) + (low - (rows ? first : 0));
    if (axis + 1 == shape.size()) {
      std::memcpy(to + std::size_t(target_at) * item, from + std::size_t(source_at) * item,
                  std::size_t(high - low) * item);
      return;
    }
    for (std::int64_t k = 0; k < high - low; ++k) along(axis + 1, source_at + k, target_at + k);
  }
};

} // namespace

Hdf5Node Hdf5Node::open(const std::string& path) {
  auto image = std::make_shared<Image>(path);
  const std::uint64_t root = image->root();
  return {std::move(image), root, "/", 0};
}

const std::string& Hdf5Node::path() const { return image_->path(); }

Hdf5Node::Hdf5Node(std::shared_ptr<Image> image, std::uint64_t address, std::string name, int depth)
    : image_(std::move(image)), address_(address), name_(std::move(name)), depth_(depth) {
  if (depth > deepest) image_->damaged("its groups are nested without end");
  for (const auto& [type, data] : image_->header(address)) take(type, data);
  if (!group_ && layout_.kind == Layout::none) {
    if (!datatype_ && no_datatype_.empty())
      group_ = true; // a group without members
    else
      image_->damaged(name_ + " is neither a group nor an array");
  }
  if (!sorted_)
    std::stable_sort(links_.begin(), links_.end(), [](const LinkTo& a, const LinkTo& b) { return a.order < b.order; });
  else
    std::sort(links_.begin(), links_.end(), [](const LinkTo& a, const LinkTo& b) { return a.name < b.name; });
  for (std::size_t k = 0; k + 1 < links_.size(); ++k)
    if (links_[k].name == links_[k + 1].name) image_->damaged(name_ + " has two members of one name");
  if (!group_) check_size();
}

void Hdf5Node::take(int type, const Bytes& data) {
  Cursor in(*image_, data);
  switch (type) {
  case 1: shape_ = dataspace_of(*image_, in); break;
  case -1: image_->unknown("shapes that arrays share");
  case 2: {
    group_ = true;
    const int version = in.u8(), flags = in.u8();
    if (version != 0) image_->unknown("groups of a later version");
    if (flags & 1) in.u64();
    sorted_ = sorted_ && !(flags & 1);
    if (in.u64() != undefined) image_->unknown("groups of very many members");
    break;
  }
  case 3: try { datatype_ = datatype_of(*image_, in);
    } catch (const UnknownStructure& e) { no_datatype_ = e.problem; } // an array that nobody may ask for
    break;
  case -3: no_datatype_ = "this HDF5 file has kinds of numbers that have names, which Cairn does not read"; break;
  case 6: {
    group_ = true;
    if (in.u8() != 1) image_->unknown("links of a later version");
    const int flags = in.u8(), kind = flags & 8 ? in.u8() : 0;
    const std::uint64_t order = flags & 4 ? in.u64() : links_.size();
    if (flags & 16) in.u8();
    const std::string name = in.text(in.number(1 << (flags & 3)));
    if (kind == 0)
      links_.push_back({name, in.u64(), order});
    else if (kind == 1)
      links_.push_back({name, in.text(in.u16()), order});
    else
      image_->unknown("links to other files");
    break;
  }
  case 8: layout_ = layout_of(*image_, in); break;
  case 11: {
    in.u8();
    filtered_ = in.u8() > 0;
    break;
  }
  case 12: {
    const int version = in.u8();
    if (version < 1 || version > 3) image_->unknown("attributes of a later version");
    in.u8();
    const std::uint16_t length = in.u16();
    in.u32();
    if (version == 3) in.u8();
    attributes_.emplace_back(in.text(length), data);
    break;
  }
  case 17: {
    group_ = true;
    const std::uint64_t tree = in.u64(), heap = in.u64();
    read_symbols(tree, heap);
    break;
  }
  case 21: {
    const int version = in.u8(), flags = in.u8();
    if (version == 0 && flags & 1) in.u16();
    if (in.u64() != undefined) image_->unknown("very many attributes");
    break;
  }
  default: break;
  }
}

// Members of a group as HDF5 wrote them before 1.8: a B-tree of tables, names in a heap.
void Hdf5Node::read_symbols(std::uint64_t tree, std::uint64_t heap) {
  const Bytes start = image_->read(heap, 32);
  Cursor in(*image_, start);
  if (!in.tag("HEAP")) image_->damaged("the names of a group do not stand where they should");
  in.skip(4);
  const std::uint64_t size = in.u64();
  in.u64();
  const Bytes names = image_->read(in.u64(), size);
  std::set<std::uint64_t> seen;
  symbols_of(tree, names, seen, 8);
}

void Hdf5Node::symbols_of(std::uint64_t address, const Bytes& heap, std::set<std::uint64_t>& seen, int level) {
  if (!seen.insert(address).second || level < 0) image_->damaged("the members of a group go round in a circle");
  const Bytes head = image_->read(address, 24);
  Cursor in(*image_, head);
  if (in.tag("TREE")) {
    if (in.u8() != 0) image_->damaged("the members of a group do not stand where they should");
    const int own = in.u8(), count = in.u16();
    if (own >= level && level < 8) image_->damaged("the members of a group go round in a circle");
    const Bytes body = image_->read(address + 24, 8 + 16 * std::uint64_t(count));
    Cursor entry(*image_, body);
    for (int k = 0; k < count; ++k) {
      entry.u64();
      symbols_of(entry.u64(), heap, seen, std::min(own, 7));
    }
    return;
  }
  in = Cursor(*image_, head);
  if (!in.tag("SNOD")) image_->damaged("the members of a group do not stand where they should");
  in.u16();
  const int count = in.u16();
  const Bytes body = image_->read(address + 8, 40 * std::uint64_t(count));
  Cursor entry(*image_, body);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t name = entry.u64(), object = entry.u64();
    const std::uint32_t cached = entry.u32();
    entry.u32();
    const Bytes scratch = entry.bytes(16);
    if (name >= heap.size()) image_->damaged("a member of a group has no name");
    Cursor text(*image_, heap, name);
    if (cached == 2) {
      std::uint32_t place;
      std::memcpy(&place, scratch.data(), 4);
      if (place >= heap.size()) image_->damaged("a link leads nowhere");
      Cursor path(*image_, heap, place);
      links_.push_back({text.text(text.left()), path.text(path.left()), links_.size()});
    } else {
      links_.push_back({text.text(text.left()), object, links_.size()});
    }
  }
}

std::vector<std::string> Hdf5Node::names() const {
  std::vector<std::string> out;
  for (const LinkTo& link : links_) out.push_back(link.name);
  return out;
}

std::optional<std::string> Hdf5Node::soft_link(const std::string& name) const {
  for (const LinkTo& link : links_)
    if (link.name == name)
      if (const auto* path = std::get_if<std::string>(&link.target)) return *path;
  return {};
}

Hdf5Node Hdf5Node::child(const std::string& name) const {
  for (const LinkTo& link : links_)
    if (link.name == name) {
      const std::string own = name_ == "/" ? "/" + name : name_ + "/" + name;
      if (const auto* address = std::get_if<std::uint64_t>(&link.target)) return {image_, *address, own, depth_ + 1};
      return followed(std::get<std::string>(link.target), most_links);
    }
  image_->damaged(name_ + " lacks " + name);
}

Hdf5Node Hdf5Node::at(const std::string& path) const { return followed(path, most_links); }

Hdf5Node Hdf5Node::followed(const std::string& path, int links) const {
  if (links < 0) image_->damaged("its links go round in a circle");
  Hdf5Node here = path.starts_with('/') ? Hdf5Node(image_, image_->root(), "/", 0) : *this;
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    const std::string name = path.substr(at, end - at);
    at = end + 1;
    if (name.empty()) continue;
    const std::optional<std::string> link = here.soft_link(name);
    here = link ? here.followed(*link, links - 1) : here.child(name);
  }
  return here;
}

bool Hdf5Node::contains(const std::string& path) const {
  const std::size_t slash = path.find('/');
  const std::string name = path.substr(0, slash);
  if (name.empty()) return slash != std::string::npos && contains(path.substr(slash + 1));
  if (std::none_of(links_.begin(), links_.end(), [&](const LinkTo& link) { return link.name == name; })) return false;
  return slash == std::string::npos || child(name).contains(path.substr(slash + 1));
}

std::vector<std::string> Hdf5Node::attribute_names() const {
  std::vector<std::string> out;
  for (const auto& [name, data] : attributes_) out.push_back(name);
  return out;
}

std::optional<StoredArray> Hdf5Node::attribute(const std::string& name) const {
  for (const auto& [known, data] : attributes_) {
    if (known != name) continue;
    Cursor in(*image_, data);
    const int version = in.u8(), flags = in.u8();
    if (version > 1 && flags) return {};
    const std::uint16_t name_size = in.u16(), type_size = in.u16(), space_size = in.u16();
    if (version == 3) in.u8();
    const auto part = [&](std::uint16_t size) {
      Bytes bytes = in.bytes(size);
      if (version == 1) in.align(); // from the begin of the message, as HDF5 has it
      return bytes;
    };
    part(name_size);
    const Bytes type = part(type_size), space = part(space_size);
    Cursor type_in(*image_, type), space_in(*image_, space);
    Datatype datatype;
    try {
      datatype = datatype_of(*image_, type_in);
    } catch (const UnknownStructure&) { return {}; }
    std::vector<std::int64_t> shape = dataspace_of(*image_, space_in);
    const std::uint64_t size = bytes_of(*image_, datatype, shape);
    return converted(*image_, datatype, std::move(shape), in.bytes(size));
  }
  return {};
}

StoredType Hdf5Node::type() const {
  if (!datatype_) throw UnknownStructure(image_->path(), name_ + ": " + no_datatype_, "write it again without");
  return datatype_->type;
}

void Hdf5Node::check_size() const {
  if (!datatype_) return;
  const std::uint64_t size = bytes_of(*image_, *datatype_, shape_);
  const bool told = layout_.kind == Layout::compact      ? layout_.inside.size() >= size
                    : layout_.kind == Layout::contiguous ? layout_.address == undefined || layout_.size >= size
                                                         : layout_.chunk.size() == shape_.size() + 1;
  if (!told) image_->damaged(name_ + " is stored in another size than it has");
}

StoredArray Hdf5Node::read() const { return rows(0, shape_.empty() ? 1 : shape_[0]); }

std::shared_ptr<const unsigned char> Hdf5Node::mapped() const {
  const StoredType of = type();
  const bool lies = layout_.kind == Layout::contiguous && layout_.address != undefined && !filtered_;
  if (group_ || !lies || of.kind == 'S' || datatype_->big_endian || layout_.address % of.item != 0) return nullptr;
  const std::uint64_t size = bytes_of(*image_, *datatype_, shape_);
  return size > 0 ? image_->map(layout_.address, size) : nullptr;
}

StoredArray Hdf5Node::rows(std::int64_t first, std::int64_t count) const {
  type();
  if (group_) image_->damaged(name_ + " is a group, and no array");
  const std::int64_t there = shape_.empty() ? 1 : shape_[0];
  if (first < 0 || count < 0 || first > there || count > there - first)
    image_->damaged(name_ + " has " + std::to_string(there) + " rows; rows " + std::to_string(first) + " to " +
                    std::to_string(first + count) + " are asked for");
  if (filtered_) image_->unknown("compressed arrays");
  std::vector<std::int64_t> shape = shape_;
  if (!shape.empty()) shape[0] = count;
  const std::uint64_t size = bytes_of(*image_, *datatype_, shape), row = count > 0 ? size / std::uint64_t(count) : 0;
  Bytes raw(size);
  if (size > 0 && layout_.kind == Layout::compact) {
    std::copy_n(layout_.inside.begin() + std::ptrdiff_t(row * std::uint64_t(first)), size, raw.begin());
  } else if (size > 0 && layout_.kind == Layout::contiguous) {
    if (layout_.address != undefined) image_->read(layout_.address + row * std::uint64_t(first), raw.data(), size);
  } else if (size > 0) {
    Bytes piece;
    std::uint64_t piece_size = datatype_->size;
    for (std::size_t k = 0; k < shape_.size(); ++k) piece_size *= std::uint64_t(layout_.chunk[k]);
    const auto& all = chunks();
    // those before the rows that are asked for are not looked at
    auto at = std::lower_bound(all.begin(), all.end(), first - layout_.chunk[0] + 1,
                               [](const Chunk& c, std::int64_t from) { return c.offset[0] < from; });
    for (; at != all.end() && at->offset[0] < first + count; ++at) {
      if (shape_.size() == 1 || std::equal(shape_.begin() + 1, shape_.end(), layout_.chunk.begin() + 1)) {
        const std::int64_t low = std::max(first, at->offset[0]);
        const std::int64_t high = std::min(first + count, at->offset[0] + layout_.chunk[0]);
        if (low < high)
          image_->read(at->address + std::uint64_t(low - at->offset[0]) * row,
                       raw.data() + std::uint64_t(low - first) * row, std::uint64_t(high - low) * row);
        continue;
      }
      piece.resize(piece_size);
      image_->read(at->address, piece.data(), piece_size);
      PartCopy{shape_, layout_.chunk, at->offset, first, count, datatype_->size, piece.data(), raw.data()}.along(0, 0,
                                                                                                                 0);
    }
  }
  return converted(*image_, *datatype_, std::move(shape), std::move(raw));
}

const std::vector<Chunk>& Hdf5Node::chunks() const {
  if (chunks_) return *chunks_;
  chunks_ = std::make_shared<std::vector<Chunk>>();
  std::uint64_t size = datatype_ ? datatype_->size : 1;
  if (layout_.chunk.back() != std::int64_t(size)) image_->damaged(name_ + " is stored in pieces of another kind");
  for (std::size_t k = 0; k + 1 < layout_.chunk.size(); ++k) {
    if (std::uint64_t(layout_.chunk[k]) > image_->size() / size)
      image_->damaged("a piece of " + name_ + " is larger than the file");
    size *= std::uint64_t(layout_.chunk[k]);
  }
  std::set<std::uint64_t> seen;
  if (layout_.address != undefined) gather(layout_.address, 256, seen);
  std::sort(chunks_->begin(), chunks_->end(), [](const Chunk& a, const Chunk& b) { return a.offset < b.offset; });
  for (std::size_t k = 0; k < chunks_->size(); ++k) {
    const Chunk& c = (*chunks_)[k];
    if (c.address > image_->size() || size > image_->size() - c.address)
      image_->damaged("a piece of " + name_ + " stands beyond its end");
    if (k > 0 && (*chunks_)[k - 1].offset == c.offset) image_->damaged("a piece of " + name_ + " stands twice");
  }
  return *chunks_;
}

void Hdf5Node::gather(std::uint64_t address, int above, std::set<std::uint64_t>& seen) const {
  if (!seen.insert(address).second) image_->damaged("the pieces of " + name_ + " go round in a circle");
  const Bytes head = image_->read(address, 24);
  Cursor in(*image_, head);
  if (!in.tag("TREE") || in.u8() != 1) image_->damaged("the pieces of " + name_ + " do not stand where they should");
  const int level = in.u8(), count = in.u16();
  if (level >= above || level > deepest) image_->damaged("the pieces of " + name_ + " go round in a circle");
  const std::size_t axes = layout_.chunk.size();
  const Bytes body = image_->read(address + 24, std::uint64_t(count) * (16 + 8 * axes));
  Cursor entry(*image_, body);
  for (int k = 0; k < count; ++k) {
    entry.u32();
    if (entry.u32() != 0 && filtered_) image_->unknown("compressed arrays");
    Chunk chunk;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const std::uint64_t offset = entry.u64();
      if (offset >> 62 || (axis + 1 < axes && offset % std::uint64_t(layout_.chunk[axis]) != 0))
        image_->damaged("a piece of " + name_ + " has no place");
      if (axis + 1 < axes) chunk.offset.push_back(std::int64_t(offset));
    }
    chunk.address = entry.u64();
    if (level > 0)
      gather(chunk.address, level, seen);
    else
      chunks_->push_back(std::move(chunk));
  }
}

std::vector<std::uint64_t> Hdf5Node::chunk_addresses() const {
  const std::int64_t per_chunk = std::max<std::int64_t>(1, chunk_rows()),
                     due = shape_.empty() ? 0 : (shape_[0] + per_chunk - 1) / per_chunk;
  if (filtered_ || !std::equal(shape_.begin() + 1, shape_.end(), layout_.chunk.begin() + 1))
    image_->unknown("arrays that Cairn cannot go on with");
  const auto& all = chunks();
  std::vector<std::uint64_t> out;
  for (std::int64_t k = 0; k < due; ++k) {
    if (k >= std::int64_t(all.size()) || all[std::size_t(k)].offset[0] != k * per_chunk)
      image_->damaged("a piece of " + name_ + " is missing");
    out.push_back(all[std::size_t(k)].address);
  }
  return out;
}

std::uint32_t Hdf5Node::data_checksum() const {
  if (shape_.empty()) {
    const StoredArray all = read();
    return crc32(all.bytes.data(), all.bytes.size());
  }
  std::uint32_t sum = 0;
  const std::int64_t step = std::max<std::int64_t>(1, is_chunked() ? chunk_rows() : shape_[0]);
  for (std::int64_t at = 0; at < shape_[0]; at += step) {
    const StoredArray part = rows(at, std::min(step, shape_[0] - at));
    sum = crc32(part.bytes.data(), part.bytes.size(), sum);
  }
  return sum;
}

} // namespace cairn
