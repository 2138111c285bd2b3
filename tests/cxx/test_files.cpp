// The one reader and writer of files: checksums by known values, and damaged files of every kind that C++ reads, by
// bytes and with seals made right again. Run under the sanitizers, too.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "files/checksums.hpp"
#include "files/run_reader.hpp"
#include "files/run_writer.hpp"
#include "files/stored_tree.hpp"

using namespace cairn;

namespace {

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write_file(const std::string& path, const std::string& data) {
  std::ofstream(path, std::ios::binary | std::ios::trunc).write(data.data(), std::streamsize(data.size()));
}

struct Folder : testing::Test {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      (std::string("cairn_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  Folder() {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  ~Folder() override { std::filesystem::remove_all(folder); }
  std::string path(const char* name) const { return (folder / name).string(); }
};
using Checksums = testing::Test;
using DamagedFiles = Folder;

template <class T>
void put(std::string& data, std::size_t at, T value) {
  if (at + sizeof value <= data.size()) std::memcpy(data.data() + at, &value, sizeof value);
}

// One change of a file, by bytes, or in a header, a B-tree or the beginning with the checksum made right again.
std::string changed(std::string data, std::mt19937& chance) {
  const auto any = [&](std::size_t n) { return std::size_t(chance() % std::max<std::size_t>(n, 1)); };
  const std::uint64_t odd[] = {0, 1, ~0ull, ~0ull >> 1, data.size(), data.size() - 8, any(data.size()), 1ull << 40};
  const auto places = [&](const std::string& tag) {
    std::vector<std::size_t> found;
    for (std::size_t at = data.find(tag); at != std::string::npos; at = data.find(tag, at + 1)) found.push_back(at);
    return found;
  };
  switch (any(6)) {
  case 0: data[any(data.size())] ^= char(1 << any(8)); break;
  case 1: {
    const std::size_t at = any(data.size()), size = std::min<std::size_t>(8u << any(7), data.size() - at);
    std::fill_n(data.begin() + std::ptrdiff_t(at), size, any(2) ? 0 : char(any(256)));
    break;
  }
  case 2: data.resize(any(data.size())); break;
  case 3: put(data, any(data.size()), odd[any(8)]); break;
  case 4: { // in a header, sealed again
    const auto headers = places(std::string("OHDR\x02\x02", 6));
    if (headers.empty()) break;
    const std::size_t at = headers[any(headers.size())];
    std::uint32_t size;
    std::memcpy(&size, data.data() + at + 6, 4);
    if (at + 14 + size > data.size()) break;
    const std::size_t place = at + 10 + any(size);
    if (any(2))
      data[place] = char(any(2) ? data[place] ^ char(1 << any(8)) : any(256));
    else if (place + 8 <= at + 10 + size)
      put(data, place, odd[any(8)]);
    put(data, at + 10 + size, lookup3(reinterpret_cast<const unsigned char*>(data.data()) + at, 10 + size));
    break;
  }
  default: { // in a tree, or the beginning
    std::vector<std::size_t> trees = places("TREE");
    trees.push_back(0);
    const std::size_t at = trees[any(trees.size())];
    put(data, at ? at + 8 * any(8) : any(2) ? 28 : 36, odd[any(8)]);
    if (!at) put(data, 44, lookup3(reinterpret_cast<const unsigned char*>(data.data()), 44));
  }
  }
  return data;
}

// use(path) of so many damaged copies of the file throws FileError or nothing.
// CAIRN_FUZZ in the environment: another number.
template <class Use>
void expect_file_errors(const std::string& path, int many, Use&& use) {
  if (const char* number = std::getenv("CAIRN_FUZZ")) many = std::atoi(number);
  const std::string whole = read_file(path);
  use();
  int refused = 0;
  for (int k = 0; k < many; ++k) {
    std::mt19937 chance{unsigned(k)};
    write_file(path, changed(whole, chance));
    try {
      use();
    } catch (const FileError& e) {
      ++refused;
      EXPECT_EQ(std::string(e.what()).find(path), 0u);
      EXPECT_FALSE(e.remedy.empty());
    } catch (const std::exception& e) { FAIL() << "input " << k << ": " << e.what(); }
  }
  EXPECT_GT(refused, many / 10); // much of a file that grows is room that nobody reads
}

} // namespace

TEST_F(Checksums, AreThoseOfTheirInventors) {
  const auto hash = [](const std::string& text) {
    return lookup3(reinterpret_cast<const unsigned char*>(text.data()), text.size());
  };
  EXPECT_EQ(hash(""), 0xDEADBEEF); // from the comments of lookup3.c
  EXPECT_EQ(hash("Four score and seven years ago"), 0x17770551u);
  EXPECT_EQ(crc32("123456789", 9), 0xCBF43926u); // the check value of CRC-32
  EXPECT_EQ(crc32("6789", 4, crc32("12345", 5)), 0xCBF43926u);
  Blake2b digest(64); // RFC 7693, appendix A
  digest.update("abc");
  EXPECT_EQ(digest.hexdigest().substr(0, 32), "ba80a53f981c4d0d6a2797b69f12f6e9");
}

TEST_F(DamagedFiles, OfRunsEndInFileErrors) {
  const std::string file = path("a.vtkhdf");
  {
    RunWriter writer(file, 2, false);
    writer.begin();
    std::vector<double> place(40), gap(7), point(14);
    for (int k = 0; k < 5; ++k) {
      for (double& x : place) x += 0.5;
      writer.write_step(0.1 * k, 0.1 * k, k, {{"position", {'f', 8}, {2}, 20, place.data()}},
                        {{"point", {'f', 8}, {2}, 7, point.data()}, {"gap", {'f', 8}, {}, 7, gap.data()}});
      writer.write_history(0.1 * k, k, {{"error", 1e-3}, {"status", std::string("converged")}});
      writer.flush();
    }
    writer.close();
  }
  expect_file_errors(file, 200, [&] {
    const RunReader run(file);
    for (std::int64_t k = 0; k < run.outputs(); ++k)
      for (const char* what : {"bodies", "contacts"})
        for (const std::string& name : run.fields(what)) run.field(k, what, name);
    run.history("error");
  });
}

TEST_F(DamagedFiles, OfRunsThatGoOnEndInFileErrors) {
  const std::string file = path("a.vtkhdf");
  {
    RunWriter writer(file, 3, false);
    writer.begin();
    std::vector<double> place(60), point(21);
    for (int k = 0; k < 5; ++k) {
      writer.write_step(0.1 * k, 0.1 * k, k, {{"position", {'f', 8}, {3}, 20, place.data()}},
                        {{"point", {'f', 8}, {3}, 7, point.data()}});
      writer.write_history(0.1 * k, k, {{"error", 1e-3}});
      writer.flush();
    }
    writer.close();
  }
  expect_file_errors(file, 200, [&] {
    const auto writer = RunWriter::go_on(file, 2);
    writer->close();
    RunReader(file).times();
  });
}

TEST_F(DamagedFiles, OfTreesEndInFileErrors) {
  const std::string file = path("a.h5");
  StoredValue tree, inner;
  const std::vector<double> values(300, 0.25);
  inner.add_array("values", values.data(), {100, 3});
  inner.add_whole("steps", 7);
  inner.add_flags("periodic", {true, false, false});
  tree.add_text("kind", "scene");
  tree.add_real("dt", 1e-3);
  tree.add("inner", inner);
  save_tree(file, tree);
  expect_file_errors(file, 400, [&] { load_tree(file, "a scene", ".scene.h5"); });
}
