"""Options of a simulation: strategies, contact solvers and integrators."""
