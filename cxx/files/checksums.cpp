#include "checksums.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace cairn {

namespace {

std::uint32_t word_at(const unsigned char* p) {
  std::uint32_t w;
  std::memcpy(&w, p, sizeof w);
  return w;
}

// table[k][b]: contribution of byte b to the checksum k bytes later
constexpr std::array<std::array<std::uint32_t, 256>, 8> crc_tables() {
  std::array<std::array<std::uint32_t, 256>, 8> table{};
  for (std::uint32_t b = 0; b < 256; ++b) {
    std::uint32_t c = b;
    for (int i = 0; i < 8; ++i) c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
    table[0][b] = c;
  }
  for (int k = 1; k < 8; ++k)
    for (int b = 0; b < 256; ++b) table[k][b] = table[k - 1][b] >> 8 ^ table[0][table[k - 1][b] & 0xFF];
  return table;
}
constexpr auto crc_table = crc_tables();

constexpr std::array<std::uint64_t, 8> blake_start = {0x6a09e667f3bcc908, 0xbb67ae8584caa73b, 0x3c6ef372fe94f82b,
                                                      0xa54ff53a5f1d36f1, 0x510e527fade682d1, 0x9b05688c2b3e6c1f,
                                                      0x1f83d9abfb41bd6b, 0x5be0cd19137e2179};
constexpr unsigned char blake_order[10][16] = {
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}, {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
    {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4}, {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
    {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13}, {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
    {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11}, {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
    {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5}, {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0}};

} // namespace

std::uint32_t lookup3(const unsigned char* data, std::size_t size) {
  std::uint32_t a = 0xDEADBEEF + std::uint32_t(size), b = a, c = a;
  const auto turn = [](std::uint32_t& x, std::uint32_t y, std::uint32_t z, int bits) {
    x = (x - y) ^ std::rotl(y, bits);
    return y + z;
  };
  for (; size > 12; size -= 12, data += 12) {
    a += word_at(data);
    b += word_at(data + 4);
    c += word_at(data + 8);
    c = turn(a, c, b, 4);
    a = turn(b, a, c, 6);
    b = turn(c, b, a, 8);
    c = turn(a, c, b, 16);
    a = turn(b, a, c, 19);
    b = turn(c, b, a, 4);
  }
  if (size == 0) return c;
  unsigned char rest[12] = {};
  std::memcpy(rest, data, size);
  a += word_at(rest);
  b += word_at(rest + 4);
  c += word_at(rest + 8);
  const auto end = [](std::uint32_t& x, std::uint32_t y, int bits) { x = (x ^ y) - std::rotl(y, bits); };
  end(c, b, 14);
  end(a, c, 11);
  end(b, a, 25);
  end(c, b, 16);
  end(a, c, 4);
  end(b, a, 14);
  end(c, b, 24);
  return c;
}

std::uint32_t crc32(const void* data, std::size_t size, std::uint32_t before) {
  const auto* p = static_cast<const unsigned char*>(data);
  std::uint32_t c = ~before;
  const auto& t = crc_table;
  for (; size >= 8; size -= 8, p += 8) {
    const std::uint32_t low = c ^ word_at(p), high = word_at(p + 4);
    c = t[7][low & 0xFF] ^ t[6][low >> 8 & 0xFF] ^ t[5][low >> 16 & 0xFF] ^ t[4][low >> 24] ^ t[3][high & 0xFF] ^
        t[2][high >> 8 & 0xFF] ^ t[1][high >> 16 & 0xFF] ^ t[0][high >> 24];
  }
  for (; size > 0; --size) c = c >> 8 ^ t[0][(c ^ *p++) & 0xFF];
  return ~c;
}

Blake2b::Blake2b(std::size_t digest_bytes) : h_(blake_start), digest_bytes_(digest_bytes) {
  h_[0] ^= 0x01010000 ^ digest_bytes;
}

void Blake2b::update(const void* data, std::size_t size) {
  const auto* p = static_cast<const unsigned char*>(data);
  while (size > 0) {
    if (held_ == block_.size()) compress(false);
    const std::size_t take = std::min(size, block_.size() - held_);
    std::memcpy(block_.data() + held_, p, take);
    held_ += take;
    p += take;
    size -= take;
  }
}

void Blake2b::compress(bool last) {
  length_ += held_;
  if (last) std::fill(block_.begin() + std::ptrdiff_t(held_), block_.end(), 0);
  std::uint64_t m[16], v[16];
  std::memcpy(m, block_.data(), sizeof m);
  std::copy(h_.begin(), h_.end(), v);
  std::copy(blake_start.begin(), blake_start.end(), v + 8);
  v[12] ^= length_;
  if (last) v[14] = ~v[14];
  for (int round = 0; round < 12; ++round) {
    const unsigned char* s = blake_order[round % 10];
    const auto mix = [&](int a, int b, int c, int d, int k) {
      v[a] += v[b] + m[s[k]];
      v[d] = std::rotr(v[d] ^ v[a], 32);
      v[c] += v[d];
      v[b] = std::rotr(v[b] ^ v[c], 24);
      v[a] += v[b] + m[s[k + 1]];
      v[d] = std::rotr(v[d] ^ v[a], 16);
      v[c] += v[d];
      v[b] = std::rotr(v[b] ^ v[c], 63);
    };
    for (int i = 0; i < 4; ++i) mix(i, 4 + i, 8 + i, 12 + i, 2 * i);
    for (int i = 0; i < 4; ++i) mix(i, 4 + (i + 1) % 4, 8 + (i + 2) % 4, 12 + (i + 3) % 4, 8 + 2 * i);
  }
  for (int i = 0; i < 8; ++i) h_[i] ^= v[i] ^ v[i + 8];
  held_ = 0;
}

std::string Blake2b::hexdigest() {
  compress(true);
  std::string text;
  for (std::size_t i = 0; i < digest_bytes_; ++i) {
    const unsigned byte = unsigned(h_[i / 8] >> 8 * (i % 8)) & 0xFF;
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

} // namespace cairn
