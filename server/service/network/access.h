// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who a client is, and what it may do. The token file has a line for each token:
//
//   # name  role   how it is known                 options
//   farm    write  sha256:9f86d081884c7d65...      calls=8 expires=2027-01-31
//   cad     read   certificate
//   anonymous read
//
// Several lines of one name are one client. Of tokens only hashes are kept.

#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ccslice::server {

/// Each may do what those before it may.
enum class Role { kNone, kRead, kWrite, kAdmin };
inline constexpr std::array kRoleNames = {"none", "read", "write", "admin"};

using TokenDigest = std::array<std::uint8_t, 32>;

/// Longer tokens aren't looked at.
inline constexpr std::size_t kMaxTokenBytes = 4096;

struct AccessRule {
  std::string name;
  Role role = Role::kNone;
  std::optional<TokenDigest> token;              // None: the name of a certificate.
  std::size_t max_calls = 0;                     // 0: as others.
  std::optional<std::chrono::sys_days> expires;  // The first day on which it holds no longer, UTC.
};

struct AccessRules {
  std::vector<AccessRule> rules;
  Role anonymous = Role::kNone;
};

/// Throws std::invalid_argument: which line is wrong, and what it should be.
[[nodiscard]] AccessRules parse_access_rules(std::string_view text);

/// The line of a new token. Throws std::invalid_argument.
[[nodiscard]] std::string access_line(const std::string& name, const std::string& role, std::string_view token);

/// What a call says of itself.
struct Credentials {
  std::optional<std::string> authorization;  // The header, "Bearer TOKEN".
  std::string certificate;                   // The name in the client's certificate; empty if it showed none.
  std::string address;                       // client_id.h.
};

struct Identity {
  std::string client;  // Those of one name share time and limits.
  Role role = Role::kAdmin;
  bool is_named = false;      // By a token or a certificate; an address may be a proxy.
  std::size_t max_calls = 0;  // 0: as others.
};

/// Thread-safe.
class Access {
 public:
  using Clock = std::chrono::system_clock;

  /// Everybody may do everything.
  Access() = default;
  /// Throws std::runtime_error if the file can't be read or has a wrong line.
  explicit Access(std::filesystem::path token_file);

  /// Throws ServiceError{kTokenUnknown}.
  [[nodiscard]] Identity identify(const Credentials& credentials, Clock::time_point now = Clock::now()) const;
  /// Throws ServiceError{kTokenMissing, kRoleMissing}.
  void require(const Identity& identity, Role role) const;
  /// Reads the file again if it has changed, or if told so; a wrong one leaves the rules as they are. One that still
  /// changes from call to call is left for later, as somebody writes it. True if there are new rules. One thread at a
  /// time.
  bool reload(bool always);
  bool is_open() const { return file_.empty(); }

 private:
  std::shared_ptr<const AccessRules> rules() const;
  std::shared_ptr<const AccessRules> read() const;

  const std::filesystem::path file_;
  mutable std::mutex mutex_;
  std::shared_ptr<const AccessRules> rules_;
  std::array<std::int64_t, 4> version_{}, seen_{};  // Of the file: when it was read last, and looked at.
};

/// Counts the calls that each client has open. Thread-safe.
class ClientCalls {
 public:
  /// A call that is open. Movable.
  class [[nodiscard]] Share {
   public:
    Share() = default;
    Share(ClientCalls& calls, std::string client) : calls_(&calls), client_(std::move(client)) {}
    Share(Share&& other) noexcept : calls_(std::exchange(other.calls_, nullptr)), client_(std::move(other.client_)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(calls_, other.calls_);
      std::swap(client_, other.client_);
      return *this;
    }
    ~Share() {
      if (calls_ != nullptr) calls_->close(client_);
    }

   private:
    ClientCalls* calls_ = nullptr;
    std::string client_;
  };

  /// `max_calls`: of clients for which nothing else is said.
  explicit ClientCalls(std::size_t max_calls) : max_calls_(max_calls) {}

  /// Throws ServiceError{kClientLimit}.
  [[nodiscard]] Share open(const Identity& identity);

 private:
  void close(const std::string& client);

  const std::size_t max_calls_;
  std::mutex mutex_;
  std::map<std::string, std::size_t> open_;
};

}  // namespace ccslice::server
