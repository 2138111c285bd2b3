#pragma once
#include <memory>

#include "arrays.hpp"
#include "fe/bulk_model.hpp"

// blocks: a dict of each kind of cells, see python/cairn/model/bulk.py.
std::unique_ptr<cairn::BulkModel> bulk_model_of(int dim, const Input<double>& place, const py::list& blocks);
