// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Members that share time: whoever has had the least comes next. Time counts as long as a member is ACTIVE, which is
// as long as it wants some. What an active member would have had, if all of them could always use an even share, is the
// level's MIDDLE; who comes or comes back starts there, with neither a claim on the past nor a debt of it. How far a
// member gets away from the middle is bounded, so that one which couldn't use its share for long, or alone could use
// more, doesn't shut the others out later, or is shut out.

#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace ccslice::server {

/// A member's account.
struct FairShare {
  /// What a piece of work that is running counts before it is charged.
  static constexpr std::chrono::milliseconds kTurn{10};

  std::chrono::nanoseconds used{0};  // In the level's time.
  int running = 0;                   // Pieces of work.

  /// Who has had least comes first.
  std::chrono::nanoseconds had() const { return used + running * kTurn; }
};

/// Not thread-safe.
class FairLevel {
 public:
  /// How far from the middle a member may get.
  static constexpr std::chrono::seconds kMostApart{1};

  void enter(FairShare& member) {
    ++active_;
    member.used = std::max(member.used, middle_);
  }
  void leave() { --active_; }
  /// REQUIRES: the member is active.
  void charge(FairShare& member, std::chrono::nanoseconds time) {
    middle_ += time / static_cast<std::chrono::nanoseconds::rep>(active_);
    member.used = std::clamp(member.used + time, middle_ - kMostApart, middle_ + kMostApart);
  }
  /// Whether nothing would change if the member were forgotten and came back.
  bool is_even(const FairShare& member) const { return member.used <= middle_; }

 private:
  std::chrono::nanoseconds middle_{0};
  std::size_t active_ = 0;
};

}  // namespace ccslice::server
