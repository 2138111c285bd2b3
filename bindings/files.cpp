// Files: the growing container, the reader of HDF5, checkpoints and runs.
#include <pybind11/functional.h>

#include "files/checksums.hpp"
#include "files/growing_file.hpp"
#include "files/hdf5_node.hpp"
#include "files/run_writer.hpp"
#include "files/writer_lock.hpp"
#include "stored.hpp"

using cairn::StoredArray;
using cairn::StoredValue;

namespace {

std::string kind_of(const py::handle& array) { return py::cast<std::string>(array.attr("dtype").attr("kind")); }

py::object as_array(const py::handle& value) {
  static const py::handle asarray = py::object(py::module_::import("numpy").attr("asarray")).release();
  return asarray(value);
}

bool plain_numbers(const py::handle& value) {
  const std::string kind = kind_of(value);
  return kind == "i" || kind == "u" || kind == "b" || (kind == "f" && py::cast<int>(value.attr("itemsize")) <= 8);
}

StoredValue json_value(const py::handle& value, const char* kind) {
  const py::module_ json = py::module_::import("json");
  const auto text = py::cast<std::string>(json.attr("dumps")(value, py::arg("allow_nan") = false));
  return {kind, StoredArray::of(reinterpret_cast<const unsigned char*>(text.data()), {std::int64_t(text.size())}), {}};
}

// Arrays and numpy's numbers as they are, all else as JSON or text.
StoredValue value_of(const py::handle& value, const std::string& here) {
  static const py::handle generic = py::object(py::module_::import("numpy").attr("generic")).release();
  const bool array = py::isinstance<py::array>(value), number = py::isinstance(value, generic);
  if ((array || number) && plain_numbers(value)) {
    StoredValue out{number ? "number" : "array", stored_of(value), {}};
    if (out.array.type.kind == 'b') { // as whole numbers in the file
      out.kind = number ? "flag" : "flags";
      out.array.type.kind = 'u';
    }
    return out;
  }
  if (array && kind_of(value) == "U") return json_value(value.attr("tolist")(), "texts");
  if (py::isinstance<py::float_>(value)) // JSON has no NaN
    return {"float", StoredArray::number(py::cast<double>(value)), {}};
  if (py::isinstance<py::bytes>(value)) {
    const std::string_view bytes = py::cast<py::bytes>(value);
    return {"bytes",
            StoredArray::of(reinterpret_cast<const unsigned char*>(bytes.data()), {std::int64_t(bytes.size())}),
            {}};
  }
  try {
    return json_value(value, "json");
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
    throw py::type_error("checkpoint: " + here + " is a " +
                         py::cast<std::string>(py::type::of(value).attr("__name__")) + " that cannot be stored (" +
                         py::cast<std::string>(py::str(error.value())) +
                         "); use arrays, numbers, text, lists or dicts");
  }
}

// An array whose numbers stay in their file, and that nobody can write.
py::object left_in_file(const StoredValue& value) {
  auto* const kept = new std::shared_ptr<const unsigned char>(value.mapped);
  const py::capsule file(kept, [](void* of) { delete static_cast<std::shared_ptr<const unsigned char>*>(of); });
  const cairn::StoredType type = value.array.type;
  const py::array out(py::dtype(std::string(1, type.kind) + std::to_string(type.item)), value.array.shape,
                      value.mapped.get(), file);
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

py::object object_of(const StoredValue& value) {
  if (value.is_tree()) return dict_of(value);
  if (value.mapped) return left_in_file(value);
  const StoredArray& a = value.array;
  if (value.kind == "array" || value.kind == "flags") return numpy_of(a);
  if (value.kind == "number" || value.kind == "flag") return numpy_of(a).attr("__getitem__")(py::tuple());
  if (value.kind == "float") return py::float_(cairn::numbers_of<double>(a, "a number").at(0));
  const py::bytes bytes(reinterpret_cast<const char*>(a.bytes.data()), a.bytes.size());
  if (value.kind == "bytes") return bytes;
  if (value.kind != "json" && value.kind != "texts")
    throw std::invalid_argument("there is no kind '" + value.kind + "'");
  const py::object list = py::module_::import("json").attr("loads")(bytes.attr("decode")());
  return value.kind == "texts" ? as_array(list) : list;
}

cairn::hdf5::Attributes attributes_of(const py::kwargs& given) {
  cairn::hdf5::Attributes out;
  for (const auto& [name, value] : given) out.emplace_back(py::cast<std::string>(name), stored_of(value));
  return out;
}

cairn::StoredType type_of(const py::handle& dtype) {
  const py::module_ numpy = py::module_::import("numpy");
  return stored_of(numpy.attr("empty")(0, dtype)).type;
}

std::int64_t append(cairn::Series& s, const py::handle& values) {
  const py::module_ numpy = py::module_::import("numpy");
  const std::string dtype = std::string(1, s.type().kind) + std::to_string(s.type().item);
  const py::object array = numpy.attr("ascontiguousarray")(values, dtype);
  const auto given = py::cast<py::array>(array);
  std::vector<std::int64_t> row(given.shape() + (given.ndim() ? 1 : 0), given.shape() + given.ndim());
  if (row != s.row_shape())
    throw py::value_error("rows of shape " + py::cast<std::string>(py::repr(py::tuple(py::cast(s.row_shape())))) +
                          " were expected, not " + py::cast<std::string>(py::repr(py::tuple(py::cast(row)))));
  return s.append(given.data(), given.ndim() ? given.shape(0) : 1);
}

// ---------------------------------------------------------------- runs

using Kept = std::vector<py::object>; // arrays that fields point into

std::vector<cairn::RunField> fields_of(const py::dict& given, Kept& kept) {
  static const std::set<std::string> vectors = {"position", "velocity", "point", "normal", "impulse"};
  std::vector<cairn::RunField> out;
  for (const auto& [key, value] : given) {
    const auto name = py::cast<std::string>(key);
    py::object array = as_array(value);
    if (vectors.contains(name) || kind_of(array) == "b")
      array = array.attr("astype")(vectors.contains(name) ? "f8" : "u1");
    const cairn::StoredType type = type_of(array.attr("dtype"));
    const std::string dtype = std::string("<") + type.kind + std::to_string(type.item);
    array = py::module_::import("numpy").attr("ascontiguousarray")(array, dtype);
    const auto a = py::cast<py::array>(array);
    if (a.ndim() == 0) throw py::value_error(name + " is one number: give one for each body or contact");
    out.push_back({name, type, {a.shape() + 1, a.shape() + a.ndim()}, a.shape(0), a.data()});
    kept.push_back(std::move(array));
  }
  return out;
}

void bind_runs(py::module_& m) {
  using cairn::RunWriter;
  py::class_<RunWriter>(m, "RunWriter")
      .def(py::init<const std::string&, int, bool>(), py::arg("path"), py::arg("dim"), py::arg("overwrite") = false)
      .def_static("go_on", &RunWriter::go_on)
      .def_property_readonly("own", &RunWriter::own, py::return_value_policy::reference_internal)
      .def("begin", &RunWriter::begin)
      .def(
          "write_step",
          [](RunWriter& w, double time, double detected, std::int64_t step, const py::dict& bodies,
             const py::dict& contacts, const py::object& given, const py::dict& nodes, const py::dict& fluid) {
            Kept kept;
            const auto of_bodies = fields_of(bodies, kept), of_contacts = fields_of(contacts, kept),
                       of_nodes = fields_of(nodes, kept), of_fluid = fields_of(fluid, kept);
            if (given.is_none())
              return w.write_step(time, detected, step, of_bodies, of_contacts, nullptr, of_nodes, of_fluid);
            const auto of = py::cast<py::dict>(given);
            cairn::RunCells cells;
            const auto take = [&](auto& to, const char* name) {
              using T = typename std::decay_t<decltype(to)>::value_type;
              const auto a = py::cast<Input<T>>(of[name]);
              to.assign(a.data(), a.data() + a.size());
            };
            take(cells.points, "points");
            take(cells.connectivity, "connectivity");
            take(cells.offsets, "offsets");
            take(cells.types, "types");
            cells.fields = fields_of(of["fields"], kept);
            w.write_step(time, detected, step, of_bodies, of_contacts, &cells, of_nodes, of_fluid);
          },
          py::arg("time"), py::arg("time_detection"), py::arg("step"), py::arg("bodies"), py::arg("contacts"),
          py::arg("cells") = py::none(), py::arg("nodes") = py::dict(), py::arg("fluid") = py::dict())
      .def("write_history", &RunWriter::write_history)
      .def("flush", &RunWriter::flush, py::arg("sync") = py::none(), py::arg("pace") = 0.0)
      .def("close", &RunWriter::close)
      .def_property_readonly("outputs", &RunWriter::outputs)
      .def_property_readonly("last_history", &RunWriter::last_history)
      .def_property_readonly("path", &RunWriter::path)
      .def_property_readonly("dim", &RunWriter::dim)
      .def_property_readonly("size", &RunWriter::size);
}

void bind_container(py::module_& m) {
  using cairn::Group;
  using cairn::GrowingFile;
  using cairn::Series;
  const auto inside = py::return_value_policy::reference_internal;
  py::class_<Series>(m, "Series")
      .def("append", &append)
      .def_property_readonly("rows", &Series::rows)
      .def_property_readonly("row_shape", [](const Series& s) { return py::tuple(py::cast(s.row_shape())); });
  py::class_<Group>(m, "Group")
      .def("group", &Group::group, inside)
      .def("array", [](Group& g, const std::string& name, const py::handle& value,
                       const py::kwargs& attributes) { g.array(name, stored_of(value), attributes_of(attributes)); })
      .def(
          "series",
          [](Group& g, const std::string& name, const py::handle& dtype, const std::vector<std::int64_t>& row_shape,
             std::int64_t rows_per_chunk, const py::kwargs& attributes) -> Series& {
            return g.series(name, type_of(dtype), row_shape, rows_per_chunk, attributes_of(attributes));
          },
          inside, py::arg("name"), py::arg("dtype"), py::arg("row_shape") = std::vector<std::int64_t>(),
          py::arg("rows_per_chunk") = 512)
      .def("soft_link", &Group::soft_link)
      .def("set_attribute",
           [](Group& g, const std::string& name, const py::handle& value) { g.set_attribute(name, stored_of(value)); })
      .def("__contains__", &Group::contains)
      .def(
          "__getitem__", [](Group& g, const std::string& name) -> Series& { return g.series_at(name); }, inside);
  py::class_<GrowingFile>(m, "GrowingFile")
      .def(py::init([](const py::object& path, bool overwrite) {
             const auto text = py::cast<std::string>(py::module_::import("os").attr("fspath")(path));
             return std::make_unique<GrowingFile>(text,
                                                  overwrite ? GrowingFile::If::replace : GrowingFile::If::new_file);
           }),
           py::arg("path"), py::arg("overwrite") = false)
      .def_property_readonly("root", &GrowingFile::root, inside)
      .def_property_readonly("path", &GrowingFile::path)
      .def_property_readonly("size", &GrowingFile::size)
      .def("commit", &GrowingFile::commit, py::arg("sync") = py::none())
      .def("close", &GrowingFile::close)
      .def_static("watch", [](const std::optional<std::function<int(std::uint64_t, py::bytes)>>& seen) {
        GrowingFile::watch = {};
        if (seen)
          GrowingFile::watch = [call = *seen](std::uint64_t address, std::span<const unsigned char> data) {
            return call(address, py::bytes(reinterpret_cast<const char*>(data.data()), data.size()));
          };
      });
  m.def("restore_superblock", &cairn::restore_superblock);
  m.def(
      "write_whole",
      [](const py::object& path, const py::bytes& data, bool beside) {
        cairn::write_whole(py::cast<std::string>(py::module_::import("os").attr("fspath")(path)), data, beside);
      },
      py::arg("path"), py::arg("data"), py::arg("beside"));
  m.def("lookup3", [](const py::bytes& data) {
    const std::string_view text = data;
    return cairn::lookup3(reinterpret_cast<const unsigned char*>(text.data()), text.size());
  });
}

void bind_reader(py::module_& m) {
  using cairn::Hdf5Node;
  py::class_<Hdf5Node>(m, "Hdf5Node")
      .def_static("open", &Hdf5Node::open)
      .def_property_readonly("path", &Hdf5Node::path)
      .def_property_readonly("name", &Hdf5Node::name)
      .def_property_readonly("is_group", &Hdf5Node::is_group)
      .def_property_readonly("names", &Hdf5Node::names)
      .def("contains", &Hdf5Node::contains)
      .def("soft_link", &Hdf5Node::soft_link)
      .def("at", &Hdf5Node::at)
      .def_property_readonly("attribute_names", &Hdf5Node::attribute_names)
      .def("attribute",
           [](const Hdf5Node& n, const std::string& name) -> py::object {
             const std::optional<StoredArray> a = n.attribute(name);
             return a ? numpy_of(*a) : py::none();
           })
      .def_property_readonly("shape", [](const Hdf5Node& n) { return py::tuple(py::cast(n.shape())); })
      .def_property_readonly("dtype",
                             [](const Hdf5Node& n) {
                               const cairn::StoredType t = n.type();
                               return py::dtype(t.kind == 'b' ? "?" : std::string(1, t.kind) + std::to_string(t.item));
                             })
      .def_property_readonly("address", &Hdf5Node::address)
      .def("read", [](const Hdf5Node& n) { return numpy_of(n.read()); })
      .def("rows",
           [](const Hdf5Node& n, std::int64_t first, std::int64_t count) { return numpy_of(n.rows(first, count)); })
      .def("data_checksum", &Hdf5Node::data_checksum);
}

} // namespace

StoredArray stored_of(const py::handle& value) {
  const py::module_ numpy = py::module_::import("numpy");
  py::object array = as_array(value);
  std::string kind = kind_of(array);
  if (kind == "U") {
    array = as_array(numpy.attr("char").attr("encode")(array, "utf-8"));
    kind = "S";
  }
  auto item = py::cast<std::uint32_t>(array.attr("itemsize"));
  if (kind == "S" && item == 0) {
    array = array.attr("astype")("S1");
    item = 1;
  }
  if (kind != "S" && !(plain_numbers(array) && (kind != "f" || item >= 4)))
    throw py::type_error("an array of " + py::cast<std::string>(py::str(array.attr("dtype"))) +
                         " cannot be stored; use integers, float32, float64 or strings");
  array = array.attr("astype")(array.attr("dtype").attr("newbyteorder")("<"), py::arg("order") = "C",
                               py::arg("copy") = false);
  const auto a = py::cast<py::array>(array);
  StoredArray out{{kind[0], item}, {a.shape(), a.shape() + a.ndim()}, {}};
  const auto* from = static_cast<const unsigned char*>(a.data());
  out.bytes.assign(from, from + a.nbytes());
  return out;
}

py::object numpy_of(const StoredArray& array) {
  const std::string dtype =
      array.type.kind == 'b' ? "?" : std::string(1, array.type.kind) + std::to_string(array.type.item);
  py::array out(py::dtype(dtype), std::vector<py::ssize_t>(array.shape.begin(), array.shape.end()));
  if (!array.bytes.empty()) std::memcpy(out.mutable_data(), array.bytes.data(), array.bytes.size());
  return out;
}

StoredValue tree_of(const py::dict& tree, const std::string& place) {
  StoredValue out;
  for (const auto& [key, value] : tree) {
    const std::string name = py::isinstance<py::str>(key) ? py::cast<std::string>(key) : "";
    if (name.empty() || name.find('/') != std::string::npos)
      throw py::type_error("checkpoint: '" + place + "/" + py::cast<std::string>(py::str(key)) +
                           "' cannot be a name; use text without '/'");
    const std::string here = place + "/" + name;
    out.add(name, py::isinstance<py::dict>(value) ? tree_of(py::cast<py::dict>(value), here) : value_of(value, here));
  }
  return out;
}

py::dict dict_of(const StoredValue& tree) {
  py::dict out;
  for (const auto& [name, value] : tree.members) out[py::str(name)] = object_of(value);
  return out;
}

void bind_files(py::module_& m) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const cairn::FileError& e) {
      const py::object type =
          py::module_::import("cairn.base.errors")
              .attr(dynamic_cast<const cairn::UnknownStructure*>(&e) ? "UnknownStructure" : "FileError");
      // names in a damaged file need not be text, nor need a path
      const auto path = py::reinterpret_steal<py::object>(
          PyUnicode_DecodeFSDefaultAndSize(e.path.data(), py::ssize_t(e.path.size())));
      const auto text = [](const std::string& told) {
        return py::reinterpret_steal<py::object>(
            PyUnicode_DecodeUTF8(told.data(), py::ssize_t(told.size()), "backslashreplace"));
      };
      const py::object error = type(path, text(e.problem), text(e.remedy));
      if (e.number) error.attr("errno") = e.number;
      PyErr_SetObject(type.ptr(), error.ptr());
    }
  });
  bind_container(m);
  bind_reader(m);
  bind_runs(m);
  m.def("save_tree", [](const std::string& path, const py::dict& tree) { cairn::save_tree(path, tree_of(tree)); });
  m.def(
      "load_tree",
      [](const std::string& path, const std::string& what, const std::string& given,
         std::optional<std::uint64_t> stays_from) {
        const StoredValue tree =
            cairn::load_tree(path, what, given, stays_from.value_or(std::numeric_limits<std::uint64_t>::max()));
        try {
          return dict_of(tree);
        } catch (const std::exception& e) {
          throw cairn::FileError(path, what + " is damaged (" + e.what() + ")", "write it again");
        }
      },
      py::arg("path"), py::arg("what"), py::arg("given"), py::arg("stays_from") = py::none());
}
