// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory that calls may hold together, whatever their number. It is reserved before it is used, by estimate or by
// count. Nobody waits here: who gets none is refused, or waits in admission.h, where nobody can wait for another.
//
// Where shares say whose they are, a quarter of the budget is never one client's. But what is as large as the budget
// can get in where nothing else is: a share that is all that its client holds may grow into the last quarter, on loan.
// Once the loan has lasted for a while and others were refused meanwhile, it is overdue: the share grows no more, which
// ends what it is for; and for twice that while nothing is lent, so that these others have their turn. What wants to
// grow no more has to ask.

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

namespace ccslice::server {

/// Thread-safe.
class MemoryBudget {
 private:
  using ClientPtr = std::shared_ptr<const std::string>;  // To copy it never fails. Null: nobody.

 public:
  /// A part of a budget, given back with the object. Movable, not thread-safe. The budget outlives it.
  class [[nodiscard]] Share {
   public:
    Share() = default;
    /// `client`: whose it is (client_id.h); empty: nobody's, so that no client's part bounds it.
    explicit Share(MemoryBudget& budget, std::string client = {})
        : budget_(&budget),
          client_(client.empty() ? nullptr : std::make_shared<const std::string>(std::move(client))) {}
    Share(Share&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)),
          client_(std::move(other.client_)),
          bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(client_, other.client_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() { give_back(); }

    std::uint64_t bytes() const noexcept { return bytes_; }
    /// Takes more, or gives some back, of which nobody is told. False, with nothing changed, if the budget hasn't that
    /// much, or not for this client, or less than `left_bytes` would be left of it, or the machine has no memory to
    /// note it. REQUIRES: made from a budget, or bytes == 0.
    [[nodiscard]] bool resize(std::uint64_t bytes, std::uint64_t left_bytes = 0) noexcept;
    /// Keeps that much, and makes a share of its own of the rest. REQUIRES: bytes <= bytes().
    [[nodiscard]] Share split_off_beyond(std::uint64_t bytes) noexcept;
    /// Gives everything back and tells of it.
    void give_back();

   private:
    friend class MemoryBudget;
    MemoryBudget* budget_ = nullptr;
    ClientPtr client_;
    std::uint64_t bytes_ = 0;
  };

  static constexpr std::chrono::milliseconds kLoan{30'000};
  /// `given_back`: called after shares have given some back, on their threads; mustn't throw. `loan`: for so long the
  /// last quarter is lent though others want it.
  explicit MemoryBudget(std::uint64_t capacity_bytes, std::function<void()> given_back = {},
                        std::chrono::milliseconds loan = kLoan)
      : capacity_bytes_(capacity_bytes),
        most_of_one_(capacity_bytes - capacity_bytes / 4),
        loan_time_(loan),
        given_back_(std::move(given_back)) {}

  /// A share of `most` bytes while there is plenty, and less the fuller the budget is: at most a quarter of what is
  /// free, at least `least`. Nothing if not even that is free.
  [[nodiscard]] std::optional<Share> take_between(std::uint64_t least, std::uint64_t most);

  std::uint64_t capacity_bytes() const noexcept { return capacity_bytes_; }
  std::uint64_t used_bytes() const noexcept { return used_bytes_.load(); }
  /// In all, since the beginning.
  std::uint64_t given_back_bytes() const noexcept { return given_back_bytes_.load(); }
  /// Whether it takes a loan for one client to have so many.
  [[nodiscard]] bool is_lent(std::uint64_t bytes) const noexcept { return bytes > most_of_one_; }
  /// Whether the client has had the last quarter for too long. Then whoever holds it should give it back.
  [[nodiscard]] bool is_overdue(const std::string& client) noexcept;
  /// How many clients hold something.
  std::size_t clients() const;

 private:
  using Clock = std::chrono::steady_clock;
  /// The last quarter, lent to the one client that holds more than the rest.
  struct Loan {
    ClientPtr client;
    Clock::time_point since;
    bool is_wanted = false;  // Others were refused meanwhile.
  };

  [[nodiscard]] bool try_take(std::uint64_t bytes, std::uint64_t left_bytes) noexcept;
  [[nodiscard]] bool try_take(const Share& share, std::uint64_t bytes, std::uint64_t left_bytes) noexcept;
  [[nodiscard]] bool try_take_of(const Share& share, std::uint64_t& own, std::uint64_t bytes,
                                 std::uint64_t left_bytes) noexcept;
  void give_back(const Share& share, std::uint64_t bytes) noexcept;
  bool is_overdue_locked(const std::string& client, Clock::time_point now) noexcept;
  bool may_grow(const Share& share, std::uint64_t own, std::uint64_t bytes, Clock::time_point now) noexcept;

  const std::uint64_t capacity_bytes_, most_of_one_;
  const std::chrono::milliseconds loan_time_;
  const std::function<void()> given_back_;
  std::atomic<std::uint64_t> used_bytes_{0}, given_back_bytes_{0};
  mutable std::mutex mutex_;
  std::unordered_map<std::string, std::uint64_t> used_of_;  // Of clients that hold something.
  std::optional<Loan> loan_;
  Clock::time_point lends_again_;
};

}  // namespace ccslice::server
