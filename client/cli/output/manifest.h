// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages of the service as JSON members and as text. JSON has plain numbers and the field names of the contract.

#pragma once

#include <google/protobuf/struct.pb.h>

#include <cstdint>
#include <span>
#include <string>

#include "ccslice/v1/info.pb.h"
#include "ccslice/v1/mesh.pb.h"
#include "client/cli/base/json.h"
#include "client/cli/output/job_journal.h"
#include "client/client.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

/// What manifest.json says of its own form: 2 since colours and numbers of `printing` have the form of all others.
inline constexpr int kManifestVersion = 2;

/// The text of manifest.json. `plan`: the job's, whose warnings it has as they are. `layers` is a JSON array.
std::string manifest(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                     const v1::PlanSlicesResponse& plan, const JobKey& job, const std::string& layers);

/// What is wrong with a document that was read as manifest.json, as the rest of a sentence that its path begins. Empty
/// if it is one that this version reads.
std::string fault_of_manifest(const google::protobuf::Struct& document);

/// One of a manifest's materials. `rgba`: its colour's text.
void add_material(const std::string& name, const std::string& rgba, std::uint64_t voxels, JsonWriter& json);

/// Write a value as a JSON object.
void add_json(const v1::Grid& grid, JsonWriter& json);
void add_json(const v1::VoxelBox& region, JsonWriter& json);
void add_json(const v1::PrinterProfile& printer, JsonWriter& json);
void add_json(const v1::PictureLayout& layout, JsonWriter& json);
void add_json(const v1::Box3& box, JsonWriter& json);
/// `numbers`, here and below: those of the file that the mesh came from stand beside ids. Null: nobody knows them.
void add_json(const v1::LimitDeviation& deviation, JsonWriter& json, const FileNumbers* numbers = nullptr);
void add_json(const v1::CellRegion& region, JsonWriter& json);
void add_json(const v1::MeshSummary& mesh, JsonWriter& json, const FileNumbers* numbers = nullptr);
/// The members of a mesh that say where its limit folds, may fold, or overlaps itself.
void add_faults(const v1::MeshSummary& mesh, JsonWriter& json, const FileNumbers* numbers = nullptr);
void add_json(const v1::GetServerInfoResponse& info, JsonWriter& json);
/// `notes`: what was said of the file.
void add_json(const v1::PlanSlicesResponse& plan, JsonWriter& json, const FileNumbers* numbers = nullptr,
              std::span<const std::string> notes = {});

double seconds_of(const google::protobuf::Duration& duration);

/// The name of an encoding, as client/plane_encodings.h has it.
std::string encoding_name(v1::PlaneEncoding value);

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

}  // namespace ccslice::cli
