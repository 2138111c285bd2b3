// Materials of the program's own, UMATs, through the C API: tests/python/solids/umat.f90, Hooke's law or plasticity,
// linked here.
#include <algorithm>
#include <cmath>

#include "c_scene.hpp"

extern "C" void umat_(void);

namespace {

// The arguments of a UMAT from the second on, as far as they are of no use here.
using Umat = void(double* stress, double*, double*, double*, double*, double*, double*, double*, double*, double*,
                  const double*, const double*, const double*, const double*, const double*, const double*,
                  const double*, const double*, const char*, const int*, const int*, const int*, const int*,
                  const double*, const int*, const double*, const double*, double*, const double*, const double*,
                  const double*, const int*, const int*, const int*, const int*, const int*, const int*, std::size_t);

void gives_no_number(double* stress, double*, double*, double*, double*, double*, double*, double*, double*, double*,
                     const double*, const double*, const double*, const double*, const double*, const double*,
                     const double*, const double*, const char*, const int*, const int*, const int*, const int*,
                     const double*, const int*, const double*, const double*, double*, const double*, const double*,
                     const double*, const int*, const int*, const int*, const int*, const int*, const int*,
                     std::size_t) {
  stress[0] = NAN;
}
Umat* const checked = gives_no_number;
cairn_umat* const gives_up = reinterpret_cast<cairn_umat*>(checked);

// Springs of the strain, whose routine looks at the energy of the simulation that calls it.
cairn_simulation* looked_at = nullptr;
int within = 0, deepest = 0;
void looks(double* stress, double*, double* tangent, double* elastic, double*, double*, double*, double*, double*,
           double*, const double* strain, const double* change, const double*, const double*, const double*,
           const double*, const double*, const double*, const char*, const int*, const int*, const int* components,
           const int*, const double*, const int*, const double*, const double*, double*, const double*, const double*,
           const double*, const int*, const int*, const int*, const int*, const int*, const int*, std::size_t) {
  for (int k = 0; k < *components; ++k) {
    tangent[(*components + 1) * k] = 300;
    stress[k] += 300 * change[k];
    *elastic += (stress[k] - 150 * change[k]) * change[k] + 0 * strain[k];
  }
  if (!looked_at || within > 3) return;
  deepest = std::max(deepest, ++within);
  double stored = 0;
  EXPECT_EQ(cairn_simulation_energy(looked_at, "stored", &stored, nullptr), 0);
  --within;
}
Umat* const looking = looks;

// Springs that record their arguments in the plane; the same for plane stress alone.
int direct_stresses = 0, all_stresses = 0;
double stretch_across = 0;
void tells(double* stress, double*, double* tangent, double*, double*, double*, double*, double*, double*, double*,
           const double*, const double* change, const double*, const double*, const double*, const double*,
           const double*, const double*, const char*, const int* direct, const int*, const int* components, const int*,
           const double*, const int*, const double*, const double*, double*, const double*, const double*,
           const double* gradient, const int*, const int*, const int*, const int*, const int*, const int*,
           std::size_t) {
  for (int k = 0; k < *components; ++k) {
    tangent[(*components + 1) * k] = 300;
    stress[k] += 300 * change[k];
  }
  direct_stresses = *direct;
  all_stresses = *components;
  stretch_across = gradient[8];
}
Umat* const telling = tells;

struct CMaterials : CScene {
  cairn_mesh* mesh = nullptr;
  ~CMaterials() override { cairn_mesh_destroy(mesh); }
  // Two squares side by side, held on the left, drawn on the right at a speed.
  void bar(const char* material, std::vector<double> values, const char* const* names, double speed, double stress = 0,
           const char* plane = "strain") {
    const double place[] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
    const int32_t cell[] = {0, 1, 4, 3, 1, 2, 5, 4}, left[] = {0, 3}, right[] = {2, 5};
    cairn_mesh_destroy(mesh);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    mesh = nullptr;
    simulation = nullptr;
    scene = nullptr;
    make(2);
    const double none[2] = {};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    ASSERT_EQ(cairn_mesh_create(2, 6, place, &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 2, cell, material, int32_t(values.size()), names, values.data(),
                                         1e-3, "small", plane, 0, 1, &error),
              0)
        << error.message;
    const double given[12] = {stress, 0, 0, 0, 0, 0, stress, 0, 0, 0, 0, 0};
    ASSERT_EQ(stress > 0 ? cairn_mesh_set_initial_stress(mesh, 2, given, &error) : 0, 0) << error.message;
    ASSERT_EQ(cairn_mesh_hold(mesh, 2, left, 3, &error), 0);
    ASSERT_EQ(cairn_mesh_hold(mesh, 2, right, 1, &error), 0);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "bar", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_tol", 1e-12, &error), 0) << error.message;
    double held[12] = {};
    held[4] = held[10] = speed;
    ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0) << error.message;
  }
  std::vector<double> displacement() {
    std::vector<double> u(12);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, 0, "displacement", 12, u.data(), &n, &error), 0);
    return u;
  }
};

TEST_F(CMaterials, a_umat_of_the_program_is_the_material_of_the_list) {
  ASSERT_EQ(cairn_give_material("two_in_one", umat_, 1, &error), 0) << error.message;
  const char* const names[] = {"young", "poisson", "yield_stress"};
  for (const double yield : {0.0, 2.0}) {
    bar("two_in_one", {300, 0.3, yield}, nullptr, 0.5);
    steps(40, 1e-3);
    const auto u = displacement();
    const double spent = energy("dissipated_material");
    EXPECT_EQ(text("status"), "converged");
    if (yield > 0)
      bar("j2_plasticity", {300, 0.3, yield}, names, 0.5);
    else
      bar("isotropic_elastic", {300, 0.3}, names, 0.5);
    steps(40, 1e-3);
    const auto other = displacement();
    for (std::size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(u[i] / u[4], other[i] / u[4], 1e-9);
    EXPECT_EQ(spent > 1e-2 * energy("in_play"), yield > 0);
    EXPECT_NEAR(spent, energy("dissipated_material"), 1e-9 * energy("in_play"));
  }
}

TEST_F(CMaterials, what_a_umat_refuses_is_told_and_undone) {
  ASSERT_EQ(cairn_give_material("two_in_one", umat_, 1, &error), 0) << error.message;
  bar("two_in_one", {300, 0.3, 0}, nullptr, 0.5);
  steps(5, 1e-3);
  const auto before = displacement();
  double held[12] = {}; // beyond half of strain it calls XIT
  held[4] = held[10] = 2000;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0);
  EXPECT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), cairn_wrong_input);
  const std::string said = error.message;
  for (const char* word : {"bar", "quad cell", "two_in_one calls XIT"})
    EXPECT_NE(said.find(word), std::string::npos) << said;
  EXPECT_EQ(displacement(), before);
  held[4] = held[10] = 0.2;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0);
  steps(5, 1e-3);
  // a property that is no number
  const double nan = std::nan("");
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, props[] = {nan, 0.3, 0};
  const int32_t cell[] = {0, 1, 2, 3};
  cairn_mesh* wrong = nullptr;
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &wrong, &error), 0);
  ASSERT_EQ(cairn_mesh_add_solid_cells(wrong, "q4", 1, cell, "two_in_one", 3, nullptr, props, 1, "small", "strain", 0,
                                       1, &error),
            0)
      << error.message;
  EXPECT_REFUSED(cairn_scene_add_mesh(scene, wrong, "wrong", rock, -1, nullptr, nullptr, &error),
                 "quad cell 0 with nodes");
  cairn_mesh_destroy(wrong);
}

// Meshes that are there keep the routine and the states that they came in with.
TEST_F(CMaterials, a_routine_that_takes_a_name_leaves_the_meshes_that_had_it) {
  ASSERT_EQ(cairn_give_material("taken", umat_, 1, &error), 0) << error.message;
  bar("taken", {300, 0.3, 2}, nullptr, 0.5);
  steps(20, 1e-3);
  const auto alone = displacement();
  const double spent = energy("dissipated_material");
  bar("taken", {300, 0.3, 2}, nullptr, 0.5);
  steps(10, 1e-3);
  ASSERT_EQ(cairn_give_material("taken", gives_up, 40, &error), 0) << error.message;
  steps(10, 1e-3);
  EXPECT_EQ(displacement(), alone);
  EXPECT_EQ(energy("dissipated_material"), spent);
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, props[] = {300, 0.3, 0};
  const int32_t cell[] = {0, 1, 2, 3};
  const auto add = [&] {
    cairn_mesh* one = nullptr;
    EXPECT_EQ(cairn_mesh_create(2, 4, place, &one, &error), 0);
    EXPECT_EQ(
        cairn_mesh_add_solid_cells(one, "q4", 1, cell, "taken", 3, nullptr, props, 1, "small", "strain", 0, 1, &error),
        0)
        << error.message;
    const int32_t code = cairn_scene_add_mesh(scene, one, "one", rock, -1, nullptr, nullptr, &error);
    cairn_mesh_destroy(one);
    return code;
  };
  EXPECT_EQ(add(), cairn_wrong_input);   // of the routine that the name has now
  for (int turn = 0; turn < 301; ++turn) // and as often as one likes
    ASSERT_EQ(cairn_give_material("taken", turn % 2 ? gives_up : umat_, turn % 2 ? 40 : 1, &error), 0) << error.message;
  EXPECT_EQ(add(), 0) << error.message;
}

TEST_F(CMaterials, a_routine_for_plane_stress_is_called_for_it_alone) {
  cairn_umat* const springs = reinterpret_cast<cairn_umat*>(telling);
  ASSERT_EQ(cairn_give_plane_stress_material("springs", springs, 0, &error), 0) << error.message;
  bar("springs", {}, nullptr, 0.5, 0, "stress");
  steps(10, 1e-3);
  EXPECT_EQ(text("status"), "converged");
  EXPECT_EQ(direct_stresses, 2);
  EXPECT_EQ(all_stresses, 3);
  EXPECT_LT(stretch_across, 1);
  EXPECT_GT(stretch_across, 0.9);
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1};
  const int32_t cell[] = {0, 1, 2, 3};
  cairn_mesh* wrong = nullptr;
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &wrong, &error), 0);
  EXPECT_REFUSED(cairn_mesh_add_solid_cells(wrong, "q4", 1, cell, "springs", 0, nullptr, place, 1, "small", "strain", 0,
                                            1, &error),
                 "springs is a routine for plane stress, NDI = 2: give plane='stress'");
  cairn_mesh_destroy(wrong);
  // the same routine under another name is called for bodies of any plane
  ASSERT_EQ(cairn_give_material("all_springs", springs, 0, &error), 0) << error.message;
  bar("all_springs", {}, nullptr, 0.5, 0, "stress");
  EXPECT_EQ(direct_stresses, 3);
  EXPECT_EQ(all_stresses, 4);
  EXPECT_REFUSED(cairn_give_plane_stress_material("none", nullptr, 0, &error), "routine is NULL");
  EXPECT_REFUSED(cairn_plug_plane_stress_material("./no_such_library.so", "none", nullptr, 0, &error),
                 "cannot be loaded");
}

// Before the first step a look at the energy asks the materials, but not while a step does.
TEST_F(CMaterials, a_routine_may_look_at_the_simulation_that_calls_it) {
  ASSERT_EQ(cairn_give_material("looks", reinterpret_cast<cairn_umat*>(looking), 0, &error), 0) << error.message;
  std::vector<double> seen;
  for (const bool looked : {false, true}) {
    bar("looks", {}, nullptr, 0.5, 3);
    energy("stored");
    looked_at = looked ? simulation : nullptr;
    deepest = 0;
    steps(1, 1e-3);
    looked_at = nullptr;
    EXPECT_EQ(deepest, looked);
    seen.push_back(displacement()[3]);
    seen.push_back(energy("stored"));
  }
  EXPECT_EQ(seen[2], seen[0]);
  EXPECT_EQ(seen[3], seen[1]);
}

TEST_F(CMaterials, what_is_missing_is_told) {
  EXPECT_REFUSED(cairn_give_material("none", nullptr, 0, &error), "routine is NULL");
  EXPECT_REFUSED(cairn_give_material("j2_plasticity", umat_, 0, &error), "is a material of the list");
  EXPECT_REFUSED(cairn_give_material("", umat_, 0, &error), "1 to 80 characters");
  EXPECT_REFUSED(cairn_give_material("two_in_one", umat_, -1, &error), "-1 states");
  EXPECT_REFUSED(cairn_plug_material("./no_such_library.so", "none", nullptr, 0, &error), "cannot be loaded");
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, values[] = {1, 0.3};
  const int32_t cell[] = {0, 1, 2, 3};
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
  EXPECT_REFUSED(cairn_mesh_add_solid_cells(mesh, "q4", 1, cell, "neo_hookean", 2, nullptr, values, 1, "small",
                                            "strain", 0, 1, &error),
                 "names is NULL");
}

} // namespace
