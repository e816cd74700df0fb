// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/console.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/base/count_text.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

constexpr std::chrono::milliseconds kRedrawPause{100};
constexpr std::chrono::milliseconds kLinePause{5000};

std::string formatted(const char* format, double number) {
  std::array<char, 64> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), format, number);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

}  // namespace

void print_line(const std::string& text) { std::fprintf(stdout, "%s\n", harmless(text).c_str()); }
void print_part(const std::string& text) { std::fputs(harmless(text).c_str(), stdout); }
void print_note(const std::string& text) { std::fprintf(stderr, "%s\n", harmless(text).c_str()); }

std::string show_bytes(std::uint64_t bytes) {
  static constexpr std::array<const char*, 5> kUnits = {" kB", " MB", " GB", " TB", " PB"};
  if (bytes < 1000) return std::to_string(bytes) + " B";
  double number = static_cast<double>(bytes) / 1000;
  std::size_t unit = 0;
  while (number >= 999.95 && unit + 1 < kUnits.size()) {
    number /= 1000;
    ++unit;
  }
  return formatted("%.1f", number) + kUnits[unit];
}

std::string show_count(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t at = digits.size(); at > 3; at -= 3) digits.insert(at - 3, ",");
  return digits;
}

std::string show_count(std::uint64_t count, std::string_view noun) {
  return show_count(count) + " " + (count == 1 ? std::string(noun) : plural_of(noun));
}

std::string show_duration(double seconds) {
  if (seconds < 10) return formatted("%.1f s", seconds);
  const auto whole = static_cast<std::uint64_t>(std::llround(seconds));
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

std::string show_number(double number) { return formatted("%.6g", number); }

std::string show_size(double x, double y, double z) {
  return show_number(x) + " x " + show_number(y) + " x " + show_number(z);
}

std::string show_place(const std::array<double, 3>& place) {
  return "(" + show_number(place[0]) + ", " + show_number(place[1]) + ", " + show_number(place[2]) + ")";
}

std::string show_box(const std::array<double, 3>& low, const std::array<double, 3>& high) {
  const double x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
  const double nothing = 5e-7 * std::max({x, y, z});  // Below the digits that the size is shown with.
  const auto shown = [&](double place) { return show_number(std::abs(place) < nothing ? 0 : place); };
  return show_size(x, y, z) + " mm, from (" + shown(low[0]) + ", " + shown(low[1]) + ", " + shown(low[2]) + ")";
}

std::optional<double> seconds_left(std::uint64_t done, std::uint64_t total, double seconds) {
  constexpr double kEarliest = 3, kLatest = 30, kEnough = 0.05;
  if (done == 0 || done >= total || seconds < kEarliest) return std::nullopt;
  const double fraction = static_cast<double>(done) / static_cast<double>(total);
  if (fraction < kEnough && seconds < kLatest) return std::nullopt;
  return seconds * (1 - fraction) / fraction;
}

Progress::Progress(std::string what, std::string unit, std::uint64_t total, bool quiet, std::uint64_t done_before)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(std::max<std::uint64_t>(total, 1)),
      done_before_(done_before),
      terminal_(isatty(STDERR_FILENO) != 0),
      quiet_(quiet) {}

Progress::~Progress() {
  if (quiet_ || !on_screen_) return;
  if (terminal_ || done_ != drawn_done_) draw(Clock::now());
  if (terminal_) std::fputc('\n', stderr);
}

void Progress::update(std::uint64_t done) {
  const Clock::time_point now = Clock::now();
  if (!paced_) {
    paced_ = true;
    pace_start_ = now;
    pace_done_ = done;
  }
  done_ = done;
  if (quiet_ || now - drawn_ < (terminal_ ? kRedrawPause : kLinePause)) return;
  draw(now);
}

void Progress::draw(Clock::time_point now) {
  drawn_ = now;
  drawn_done_ = done_;
  on_screen_ = true;
  const std::string text = state(std::chrono::duration<double>(now - start_).count());
  // Carriage return, and clear to the end of the line.
  std::fprintf(stderr, terminal_ ? "\r%s\x1b[K" : "%s\n", harmless(text).c_str());
  std::fflush(stderr);
}

std::string Progress::state(double seconds) const {
  const double fraction = std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_));
  const double rate = seconds > 0 ? static_cast<double>(done_ - done_before_) / seconds : 0;
  std::string text = what_ + " ";
  if (terminal_) {
    constexpr int kWidth = 24;
    const int filled = static_cast<int>(fraction * kWidth);
    text += "[" + std::string(static_cast<std::size_t>(filled), '=') +
            std::string(static_cast<std::size_t>(kWidth - filled), ' ') + "] ";
  }
  const bool bytes = unit_ == "bytes";
  const auto whole_rate = static_cast<std::uint64_t>(rate);
  text += bytes ? show_bytes(done_) + " of " + show_bytes(total_)
                : show_count(done_) + " of " + show_count(total_) + " " + unit_;
  text += ", " + (bytes ? show_bytes(whole_rate) : show_number(std::round(rate * 10) / 10)) + "/s";
  if (done_ >= total_) return text + ", " + show_duration(seconds);
  const double paced = std::chrono::duration<double>(drawn_ - pace_start_).count();
  const std::optional<double> left = seconds_left(done_ - pace_done_, total_ - pace_done_, paced);
  return left ? text + ", " + show_duration(*left) + " left" : text;
}

}  // namespace ccslice::cli
