#include <algorithm>

#include "alone.hpp"
#include "arrays.hpp"
#include "contactors/mapped_contactors.hpp"
#include "scene/cell_boundaries.hpp"
#include "scene/scene.hpp"

using cairn::Scene;
using Doubles = std::optional<Input<double>>;

namespace {

cairn::Shape shape_named(const std::string& name) {
  for (const cairn::ShapeInfo& shape : cairn::shape_infos())
    if (name == shape.name) return cairn::Shape(&shape - cairn::shape_table);
  throw cairn::Error("there is no shape " + name);
}

// Names of the shapes of which all these words of shapes.def are true; of all shapes if there are none.
std::vector<std::string> shapes_that_are(const py::args& words) {
  using Info = cairn::ShapeInfo;
  static const std::pair<const char*, bool (*)(const Info&)> columns[] = {
      {"bounded", [](const Info& s) { return s.bounded; }}, {"ball", [](const Info& s) { return s.ball(); }},
      {"hollow", [](const Info& s) { return s.hollow(); }}, {"directed", [](const Info& s) { return s.directed; }},
      {"hull", [](const Info& s) { return s.is_hull(); }},  {"mover", [](const Info& s) { return s.mover; }},
      {"faced", [](const Info& s) { return s.faced; }},
  };
  std::vector<std::string> names;
  for (const Info& shape : cairn::shape_infos()) {
    bool all = true;
    for (const auto& word : words) {
      const auto name = py::cast<std::string>(word);
      const auto column =
          std::find_if(std::begin(columns), std::end(columns), [&](auto& c) { return name == c.first; });
      if (column == std::end(columns)) throw cairn::Error("shapes.def does not say which shapes are " + name);
      all = all && column->second(shape);
    }
    if (all) names.emplace_back(shape.name);
  }
  return names;
}

std::int64_t add_bodies(Scene& s, std::int64_t count, const Doubles& position, const Doubles& rotation,
                        const Doubles& velocity, const Doubles& mass, const Doubles& inertia) {
  return s.add_bodies(
      {count, span_of(position), span_of(rotation), span_of(velocity), span_of(mass), span_of(inertia)});
}

std::int64_t add_contactors(Scene& s, const std::string& shape, const Input<std::int64_t>& body,
                            const Input<std::int32_t>& material, const Doubles& radius, const Doubles& offset,
                            const Doubles& direction, const std::optional<Input<std::int32_t>>& hull) {
  return s.add_contactors({body.size(),
                           shape_named(shape),
                           {body.data(), std::size_t(body.size())},
                           {material.data(), std::size_t(material.size())},
                           span_of(radius),
                           span_of(offset),
                           span_of(direction),
                           span_of(hull)});
}

std::int32_t add_hulls(Scene& s, const Input<double>& vertex, const Input<std::int64_t>& first_vertex,
                       const Input<std::int64_t>& first_face, const Input<std::int64_t>& first_corner,
                       const Input<std::int64_t>& corner, bool facets, const Input<double>& plane,
                       const Input<double>& ball) {
  const auto span = [](const auto& a) { return std::span(a.data(), std::size_t(a.size())); };
  return s.contactors.hulls.add({span(vertex), span(first_vertex), span(first_face), span(first_corner), span(corner),
                                 facets, span(plane), span(ball)});
}

// Calls f(name, array) for every array of the hulls.
template <class F>
void each_hull_array(cairn::Hulls& h, F&& f) {
  f("first_vertex", h.first_vertex);
  f("first_face", h.first_face);
  f("first_edge", h.first_edge);
  f("first_corner", h.first_corner);
  f("corner_vertex", h.corner_vertex);
  f("corner_edge", h.corner_edge);
  f("edge", h.edge);
  f("vertex", h.vertex);
  f("normal", h.normal);
  f("offset", h.offset);
  f("inner", h.inner);
  f("radius", h.radius);
}

py::dict get_hulls(Scene& s) {
  py::dict out;
  each_hull_array(s.contactors.hulls, [&](const char* name, const auto& v) {
    out[name] = py::array(py::ssize_t(v.size()), v.data()).attr("copy")();
  });
  return out;
}

template <class Holder>
void assign_field(Scene& s, Holder& holder, const std::string& name, const py::array& values,
                  const std::vector<std::int32_t>& order) {
  bool found = false;
  holder.for_each_field([&](auto& field) {
    if (field.name != name) return;
    found = true;
    s.activate(field.need);
    assign(field, values, order);
  });
  if (!found) throw py::key_error("there is no field " + name);
}

std::int64_t add_nodes(Scene& s, std::int32_t mesh, const Input<double>& position, const Doubles& velocity,
                       const Input<double>& mass) {
  const auto span = [](const Input<double>& a) { return std::span(a.data(), std::size_t(a.size())); };
  return s.add_nodes(mesh, span(position), span_of(velocity), span(mass));
}

void set_cell(Scene& s, const std::array<bool, 3>& periodic, const Input<double>& vectors, const Input<double>& corner,
              const Input<double>& gradient) {
  if (vectors.size() != 9 || corner.size() != 3 || gradient.size() != 9)
    throw cairn::Error("a cell needs 3 x 3 vectors, 3 coordinates of its corner and a 3 x 3 velocity gradient");
  cairn::Cell cell = s.cell;
  for (int i = 0; i < 3; ++i) {
    cell.periodic[i] = periodic[i];
    cell.corner[i] = corner.data()[i];
    for (int k = 0; k < 3; ++k) { // rows of the input are cell vectors; columns are stored
      cell.vectors[i + 3 * k] = vectors.data()[3 * k + i];
      cell.velocity_gradient[i + 3 * k] = gradient.data()[3 * i + k];
    }
  }
  cairn::set_cell(s, cell);
}

py::dict get_cell(const Scene& s) {
  py::array_t<double> vectors({3, 3}), corner(3), gradient({3, 3});
  for (int i = 0; i < 3; ++i) {
    corner.mutable_at(i) = s.cell.corner[i];
    for (int k = 0; k < 3; ++k) {
      vectors.mutable_at(k, i) = s.cell.vectors[i + 3 * k];
      gradient.mutable_at(i, k) = s.cell.velocity_gradient[i + 3 * k];
    }
  }
  py::dict out;
  out["periodic"] = py::make_tuple(s.cell.periodic[0], s.cell.periodic[1], s.cell.periodic[2]);
  out["vectors"] = vectors;
  out["corner"] = corner;
  out["velocity_gradient"] = gradient;
  return out;
}

} // namespace

void bind_scene(py::module_& m) {
  m.def("pairs", &cairn::pairs_of_shapes); // that meet
  m.def("shapes", &shapes_that_are);       // in the order of their numbers
  py::class_<Scene>(m, "Scene")
      .def(py::init<int>())
      .def_readonly("dim", &Scene::dim)
      .def_readwrite("gravity", &Scene::gravity)
      .def_readwrite("origin", &Scene::origin)
      .def("add_bodies", &add_bodies)
      .def("new_mesh", &Scene::new_mesh)
      .def("add_nodes", &add_nodes)        // mesh, position, velocity, mass
      .def("add_parts", &Scene::add_parts) // mesh, count
      .def("add_hulls", &add_hulls, py::arg("vertex"), py::arg("first_vertex"), py::arg("first_face"),
           py::arg("first_corner"), py::arg("corner"), py::arg("facets") = false, py::arg("plane") = Input<double>(0),
           py::arg("ball") = Input<double>(0))
      .def("add_contactors", &add_contactors, py::arg("shape"), py::arg("body"), py::arg("material"),
           py::arg("radius") = py::none(), py::arg("offset") = py::none(), py::arg("direction") = py::none(),
           py::arg("hull") = py::none())
      .def_property_readonly("hulls", &get_hulls)
      .def("remove_bodies",
           [](Scene& s, const Input<std::int64_t>& ids) {
             s.remove_bodies({ids.data(), std::size_t(ids.size())});
           })
      .def("give_id", &Scene::give_id)
      .def("drive",
           [](Scene& s, const Input<std::int64_t>& ids, int mask, const Doubles& velocity) {
             s.drive({ids.data(), std::size_t(ids.size())}, std::uint8_t(mask), span_of(velocity));
           })
      .def("set_cell", &set_cell)
      .def("get_cell", &get_cell)
      .def("renumber", py::overload_cast<>(&Scene::renumber))
      .def("reserve", &Scene::reserve) // bodies, contactors
      .def("leave_numbers",
           [](Scene& s, bool leave) {
             if (leave && s.bodies.count > 0)
               throw cairn::Error("numbers can be left to others before bodies come, and the scene has " +
                                  std::to_string(s.bodies.count) + " bodies: leave them before the first add");
             s.leave_numbers(leave);
           })
      .def_property_readonly("body_count", [](const Scene& s) { return s.bodies.count; })
      .def_property_readonly("node_count", [](const Scene& s) { return s.nodes.count; })
      .def_property_readonly("contactor_count", [](const Scene& s) { return s.contactors.count; })
      .def("internal", &Scene::internal)
      .def("node_row", &Scene::node)
      .def("node_place", // of a node in the order in which nodes came in
           [](const Scene& s, std::int64_t id) {
             s.node(id); // refuses one that is gone
             const auto& order = s.node_insertion_order();
             const auto before = [&](std::int32_t row, std::int64_t of) { return *s.nodes.id[row] < of; };
             return std::lower_bound(order.begin(), order.end(), id, before) - order.begin();
           })
      .def("node",
           [](Scene& s, const std::string& name) { return get_ordered(s.nodes, name, s.node_insertion_order()); })
      .def("body", [](Scene& s, const std::string& name) { return get_ordered(s.bodies, name, s.insertion_order()); })
      .def("contactor",
           [](Scene& s, const std::string& name) {
             return get_ordered(s.contactors, name, s.contactor_insertion_order());
           })
      .def("carriers", // ids of the bodies, or of the parts of deformable ones, that carry the contactors
           [](const Scene& s) {
             py::array_t<std::int64_t> out(py::ssize_t(s.contactors.count));
             std::int64_t* to = out.mutable_data();
             for (const std::int32_t i : s.contactor_insertion_order()) *to++ = carrier_id(s.bodies, s.contactors, i);
             return out;
           })
      .def("assign_body", [](Scene& s, const std::string& name,
                             const py::array& values) { assign_field(s, s.bodies, name, values, s.insertion_order()); })
      .def("assign_node",
           [](Scene& s, const std::string& name, const py::array& values) {
             assign_field(s, s.nodes, name, values, s.node_insertion_order());
           })
      .def("raw_node",
           [](py::object self, const std::string& name) { return get_live(self.cast<Scene&>().nodes, name, self); })
      .def("raw_body",
           [](py::object self, const std::string& name) { return get_live(self.cast<Scene&>().bodies, name, self); })
      .def("body_fields", [](Scene& s) { return describe(s.bodies); })
      .def("node_fields", [](Scene& s) { return describe(s.nodes); })
      .def("contactor_fields", [](Scene& s) { return describe(s.contactors); });
}
