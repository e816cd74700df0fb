// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The shares that decide what is painted: how much of a tolerance errors may take, and how far flat triangles may miss
// a block's faces. Each comes with what it rests on; docs/tolerance.md has the whole argument.

#pragma once

namespace ccslice {

// Shares of a channel's tolerance:

/// A bound of a piece's error. What it leaves is for places where two pieces meet: they may differ by it. With 0.85
/// the coyote's materials took 1.18 times as long as before there were bounds.
inline constexpr double kPieceShare = 0.92;
/// The error of a piece at its samples, where there is no bound. With 0.45 the engine took 1.1 and the grid 1.2 times
/// as long, with 0.60 the engine was no faster; of 26.8 million voxels of samples and real meshes the worst came to
/// 0.75 of its tolerance.
inline constexpr double kSampledPieceShare = 0.55;
/// The error of such a piece between its samples. Without looking there, voxels of a CAD part were a sixth beyond
/// 1/65536: five equidistant samples don't show errors of the fifth degree.
inline constexpr double kBetweenSamplesShare = 0.7;
/// The error seen there is taken to be at least this share of such a piece's largest. That is measured: of 266,000
/// random pieces 16 had an error 1.2 times as large as was seen, one 1.31 times.
inline constexpr double kSeenBetweenSamples = 0.75;
/// A bound of a tile's error. A tenth is left for what steep materials change beside the boundary.
inline constexpr double kTileShare = 0.9;
/// What the formula of a tile's bound yields where it bounds nothing, as a particle isn't in one patch.
inline constexpr double kSampledTileShare = 0.5;

// Shares of a block's thickness:

/// How far faces may bulge beyond flat triangles between neighbouring samples. Errors of cubics have grown threefold
/// there.
inline constexpr double kMostBulge = 0.05;
/// How far a face may miss its triangles by both of its arcs and its twist together. When only the larger arc counted,
/// voxels of thin saddles were 1.4 times beyond the tolerance.
inline constexpr double kMostMiss = 4 * kMostBulge;
/// How far faces may bulge between the samples that larger triangles take. Without that limit, voxels of thin pieces of
/// the engine were up to 17 % beyond the tolerance.
inline constexpr double kMostCoarseBulge = 0.01;
/// How far a piece may be followed beyond its triangles.
inline constexpr double kMostReachShare = 0.1;

}  // namespace ccslice
