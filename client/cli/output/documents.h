// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages of the service as documents and as text.

#pragma once

#include <string>

#include "ccslice/v1/info.pb.h"
#include "ccslice/v1/mesh.pb.h"
#include "client/cli/base/messages.h"
#include "client/client.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

v1::VoxelGrid document_of(const v1::Grid& grid);
v1::DeliveredBox document_of(const v1::VoxelBox& region);
v1::RowLayout document_of(const v1::PictureLayout& layout);
v1::Printer document_of(const v1::PrinterProfile& printer);
v1::ServerDocument document_of(const v1::GetServerInfoResponse& info);
/// `numbers`, here and below: those of the file that the mesh came from stand beside ids. Null: nobody knows them.
v1::ServerMesh document_of(const v1::MeshSummary& mesh, const FileNumbers* numbers = nullptr);
v1::PlanDocument document_of(const v1::PlanSlicesResponse& plan, const FileNumbers* numbers = nullptr);
/// What --full adds to the document of a file.
v1::FileDocument document_of_limit(const v1::MeshSummary& limit, const FileNumbers& numbers);

/// "part_clipped" of PLAN_WARNING_KIND_PART_CLIPPED.
std::string kind_text(v1::PlanWarningKind kind);
/// The name of an encoding, as client/plane_encodings.h has it.
std::string encoding_name(v1::PlaneEncoding value);
double seconds_of(const google::protobuf::Duration& duration);

/// "24 x 16 x 8 mm, from (0, 0, 0)".
std::string describe(const v1::Box3& box);
/// Lines for people, without the last line end. Those of a deviation begin with one.
std::string describe(const v1::LimitDeviation& deviation);
std::string describe(const v1::CellRegion& region);
std::string describe(const v1::MeshSummary& mesh);
/// Says only where the limit of a mesh folds, may fold, or overlaps itself. Begins with a line end, or is empty.
std::string describe_faults(const v1::MeshSummary& mesh);
std::string describe(const v1::GetServerInfoResponse& info);
std::string describe(const v1::PlanSlicesResponse& plan);
/// Says how many copies were moved to whole voxels, and how far.
std::string describe(const v1::SnappedCopies& snapped);

}  // namespace ccslice::cli
