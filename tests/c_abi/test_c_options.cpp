// Options, fields, energy and changes between steps, by name.
#include "c_scene.hpp"

namespace {

struct COptions : CScene {
  int64_t grain = -1;
  void pile(int dim) {
    make(dim);
    floor(dim);
    std::vector<double> place(dim, 0.0);
    place[dim - 1] = 0.5;
    grain = body(place, 2, 0.25);
    ball(dim, grain, 0.5, rock);
  }
};

TEST_F(COptions, are_set_and_read_by_name) {
  pile(2);
  start();
  char room[64];
  ASSERT_EQ(cairn_simulation_set_option(simulation, "solver", "auto", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_get_option(simulation, "solver", sizeof room, room, &error), 0);
  EXPECT_STREQ(room, "auto");
  ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-9, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "warm_start", 0, &error), 0) << error.message;
  double value = 0;
  ASSERT_EQ(cairn_simulation_get_number(simulation, "tol", &value, &error), 0);
  EXPECT_EQ(value, 1e-9);
  ASSERT_EQ(cairn_simulation_get_number(simulation, "margin", &value, &error), 0);
  EXPECT_TRUE(std::isnan(value));
  steps(5);
  EXPECT_EQ(text("status"), "converged");
  EXPECT_EQ(text("hint"), "");
}

TEST_F(COptions, out_of_range_are_refused_by_name_and_change_nothing) {
  pile(2);
  start();
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "tol", 0, &error), "tol is 0");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "theta", 0.4, &error), "[0.5, 1]");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "theta", std::nan(""), &error), "theta");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "threads", 1.5, &error), "whole");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "min_iter", 2000, &error), "max_iter");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "colour", 1, &error), "theta, solver, tol");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "skin", 1, &error), "skin");
  EXPECT_REFUSED(cairn_simulation_set_option(simulation, "solver", "magic", &error), "nlgs");
  EXPECT_REFUSED(cairn_simulation_set_option(simulation, "strategy", "magic", &error), "smooth_dem");
  EXPECT_REFUSED(cairn_simulation_set_option(simulation, "tol", "small", &error), "number");
  double value = 0;
  for (const auto& [name, standard] : {std::pair("tol", 1e-4), std::pair("theta", 0.5), std::pair("min_iter", 1.0)}) {
    ASSERT_EQ(cairn_simulation_get_number(simulation, name, &value, &error), 0);
    EXPECT_EQ(value, standard);
  }
}

TEST_F(COptions, smooth_dem_is_chosen_by_name) {
  pile(3);
  const double spring[] = {1e5, 0.3, 0.5, 0.5};
  ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "LinearSpring", 4, spring, &error), 0) << error.message;
  start();
  EXPECT_REFUSED(cairn_simulation_step(simulation, 1e-5, nullptr, &error), "SmoothDEM");
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "smooth_dem", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "overlap", 0.02, &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "theta", 0.5, &error), "skin");
  steps(1000, 1e-5);
  EXPECT_EQ(text("status"), "explicit");
  ASSERT_EQ(cairn_simulation_contacts(simulation), 1);
  const auto impulse = contact("impulse"), gap = contact("gap");
  EXPECT_LT(gap[0], 0);
  EXPECT_GT(impulse[2], 0);
  EXPECT_GT(energy("stored"), 0);
  EXPECT_REFUSED(cairn_simulation_contact_field(simulation, "beta", 0, nullptr, nullptr, &error), "beta");
}

// Springs at the contacts: at rest, the weight is their stiffness times the overlap.
TEST_F(COptions, granular_element_and_carpenter_are_chosen_by_name) {
  pile(2);
  start();
  char room[64];
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "granular_element", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "stiffness", 1e5, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_get_option(simulation, "strategy", sizeof room, room, &error), 0);
  EXPECT_STREQ(room, "granular_element");
  steps(2000);
  EXPECT_NEAR(contact("gap")[0] * 1e5 / (-2 * 9.81), 1, 1e-3);
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "carpenter", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "stiffness", infinite, &error), 0) << error.message;
  steps(2); // the overlap is pushed out in one step, and the bodies fly on
  EXPECT_GT(contact("gap")[0], -1e-9);
}

TEST_F(COptions, integrators_are_chosen_by_name_and_bring_options_of_their_own) {
  pile(2);
  start();
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "beta", 0.3, &error), "theta");
  EXPECT_REFUSED(cairn_simulation_set_option(simulation, "integrator", "magic", &error), "generalised_alpha");
  ASSERT_EQ(cairn_simulation_set_option(simulation, "integrator", "newmark", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "beta", 0.3025, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "gamma", 0.6, &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "gamma", 0.4, &error), "[0.5, 1]");
  steps(10);
  EXPECT_EQ(text("status"), "converged");
  EXPECT_NEAR(contact("impulse")[1], 2 * 9.81 * 1e-3, 1e-12);
  EXPECT_REFUSED(cairn_simulation_set_option(simulation, "strategy", "event_drive", &error), "event_driven");
}

TEST_F(COptions, event_driven_is_chosen_by_name) {
  pile(2);
  const double law[] = {0, 0.5, 0, 1};
  ASSERT_EQ(cairn_scene_set_law(scene, rock, rock, "Restitution", 4, law, &error), 0) << error.message;
  start();
  const double up[] = {0, 2, 0};
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "velocity", 1, &grain, up, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "event_driven", &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "impacts", 0, &error), "impacts is 0");
  ASSERT_EQ(cairn_simulation_set_number(simulation, "impacts", 50, &error), 0) << error.message;
  steps(500); // up and down again, and the first bounce, half as high
  double events = -1;
  ASSERT_EQ(cairn_simulation_report(simulation, "events", &events, &error), 0) << error.message;
  EXPECT_EQ(events, 0);
  EXPECT_NEAR(field("velocity")[3 * grain + 1], 1 - 9.81 * (0.5 - 2 * 2 / 9.81), 1e-10);
}

TEST_F(COptions, contacts_and_energy_are_read_by_name) {
  pile(2);
  start();
  steps(10);
  const double weight = 2 * 9.81 * 1e-3;
  EXPECT_NEAR(contact("impulse")[1], weight, 1e-12);
  EXPECT_NEAR(contact("impulse_local")[0], weight, 1e-12);
  EXPECT_EQ(contact("bodies"), (std::vector<double>{double(grain), 0}));
  EXPECT_EQ(contact("status"), std::vector<double>{1});
  EXPECT_EQ(contact("normal"), (std::vector<double>{0, 1}));
  EXPECT_EQ(contact("key").size(), 4u);
  EXPECT_REFUSED(cairn_simulation_contact_field(simulation, "colour", 0, nullptr, nullptr, &error), "gap, normal");
  EXPECT_NEAR(energy("kinetic"), 0, 1e-12);
  EXPECT_REFUSED(cairn_simulation_energy(simulation, "heat", nullptr, &error), "NULL");
  double value = -2;
  EXPECT_REFUSED(cairn_simulation_energy(simulation, "heat", &value, &error), "kinetic, potential");
  ASSERT_EQ(cairn_simulation_report(simulation, "contacts", &value, &error), 0);
  EXPECT_EQ(value, 1);
  ASSERT_EQ(cairn_simulation_report(simulation, "worst_contact", &value, &error), 0);
  EXPECT_GE(value, -1);
}

TEST_F(COptions, forces_damping_gravity_and_removal_act_between_steps) {
  pile(2);
  const int64_t other = body({3, 5}, 2, 0.25);
  ball(2, other, 0.5, rock);
  start();
  const double sideways[] = {4, 2 * 9.81, 0}; // and it floats
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 1, &other, sideways, &error), 0) << error.message;
  steps(10);
  EXPECT_NEAR(field("velocity")[3 * other], 4 / 2.0 * 0.01, 1e-12);
  EXPECT_NEAR(field("velocity")[3 * other + 1], 0, 1e-12);
  const double damping[] = {1e3};
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "damping", 1, &other, damping, &error), 0) << error.message;
  steps(50);
  EXPECT_NEAR(field("velocity")[3 * other], 4 / 2.0 / 1e3, 1e-6); // force over damping
  const double up[] = {0, 9.81}, wrong[] = {-1.0};
  EXPECT_REFUSED(cairn_simulation_set_body_field(simulation, "damping", 1, &other, wrong, &error), "damping[0]");
  EXPECT_REFUSED(cairn_simulation_set_body_field(simulation, "mass", 1, &other, damping, &error), "mass");
  ASSERT_EQ(cairn_simulation_remove_bodies(simulation, 1, &other, &error), 0) << error.message;
  EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 0);
  EXPECT_REFUSED(cairn_simulation_remove_bodies(simulation, 1, &other, &error), "no body");
  ASSERT_EQ(cairn_simulation_set_gravity(simulation, up, &error), 0);
  steps(10);
  EXPECT_GT(field("velocity")[3 * grain + 1], 0.05);
  const double place[] = {0, 20}, mass[] = {1}, inertia[] = {0.1}, radius[] = {0.5};
  int64_t late = -1;
  ASSERT_EQ(cairn_simulation_add_bodies(simulation, 1, place, nullptr, nullptr, mass, inertia, &late, &error), 0);
  EXPECT_EQ(late, other + 1);
  ASSERT_EQ(cairn_simulation_add_contactors(simulation, "disk", 1, &late, &rock, radius, nullptr, nullptr, nullptr,
                                            nullptr, &error),
            0)
      << error.message;
  steps(2);
  EXPECT_EQ(cairn_simulation_bodies(simulation), 3);
}

TEST_F(COptions, groups_that_do_not_meet_pass_through_each_other) {
  make(2);
  floor(2);
  int32_t ghost = -1;
  EXPECT_REFUSED(cairn_scene_set_rule(scene, "ghosts", "*", nullptr, 0, nullptr, &error), "ghosts");
  ASSERT_EQ(cairn_scene_add_material_of_group(scene, "rock", "ghosts", &ghost, &error), 0) << error.message;
  ASSERT_EQ(cairn_scene_set_rule(scene, "ghosts", "*", nullptr, 0, nullptr, &error), 0) << error.message;
  const int64_t solid = body({0, 0.5}), through = body({0, 0.5});
  ball(2, solid, 0.5, rock);
  ball(2, through, 0.5, ghost);
  start();
  steps(20);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
  EXPECT_LT(field("velocity")[3 * through + 1], -0.15);
  EXPECT_NEAR(field("velocity")[3 * solid + 1], 0, 1e-12);
}

TEST_F(COptions, a_cell_carries_over_its_border) {
  make(2);
  const double gravity[] = {0, 0}, lengths[] = {4, 0}, nowhere[] = {-1, 0};
  ASSERT_EQ(cairn_scene_set_gravity(scene, gravity, &error), 0);
  EXPECT_REFUSED(cairn_scene_set_cell(scene, nowhere, nullptr, 0, 0, &error), "lengths[0]");
  EXPECT_REFUSED(cairn_scene_set_cell(scene, lengths, nullptr, 1, 0, &error), "lean");
  ASSERT_EQ(cairn_scene_set_cell(scene, lengths, nullptr, 0, 0, &error), 0) << error.message;
  const int64_t left = body({0.5, 0}), right = body({3.5, 0}); // they touch over the border
  ball(2, left, 0.5, rock);
  ball(2, right, 0.5, rock);
  const int64_t both[] = {left, right};
  const double together[] = {-1, 0, 0, 1, 0, 0};
  EXPECT_REFUSED(cairn_scene_set_body_field(scene, "velocity", 1, nullptr, together, &error), "there are 2");
  ASSERT_EQ(cairn_scene_set_body_field(scene, "velocity", 2, both, together, &error), 0) << error.message;
  start();
  steps(2);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
  EXPECT_NEAR(field("velocity")[0], 0, 1e-9);
}

} // namespace
