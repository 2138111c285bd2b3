// Files through the C API: a restart goes on to the same bits, a run reads as written, damaged files are refused.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "c_scene.hpp"

namespace {

struct CFiles : CScene {
  std::filesystem::path folder = std::filesystem::temp_directory_path() /
                                 ("cairn_files_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                                  "_" + ::testing::UnitTest::GetInstance()->current_test_info()->name());
  CFiles() {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  ~CFiles() override { std::filesystem::remove_all(folder); }
  std::string path(const char* name) const { return (folder / name).string(); }

  // Balls that fall on each other and on the floor, one of them driven.
  void heap(int dim) {
    make(dim);
    floor(dim);
    int64_t first = -1;
    for (int k = 0; k < 12; ++k) {
      std::vector<double> place(std::size_t(dim), 0.01 * k);
      place.back() = 0.1 + 0.19 * k;
      const int64_t id = body(place);
      if (k == 0) first = id;
      ball(dim, id, 0.1, rock);
    }
    ASSERT_EQ(cairn_scene_drive(scene, 1, &first, 1, nullptr, &error), 0) << error.message;
    start();
  }
  void again() {
    cairn_simulation_destroy(simulation);
    simulation = nullptr;
    start();
  }
  void restarted(int dim) {
    heap(dim);
    steps(60);
    ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, path("a.checkpoint.h5").c_str(), &error), 0)
        << error.message;
    steps(40);
    const auto position = field("position"), velocity = field("velocity"), impulse = contact("impulse");
    const double kinetic = energy("kinetic"), closure = energy("closure");
    again();
    ASSERT_EQ(cairn_simulation_restart(simulation, path("a.checkpoint.h5").c_str(), &error), 0) << error.message;
    steps(40);
    EXPECT_EQ(field("position"), position);
    EXPECT_EQ(field("velocity"), velocity);
    EXPECT_EQ(contact("impulse"), impulse);
    EXPECT_EQ(energy("kinetic"), kinetic);
    EXPECT_EQ(energy("closure"), closure);
  }
  std::vector<double> read(cairn_run* run, int64_t output, const char* name, bool bodies = true) {
    int64_t count = -1;
    const auto get = bodies ? cairn_run_body_field : cairn_run_contact_field;
    EXPECT_EQ(get(run, output, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(std::size_t(std::max<int64_t>(count, 0)));
    EXPECT_EQ(get(run, output, name, count, values.data(), &count, &error), 0) << error.message;
    return values;
  }
};

TEST_F(CFiles, RestartsToTheSameBitsIn2D) { restarted(2); }
TEST_F(CFiles, RestartsToTheSameBitsIn3D) { restarted(3); }

TEST_F(CFiles, ACheckpointOfAnotherSceneOrDamagedIsRefusedAndNothingHasChanged) {
  heap(2);
  steps(20);
  const std::string file = path("a.checkpoint.h5");
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, file.c_str(), &error), 0) << error.message;
  steps(5);
  const auto position = field("position");
  const auto refused = [&](const char* word) {
    EXPECT_EQ(cairn_simulation_restart(simulation, file.c_str(), &error), cairn_file_error);
    EXPECT_NE(std::string(error.message).find(word), std::string::npos) << error.message;
    EXPECT_EQ(field("position"), position);
  };
  std::string whole;
  {
    std::ifstream in(file, std::ios::binary);
    whole.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (std::size_t at = 0; at < whole.size(); at += whole.size() / 40) { // any byte, and a zeroed block
    std::string other = whole;
    other[at] = char(other[at] ^ 1);
    for (std::size_t k = at; k < std::min(at + 64, other.size()) && at % 2; ++k) other[k] = 0;
    if (other == whole) continue;
    std::ofstream(file, std::ios::binary) << other;
    const int32_t code = cairn_simulation_restart(simulation, file.c_str(), &error);
    EXPECT_TRUE(code == 0 || code == cairn_file_error) << error.message; // unused space in the file may hold anything
    if (code != 0) {
      EXPECT_EQ(field("position"), position);
      continue;
    }
    steps(5);
    EXPECT_EQ(field("position"), position);
  }
  std::ofstream(file, std::ios::binary) << whole.substr(0, whole.size() / 2);
  refused("truncated");
  std::ofstream(file, std::ios::binary) << "text";
  refused("not a checkpoint");
  std::ofstream(file, std::ios::binary) << whole;
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  ball(2, 1, 0.05, rock);
  start();
  EXPECT_EQ(cairn_simulation_restart(simulation, file.c_str(), &error), cairn_file_error);
  EXPECT_NE(std::string(error.message).find("another scene"), std::string::npos) << error.message;
}

TEST_F(CFiles, ARunIsReadAsItWasWrittenAndGoesOnAfterARestart) {
  heap(2);
  cairn_run_writer* writer = nullptr;
  const std::string file = path("a.vtkhdf"), saved = path("a.checkpoint.h5");
  ASSERT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_new_file, &writer, &error), 0) << error.message;
  std::vector<std::vector<double>> positions, impulses;
  const auto output = [&](bool keep) {
    ASSERT_EQ(cairn_run_writer_output(writer, simulation, &error), 0) << error.message;
    if (!keep) return;
    positions.push_back(field("position"));
    impulses.push_back(contact("impulse"));
  };
  output(true);
  for (int k = 1; k <= 40; ++k) {
    steps(1);
    ASSERT_EQ(cairn_run_writer_step(writer, simulation, &error), 0) << error.message;
    if (k % 10 == 0) output(k <= 20);
    if (k == 20) {
      ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, saved.c_str(), &error), 0) << error.message;
    }
  }
  ASSERT_EQ(cairn_run_writer_close(writer, &error), 0) << error.message;
  EXPECT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_new_file, &writer, &error), cairn_file_error);
  again();
  ASSERT_EQ(cairn_simulation_restart(simulation, saved.c_str(), &error), 0) << error.message;
  ASSERT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_go_on, &writer, &error), 0) << error.message;
  steps(10);
  output(true);
  ASSERT_EQ(cairn_run_writer_step(writer, simulation, &error), 0) << error.message;
  ASSERT_EQ(cairn_run_writer_close(writer, &error), 0) << error.message;

  cairn_run* run = nullptr;
  ASSERT_EQ(cairn_run_open(file.c_str(), &run, &error), 0) << error.message;
  ASSERT_EQ(cairn_run_outputs(run), 4);
  double times[4];
  int64_t count = 0;
  ASSERT_EQ(cairn_run_times(run, 4, times, &count, &error), 0);
  EXPECT_NEAR(times[3], 0.03, 1e-12);
  for (int64_t k = 0; k < 4; ++k) {
    EXPECT_EQ(read(run, k, "position"), positions[std::size_t(k)]);
    EXPECT_EQ(read(run, k, "impulse", false), impulses[std::size_t(k)]);
    EXPECT_EQ(read(run, k, "velocity").size(), 3 * positions[0].size() / 2);
  }
  EXPECT_EQ(read(run, 0, "radius")[1], 0.1);
  ASSERT_EQ(cairn_run_history(run, "contacts", 0, nullptr, &count, &error), 0) << error.message;
  EXPECT_EQ(count, 21);
  EXPECT_EQ(cairn_run_body_field(run, 4, "position", 0, nullptr, &count, &error), cairn_file_error);
  EXPECT_EQ(cairn_run_body_field(run, 0, "colour", 0, nullptr, &count, &error), cairn_file_error);
  cairn_run_close(run);
}

// Another scene, a simulation without a restart and a restart from another run are refused; the file keeps its outputs.
TEST_F(CFiles, ARunIsNotGoneOnWithByWhatDidNotComeFromIt) {
  const std::string file = path("a.vtkhdf"), saved = path("a.checkpoint.h5"), other = path("b.checkpoint.h5");
  const auto text = [&] {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  cairn_run_writer* writer = nullptr;
  const auto write = [&](int every, int count) {
    for (int k = 1; k <= count; ++k) {
      steps(1);
      ASSERT_EQ(cairn_run_writer_step(writer, simulation, &error), 0) << error.message;
      if (k % every == 0) { ASSERT_EQ(cairn_run_writer_output(writer, simulation, &error), 0) << error.message; }
    }
    ASSERT_EQ(cairn_run_writer_close(writer, &error), 0) << error.message;
  };
  const auto refused = [&](const char* words) {
    const std::string before = text();
    EXPECT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_go_on, &writer, &error), cairn_file_error);
    EXPECT_NE(std::string(error.message).find(words), std::string::npos) << error.message;
    EXPECT_EQ(text(), before);
  };
  heap(2);
  ASSERT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_new_file, &writer, &error), 0) << error.message;
  write(5, 10);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, saved.c_str(), &error), 0) << error.message;
  ASSERT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_go_on, &writer, &error), 0) << error.message;
  write(5, 10); // by itself
  again();
  refused("outputs would be lost");
  steps(12);
  refused("outputs would be lost");
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, other.c_str(), &error), 0) << error.message;
  steps(13);
  refused("without having come from there");
  ASSERT_EQ(cairn_simulation_restart(simulation, saved.c_str(), &error), 0) << error.message;
  ASSERT_EQ(cairn_run_writer_create(simulation, file.c_str(), cairn_go_on, &writer, &error), 0) << error.message;
  write(5, 10);
  cairn_run* run = nullptr;
  ASSERT_EQ(cairn_run_open(file.c_str(), &run, &error), 0) << error.message;
  EXPECT_EQ(cairn_run_outputs(run), 4);
  cairn_run_close(run);
  again();
  const double gravity[2] = {0, -1};
  ASSERT_EQ(cairn_simulation_set_gravity(simulation, gravity, &error), 0) << error.message;
  steps(12);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, other.c_str(), &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_restart(simulation, other.c_str(), &error), 0) << error.message;
  refused("where this run did not pass");
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  ball(2, 1, 0.05, rock);
  start();
  refused("another scene");
}

} // namespace
