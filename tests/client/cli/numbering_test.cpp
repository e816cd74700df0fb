// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/numbering.h"

#include <gmock/gmock.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

#include "client/cli/base/message_json.h"
#include "client/cli/output/documents.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace ccslice::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Elements 501, 502, ... and nodes 1000, 1001, ...; the last element has the largest number that there is.
FileNumbers abaqus() {
  FileNumbers numbers{"node", "element", {}, {}};
  for (std::uint64_t i = 0; i < 20; ++i) {
    numbers.vertices.push_back(1000 + i);
    numbers.cells.push_back(501 + i);
  }
  numbers.cells.back() = std::numeric_limits<std::uint64_t>::max();
  return numbers;
}

client::ClientError refusal(const std::string& message, const std::string& ids) {
  google::rpc::ErrorInfo info;
  info.set_reason("MESH_INVERTED_CELL");
  if (!ids.empty()) (*info.mutable_metadata())["ids"] = ids;
  google::rpc::Status details;
  details.add_details()->PackFrom(info);
  return client::ClientError(grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, message, details.SerializeAsString()));
}

v1::PlanWarning& add_warning(v1::PlanSlicesResponse& plan, v1::PlanWarningKind kind, const std::string& message) {
  v1::PlanWarning& warning = *plan.add_warnings();
  warning.set_kind(kind);
  warning.set_message(message);
  return warning;
}

TEST(Numbering, TranslatesTheServersRefusals) {
  const client::ClientError told = renumbered(refusal("inside out: cells 0, 3: untangle them", "0,3"), abaqus());
  EXPECT_STREQ(told.what(), "inside out: elements 501, 504: untangle them");
  EXPECT_EQ(told.reason(), "MESH_INVERTED_CELL");
  EXPECT_EQ(told.code(), grpc::StatusCode::INVALID_ARGUMENT);
  for (const char* ids : {"", "x", "99999999999999999999", "5"}) {
    EXPECT_STREQ(renumbered(refusal("cells 0, 3", ids), abaqus()).what(), "cells 0, 3") << ids;
  }
}

TEST(Numbering, TranslatesThePlansWarnings) {
  v1::PlanSlicesResponse plan;
  v1::PlanWarning& folds = add_warning(plan, v1::PLAN_WARNING_KIND_FOLDS,
                                       "folds in 7 limit cells, one of them in control cell 2 near (1, 2, 3) mm");
  folds.add_control_cells(2);
  v1::PlanWarning& inverted =
      add_warning(plan, v1::PLAN_WARNING_KIND_INVERTED_CELLS, "2 control cells are inverted; repair the mesh");
  inverted.add_control_cells(0);
  inverted.add_control_cells(19);
  add_warning(plan, v1::PLAN_WARNING_KIND_DEVIATION, "boundary vertex 5 is 0.1 mm from its limit point");
  add_warning(plan, v1::PLAN_WARNING_KIND_MIRRORED, "vertex 5 is no finding of this kind");
  const v1::PlanSlicesResponse told = renumbered(plan, abaqus());
  EXPECT_EQ(told.warnings(0).message(), "folds in 7 limit cells, one of them in element 503 near (1, 2, 3) mm");
  EXPECT_EQ(told.warnings(1).message(),
            "2 control cells are inverted; repair the mesh (elements 501, 18446744073709551615)");
  EXPECT_EQ(told.warnings(2).message(), "boundary node 1005 is 0.1 mm from its limit point");
  EXPECT_EQ(told.warnings(3).message(), "vertex 5 is no finding of this kind");
  const std::string text = describe(plan, abaqus());
  EXPECT_THAT(text, AllOf(HasSubstr("in element 503 near"), HasSubstr("(elements 501, 18446744073709551615)"),
                          HasSubstr("boundary node 1005 is")));
  const FileNumbers numbers = abaqus();
  EXPECT_THAT(json_of(document_of(told, &numbers)),
              AllOf(HasSubstr("\"control_cells\":[0,19],\"file_cells\":[501,18446744073709551615]"),
                    HasSubstr("in element 503 near")));
  EXPECT_THAT(json_of(document_of(plan)), Not(HasSubstr("file_cells")));
}

// A server lists 32 of the 75 at most.
TEST(Numbering, DoesNotCountTheCellsThatAWarningLists) {
  v1::PlanSlicesResponse plan;
  v1::PlanWarning& inverted =
      add_warning(plan, v1::PLAN_WARNING_KIND_INVERTED_CELLS, "75 control cells are inverted; repair the mesh");
  for (std::uint32_t cell = 0; cell < 9; ++cell) inverted.add_control_cells(cell);
  const char* const told =
      "75 control cells are inverted; repair the mesh (elements 501, 502, 503, 504, 505, 506, 507, 508 and others)";
  EXPECT_EQ(renumbered(plan, abaqus()).warnings(0).message(), told);
  EXPECT_THAT(describe(plan, abaqus()), HasSubstr(told));
}

TEST(Numbering, TranslatesWhatIsSaidOfMeshes) {
  v1::MeshSummary mesh;
  mesh.add_folds()->set_control_cell(4);
  v1::LimitDeviation& deviation = *mesh.mutable_deviation();
  deviation.set_farthest_vertex(7);
  deviation.set_farthest_distance_mm(1);
  mesh.add_cell_regions()->set_name("cell 3");
  mesh.mutable_overlaps()->set_limit_cells(16);
  mesh.mutable_overlaps()->set_depth_mm(0.02);
  v1::OverlapPlace& overlap = *mesh.mutable_overlaps()->add_places();
  overlap.set_control_cell(2);
  overlap.set_other_control_cell(4);
  overlap.set_depth_mm(0.015);
  const std::string text = describe(mesh, abaqus());
  EXPECT_THAT(text, AllOf(HasSubstr("folds      element 505 at"), HasSubstr("boundary node 1007 from"),
                          HasSubstr("region     cell 3:"),
                          HasSubstr("overlaps   16 limit cells overlap others that they don't touch, by up to 0.02 mm"),
                          HasSubstr("\n             elements 503 and 505 at (0, 0, 0) mm, 0.015 mm deep")));
  EXPECT_EQ(describe_faults(mesh, abaqus()),
            text.substr(text.find("\n  folds"), text.find("\n  memory") - text.find("\n  folds")));
  EXPECT_EQ(describe_faults(v1::MeshSummary()), "");
  v1::MeshSummary cut_short;
  cut_short.mutable_overlaps()->set_more(true);
  EXPECT_THAT(describe_faults(cut_short), HasSubstr("overlaps   none found, but so many faces are close to others"));
  EXPECT_THAT(describe(deviation, abaqus()), HasSubstr("boundary node 1007 from"));
  const FileNumbers numbers = abaqus();
  EXPECT_THAT(json_of(document_of(mesh, &numbers)),
              AllOf(HasSubstr("\"control_cell\":4,\"file_cell\":505"),
                    HasSubstr("\"control_cells\":[2,4],\"file_cells\":[503,505],\"depth_mm\""),
                    HasSubstr("\"farthest_vertex\":7,\"farthest_file_vertex\":1007")));
}

}  // namespace
}  // namespace ccslice::cli
