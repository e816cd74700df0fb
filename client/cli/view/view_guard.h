// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who may use the page of `ccslice view`. Other programs of this machine and pages of other sites reach its port as
// well: a foreign page could send requests there, and by a name that it owns (DNS rebinding) read the answers too. So
// requests need the host that was printed, no foreign origin, and the token that only the printed address has.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ccslice::cli {

/// Headers of a request; empty if they aren't there.
struct ViewRequest {
  std::string_view host = {}, origin = {}, cookie = {}, authorization = {};
};

struct ViewRefusal {
  int status = 0;
  std::string message;
};

class ViewGuard {
 public:
  /// REQUIRES: a token of letters and digits.
  ViewGuard(std::uint16_t port, std::string token) : port_(port), token_(std::move(token)) {}

  /// For everything: what is wrong with the request's host or origin, if anything is.
  std::optional<ViewRefusal> refuse_stranger(const ViewRequest& request) const;
  /// For what needs the token: its cookie, or "Authorization: Bearer TOKEN".
  std::optional<ViewRefusal> refuse_without_token(const ViewRequest& request) const;
  bool is_token(std::string_view text) const;

  const std::string& token() const noexcept { return token_; }
  /// The header Set-Cookie that a page gets for the token.
  std::string cookie() const;

 private:
  bool is_ours(std::string_view host) const;

  std::uint16_t port_;
  std::string token_;
};

/// 128 random bits, as hexadecimal digits.
std::string random_token();

}  // namespace ccslice::cli
