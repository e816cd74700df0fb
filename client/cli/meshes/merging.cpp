// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/merging.h"

#include <optional>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/mesh_import/hanging_nodes.h"
#include "core/mesh_import/join_points.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/renumber_text.h"
#include "core/mesh_import/split_touching.h"

namespace ccslice::cli {
namespace {

constexpr int kLengthDigits = 3;

std::string mm_text(double mm) { return number_text(mm, kLengthDigits) + " mm"; }

void add_join_notes(const JoinReport& report, double distance_mm, std::vector<std::string>& notes) {
  if (report.places == 0) return;
  std::string note = show_count(report.joined + report.places) + " points lie in " +
                     show_count(report.places, "place") + " and become one vertex in each: they are " +
                     (report.farthest_apart_mm > 0 ? "up to " + mm_text(report.farthest_apart_mm) + " apart"
                                                   : "at the same coordinates");
  if (report.jumps > 0) note += "; at " + show_count(report.jumps) + " of them each cell region keeps its own values";
  notes.push_back(note + " (--no-merge keeps points apart)");
  if (report.chains > 0) {
    const PointChain& chain = report.longest_chain;
    notes.push_back("points within " + mm_text(distance_mm) + " of the next are joined to chains longer than that in " +
                    show_count(report.chains, "place") + ", the longest of " + show_count(chain.points) + " points, " +
                    mm_text(chain.length_mm) + " long, round " + place_in_mm(chain.place) +
                    "; if that isn't meant, give a smaller --merge-points");
  }
  if (report.disagreeing_edges > 0) {
    notes.push_back(show_count(report.disagreeing_edges, "edge") +
                    " or faces of joined cells have nodes in their middle that disagree in a channel; the first of "
                    "each is taken");
  }
  if (report.has_other_order) {
    notes.push_back(other_order_text(report.bent_by_mm, report.bent_edges));
  } else if (report.bent_edges > 0) {
    notes.push_back(show_count(report.bent_edges, "edge") +
                    " or faces of joined cells have nodes in their middle that are up to " +
                    mm_text(report.bent_by_mm) + " apart; the first of each is taken");
  }
}

/// The distance that a user may give to join what is so far apart.
std::string distance_for(double apart_mm) {
  constexpr double kMore = 1.1;
  return number_text(kMore * apart_mm, 2);
}

/// Cells without common points are parts of their own, which hardly anybody means.
void warn_of_parts(const MergeOptions& options, bool is_contract, double same_mm, const ControlMesh& mesh,
                   std::vector<std::string>& notes) {
  constexpr std::size_t kFewest = 3;
  constexpr double kNear = 1e-6;  // Of the part's size.
  const ConnectedParts parts = count_parts(mesh);
  if (parts.count < 2) return;
  const bool many = parts.of_one_cell >= kFewest && 2 * parts.of_one_cell > parts.count;
  Box3 box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  const double most_mm = kNear * box.diagonal().norm();
  if (!many && is_contract) return;
  const NearParts near = find_near_parts(mesh, most_mm);
  if (!many && near.count == parts.count) return;
  std::string note = "the mesh falls into " + show_count(parts.count) + " separate parts";
  if (many) note += ", " + show_count(parts.of_one_cell) + " of them of one cell";
  if (near.count == parts.count) {
    notes.push_back(note +
                    ", as cells are one part only by common points; --merge-points DISTANCE joins points that "
                    "are no farther apart, in mm");
    return;
  }
  note += "; points of different parts are ";
  note += near.apart_mm > 0 ? "no more than " + mm_text(near.apart_mm) + " apart" : "at the same coordinates";
  const std::string remedy = options.no_merge && near.apart_mm <= same_mm
                                 ? "without --no-merge there are "
                                 : "with --merge-points " + distance_for(near.apart_mm) + " there are ";
  notes.push_back(note + ": " + remedy + (near.count == 1 ? "no separate ones" : show_count(near.count) + " parts"));
}

/// Tells of cells in contact that have no common faces: the limit draws back from there on both sides.
void warn_of_hanging_nodes(const ControlMesh& mesh, const CellComplex& complex, std::vector<std::string>& notes) {
  if (mesh.as_meshed) return;
  const HangingNodes hanging = find_hanging_nodes(mesh, complex, same_place_mm(mesh));
  if (!hanging.any()) return;
  std::string what;
  if (hanging.edges > 0) what = show_count(hanging.edges, "edge") + " with a vertex of smaller cells in the middle";
  if (hanging.quadrilaterals > 0) {
    what += (what.empty() ? "" : " and ") + show_count(hanging.quadrilaterals, "quadrilateral") +
            " with two triangles on top";
  }
  notes.push_back("cells in contact have no common faces, at " + what + ", the first at " + place_in_mm(hanging.first) +
                  ": the limit draws back from there on both sides. --as-meshed slices the mesh as it is; else refine "
                  "both sides alike");
}

/// Joins points that differ in the last digit. False, and nothing is joined, if cells or values don't allow it: then
/// what the digits say is meant.
bool joins_by_digits(const SamePlace& same, MeshFile& file, JoinReport& report) {
  try {
    report = join_points(same.last_digit_mm, file.mesh, file.numbers, same.mm);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

void add_merge_options(CLI::App& command, MergeOptions& options) {
  const OptionGroup group(command, "Mesh");
  CLI::Option* distance =
      command
          .add_option("--merge-points", options.merge_points,
                      "Join points that are no farther apart than so many mm, measured after "
                      "--units and before --size. Default: a billionth of the part's size; if all "
                      "coordinates are single-precision numbers or have 6 to 9 digits, also points that differ in the "
                      "last one; in a .ccmesh or its .json none")
          ->check([](const std::string& text) { return text.empty() ? "it needs a distance" : ""; });
  command
      .add_flag("--no-merge", options.no_merge,
                "Keep points apart that lie in the same place: cells without common points are parts of their own")
      ->excludes(distance);
  command.add_flag("--no-split", options.no_split,
                   "Refuse meshes that touch themselves in edges or vertices, as those of voxels do, instead of giving "
                   "each side vertices of its own there");
}

void check_merge_options(const MergeOptions& options) {
  if (options.merge_points.empty()) return;
  if (parse_number("--merge-points", options.merge_points) < 0) {
    throw UsageError("--merge-points takes a distance in mm, 0 or more, not '" + options.merge_points + "'");
  }
}

bool merge_points(const MergeOptions& options, bool is_contract, const SamePlace& same, MeshFile& file) {
  JoinReport report;
  const bool asked = !options.merge_points.empty();
  if (!options.no_merge && (asked || !is_contract)) {
    double distance_mm = asked ? parse_number("--merge-points", options.merge_points) : same.mm;
    try {
      const bool by_digits = !asked && same.last_digit_mm > same.mm && joins_by_digits(same, file, report);
      if (by_digits) distance_mm = same.last_digit_mm;
      // A .ccmesh or its .json has no collapsed cells.
      const auto same_mm = is_contract ? std::nullopt : std::optional(same.mm);
      if (!by_digits) report = join_points(distance_mm, file.mesh, file.numbers, same_mm);
    } catch (const Error& error) {
      const char* remedy = error.code() == ErrorCode::kMeshBadChannel
                               ? " (--regions-from, --leave-out CHANNEL, --no-merge)"
                               : " (--merge-points DISTANCE, --no-merge)";
      throw Error(error.code(), error.what() + std::string(remedy), error.field(), error.ids());
    }
    add_join_notes(report, distance_mm, file.warnings);
  }
  warn_of_parts(options, is_contract, same.mm, file.mesh, file.warnings);
  return report.places > 0;
}

ConnectedMesh validate_split(const MergeOptions& options, ControlMesh& checked, ControlMesh& mesh, FileNumbers& numbers,
                             std::vector<std::string>& notes, bool& was_split) {
  was_split = false;
  try {
    return validate_and_connect(checked, {}, {});
  } catch (const Error& error) {
    const bool touches =
        error.code() == ErrorCode::kMeshNonManifoldEdge || error.code() == ErrorCode::kMeshNonManifoldVertex;
    if (!touches) throw;
    if (options.no_split) {
      throw Error(error.code(), std::string(error.what()) + ", or leave out --no-split: then each side gets its own",
                  error.field(), error.ids());
    }
  }
  const SplitReport report = split_touching(mesh, numbers);
  was_split = report.new_vertices > 0;
  std::string places;
  if (report.edges > 0) places = show_count(report.edges, "edge");
  if (report.vertices > 0) {
    places += (places.empty() ? "" : " and ") + show_count(report.vertices, "vertex");
  }
  const ConnectedParts parts = count_parts(mesh);
  std::string note = "the mesh touches itself in " + places + ", the first at " + place_in_mm(report.first) +
                     ": each side has vertices of its own there, " + show_count(report.new_vertices) + " more in all";
  if (report.faces > 0) {
    note += ", and " + show_count(report.faces, "face") + " between cells " + (report.faces == 1 ? "is" : "are") +
            " parted too, as the sides hang together all round";
  }
  if (parts.count > 1) {
    note += "; that makes " + show_count(parts.count) + " separate parts, " + show_count(parts.of_one_cell) +
            " of them of one cell";
  }
  notes.push_back(note + " (--no-split refuses such meshes)");
  checked = mesh;
  ConnectedMesh connected = validate_and_connect(checked, {}, {});
  warn_of_hanging_nodes(mesh, connected.complex, notes);
  return connected;
}

}  // namespace ccslice::cli
