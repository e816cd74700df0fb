// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/outline_lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

constexpr double kWhole = 255;  // Of a pixel.

/// The pixels from `first` to before `end` are those whose middles, half a pixel above their index, lie in [low, high].
struct PixelSpan {
  PixelSpan(double low, double high, std::uint32_t count)
      : first(within(std::ceil(low - 0.5), count)), end(within(std::floor(high - 0.5) + 1, count)) {}
  static std::uint32_t within(double index, std::uint32_t count) {
    return static_cast<std::uint32_t>(std::clamp(index, 0.0, static_cast<double>(count)));
  }
  std::uint32_t first, end;
};

/// How much of each pixel the lines cover. In pixels, from the picture's lower left corner.
class Coverage {
 public:
  /// `mixes`: whether pixels may be covered in part.
  Coverage(double width, bool mixes, std::uint32_t columns, std::uint32_t rows)
      : half_width_(0.5 * width),
        reach_(mixes ? half_width_ + 0.5 : std::max(half_width_, 0.5)),
        most_(std::min(width, 1.0)),
        mixes_(mixes),
        columns_(columns),
        rows_(rows),
        covered_(std::size_t{columns} * rows) {}

  /// A line, round at its ends.
  void add(const Vec2& a, const Vec2& b) {
    const Vec2 along = b - a;
    const double squared_length = along.squaredNorm();
    const auto [low, high] = std::minmax({a.y(), b.y()});
    const PixelSpan rows(low - reach_, high + reach_, rows_);
    for (std::uint32_t row = rows.first; row < rows.end; ++row) {
      const double y = row + 0.5;
      // Columns that what the line has within reach of the row comes from.
      double from = 0, to = 1;
      if (low < high) {
        from = std::clamp((y - reach_ - a.y()) / along.y(), 0.0, 1.0);
        to = std::clamp((y + reach_ - a.y()) / along.y(), 0.0, 1.0);
      }
      const auto [left, right] = std::minmax({a.x() + from * along.x(), a.x() + to * along.x()});
      const PixelSpan columns(left - reach_, right + reach_, columns_);
      for (std::uint32_t column = columns.first; column < columns.end; ++column) {
        const Vec2 middle(column + 0.5, y);
        const double share = squared_length > 0 ? std::clamp((middle - a).dot(along) / squared_length, 0.0, 1.0) : 0.0;
        cover(column, row, (middle - a - share * along).norm());
      }
    }
  }

  std::uint8_t at(std::uint32_t column, std::uint32_t row) const {
    return covered_[std::size_t{columns_} * row + column];
  }

 private:
  void cover(std::uint32_t column, std::uint32_t row, double distance) {
    double share = distance <= reach_ ? 1 : 0;
    if (mixes_) share = std::clamp(half_width_ + 0.5 - distance, 0.0, most_);
    std::uint8_t& covered = covered_[std::size_t{columns_} * row + column];
    covered = std::max(covered, static_cast<std::uint8_t>(std::lround(kWhole * share)));
  }

  double half_width_, reach_, most_;
  bool mixes_;
  std::uint32_t columns_, rows_;
  std::vector<std::uint8_t> covered_;
};

/// Puts a colour, as opaque as the pixel is covered, over what a pixel shows: all of it, or nothing.
void put_over(const Srgb& colour, std::uint8_t covered, std::uint8_t* rgba) {
  if (rgba[3] == 0) {
    std::ranges::copy(colour, rgba);
    rgba[3] = covered;
    return;
  }
  const double share = covered / kWhole;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    rgba[i] = static_cast<std::uint8_t>(std::lround(share * colour[i] + (1 - share) * rgba[i]));
  }
}

}  // namespace

void draw_lines(const PreviewColours& show, double times, PreviewPicture& picture, const CancellationToken& cancel) {
  constexpr std::size_t kLinesPerPoll = 1024;
  Coverage coverage(show.lines->width_pixels / times, show.content != PreviewContent::kHalftone, picture.columns,
                    picture.rows);
  const Vec2 pixel(picture.across_mm, picture.up_mm);
  std::size_t lines = 0;
  for (const std::vector<Vec2>& outline : picture.outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      if (lines++ % kLinesPerPoll == 0) cancel.throw_if_cancelled();
      coverage.add(outline[i].cwiseQuotient(pixel), outline[(i + 1) % outline.size()].cwiseQuotient(pixel));
    }
  }
  std::uint8_t* rgba = picture.rgba.data();
  for (std::uint32_t row = picture.rows; row-- > 0;) {
    for (std::uint32_t column = 0; column < picture.columns; ++column, rgba += 4) {
      const std::uint8_t covered = coverage.at(column, row);
      if (covered != 0) put_over(show.lines->colour, covered, rgba);
    }
  }
}

}  // namespace ccslice
