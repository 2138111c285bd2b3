// Bytes of an HDF5 file that is read, and their parts below groups and arrays.
#pragma once
#include "hdf5_node.hpp"

namespace cairn::hdf5 {

class Image {
public:
  explicit Image(const std::string& path);
  ~Image();
  Image(const Image&) = delete;
  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t root() const { return root_; }
  void read(std::uint64_t address, void* to, std::uint64_t count) const;
  Bytes read(std::uint64_t address, std::uint64_t count) const;
  // The same bytes as memory that the operating system reads from the file when it is looked at; it outlives the image.
  std::shared_ptr<const unsigned char> map(std::uint64_t address, std::uint64_t count) const;
  // Messages of an object header, of version 1 or 2, in their order.
  std::vector<std::pair<int, Bytes>> header(std::uint64_t address) const;
  [[noreturn]] void damaged(const std::string& what) const;
  [[noreturn]] void unknown(const std::string& what) const;

private:
  std::string path_;
  int fd_ = -1;
  std::uint64_t size_ = 0, root_ = 0;
};

// Reads consecutive numbers; a read beyond the end counts as damage.
class Cursor {
public:
  Cursor(const Image& image, const Bytes& bytes, std::size_t at = 0) : image_(&image), bytes_(&bytes), at_(at) {}
  template <class T>
  T take() {
    T value;
    need(sizeof value);
    std::memcpy(&value, bytes_->data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::uint8_t u8() { return take<std::uint8_t>(); }
  std::uint16_t u16() { return take<std::uint16_t>(); }
  std::uint32_t u32() { return take<std::uint32_t>(); }
  std::uint64_t u64() { return take<std::uint64_t>(); }
  std::uint64_t number(int bytes) { // of 1, 2, 4 or 8
    std::uint64_t value = 0;
    need(std::size_t(bytes));
    std::memcpy(&value, bytes_->data() + at_, std::size_t(bytes));
    at_ += std::size_t(bytes);
    return value;
  }
  Bytes bytes(std::uint64_t n) {
    need(n);
    const auto from = bytes_->begin() + std::ptrdiff_t(at_);
    at_ += n;
    return {from, from + std::ptrdiff_t(n)};
  }
  std::string text(std::uint64_t n) { // up to the first nought
    const Bytes all = bytes(n);
    std::string out(all.begin(), all.end());
    return out.substr(0, out.find('\0'));
  }
  bool tag(const char* four) {
    const Bytes is = bytes(4);
    return std::equal(is.begin(), is.end(), four);
  }
  void skip(std::uint64_t n) {
    need(n);
    at_ += n;
  }
  void align() { at_ = (at_ + 7) / 8 * 8; }
  std::size_t at() const { return at_; }
  std::size_t left() const { return at_ > bytes_->size() ? 0 : bytes_->size() - at_; }

private:
  void need(std::uint64_t n) const {
    if (n > left()) image_->damaged("a structure ends too early");
  }
  const Image* image_;
  const Bytes* bytes_;
  std::size_t at_;
};

Datatype datatype_of(const Image& image, Cursor& in);
std::vector<std::int64_t> dataspace_of(const Image& image, Cursor& in);
Layout layout_of(const Image& image, Cursor& in);
// Numbers in the order of bytes of this machine, texts out of the heap.
StoredArray converted(const Image& image, const Datatype& type, std::vector<std::int64_t> shape, Bytes raw);
// How many bytes so many numbers of a type take; damage where that is more than the file can hold.
std::uint64_t bytes_of(const Image& image, const Datatype& type, const std::vector<std::int64_t>& shape);

} // namespace cairn::hdf5
