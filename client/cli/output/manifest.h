// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// manifest.json, which says what is in a folder of layers.

#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/cli/output/job_journal.h"
#include "client/cli/output/part_amounts.h"
#include "client/client.h"

namespace ccslice::cli {

/// `format_version` of manifest.json. Version 3 has parts and printing in slice_job alone.
inline constexpr std::uint32_t kManifestVersion = 3;

/// Completes a manifest that has its layers. `plan`: the job's, whose warnings it has as they are.
void complete_manifest(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                       const v1::PlanSlicesResponse& plan, const JobKey& job, v1::Manifest& manifest);

template <class Document>
void set_voxel_counts(const client::SliceOutcome& counts, Document& document) {
  document.set_voxel_count(counts.voxel_count);
  document.set_voxels_covered(counts.voxels_covered);
  if (counts.voxels_cut > 0) document.set_voxels_cut(counts.voxels_cut);
  document.set_voxels_interpolated(counts.voxels_interpolated);
  document.set_voxels_unresolved(counts.voxels_unresolved);
  document.set_voxels_repainted(counts.voxels_repainted);
  document.set_max_residual_mm(counts.max_residual_mm);
}

/// Sets what each part has, and which parts overlap.
template <class Document>
void set_part_counts(const v1::SliceJob& job, const client::SliceOutcome& counts, double voxel_cm3,
                     const std::vector<v1::MaterialVoxels>& materials, Document& document) {
  document.clear_parts();
  document.clear_overlaps();
  for (v1::PartAmount& part : part_amounts(job, counts, voxel_cm3, materials)) *document.add_parts() = std::move(part);
  for (v1::PartPair& pair : part_pairs(job, counts, voxel_cm3)) *document.add_overlaps() = std::move(pair);
}

/// Voxels whose values the material maps don't take as they are.
template <class Document>
void set_misfit_counts(const client::SliceOutcome& counts, Document& document) {
  document.set_voxels_off_map(counts.voxels_off_map);
  document.set_voxels_scaled_up(counts.voxels_scaled_up);
  document.set_least_fraction_sum(counts.least_fraction_sum);
}

/// Sets the counts of all layers, those of each material and part too.
void count_voxels(const client::SliceOutcome& counts, v1::Manifest& manifest);

/// Reads the text of a manifest.json. Returns what is wrong with it, as the rest of a sentence that its path begins;
/// empty if it is one that this version reads.
[[nodiscard]] std::string read_manifest(const std::string& text, v1::Manifest& manifest);

}  // namespace ccslice::cli
