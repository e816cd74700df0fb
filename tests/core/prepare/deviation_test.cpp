// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/deviation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/validate.h"
#include "core/mesh_authoring/sharpen.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/support/brute_force.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// The oracle: the surface alone, polygons without any volume behind them, refined by the rules of Catmull and Clark
/// with sharp edges and corners.
class Polygons {
 public:
  explicit Polygons(const ControlMesh& mesh) : points_(mesh.positions) {
    const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
    const oracle::BruteTopology topology = oracle::build_topology(brute.cells, brute.vertex_count());
    for (const oracle::BruteFace& face : topology.faces) {
      if (face.boundary) faces_.emplace_back(face.v.begin(), face.v.begin() + face.corners());
    }
    for (const auto& [a, b] : mesh.sharp_edges) sharp_[key(a, b)] = true;
    corners_.assign(points_.size(), false);
    for (const std::uint32_t v : mesh.sharp_vertices) corners_[v] = true;
  }

  /// Sums the pyramids from the origin over triangles round the middle of each face.
  double volume() const {
    double sum = 0;
    for (const Face& face : faces_) {
      const Vec3 middle = mean(face);
      for (std::size_t i = 0; i < face.size(); ++i) {
        sum += middle.dot(points_[face[i]].cross(points_[face[(i + 1) % face.size()]]));
      }
    }
    return sum / 6;
  }

  Polygons refined() const {
    const Edges edges = find_edges();
    Polygons next;
    next.points_ = vertex_points(edges);
    const std::size_t edge_begin = next.points_.size(), face_begin = edge_begin + edges.size();
    next.points_.resize(face_begin + faces_.size());
    for (const auto& [at, edge] : edges) next.points_[edge_begin + edge.number] = edge_point(at, edge);
    next.corners_ = corners_;
    next.corners_.resize(next.points_.size(), false);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      const Face& face = faces_[f];
      next.points_[face_begin + f] = mean(face);
      const auto middle = [&](std::size_t i) {
        const Edge& edge = edges.at(key(face[i], face[(i + 1) % face.size()]));
        return static_cast<std::uint32_t>(edge_begin + edge.number);
      };
      for (std::size_t i = 0; i < face.size(); ++i) {
        const std::uint32_t before = middle((i + face.size() - 1) % face.size()), after = middle(i);
        next.faces_.push_back({face[i], after, static_cast<std::uint32_t>(face_begin + f), before});
        if (sharp_.contains(key(face[i], face[(i + 1) % face.size()]))) next.sharp_[key(face[i], after)] = true;
        if (sharp_.contains(key(face[(i + face.size() - 1) % face.size()], face[i]))) {
          next.sharp_[key(face[i], before)] = true;
        }
      }
    }
    return next;
  }

 private:
  using Face = std::vector<std::uint32_t>;
  using Key = std::uint64_t;
  struct Edge {
    std::size_t number = 0;
    Vec3 face_means = Vec3::Zero();  // The sum of its two faces' means.
  };
  using Edges = std::unordered_map<Key, Edge>;

  Polygons() = default;

  static Key key(std::uint32_t a, std::uint32_t b) { return Key{std::min(a, b)} << 32 | std::max(a, b); }
  static std::array<std::uint32_t, 2> ends(Key at) { return {static_cast<std::uint32_t>(at >> 32), std::uint32_t(at)}; }

  Vec3 mean(const Face& face) const {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t v : face) sum += points_[v];
    return sum / static_cast<double>(face.size());
  }

  Edges find_edges() const {
    Edges edges;
    for (const Face& face : faces_) {
      for (std::size_t i = 0; i < face.size(); ++i) {
        Edge& edge = edges.try_emplace(key(face[i], face[(i + 1) % face.size()]), Edge{edges.size()}).first->second;
        edge.face_means += mean(face);
      }
    }
    return edges;
  }

  Vec3 edge_point(Key at, const Edge& edge) const {
    const auto [a, b] = ends(at);
    const Vec3 both = points_[a] + points_[b];
    return sharp_.contains(at) ? Vec3(both / 2) : Vec3((both + edge.face_means) / 4);
  }

  std::vector<Vec3> vertex_points(const Edges& edges) const {
    struct Sums {
      Vec3 faces = Vec3::Zero(), middles = Vec3::Zero(), sharp_ends = Vec3::Zero();
      int count = 0, sharp = 0;
    };
    std::vector<Sums> sums(points_.size());
    for (const auto& [at, edge] : edges) {
      const auto [a, b] = ends(at);
      for (const auto& [v, other] : {std::pair{a, b}, std::pair{b, a}}) {
        ++sums[v].count;
        sums[v].faces += edge.face_means / 2;  // Each face has two edges here.
        sums[v].middles += (points_[a] + points_[b]) / 2;
        if (!sharp_.contains(at)) continue;
        ++sums[v].sharp;
        sums[v].sharp_ends += points_[other];
      }
    }
    std::vector<Vec3> moved = points_;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const Sums& s = sums[v];
      if (s.count == 0 || s.sharp > 2 || corners_[v]) continue;
      if (s.sharp == 2) {
        moved[v] = (s.sharp_ends + 6 * points_[v]) / 8;
      } else {
        const double k = s.count;
        moved[v] = (s.faces / k + 2 * s.middles / k + (k - 3) * points_[v]) / k;
      }
    }
    return moved;
  }

  std::vector<Vec3> points_;
  std::vector<Face> faces_;
  std::unordered_map<Key, bool> sharp_;
  std::vector<bool> corners_;
};

/// Volumes of finer and finer polygons, whose error falls to a quarter each time, extrapolated.
double oracle_volume(const ControlMesh& mesh, int refinements) {
  Polygons polygons(mesh);
  double coarse = 0, fine = polygons.volume();
  for (int i = 0; i < refinements; ++i) {
    polygons = polygons.refined();
    coarse = std::exchange(fine, polygons.volume());
  }
  return fine + (fine - coarse) / 3;
}

Deviation deviation_of(const ControlMesh& mesh) { return prepare_solid(mesh)->summary().deviation; }

/// Without sharp features. REQUIRES: hexahedra.
ControlMesh cells_of(const ControlMesh& mesh, std::uint8_t region) {
  ControlMesh part;
  std::unordered_map<std::uint32_t, std::uint32_t> numbers;
  for (std::size_t i = 0; i < mesh.cell_vertices.size(); ++i) {
    if (mesh.cell_regions[i / 8] != region) continue;
    const std::uint32_t vertex = mesh.cell_vertices[i];
    const auto [number, is_new] = numbers.try_emplace(vertex, static_cast<std::uint32_t>(numbers.size()));
    if (is_new) part.positions.push_back(mesh.positions[vertex]);
    part.cell_vertices.push_back(number->second);
  }
  part.cell_kinds.assign(part.cell_vertices.size() / 8, CellKind::kHex);
  return part;
}

TEST(Deviation, IsNothingForABoxWhoseEdgesAreAllSharp) {
  ControlMesh mesh = oracle::box_mesh(3, 2, 1);
  oracle::sharpen_by_cells(mesh, 1);
  for (Vec3& position : mesh.positions) position += Vec3(1000, -2000, 3000);
  const Deviation deviation = deviation_of(mesh);
  EXPECT_NEAR(deviation.control_volume_mm3, 6000, 1e-8);
  EXPECT_NEAR(deviation.limit_volume_mm3, 6000, 1e-8);
  EXPECT_NEAR(deviation.farthest.distance_mm(), 0, 1e-11);
  EXPECT_TRUE(deviation.control_box.min().isApprox(Vec3(1000, -2000, 3000)));
  EXPECT_TRUE(deviation.control_box.max().isApprox(Vec3(1030, -1980, 3010)));
}

// At a corner of a cube of side a the limit is (k^2 P + 4 sum of edge neighbours + sum of face neighbours) / (k (k +
// 5)) with k = 3: a step of (4 + 2) / 24 a along each axis.
TEST(Deviation, OfACubeIsAtItsCorners) {
  const Deviation deviation = deviation_of(oracle::box_mesh(1, 1, 1));
  EXPECT_NEAR(deviation.control_volume_mm3, 1000, 1e-10);
  EXPECT_NEAR(deviation.limit_volume_mm3, oracle_volume(oracle::box_mesh(1, 1, 1), 7), 1e-4);
  EXPECT_NEAR(deviation.farthest.distance_mm(), 10 * std::sqrt(3) / 4, 1e-11);
  const Vec3 inwards = deviation.farthest.limit - deviation.farthest.position;
  EXPECT_NEAR(inwards.cwiseAbs().minCoeff(), inwards.cwiseAbs().maxCoeff(), 1e-11);
}

TEST(Deviation, HasTheVolumeOfFinePolygons) {
  for (const char* name :
       {"single_hex", "box_3", "hollow_cube", "cross_of_seven", "edge_valence_8", "vertex_link_icosahedron",
        "concave_corner", "sharp_2_hexes_dart", "sharp_3_hexes", "sharp_corner", "sharp_concave_corner", "sharp_cross",
        "tagged_corners", "single_tet", "single_wedge", "cube_of_tets", "sharp_hex_wedge_tet"}) {
    const ControlMesh& mesh = oracle::tiny_mesh(name);
    const Deviation deviation = deviation_of(mesh);
    EXPECT_NEAR(deviation.control_volume_mm3, Polygons(mesh).volume(), 1e-10 * deviation.control_volume_mm3) << name;
    EXPECT_NEAR(deviation.limit_volume_mm3, oracle_volume(mesh, 5), 2e-5 * deviation.control_volume_mm3) << name;
  }
}

TEST(Deviation, FindsTheFarthestLimitPoint) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const oracle::BruteMesh brute = oracle::to_brute_mesh(mesh);
    const oracle::BruteTopology topology = oracle::build_topology(brute.cells, brute.vertex_count());
    double most = 0;
    for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      if (!topology.vertex_on_boundary(v)) continue;
      most = std::max(most, (oracle::limit_point(brute, topology, v).head<3>() - mesh.positions[v]).norm());
    }
    const VertexLimit farthest = deviation_of(mesh).farthest;
    EXPECT_NEAR(farthest.distance_mm(), most, 1e-9) << name;
    EXPECT_TRUE(topology.vertex_on_boundary(farthest.vertex)) << name;
    EXPECT_EQ(farthest.position, mesh.positions[farthest.vertex]) << name;
    const Vec3 limit = oracle::limit_point(brute, topology, farthest.vertex).head<3>();
    EXPECT_LT((farthest.limit - limit).norm(), 1e-9) << name;
  }
}

/// The mesh that is meant, built apart: limit points, and missed vertices where they were to be.
TEST(Deviation, ComparesWithWhatAFitMissed) {
  for (const char* name : {"box_3", "sharp_hex_wedge_tet"}) {
    ControlMesh mesh = oracle::tiny_mesh(name);
    mesh.allow_folds = true;
    mesh.interpolating = true;
    validate(mesh);
    ControlMesh meant = mesh_of_limit_points(mesh);
    const std::uint32_t vertex = deviation_of(mesh).farthest.vertex;
    const Vec3 limit = meant.positions[vertex];
    const double limits_mm3 = deviation_of(meant).control_volume_mm3;
    meant.positions[vertex] += Vec3(1, -2, 3);
    mesh.missed_vertices = {{vertex, meant.positions[vertex]}};
    const Deviation found = deviation_of(mesh), expected = deviation_of(meant);
    EXPECT_EQ(found.farthest.vertex, vertex) << name;
    EXPECT_EQ(found.farthest.position, meant.positions[vertex]);
    EXPECT_LT((found.farthest.limit - limit).norm(), 1e-9);
    EXPECT_NEAR(found.farthest.distance_mm(), std::sqrt(14.0), 1e-9);
    EXPECT_NEAR(found.control_volume_mm3, expected.control_volume_mm3, 1e-9 * expected.control_volume_mm3);
    EXPECT_NEAR(found.vertex_limits_volume_mm3, limits_mm3, 1e-9 * limits_mm3);
    EXPECT_GT(std::abs(limits_mm3 / found.control_volume_mm3 - 1), 1e-3);
    EXPECT_EQ(expected.vertex_limits_volume_mm3, 0);
    EXPECT_TRUE(found.control_box.isApprox(expected.control_box));
    const Placement twice = Placement(Eigen::Scaling(2.0));
    EXPECT_NEAR(placed_deviation(*prepare_solid(mesh), twice).farthest.distance_mm(), 2 * std::sqrt(14.0), 1e-9);
  }
}

/// Cells of one region touch the boundary along a reentrant edge alone, those of another one nowhere. Fitted, they are
/// compared with the limit points of the mesh's vertices, whatever copies of them the regions have.
TEST(Deviation, ComparesFittedRegionsThatHardlyTouchTheBoundary) {
  ControlMesh mesh = oracle::box_mesh(5, 5, 5, 10, [](int i, int j, int) { return i > 0 || j > 0; });
  const CellComplex complex = validate_and_connect(mesh, {}, {}).complex;
  for (const CellId c : complex.cells()) {
    Vec3 low = Vec3::Constant(100);
    for (const VertexId v : complex.cell_vertices(c)) low = low.cwiseMin(mesh.positions[v]);
    const bool beside = low.x() < 5, opposite = low.head<2>() == Vec3(10, 10, 0).head<2>();
    mesh.cell_regions.push_back(beside ? 0 : opposite ? 1 : low == Vec3(30, 30, 30) ? 2 : 3);
  }
  mesh.cell_region_names = {"beside", "opposite", "nowhere", "rest"};
  oracle::jitter(mesh, 1, 7);
  mesh.interpolating = true;
  const SplitMesh split = split_cell_regions(mesh, complex);
  ASSERT_GT(split.mesh.vertex_count(), mesh.vertex_count());
  ControlMesh meant = mesh;
  take_from_copies(split, mesh_of_limit_points(split.mesh), meant);
  for (std::uint32_t v = 0; v < mesh.vertex_count(); v += 5) {
    if (!complex.vertex_on_boundary(VertexId{v})) continue;
    meant.positions[v] += Vec3(1, -2, 3);
    mesh.missed_vertices.push_back({v, meant.positions[v]});
  }
  const auto solid = prepare_solid(mesh);
  const Deviation& found = solid->summary().deviation;
  EXPECT_NEAR(found.control_volume_mm3, Polygons(meant).volume(), 1e-9 * found.control_volume_mm3);
  EXPECT_NEAR(found.farthest.distance_mm(), std::sqrt(14.0), 1e-9);
  for (std::uint8_t r = 0; r < 4; ++r) {
    const double volume = Polygons(cells_of(meant, r)).volume();
    EXPECT_NEAR(solid->summary().cell_regions[r].control_volume_mm3, volume, 1e-9 * volume) << int{r};
  }
}

/// A cube in a box that is sharp all over: the cube is what it would be alone, and the whole is the box.
TEST(Deviation, OfAnInterfaceIsThatOfTheRegionAlone) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  validate(mesh);
  add_sharp_features({find_sharp_edges(mesh, 40).convex, {}}, mesh);
  mesh.cell_region_names = {"shell", "core", "unused"};
  mesh.cell_regions.assign(27, 0);
  mesh.cell_regions[13] = 1;
  const auto solid = prepare_solid(mesh);
  const Deviation& found = solid->summary().deviation;
  const Deviation alone = deviation_of(cells_of(mesh, 1));
  EXPECT_NEAR(found.limit_volume_mm3, 27000, 1e-8);
  const auto& regions = solid->summary().cell_regions;
  EXPECT_NEAR(regions[1].control_volume_mm3, 1000, 1e-9);
  EXPECT_NEAR(regions[1].volume_mm3, alone.limit_volume_mm3, 1e-9);
  EXPECT_NEAR(regions[0].control_volume_mm3, 26000, 1e-8);
  EXPECT_NEAR(regions[0].volume_mm3, 27000 - alone.limit_volume_mm3, 1e-8);
  EXPECT_EQ(regions[2].control_volume_mm3, 0);
  EXPECT_TRUE(found.farthest.on_interface);
  EXPECT_NEAR(found.farthest.distance_mm(), alone.farthest.distance_mm(), 1e-9);
  const Placement twice = Placement(Eigen::Scaling(2.0));
  EXPECT_TRUE(placed_deviation(*solid, twice).farthest.on_interface);
  mesh.interpolating = true;
  EXPECT_EQ(deviation_of(mesh).rounded.count, 12u);
  mesh.missed_vertices = {{found.farthest.vertex, found.farthest.limit + Vec3(1, -2, 3)}};
  const Deviation fitted = deviation_of(mesh);
  EXPECT_TRUE(fitted.farthest.on_interface);
  EXPECT_NEAR(fitted.farthest.distance_mm(), std::sqrt(14.0), 1e-9);
}

TEST(Deviation, CountsNoMissedVerticesInside) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  mesh.interpolating = true;
  const Deviation before = deviation_of(mesh);
  const auto centre = std::find(mesh.positions.begin(), mesh.positions.end(), Vec3(10, 10, 10));
  ASSERT_NE(centre, mesh.positions.end());
  mesh.missed_vertices = {{static_cast<std::uint32_t>(centre - mesh.positions.begin()), Vec3(100, 100, 100)}};
  const Deviation after = deviation_of(mesh);
  EXPECT_EQ(after.farthest.distance_mm(), 0);
  EXPECT_EQ(after.control_volume_mm3, before.control_volume_mm3);
}

TEST(Deviation, IsPlaced) {
  const ControlMesh& mesh = oracle::tiny_mesh("sharp_hex_wedge_tet");
  Placement placement = Placement::Identity();
  placement.linear() << 0, -2, 0, 3, 0, 0.5, 0, 0, -1;
  placement.translation() = Vec3(5, 6, 7);
  ControlMesh placed = mesh;
  placed.allow_folds = true;
  for (Vec3& position : placed.positions) position = placement * position;
  const auto solid = prepare_solid(mesh);
  const Deviation found = placed_deviation(*solid, placement), expected = deviation_of(placed);
  EXPECT_NEAR(found.control_volume_mm3, expected.control_volume_mm3, 1e-9 * expected.control_volume_mm3);
  EXPECT_NEAR(found.limit_volume_mm3, expected.limit_volume_mm3, 4e-6 * expected.limit_volume_mm3);
  EXPECT_EQ(found.farthest.vertex, expected.farthest.vertex);
  EXPECT_LT((found.farthest.limit - expected.farthest.limit).norm(), 1e-9);
  EXPECT_TRUE(found.control_box.isApprox(expected.control_box));
  const Mat3 only_z = Vec3(0, 0, 1).asDiagonal();
  const VertexLimit along_z = farthest_vertex(*solid, only_z);
  const VertexLimit farthest = solid->summary().deviation.farthest;
  EXPECT_GE(std::abs((along_z.limit - along_z.position).z()), std::abs((farthest.limit - farthest.position).z()));
}

TEST(Deviation, IsMeasuredWithoutPreparing) {
  for (const char* name : {"box_3", "sharp_hex_wedge_tet", "vertex_link_icosahedron"}) {
    const ControlMesh& mesh = oracle::tiny_mesh(name);
    const LimitShape shape = measure_limit(mesh);
    const auto solid = prepare_solid(mesh);
    EXPECT_EQ(shape.deviation.limit_volume_mm3, solid->summary().deviation.limit_volume_mm3);
    EXPECT_EQ(shape.deviation.control_volume_mm3, solid->summary().deviation.control_volume_mm3);
    EXPECT_EQ(shape.deviation.farthest.vertex, solid->summary().deviation.farthest.vertex);
    EXPECT_EQ(shape.bounding_box.min(), solid->summary().bounding_box.min());
    EXPECT_EQ(shape.bounding_box.max(), solid->summary().bounding_box.max());
  }
  PrepareOptions cancelled;
  cancelled.cancel = CancellationToken::make();
  cancelled.cancel.cancel();
  EXPECT_THROW(measure_limit(oracle::tiny_mesh("box_3"), cancelled), Error);
}

}  // namespace
}  // namespace ccslice
