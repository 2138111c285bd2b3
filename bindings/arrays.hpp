// Fields as numpy arrays: rows are items, columns components.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <string>

#include "base/call.hpp"
#include "base/field.hpp"

namespace py = pybind11;

template <class T>
using Input = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class T>
std::span<const T> span_of(const std::optional<Input<T>>& a) {
  return a ? std::span<const T>(a->data(), std::size_t(a->size())) : std::span<const T>();
}

inline std::vector<py::ssize_t> shape_of(std::int64_t items, int components) {
  if (components == 1) return {items};
  return {items, components};
}

// A copy in the order given.
template <class T>
py::array ordered(const cairn::Field<T>& field, const std::vector<std::int32_t>& order) {
  py::array_t<T> out(shape_of(field.active ? order.size() : 0, field.components));
  T* to = out.mutable_data();
  if (field.active)
    for (const std::int32_t i : order) {
      std::memcpy(to, field[i], field.components * sizeof(T));
      to += field.components;
    }
  return out;
}

// The live memory itself, in internal order.
template <class T>
py::array live(cairn::Field<T>& field, std::int64_t count, py::object owner) {
  return py::array_t<T>(shape_of(field.active ? count : 0, field.components), field.values.data(), owner);
}

template <class T>
void assign(cairn::Field<T>& field, const py::array& values, const std::vector<std::int32_t>& order) {
  const Input<T> in = Input<T>::ensure(values);
  if (!in || std::size_t(in.size()) != order.size() * field.components)
    throw cairn::Error(std::string(field.name) + " holds " + std::to_string(values.size()) + " numbers; " +
                       std::to_string(order.size()) + " items of " + std::to_string(field.components) + " need " +
                       std::to_string(order.size() * field.components));
  const T* from = in.data();
  for (const std::int32_t i : order) {
    std::memcpy(field[i], from, field.components * sizeof(T));
    from += field.components;
  }
}

template <class Holder>
py::array get_ordered(Holder& holder, const std::string& name, const std::vector<std::int32_t>& order) {
  py::object found = py::none();
  holder.for_each_field([&](auto& field) {
    if (field.name == name) found = ordered(field, order);
  });
  if (found.is_none()) throw py::key_error("there is no field " + name);
  return found;
}

template <class Holder>
py::array get_live(Holder& holder, const std::string& name, py::object owner) {
  py::object found = py::none();
  holder.for_each_field([&](auto& field) {
    if (field.name == name) found = live(field, holder.count, owner);
  });
  if (found.is_none()) throw py::key_error("there is no field " + name);
  return found;
}

template <class Holder>
py::list describe(Holder& holder) {
  py::list rows;
  holder.for_each_field([&](auto& field) {
    using T = typename std::decay_t<decltype(field)>::value_type;
    py::dict row;
    row["name"] = field.name;
    row["unit"] = field.unit;
    row["stage"] = field.stage;
    row["meaning"] = field.meaning;
    row["components"] = field.components;
    row["active"] = field.active;
    row["bytes"] = field.active ? field.components * sizeof(T) : 0;
    rows.append(row);
  });
  return rows;
}

void bind_body_rows(py::module_& m);
void bind_bulk(py::module_& m);
void bind_called(py::module_& m);
void bind_expressions(pybind11::module_& m);
void bind_elements(py::module_& m);
void bind_files(py::module_& m);
void bind_frames(py::module_& m);
void bind_laws(py::module_& m);
void bind_meshes(py::module_& m);
void bind_networks(py::module_& m);
void bind_problems(py::module_& m);
void bind_reference(py::module_& m);
void bind_scene(py::module_& m);
void bind_simulation(py::module_& m);
void bind_soe(py::module_& m);
