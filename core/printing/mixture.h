// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From channels' values to mixing fractions, by blocks of voxels. All maps end in the same rule: what is below 0, or no
// number, counts as 0; then all are divided by their sum; where that is 0 all is the map's first material.
//
//   table   (blends and curves) f_m(v) piecewise linear, held at its ends. A sum over the segments s of
//           clamp((v - v_s) / (v_s+1 - v_s), 0, 1) * (f_m,s+1 - f_m,s), without branches, for the usual short table; in
//           long ones the segment is looked for from that of the voxel before;
//   direct  f_m = v_m; a material that takes the rest gets max(0, 1 - sum);
//   colour  weights of the palette for the nearest colour that it reaches (colour_table.h).
//
// A voxel at which an override of the map holds is of that one's material alone, whatever the values are. Then those
// overrides follow that take the fraction of one material only.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/printing/colour_table.h"
#include "core/printing/printing.h"

namespace ccslice {

/// Voxels that are worked on together.
inline constexpr std::size_t kMixBlock = 64;

using MixRow = std::array<float, kMixBlock>;

/// What a block's voxels are mixed of: fractions[m - 1][k] of material m, at least 0, adding up to 1 but for rounding.
using Fractions = std::array<MixRow, kMaxPrintMaterials>;

/// Voxels whose values are more than kStrictSlack off what a map takes. The rule above made fractions of them.
struct MapMisfits {
  std::uint64_t off_map = 0;    // Some value, or a sum of fractions, is beyond the ends of what the map covers.
  std::uint64_t scaled_up = 0;  // Fractions add up to less than 1, and no material takes the rest.
  double least_sum = 1;         // Of the fractions of those.
};

class Mixture {
 public:
  /// What one of the printing's maps mixes. `colours` is that of the printing, colour_table_of(). REQUIRES:
  /// validate_printing() passes.
  Mixture(const Printing& printing, const MaterialMap& map, std::shared_ptr<const ColourTable> colours);

  std::size_t material_count() const noexcept { return material_count_; }
  /// The channels that evaluate() reads, in this order.
  const std::vector<std::string>& channels() const noexcept { return channels_; }

  /// values[c][k]: of channels()[c] at voxel k. All kMixBlock voxels are computed, whatever the values are.
  void evaluate(std::span<const MixRow> values, Fractions& fractions) const noexcept;

  /// The first of voxels [begin, end) whose values are more than kStrictSlack off what the map takes.
  [[nodiscard]] std::optional<std::size_t> first_misfit(std::span<const MixRow> values, std::size_t begin,
                                                        std::size_t end) const noexcept;

  /// Adds those of voxels [begin, end). Colours are off the map by their channels, not for being mixed by nothing.
  void count_misfits(std::span<const MixRow> values, std::size_t begin, std::size_t end,
                     MapMisfits& misfits) const noexcept;

 private:
  struct Table {
    std::vector<float> values;                                     // At the stops.
    std::vector<float> inverse_lengths;                            // 1 / length of the segments after the stops.
    std::vector<std::array<float, kMaxPrintMaterials>> fractions;  // At the stops.
  };
  struct Share {
    std::size_t row;       // In channels().
    std::size_t material;  // From 0.
  };
  struct Override {
    std::size_t row;  // In channels().
    float below;
    std::size_t material;  // From 0.
  };
  struct Replacement : Override {
    std::size_t instead_of;  // From 0.
  };
  struct Colours {
    std::array<std::size_t, 3> rows;
    float scale;  // From values to nodes.
    std::shared_ptr<const ColourTable> table;
  };

  void make_table(const BlendMap& map);
  void make_table(const CalibrationMap& map);
  void make_table(const ColourMap& map, std::shared_ptr<const ColourTable> colours);
  void make_table(const DirectMap& map);
  void finish_table();

  void mix_short_table(const MixRow& values, Fractions& fractions) const noexcept;
  void mix_long_table(const MixRow& values, Fractions& fractions) const noexcept;
  void mix_shares(std::span<const MixRow> values, Fractions& fractions) const noexcept;
  void mix_colours(std::span<const MixRow> values, Fractions& fractions) const noexcept;
  MixRow sum_of_shares(std::span<const MixRow> values) const noexcept;
  void mix_kind(std::span<const MixRow> values, Fractions& fractions) const noexcept;
  void override_kind(std::span<const MixRow> values, Fractions& fractions) const noexcept;
  void replace(std::span<const MixRow> values, Fractions& fractions) const noexcept;
  bool is_overridden(std::span<const MixRow> values, std::size_t voxel) const noexcept;
  bool table_fits(float value) const noexcept;
  bool shares_fit(std::span<const MixRow> values, std::size_t voxel) const noexcept;
  bool colour_fits(std::span<const MixRow> values, std::size_t voxel) const noexcept;

  enum class Kind : std::uint8_t { kPure, kShares, kTable, kColours };
  Kind kind_ = Kind::kPure;
  std::size_t material_count_;
  std::size_t first_ = 0;  // The map's first material, from 0.
  std::vector<std::string> channels_;
  Table table_;
  std::vector<Share> shares_;
  std::vector<Override> overrides_;
  std::vector<Replacement> replacements_;
  std::optional<std::size_t> rest_;
  Colours colours_;
};

/// Where the channels that a mixture reads are in a list that has them all.
std::vector<std::size_t> places_among(std::span<const std::string> channels, const Mixture& mixture);

}  // namespace ccslice
