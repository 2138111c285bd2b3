// The C API of files (cairn/cairn.h): checkpoints, restart, runs that are written and read.
#include <algorithm>
#include <filesystem>

#include "../files/run_continued.hpp"
#include "../files/run_reader.hpp"
#include "../files/run_snapshot.hpp"
#include "../files/simulation_state.hpp"
#include "cairn/build.h"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

struct cairn_run_writer {
  std::unique_ptr<cairn::RunWriter> writer;
};
struct cairn_run {
  cairn::RunReader reader;
};

namespace {

void numbers_out(const std::vector<double>& from, std::int64_t capacity, double* values, std::int64_t* count) {
  if (count) *count = std::int64_t(from.size());
  if (from.empty() || std::int64_t(from.size()) > capacity) return;
  require(values, "values");
  std::copy(from.begin(), from.end(), values);
}

int32_t field_out(const cairn_run* run, int64_t output, const char* what, const char* name, int64_t capacity,
                  double* values, int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(run, "run");
    require(name, "name");
    numbers_out(run->reader.field(output, what, name), capacity, values, count);
  });
}

std::string absolute(const std::string& path) { return std::filesystem::weakly_canonical(path).string(); }

cairn::RunOrigin origin_of(const cairn_simulation& simulation, const std::string& path) {
  const auto own = simulation.last_output.find(absolute(path));
  return {simulation.restarted ? cairn::RunOrigin::checkpoint : cairn::RunOrigin::steps,
          own == simulation.last_output.end() ? -1 : own->second,
          {{"core_mark", simulation.fingerprint}}};
}

} // namespace

extern "C" {

int32_t cairn_simulation_write_checkpoint(cairn_simulation* simulation, const char* path, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_write_checkpoint");
    require(path, "path");
    cairn::write_checkpoint(simulation->simulation, simulation->fingerprint, int(simulation->matter.materials.size()),
                            path);
  });
}

int32_t cairn_simulation_restart(cairn_simulation* simulation, const char* path, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_restart");
    require(path, "path");
    cairn::restart(simulation->simulation, simulation->fingerprint, int(simulation->matter.materials.size()), path);
    simulation->transforms.restarted(simulation->simulation.scene);
    simulation->restarted = true;
    simulation->last_output.clear();
  });
}

int32_t cairn_run_writer_create(cairn_simulation* simulation, const char* path, int32_t mode, cairn_run_writer** writer,
                                cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_run_writer_create");
    require(path, "path");
    require(writer, "writer");
    if (mode < cairn_new_file || mode > cairn_go_on)
      throw Error("mode is " + std::to_string(mode) + "; give cairn_new_file, cairn_replace or cairn_go_on");
    cairn::Simulation& s = simulation->simulation;
    cairn::keep_rotations(s.scene);
    auto made = std::make_unique<cairn_run_writer>();
    if (mode == cairn_go_on) {
      cairn::refuse_other_run(path, s, origin_of(*simulation, path));
      made->writer = cairn::RunWriter::go_on(path, s.steps);
    } else {
      made->writer = std::make_unique<cairn::RunWriter>(path, s.scene.dim, mode == cairn_replace);
      cairn::write_scene(made->writer->own().group("scene"), s, simulation->matter.materials, simulation->fingerprint);
      cairn::Group& provenance = made->writer->own().group("provenance");
      provenance.array("version", cairn::StoredArray::text(CAIRN_VERSION));
      provenance.array("compiler", cairn::StoredArray::text(CAIRN_CXX_COMPILER ", " CAIRN_FORTRAN_COMPILER));
      provenance.array("flags", cairn::StoredArray::text(CAIRN_FLAGS));
      made->writer->begin();
    }
    *writer = made.release();
  });
}

int32_t cairn_run_writer_output(cairn_run_writer* writer, cairn_simulation* simulation, cairn_error* error) {
  return guarded(error, [&] {
    require(writer, "writer");
    between_steps(simulation, "cairn_run_writer_output");
    cairn::Simulation& s = simulation->simulation;
    const cairn::RunSnapshot now(s);
    const bool stepped = s.report.step == s.steps && s.steps > 0; // else it is restarted, or at its start
    writer->writer->write_step(s.time, stepped ? s.report.time_detection : s.time, s.steps, now.bodies, now.contacts,
                               nullptr, now.nodes);
    writer->writer->flush();
    simulation->last_output[absolute(writer->writer->path())] = s.steps;
  });
}

int32_t cairn_run_writer_step(cairn_run_writer* writer, const cairn_simulation* simulation, cairn_error* error) {
  return guarded(error, [&] {
    require(writer, "writer");
    require(simulation, "simulation");
    const cairn::Simulation& s = simulation->simulation;
    writer->writer->write_history(s.time, s.steps, cairn::numbers_of_step(s));
  });
}

int32_t cairn_run_writer_close(cairn_run_writer* writer, cairn_error* error) {
  return guarded(error, [&] {
    const std::unique_ptr<cairn_run_writer> closed(writer);
    if (closed) closed->writer->close();
  });
}

int32_t cairn_run_open(const char* path, cairn_run** run, cairn_error* error) {
  return guarded(error, [&] {
    require(path, "path");
    require(run, "run");
    *run = new cairn_run{cairn::RunReader(path)};
  });
}

void cairn_run_close(cairn_run* run) { delete run; }

int64_t cairn_run_outputs(const cairn_run* run) { return run ? run->reader.outputs() : 0; }

int32_t cairn_run_times(const cairn_run* run, int64_t capacity, double* times, int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(run, "run");
    numbers_out(run->reader.times(), capacity, times, count);
  });
}

int32_t cairn_run_body_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity, double* values,
                             int64_t* count, cairn_error* error) {
  return field_out(run, output, "bodies", name, capacity, values, count, error);
}

int32_t cairn_run_node_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity, double* values,
                             int64_t* count, cairn_error* error) {
  return field_out(run, output, "nodes", name, capacity, values, count, error);
}

int32_t cairn_run_contact_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity,
                                double* values, int64_t* count, cairn_error* error) {
  return field_out(run, output, "contacts", name, capacity, values, count, error);
}

int32_t cairn_run_history(const cairn_run* run, const char* name, int64_t capacity, double* values, int64_t* count,
                          cairn_error* error) {
  return guarded(error, [&] {
    require(run, "run");
    require(name, "name");
    numbers_out(run->reader.history(name), capacity, values, count);
  });
}

} // extern "C"
