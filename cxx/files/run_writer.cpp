#include "run_writer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "checksums.hpp"
#include "hdf5_node.hpp"
#include "stored_tree.hpp"

namespace cairn {

namespace {

constexpr std::int64_t format_version[2] = {1, 2}; // the first changes when older programs can no longer read the file
constexpr std::int64_t vtk_version[2] = {2, 1};
constexpr std::int64_t few = 256; // rows per chunk of arrays with a row per output

const std::pair<const char*, const char*> units[] = {
    {"position", "m"},       {"point", "m"},     {"gap", "m"},        {"radius", "m"}, {"velocity", "m/s"},
    {"spin", "rad/s"},       {"impulse", "N s"}, {"couple", "N m s"}, {"mass", "kg"},  {"time", "s"},
    {"time_detection", "s"}, {"dt", "s"},        {"normal", "-"},     {"status", "-"}};
const char* const steady[] = {"radius", "material", "id", "group", "layer", "mass", "inertia", "shape", "body"};
const char* const vectors[] = {"position", "point", "normal", "impulse"};
const std::pair<const char*, StoredType> step_names[] = {
    {"time", {'f', 8}},   {"time_detection", {'f', 8}}, {"step", {'i', 8}},    {"first_body", {'i', 8}},
    {"bodies", {'i', 8}}, {"first_contact", {'i', 8}},  {"contacts", {'i', 8}}};
const char* const node_step_names[] = {"first_node", "nodes"}; // of runs with meshes
const char* const part_names[] = {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"};
// of a block's Steps, with the shape of their rows
const std::pair<const char*, std::vector<std::int64_t>> block_steps[] = {{"PartOffsets", {}},
                                                                         {"NumberOfParts", {}},
                                                                         {"PointOffsets", {}},
                                                                         {"CellOffsets", {1}},
                                                                         {"ConnectivityIdOffsets", {1}}};

hdf5::Attributes unit_of(const std::string& name) {
  for (const auto& [known, unit] : units)
    if (name == known) return {{"unit", StoredArray::text(unit)}};
  return {};
}
template <class List>
bool among(const List& list, const std::string& name) {
  return std::any_of(std::begin(list), std::end(list), [&](const char* known) { return name == known; });
}
void set_type(Group& group, const char* type) {
  group.set_attribute("Version", StoredArray::of(vtk_version, {2}));
  group.set_attribute("Type", StoredArray::text(type));
}
std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "(";
  for (std::size_t k = 0; k < shape.size(); ++k) text += (k ? ", " : "") + std::to_string(shape[k]);
  return text + (shape.size() == 1 ? ",)" : ")");
}
std::string shape_text(std::int64_t rows, std::vector<std::int64_t> row_shape) {
  row_shape.insert(row_shape.begin(), rows);
  return shape_text(row_shape);
}

std::string json_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= 32) out += c;
  }
  return out + '"';
}
// The words of a list that json_text made.
std::vector<std::string> json_words(const std::string& json) {
  std::vector<std::string> out;
  bool inside = false;
  for (std::size_t k = 0; k < json.size(); ++k) {
    const char c = json[k];
    if (c == '"') {
      if (!inside) out.emplace_back();
      inside = !inside;
    } else if (inside) {
      out.back() += c == '\\' && k + 1 < json.size() ? json[++k] : c;
    }
  }
  return out;
}

} // namespace

RunWriter::RunWriter(const std::string& path, int dim, bool overwrite) : dim_(dim) {
  if (dim != 2 && dim != 3) throw std::invalid_argument("dim is " + std::to_string(dim) + "; it must be 2 or 3");
  file_ = std::make_unique<GrowingFile>(path, overwrite ? GrowingFile::If::replace : GrowingFile::If::new_file);
  own().set_attribute("format", StoredArray::text("cairn-run"));
  own().set_attribute("version", StoredArray::of(format_version, {2}));
  own().set_attribute("dim", StoredArray::number(std::int64_t(dim)));
  own().group("scene");
  own().group("provenance");
}

void RunWriter::begin() {
  Group& steps = own().group("steps");
  for (const auto& [name, type] : step_names) steps_.push_back(&steps.series(name, type, {}, few));
  own().group("history");
  file_->commit();
}

// ---------------------------------------------------------------- outputs

void RunWriter::make_blocks(const std::vector<RunField>& bodies, const std::vector<RunField>& contacts,
                            std::int64_t n) {
  Group& root = file_->root().group("VTKHDF");
  set_type(root, "MultiBlockDataSet");
  // VTK forgets the steps of the blocks when it is asked twice, unless the root has steps too; 9.4 wants every
  // member of the root to have a type, and looks for the times in the last one, so this is the first
  root_steps_ = &root.group("Steps");
  set_type(*root_steps_, "ImageData");
  times_ = &root_steps_->series("Values", {'f', 8}, {}, few, unit_of("time"));
  add_block("bodies", bodies, n);
  add_block("contacts", contacts, 2 * n);
}

// A block more, with its place in the assembly; its number.
std::size_t RunWriter::add_block(const char* name, const std::vector<RunField>& fields, std::int64_t expected,
                                 bool of_cells) {
  Group& root = file_->root().group("VTKHDF");
  const std::size_t number = blocks_.size();
  blocks_.push_back(make_block(root.group(name), fields, expected, of_cells));
  root.group(name).set_attribute("Index", StoredArray::number(std::int64_t(number)));
  const std::string path = std::string("/VTKHDF/") + name;
  root.group("Assembly").soft_link(name, path);
  own().soft_link(name, path);
  return number;
}

// Meshes may come in at any time: in the outputs before, their blocks are empty.
void RunWriter::add_mesh_blocks(const RunCells* cells, const std::vector<RunField>& nodes, std::int64_t many_nodes) {
  if (cells && !of_cells_) {
    of_cells_ = add_block("meshes", cells->fields, std::int64_t(cells->types.size()), true);
    for (const double time : output_times_) append_cells(blocks_[of_cells_], time, {{}, {}, {0}, {}, {}});
  }
  if (many_nodes == 0 || of_nodes_) return;
  of_nodes_ = add_block("nodes", nodes, many_nodes);
  for (const char* name : node_step_names) node_steps_.push_back(&own().group("steps").series(name, {'i', 8}, {}, few));
  for (const double time : output_times_) {
    const auto none = none_of(blocks_[of_nodes_]);
    node_steps_[0]->append_one(append(blocks_[of_nodes_], time, none.first, none.second));
    node_steps_[1]->append_one(std::int64_t(0));
  }
}

// A block of /VTKHDF: a set of points over time, with one vertex each.
RunWriter::Block RunWriter::make_block(Group& group, const std::vector<RunField>& fields, std::int64_t expected,
                                       bool of_cells) {
  // some outputs to a chunk, so that not every flush adds to the index, and not more than some 200 kB
  const int bits = std::max<int>(6, int(std::bit_width(std::uint64_t(4 * expected))));
  const std::int64_t rows = std::int64_t(1) << std::min(bits, 13);
  set_type(group, "UnstructuredGrid");
  const StoredType whole{'i', 8};
  for (const char* name : part_names) group.series(name, whole, {}, few);
  group.series("Points", {'f', 8}, {3}, rows, unit_of("point"));
  group.series("Connectivity", whole, {}, rows);
  group.series("Offsets", whole, {}, rows);
  group.series("Types", {'u', 1}, {}, rows);
  Group &data = group.group(of_cells ? "CellData" : "PointData"), &steps = group.group("Steps");
  for (const RunField& f : fields) data.series(f.name, f.type, f.row_shape, rows, unit_of(f.name));
  for (const auto& [name, row_shape] : block_steps) steps.series(name, whole, row_shape, few);
  steps.series("Values", {'f', 8}, {}, few, unit_of("time"));
  Group& offsets = steps.group(of_cells ? "CellDataOffsets" : "PointDataOffsets");
  for (const RunField& f : fields) offsets.series(f.name, whole, {}, few);
  return known_block(group, of_cells);
}

// A block as it stands in the file; its steady fields are written once more, its list of points begins a new part.
RunWriter::Block RunWriter::known_block(Group& group, bool of_cells) {
  Block b;
  b.group = &group;
  b.points = &group.series_at("Points");
  b.connectivity = &group.series_at("Connectivity");
  b.offsets = &group.series_at("Offsets");
  b.types = &group.series_at("Types");
  for (const char* name : part_names) b.parts.push_back(&group.series_at(name));
  Group &data = group.group_at(of_cells ? "CellData" : "PointData"), &steps = group.group_at("Steps");
  for (const auto& [name, row_shape] : block_steps) b.steps.push_back(&steps.series_at(name));
  b.values = &steps.series_at("Values");
  Group& offsets = steps.group_at(of_cells ? "CellDataOffsets" : "PointDataOffsets");
  for (const std::string& name : data.names()) {
    b.data.emplace_back(name, &data.series_at(name));
    b.data_offsets.emplace_back(name, &offsets.series_at(name));
  }
  b.part = b.parts[0]->rows() - 1;
  return b;
}

// The first `take` components of each row with noughts behind, so that there are as many as due.
RunField RunWriter::wide(const RunField& f, std::int64_t take, std::int64_t due, std::vector<Own>& made) const {
  if (take == due) return f;
  const std::int64_t own = f.row_shape[0];
  std::vector<double> values(std::size_t(f.rows * due));
  for (std::int64_t i = 0; i < f.rows; ++i)
    std::copy_n(static_cast<const double*>(f.values) + i * own, take, values.data() + i * due);
  made.push_back({{f.name, f.type, {due}, f.rows, nullptr}, std::move(values)});
  made.back().field.values = made.back().values.data();
  return made.back().field;
}

std::pair<RunField, std::vector<RunField>> RunWriter::in_space(const char* point, const std::vector<RunField>& given,
                                                               std::vector<Own>& made, bool turning) const {
  std::pair<RunField, std::vector<RunField>> out;
  const RunField* velocity = nullptr;
  bool found = false;
  for (const RunField& f : given) {
    const auto refuse = [&](std::int64_t components) {
      throw std::invalid_argument(f.name + " has shape " + shape_text(f.rows, f.row_shape) + "; it must be (n, " +
                                  std::to_string(components) + ")");
    };
    const bool real = f.type == StoredType{'f', 8};
    if (f.name == "velocity" && turning) {
      if (!real || f.row_shape != std::vector<std::int64_t>{3 * dim_ - 3}) refuse(3 * dim_ - 3);
      velocity = &f;
    } else if (among(vectors, f.name) || (f.name == "velocity" && std::string(point) == "position")) {
      if (!real || f.row_shape != std::vector<std::int64_t>{dim_}) refuse(dim_);
      const RunField in_3d = wide(f, dim_, 3, made);
      if (f.name == point) {
        out.first = in_3d;
        found = true;
      } else {
        out.second.push_back(in_3d);
      }
    } else {
      out.second.push_back(f);
    }
  }
  if (!found)
    throw std::invalid_argument(std::string(point) + " is missing: it says where bodies, nodes and contacts are");
  if (!velocity) return out;
  const auto* v = static_cast<const double*>(velocity->values);
  std::vector<double> linear(std::size_t(3 * velocity->rows)), spin;
  for (std::int64_t i = 0; i < velocity->rows; ++i, v += 3 * dim_ - 3) {
    std::copy_n(v, dim_, linear.data() + 3 * i);
    spin.insert(spin.end(), v + dim_, v + 3 * dim_ - 3);
  }
  const auto keep = [&](const char* name, std::vector<std::int64_t> shape, std::vector<double>&& values) {
    made.push_back({{name, {'f', 8}, std::move(shape), velocity->rows, nullptr}, std::move(values)});
    made.back().field.values = made.back().values.data();
    out.second.push_back(made.back().field);
  };
  keep("velocity", {3}, std::move(linear));
  keep("spin", dim_ == 2 ? std::vector<std::int64_t>{} : std::vector<std::int64_t>{3}, std::move(spin));
  return out;
}

void RunWriter::check(const Block& block, const char* what, const std::vector<RunField>& fields,
                      std::int64_t rows) const {
  const auto list = [](auto begin, auto end, auto&& name) {
    std::vector<std::string> names;
    for (auto it = begin; it != end; ++it) names.push_back(name(*it));
    std::sort(names.begin(), names.end());
    std::string text = "[";
    for (const auto& n : names) text += (text.size() > 1 ? ", '" : "'") + n + "'";
    return text + "]";
  };
  const std::string own = list(fields.begin(), fields.end(), [](const RunField& f) { return f.name; });
  const std::string first = list(block.data.begin(), block.data.end(), [](const auto& d) { return d.first; });
  if (own != first)
    throw std::invalid_argument(std::string("the ") + what + " have fields " + own + ", those of the first output " +
                                first + "; give the same at every output");
  for (const RunField& f : fields)
    for (const auto& [name, series] : block.data)
      if (name == f.name && (f.rows != rows || f.row_shape != series->row_shape() || f.type != series->type()))
        throw std::invalid_argument(std::string(what) + " " + name + " has shape " + shape_text(f.rows, f.row_shape) +
                                    "; it must be " + shape_text(rows, series->row_shape()) +
                                    ", as at the first output");
}

std::int64_t RunWriter::append(Block& b, double time, const RunField& points, const std::vector<RunField>& fields) {
  const std::int64_t n = points.rows;
  if (n !=
      b.count) { // a part with n vertices. Every part is 0, 1, 2 ..., so that all share one list of points of cells
    std::vector<std::int64_t> numbers(std::size_t(n + 1));
    for (std::int64_t i = 0; i <= n; ++i) numbers[std::size_t(i)] = i;
    if (const std::int64_t known = b.connectivity->rows(); known < n)
      b.connectivity->append(numbers.data() + known, n - known);
    b.cells = b.types->rows();
    const std::vector<std::uint8_t> vertex(std::size_t(n), 1); // VTK_VERTEX
    b.types->append(vertex.data(), n);
    b.offsets->append(numbers.data(), n + 1);
    for (Series* part : b.parts) part->append_one(n);
    b.count = n;
    ++b.part;
  }
  const std::int64_t first = b.points->append(points.values, n);
  const std::int64_t row[] = {b.part, 1, first, b.cells, 0};
  for (std::size_t k = 0; k < b.steps.size(); ++k) b.steps[k]->append_one(row[k]);
  b.values->append_one(time);
  for (std::size_t k = 0; k < b.data.size(); ++k) {
    const std::string& name = b.data[k].first;
    const RunField& f = *std::find_if(fields.begin(), fields.end(), [&](const RunField& g) { return g.name == name; });
    std::int64_t at;
    if (!among(steady, name)) {
      at = b.data[k].second->append(f.values, n);
    } else {
      Blake2b digest(16);
      digest.update(std::to_string(n) + "|");
      digest.update(f.values, std::size_t(n * b.data[k].second->row_bytes()));
      auto& [known, where] = b.seen[name];
      if (std::string now = digest.hexdigest(); now != known) {
        known = std::move(now);
        where = b.data[k].second->append(f.values, n);
      }
      at = where;
    }
    b.data_offsets[k].second->append_one(at);
  }
  return first;
}

// Cells that are as they were stand in the part of the outputs before.
void RunWriter::append_cells(Block& b, double time, const RunCells& c) {
  const auto cells = std::int64_t(c.types.size()), corners = std::int64_t(c.connectivity.size());
  const std::int64_t nodes = std::int64_t(c.points.size()) / 3;
  Blake2b digest(16);
  digest.update(std::to_string(nodes) + "|" + std::to_string(cells) + "|");
  digest.update(c.connectivity.data(), sizeof(std::int64_t) * c.connectivity.size());
  digest.update(c.types.data(), c.types.size());
  if (std::string now = digest.hexdigest(); now != b.shape) {
    b.shape = std::move(now);
    b.first_corner = b.connectivity->append(c.connectivity.data(), corners);
    b.cells = b.types->append(c.types.data(), cells);
    b.offsets->append(c.offsets.data(), cells + 1);
    const std::int64_t sizes[] = {nodes, cells, corners};
    for (std::size_t k = 0; k < b.parts.size(); ++k) b.parts[k]->append_one(sizes[k]);
    ++b.part;
  }
  const std::int64_t row[] = {b.part, 1, b.points->append(c.points.data(), nodes), b.cells, b.first_corner};
  for (std::size_t k = 0; k < b.steps.size(); ++k) b.steps[k]->append_one(row[k]);
  b.values->append_one(time);
  for (std::size_t k = 0; k < b.data.size(); ++k) {
    const auto f = std::find_if(c.fields.begin(), c.fields.end(),
                                [&, &wanted = b.data[k].first](const RunField& g) { return g.name == wanted; });
    const void* values = f == c.fields.end() ? nullptr : f->values; // no cell, no value
    b.data_offsets[k].second->append_one(b.data[k].second->append(values, cells));
  }
}

// An output in which a block has no points.
std::pair<RunField, std::vector<RunField>> RunWriter::none_of(const Block& block) const {
  std::pair<RunField, std::vector<RunField>> out;
  out.first = {"position", {'f', 8}, {3}, 0, nullptr};
  for (const auto& [name, series] : block.data)
    out.second.push_back({name, series->type(), series->row_shape(), 0, nullptr});
  return out;
}

// Particles of a liquid, in every output of a run that has them.
void RunWriter::append_fluid(double time, const std::vector<RunField>& fluid, std::vector<Own>& made) {
  const auto [points, fields] = in_space("position", fluid, made, false);
  if (!of_fluid_) {
    of_fluid_ = add_block("fluid", fields, points.rows);
    for (const double earlier : output_times_) {
      const auto none = none_of(blocks_[of_fluid_]);
      append(blocks_[of_fluid_], earlier, none.first, none.second);
    }
  }
  check(blocks_[of_fluid_], "particles", fields, points.rows);
  append(blocks_[of_fluid_], time, points, fields);
}

void RunWriter::write_step(double time, double time_detection, std::int64_t step, const std::vector<RunField>& bodies,
                           const std::vector<RunField>& contacts, const RunCells* cells,
                           const std::vector<RunField>& nodes, const std::vector<RunField>& fluid) {
  std::vector<Own> made;
  made.reserve(bodies.size() + contacts.size() + nodes.size() + fluid.size() +
               2); // pointers to the elements stay valid
  const auto [points, fields] = in_space("position", bodies, made, true);
  const auto [contact_points, contact_fields] = in_space("point", contacts, made, false);
  std::pair<RunField, std::vector<RunField>> at_nodes;
  if (!nodes.empty()) at_nodes = in_space("position", nodes, made, false);
  const std::int64_t many_nodes = nodes.empty() ? 0 : at_nodes.first.rows;
  if (blocks_.empty()) make_blocks(fields, contact_fields, points.rows);
  add_mesh_blocks(cells, at_nodes.second, many_nodes);
  const RunCells none{{}, {}, {0}, {}, {}};
  if (of_cells_ && cells) check(blocks_[of_cells_], "cells", cells->fields, std::int64_t(cells->types.size()));
  if (of_nodes_ && many_nodes > 0) check(blocks_[of_nodes_], "nodes", at_nodes.second, many_nodes);
  check(blocks_[0], "bodies", fields, points.rows);
  check(blocks_[1], "contacts", contact_fields, contact_points.rows);
  const std::int64_t first_body = append(blocks_[0], time, points, fields);
  const std::int64_t first_contact = append(blocks_[1], time, contact_points, contact_fields);
  if (of_cells_) append_cells(blocks_[of_cells_], time, cells ? *cells : none);
  if (of_nodes_) {
    if (many_nodes == 0) at_nodes = none_of(blocks_[of_nodes_]); // all were removed
    node_steps_[0]->append_one(append(blocks_[of_nodes_], time, at_nodes.first, at_nodes.second));
    node_steps_[1]->append_one(many_nodes);
  }
  if (!fluid.empty()) append_fluid(time, fluid, made);
  times_->append_one(time);
  output_times_.push_back(time);
  steps_[0]->append_one(time);
  steps_[1]->append_one(time_detection);
  const std::int64_t row[] = {step, first_body, points.rows, first_contact, contact_points.rows};
  for (int k = 0; k < 5; ++k) steps_[std::size_t(k + 2)]->append_one(row[k]);
  const StoredArray outputs = StoredArray::number(times_->rows());
  root_steps_->set_attribute("NSteps", outputs);
  for (Block& block : blocks_) block.group->group("Steps").set_attribute("NSteps", outputs);
}

// ---------------------------------------------------------------- history

void RunWriter::write_history(double time, std::int64_t step, const std::vector<RunNumber>& numbers) {
  std::vector<RunNumber> row = {{"time", time}, {"step", double(step)}};
  for (const RunNumber& number : numbers)
    if (std::none_of(row.begin(), row.end(), [&](const RunNumber& r) { return r.first == number.first; }))
      row.push_back(number);
  pending_.push_back(std::move(row));
  last_history_ = step;
}

// A column of the history; rows before its first value hold the missing value: NaN or -1.
RunWriter::Column& RunWriter::column(const std::string& name, bool words) {
  const auto found = columns_.find(name);
  if (found != columns_.end()) return found->second;
  const StoredType type = words ? StoredType{'i', 4} : name == "step" ? StoredType{'i', 8} : StoredType{'f', 8};
  Series& series =
      own().group("history").series(name, type, {}, 512, type.kind == 'f' ? unit_of(name) : hdf5::Attributes());
  for (std::int64_t k = 0; k < rows_; ++k) {
    if (type.kind == 'f')
      series.append_one(std::numeric_limits<double>::quiet_NaN());
    else if (words)
      series.append_one(std::int32_t(-1));
    else
      series.append_one(std::int64_t(-1));
  }
  return columns_.emplace(name, Column{&series, words, {}}).first->second;
}

// Words are stored as numbers; the list of words is an attribute of the history.
void RunWriter::append_words(const std::string& name, Column& c, const std::vector<const RunNumber*>& values) {
  std::vector<std::int32_t> codes;
  const std::size_t known = c.table.size();
  for (const RunNumber* value : values) {
    const auto* word = value ? std::get_if<std::string>(&value->second) : nullptr;
    if (!word) {
      codes.push_back(-1);
      continue;
    }
    const auto at = std::find(c.table.begin(), c.table.end(), *word);
    codes.push_back(std::int32_t(at - c.table.begin()));
    if (at == c.table.end()) c.table.push_back(*word);
  }
  c.series->append(codes.data(), std::int64_t(codes.size()));
  if (c.table.size() == known) return;
  std::string list;
  for (const std::string& word : c.table) list += (list.empty() ? "" : ", ") + json_text(word);
  own().group("history").set_attribute(name + "_words", StoredArray::text("[" + list + "]"));
}

void RunWriter::store_history() {
  if (pending_.empty()) return;
  for (const auto& row : pending_)
    for (const auto& [name, value] : row) column(name, std::holds_alternative<std::string>(value));
  for (auto& [name, c] : columns_) {
    std::vector<const RunNumber*> values;
    for (const auto& row : pending_) {
      const auto found =
          std::find_if(row.begin(), row.end(), [&, &wanted = name](const RunNumber& r) { return r.first == wanted; });
      values.push_back(found == row.end() ? nullptr : &*found);
    }
    if (c.words) {
      append_words(name, c, values);
      continue;
    }
    std::vector<double> real;
    std::vector<std::int64_t> whole;
    for (const RunNumber* value : values) {
      const double* x = value ? std::get_if<double>(&value->second) : nullptr;
      real.push_back(x ? *x : std::numeric_limits<double>::quiet_NaN());
      whole.push_back(x ? std::int64_t(*x) : -1);
    }
    c.series->append(c.series->type().kind == 'f' ? static_cast<const void*>(real.data()) : whole.data(),
                     std::int64_t(values.size()));
  }
  rows_ += std::int64_t(pending_.size());
  pending_.clear();
}

// ---------------------------------------------------------------- flush, close, go on

void RunWriter::flush(std::optional<bool> sync, double pace) {
  const auto now = std::chrono::steady_clock::now();
  if (pace > 0 && std::chrono::duration<double>(now - flushed_at_).count() < pace) return;
  store_history();
  file_->commit(sync);
  flushed_at_ = std::chrono::steady_clock::now();
}

void RunWriter::close() {
  if (!pending_.empty() && !file_->failed()) store_history();
  file_->close();
}

std::unique_ptr<RunWriter> RunWriter::go_on(const std::string& path, std::int64_t step) {
  try {
    return take_up(path, step);
  } catch (const FileError&) { throw; } catch (const std::exception& e) {
    throw FileError(path, std::string("the file is damaged: ") + e.what(), "use a copy of it");
  }
}

std::unique_ptr<RunWriter> RunWriter::take_up(const std::string& path, std::int64_t step) {
  const auto kept_of = [&](const Hdf5Node& array) {
    const std::vector<std::int64_t> steps = numbers_of<std::int64_t>(array.read(), "step");
    return std::int64_t(std::upper_bound(steps.begin(), steps.end(), step) - steps.begin());
  };
  std::int64_t outputs, kept_rows = 0;
  std::unique_ptr<RunWriter> w(new RunWriter);
  w->file_ = std::make_unique<GrowingFile>(path, GrowingFile::If::go_on);
  {
    const Hdf5Node old = Hdf5Node::open(path).at("cairn");
    const std::optional<StoredArray> dim = old.attribute("dim");
    w->dim_ = dim && dim->size() == 1 ? int(numbers_of<std::int64_t>(*dim, "dim")[0]) : 0;
    outputs = kept_of(old.at("steps/step"));
    w->output_times_ = numbers_of<double>(old.at("steps/time").read(), "time");
    w->output_times_.resize(std::size_t(outputs));
    if (old.contains("history/step")) kept_rows = kept_of(old.at("history/step"));
  }
  Group &root = w->file_->root(), &own = root.group_at("cairn");
  for (const auto& [name, type] : step_names) w->steps_.push_back(&own.group_at("steps").series_at(name));
  Group& history = own.group_at("history");
  for (const std::string& name : history.names()) {
    Column column{&history.series_at(name), false, {}};
    if (const StoredArray* words = history.attribute(name + "_words"))
      column = {column.series, true, json_words({words->bytes.begin(), words->bytes.end()})};
    column.series->cut(kept_rows);
    w->columns_.emplace(name, std::move(column));
  }
  w->rows_ = kept_rows;
  std::vector<Series*> cut = w->steps_;
  if (root.contains("VTKHDF")) {
    Group& vtk = root.group_at("VTKHDF");
    w->root_steps_ = &vtk.group_at("Steps");
    w->times_ = &w->root_steps_->series_at("Values");
    cut.push_back(w->times_);
    const StoredArray count = StoredArray::number(outputs);
    w->root_steps_->set_attribute("NSteps", count);
    for (const char* name : {"bodies", "contacts", "meshes", "nodes", "fluid"}) {
      if (!vtk.contains(name)) continue; // of scenes without bodies that deform
      const std::string what = name;
      if (what == "meshes") w->of_cells_ = w->blocks_.size();
      if (what == "fluid") w->of_fluid_ = w->blocks_.size();
      if (what == "nodes") {
        w->of_nodes_ = w->blocks_.size();
        for (const char* column : node_step_names) w->node_steps_.push_back(&own.group_at("steps").series_at(column));
        cut.insert(cut.end(), w->node_steps_.begin(), w->node_steps_.end());
      }
      w->blocks_.push_back(w->known_block(vtk.group_at(name), what == "meshes"));
      const Block& b = w->blocks_.back();
      cut.insert(cut.end(), b.steps.begin(), b.steps.end());
      cut.push_back(b.values);
      for (const auto& [field, series] : b.data_offsets) cut.push_back(series);
      b.group->group("Steps").set_attribute("NSteps", count);
    }
  }
  for (Series* series : cut) series->cut(outputs);
  w->file_->commit();
  return w;
}

} // namespace cairn
