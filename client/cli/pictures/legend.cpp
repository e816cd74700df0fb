// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/legend.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "client/cli/pictures/pixel_font.h"
#include "core/base/number_text.h"

namespace ccslice::cli {
namespace {

// In dots of letters.
constexpr int kMargin = 4, kSpacing = 4, kBarHeight = 8, kTick = 2;
constexpr int kBarRowHeight = kBarHeight + kTick + 1 + kGlyphHeight;
constexpr int kNarrowest = 180, kLongestName = 120;
constexpr int kMostRows = 4;

const Colour kLineColour = Colour::Constant(60.0 / 255);

/// A smallest number of the form 1, 2 or 5 times a power of ten that isn't below `least`.
double round_step(double least) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= least) return digit * power;
  }
  return 10 * power;
}

/// Enough digits to tell numbers apart that differ by a hundredth of the range.
int digits_for(double low, double high) {
  constexpr double kFewest = 4, kMost = 9;
  const double largest = std::max(std::abs(low), std::abs(high));
  return static_cast<int>(std::clamp(2 + std::ceil(std::log10(largest / (high - low))), kFewest, kMost));
}

/// Writes below a picture, row by row.
class LegendWriter {
 public:
  LegendWriter(const Picture& above, int scale)
      : scale_(scale), picture_(blank_picture(std::max(above.width, kNarrowest * scale), above.height)) {
    for (int row = 0; row < above.height; ++row) {
      const std::ptrdiff_t bytes = std::ptrdiff_t{3} * above.width;
      std::copy_n(above.rgb.begin() + row * bytes, bytes,
                  picture_.rgb.begin() + std::ptrdiff_t{3} * picture_.width * row);
    }
  }

  void write_bar(const std::string& title, double low, double high);
  void write_entries(const std::string& title, const std::vector<Legend::Entry>& entries);
  Picture take() { return std::move(picture_); }

 private:
  int dots(int count) const { return scale_ * count; }

  /// Makes room for a row at the bottom. The place of its top.
  int add_row(int height_dots) {
    const int top = picture_.height;
    picture_.height += dots(height_dots);
    picture_.rgb.resize(3 * static_cast<std::size_t>(picture_.width) * static_cast<std::size_t>(picture_.height), 255);
    return top;
  }

  void fill(int left, int top, int width, int height, const Colour& colour) {
    for (int row = top; row < top + height; ++row) {
      for (int column = left; column < left + width; ++column) set_colour(column, row, colour, picture_);
    }
  }

  void write_tick(int left, int width, int top, double share, const std::string& label, int& free_from, int free_to);
  void write_labels(int left, int width, int top, double low, double high);

  const int scale_;
  Picture picture_;
};

/// A line at a share of the bar and, where there is room from `free_from` to `free_to`, its label below.
void LegendWriter::write_tick(int left, int width, int top, double share, const std::string& label, int& free_from,
                              int free_to) {
  const int at = left + static_cast<int>(std::lround(share * (width - scale_)));
  fill(at, top, scale_, dots(kTick), kLineColour);
  const int label_width = text_width(label, scale_);
  const int label_left = std::clamp(at + scale_ / 2 - label_width / 2, left, left + width - label_width);
  if (label_left < free_from || label_left + label_width > free_to) return;
  draw_text(label, label_left, top + dots(kTick + 1), picture_, scale_);
  free_from = label_left + label_width + dots(kSpacing);
}

void LegendWriter::write_labels(int left, int width, int top, double low, double high) {
  const int digits = digits_for(low, high);
  const std::string last = number_text(high, digits);
  const int end = left + width, last_from = end - text_width(last, scale_);
  int free_from = left;
  write_tick(left, width, top, 0, number_text(low, digits), free_from, end);
  const int most = std::max(1, width / (dots(kSpacing) + text_width(last, scale_) + dots(kGlyphAdvance)));
  for (const double number : round_numbers_between(low, high, std::min(most, 9))) {
    const double share = (number - low) / (high - low);
    write_tick(left, width, top, share, number_text(number, digits), free_from, last_from - dots(kSpacing));
  }
  write_tick(left, width, top, 1, last, free_from, end);
}

void LegendWriter::write_bar(const std::string& title, double low, double high) {
  const int top = add_row(kBarRowHeight + 2 * kMargin) + dots(kMargin);
  const std::string name = fitting_text(title, picture_.width / 3, scale_);
  draw_text(name, dots(kMargin), top + scale_ / 2, picture_, scale_);
  const int left = dots(kMargin) + (name.empty() ? 0 : text_width(name, scale_) + dots(2 * kSpacing));
  const int width = picture_.width - dots(kMargin) - left;
  for (int column = 0; column < width; ++column) {
    fill(left + column, top, 1, dots(kBarHeight), material_colour((column + 0.5) / width));
  }
  write_labels(left, width, top + dots(kBarHeight), low, high);
}

void LegendWriter::write_entries(const std::string& title, const std::vector<Legend::Entry>& entries) {
  constexpr int kRowHeight = kBarHeight + kSpacing;
  const int first_top = add_row(kRowHeight + kMargin) + dots(kMargin);
  int top = first_top;
  const std::string name = fitting_text(title, picture_.width / 3, scale_);
  draw_text(name, dots(kMargin), top + scale_ / 2, picture_, scale_);
  const int indent = dots(kMargin) + text_width(name, scale_) + dots(2 * kSpacing);
  int left = indent;
  const int swatch = dots(kBarHeight), end = picture_.width - dots(kMargin);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const int room = std::min(dots(kLongestName), end - indent - swatch - dots(kSpacing));
    const std::string label = fitting_text(entries[i].name, room, scale_);
    const int width = swatch + dots(kSpacing) + text_width(label, scale_);
    if (left + width > end && left > indent) {
      if (top == first_top + (kMostRows - 1) * dots(kRowHeight)) {
        const int row = add_row(kRowHeight);
        draw_text("and " + std::to_string(entries.size() - i) + " more", indent, row, picture_, scale_);
        break;
      }
      left = indent;
      top = add_row(kRowHeight);
    }
    fill(left, top, swatch, swatch, kLineColour);
    fill(left + scale_, top + scale_, swatch - 2 * scale_, swatch - 2 * scale_, entries[i].colour);
    draw_text(label, left + swatch + dots(kSpacing), top + scale_ / 2, picture_, scale_);
    left += width + dots(3 * kSpacing);
  }
}

}  // namespace

std::vector<double> round_numbers_between(double low, double high, int most) {
  const double step = round_step((high - low) / (most + 1));
  std::vector<double> numbers;
  const double first = std::floor(low / step) + 1;
  for (int i = 0; i < most; ++i) {
    const double number = (first + i) * step;
    if (number > low && number < high) numbers.push_back(number);
  }
  return numbers;
}

Picture with_legend(Picture picture, const Legend& legend, int scale) {
  if (legend.empty()) return picture;
  LegendWriter writer(picture, scale);
  if (!legend.range) {
    writer.write_entries(legend.title, legend.entries);
  } else if (const auto [low, high] = *legend.range; low < high) {
    writer.write_bar(legend.title, low, high);
  } else {
    writer.write_entries(legend.title, {{number_text(low, 4) + " everywhere", material_colour(0)}});
  }
  return writer.take();
}

}  // namespace ccslice::cli
