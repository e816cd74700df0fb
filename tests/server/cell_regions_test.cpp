// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

/// A block of 10 mm of 4 x 4 x 4 cells, the lower half and the upper half.
v1::ControlMesh halves() {
  v1::ControlMesh mesh = make_box(4, 10);
  mesh.add_cell_region_names("core");
  mesh.add_cell_region_names("shell");
  for (int cell = 0; cell < mesh.cell_kinds_size(); ++cell) {
    double height = 0;
    for (int corner = 8 * cell; corner < 8 * cell + 8; ++corner) {
      height += mesh.positions_mm(3 * static_cast<int>(mesh.cell_vertices(corner)) + 2) / 8;
    }
    mesh.add_cell_regions(height < 5 ? 0 : 1);
  }
  return mesh;
}

class CellRegions : public ::testing::Test {
 protected:
  v1::SliceRangeRequest request_for(const v1::ControlMesh& mesh) {
    v1::SliceRangeRequest request = slice_request(server_.upload_good(mesh), 0.25, 0, 40);
    request.mutable_job()->clear_planes();
    request.mutable_job()->add_planes()->mutable_cell_regions();
    request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    return request;
  }

  TestServer server_;
};

TEST_F(CellRegions, AreShownByTheirNumbersAndNamed) {
  v1::SliceRangeRequest request = request_for(halves());
  request.mutable_job()->mutable_planes(0)->set_sample_type(v1::SAMPLE_TYPE_UINT8);
  const Sliced sliced = server_.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  ASSERT_EQ(sliced.header.cell_region_names_size(), 2);
  EXPECT_EQ(sliced.header.cell_region_names(1), "shell");
  for (const auto& [index, end] : sliced.ends) {
    const std::string& plane = sliced.planes.at(index)[0];
    ASSERT_EQ(plane.size(), 1600u);
    const char number = index < 20 ? 1 : 2;
    EXPECT_EQ(static_cast<std::uint64_t>(std::count(plane.begin(), plane.end(), number)), end.voxel_count());
    EXPECT_EQ(static_cast<std::uint64_t>(std::count(plane.begin(), plane.end(), 0)), 1600 - end.voxel_count());
  }
}

TEST_F(CellRegions, TakeTheSmallestSampleTypeAndPictures) {
  v1::SliceRangeRequest request = request_for(halves());
  for (const v1::PlaneEncoding encoding : {v1::PLANE_ENCODING_PNG, v1::PLANE_ENCODING_PNG_RGBA}) {
    request.mutable_job()->mutable_planes(0)->set_encoding(encoding);
    const Sliced sliced = server_.slice(request);
    ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    EXPECT_EQ(sliced.header.planes(0).sample_type(), v1::SAMPLE_TYPE_UINT2);
    EXPECT_TRUE(sliced.header.planes(0).has_cell_regions());
  }
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_TIFF);
  EXPECT_EQ(server_.slice_failure(request).reason, "ENCODING_UNSUPPORTED");
}

TEST_F(CellRegions, AreInTheSummary) {
  const std::string id = server_.upload_good(halves());
  v1::GetMeshRequest request;
  request.set_mesh_id(id);
  v1::GetMeshResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.stub().GetMesh(&context, request, &response).ok());
  ASSERT_EQ(response.mesh().cell_regions_size(), 2);
  EXPECT_EQ(response.mesh().cell_regions(0).name(), "core");
  EXPECT_EQ(response.mesh().cell_regions(0).control_cells(), 32u);
  EXPECT_NEAR(response.mesh().cell_regions(0).volume_mm3() + response.mesh().cell_regions(1).volume_mm3(),
              response.mesh().deviation().limit_volume_mm3(), 1e-6);
  EXPECT_NEAR(
      response.mesh().cell_regions(0).control_volume_mm3() + response.mesh().cell_regions(1).control_volume_mm3(),
      response.mesh().deviation().control_volume_mm3(), 1e-6);
}

TEST_F(CellRegions, HaveContoursOfTheirOwn) {
  v1::ControlMesh mesh = make_box(4, 10);  // Left and right, so that every layer has both.
  mesh.add_cell_region_names("core");
  mesh.add_cell_region_names("shell");
  for (int cell = 0; cell < mesh.cell_kinds_size(); ++cell) {
    double x = 0;
    for (int corner = 8 * cell; corner < 8 * cell + 8; ++corner) {
      x += mesh.positions_mm(3 * static_cast<int>(mesh.cell_vertices(corner))) / 8;
    }
    mesh.add_cell_regions(x < 5 ? 0 : 1);
  }
  v1::SliceRangeRequest request = request_for(mesh);
  request.mutable_job()->clear_planes();
  request.mutable_job()->mutable_contours()->set_by_cell_region(true);
  request.set_first_layer(20);
  request.set_layer_count(1);
  grpc::ClientContext context;
  const auto stream = server_.stub().SliceRange(&context, request);
  v1::SliceRangeResponse message;
  std::vector<double> area_of(3);
  std::uint64_t loops = 0;
  while (stream->Read(&message)) {
    EXPECT_EQ(message.header().cell_region_names_size(), message.has_header() ? 2 : 0);
    if (message.has_layer_begin()) loops = message.layer_begin().contour_loops();
    for (const v1::ContourPiece& piece : message.contour_chunk().pieces()) {
      EXPECT_TRUE(piece.last());
      EXPECT_EQ(piece.faces_size() + piece.parameters_size(), 0);
      ASSERT_TRUE(piece.cell_region() == 1 || piece.cell_region() == 2);
      const int points = piece.points_mm_size() / 2;
      for (int i = 0; i < points; ++i) {
        const int next = (i + 1) % points;
        area_of[piece.cell_region()] += (piece.points_mm(2 * i) * piece.points_mm(2 * next + 1) -
                                         piece.points_mm(2 * next) * piece.points_mm(2 * i + 1)) /
                                        2;
      }
    }
  }
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_EQ(loops, 2u);
  EXPECT_GT(area_of[1], 25);
  EXPECT_NEAR(area_of[1], area_of[2], 1e-6);  // The box is symmetric.

  part_of(*request.mutable_job()).set_mesh_id(server_.upload_good(make_box(4, 10)));
  const Failure failure = server_.slice_failure(request);
  EXPECT_EQ(failure.reason, "CELL_REGIONS_MISSING");
  EXPECT_EQ(failure.field, "job.contours.by_cell_region");
}

v1::CellRegionMap map_of(const std::string& region, const std::string& material) {
  v1::CellRegionMap map;
  map.set_cell_region(region);
  map.mutable_map()->set_material(material);
  return map;
}

v1::Printing soft_and_hard() {
  v1::Printing printing;
  for (const auto& [name, rgba] : {std::pair("soft", 0xff8000ffu), std::pair("hard", 0x0080ffffu)}) {
    v1::PrintMaterial& material = *printing.add_materials();
    material.set_name(name);
    material.set_rgba(rgba);
  }
  return printing;
}

TEST_F(CellRegions, ArePrintedByTheirOwnMaps) {
  v1::SliceRangeRequest request = request_for(halves());
  *request.mutable_job()->mutable_printing() = soft_and_hard();
  *request.mutable_job()->mutable_printing()->add_cell_region_maps() = map_of("shell", "soft");
  *request.mutable_job()->mutable_printing()->add_cell_region_maps() = map_of("core", "hard");
  request.mutable_job()->add_planes()->mutable_materials();
  for (v1::PlaneSpec& plane : *request.mutable_job()->mutable_planes()) {
    plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
    plane.set_encoding(v1::PLANE_ENCODING_RAW);
  }
  const Sliced sliced = server_.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.printing().cell_region_maps(1).cell_region(), "core");
  EXPECT_EQ(sliced.header.printing().cell_region_maps(1).map().material(), "hard");
  std::size_t voxels = 0;
  for (const auto& [index, planes] : sliced.planes) {
    for (std::size_t k = 0; k < planes[0].size(); ++k) {
      voxels += planes[0][k] != 0;
      ASSERT_EQ(planes[1][k], planes[0][k] == 0 ? 0 : 3 - planes[0][k]) << index << ' ' << k;
    }
  }
  EXPECT_GT(voxels, 20000u);
}

TEST_F(CellRegions, ThatNobodyKnowsHaveNoMaps) {
  v1::SliceRangeRequest request = request_for(halves());
  *request.mutable_job()->mutable_printing() = soft_and_hard();
  *request.mutable_job()->mutable_printing()->add_cell_region_maps() = map_of("shelf", "soft");
  request.mutable_job()->add_planes()->mutable_materials();
  const Failure unknown = server_.slice_failure(request);
  EXPECT_EQ(unknown.reason, "CELL_REGION_UNKNOWN");
  EXPECT_EQ(unknown.field, "job.printing.cell_region_maps[0].cell_region");
  *request.mutable_job()->mutable_printing()->mutable_cell_region_maps(0) = map_of("Shell", "soft");
  EXPECT_THAT(server_.slice_failure(request).message, testing::HasSubstr("; did you mean \"shell\"?"));
  *request.mutable_job()->mutable_printing()->mutable_cell_region_maps(0) = map_of("shell", "soft");
  const Failure unmapped = server_.slice_failure(request);
  EXPECT_EQ(unmapped.reason, "MATERIAL_MAP_MISSING");
  EXPECT_EQ(unmapped.field, "job.printing.map");
}

TEST_F(CellRegions, AreMissedWhereThereAreNone) {
  const Failure failure = server_.slice_failure(request_for(make_box(2, 10)));
  EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(failure.reason, "CELL_REGIONS_MISSING");
  EXPECT_EQ(failure.field, "job.planes[0].cell_regions");
}

}  // namespace
}  // namespace ccslice::server
