// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

constexpr std::string_view kTlsScheme = "https://", kTlsPort = ":443";

[[noreturn]] void refuse_address(const std::string& message) {
  throw ClientError(grpc::StatusCode::INVALID_ARGUMENT, local_reason::kAddressInvalid, message);
}

bool has_grpc_scheme(std::string_view text) {
  constexpr std::array<std::string_view, 6> kSchemes = {"unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "xds:"};
  return std::ranges::any_of(kSchemes, [&](std::string_view scheme) { return text.starts_with(scheme); });
}

bool is_port(std::string_view text) {
  constexpr int kLastPort = 65'535;
  int port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, port);
  return status == std::errc() && stop == end && port > 0 && port <= kLastPort;
}

/// A number of IPv6 has colons of its own: it stands in brackets, or nobody knows where the port begins.
bool is_host(std::string_view text) {
  constexpr std::string_view kNever = "/ ,@?#[]";
  const bool bracketed = text.size() > 2 && text.front() == '[' && text.back() == ']';
  const std::string_view inside = bracketed ? text.substr(1, text.size() - 2) : text;
  return !inside.empty() && inside.find_first_of(kNever) == std::string_view::npos &&
         (bracketed || inside.find(':') == std::string_view::npos);
}

/// gRPC takes any number for a port, and says no more than that nobody is there. A name's port may be left out.
void require_ports(const std::string& text) {
  if (text.starts_with("unix") || text.starts_with("xds:")) return;
  std::istringstream parts(text.substr(text.find(':') + 1));
  for (std::string part; std::getline(parts, part, ',');) {
    part.erase(0, part.rfind('/') + 1);
    const std::size_t colon = part.rfind(':');
    if (colon == std::string::npos || (part.find(':') != colon && part[colon - 1] != ']')) continue;  // Of IPv6.
    const std::string port = part.substr(colon + 1);
    const bool is_number = !port.empty() && port.find_first_not_of("0123456789") == std::string::npos;
    if (is_number && !is_port(port)) refuse_address("there is no port " + port + ", as in '" + text + "'");
  }
}

using SocketAddresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

SocketAddresses socket_addresses(const std::string& host, const std::string& port) {
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_ADDRCONFIG | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int status = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  return {status == 0 ? found : nullptr, freeaddrinfo};
}

/// 10.0.0.1, [fd00::1].
std::string number_of(const addrinfo& address) {
  std::array<char, NI_MAXHOST> text = {};
  constexpr int kNumber = NI_NUMERICHOST;
  if (getnameinfo(address.ai_addr, address.ai_addrlen, text.data(), text.size(), nullptr, 0, kNumber) != 0) return "";
  std::string number = text.data();
  if (address.ai_family == AF_INET6) number.insert(0, 1, '[').push_back(']');
  return number;
}

bool is_loopback_number(const std::string& host) {
  in_addr old = {};
  if (inet_pton(AF_INET, host.c_str(), &old) == 1) return (ntohl(old.s_addr) >> 24) == 127;
  in6_addr number = {};
  if (inet_pton(AF_INET6, host.c_str(), &number) != 1) return false;
  return IN6_IS_ADDR_LOOPBACK(&number) || (IN6_IS_ADDR_V4MAPPED(&number) && number.s6_addr[12] == 127);
}

/// In lower case, without brackets, port, and a full stop at its end.
std::string host_of(std::string_view place) {
  const std::size_t colon = place.rfind(':');
  if (place.starts_with('[')) {
    place = place.substr(1, place.find(']') - 1);
  } else if (colon != std::string_view::npos && place.find(':') == colon) {
    place = place.substr(0, colon);
  }
  if (place.ends_with('.')) place.remove_suffix(1);
  std::string host(place);
  for (char& c : host) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return host;
}

/// Those that a target names: of dns://AUTHORITY/HOST:PORT, and of lists of numbers.
std::vector<std::string> hosts_of(std::string_view target) {
  if (has_grpc_scheme(target)) target.remove_prefix(target.find(':') + 1);
  target.remove_prefix(target.rfind('/') + 1);
  std::vector<std::string> hosts;
  std::istringstream places{std::string(target)};
  for (std::string place; std::getline(places, place, ',');) hosts.push_back(host_of(place));
  return hosts;
}

/// The first of them that is set; what it holds is in `value`.
template <std::size_t n>
std::string first_variable(const std::array<const char*, n>& names, std::string& value) {
  for (const char* name : names) {
    const char* const found = std::getenv(name);
    if (found == nullptr) continue;
    value = found;
    return name;
  }
  return "";
}

}  // namespace

Address parse_address(const std::string& text) {
  if (text == "unix:") refuse_address("unix: takes the path of a socket, as in unix:/run/ccsliced.sock");
  if (has_grpc_scheme(text)) {
    require_ports(text);
    return {text, "", "", false};
  }
  Address address;
  address.tls = text.starts_with(kTlsScheme);
  address.target = address.tls ? text.substr(kTlsScheme.size()) : text;
  if (address.tls && is_host(address.target)) address.target += kTlsPort;
  const std::size_t colon = address.target.rfind(':');
  if (colon != std::string::npos) {
    address.host = address.target.substr(0, colon);
    address.port = address.target.substr(colon + 1);
    if (is_host(address.host) && is_port(address.port)) return address;
  }
  refuse_address("an address is HOST:PORT, such as localhost:50051, https://HOST:PORT, or unix:PATH, not '" + text +
                 "'");
}

std::vector<Address> parse_addresses(const std::vector<std::string>& texts) {
  std::vector<Address> addresses;
  std::set<std::string> seen;
  for (const std::string& text : texts) {
    if (text.empty() && texts.size() > 1) refuse_address("an address of the list is empty: leave out a comma");
    addresses.push_back(parse_address(text));
    if (!seen.insert(addresses.back().target).second) {
      refuse_address("the address '" + text + "' is in the list twice: name each server once");
    }
  }
  if (addresses.empty()) refuse_address("there is no address of a server");
  return addresses;
}

bool is_name(const Address& address) {
  if (address.host.empty() || address.host == "localhost" || address.host.starts_with('[')) return false;
  in_addr number = {};
  return inet_pton(AF_INET, address.host.c_str(), &number) != 1;
}

bool is_loopback(const std::string& target) {
  if (target.starts_with("unix:") || target.starts_with("unix-abstract:")) return true;
  if (target.starts_with("xds:")) return false;
  const std::vector<std::string> hosts = hosts_of(target);
  return !hosts.empty() && std::ranges::all_of(hosts, [](const std::string& host) {
    return host == "localhost" || is_loopback_number(host);
  });
}

std::string proxy_variable(const std::string& target) {
  if (is_loopback(target) || target.starts_with("xds:")) return "";
  std::string proxy, exceptions;
  const std::string name = first_variable(std::array{"grpc_proxy", "https_proxy", "http_proxy"}, proxy);
  if (proxy.empty()) return "";
  first_variable(std::array{"no_grpc_proxy", "no_proxy"}, exceptions);
  const std::vector<std::string> hosts = hosts_of(target);
  std::istringstream parts(exceptions);
  for (std::string part; std::getline(parts, part, ',');) {
    if (!hosts.empty() && !part.empty() && hosts.front().ends_with(host_of(part))) return "";
  }
  return name;
}

std::vector<std::string> look_up(const std::string& host, const std::string& port) {
  const SocketAddresses found = socket_addresses(host, port);
  if (!found) return {};
  std::set<std::string> old_version, new_version;
  for (const addrinfo* address = found.get(); address != nullptr; address = address->ai_next) {
    const std::string number = number_of(*address);
    if (number.empty()) continue;
    (address->ai_family == AF_INET ? old_version : new_version).insert(number + ":" + port);
  }
  const std::set<std::string>& more = old_version.size() >= new_version.size() ? old_version : new_version;
  if (more.size() <= 1) return {host + ":" + port};
  return {more.begin(), more.end()};
}

}  // namespace ccslice::client
