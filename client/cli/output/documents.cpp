// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/documents.h"

#include <cctype>
#include <string_view>

#include "client/cli/base/message_json.h"
#include "client/job.h"
#include "client/plane_encodings.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice::cli {
namespace {

v1::Vector3 vector_of(const v1::VoxelPitch& pitch) {
  return client::vector_of(pitch.x_mm(), pitch.y_mm(), pitch.z_mm());
}

void add_numbers(const v1::Vector3& vector, google::protobuf::RepeatedField<double>& numbers) {
  for (const double number : {vector.x(), vector.y(), vector.z()}) numbers.Add(number);
}

void name_vertex(const FileNumbers* numbers, v1::Deviation& deviation) {
  if (numbers) deviation.set_farthest_file_vertex(file_vertex(*numbers, deviation.farthest_vertex()));
}

/// The document of a mesh, or of its limit.
template <class Document>
Document document_of_summary(const v1::MeshSummary& mesh, const FileNumbers* numbers) {
  auto document = with_fields_of<Document>(mesh);
  if (document.has_deviation()) name_vertex(numbers, *document.mutable_deviation());
  for (int i = 0; numbers && i < mesh.folds_size(); ++i) {
    document.mutable_folds(i)->set_file_cell(file_cell(*numbers, mesh.folds(i).control_cell()));
  }
  v1::OverlappingCells& overlaps = *document.mutable_overlaps();
  for (int i = 0; i < mesh.overlaps().places_size(); ++i) {
    const v1::OverlapPlace& place = mesh.overlaps().places(i);
    for (const std::uint32_t cell : {place.control_cell(), place.other_control_cell()}) {
      overlaps.mutable_places(i)->add_control_cells(cell);
      if (numbers) overlaps.mutable_places(i)->add_file_cells(file_cell(*numbers, cell));
    }
  }
  return document;
}

}  // namespace

v1::VoxelGrid document_of(const v1::Grid& grid) {
  auto document = with_fields_of<v1::VoxelGrid>(grid.extent());
  add_numbers(grid.origin_mm(), *document.mutable_origin_mm());
  add_numbers(vector_of(grid.pitch()), *document.mutable_pitch_mm());
  add_numbers(grid.part_box().min_mm(), *document.mutable_part_box()->mutable_min_mm());
  add_numbers(grid.part_box().max_mm(), *document.mutable_part_box()->mutable_max_mm());
  return document;
}

v1::DeliveredBox document_of(const v1::VoxelBox& region) {
  auto document = with_fields_of<v1::DeliveredBox>(region.extent());
  document.set_first_column(region.first_column());
  document.set_first_row(region.first_row());
  document.set_first_layer(region.first_layer());
  return document;
}

v1::RowLayout document_of(const v1::PictureLayout& layout) {
  v1::RowLayout document;
  document.set_row_order(layout.row_order() == v1::ROW_ORDER_DESCENDING_Y ? "descending" : "ascending");
  document.set_flip_x(layout.flip_x());
  document.set_flip_y(layout.flip_y());
  return document;
}

v1::Printer document_of(const v1::PrinterProfile& printer) {
  auto document = with_fields_of<v1::Printer>(printer);
  *document.mutable_pitch_mm() = vector_of(printer.pitch());
  return document;
}

v1::ServerDocument document_of(const v1::GetServerInfoResponse& info) {
  v1::GetServerInfoResponse rest = info;
  rest.clear_encodings();
  rest.clear_printer_profiles();
  auto document = with_fields_of<v1::ServerDocument>(rest);
  for (const int encoding : info.encodings()) {
    document.add_encodings(encoding_name(static_cast<v1::PlaneEncoding>(encoding)));
  }
  for (const v1::PrinterProfile& printer : info.printer_profiles()) {
    *document.add_printer_profiles() = document_of(printer);
  }
  return document;
}

v1::ServerMesh document_of(const v1::MeshSummary& mesh, const FileNumbers* numbers) {
  constexpr double kMilliseconds = 1e3;  // A second has.
  auto document = document_of_summary<v1::ServerMesh>(mesh, numbers);
  document.set_preparation_ms(kMilliseconds * seconds_of(mesh.preparation_time()));
  return document;
}

v1::FileDocument document_of_limit(const v1::MeshSummary& limit, const FileNumbers& numbers) {
  return document_of_summary<v1::FileDocument>(limit, &numbers);
}

v1::PlanDocument document_of(const v1::PlanSlicesResponse& plan, const FileNumbers* numbers) {
  v1::PlanSlicesResponse rest = plan;
  rest.clear_grid();
  rest.clear_layout();
  for (v1::PlanWarning& warning : *rest.mutable_warnings()) warning.clear_kind();
  auto document = with_fields_of<v1::PlanDocument>(rest);
  *document.mutable_grid() = document_of(plan.grid());
  *document.mutable_region() = document_of(client::region_of(plan));
  *document.mutable_layout() = document_of(plan.layout());
  if (document.has_deviation()) name_vertex(numbers, *document.mutable_deviation());
  for (int i = 0; i < plan.warnings_size(); ++i) {
    v1::WarningOfCells& warning = *document.mutable_warnings(i);
    warning.set_kind(kind_text(plan.warnings(i).kind()));
    if (!numbers) continue;
    for (const std::uint32_t cell : warning.control_cells()) warning.add_file_cells(file_cell(*numbers, cell));
  }
  return document;
}

std::string kind_text(v1::PlanWarningKind kind) {
  constexpr std::string_view kPrefix = "PLAN_WARNING_KIND_";
  if (kind == v1::PLAN_WARNING_KIND_UNSPECIFIED || !v1::PlanWarningKind_IsValid(kind)) return "other";
  std::string name = v1::PlanWarningKind_Name(kind).substr(kPrefix.size());
  for (char& c : name) c = static_cast<char>(std::tolower(c));
  return name;
}

std::string encoding_name(v1::PlaneEncoding value) {
  const client::PlaneEncoding* encoding = client::find_encoding(value);
  return encoding ? std::string(encoding->name) : "unknown";
}

double seconds_of(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

}  // namespace ccslice::cli
