// Writes a run: one .vtkhdf file that ParaView and PyVista open, with Cairn's own groups beside.
//
// Layout, version 1.2:
//
//   /VTKHDF                MultiBlockDataSet, with Steps for the times
//     bodies, contacts     UnstructuredGrid over time: a vertex per body and per contact, PointData its fields
//     fluid                UnstructuredGrid over time: a vertex per particle of a liquid; if any
//     meshes               UnstructuredGrid over time: cells of bodies that deform, CellData their fields; if any
//     Steps                time of each output
//     Assembly             soft links to both blocks
//   /cairn                 attributes format, version, dim
//     scene, provenance    the scene and the program that ran it: nested groups, text and arrays
//     steps                a row per output: number of the step, both times, first row and number of bodies, contacts
//     history              a row per step taken: time, step, contacts, iterations, error, energies ...
//     bodies, contacts, meshes     soft links into /VTKHDF
//
// A field that did not change since the output before it (radius, material ...) is not written again: its offset is
// repeated. In 2D z is 0. Texts have a fixed length, arrays the attribute crc32. VTK 9.4 and later (ParaView 5.13) read
// the blocks over time.
#pragma once
#include <limits>

#include "growing_file.hpp"

namespace cairn {

// One field of all bodies or contacts of an output: values (row_shape, rows).
struct RunField {
  std::string name;
  StoredType type;
  std::vector<std::int64_t> row_shape; // empty: one number each
  std::int64_t rows;
  const void* values;
};
// Cells of bodies that deform at an output, as VTK has them.
struct RunCells {
  std::vector<double> points; // (3, nodes) [m]
  std::vector<std::int64_t> connectivity, offsets;
  std::vector<std::uint8_t> types;
  std::vector<RunField> fields; // of the cells
};
// A number or a word of one step.
using RunNumber = std::pair<std::string, std::variant<double, std::string>>;

class RunWriter {
public:
  // A new file, which appears with `begin`: until then scene and provenance are written below `own`.
  RunWriter(const std::string& path, int dim, bool overwrite);
  Group& own() { return file_->root().group("cairn"); }
  void begin();
  // Goes on in the file of an earlier run after a step: outputs and rows of the history that are later are dropped.
  static std::unique_ptr<RunWriter> go_on(const std::string& path, std::int64_t step);
  std::int64_t outputs() const { return steps_[0]->rows(); }

  // time, time_detection: end of the step, to which the bodies belong, and the time of the detection configuration, to
  // which the contacts belong [s]. bodies: "position" (dim) [m] is needed, "velocity" (3 | 6) is stored as velocity and
  // spin; contacts: "point" (dim) [m] is needed; nodes of meshes, none: "position" (dim) [m] is needed. The fields of
  // the first output are those of all: throws std::invalid_argument where they differ, and where nodes come later.
  void write_step(double time, double time_detection, std::int64_t step, const std::vector<RunField>& bodies,
                  const std::vector<RunField>& contacts, const RunCells* cells = nullptr,
                  const std::vector<RunField>& nodes = {}, const std::vector<RunField>& fluid = {});
  // The numbers of one step taken; cheap, stored at the next flush.
  void write_history(double time, std::int64_t step, const std::vector<RunNumber>& numbers);
  std::int64_t last_history() const { return last_history_; } // step; -1: none
  // Commits the outputs written so far; sync as in GrowingFile::commit. Does nothing if the last flush is less than
  // `pace` seconds ago.
  void flush(std::optional<bool> sync = {}, double pace = 0);
  void close(); // flushes; calling it again does nothing
  const std::string& path() const { return file_->path(); }
  std::int64_t size() const { return file_->size(); }
  int dim() const { return dim_; }

private:
  struct Own { // values of a field that were made for the file
    RunField field;
    std::vector<double> values;
  };
  struct Block {
    Group* group = nullptr;
    Series *points = nullptr, *connectivity = nullptr, *offsets = nullptr, *types = nullptr, *values = nullptr;
    std::vector<Series*> parts, steps;                                // of the names in run_writer.cpp
    std::vector<std::pair<std::string, Series*>> data, data_offsets;  // in the order of the fields
    std::map<std::string, std::pair<std::string, std::int64_t>> seen; // digest and first row of steady fields
    std::int64_t count = -1, part = -1, cells = 0, first_corner = 0;
    std::string shape; // digest of cells that have one
  };
  struct Column {
    Series* series;
    bool words = false;
    std::vector<std::string> table;
  };
  RunWriter() = default;
  static std::unique_ptr<RunWriter> take_up(const std::string& path, std::int64_t step);
  void make_blocks(const std::vector<RunField>& bodies, const std::vector<RunField>& contacts, std::int64_t n);
  std::size_t add_block(const char* name, const std::vector<RunField>& fields, std::int64_t expected,
                        bool of_cells = false);
  void add_mesh_blocks(const RunCells* cells, const std::vector<RunField>& nodes, std::int64_t many_nodes);
  void append_fluid(double time, const std::vector<RunField>& fluid, std::vector<Own>& made);
  Block make_block(Group& group, const std::vector<RunField>& fields, std::int64_t expected, bool of_cells = false);
  Block known_block(Group& group, bool of_cells = false);
  void append_cells(Block& block, double time, const RunCells& cells);
  void check(const Block& block, const char* what, const std::vector<RunField>& fields, std::int64_t rows) const;
  std::int64_t append(Block& block, double time, const RunField& points, const std::vector<RunField>& fields);
  std::pair<RunField, std::vector<RunField>> in_space(const char* point, const std::vector<RunField>& given,
                                                      std::vector<Own>& made, bool turning) const;
  std::pair<RunField, std::vector<RunField>> none_of(const Block& block) const;
  RunField wide(const RunField& field, std::int64_t take, std::int64_t due, std::vector<Own>& made) const;
  void store_history();
  Column& column(const std::string& name, bool words);
  void append_words(const std::string& name, Column& column, const std::vector<const RunNumber*>& values);

  int dim_ = 2;
  std::unique_ptr<GrowingFile> file_;
  std::vector<Series*> steps_, node_steps_;
  std::vector<double> output_times_;
  Group* root_steps_ = nullptr;
  Series* times_ = nullptr;
  std::vector<Block> blocks_;
  std::size_t of_cells_ = 0, of_nodes_ = 0, of_fluid_ = 0; // their blocks; 0: none
  std::map<std::string, Column> columns_;
  std::int64_t rows_ = 0, last_history_ = -1;
  std::vector<std::vector<RunNumber>> pending_;
  std::chrono::steady_clock::time_point flushed_at_{};
};

} // namespace cairn
