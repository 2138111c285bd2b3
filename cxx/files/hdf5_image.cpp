#include "hdf5_image.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>

#include "checksums.hpp"

namespace cairn::hdf5 {

namespace {

const char* const remedy = "copy it again from where it was made, or try 'cairn info --repair'";
constexpr std::uint64_t most_header_bytes = 1 << 26;

// Adds the messages of one block of a header; returns the blocks that continue it.
std::vector<std::pair<std::uint64_t, std::uint64_t>> messages_of(const Image& image, const Bytes& block, int version,
                                                                 bool ordered, std::size_t& left,
                                                                 std::vector<std::pair<int, Bytes>>& out) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> more;
  Cursor in(image, block);
  const std::size_t head = version == 1 ? 8 : ordered ? 6 : 4;
  while (in.left() >= head && left > 0) {
    const int type = version == 1 ? in.u16() : in.u8();
    const std::uint16_t size = in.u16();
    const std::uint8_t flags = in.u8();
    in.skip(head - (version == 1 ? 5 : 4));
    Bytes data = in.bytes(size);
    --left;
    if (type == 0x10) {
      Cursor at(image, data);
      const std::uint64_t address = at.u64(), length = at.u64();
      more.emplace_back(address, length);
    } else if (flags & 2 && (type == 1 || type == 3 || type == 12)) {
      out.emplace_back(-type, Bytes()); // stands elsewhere, shared
    } else if (type != 0) {
      out.emplace_back(type, std::move(data));
    }
  }
  return more;
}

} // namespace

Image::Image(const std::string& path) : path_(path) {
  fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat there {};
  if (fd_ < 0 || ::fstat(fd_, &there) != 0) throw system_error(path, errno);
  try {
    if (S_ISDIR(there.st_mode)) throw system_error(path, EISDIR);
    if (!S_ISREG(there.st_mode)) throw FileError(path, "this is no plain file", "give the name of a file");
    size_ = std::uint64_t(there.st_size);
    const Bytes block = read(0, std::min<std::uint64_t>(size_, 96));
    if (block.size() < 8 || !std::equal(signature, signature + 8, block.begin()))
      throw FileError(path, size_ == 0 ? "the file is empty" : "this is not an HDF5 file",
                      "give a file that Cairn wrote");
    Cursor in(*this, block, 8);
    const int version = in.u8();
    std::uint64_t base, end;
    if (version == 2 || version == 3) {
      if (in.u8() != 8 || in.u8() != 8) unknown("addresses that are not of 8 bytes");
      in.u8();
      base = in.u64();
      in.u64();
      end = in.u64();
      root_ = in.u64();
      if (in.u32() != lookup3(block.data(), superblock_size - 4)) damaged("the checksum of its beginning is wrong");
    } else if (version == 0 || version == 1) {
      in.skip(4);
      if (in.u8() != 8 || in.u8() != 8) unknown("addresses that are not of 8 bytes");
      in.skip(1 + 2 + 2 + 4 + (version == 1 ? 4 : 0));
      base = in.u64();
      in.u64();
      end = in.u64();
      in.u64();
      in.u64(); // name of the root
      root_ = in.u64();
    } else {
      unknown("version " + std::to_string(version) + " of its beginning");
    }
    if (base != 0) unknown("data before its beginning");
    if (end > size_) throw FileError(path, "the file is truncated", remedy);
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

Image::~Image() { ::close(fd_); }

std::shared_ptr<const unsigned char> Image::map(std::uint64_t address, std::uint64_t count) const {
  if (count == 0 || address > size_ || count > size_ - address) damaged("numbers lie beyond its end");
  const auto page = std::uint64_t(::sysconf(_SC_PAGESIZE)), before = address % page, length = before + count;
  void* const first = ::mmap(nullptr, length, PROT_READ, MAP_PRIVATE, fd_, off_t(address - before));
  if (first == MAP_FAILED) throw system_error(path_, errno);
  return {static_cast<const unsigned char*>(first) + before,
          [first, length](const unsigned char*) { ::munmap(first, length); }};
}

void Image::damaged(const std::string& what) const { throw FileError(path_, "the file is damaged: " + what, remedy); }

void Image::unknown(const std::string& what) const {
  throw UnknownStructure(path_, "this HDF5 file has " + what + ", which Cairn does not read",
                         "write it again without (h5repack)");
}

void Image::read(std::uint64_t address, void* to, std::uint64_t count) const {
  if (address > size_ || count > size_ - address) damaged("something stands beyond its end");
  auto* at = static_cast<unsigned char*>(to);
  while (count > 0) {
    const ssize_t done = ::pread(fd_, at, count, off_t(address));
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) throw system_error(path_, errno);
    if (done == 0) throw FileError(path_, "the file is truncated", remedy);
    at += done;
    address += std::uint64_t(done);
    count -= std::uint64_t(done);
  }
}

Bytes Image::read(std::uint64_t address, std::uint64_t count) const {
  if (address > size_ || count > size_ - address) damaged("something stands beyond its end");
  Bytes out(count);
  read(address, out.data(), count);
  return out;
}

std::vector<std::pair<int, Bytes>> Image::header(std::uint64_t address) const {
  std::vector<std::pair<int, Bytes>> out;
  const Bytes start = read(address, std::min<std::uint64_t>(64, size_ - std::min(address, size_)));
  Cursor in(*this, start);
  std::vector<std::pair<std::uint64_t, std::uint64_t>> blocks;
  std::uint64_t total = 0;
  const bool second = in.tag("OHDR");
  bool ordered = false;
  std::size_t left = ~std::size_t(0);
  if (second) {
    if (in.u8() != 2) unknown("a header of a later version");
    const int flags = in.u8();
    ordered = flags & 4;
    in.skip((flags & 32 ? 16 : 0) + (flags & 16 ? 4 : 0));
    const std::uint64_t size = in.number(1 << (flags & 3)), whole = in.at() + size;
    if (size > most_header_bytes) damaged("a header is too long");
    const Bytes block = read(address, whole + 4);
    std::uint32_t sum;
    std::memcpy(&sum, block.data() + whole, 4);
    if (sum != lookup3(block.data(), whole)) damaged("the checksum of a header is wrong");
    blocks = messages_of(*this, {block.begin() + std::ptrdiff_t(in.at()), block.end() - 4}, 2, ordered, left, out);
  } else {
    in = Cursor(*this, start);
    if (in.u8() != 1) damaged("there is no header where one is named");
    in.u8();
    left = in.u16();
    in.u32();
    const std::uint64_t size = in.u32();
    blocks = messages_of(*this, read(address + 16, size), 1, false, left, out);
  }
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const auto [at, length] = blocks[k];
    total += length;
    if (total > std::min(most_header_bytes, size_)) damaged("a header goes on without end");
    Bytes block = read(at, length);
    if (second) {
      if (length < 8 || !std::equal(block.begin(), block.begin() + 4, "OCHK"))
        damaged("a header does not go on where it says");
      std::uint32_t sum;
      std::memcpy(&sum, block.data() + length - 4, 4);
      if (sum != lookup3(block.data(), length - 4)) damaged("the checksum of a header is wrong");
      block = {block.begin() + 4, block.end() - 4};
    }
    for (const auto& more : messages_of(*this, block, second ? 2 : 1, ordered, left, out)) blocks.push_back(more);
  }
  return out;
}

namespace {

// Texts of several lengths, out of the collections of the global heap. Each collection is read once: a damaged file may
// name one as often as it has numbers.
class Heap {
public:
  explicit Heap(const Image& image) : image_(image) {}
  const Bytes& object(std::uint64_t collection, std::uint32_t index) {
    const auto [at, fresh] = collections_.try_emplace(collection);
    if (fresh) at->second = objects(collection);
    const auto found = at->second.find(index);
    if (found == at->second.end()) image_.damaged("a text does not stand where it is named");
    return found->second;
  }

private:
  std::map<std::uint32_t, Bytes> objects(std::uint64_t collection) {
    const Bytes start = image_.read(collection, 16);
    Cursor in(image_, start);
    if (!in.tag("GCOL")) image_.damaged("a text does not stand where it is named");
    in.skip(4);
    const std::uint64_t size = in.u64();
    // sound collections do not overlap
    if (size > image_.size() - read_) image_.damaged("collections of texts stand in each other");
    read_ += size;
    const Bytes all = image_.read(collection, size);
    Cursor object(image_, all, 16);
    std::map<std::uint32_t, Bytes> out;
    while (object.left() >= 16) {
      const std::uint16_t number = object.u16();
      object.skip(6);
      const std::uint64_t length = object.u64();
      if (number == 0) break; // free space
      out.try_emplace(number, object.bytes(length));
      object.align();
    }
    return out;
  }

  const Image& image_;
  std::uint64_t read_ = 0;
  std::map<std::uint64_t, std::map<std::uint32_t, Bytes>> collections_;
};

} // namespace

Datatype datatype_of(const Image& image, Cursor& in) {
  const int first = in.u8(), version = first >> 4;
  const std::uint32_t bits = std::uint32_t(in.number(1)) | std::uint32_t(in.number(2)) << 8;
  Datatype out;
  out.size = in.u32();
  if (version < 1 || version > 3) image.unknown("a kind of numbers of a later version");
  if (out.size == 0) image.damaged("its numbers have no size");
  const auto sized = [&](std::initializer_list<std::uint32_t> sizes) {
    if (std::find(sizes.begin(), sizes.end(), out.size) == sizes.end()) image.unknown("numbers of an odd size");
  };
  switch (first & 15) {
  case 0: {
    sized({1, 2, 4, 8});
    out.big_endian = bits & 1;
    out.type = {bits & 8 ? 'i' : 'u', out.size};
    const int offset = in.u16(), precision = in.u16();
    if (offset != 0 || precision != int(8 * out.size)) image.unknown("whole numbers of an odd size");
    return out;
  }
  case 1: {
    sized({4, 8});
    out.big_endian = bits & 1;
    out.type = {'f', out.size};
    const Bytes given = in.bytes(12), wide = {0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 3, 0, 0};
    const Bytes narrow = {0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0};
    if (given != (out.size == 8 ? wide : narrow) || bits & 0x40) image.unknown("real numbers of an odd form");
    return out;
  }
  case 3: out.type = {'S', out.size}; return out;
  case 8: { // true and false, as h5py stores them, and other names of numbers
    const Datatype base = datatype_of(image, in);
    if (base.type.kind != 'i' && base.type.kind != 'u') image.unknown("names of what are no numbers");
    out = base;
    if (base.size == 1 && (bits & 0xFFFF) == 2 && in.left() >= 6 && in.text(6) == "FALSE") out.type.kind = 'b';
    return out;
  }
  case 9:
    if ((bits & 15) != 1 || out.size != 16) image.unknown("lists of several lengths");
    out.type = {'S', 1};
    out.variable = true;
    return out;
  default: image.unknown("a kind of numbers of its own");
  }
}

std::vector<std::int64_t> dataspace_of(const Image& image, Cursor& in) {
  const int version = in.u8(), rank = in.u8(), flags = in.u8();
  if (version != 1 && version != 2) image.unknown("a shape of a later version");
  const int type = in.u8();
  if (version == 1) in.skip(4);
  if (rank > 32) image.damaged("an array has too many axes");
  if (version == 2 && type == 2) return {0};
  if (flags & 2) image.unknown("axes in an order of their own");
  std::vector<std::int64_t> shape;
  for (int k = 0; k < rank; ++k) {
    const std::uint64_t n = in.u64();
    if (n >> 62) image.damaged("an array is longer than any file");
    shape.push_back(std::int64_t(n));
  }
  return shape;
}

Layout layout_of(const Image& image, Cursor& in) {
  const int version = in.u8();
  if (version != 3) image.unknown("arrays laid out in version " + std::to_string(version));
  Layout out;
  switch (in.u8()) {
  case 0:
    out.kind = Layout::compact;
    out.inside = in.bytes(in.u16());
    break;
  case 1:
    out.kind = Layout::contiguous;
    out.address = in.u64();
    out.size = in.u64();
    break;
  case 2: {
    out.kind = Layout::chunked;
    const int axes = in.u8();
    out.address = in.u64();
    for (int k = 0; k < axes; ++k) {
      out.chunk.push_back(in.u32());
      if (out.chunk.back() == 0) image.damaged("a piece of an array is empty");
    }
    break;
  }
  default: image.unknown("arrays laid out in a way of their own");
  }
  return out;
}

std::uint64_t bytes_of(const Image& image, const Datatype& type, const std::vector<std::int64_t>& shape) {
  std::uint64_t total = type.size;
  if (std::find(shape.begin(), shape.end(), 0) != shape.end()) return 0;
  // missing bytes read as zeros, of which a small amount is harmless
  const std::uint64_t most = image.size() + (1 << 20);
  for (const std::int64_t n : shape) {
    if (std::uint64_t(n) > most / total) image.damaged("an array is larger than the file");
    total *= std::uint64_t(n);
  }
  return total;
}

StoredArray converted(const Image& image, const Datatype& type, std::vector<std::int64_t> shape, Bytes raw) {
  StoredArray out{type.type, std::move(shape), {}};
  if (type.variable) {
    std::vector<Bytes> texts;
    Heap heap(image);
    std::size_t longest = 1;
    const std::size_t count = raw.size() / 16;
    for (std::size_t at = 0; at + 16 <= raw.size(); at += 16) {
      Cursor in(image, raw, at);
      const std::uint32_t length = in.u32();
      const std::uint64_t collection = in.u64();
      const std::uint32_t index = in.u32();
      longest = std::max<std::size_t>(longest, length);
      if (longest > (image.size() + (1 << 20)) / count) image.damaged("texts are larger than the file");
      texts.push_back(length == 0 ? Bytes() : heap.object(collection, index));
      if (texts.back().size() < length) image.damaged("a text is shorter than it says");
      texts.back().resize(length);
    }
    out.type.item = std::uint32_t(longest);
    for (Bytes& text : texts) {
      text.resize(longest);
      out.bytes.insert(out.bytes.end(), text.begin(), text.end());
    }
    return out;
  }
  if (type.big_endian && type.size > 1)
    for (std::size_t at = 0; at + type.size <= raw.size(); at += type.size)
      std::reverse(raw.begin() + std::ptrdiff_t(at), raw.begin() + std::ptrdiff_t(at + type.size));
  out.bytes = std::move(raw);
  return out;
}

} // namespace cairn::hdf5
