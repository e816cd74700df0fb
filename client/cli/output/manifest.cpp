// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/manifest.h"

#include <cctype>
#include <cmath>
#include <string>
#include <string_view>

#include "client/cli/base/json_fields.h"
#include "client/cli/base/message_json.h"
#include "client/cli/options/job_file.h"
#include "client/plane_encodings.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice::cli {
namespace {

constexpr const char* kManifestFormat = "ccslice-layers";

const char* name_of(v1::SampleType type) {
  switch (type) {
    case v1::SAMPLE_TYPE_BIT: return "bit";
    case v1::SAMPLE_TYPE_UINT8: return "u8";
    case v1::SAMPLE_TYPE_UINT16: return "u16";
    case v1::SAMPLE_TYPE_FLOAT32: return "f32";
    case v1::SAMPLE_TYPE_UINT2: return "u2";
    case v1::SAMPLE_TYPE_UINT4: return "u4";
    default: return "unknown";
  }
}

/// "part_clipped" of PLAN_WARNING_KIND_PART_CLIPPED.
std::string name_of(v1::PlanWarningKind kind) {
  constexpr std::string_view kPrefix = "PLAN_WARNING_KIND_";
  if (kind == v1::PLAN_WARNING_KIND_UNSPECIFIED || !v1::PlanWarningKind_IsValid(kind)) return "other";
  std::string name = v1::PlanWarningKind_Name(kind).substr(kPrefix.size());
  for (char& c : name) c = static_cast<char>(std::tolower(c));
  return name;
}

void add_vector(const v1::Vector3& vector, JsonWriter& json) {
  json.begin_array().value(vector.x()).value(vector.y()).value(vector.z()).end_array();
}

/// The name of the field that says it.
std::string content_of(const v1::PlaneSpec& plane) {
  const auto* const content = plane.GetDescriptor()->FindOneofByName("content");
  const auto* const field = plane.GetReflection()->GetOneofFieldDescriptor(plane, content);
  return field == nullptr ? "occupancy" : field->name();
}

/// What a picture of channels holds outside the part. JSON has no NaN.
void add_outside(const v1::PlaneSpec& plane, JsonWriter& json) {
  if (!plane.has_channel() && !plane.has_channels()) return;
  if (std::isnan(plane.outside_sample())) {
    json.member("outside_sample", "nan");
  } else {
    json.member("outside_sample", plane.outside_sample());
  }
  const client::PlaneEncoding* encoding = client::find_encoding(plane.encoding());
  json.member("alpha", encoding && encoding->without_alpha != v1::PLANE_ENCODING_UNSPECIFIED);
}

void add_plane(const v1::PlaneSpec& plane, JsonWriter& json) {
  json.begin_object();
  json.member("content", content_of(plane));
  if (plane.has_material_mask()) json.member("material", plane.material_mask().material());
  if (plane.has_channel()) json.member("channel", plane.channel().name());
  if (plane.has_channels()) {
    json.key("channels").begin_array();
    for (const std::string& name : plane.channels().names()) json.value(name);
    json.end_array();
  }
  json.member("sample_type", name_of(plane.sample_type())).member("encoding", encoding_name(plane.encoding()));
  add_outside(plane, json);
  if (plane.has_value_range()) {
    json.key("value_range").begin_array().value(plane.value_range().min()).value(plane.value_range().max()).end_array();
  }
  json.end_object();
}

void add_folds(const v1::MeshSummary& mesh, const FileNumbers* numbers, JsonWriter& json) {
  json.key("folds").begin_array();
  for (const v1::FoldPlace& fold : mesh.folds()) {
    json.begin_object().member("limit_cell", fold.limit_cell()).member("control_cell", fold.control_cell());
    if (numbers != nullptr) json.member("file_cell", file_cell(*numbers, fold.control_cell()));
    json.key("position_mm");
    add_vector(fold.position_mm(), json);
    json.member("determinant", fold.determinant()).end_object();
  }
  json.end_array();
}

void add_overlaps(const v1::Overlaps& overlaps, const FileNumbers* numbers, JsonWriter& json) {
  json.begin_object().member("limit_cells", overlaps.limit_cells()).member("depth_mm", overlaps.depth_mm());
  json.member("volume_mm3", overlaps.volume_mm3()).member("more", overlaps.more()).key("places").begin_array();
  for (const v1::OverlapPlace& place : overlaps.places()) {
    json.begin_object().key("control_cells").begin_array();
    json.value(place.control_cell()).value(place.other_control_cell()).end_array();
    if (numbers != nullptr) {
      json.key("file_cells").begin_array().value(file_cell(*numbers, place.control_cell()));
      json.value(file_cell(*numbers, place.other_control_cell())).end_array();
    }
    json.key("position_mm");
    add_vector(place.position_mm(), json);
    json.member("depth_mm", place.depth_mm()).end_object();
  }
  json.end_array().end_object();
}

void add_warning(const v1::PlanWarning& warning, const FileNumbers* numbers, JsonWriter& json) {
  json.begin_object().member("kind", name_of(warning.kind())).member("message", warning.message());
  json.key("control_cells").begin_array();
  for (const std::uint32_t cell : warning.control_cells()) json.value(cell);
  if (numbers != nullptr) {
    json.end_array().key("file_cells").begin_array();
    for (const std::uint32_t cell : warning.control_cells()) json.value(file_cell(*numbers, cell));
  }
  json.end_array().key("places_mm").begin_array();
  for (const v1::Vector3& place : warning.places_mm()) add_vector(place, json);
  json.end_array().end_object();
}

}  // namespace

double seconds_of(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

std::string encoding_name(v1::PlaneEncoding value) {
  const client::PlaneEncoding* encoding = client::find_encoding(value);
  return encoding ? std::string(encoding->name) : "unknown";
}

namespace {

/// The materials that were printed with, and the voxels of each.
void add_materials(const client::SliceOutcome& outcome, JsonWriter& json) {
  const v1::Printing& printing = outcome.header.printing();
  if (printing.materials().empty()) return;
  json.key("materials").begin_array();
  for (int i = 0; i < printing.materials_size(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const bool counted = index < outcome.material_voxels.size();
    add_material(printing.materials(i).name(), colour_text(printing.materials(i).rgba()),
                 counted ? outcome.material_voxels[index] : 0, json);
  }
  json.end_array();
  json.member("voxels_off_map", outcome.voxels_off_map).member("voxels_scaled_up", outcome.voxels_scaled_up);
  json.member("least_fraction_sum", outcome.least_fraction_sum);
}

void add_parts(const v1::SliceJob& job, JsonWriter& json) {
  json.key("parts").begin_array();
  for (const v1::Part& part : job.parts()) {
    json.begin_object().member("name", part.name()).member("mesh_id", part.mesh_id()).key("placements").begin_array();
    for (const v1::Placement& placement : part.placements()) {
      json.begin_array();
      for (const double entry : placement.matrix()) json.value(entry);
      json.end_array();
    }
    json.end_array().end_object();
  }
  json.end_array();
}

}  // namespace

void add_material(const std::string& name, const std::string& rgba, std::uint64_t voxels, JsonWriter& json) {
  json.begin_object().member("name", name).member("rgba", rgba).member("voxel_count", voxels).end_object();
}

std::string fault_of_manifest(const google::protobuf::Struct& document) {
  if (text(document, "format") != kManifestFormat) return "isn't a manifest of layers";
  if (number(document, "format_version") == kManifestVersion) return {};
  return "is one of another version of ccslice; slice the layers again with this one";
}

std::string manifest(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                     const v1::PlanSlicesResponse& plan, const JobKey& job, const std::string& layers) {
  JsonWriter json;
  json.begin_object()
      .member("format", kManifestFormat)
      .member("format_version", kManifestVersion)
      .member("job", job.id);
  if (job.share) {
    json.key("share");
    add_json(*job.share, json);
  }
  json.member("mesh_id", sliced.parts(0).mesh_id()).member("engine_version", outcome.header.engine_version());
  json.key("grid");
  add_json(outcome.header.grid(), json);
  json.key("region");
  add_json(client::region_of(outcome.header), json);
  json.key("layout");
  add_json(outcome.header.layout(), json);
  json.key("placement").begin_array();
  for (const double entry : sliced.parts(0).placements(0).matrix()) json.value(entry);
  json.end_array();
  if (sliced.parts_size() > 1 || sliced.parts(0).placements_size() > 1) add_parts(sliced, json);
  json.key("slice_job").raw(job_json(sliced));
  json.key("planes").begin_array();
  for (const v1::PlaneSpec& plane : outcome.header.planes()) add_plane(plane, json);
  json.end_array();
  if (outcome.header.has_printing()) {
    json.key("printing");
    add_message(outcome.header.printing(), json);
  }
  add_materials(outcome, json);
  if (outcome.header.cell_region_names_size() > 0) {
    json.key("cell_regions").begin_array();
    for (const std::string& name : outcome.header.cell_region_names()) json.value(name);
    json.end_array();
  }
  json.key("warnings").begin_array();
  for (const v1::PlanWarning& warning : plan.warnings()) {
    json.begin_object().member("kind", name_of(warning.kind())).member("message", warning.message()).end_object();
  }
  json.end_array();
  json.member("voxel_count", outcome.voxel_count);
  json.member("voxels_interpolated", outcome.voxels_interpolated)
      .member("voxels_unresolved", outcome.voxels_unresolved)
      .member("voxels_repainted", outcome.voxels_repainted);
  json.member("max_residual_mm", outcome.max_residual_mm).key("layers").raw(layers).end_object();
  return json.text() + "\n";
}

void add_json(const v1::Box3& box, JsonWriter& json) {
  json.begin_object().key("min_mm");
  add_vector(box.min_mm(), json);
  json.key("max_mm");
  add_vector(box.max_mm(), json);
  json.end_object();
}

void add_json(const v1::Grid& grid, JsonWriter& json) {
  json.begin_object().key("origin_mm");
  add_vector(grid.origin_mm(), json);
  json.key("pitch_mm").begin_array().value(grid.pitch().x_mm()).value(grid.pitch().y_mm()).value(grid.pitch().z_mm());
  json.end_array().member("columns", grid.extent().columns()).member("rows", grid.extent().rows());
  json.member("layers", grid.extent().layers()).key("part_box");
  add_json(grid.part_box(), json);
  json.end_object();
}

void add_json(const v1::PrinterProfile& printer, JsonWriter& json) {
  const v1::VoxelPitch& pitch = printer.pitch();
  json.begin_object().member("name", printer.name()).member("title", printer.title()).key("pitch_mm").begin_array();
  json.value(pitch.x_mm()).value(pitch.y_mm()).value(pitch.z_mm()).end_array().key("tray_mm");
  add_vector(printer.tray_mm(), json);
  json.member("max_materials", printer.max_materials()).member("min_layers", printer.min_layers()).end_object();
}

void add_json(const v1::VoxelBox& region, JsonWriter& json) {
  json.begin_object().member("first_column", region.first_column()).member("first_row", region.first_row());
  json.member("first_layer", region.first_layer()).member("columns", region.extent().columns());
  json.member("rows", region.extent().rows()).member("layers", region.extent().layers()).end_object();
}

void add_json(const v1::PictureLayout& layout, JsonWriter& json) {
  const bool descending = layout.row_order() == v1::ROW_ORDER_DESCENDING_Y;
  json.begin_object().member("row_order", descending ? "descending" : "ascending");
  json.member("flip_x", layout.flip_x()).member("flip_y", layout.flip_y()).end_object();
}

void add_json(const v1::CellRegion& region, JsonWriter& json) {
  json.begin_object().member("name", region.name()).member("control_cells", region.control_cells());
  json.member("volume_mm3", region.volume_mm3()).member("control_volume_mm3", region.control_volume_mm3());
  json.end_object();
}

void add_json(const v1::LimitDeviation& deviation, JsonWriter& json, const FileNumbers* numbers) {
  json.begin_object().member("control_volume_mm3", deviation.control_volume_mm3());
  json.member("limit_volume_mm3", deviation.limit_volume_mm3()).key("control_box");
  add_json(deviation.control_box(), json);
  json.member("farthest_vertex", deviation.farthest_vertex());
  if (numbers != nullptr) json.member("farthest_file_vertex", file_vertex(*numbers, deviation.farthest_vertex()));
  json.key("farthest_vertex_mm");
  add_vector(deviation.farthest_vertex_mm(), json);
  json.key("farthest_limit_mm");
  add_vector(deviation.farthest_limit_mm(), json);
  json.member("farthest_distance_mm", deviation.farthest_distance_mm());
  json.member("farthest_on_interface", deviation.farthest_on_interface());
  json.member("interpolating", deviation.interpolating());
  if (deviation.as_meshed()) json.member("as_meshed", true);
  json.member("vertex_limits_volume_mm3", deviation.vertex_limits_volume_mm3());
  json.member("rounded_edges", deviation.rounded_edges());
  if (deviation.has_rounded_edge_mm()) {
    json.key("rounded_edge_mm");
    add_vector(deviation.rounded_edge_mm(), json);
    json.member("rounded_edge_deg", deviation.rounded_edge_deg());
  }
  json.end_object();
}

void add_json(const v1::MeshSummary& mesh, JsonWriter& json, const FileNumbers* numbers) {
  json.begin_object().member("mesh_id", mesh.mesh_id()).member("size_bytes", mesh.size_bytes());
  json.member("memory_bytes", mesh.memory_bytes()).member("control_vertices", mesh.control_vertices());
  json.member("control_cells", mesh.control_cells()).member("limit_cells", mesh.limit_cells());
  json.member("regular_cells", mesh.regular_cells()).member("line_cells", mesh.line_cells());
  json.member("vertex_cells", mesh.vertex_cells()).member("extraordinary_edges", mesh.extraordinary_edges());
  json.member("extraordinary_vertices", mesh.extraordinary_vertices());
  json.member("irregular_boundary_edges", mesh.irregular_boundary_edges()).member("sharp_edges", mesh.sharp_edges());
  json.member("boundary_faces", mesh.boundary_faces()).key("bounding_box");
  add_json(mesh.bounding_box(), json);
  if (mesh.has_deviation()) {
    json.key("deviation");
    add_json(mesh.deviation(), json, numbers);
  }
  json.key("channels").begin_array();
  for (const v1::Channel& channel : mesh.channels()) {
    json.begin_object().member("name", channel.name()).member("min_value", channel.min_value());
    json.member("max_value", channel.max_value()).end_object();
  }
  json.end_array().key("cell_regions").begin_array();
  for (const v1::CellRegion& region : mesh.cell_regions()) add_json(region, json);
  json.end_array().member("inverted_control_cell_count", mesh.inverted_control_cell_count());
  add_faults(mesh, json, numbers);
  json.member("preparation_ms", 1e3 * seconds_of(mesh.preparation_time()));
  json.member("engine_version", mesh.engine_version()).end_object();
}

void add_faults(const v1::MeshSummary& mesh, JsonWriter& json, const FileNumbers* numbers) {
  json.member("folding_cells", mesh.folding_cells()).member("undecided_cells", mesh.undecided_cells());
  add_folds(mesh, numbers, json);
  json.key("overlaps");
  add_overlaps(mesh.overlaps(), numbers, json);
}

void add_json(const v1::GetServerInfoResponse& info, JsonWriter& json) {
  json.begin_object().member("server_version", info.server_version()).member("engine_version", info.engine_version());
  json.member("threads", info.threads()).member("max_concurrent_calls", info.max_concurrent_calls());
  json.member("cache_capacity_bytes", info.cache_capacity_bytes()).member("cache_used_bytes", info.cache_used_bytes());
  json.member("cached_meshes", info.cached_meshes()).member("max_mesh_bytes", info.max_mesh_bytes());
  json.member("max_chunk_bytes", info.max_chunk_bytes())
      .member("max_points_per_message", info.max_points_per_message());
  json.key("mesh_limits").begin_object().member("max_vertices", info.mesh_limits().max_vertices());
  json.member("max_cells", info.mesh_limits().max_cells()).member("max_channels", info.mesh_limits().max_channels());
  json.end_object().key("slice_limits").begin_object().member("max_columns", info.slice_limits().max_columns());
  json.member("max_rows", info.slice_limits().max_rows()).member("max_layers", info.slice_limits().max_layers());
  json.member("max_voxels_per_layer", info.slice_limits().max_voxels_per_layer());
  json.member("min_pitch_mm", info.slice_limits().min_pitch_mm());
  json.member("max_pitch_mm", info.slice_limits().max_pitch_mm()).end_object();
  json.key("encodings").begin_array();
  for (const int encoding : info.encodings()) json.value(encoding_name(static_cast<v1::PlaneEncoding>(encoding)));
  json.end_array().key("printer_profiles").begin_array();
  for (const v1::PrinterProfile& profile : info.printer_profiles()) add_json(profile, json);
  json.end_array().end_object();
}

void add_json(const v1::PlanSlicesResponse& plan, JsonWriter& json, const FileNumbers* numbers,
              std::span<const std::string> notes) {
  json.begin_object().key("grid");
  add_json(plan.grid(), json);
  json.key("region");
  add_json(client::region_of(plan), json);
  json.key("layout");
  add_json(plan.layout(), json);
  json.key("size_mm");
  add_vector(plan.size_mm(), json);
  json.member("layer_count", plan.layer_count()).member("raw_bytes_per_layer", plan.raw_bytes_per_layer());
  json.member("raw_bytes", plan.raw_bytes()).member("estimated_bytes", plan.estimated_bytes());
  if (plan.has_deviation()) {
    json.key("deviation");
    add_json(plan.deviation(), json, numbers);
  }
  json.member("engine_version", plan.engine_version()).key("warnings").begin_array();
  for (const v1::PlanWarning& warning : plan.warnings()) add_warning(warning, numbers, json);
  json.end_array();
  if (numbers != nullptr) {
    json.key("notes").begin_array();
    for (const std::string& note : notes) json.value(note);
    json.end_array();
  }
  json.end_object();
}

}  // namespace ccslice::cli
