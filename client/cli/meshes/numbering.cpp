// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/numbering.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/cli/output/documents.h"
#include "core/mesh/offenders.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice::cli {
namespace {

/// "3,17": what a server lists. Anything else is left out.
std::vector<std::int64_t> listed_ids(const client::ClientError& error) {
  std::vector<std::int64_t> ids;
  const auto list = error.metadata().find("ids");
  if (list == error.metadata().end()) return ids;
  for (const std::string& text : split(list->second, ',')) {
    std::int64_t id = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), id);
    if (status == std::errc() && end == text.data() + text.size()) ids.push_back(id);
  }
  return ids;
}

IdsInText ids_of(const v1::PlanWarning& warning) {
  // Only warnings of deviations name vertices, and they list none.
  IdsInText ids{{}, {{warning.control_cells().begin(), warning.control_cells().end()}}};
  if (warning.kind() != v1::PLAN_WARNING_KIND_DEVIATION) ids.vertices.emplace();
  return ids;
}

/// Servers list some of the cells that are meant, so those that aren't named can't be counted.
void name_cells(v1::PlanWarning& warning) {
  const IdsInText ids = ids_of(warning);
  if (ids.cells->empty() || names_any(warning.message(), ids)) return;
  const std::size_t named = std::min(ids.cells->size(), kMaxEchoItems);
  const std::string others = named < ids.cells->size() ? " and others" : "";
  warning.set_message(warning.message() + " (" +
                      named_ids(kCells, {ids.cells->begin(), ids.cells->begin() + static_cast<std::ptrdiff_t>(named)}) +
                      others + ")");
}

std::vector<std::int64_t> cells_at_fault(const v1::MeshSummary& mesh) {
  std::vector<std::int64_t> cells;
  for (const v1::FoldPlace& fold : mesh.folds()) cells.push_back(fold.control_cell());
  for (const v1::OverlapPlace& place : mesh.overlaps().places()) {
    cells.insert(cells.end(), {place.control_cell(), place.other_control_cell()});
  }
  return cells;
}

}  // namespace

client::ClientError renumbered(const client::ClientError& error, const FileNumbers& numbers) {
  const std::vector<std::int64_t> ids = listed_ids(error);
  return {error, ids.empty() ? error.what() : renumber_text(error.what(), numbers, {ids, ids})};
}

v1::PlanSlicesResponse renumbered(v1::PlanSlicesResponse plan, const FileNumbers& numbers) {
  for (v1::PlanWarning& warning : *plan.mutable_warnings()) {
    name_cells(warning);
    warning.set_message(renumber_text(warning.message(), numbers, ids_of(warning)));
  }
  return plan;
}

std::string describe(v1::PlanSlicesResponse plan, const FileNumbers& numbers) {
  std::vector<std::int64_t> cells;
  for (v1::PlanWarning& warning : *plan.mutable_warnings()) {
    name_cells(warning);
    cells.insert(cells.end(), warning.control_cells().begin(), warning.control_cells().end());
  }
  return renumber_text(describe(plan), numbers, {{}, cells});
}

std::string describe(const v1::MeshSummary& mesh, const FileNumbers& numbers) {
  return renumber_text(describe(mesh), numbers, {{{mesh.deviation().farthest_vertex()}}, cells_at_fault(mesh)});
}

std::string describe_faults(const v1::MeshSummary& mesh, const FileNumbers& numbers) {
  return renumber_text(describe_faults(mesh), numbers, {std::vector<std::int64_t>(), cells_at_fault(mesh)});
}

std::string describe(const v1::LimitDeviation& deviation, const FileNumbers& numbers) {
  return renumber_text(describe(deviation), numbers, {{{deviation.farthest_vertex()}}, std::vector<std::int64_t>()});
}

}  // namespace ccslice::cli
