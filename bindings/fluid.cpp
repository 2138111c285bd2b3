#include "fluid/fluid.hpp"
#include "fluid/fluid_draft.hpp"
#include "simulation/simulation.hpp"

#include "alone.hpp"
#include "arrays.hpp"

using cairn::Simulation;

namespace {

cairn::FluidSettings settings_of(const py::dict& d) {
  cairn::FluidSettings s;
  const auto take = [&](const char* name, auto& to) {
    if (d.contains(name)) to = py::cast<std::decay_t<decltype(to)>>(d[name]);
  };
  take("spacing", s.spacing);
  take("density", s.density);
  take("viscosity", s.viscosity);
  take("sound_speed", s.sound_speed);
  take("smoothing", s.smoothing);
  take("diffusion", s.diffusion);
  take("limiter", s.limiter);
  take("artificial", s.artificial);
  take("drift", s.drift);
  take("courant", s.courant);
  take("depth", s.depth);
  take("surface_tension", s.surface_tension);
  take("threads", s.threads);
  take("incompressible", s.incompressible);
  take("filter", s.filter);
  take("correction", s.correction);
  take("tolerance", s.tolerance);
  take("iterations", s.iterations);
  return s;
}

template <class T>
std::vector<T> numbers(const py::dict& d, const char* name) {
  const auto a = py::cast<Input<T>>(d[name]);
  return {a.data(), a.data() + a.size()};
}

cairn::FluidSurface surface_of(const py::dict& d) {
  cairn::FluidSurface s;
  s.body = numbers<std::int64_t>(d, "body");
  s.offset = numbers<double>(d, "offset");
  s.normal = numbers<double>(d, "normal");
  s.depth = numbers<double>(d, "depth");
  s.volume = numbers<double>(d, "volume");
  s.slip = numbers<std::int8_t>(d, "slip");
  s.centre = numbers<double>(d, "centre");
  const std::size_t n = s.body.size();
  if (s.offset.size() != 3 * n || s.normal.size() != 3 * n || s.depth.size() != n || s.volume.size() != n ||
      s.slip.size() != n || s.centre.size() != n)
    throw cairn::Error("points of surfaces hold arrays of different lengths: give one row for each");
  return s;
}

cairn::FluidGrains grains_of(const py::dict& d) {
  cairn::FluidGrains s;
  s.body = numbers<std::int64_t>(d, "body");
  s.diameter = numbers<double>(d, "diameter");
  s.volume = numbers<double>(d, "volume");
  s.law = numbers<std::int8_t>(d, "law");
  if (s.diameter.size() != s.body.size() || s.volume.size() != s.body.size() || s.law.size() != s.body.size())
    throw cairn::Error("grains hold arrays of different lengths: give one row for each");
  return s;
}

// Open ends: lanes of inflows, a row (6 numbers low and high, axis, sign, pressure) for each outflow.
void set_ends(cairn::Fluid& fluid, const py::dict& d) {
  cairn::FluidLanes l;
  l.axis = numbers<std::int32_t>(d, "axis");
  l.sign = numbers<double>(d, "sign");
  l.face = numbers<double>(d, "face");
  l.length = numbers<double>(d, "length");
  l.speed = numbers<double>(d, "speed");
  const std::size_t n = l.axis.size();
  if (l.sign.size() != n || l.face.size() != n || l.length.size() != n || l.speed.size() != n)
    throw cairn::Error("lanes of inflows hold arrays of different lengths: give one row for each");
  const std::vector<double> rows = numbers<double>(d, "outflow");
  if (rows.size() % 9 != 0) throw cairn::Error("an outflow has 9 numbers: give low, high, axis, sign and pressure");
  std::vector<cairn::FluidOutflow> outflows(rows.size() / 9);
  for (std::size_t k = 0; k < outflows.size(); ++k) {
    const double* row = &rows[9 * k];
    std::copy_n(row, 3, outflows[k].low.begin());
    std::copy_n(row + 3, 3, outflows[k].high.begin());
    outflows[k].axis = int(row[6]);
    outflows[k].sign = row[7];
    outflows[k].pressure = row[8];
  }
  fluid.set_ends(std::move(l), std::move(outflows), numbers<std::int32_t>(d, "lane"));
}

// Points below sides of meshes, and the measure of the side at the foot of each.
std::pair<cairn::FluidSkin, std::vector<double>> skin_of(const py::dict& d) {
  cairn::FluidSkin s;
  s.first_node = numbers<std::int64_t>(d, "first_node");
  s.slip = numbers<std::int8_t>(d, "slip");
  s.most = py::cast<std::int64_t>(d["most"]);
  s.mesh = numbers<std::int32_t>(d, "mesh");
  s.node = numbers<std::int32_t>(d, "node");
  s.weight = numbers<double>(d, "weight");
  s.along = numbers<double>(d, "along");
  s.across = numbers<double>(d, "across");
  s.depth = numbers<double>(d, "depth");
  s.volume = numbers<double>(d, "volume");
  s.behind = numbers<double>(d, "behind");
  std::vector<double> size = numbers<double>(d, "size");
  const std::size_t n = s.mesh.size(), wide = n * std::size_t(s.most);
  if (s.slip.size() != s.first_node.size() || s.node.size() != wide || s.weight.size() != wide ||
      s.along.size() != wide || s.across.size() != wide || s.depth.size() != n || s.volume.size() != n ||
      s.behind.size() != n || size.size() != n)
    throw cairn::Error("points of meshes hold arrays of different lengths: give one row for each");
  for (const std::int32_t k : s.mesh)
    if (k < 0 || std::size_t(k) >= s.first_node.size())
      throw cairn::Error("a point names mesh " + std::to_string(k) + ", which is not there: give numbers from 0");
  for (const std::int32_t k : s.node)
    if (k < 0) throw cairn::Error("a point names node " + std::to_string(k) + ": give numbers from 0");
  return {std::move(s), std::move(size)};
}

cairn::Fluid& fluid_of(Simulation& s) {
  if (!s.fluid) throw cairn::Error("this scene has no fluid: give cn.fluid(...) to Scene.add");
  return *s.fluid;
}

py::array rows(const std::vector<double>& values, int components, int keep) {
  const auto n = py::ssize_t(values.size() / std::size_t(components));
  py::array_t<double> out({n, py::ssize_t(keep)});
  for (py::ssize_t i = 0; i < n; ++i)
    for (py::ssize_t c = 0; c < keep; ++c) out.mutable_at(i, c) = values[std::size_t(i * components + c)];
  return out;
}

template <class T>
py::array line(const std::vector<T>& values) {
  return py::array_t<T>(py::ssize_t(values.size()), values.data());
}

// Calls gauge(place) for places (n, 3) relative to the origin of the scene.
template <class Gauge>
py::array at_places(const Input<double>& place, Gauge&& gauge) {
  std::vector<double> found(std::size_t(place.size() / 3));
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = gauge(place.data() + 3 * i);
  return line(found);
}

py::tuple points_in_ball(int dim, double radius, double spacing, int layers, bool hollow) {
  const cairn::SurfacePoints made = cairn::points_in_ball(dim, radius, spacing, layers, hollow);
  return py::make_tuple(rows(made.place, 3, dim), rows(made.normal, 3, dim), line(made.depth), line(made.volume),
                        line(made.centre));
}

py::object field(Simulation& s, const std::string& name) {
  cairn::Fluid& f = fluid_of(s);
  if (name == "position") return rows(f.position(), 3, s.scene.dim);
  if (name == "velocity") return rows(f.velocity(), 3, s.scene.dim);
  if (name == "pressure") return line(f.pressure());
  if (name == "density") return line(f.density());
  if (name == "open") return line(f.at_surface());
  if (name == "end") return line(f.ends());
  if (name == "mass") return line(f.masses());
  if (name == "porosity") return line(f.porosity());
  throw py::key_error("there is no field " + name + " of a fluid");
}

py::dict report(Simulation& s) {
  const cairn::Fluid& f = fluid_of(s);
  py::dict out;
  out["sub_steps"] = f.report.sub_steps;
  out["lists"] = f.report.lists;
  out["speed"] = f.report.speed;
  out["compression"] = f.report.compression;
  out["neighbours"] = f.report.neighbours;
  out["stable_step"] = f.stable_step(s.scene);
  out["passes"] = f.report.passes;
  out["products"] = f.report.products;
  out["misfit"] = f.report.misfit;
  out["residual"] = f.report.residual;
  out["drag_loss"] = f.report.drag_loss;
  out["volume"] = f.report.volume;
  out["volume_begin"] = f.volume_begin();
  out["back_flow"] = f.back_flow();
  out["light_factor"] = f.report.light_factor;
  out["light_body"] = f.report.light_body;
  out["came_in"] = f.passed()[0];
  out["left"] = f.passed()[1];
  out["surface_energy"] = f.surface_energy();
  out["bytes"] = f.bytes();
  return out;
}

} // namespace

void bind_fluid(py::module_& m) {
  m.def("set_fluid", [](Simulation& s, const py::dict& settings, const Input<double>& position,
                        const Input<double>& velocity, const Input<double>& pressure) {
    auto fluid = std::make_unique<cairn::Fluid>(s.scene.dim, settings_of(settings));
    const auto span = [](const Input<double>& a) { return std::span<const double>(a.data(), std::size_t(a.size())); };
    if (position.size() != 3 * pressure.size() || velocity.size() != position.size())
      throw cairn::Error(
          "position, velocity and pressure of a fluid have different lengths: give a row for each particle");
    fluid->set_particles(span(position), span(velocity), span(pressure));
    s.fluid = std::move(fluid);
  });
  m.def("set_fluid_surfaces", [](Simulation& s, const py::dict& points, const py::dict& planes, const py::dict& grains,
                                 const py::dict& skins) {
    auto [points_of_meshes, size] = skin_of(skins);
    fluid_of(s).set_surfaces(surface_of(points), surface_of(planes), grains_of(grains));
    fluid_of(s).set_skins(std::move(points_of_meshes), std::move(size));
  });
  m.def("set_fluid_ends", [](Simulation& s, const py::dict& ends) { set_ends(fluid_of(s), ends); });
  m.def("fluid_count", [](Simulation& s) { return fluid_of(s).count(); });
  m.def("fluid_field", &field);
  m.def("fluid_report", &report);
  m.def("fluid_mesh_forces",
        [](Simulation& s, std::int64_t first_node) { return line(fluid_of(s).forces_on_mesh(first_node)); });
  m.def("fluid_force", [](Simulation& s, std::int64_t body) { return fluid_of(s).force_on(body); });
  m.def("fluid_pressure_at", [](Simulation& s, const Input<double>& place) {
    return at_places(place, [&](const double* at) { return fluid_of(s).pressure_at(s.scene, at); });
  });
  m.def("fluid_level_at", [](Simulation& s, const Input<double>& place) {
    return at_places(place, [&](const double* at) { return fluid_of(s).level_at(s.scene, at); });
  });
  m.def("fluid_points_in_ball", &points_in_ball);
  m.def("natural_sound_speed", [](int dim, const py::dict& settings, const Input<double>& position,
                                  const Input<double>& velocity, const Input<double>& gravity) {
    const auto span = [](const Input<double>& a) { return std::span<const double>(a.data(), std::size_t(a.size())); };
    return cairn::natural_sound_speed(dim, settings_of(settings), span(position), span(velocity), span(gravity));
  });
}
