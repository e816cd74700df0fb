// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/access.h"

#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "core/base/echo.h"
#include "server/service/base/file_version.h"
#include "server/service/base/limits.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kHash = "sha256:", kCertificate = "certificate", kAnonymous = "anonymous";
constexpr std::string_view kCalls = "calls=", kExpires = "expires=";
constexpr std::size_t kMaxFileBytes = 16 << 20;
constexpr std::size_t kMaxNameBytes = 64;
constexpr std::size_t kMostCallsOfClient = 1'000'000;

TokenDigest digest_of(std::string_view token) {
  TokenDigest digest;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest.data());
  return digest;
}

std::string hex_of(const TokenDigest& digest) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

/// Every byte is looked at, wherever the first difference is.
bool are_same(const TokenDigest& a, const TokenDigest& b) { return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0; }

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameBytes && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-' || c == '@';
  });
}

bool is_token(std::string_view text) {
  return !text.empty() && text.size() <= kMaxTokenBytes &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

std::string require_name(const std::string& text) {
  if (is_name(text)) return text;
  throw std::invalid_argument("a name has 1 to 64 letters, digits, dots, hyphens, underscores or @");
}

Role parse_role(const std::string& text) {
  const auto name = std::find(kRoleNames.begin() + 1, kRoleNames.end(), text);
  if (name == kRoleNames.end()) throw std::invalid_argument("a role is read, write or admin");
  return static_cast<Role>(name - kRoleNames.begin());
}

TokenDigest parse_digest(std::string_view text) {
  TokenDigest digest;
  bool good = text.size() == kHash.size() + 2 * digest.size() && text.starts_with(kHash);
  for (std::size_t i = 0; good && i < digest.size(); ++i) {
    const char* const begin = text.data() + kHash.size() + 2 * i;
    good = std::from_chars(begin, begin + 2, digest[i], 16).ptr == begin + 2;
  }
  if (good) return digest;
  throw std::invalid_argument(
      "behind name and role stands sha256: and 64 hexadecimal digits (ccsliced --hash-token makes the line), or "
      "certificate");
}

std::size_t parse_calls(std::string_view text) {
  std::size_t calls = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), calls);
  if (error == std::errc() && end == text.data() + text.size() && calls >= 1 && calls <= kMostCallsOfClient) {
    return calls;
  }
  throw std::invalid_argument("calls= takes a number of calls, such as calls=8");
}

/// A day in UTC; the token holds until it ends. Given as the next day: in nanoseconds the clock ends in 2262.
std::chrono::sys_days parse_end_of_day(std::string_view text) {
  int year = 0;
  unsigned month = 0, day = 0;
  const char *at = text.data(), *const end = text.data() + text.size();
  const auto number = [&](auto& value) {
    const auto [next, error] = std::from_chars(at, end, value);
    const bool good = error == std::errc();
    at = next;
    return good;
  };
  const auto hyphen = [&] { return at != end && *at++ == '-'; };
  const bool parsed = number(year) && hyphen() && number(month) && hyphen() && number(day) && at == end;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!parsed || !date.ok()) throw std::invalid_argument("expires= takes a date, such as expires=2027-01-31");
  return std::chrono::sys_days(date) + std::chrono::days(1);
}

AccessRule parse_rule(const std::vector<std::string>& words) {
  AccessRule rule{
      .name = require_name(words[0]), .role = parse_role(words[1]), .token = {}, .max_calls = 0, .expires = {}};
  if (words.size() < 3 || words[2] != kCertificate) rule.token = parse_digest(words.size() < 3 ? "" : words[2]);
  for (std::size_t i = 3; i < words.size(); ++i) {
    const std::string_view word = words[i];
    if (word.starts_with(kCalls)) {
      rule.max_calls = parse_calls(word.substr(kCalls.size()));
    } else if (word.starts_with(kExpires)) {
      rule.expires = parse_end_of_day(word.substr(kExpires.size()));
    } else {
      throw std::invalid_argument("behind that stand calls=N and expires=YEAR-MONTH-DAY");
    }
  }
  return rule;
}

void add_line(const std::vector<std::string>& words, AccessRules& rules) {
  if (words.size() < 2) throw std::invalid_argument("a line has a name, a role, and how the client is known");
  if (words[0] == kAnonymous) {
    if (words.size() > 2) throw std::invalid_argument("behind anonymous stands a role, and nothing more");
    rules.anonymous = parse_role(words[1]);
    return;
  }
  const AccessRule rule = parse_rule(words);
  for (const AccessRule& other : rules.rules) {
    const bool same =
        rule.token ? other.token && are_same(*rule.token, *other.token) : !other.token && other.name == rule.name;
    if (same) throw std::invalid_argument("the token, or the certificate, has a line already, that of " + other.name);
  }
  rules.rules.push_back(rule);
}

ServiceError unknown_token(const std::string& why) {
  return ServiceError(ServiceErrorCode::kTokenUnknown,
                      why + ": ask the server's operator for a token (ccslice takes it from --token-file)");
}

/// Of "Bearer TOKEN". The scheme may be written in any case.
std::string_view token_of(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  const std::string_view scheme = authorization.substr(0, kScheme.size());
  const bool bearer = std::equal(scheme.begin(), scheme.end(), kScheme.begin(), kScheme.end(), [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
  if (!bearer) throw unknown_token("the authorization isn't \"Bearer TOKEN\"");
  const std::string_view token = authorization.substr(kScheme.size());
  if (!is_token(token)) throw unknown_token("the token isn't one: 1 to 4096 printable ASCII characters, no space");
  return token;
}

}  // namespace

AccessRules parse_access_rules(std::string_view text) {
  AccessRules rules;
  if (!text.empty() && text.back() != '\n') {
    throw std::invalid_argument("the last line doesn't end: the file is being written, or lacks a line end");
  }
  std::istringstream lines{std::string(text)};
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    std::istringstream stream(line.substr(0, line.find('#')));
    const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
    try {
      if (!words.empty()) add_line(words, rules);
    } catch (const std::invalid_argument& why) {
      throw std::invalid_argument("line " + std::to_string(number) + ": " + why.what());
    }
  }
  if (rules.rules.empty() && rules.anonymous == Role::kNone) {
    throw std::invalid_argument("no line says who may do anything");
  }
  return rules;
}

std::string access_line(const std::string& name, const std::string& role, std::string_view token) {
  if (require_name(name) == kAnonymous) throw std::invalid_argument("anonymous is who has no token");
  (void)parse_role(role);
  if (!is_token(token)) {
    throw std::invalid_argument("a token has 1 to 4096 printable ASCII characters, and no space");
  }
  return name + " " + role + " " + std::string(kHash) + hex_of(digest_of(token));
}

Access::Access(std::filesystem::path token_file) : file_(std::move(token_file)) {
  version_ = seen_ = file_version(file_);
  try {
    rules_ = read();
  } catch (const std::invalid_argument& why) {
    throw std::runtime_error("--token-file " + file_.string() + ": " + why.what());
  }
}

std::shared_ptr<const AccessRules> Access::read() const {
  std::ifstream stream(file_, std::ios::binary);
  std::string text(kMaxFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream.is_open() || stream.bad()) throw std::invalid_argument("the file can't be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxFileBytes) throw std::invalid_argument("the file has more than 16 MiB");
  return std::make_shared<const AccessRules>(parse_access_rules(text));
}

std::shared_ptr<const AccessRules> Access::rules() const {
  const std::lock_guard lock(mutex_);
  return rules_;
}

bool Access::reload(bool always) {
  if (is_open()) return false;
  const FileVersion now = file_version(file_);
  const bool rests = now == std::exchange(seen_, now);
  if (!always && (now == version_ || !rests)) return false;
  version_ = now;
  try {
    std::shared_ptr<const AccessRules> fresh = read();
    spdlog::info("the token file has been read: {} lines", fresh->rules.size());
    const std::lock_guard lock(mutex_);
    rules_ = std::move(fresh);
    return true;
  } catch (const std::invalid_argument& why) {
    spdlog::error("the token file isn't taken, what was read before holds: {}: {}", file_.string(), why.what());
    return false;
  }
}

Identity Access::identify(const Credentials& credentials, Clock::time_point now) const {
  Identity identity{.client = credentials.address, .role = Role::kAdmin, .is_named = false, .max_calls = 0};
  if (!credentials.certificate.empty()) {
    identity.client = "certificate " + credentials.certificate;
    identity.is_named = true;
  }
  if (is_open()) return identity;
  const std::shared_ptr<const AccessRules> rules = this->rules();
  identity.role = rules->anonymous;
  std::optional<TokenDigest> digest;
  if (credentials.authorization) digest = digest_of(token_of(*credentials.authorization));
  const AccessRule* found = nullptr;
  for (const AccessRule& rule : rules->rules) {
    const bool matches =
        digest ? rule.token && are_same(*rule.token, *digest) : !rule.token && rule.name == credentials.certificate;
    if (matches) found = &rule;
  }
  if (digest && found == nullptr) throw unknown_token("the server doesn't know the token");
  if (found == nullptr) return identity;
  if (found->expires && std::chrono::floor<std::chrono::days>(now) >= *found->expires) {
    throw unknown_token("the token, or the certificate's line, of " + found->name + " has expired");
  }
  return {.client = found->name, .role = found->role, .is_named = true, .max_calls = found->max_calls};
}

void Access::require(const Identity& identity, Role role) const {
  if (identity.role >= role) return;
  const std::string needed = kRoleNames[static_cast<std::size_t>(role)];
  if (!identity.is_named) {
    throw ServiceError(ServiceErrorCode::kTokenMissing, "the call needs a token of the role " + needed +
                                                            " and brings none: ask the server's operator " +
                                                            "for one (ccslice takes it from --token-file)");
  }
  throw ServiceError(ServiceErrorCode::kRoleMissing,
                     "the call needs the role " + needed + ", and \"" + echoed(identity.client) + "\" has the role " +
                         kRoleNames[static_cast<std::size_t>(identity.role)] + ": ask the server's operator for more");
}

ClientCalls::Share ClientCalls::open(const Identity& identity) {
  if (!identity.is_named) return {};
  const std::size_t most = identity.max_calls > 0 ? identity.max_calls : max_calls_;
  const std::lock_guard lock(mutex_);
  std::size_t& open = open_[identity.client];
  if (open >= most) {
    throw ServiceError(ServiceErrorCode::kClientLimit,
                       "\"" + echoed(identity.client) + "\" has " + std::to_string(open) +
                           " calls open, and may have no more: end some, or try again later",
                       kRetryDelay);
  }
  ++open;
  return Share(*this, identity.client);
}

void ClientCalls::close(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto open = open_.find(client);
  if (--open->second == 0) open_.erase(open);
}

}  // namespace ccslice::server
