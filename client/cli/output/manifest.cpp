// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/manifest.h"

#include "client/cli/base/message_json.h"
#include "client/cli/output/documents.h"
#include "client/cli/output/material_amounts.h"
#include "client/plane_encodings.h"

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

/// The name of the field that says it.
std::string content_of(const v1::PlaneSpec& plane) {
  const auto* const content = plane.GetDescriptor()->FindOneofByName("content");
  const auto* const field = plane.GetReflection()->GetOneofFieldDescriptor(plane, content);
  return field == nullptr ? "occupancy" : field->name();
}

v1::Plane plane_of(const v1::PlaneSpec& spec) {
  v1::Plane plane;
  plane.set_content(content_of(spec));
  if (spec.has_material_mask()) plane.set_material(spec.material_mask().material());
  if (spec.has_channel()) plane.set_channel(spec.channel().name());
  *plane.mutable_channels() = spec.channels().names();
  plane.set_sample_type(name_of(spec.sample_type()));
  plane.set_encoding(encoding_name(spec.encoding()));
  if (spec.has_channel() || spec.has_channels()) {
    const client::PlaneEncoding* encoding = client::find_encoding(spec.encoding());
    plane.set_outside_sample(spec.outside_sample());
    plane.set_alpha(encoding && encoding->without_alpha != v1::PLANE_ENCODING_UNSPECIFIED);
  }
  if (spec.has_value_range()) {
    plane.add_value_range(spec.value_range().min());
    plane.add_value_range(spec.value_range().max());
  }
  return plane;
}

/// What the header of the layers says.
void add_header(const v1::SliceHeader& header, v1::Manifest& manifest) {
  manifest.set_engine_version(header.engine_version());
  *manifest.mutable_grid() = document_of(header.grid());
  *manifest.mutable_region() = document_of(client::region_of(header));
  *manifest.mutable_layout() = document_of(header.layout());
  for (const v1::PlaneSpec& plane : header.planes()) *manifest.add_planes() = plane_of(plane);
  for (const v1::PrintMaterial& material : header.printing().materials()) {
    describe_material(material, *manifest.add_materials());
  }
  *manifest.mutable_cell_regions() = header.cell_region_names();
}

}  // namespace

void complete_manifest(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                       const v1::PlanSlicesResponse& plan, const JobKey& job, v1::Manifest& manifest) {
  manifest.set_format(kManifestFormat);
  manifest.set_format_version(kManifestVersion);
  manifest.set_job(job.id);
  if (job.share) *manifest.mutable_share() = document_of(*job.share);
  *manifest.mutable_slice_job() = sliced;
  add_header(outcome.header, manifest);
  for (const v1::PlanWarning& warning : plan.warnings()) {
    v1::ToldWarning& told = *manifest.add_warnings();
    told.set_kind(kind_text(warning.kind()));
    told.set_message(warning.message());
    if (warning.has_part()) told.set_part(warning.part());
  }
  count_voxels(outcome, manifest);
}

void count_voxels(const client::SliceOutcome& counts, v1::Manifest& manifest) {
  set_voxel_counts(counts, manifest);
  const auto& pitch_mm = manifest.grid().pitch_mm();
  const double voxel_cm3 = pitch_mm.size() == 3 ? pitch_mm[0] * pitch_mm[1] * pitch_mm[2] / 1000 : 0;
  set_part_counts(manifest.slice_job(), counts, voxel_cm3, {manifest.materials().begin(), manifest.materials().end()},
                  manifest);
  if (manifest.materials().empty()) return;
  set_misfit_counts(counts, manifest);
  for (int m = 0; m < manifest.materials_size(); ++m) {
    const auto index = static_cast<std::size_t>(m);
    const bool counted = index < counts.material_voxels.size();
    const std::uint64_t voxels = counted ? counts.material_voxels[index] : 0;
    const v1::Printing& printing = manifest.slice_job().printing();
    const v1::PrintMaterial material = m < printing.materials_size() ? printing.materials(m) : v1::PrintMaterial();
    set_amount(voxels, voxel_cm3, material, *manifest.mutable_materials(m));
  }
}

std::string read_manifest(const std::string& text, v1::Manifest& manifest) {
  v1::FileHead head;
  const bool whole = read_json(text, manifest);
  if (whole) {
    head.set_format(manifest.format());
    head.set_format_version(manifest.format_version());
  } else if (!read_json(text, head)) {
    return "isn't a manifest of layers: was it cut short? Slice the layers again";
  }
  if (head.format() != kManifestFormat) return "isn't a manifest of layers";
  if (head.format_version() != kManifestVersion) {
    return "is one of another version of ccslice; slice the layers again with this one";
  }
  return whole && !manifest.slice_job().parts().empty() ? "" : "isn't as it was written; slice the layers again";
}

}  // namespace ccslice::cli
