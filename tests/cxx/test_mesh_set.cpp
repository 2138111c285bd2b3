// Contact points on a deformable body: their nodes and weights.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "contactors/hull_shapes.hpp"
#include "contactors/shapes.hpp"
#include "meshes/mesh_set.hpp"
#include "scene/scene.hpp"
#include "scheme.hpp"

namespace {

// One quadrilateral that is not flat, of four nodes, and the two facets it is cut into.
struct Face {
  cairn::Scene scene{3};
  cairn::MeshSet set;
  const std::vector<double> corner{0, 0, 0, 2, 0.1, 0.05, 1.8, 1.5, 0, -0.2, 1, 0.05};

  Face() {
    const std::vector<double> mass(4, 1.0);
    const std::int32_t number = scene.new_mesh();
    scene.add_nodes(number, corner, {}, mass);
    scene.add_parts(number, 2);
    const std::vector<std::int32_t> triangle{0, 1, 2, 0, 2, 3};
    const std::vector<std::int64_t> facets{4, 5}, nodes{2};
    const std::int32_t material[] = {0};
    const cairn::SurfaceFacets made = cairn::add_facets(scene.contactors.hulls, corner, triangle);
    const std::vector<std::int32_t> hull{made.first, made.first + 1};
    const std::vector<double> radius{0};
    scene.add_contactors({2, cairn::Shape::facet, facets, material, {}, {}, {}, hull});
    scene.add_contactors({1, cairn::Shape::sphere, nodes, material, radius, {}, {}});
    cairn::MeshModel m;
    m.dim = 3;
    m.reference = corner;
    m.mass.n = 12;
    m.mass.start.clear();
    for (std::int64_t i = 0; i <= 12; ++i) m.mass.start.push_back(i);
    for (std::int32_t i = 0; i < 12; ++i) m.mass.row.push_back(i), m.mass.value.push_back(1);
    m.stiffness = m.damping = m.mass;
    m.held.assign(12, 0);
    m.number = number;
    m.node_ids = {0, 1, 2, 3};
    m.side_ids = {4, 5};
    m.side_nodes = {0, 1, 2, -1, 0, 2, 3, -1};
    m.face_nodes = {0, 1, 2, 3, 0, 1, 2, 3};
    m.around = {0, 1, 2, 0, 2, 3};
    m.around_start = {0, 3, 6};
    set.meshes.emplace_back(std::move(m));
    set.place(scene.nodes, scene.contactors);
  }
  // Shares of the nodes at (a, b) of the square from -1 to 1.
  static std::vector<double> shares(double a, double b) {
    return {(1 - a) * (1 - b) / 4, (1 + a) * (1 - b) / 4, (1 + a) * (1 + b) / 4, (1 - a) * (1 + b) / 4};
  }
  // A point of the face, lifted by `height` along the normal of the facet.
  std::vector<double> point(const std::vector<double>& share, const std::vector<std::int32_t>& facet,
                            double height) const {
    double e[3], f[3], x[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      e[k] = corner[3 * facet[1] + k] - corner[3 * facet[0] + k];
      f[k] = corner[3 * facet[2] + k] - corner[3 * facet[0] + k];
      for (int i = 0; i < 4; ++i) x[k] += share[i] * corner[3 * i + k];
    }
    const double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
    const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    return {x[0] + height * n[0] / size, x[1] + height * n[1] / size, x[2] + height * n[2] / size};
  }
};

TEST(MeshSet, SharesOfAQuadrilateralAreThoseOfItsShapeFunctions) {
  const Face face;
  const double places[][2] = {{0.3, -0.6}, {-0.2, 0.4}, {0, 0}, {-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (const auto& at : places)
    for (const std::int32_t side : {0, 1}) {
      const std::vector<std::int32_t> facet =
          side == 0 ? std::vector<std::int32_t>{0, 1, 2} : std::vector<std::int32_t>{0, 2, 3};
      const auto want = Face::shares(at[0], at[1]);
      const auto point = face.point(want, facet, 0.2);
      const cairn::Mapping m = face.set.mapping(face.scene.nodes, side, point.data());
      double sum = 0;
      for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(m.node[i], i);
        EXPECT_NEAR(m.weight[i], want[i], 1e-13); // of a sum of 1
        sum += m.weight[i];
      }
      EXPECT_NEAR(sum, 1, 1e-15);
    }
}

TEST(MeshSet, ANodeRestsOnItself) {
  const Face face;
  const double somewhere[3] = {7, 7, 7};
  const cairn::Mapping m = face.set.mapping(face.scene.nodes, 2, somewhere);
  EXPECT_EQ(m.node[0], 2);
  EXPECT_EQ(m.weight[0], 1);
  EXPECT_EQ(m.node[1], -1);
}

TEST(MeshSet, MappedContactorsStandWhereTheirNodesAreAndNoBodyDoes) {
  Face face;
  EXPECT_EQ(face.scene.bodies.count, 0);
  EXPECT_EQ(face.scene.nodes.count, 4);
  for (int k = 0; k < 3; ++k) face.scene.nodes.position[2][k] += 3;
  face.set.follow(face.scene.nodes, face.scene.contactors);
  ASSERT_EQ(face.set.mapped().contactor, (std::vector<std::int32_t>{0, 1, 2}));
  for (int k = 0; k < 3; ++k) {
    const double moved = face.corner[6 + k] + 3;
    EXPECT_NEAR(face.set.mapped().centre[k], (face.corner[k] + face.corner[3 + k] + moved) / 3, 1e-14);
    EXPECT_EQ(face.set.mapped().centre[6 + k], moved);
  }
  for (std::int64_t c = 0; c < 3; ++c) EXPECT_EQ(*face.scene.contactors.body[c], -1);
  face.scene.renumber(); // contactors find their mesh again
  face.set.place(face.scene.nodes, face.scene.contactors);
  EXPECT_EQ(face.set.mapped().contactor.size(), 3u);
}

TEST(MeshSet, NodesHaveASetOfTheirOwnAndContactorsOnThemStandLast) {
  Face face;
  const std::vector<double> mass{1}, inertia{1, 1, 1}, position{5, 5, 5}, radius{1};
  const std::int64_t id = face.scene.add_bodies({1, position, {}, {}, mass, inertia});
  EXPECT_EQ(id, 6); // numbers are of bodies, nodes and other parts of meshes together
  const std::int32_t material[] = {0};
  face.scene.add_contactors({1, cairn::Shape::sphere, {&id, 1}, material, radius, {}, {}});
  EXPECT_EQ(*face.scene.contactors.body[3], 0);
  face.scene.put_meshes_in_order();
  EXPECT_EQ(*face.scene.contactors.body[0], 0);
  face.set.place(face.scene.nodes, face.scene.contactors);
  EXPECT_EQ(face.set.mapped().contactor, (std::vector<std::int32_t>{1, 2, 3}));
  EXPECT_EQ(face.scene.internal(id), 0);
  EXPECT_EQ(face.scene.node(2), 2);
  EXPECT_THROW(face.scene.internal(2), std::exception);
}

// A mesh goes along the curve as a whole: its nodes keep the order that its matrices have.
TEST(MeshSet, NodesOfAMeshStayInItsOrderWhereverTheCurvePutsIt) {
  cairn::Scene scene(2);
  const std::vector<double> mass(3, 1.0), far{5, 5, -5, 5, 5, -5}, near{0, 0, 0.1, 0, 0, 0.1};
  for (const auto* place : {&far, &near, &far}) scene.add_nodes(scene.new_mesh(), *place, {}, mass);
  scene.renumber();
  for (std::int64_t first = 0; first < 9; first += 3)
    for (std::int64_t k = 0; k < 3; ++k) {
      EXPECT_EQ(*scene.nodes.id[first + k], *scene.nodes.id[first] + k);
      EXPECT_EQ(*scene.nodes.mesh[first + k], *scene.nodes.mesh[first]);
    }
  const std::vector<std::int64_t> second{3, 4, 5};
  scene.remove_bodies(second);
  EXPECT_EQ(scene.nodes.count, 6);
  EXPECT_EQ(scene.find_node(4), -1);
}

TEST(MeshSet, CompliancesOfNodesThatAreTouchedLaterAreThoseOfAllAtOnce) {
  Face one, two;
  const double gravity[3] = {0, 0, 0};
  for (Face* face : {&one, &two})
    face->set.meshes[0].free_velocity(face->scene.nodes, gravity, scheme_of(0.5, 1), true);
  cairn::MeshBody &a = one.set.meshes[0], &b = two.set.meshes[0];
  a.touch({0, 1, 2});
  b.touch({0});
  b.touch({1, 2});
  ASSERT_EQ(a.contact_nodes(), 3);
  ASSERT_EQ(b.contact_nodes(), 3);
  const double want = 1 / (1 + 0.5 + 0.25); // M + h C + h^2 K, all of them the unit matrix
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) {
      EXPECT_NEAR(a.compliance()[a.leading() * i + j], i == j ? want : 0, 1e-15);
      EXPECT_NEAR(b.compliance()[b.leading() * i + j], a.compliance()[a.leading() * i + j], 1e-15);
    }
}

} // namespace
