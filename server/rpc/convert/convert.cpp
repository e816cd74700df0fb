// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/convert.h"

#include "core/base/choice_text.h"
#include "core/base/error.h"
#include "core/field/contone.h"
#include "core/job/validate_placement.h"
#include "core/output/pack_indices.h"
#include "server/rpc/convert/contract_value.h"
#include "server/rpc/convert/convert_printing.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

SampleType default_sample_type(PlaneContent content, const SolidSummary& solid,
                               const std::optional<Printing>& printing) {
  switch (content) {
    case PlaneContent::kOccupancy:
    case PlaneContent::kMaterialMask: return SampleType::kBit;
    case PlaneContent::kChannels: return SampleType::kFloat32;
    case PlaneContent::kMaterials: return smallest_index_type(printing ? printing->materials.size() : 1);
    case PlaneContent::kCellRegions: return smallest_index_type(solid.cell_regions.size());
    case PlaneContent::kChannel: break;
  }
  return SampleType::kUint8;
}

SampleType to_sample_type(v1::SampleType type, SampleType otherwise, const std::string& field) {
  switch (type) {
    case v1::SAMPLE_TYPE_UNSPECIFIED: return otherwise;
    case v1::SAMPLE_TYPE_UINT2: return SampleType::kUint2;
    case v1::SAMPLE_TYPE_UINT4: return SampleType::kUint4;
    case v1::SAMPLE_TYPE_BIT: return SampleType::kBit;
    case v1::SAMPLE_TYPE_UINT8: return SampleType::kUint8;
    case v1::SAMPLE_TYPE_UINT16: return SampleType::kUint16;
    case v1::SAMPLE_TYPE_FLOAT32: return SampleType::kFloat32;
    default: break;
  }
  throw Error(ErrorCode::kEnumValueUnknown,
              field + ": " + std::to_string(static_cast<int>(type)) +
                  " isn't a sample type that this server knows; ask for BIT, UINT2, UINT4, UINT8, UINT16 or FLOAT32",
              field);
}

constexpr std::string_view kEncodingPrefix = "PLANE_ENCODING_";

Encoding to_encoding(v1::PlaneEncoding encoding, const std::string& field) {
  if (encoding == v1::PLANE_ENCODING_UNSPECIFIED) return PlaneSpec().encoding;
  if (const auto* traits = find_contract_row(encodings(), kEncodingPrefix, encoding)) return traits->encoding;
  throw Error(ErrorCode::kEnumValueUnknown,
              field + ": " + std::to_string(static_cast<int>(encoding)) +
                  " isn't an encoding that this server knows; ask for " + choice_text(encodings()),
              field);
}

std::uint32_t to_mask_material(const std::string& name, const std::optional<Printing>& printing,
                               const std::string& field) {
  if (printing) return to_material(name, *printing, field);
  throw Error(ErrorCode::kMaterialsMissing,
              "printing.materials: none, and " + field + " shows one of them; say what the printer holds",
              "printing.materials");
}

PlaneSpec to_plane(const v1::PlaneSpec& message, const SolidSummary& solid, const std::optional<Printing>& printing,
                   const std::string& path) {
  PlaneSpec plane;
  switch (message.content_case()) {
    case v1::PlaneSpec::kOccupancy: plane.content = PlaneContent::kOccupancy; break;
    case v1::PlaneSpec::kChannel:
      plane.content = PlaneContent::kChannel;
      plane.channel = message.channel().name();
      break;
    case v1::PlaneSpec::kChannels:
      plane.content = PlaneContent::kChannels;
      plane.channels.assign(message.channels().names().begin(), message.channels().names().end());
      break;
    case v1::PlaneSpec::kMaterials: plane.content = PlaneContent::kMaterials; break;
    case v1::PlaneSpec::kCellRegions: plane.content = PlaneContent::kCellRegions; break;
    case v1::PlaneSpec::kMaterialMask:
      plane.content = PlaneContent::kMaterialMask;
      plane.material = to_mask_material(message.material_mask().material(), printing, path + ".material_mask.material");
      break;
    default:
      throw Error(ErrorCode::kContentInvalid,
                  path +
                      ": has no content that this server knows; ask for occupancy, channel, channels, materials, "
                      "material_mask or cell_regions",
                  path);
  }
  plane.sample_type =
      to_sample_type(message.sample_type(), default_sample_type(plane.content, solid, printing), path + ".sample_type");
  plane.encoding = to_encoding(message.encoding(), path + ".encoding");
  if (message.has_value_range()) {
    plane.range = ValueRange{.min = message.value_range().min(), .max = message.value_range().max()};
  }
  plane.outside_sample = message.outside_sample();
  return plane;
}

GridExtent to_extent(const v1::GridExtent& message) { return {message.columns(), message.rows(), message.layers()}; }

v1::GridExtent extent_message(const GridExtent& value) {
  v1::GridExtent message;
  message.set_columns(value.columns);
  message.set_rows(value.rows);
  message.set_layers(value.layers);
  return message;
}

}  // namespace

Vec3 to_vec3(const v1::Vector3& message) { return {message.x(), message.y(), message.z()}; }

Placement to_placement(const v1::Placement& message, const Box3& solid_box, const SliceLimits& limits) {
  Placement placement = Placement::Identity();
  if (message.matrix_size() != 0 && message.matrix_size() != 12) {
    throw ServiceError(ServiceErrorCode::kRequestMalformed,
                       "placement.matrix has " + std::to_string(message.matrix_size()) +
                           " numbers: give the 12 of a 3 x 4 matrix row by row, or none",
                       "placement.matrix");
  }
  for (int i = 0; i < message.matrix_size(); ++i) placement(i / 4, i % 4) = message.matrix(i);
  validate_placement(placement, solid_box, limits);
  return placement;
}

GridRequest to_grid_request(const v1::GridSpec& message) {
  if (!message.has_pitch()) {
    throw Error(ErrorCode::kPitchMissing, "grid.pitch: missing; say how large a voxel is, 600 dpi is 0.0423 mm",
                "grid.pitch");
  }
  GridRequest request;
  request.pitch = {message.pitch().x_mm(), message.pitch().y_mm(), message.pitch().z_mm()};
  if (message.has_origin_mm()) {
    request.origin_mm = to_vec3(message.origin_mm());
  }
  if (message.has_extent()) request.extent = to_extent(message.extent());
  return request;
}

VoxelBox to_region(const v1::Region& message, const Grid& grid) {
  switch (message.kind_case()) {
    case v1::Region::kVoxels: {
      const v1::VoxelBox& voxels = message.voxels();
      const VoxelBox region = {voxels.first_column(), voxels.first_row(), voxels.first_layer(),
                               to_extent(voxels.extent())};
      validate_region(grid, region);
      return region;
    }
    case v1::Region::kBoxMm: {
      Box3 box_mm;
      box_mm.min() = to_vec3(message.box_mm().min_mm());
      box_mm.max() = to_vec3(message.box_mm().max_mm());
      return region_of_box(grid, box_mm);
    }
    default:
      throw Error(ErrorCode::kRegionEmpty,
                  "region: neither voxels nor box_mm; give one of them, or leave the region out for the whole grid",
                  "region");
  }
}

PictureOrder to_order(const v1::PictureLayout& message) {
  switch (message.row_order()) {
    case v1::ROW_ORDER_UNSPECIFIED:
    case v1::ROW_ORDER_ASCENDING_Y: return {message.flip_x(), message.flip_y()};
    case v1::ROW_ORDER_DESCENDING_Y: return {message.flip_x(), !message.flip_y()};
    default: break;
  }
  throw Error(ErrorCode::kEnumValueUnknown,
              "layout.row_order: " + std::to_string(static_cast<int>(message.row_order())) +
                  " isn't an order of rows that this server knows; ask for ASCENDING_Y or DESCENDING_Y",
              "layout.row_order");
}

v1::PictureLayout with_defaults(const v1::PictureLayout& message) {
  v1::PictureLayout layout = message;
  if (layout.row_order() == v1::ROW_ORDER_UNSPECIFIED) layout.set_row_order(v1::ROW_ORDER_ASCENDING_Y);
  return layout;
}

std::vector<PlaneSpec> to_planes(const google::protobuf::RepeatedPtrField<v1::PlaneSpec>& messages,
                                 const SolidSummary& solid, const std::optional<Printing>& printing) {
  std::vector<PlaneSpec> planes;
  for (int i = 0; i < messages.size(); ++i) {
    planes.push_back(to_plane(messages[i], solid, printing, "planes[" + std::to_string(i) + "]"));
  }
  return planes;
}

v1::SampleType to_message(SampleType type) {
  switch (type) {
    case SampleType::kBit: return v1::SAMPLE_TYPE_BIT;
    case SampleType::kUint8: return v1::SAMPLE_TYPE_UINT8;
    case SampleType::kUint16: return v1::SAMPLE_TYPE_UINT16;
    case SampleType::kFloat32: return v1::SAMPLE_TYPE_FLOAT32;
    case SampleType::kUint2: return v1::SAMPLE_TYPE_UINT2;
    case SampleType::kUint4: return v1::SAMPLE_TYPE_UINT4;
  }
  return v1::SAMPLE_TYPE_UNSPECIFIED;
}

v1::Vector3 to_message(const Vec3& value) {
  v1::Vector3 message;
  message.set_x(value.x());
  message.set_y(value.y());
  message.set_z(value.z());
  return message;
}

v1::Box3 to_message(const Box3& value) {
  v1::Box3 message;
  *message.mutable_min_mm() = to_message(Vec3(value.min()));
  *message.mutable_max_mm() = to_message(Vec3(value.max()));
  return message;
}

v1::VoxelPitch to_message(const VoxelPitch& value) {
  v1::VoxelPitch message;
  message.set_x_mm(value.x_mm);
  message.set_y_mm(value.y_mm);
  message.set_z_mm(value.z_mm);
  return message;
}

v1::Grid to_message(const Grid& value) {
  v1::Grid message;
  *message.mutable_origin_mm() = to_message(value.origin_mm);
  *message.mutable_pitch() = to_message(value.pitch);
  *message.mutable_extent() = extent_message(value.extent);
  *message.mutable_part_box() = to_message(value.part_box);
  return message;
}

v1::VoxelBox to_message(const VoxelBox& value) {
  v1::VoxelBox message;
  message.set_first_column(value.first_column);
  message.set_first_row(value.first_row);
  message.set_first_layer(value.first_layer);
  *message.mutable_extent() = extent_message(value.extent);
  return message;
}

v1::PlaneSpec to_message(const PlaneSpec& value, const ChannelTable& channels,
                         const std::optional<Printing>& printing) {
  v1::PlaneSpec message;
  message.set_sample_type(to_message(value.sample_type));
  message.set_encoding(to_message(*find_encoding(value.encoding)));
  switch (value.content) {
    case PlaneContent::kOccupancy: message.mutable_occupancy(); return message;
    case PlaneContent::kMaterials: message.mutable_materials(); return message;
    case PlaneContent::kCellRegions: message.mutable_cell_regions(); return message;
    case PlaneContent::kMaterialMask:
      message.mutable_material_mask()->set_material(printing->materials[value.material - 1].name);
      return message;
    case PlaneContent::kChannels:
      for (const std::string& channel : value.channels) message.mutable_channels()->add_names(channel);
      message.set_outside_sample(value.outside_sample);
      return message;
    case PlaneContent::kChannel: break;
  }
  message.mutable_channel()->set_name(value.channel);
  message.set_outside_sample(value.outside_sample);
  if (value.sample_type != SampleType::kFloat32) {
    const ValueRange range = value_range(value, channels.at(value.channel).range);
    message.mutable_value_range()->set_min(range.min);
    message.mutable_value_range()->set_max(range.max);
  }
  return message;
}

v1::CellKind to_message(const CellKindTraits& value) { return contract_value<v1::CellKind>("CELL_KIND_", value.name); }

v1::PlaneEncoding to_message(const EncodingTraits& value) {
  return contract_value<v1::PlaneEncoding>(kEncodingPrefix, value.name);
}

v1::Channel to_message(const ChannelRange& value) {
  v1::Channel message;
  message.set_name(value.name);
  message.set_min_value(value.min);
  message.set_max_value(value.max);
  return message;
}

v1::CellRegion to_message(const CellRegionSummary& value) {
  v1::CellRegion message;
  message.set_name(value.name);
  message.set_control_cells(value.control_cells);
  message.set_volume_mm3(value.volume_mm3);
  message.set_control_volume_mm3(value.control_volume_mm3);
  return message;
}

v1::FoldPlace to_message(const FoldPlace& value) {
  v1::FoldPlace message;
  message.set_limit_cell(value.cell);
  message.set_control_cell(value.control_cell);
  *message.mutable_position_mm() = to_message(value.position);
  message.set_determinant(value.determinant);
  return message;
}

v1::Overlaps to_message(const Overlaps& value) {
  v1::Overlaps message;
  message.set_limit_cells(value.cells);
  message.set_depth_mm(value.depth_mm);
  message.set_volume_mm3(value.volume_mm3);
  message.set_more(value.at_least);
  for (const OverlapPlace& place : value.places) {
    v1::OverlapPlace& added = *message.add_places();
    added.set_control_cell(place.cell);
    added.set_other_control_cell(place.other);
    *added.mutable_position_mm() = to_message(place.position);
    added.set_depth_mm(place.depth_mm);
  }
  return message;
}

v1::LimitDeviation to_message(const Deviation& value) {
  v1::LimitDeviation message;
  message.set_control_volume_mm3(value.control_volume_mm3);
  message.set_limit_volume_mm3(value.limit_volume_mm3);
  *message.mutable_control_box() = to_message(value.control_box);
  message.set_farthest_vertex(value.farthest.vertex);
  *message.mutable_farthest_vertex_mm() = to_message(value.farthest.position);
  *message.mutable_farthest_limit_mm() = to_message(value.farthest.limit);
  message.set_farthest_distance_mm(value.farthest.distance_mm());
  message.set_farthest_on_interface(value.farthest.on_interface);
  message.set_interpolating(value.interpolating);
  message.set_as_meshed(value.as_meshed);
  message.set_vertex_limits_volume_mm3(value.vertex_limits_volume_mm3);
  if (value.rounded.count > 0) {
    message.set_rounded_edges(value.rounded.count);
    *message.mutable_rounded_edge_mm() = to_message(value.rounded.place);
    message.set_rounded_edge_deg(value.rounded.turn_deg);
  }
  return message;
}

v1::LayerStatistics to_message(const LayerStats& value) {
  v1::LayerStatistics message;
  message.set_voxels_coherent(value.voxels_coherent);
  message.set_voxels_full(value.voxels_full);
  message.set_voxels_interpolated(value.voxels_interpolated);
  message.set_voxels_unresolved(value.voxels_unresolved);
  message.set_voxels_repainted(value.voxels_repainted);
  message.set_max_residual_mm(value.max_residual_mm);
  message.set_contour_loops(value.contour_loops);
  message.set_contour_points(value.contour_points);
  message.set_contour_leaves_unresolved(value.contour_leaves_unresolved);
  message.set_voxels_off_map(value.voxels_off_map);
  message.set_voxels_scaled_up(value.voxels_scaled_up);
  message.set_least_fraction_sum(value.least_fraction_sum);
  message.set_voxels_covered(value.voxels_covered);
  message.set_voxels_cut(value.voxels_cut);
  message.mutable_material_voxels()->Assign(value.material_voxels.begin(), value.material_voxels.end());
  for (const PartVoxels& part : value.parts) {
    v1::PartVoxels& added = *message.add_parts();
    added.set_voxel_count(part.voxels);
    added.mutable_material_voxels()->Assign(part.material_voxels.begin(), part.material_voxels.end());
  }
  for (const PartOverlap& overlap : value.overlaps) {
    v1::PartOverlap& added = *message.add_overlaps();
    added.set_owner(overlap.owner);
    added.set_covered(overlap.covered);
    added.set_voxel_count(overlap.voxels);
    *added.mutable_place_mm() = to_message(overlap.place_mm);
  }
  return message;
}

google::protobuf::Duration to_duration(std::chrono::nanoseconds value) {
  google::protobuf::Duration message;
  message.set_seconds(value.count() / 1'000'000'000);
  message.set_nanos(static_cast<int>(value.count() % 1'000'000'000));
  return message;
}

google::protobuf::Timestamp to_timestamp(std::chrono::system_clock::time_point value) {
  const std::int64_t ns = std::chrono::duration_cast<std::chrono::nanoseconds>(value.time_since_epoch()).count();
  google::protobuf::Timestamp message;
  message.set_seconds(ns / 1'000'000'000);
  message.set_nanos(static_cast<int>(ns % 1'000'000'000));
  return message;
}

}  // namespace ccslice::server
