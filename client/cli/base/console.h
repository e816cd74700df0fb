// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the user sees. Results go to standard output, everything else to standard error; with --json standard output is
// JSON only.

#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ccslice::cli {

/// The most that is shown of a server's message.
inline constexpr std::size_t kMaxMessageBytes = 2000;

/// Print one line, on standard output or on standard error. Texts of meshes, servers and files come here through
/// echoed(); whatever comes otherwise can't make a terminal do anything either, see harmless().
void print_line(const std::string& text);
void print_part(const std::string& text);  // Of a line.
void print_note(const std::string& text);

/// "12.3 MB", "0 B": decimal units.
std::string show_bytes(std::uint64_t bytes);
/// "507,012,345".
std::string show_count(std::uint64_t count);
/// "1 layer", "1,234 layers".
std::string show_count(std::uint64_t count, std::string_view noun);
/// "0.3 s", "42 s", "3 min 20 s", "2 h 5 min".
std::string show_duration(double seconds);
/// "83.53": up to 6 significant digits.
std::string show_number(double number);
/// "83.53 x 83.53 x 17.28".
std::string show_size(double x, double y, double z);
/// "(0, -10, 3.5)".
std::string show_place(const std::array<double, 3>& place);
/// "83.53 x 83.53 x 17.28 mm, from (0, -10, 3.5)". What is below the digits of the size is shown as 0.
std::string show_box(const std::array<double, 3>& low, const std::array<double, 3>& high);

/// How long the rest takes at the pace so far. Nothing while that tells little: after a few seconds, or a few pieces of
/// many.
std::optional<double> seconds_left(std::uint64_t done, std::uint64_t total, double seconds);

/// How far a job is: a bar that moves with rate and remaining time where standard error is a terminal; a line now and
/// then where it isn't; nothing if quiet.
class Progress {
 public:
  /// `what`: "slicing", `unit`: "layers". `done_before`: what was done before the clock of the rate began.
  Progress(std::string what, std::string unit, std::uint64_t total, bool quiet, std::uint64_t done_before = 0);
  /// Leaves the last state standing.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::uint64_t done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string state(double seconds) const;
  void draw(Clock::time_point now);

  const std::string what_, unit_;
  const std::uint64_t total_, done_before_;
  const bool terminal_, quiet_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_ = start_;
  std::uint64_t done_ = 0, drawn_done_ = 0;
  bool on_screen_ = false;
  // The pace counts from the first piece on, which waits for what is prepared once.
  bool paced_ = false;
  Clock::time_point pace_start_ = start_;
  std::uint64_t pace_done_ = 0;
};

}  // namespace ccslice::cli
