// Deformable bodies through the C API: from cells and from matrices, held and loaded, against rigid bodies and each
// other.
#include <algorithm>
#include <cmath>

#include "c_meshes.hpp"

namespace {

TEST_F(CMeshes, a_block_rests_on_a_floor) {
  for (const int dim : {2, 3}) {
    make(dim);
    floor(dim);
    block(dim, 2, {0, 0, 0});
    elastic(dim);
    touch(level(dim, 0));
    const int32_t number = add("block");
    start();
    settle(100);
    EXPECT_NEAR(upwards(dim) / 9810, 1, 1e-6);
    EXPECT_GT(energy("stored"), 0);
    for (const double v : mesh_field(number, "velocity")) EXPECT_NEAR(v, 0, 1e-5);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
}

TEST_F(CMeshes, blocks_rest_on_each_others_sides) {
  for (const int dim : {2, 3}) {
    make(dim);
    floor(dim);
    block(dim, 2, {0, 0, 0});
    elastic(dim);
    touch(level(dim, 0));
    touch_sides(dim, level(dim, 1));
    add("lower");
    EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "lower", rock, -1, nullptr, nullptr, &error), "lower");
    if (dim == 2)
      block(dim, 2, {0.1, 1});
    else
      block(dim, 2, {0.1, 0.05, 1});
    elastic(dim);
    touch(level(dim, 1));
    add("upper");
    start();
    settle(400);
    double on_floor = 0;
    const auto bodies = contact("bodies"), impulse = contact("impulse");
    for (std::size_t i = 0; i < bodies.size() / 2; ++i)
      if (bodies[2 * i + 1] == 0) on_floor += impulse[dim * i + dim - 1] / 2e-3;
    EXPECT_NEAR(on_floor / 9810, 2, 5e-3) << dim; // it still sways a little
    EXPECT_NEAR((upwards(dim) - on_floor) / 9810, 1, 5e-3) << dim;
    const int64_t part = 1;
    EXPECT_REFUSED(cairn_simulation_remove_bodies(simulation, 1, &part, &error), "lower");
    EXPECT_REFUSED(cairn_simulation_set_option(simulation, "strategy", "smooth_dem", &error), "SmoothDEM");
    EXPECT_EQ(cairn_simulation_set_number(simulation, "project_positions", 1, &error), 0) << error.message;
    settle(5);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
}

// Held below, pulled above: the answer of a rod without transverse strain.
TEST_F(CMeshes, held_and_loaded_nodes_give_the_strain_of_a_rod) {
  make(2);
  const double none[] = {0, 0};
  ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
  block(2, 2, {0, 0});
  EXPECT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", cells(2), cell.data(), 1e7, 0, 1000, 1, 0.5, &error), 0);
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 5e-3, 0, &error), 0);
  const auto bottom = level(2, 0), top = level(2, 1);
  ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(bottom.size()), bottom.data(), 3, &error), 0) << error.message;
  EXPECT_REFUSED(cairn_mesh_hold(mesh, 1, bottom.data(), 4, &error), "mask");
  const int32_t number = add("rod");
  start();
  std::vector<double> force(node.size(), 0.0);
  for (std::size_t k = 0; k < top.size(); ++k) force[2 * std::size_t(top[k]) + 1] = k == 1 ? 500.0 : 250.0;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, force.data(), nullptr, nullptr, &error), 0);
  EXPECT_REFUSED(cairn_simulation_load_mesh(simulation, 4, force.data(), nullptr, nullptr, &error), "mesh 4");
  settle(200);
  const auto u = mesh_field(number, "displacement");
  for (const int32_t i : top) EXPECT_NEAR(u[2 * std::size_t(i) + 1] / (1000 / (1e7 * 0.5)), 1, 1e-4);
}

// A column of neo-Hookean rubber between walls that hold it across, P = mu (s - 1/s) + lambda ln s / s.
TEST_F(CMeshes, a_material_of_solids_by_its_name) {
  make(2);
  const double none[] = {0, 0};
  ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
  block(2, 2, {0, 0});
  const char* const names[] = {"young", "poisson"};
  const char* const wrong[] = {"young", "nu"};
  const double values[] = {1e7, 0.3};
  const auto cells_of = [&](const char* material, const char* const* of, const char* kinematics, double thickness) {
    return cairn_mesh_add_solid_cells(mesh, "q4", cells(2), cell.data(), material, 2, of, values, 1000, kinematics,
                                      "strain", 0, thickness, &error);
  };
  EXPECT_REFUSED(cells_of("rubber", names, "total_lagrangian", 1), "neo_hookean");
  EXPECT_REFUSED(cells_of("neo_hookean", wrong, "total_lagrangian", 1), "nu");
  EXPECT_REFUSED(cells_of("neo_hookean", names, "small", 1), "large strains");
  EXPECT_REFUSED(cells_of("neo_hookean", names, "huge", 1), "logarithmic");
  ASSERT_EQ(cells_of("neo_hookean", names, "total_lagrangian", 0.5), 0) << error.message;
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 5e-3, 0, &error), 0);
  const auto bottom = level(2, 0), top = level(2, 1);
  ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(bottom.size()), bottom.data(), 3, &error), 0) << error.message;
  const auto all = int64_t(node.size() / 2);
  std::vector<int32_t> every(static_cast<std::size_t>(all));
  for (int64_t i = 0; i < all; ++i) every[std::size_t(i)] = int32_t(i);
  ASSERT_EQ(cairn_mesh_hold(mesh, all, every.data(), 1, &error), 0) << error.message;
  const int32_t number = add("rubber");
  start();
  std::vector<double> force(node.size(), 0.0);
  const double total = -1e6; // on a width of 1 and a thickness of 1/2: P = -2e6
  for (std::size_t k = 0; k < top.size(); ++k) force[2 * std::size_t(top[k]) + 1] = total * (k == 1 ? 0.5 : 0.25);
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, force.data(), nullptr, nullptr, &error), 0);
  settle(400);
  const auto u = mesh_field(number, "displacement");
  const double mu = 1e7 / 2.6, lambda = 1e7 * 0.3 / (1.3 * 0.4);
  const double s = 1 + u[2 * std::size_t(top[0]) + 1];
  EXPECT_LT(s, 0.9);
  EXPECT_NEAR((mu * (s - 1 / s) + lambda * std::log(s) / s) / -2e6, 1, 1e-4);
}

// Soil under its own weight, pressed as much as it weighs: linear cells by a stress at their points, a material's by
// one of each cell, as pressures vary over it.
TEST_F(CMeshes, a_layer_that_has_its_stress_stays) {
  for (const bool solid : {false, true}) {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
    make(2);
    const double down[] = {0, -10};
    ASSERT_EQ(cairn_scene_set_gravity(scene, down, &error), 0);
    block(2, 3, {0, 0});
    if (solid) {
      const char* const names[] = {"young", "poisson"};
      const double values[] = {1e7, 0.3};
      ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", cells(2), cell.data(), "neo_hookean", 2, names, values, 1000,
                                           "total_lagrangian", "strain", 0, 1, &error),
                0)
          << error.message;
    } else {
      elastic(2);
    }
    int64_t count = 0;
    ASSERT_EQ(cairn_mesh_stress_points(mesh, 0, nullptr, &count, &error), 0);
    std::vector<double> at(std::size_t(count), 0.0), stress;
    ASSERT_EQ(cairn_mesh_stress_points(mesh, count, at.data(), &count, &error), 0) << error.message;
    for (std::size_t p = 0; p < at.size() / 2; ++p) {
      const double down_there = 1e4 * (at[2 * p + 1] - 1);
      stress.insert(stress.end(), {0.5 * down_there, down_there, 0.5 * down_there, 0, 0, 0});
    }
    EXPECT_REFUSED(cairn_mesh_set_initial_stress(mesh, 5, stress.data(), &error), "stress is of 5 cells; give that of");
    ASSERT_EQ(cairn_mesh_set_initial_stress(mesh, count / 2, stress.data(), &error), 0) << error.message;
    const auto bottom = level(2, 0);
    ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(bottom.size()), bottom.data(), 3, &error), 0) << error.message;
    std::vector<int32_t> every(node.size() / 2);
    for (std::size_t i = 0; i < every.size(); ++i) every[i] = int32_t(i);
    ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(every.size()), every.data(), 1, &error), 0) << error.message;
    const int32_t number = add("layer");
    start();
    const double stored = energy("stored"); // by the stress alone, before there is a balance: p^2 (3/2 - 5/2 nu) / 2 E
    if (!solid) { EXPECT_NEAR(stored / 1.25, 1, 1e-12); }
    steps(1, 1e-2);
    EXPECT_GT(stored, 1);
    EXPECT_NEAR(energy("stored") / stored, 1, 1e-9);
    steps(4, 1e-2);
    for (const double u : mesh_field(number, "displacement")) EXPECT_NEAR(u, 0, 1e-14);
    EXPECT_LT(energy("kinetic"), 1e-20);
  }
}

// A block that is thrown into itself faster than a whole step can follow, under a force on its top that grows with
// time: in parts its loads go along a line, as a routine that says that line gives them; and nothing else has the
// simulation meanwhile.
struct Pushed {
  const std::vector<int32_t>* top;
  int32_t mesh = 0;
  std::size_t dofs = 0;
  std::vector<double> times;
  std::string refused;
  std::vector<double> at(double time) const {
    std::vector<double> force(dofs, 0.0);
    for (const int32_t i : *top) force[std::size_t(2 * i)] = 4e5 * time;
    return force;
  }
};

TEST_F(CMeshes, a_step_is_made_in_parts) {
  const char* const names[] = {"young", "poisson"};
  const double values[] = {1e5, 0.3};
  make(2);
  block(2, 2, {0, 0});
  ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", cells(2), cell.data(), "neo_hookean", 2, names, values, 1000,
                                       "total_lagrangian", "strain", 0, 1, &error),
            0)
      << error.message;
  const auto bottom = level(2, 0);
  ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(bottom.size()), bottom.data(), 3, &error), 0) << error.message;
  std::vector<double> speed(node.size(), 0.0);
  for (std::size_t i = 1; i < node.size(); i += 2) speed[i] = -14 * node[i];
  ASSERT_EQ(cairn_mesh_set_motion(mesh, nullptr, speed.data(), &error), 0);
  const int32_t number = add("rubber");
  const auto top = level(2, 1);
  std::vector<double> ways[2];
  for (const bool given : {false, true}) {
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_passes", 4, &error), 0) << error.message;
    EXPECT_REFUSED(cairn_simulation_set_number(simulation, "cut_back", 31, &error), "cut_back");
    ASSERT_EQ(cairn_simulation_set_number(simulation, "cut_back", 9, &error), 0) << error.message;
    Pushed pushed{&top, number, node.size(), {}, {}};
    const auto heard = [](cairn_simulation* s, double time, double h, void* context) {
      auto& all = *static_cast<Pushed*>(context);
      all.times.insert(all.times.end(), {time, h});
      cairn_error told{};
      cairn_simulation_load_mesh(s, all.mesh, all.at(time).data(), all.at(time + h).data(), nullptr, &told);
      if (cairn_simulation_step(s, h, nullptr, &told) != 0) all.refused = told.message;
    };
    const double h = 0.08;
    ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, pushed.at(0).data(), pushed.at(h).data(), nullptr, &error),
              0)
        << error.message;
    if (given) { ASSERT_EQ(cairn_simulation_before_parts(simulation, heard, &pushed, &error), 0) << error.message; }
    cairn_report report{};
    ASSERT_EQ(cairn_simulation_step(simulation, h, &report, &error), 0) << error.message;
    EXPECT_EQ(report.time, h);
    EXPECT_EQ(report.step, 1);
    double parts = 0;
    ASSERT_EQ(cairn_simulation_report(simulation, "sub_steps", &parts, &error), 0) << error.message;
    EXPECT_GT(parts, 1);
    ways[given] = mesh_field(number, "displacement");
    if (!given) {
      cairn_simulation_destroy(simulation);
      simulation = nullptr;
      continue;
    }
    const std::vector<double>& times = pushed.times;
    ASSERT_GE(times.size(), 2 * std::size_t(parts));
    EXPECT_EQ(times[0], 0);
    EXPECT_EQ(times[1], 0.04);
    EXPECT_EQ(times[times.size() - 2] + times.back(), 0.08);
    EXPECT_NE(pushed.refused.find("cairn_simulation_step stands between steps, and one is being made"),
              std::string::npos);
  }
  ASSERT_EQ(ways[0].size(), ways[1].size());
  ASSERT_GT(ways[0].size(), 0u);
  double most = 0;
  for (const double way : ways[0]) most = std::max(most, std::abs(way));
  EXPECT_GT(std::abs(ways[0][std::size_t(2 * top[0])]), 0.01 * most); // the force pushes it aside
  for (std::size_t i = 0; i < ways[0].size(); ++i) EXPECT_NEAR(ways[0][i], ways[1][i], 1e-9 * most);
}

// The same body from matrices that a program puts together from those of its elements.
TEST_F(CMeshes, matrices_of_elements_give_the_same_steps) {
  make(2);
  const double young = 1e7, poisson = 0.3, lame = young * poisson / (1.3 * 0.4), shear = young / 2.6;
  const double elasticity[] = {lame + 2 * shear, lame, 0, lame, lame + 2 * shear, 0, 0, 0, shear};
  block(2, 1, {0, 0});
  std::vector<double> corners, stiffness(64), mass(64);
  for (const int32_t i : cell) corners.insert(corners.end(), {node[2 * i], node[2 * i + 1]});
  ASSERT_EQ(cairn_element_matrices("q4", 1, corners.data(), 1000, elasticity, stiffness.data(), mass.data(), &error), 0)
      << error.message;
  std::vector<int64_t> start_of{0};
  std::vector<int32_t> row;
  std::vector<double> m, k;
  for (int c = 0; c < 8; ++c) {
    for (int r = c; r < 8; ++r) {
      // where dofs of nodes stand among those of the cell: its last two nodes are in the other order
      const int order[] = {0, 1, 3, 2}, ec = 2 * order[c / 2] + c % 2, er = 2 * order[r / 2] + r % 2;
      row.push_back(r);
      m.push_back(mass[8 * ec + er]);
      k.push_back(stiffness[8 * ec + er]);
    }
    start_of.push_back(int64_t(row.size()));
  }
  elastic(2, young);
  EXPECT_REFUSED(cairn_mesh_set_matrices(mesh, start_of.data(), row.data(), m.data(), k.data(), nullptr, &error),
                 "cells");
  add("cells");
  block(2, 1, {0, 0});
  const std::vector<int32_t> wrong(row.size(), 0);
  EXPECT_REFUSED(cairn_mesh_set_matrices(mesh, start_of.data(), wrong.data(), m.data(), k.data(), nullptr, &error),
                 "row[1]");
  std::vector<double> damping = k;
  for (double& c : damping) c *= 5e-3;
  ASSERT_EQ(cairn_mesh_set_matrices(mesh, start_of.data(), row.data(), m.data(), k.data(), damping.data(), &error), 0)
      << error.message;
  add("matrices");
  start();
  const std::vector<double> force = {0, 0, 1e3, 0, -2e3, 0, 0, 5e2};
  for (const int32_t which : {0, 1})
    ASSERT_EQ(cairn_simulation_load_mesh(simulation, which, force.data(), nullptr, nullptr, &error), 0);
  steps(20);
  const auto one = mesh_field(0, "velocity"), other = mesh_field(1, "velocity");
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(one[i], other[i], 1e-12 * std::abs(one[i]) + 1e-13);
}

TEST_F(CMeshes, what_no_mesh_can_be_is_refused_by_name) {
  make(2);
  block(2, 1, {0, 0});
  EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "empty", rock, -1, nullptr, nullptr, &error), "cells");
  const std::vector<int32_t> turned(cell.rbegin(), cell.rend()), far{0, 1, 2, 9};
  EXPECT_REFUSED(cairn_mesh_add_elastic_cells(mesh, "q5", 1, cell.data(), 1, 0, 1, 0, 1, &error), "q4");
  EXPECT_REFUSED(cairn_mesh_add_elastic_cells(mesh, "hex8", 1, cell.data(), 1, 0, 1, 0, 1, &error), "dimensions");
  EXPECT_REFUSED(cairn_mesh_add_elastic_cells(mesh, "q4", 1, far.data(), 1, 0, 1, 0, 1, &error), "node 9");
  EXPECT_REFUSED(cairn_mesh_add_elastic_cells(mesh, "q4", 1, cell.data(), 1, 0.5, 1, 0, 1, &error), "poisson");
  EXPECT_REFUSED(cairn_mesh_touch_nodes(mesh, 1, &far[3], &error), "node 9");
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 1, turned.data(), 1, 0, 1, 0, 1, &error), 0) << error.message;
  EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "turned", rock, -1, nullptr, nullptr, &error), "inside out");
  EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "rock", rock, -1, nullptr, nullptr, &error), "rock");
  start();
  EXPECT_EQ(cairn_simulation_bodies(simulation), 0); // nothing of it stays
}

} // namespace
