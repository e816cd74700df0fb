// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/slice_report.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/output/manifest.h"
#include "client/cli/output/material_amounts.h"
#include "client/cli/output/part_amounts.h"
#include "core/base/echo.h"
#include "core/base/number_text.h"

namespace ccslice::cli {
namespace {

v1::SlicedLayers sliced_document(const std::string& output, const PlannedJob& job, const SliceResult& result) {
  const client::SliceOutcome& outcome = result.outcome;
  v1::SlicedLayers document;
  document.set_output(output);
  document.set_mesh_id(job.request.job().parts(0).mesh_id());
  if (job.key.share) *document.mutable_share() = document_of(*job.key.share);
  document.set_engine_version(outcome.header.engine_version());
  document.set_layers(outcome.layers);
  document.set_empty_layers(outcome.empty_layers);
  set_voxel_counts(outcome, document);
  set_misfit_counts(outcome, document);
  for (v1::MaterialVoxels& material : materials_of(outcome)) *document.add_materials() = std::move(material);
  set_part_counts(job.request.job(), outcome, cm3_of(1, outcome), materials_of(outcome), document);
  document.set_written_bytes(result.written_bytes);
  document.set_seconds(result.seconds);
  if (!result.contact_sheet.empty()) document.set_contact_sheet(result.contact_sheet);
  document.set_resumes(static_cast<std::uint32_t>(outcome.resumes));
  document.set_reuploads(static_cast<std::uint32_t>(outcome.reuploads));
  return document;
}

/// Voxels whose values the material maps don't take as they are.
void warn_of_misfits(const client::SliceOutcome& outcome) {
  constexpr int kDigits = 3;
  const std::uint64_t all =
      std::accumulate(outcome.material_voxels.begin(), outcome.material_voxels.end(), std::uint64_t{0});
  const auto share = [&](std::uint64_t voxels) {
    const double percent = 100 * static_cast<double>(voxels) / static_cast<double>(all);
    return show_count(voxels) + " of " + show_count(all) + " voxels (" + number_text(percent, kDigits) + " %)";
  };
  if (outcome.voxels_off_map > 0) {
    print_note("warning: " + share(outcome.voxels_off_map) +
               " have values that their --map doesn't cover, and took what the nearer end gives");
  }
  if (outcome.voxels_scaled_up > 0) {
    print_note(
        "warning: " + share(outcome.voxels_scaled_up) + " have fractions that add up to less than 1, the least to " +
        number_text(outcome.least_fraction_sum, kDigits) +
        ", and were scaled up to 1; rest=NAME in --map direct lets a material take the rest, and rest=void leaves it "
        "empty");
  }
}

}  // namespace

std::string place_of(const std::string& output) { return output == "-" ? "standard output" : output; }

void report_sliced(const Session& session, const std::string& output, const PlannedJob& job,
                   const SliceResult& result) {
  const client::SliceOutcome& outcome = result.outcome;
  if (session.options().json) return print_line(json_of(sliced_document(output, job, result)));
  const std::string said = show_count(outcome.layers, "layer") + ", " + show_count(outcome.voxel_count, "voxel") +
                           " inside, " + show_cm3(cm3_of(outcome.voxel_count, outcome)) + ", " +
                           show_bytes(result.written_bytes) + " in " + show_duration(result.seconds) + " -> " +
                           place_of(output);
  if (output != "-") {
    print_line(said);
    if (const std::string materials = materials_text(outcome); !materials.empty()) {
      print_line("materials: " + materials);
    }
    if (const std::string parts = part_amounts_text(job.request.job(), outcome); !parts.empty()) print_line(parts);
    if (outcome.voxels_cut > 0) print_line("cut out: " + show_cm3(cm3_of(outcome.voxels_cut, outcome)));
    if (!result.contact_sheet.empty()) print_line("contact sheet: " + result.contact_sheet);
    if (job.key.share) print_line(describe(*job.key.share) + "; ccslice join makes the job of all shares");
  } else if (!session.quiet()) {
    print_note(said);
  }
  if (outcome.voxels_unresolved > 0 && !session.quiet()) {
    print_note("note: " + show_count(outcome.voxels_unresolved) +
               " voxels took the material of the nearest place that could be solved");
  }
  if (outcome.voxels_repainted > 0 && !session.quiet()) {
    print_note(
        "note: " + show_count(outcome.voxels_repainted) +
        " voxels were inverted, as one beside them, which was checked, was beyond the material tolerance; please "
        "report it with the mesh and the command");
  }
  if (!session.quiet()) warn_of_misfits(outcome);
  const bool held_some =
      outcome.voxels_cut > 0 || std::ranges::any_of(outcome.material_voxels, [](auto n) { return n > 0; });
  if (!session.quiet() && outcome.voxel_count == 0 && held_some) {
    print_note("warning: nothing is printed: every voxel of these layers is cut out or left empty");
  }
}

void report_complete(const Session& session, const std::string& output, const PlannedJob& job) {
  if (session.options().json) {
    v1::CompleteLayers document;
    document.set_output(output);
    document.set_engine_version(job.plan.engine_version());
    if (job.key.share) *document.mutable_share() = document_of(*job.key.share);
    document.set_layers(job.layers());
    document.set_complete_before(true);
    return print_line(json_of(document));
  }
  print_line(show_count(job.layers(), "layer") + " -> " + output);
}

void warn_of_covered(const v1::SliceJob& job, const client::SliceOutcome& outcome) {
  if (outcome.voxels_covered == 0) return;
  const std::string pairs = part_pairs_text(job, outcome);
  print_note("warning: parts overlap in " + show_count(outcome.voxels_covered, "voxel") +
             (pairs.empty() ? "" : ": " + pairs) +
             ". Move them apart if that isn't meant; --overlaps refuse ends a job where they do");
}

void warn_of_materials(const client::SliceOutcome& outcome) {
  const auto& materials = outcome.header.printing().materials();
  std::vector<std::string> used, unused;
  for (int m = 0; m < materials.size(); ++m) {
    const auto index = static_cast<std::size_t>(m);
    const bool printed = index < outcome.material_voxels.size() && outcome.material_voxels[index] > 0;
    (printed ? used : unused).push_back(echoed(materials[m].name()));
  }
  if (unused.empty() || used.empty()) return;
  const std::string nowhere = "material" + std::string(unused.size() == 1 ? " " : "s ") +
                              echoed_list(unused, unused.size()) + " came out nowhere";
  print_note("warning: " + nowhere + (used.size() == 1 ? ": all voxels are of " + used.front() : "") +
             "; if that isn't meant, compare the channels' ranges (ccslice info) with the --map");
}

}  // namespace ccslice::cli
