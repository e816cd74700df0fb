// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What materials a map may give a voxel whose channels are known within bounds: by the rules of
// ccslice/v1/material.proto, in doubles. Only the mixes of colours come from core's table, which has tests of its own.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/printing/colour_table.h"
#include "core/printing/printing.h"

namespace ccslice::oracle {

inline constexpr double kRoundingOfShares = 1e-5;  // Of sums of floats, up to 20 of them.

struct Interval {
  double low = 0, high = 0;
};

/// Bounds on mixing fractions, by material from 0, and on the sums of the first of them.
struct MixBounds {
  std::array<Interval, kMaxPrintMaterials> shares;
  std::array<Interval, kMaxPrintMaterials + 1> sums;  // sums[m]: of materials 0 to m - 1.
};

/// By how much a channel's value changes where a map is steepest, for a fraction to go from 0 to 1.
double steepest_span_of(const MaterialMap& map);

class MapTruth {
 public:
  /// `colours`: colour_table_of() the printing. REQUIRES: validate_printing() passes; no two shares of a direct map
  /// have the same channel.
  MapTruth(const Printing& printing, const MaterialMap& map, std::shared_ptr<const ColourTable> colours);

  /// The channels that it reads, in its order, then those of its overrides. A channel may come several times.
  const std::vector<std::string>& channels() const { return channels_; }
  /// `values`: within what bounds each of channels() is. Floats' rounding is added.
  MixBounds bounds(std::span<const Interval> values) const;

 private:
  using Shares = std::array<double, kMaxPrintMaterials>;

  /// Between these the fractions are monotone in this channel, whatever the others are.
  void add_kinks(const Interval& within, std::vector<double>& places) const;
  Shares shares(std::span<const double> values) const;
  Shares overridden(Shares shares, std::span<const double> values) const;
  Shares table_shares(double value) const;
  Shares direct_shares(const DirectMap& map, std::span<const double> values) const;
  Shares colour_shares(const ColourMap& map, std::span<const double> values) const;

  const MaterialMap& map_;
  const std::size_t materials_;
  std::shared_ptr<const ColourTable> colours_;
  std::vector<std::string> channels_;
  std::vector<double> stops_;        // Of blends and curves,
  std::vector<Shares> stop_shares_;  // and what there is of each material.
};

}  // namespace ccslice::oracle
