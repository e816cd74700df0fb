// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One hostile job from its seed, sliced and compared:
//
// Every voxel of the job is inverted if it is small enough (HostileJob::most_inverted), else those of some layers drawn
// for it: the INVERTED layers.
//
//   tolerance   every voxel of the inverted layers against the same job with every voxel inverted: off by at most
//               tolerance * min(value range, range of the channel), by the strictest of the planes that show the
//               channel and of the maps that read it (whose value range is what they take from none of a material to
//               all of it where they are steepest), plus what the samples' rounding takes, plus what two
//               inversions may differ by (hostile_truth.h; a few 1e-6 mm of the materials' slope). Interpolation isn't
//               asked for more than that tolerance;
//   linear      every voxel of every layer, in channels that are linear in the position, against that position: off by
//               the same, plus how far off the solid a voxel inside the contours may be. Also right in folds;
//   truth       some random inverted voxels, and those beyond the tolerance, against the truth. Excused: those
//               near folds and overlaps, and off the solid where two places are as near. Where channels jump at an
//               interface, either side is right within what inversion accepts of it;
//   pieces      some hundred pieces of cells, and tiles, searched for where their polynomials are off most: by no more
//               than the tolerance, and where a piece's error is bounded, by no more than that bound. If jobs ask for
//               proof, all are;
//   shells      the same of the flat triangles up to which some of these pieces paint, against what inversion finds
//               there; up to 1.1 of the tolerance unless jobs ask for proof;
//   pictures    planes of all encodings and orders read back: sizes, checksums, alpha. All other checks are of what is
//               read;
//   occupancy   one layer against the winding numbers of its contours; all planes against one another; samples outside;
//   contours    those delivered are those of the inverted layers; each cell region's wind once round its voxels and not
//               round others, and together they have the area of the whole. Excused: folds;
//   regions     every voxel of the inverted layers: the cell region that planes show against that of the cell that
//               inversion finds. Excused: within the contours' tolerance of an interface, and near folds and overlaps;
//   printed     one material in each voxel inside and none outside, in all planes of all layers; of the inverted ones
//               every voxel's material against what the map of its cell region and the halftone make of the inverted
//               channels, within the tolerance of the channels;
//   strict      a strict map refuses the first layer with values beyond what it takes, as the inverted channels have
//               them, and no other; layers before are the same. Excused: folds;
//   unresolved  no voxel without a parameter, unless the solid reports folds;
//   bytes       the same on two threads, with the range split anywhere, and in a region.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "tests/oracle/hostile/hostile_finding.h"
#include "tests/oracle/hostile/hostile_mesh.h"

namespace ccslice::oracle {

enum class HostileCheck : std::uint8_t {
  kTolerance,
  kLinear,
  kTruth,
  kPieces,
  kShells,
  kPictures,
  kOccupancy,
  kContours,
  kRegions,
  kPrinted,
  kStrict,
  kUnresolved,
  kBytes
};
inline constexpr std::size_t kHostileChecks = 13;
std::string_view to_text(HostileCheck check);

struct HostileResult {
  std::uint64_t seed = 0;
  std::string description;  // Of the mesh and the job, in one line.
  std::string refused;      // Why the mesh is none, or the job.
  std::string broken;       // What was thrown that shouldn't be.
  std::array<HostileFinding, kHostileChecks> findings;
  std::uint64_t voxels = 0, interpolated = 0;
  bool every_voxel = false;  // Not only those of some layers were inverted and compared.
  double seconds = 0;

  HostileFinding& operator[](HostileCheck check) { return findings[static_cast<std::size_t>(check)]; }
  const HostileFinding& operator[](HostileCheck check) const { return findings[static_cast<std::size_t>(check)]; }
  bool failed() const;
};

struct HostileOptions {
  double most_voxels = 3e5;          // A job, those outside of the part included.
  std::span<const NamedMesh> files;  // Their shapes instead of made ones.
  bool only_linear = false;          // That check alone, which takes a tenth of the time.
  bool only_channels = false;        // Without cell regions, and no planes but those of channels and the occupancy.
  bool only_subdivided = false;      // No mesh is taken as meshed.
  bool prove = false;                // Jobs ask for SliceJob::prove_channels.
};

/// Throws nothing but std::bad_alloc.
HostileResult run_hostile_seed(std::uint64_t seed, const HostileOptions& options = {});

/// In one line: the seed, its job and what failed.
std::string to_text(const HostileResult& result);

}  // namespace ccslice::oracle
