// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/view/view_guard.h"

#include <array>
#include <cstdio>
#include <random>

namespace ccslice::cli {
namespace {

/// Browsers send cookies to all ports of a host: each view has one of its own.
std::string cookie_name(std::uint16_t port) { return "ccslice_view_" + std::to_string(port); }

/// The value of a cookie, empty if there is none of that name.
std::string_view cookie_of(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view pair = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    while (pair.starts_with(' ')) pair.remove_prefix(1);
    if (pair.starts_with(name) && pair.substr(name.size()).starts_with('=')) return pair.substr(name.size() + 1);
  }
  return {};
}

}  // namespace

bool ViewGuard::is_ours(std::string_view host) const {
  const std::string port = std::to_string(port_);
  return host == "127.0.0.1:" + port || host == "localhost:" + port;
}

bool ViewGuard::is_token(std::string_view text) const {
  // The time that comparing takes says nothing of where texts differ.
  unsigned different = text.size() == token_.size() ? 0 : 1;
  for (std::size_t i = 0; i < token_.size(); ++i) {
    const char other = i < text.size() ? text[i] : '\0';
    different |= static_cast<unsigned>(static_cast<unsigned char>(other) ^ static_cast<unsigned char>(token_[i]));
  }
  return different == 0;
}

std::optional<ViewRefusal> ViewGuard::refuse_stranger(const ViewRequest& request) const {
  constexpr int kMisdirected = 421, kForbidden = 403;
  constexpr std::string_view kScheme = "http://";
  if (!is_ours(request.host)) {
    return ViewRefusal{kMisdirected, "this address isn't the one that ccslice view printed: open that one"};
  }
  const bool own =
      request.origin.empty() || (request.origin.starts_with(kScheme) && is_ours(request.origin.substr(kScheme.size())));
  if (!own) return ViewRefusal{kForbidden, "a page of another site may not ask here"};
  return std::nullopt;
}

std::optional<ViewRefusal> ViewGuard::refuse_without_token(const ViewRequest& request) const {
  constexpr int kUnauthorized = 401;
  constexpr std::string_view kBearer = "Bearer ";
  if (is_token(cookie_of(request.cookie, cookie_name(port_)))) return std::nullopt;
  if (request.authorization.starts_with(kBearer) && is_token(request.authorization.substr(kBearer.size()))) {
    return std::nullopt;
  }
  return ViewRefusal{kUnauthorized,
                     "the token is missing or wrong: open the address that ccslice view printed, or send the header "
                     "Authorization: Bearer TOKEN"};
}

std::string ViewGuard::cookie() const {
  return cookie_name(port_) + "=" + token_ + "; Path=/; HttpOnly; SameSite=Strict";
}

std::string random_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", static_cast<unsigned>(random()));
    token += digits.data();
  }
  return token;
}

}  // namespace ccslice::cli
