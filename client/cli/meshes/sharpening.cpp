// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/sharpening.h"

#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_authoring/sharpen.h"

namespace ccslice::cli {
namespace {

/// `reentrant`: whether there are edges that aren't convex.
SharpFeatures by_angle(const SharpOptions& options, const ControlMesh& checked, std::vector<std::string>& notes,
                       bool& reentrant) {
  if (!(*options.angle_deg > 0) || *options.angle_deg > 180) {
    throw UsageError("--sharp-angle takes degrees, more than 0 and at most 180; 40 suits machined parts");
  }
  SharpEdges found = find_sharp_edges(checked, *options.angle_deg);
  std::string note = "edges that stay sharp: " + show_count(found.convex.size()) + " convex ones";
  std::string others;
  if (!found.reentrant.empty()) others = show_count(found.reentrant.size()) + " reentrant ones";
  if (!found.interface.empty()) {
    others += (others.empty() ? "" : " and ") + show_count(found.interface.size()) + " of interfaces";
  }
  reentrant = options.reentrant && !others.empty();
  if (options.reentrant) {
    note += " and " + (others.empty() ? "no reentrant ones" : others);
    for (const auto& edges : {found.reentrant, found.interface}) {
      found.convex.insert(found.convex.end(), edges.begin(), edges.end());
    }
  } else if (!others.empty()) {
    note += "; " + others + " stay smooth (--sharp-reentrant)";
  }
  notes.push_back(note);
  return {std::move(found.convex), {}};
}

SharpFeatures from_file(const std::string& path) {
  constexpr std::uint64_t kMaxFileBytes = 1ull << 30;
  const std::string text = read_file_bytes(path, kMaxFileBytes);
  try {
    return read_sharp_features(text);
  } catch (const Error& error) {
    throw Error(error.code(), path + ": " + error.what());
  }
}

}  // namespace

void add_sharp_options(CLI::App& command, SharpOptions& options) {
  const OptionGroup group(command, "Mesh");
  CLI::Option* angle = command.add_option("--sharp-angle", options.angle_deg,
                                          "Keep convex edges sharp where the surface of the control mesh turns by at "
                                          "least this many degrees (the edges of a box: 90)");
  command
      .add_flag("--sharp-reentrant", options.reentrant,
                "With --sharp-angle: keep reentrant edges sharp too, and those of interfaces between cell regions. "
                "Cells there often fold")
      ->needs(angle);
  command.add_option("--sharp-file", options.file,
                     "Keep the edges and corners of this list sharp: two vertices on a line for an edge, one for a "
                     "corner, counted from 0 as the file lists those that cells use");
}

void sharpen_listed(const SharpOptions& options, ControlMesh& mesh) {
  if (!options.file.empty()) add_sharp_features(from_file(options.file), mesh);
}

bool sharpen_by_angle(const SharpOptions& options, const ControlMesh& checked, ControlMesh& mesh,
                      std::vector<std::string>& notes) {
  if (!options.angle_deg) return false;
  bool reentrant = false;
  add_sharp_features(by_angle(options, checked, notes, reentrant), mesh);
  return reentrant;
}

}  // namespace ccslice::cli
