// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory that calls may hold together, whatever their number. It is reserved before it is used, by estimate or by
// count. Nobody waits here: who gets none is refused, or waits in admission.h, where nobody can wait for another.

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

namespace ccslice::server {

/// Thread-safe.
class MemoryBudget {
 public:
  /// A part of a budget, given back with the object. Movable, not thread-safe. The budget outlives it.
  class [[nodiscard]] Share {
   public:
    Share() = default;
    explicit Share(MemoryBudget& budget) : budget_(&budget) {}
    Share(Share&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() { give_back(); }

    std::uint64_t bytes() const noexcept { return bytes_; }
    /// Takes more, or gives some back, of which nobody is told. False, with nothing changed, if the budget hasn't that
    /// much, or less than `left_bytes` would be left of it. REQUIRES: made from a budget, or bytes == 0.
    [[nodiscard]] bool resize(std::uint64_t bytes, std::uint64_t left_bytes = 0) noexcept;
    /// Keeps that much, and makes a share of its own of the rest. REQUIRES: bytes <= bytes().
    [[nodiscard]] Share split_off_beyond(std::uint64_t bytes) noexcept;
    /// Gives everything back and tells of it.
    void give_back();

   private:
    MemoryBudget* budget_ = nullptr;
    std::uint64_t bytes_ = 0;
  };

  /// `given_back`: called after shares have given some back, on their threads; mustn't throw.
  explicit MemoryBudget(std::uint64_t capacity_bytes, std::function<void()> given_back = {})
      : capacity_bytes_(capacity_bytes), given_back_(std::move(given_back)) {}

  /// A share of `most` bytes while there is plenty, and less the fuller the budget is: at most a quarter of what is
  /// free, at least `least`. Nothing if not even that is free.
  [[nodiscard]] std::optional<Share> take_between(std::uint64_t least, std::uint64_t most);

  std::uint64_t capacity_bytes() const noexcept { return capacity_bytes_; }
  std::uint64_t used_bytes() const noexcept { return used_bytes_.load(); }
  /// In all, since the beginning.
  std::uint64_t given_back_bytes() const noexcept { return given_back_bytes_.load(); }

 private:
  [[nodiscard]] bool try_take(std::uint64_t bytes, std::uint64_t left_bytes) noexcept;
  void give_back(std::uint64_t bytes) noexcept {
    used_bytes_.fetch_sub(bytes);
    given_back_bytes_.fetch_add(bytes);
  }

  const std::uint64_t capacity_bytes_;
  const std::function<void()> given_back_;
  std::atomic<std::uint64_t> used_bytes_{0}, given_back_bytes_{0};
};

}  // namespace ccslice::server
