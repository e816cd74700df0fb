// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the colours of a picture stand for: a bar with numbers for a channel, a name for each of some materials or cell
// regions.

#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/pictures/picture.h"

namespace ccslice::cli {

struct Legend {
  struct Entry {
    std::string name;
    Colour colour;
  };

  std::string title;                           // A channel's name, or what the entries are.
  std::optional<std::array<double, 2>> range;  // Of a channel: the values of material_colour(0) and material_colour(1).
  std::vector<Entry> entries;                  // Of materials or cell regions, from the first.

  /// Nothing to tell: the picture is of one colour.
  bool empty() const { return !range && entries.empty(); }
};

/// Round numbers that lie strictly between the two, `most` at most, ascending. REQUIRES: low < high, most > 0.
std::vector<double> round_numbers_between(double low, double high, int most);

/// The picture with the legend below, which takes up to four rows of names and leaves out what is beyond. Dots of
/// letters have scale x scale places. A narrow picture gets white at its right, for room. The picture itself if the
/// legend is empty. REQUIRES: scale > 0.
Picture with_legend(Picture picture, const Legend& legend, int scale);

}  // namespace ccslice::cli
