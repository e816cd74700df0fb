// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

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
    request.clear_planes();
    request.add_planes()->mutable_cell_regions();
    request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    return request;
  }

  TestServer server_;
};

TEST_F(CellRegions, AreShownByTheirNumbersAndNamed) {
  v1::SliceRangeRequest request = request_for(halves());
  request.mutable_planes(0)->set_sample_type(v1::SAMPLE_TYPE_UINT8);
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
    request.mutable_planes(0)->set_encoding(encoding);
    const Sliced sliced = server_.slice(request);
    ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    EXPECT_EQ(sliced.header.planes(0).sample_type(), v1::SAMPLE_TYPE_UINT2);
    EXPECT_TRUE(sliced.header.planes(0).has_cell_regions());
  }
  request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_TIFF);
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
}

TEST_F(CellRegions, AreMissedWhereThereAreNone) {
  const Failure failure = server_.slice_failure(request_for(make_box(2, 10)));
  EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(failure.reason, "CELL_REGIONS_MISSING");
  EXPECT_EQ(failure.field, "planes[0].cell_regions");
}

}  // namespace
}  // namespace ccslice::server
