// Terms of networks in the report of a simulation.
#pragma once
#include <pybind11/pybind11.h>

#include "simulation/simulation.hpp"

void add_network_reports(pybind11::dict& out, const cairn::Simulation& s);
