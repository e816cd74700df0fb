// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The options that give a mesh file its size and its place: the unit of its coordinates, how large the part is to be,
// and where it is to lie. Sizes and places are those of the limit volume, which is what gets printed: it is smaller
// than its control mesh wherever edges aren't sharp. So edges are sharpened before a mesh is sized. --scale comes
// later, with the placement, but is allowed for: a size is the one that is printed, and the bed lies below the part as
// mirrored.

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::cli {

struct SizeOptions {
  std::string units = {};  // "mm", "cm", "m", "in" or "um".
  std::string size = {};   // "30" or "z=30", mm.
  bool center = false;
  bool on_bed = false;

  bool any() const { return !units.empty() || !size.empty() || center || on_bed; }
};

void add_size_options(CLI::App& command, SizeOptions& options);

/// What the options say.
struct Sizing {
  double mm_per_unit = 1;
  std::optional<double> side_mm = std::nullopt;  // What the limit's box is to measure.
  std::optional<int> axis = std::nullopt;        // Along this axis; along its longest side if there is none.
  bool center = false, on_bed = false;

  /// Whether a mesh is other than before.
  bool changes() const { return mm_per_unit != 1 || places(); }
  /// Whether it takes the limit's box.
  bool places() const { return side_mm || center || on_bed; }
};

/// Throws UsageError.
Sizing parse_sizing(const SizeOptions& options);

/// Turns the file's coordinates into mm.
void apply_units(const Sizing& sizing, ControlMesh& mesh);

/// Scaled about the origin, then moved.
struct Similarity {
  double scale = 1;
  Vec3 offset = Vec3::Zero();

  Vec3 operator()(const Vec3& position) const { return scale * position + offset; }
  void apply(ControlMesh& mesh) const;
};

/// Where a mesh was before it was brought near the origin: its positions are scale * (those of the file - home).
struct NearOrigin {
  double scale = 1;
  Vec3 home = Vec3::Zero();
};

/// Moves a mesh with coordinates beyond the limits to the origin, if the options say where the part goes, and gives it
/// some size if they say which. So the limits hold for what find_place() makes of it, and rounding is that of a part at
/// the origin.
NearOrigin bring_near(const Sizing& sizing, ControlMesh& mesh);

/// Where a mesh goes, and what moves a mirrored part back to where it would lie if it weren't mirrored: only --on-bed
/// puts it elsewhere.
struct PlaceOfMesh {
  Similarity similarity;
  Vec3 unmirrored = Vec3::Zero();
};

/// What takes the limit of a mesh, as bring_near() left it, to the size and the place that are meant once `scale` has
/// scaled it further. Adds a sentence on where the part is then to `notes`. REQUIRES: a mesh that validate() takes.
/// Throws what preparing the mesh does.
PlaceOfMesh find_place(const SizeOptions& options, const Sizing& sizing, const Vec3& scale, const NearOrigin& near,
                       const ControlMesh& mesh, std::vector<std::string>& notes);

/// Adds a warning to `notes` if the mesh, scaled by `scale`, is so small or so large that its unit may be another one,
/// unless the options say that it is meant.
void warn_of_size(const SizeOptions& options, const Vec3& scale, const ControlMesh& mesh,
                  std::vector<std::string>& notes);

}  // namespace ccslice::cli
