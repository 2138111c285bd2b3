// Checksums of files: of HDF5's headers, of arrays, of whole checkpoints.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace cairn {

// Jenkins' lookup3 hash, initial value 0 (Jenkins 2006): the checksum of HDF5 metadata.
std::uint32_t lookup3(const unsigned char* data, std::size_t size);

// CRC-32 (IEEE 802.3, as zlib and PNG have it) of data that follows what `before` is the checksum of.
std::uint32_t crc32(const void* data, std::size_t size, std::uint32_t before = 0);

// BLAKE2b (RFC 7693) without a key, of data that comes in parts.
class Blake2b {
public:
  explicit Blake2b(std::size_t digest_bytes);
  void update(const void* data, std::size_t size);
  void update(const std::string& text) { update(text.data(), text.size()); }
  std::string hexdigest(); // once, at the end

private:
  void compress(bool last);
  std::array<std::uint64_t, 8> h_;
  std::array<unsigned char, 128> block_{};
  std::size_t held_ = 0, digest_bytes_;
  std::uint64_t length_ = 0;
};

} // namespace cairn
