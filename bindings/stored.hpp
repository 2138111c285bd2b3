// Conversion between stored values of files and Python's dicts, numpy arrays, numbers and texts.
#pragma once
#include "arrays.hpp"
#include "files/stored_tree.hpp"

cairn::StoredArray stored_of(const py::handle& value); // TypeError for unsupported types
py::object numpy_of(const cairn::StoredArray& array);
cairn::StoredValue tree_of(const py::dict& tree, const std::string& place = "");
py::dict dict_of(const cairn::StoredValue& tree);
