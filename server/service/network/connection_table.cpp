// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/connection_table.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "server/service/network/listen_socket.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

constexpr std::array<std::uint8_t, 12> kMappedIpv4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
/// To look for connections that have left costs a system call for each: where a limit is reached, and else.
constexpr auto kBetweenLooks = 20ms, kBetweenIdleLooks = 500ms;
/// Greetings, certificates and pings take less, and so do many calls that are cancelled.
constexpr std::int64_t kArrivingBytes = 16 << 10;
constexpr std::int64_t kHeadersBytes = 8 << 10;  // Of a call, at most.
/// Where calls are open, a message has some time to be whole before it counts, as slow uploads send chunks of 1 MiB at
/// 100 KiB a second. What is more than one message has less.
std::chrono::milliseconds time_to_be_whole(std::int64_t bytes) {
  constexpr std::int64_t kOneMessageBytes = (4 << 20) + (64 << 10), kSlowBytesPerMs = 128;
  constexpr std::chrono::milliseconds kAtLeast = 1s, kAtMost = 10s;
  if (bytes > kOneMessageBytes) return kAtLeast;
  return std::min(kAtLeast + std::chrono::milliseconds(bytes / kSlowBytesPerMs), kAtMost);
}

bool is_ipv4(const Peer& peer) { return std::equal(kMappedIpv4.begin(), kMappedIpv4.end(), peer.address.begin()); }

Peer peer_of_ipv4(const in_addr& address, std::uint16_t port) {
  Peer peer{.port = port};
  std::copy(kMappedIpv4.begin(), kMappedIpv4.end(), peer.address.begin());
  std::memcpy(peer.address.data() + kMappedIpv4.size(), &address, sizeof address);
  return peer;
}

Peer peer_of_ipv6(const in6_addr& address, std::uint16_t port) {
  Peer peer{.port = port};
  std::memcpy(peer.address.data(), &address, sizeof address);
  return peer;
}

/// The address alone: no brackets, no zone of a link-local address.
std::string bare_host(std::string host) {
  for (const char* const bracket : {"[", "%5B", "]", "%5D"}) {
    const std::size_t at = host.find(bracket);
    if (at != std::string::npos) host.erase(at, std::strlen(bracket));
  }
  return host.substr(0, host.find('%'));
}

/// Bytes that the peer has sent and the kernel has acknowledged, without what HTTP/2 may have had it say to those that
/// were sent to him: updates of two windows, of 13 bytes each, where it reads 4 KiB, and besides an answer to a ping,
/// of 17, where it reads a single small message. So it may sink.
std::int64_t received_bytes(int descriptor) {
  constexpr std::uint64_t kReadByByte = 128, kByMessage = 64;
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return 0;
  if (size < offsetof(tcp_info, tcpi_data_segs_out) + sizeof info.tcpi_data_segs_out) return 0;
  return static_cast<std::int64_t>(info.tcpi_bytes_received) -
         static_cast<std::int64_t>(info.tcpi_bytes_acked / kReadByByte + info.tcpi_data_segs_out * kByMessage);
}

/// Stays that socket whatever happens to the number meanwhile. Nothing if the number stands for another file.
Descriptor duplicate_of(int descriptor, dev_t device, ino_t inode) {
  Descriptor socket(fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
  struct stat file {};
  if (!socket || fstat(socket.get(), &file) != 0 || file.st_dev != device || file.st_ino != inode) return {};
  return socket;
}

}  // namespace

std::array<std::uint8_t, 16> Peer::site() const {
  std::array<std::uint8_t, 16> site = address;
  if (!is_ipv4(*this)) std::fill(site.begin() + 8, site.end(), std::uint8_t{0});
  return site;
}

std::optional<Peer> peer_of(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address);
    return peer_of_ipv4(four.sin_addr, ntohs(four.sin_port));
  }
  if (address.ss_family != AF_INET6) return std::nullopt;
  const auto& six = reinterpret_cast<const sockaddr_in6&>(address);
  return peer_of_ipv6(six.sin6_addr, ntohs(six.sin6_port));
}

std::optional<Peer> parse_peer(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon < 5) return std::nullopt;
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, port);
  if (error != std::errc() || rest != end) return std::nullopt;
  const std::string host = bare_host(text.substr(5, colon - 5));
  in_addr four{};
  if (text.starts_with("ipv4:") && inet_pton(AF_INET, host.c_str(), &four) == 1) return peer_of_ipv4(four, port);
  in6_addr six{};
  if (text.starts_with("ipv6:") && inet_pton(AF_INET6, host.c_str(), &six) == 1) return peer_of_ipv6(six, port);
  return std::nullopt;
}

ConnectionVerdict ConnectionTable::add(int descriptor, const std::optional<Peer>& peer, Clock::time_point now,
                                       const std::shared_ptr<FrameGuard>& guard) {
  struct stat file {};
  fstat(descriptor, &file);
  const std::lock_guard lock(mutex_);
  // Whoever has its number, or its address, has left.
  if (const auto before = connections_.find(descriptor); before != connections_.end()) forget(before);
  if (peer) {
    const auto before = ids_.find(*peer);
    if (before != ids_.end()) forget(connections_.find(descriptors_.at(before->second)));
  }
  const auto refusal = [&] {
    if (connections_.size() >= limits_.connections) return ConnectionVerdict::kTooMany;
    const auto site = peer ? of_site_.find(peer->site()) : of_site_.end();
    if (site != of_site_.end() && site->second >= limits_.per_address) return ConnectionVerdict::kTooManyOfAddress;
    return ConnectionVerdict::kTaken;
  };
  if (refusal() != ConnectionVerdict::kTaken && now - looked_at_ >= kBetweenLooks) forget_left(now);
  if (const ConnectionVerdict verdict = refusal(); verdict != ConnectionVerdict::kTaken) return verdict;
  connections_[descriptor] = {.id = ++last_id_,
                              .device = file.st_dev,
                              .inode = file.st_ino,
                              .peer = peer,
                              .idle_since = now,
                              .served = now,
                              .whole = now,
                              .guard = guard};
  connections_[descriptor].reads =
      std::make_unique<GuardedReads>(descriptor, limits_.encrypted ? nullptr : guard);  // GuardedSessions see others.
  descriptors_[last_id_] = descriptor;
  if (peer) {
    ids_[*peer] = last_id_;
    ++of_site_[peer->site()];
  }
  return ConnectionVerdict::kTaken;
}

ConnectionTable::ConnectionId ConnectionTable::begin_call(const Peer& peer, CallKind kind) {
  const std::lock_guard lock(mutex_);
  const auto id = ids_.find(peer);
  if (id == ids_.end()) return 0;
  Connection& connection = connections_.at(descriptors_.at(id->second));
  ++connection.calls;
  connection.slicer_calls += kind == CallKind::kSlicer ? 1 : 0;
  connection.known_bytes += kHeadersBytes;
  return id->second;
}

void ConnectionTable::note_message(ConnectionId id, std::uint64_t bytes, Clock::time_point now) {
  constexpr std::int64_t kFrame = 16384, kFrameBytes = 16;  // Its header, and that of a message.
  const std::lock_guard lock(mutex_);
  const auto descriptor = descriptors_.find(id);
  if (descriptor == descriptors_.end()) return;
  Connection& connection = connections_.at(descriptor->second);
  connection.whole = now;
  connection.received_bytes = received_bytes(descriptor->second);
  connection.arriving_since.reset();
  const auto length = static_cast<std::int64_t>(bytes);
  connection.known_bytes += length + (length / kFrame + 1) * kFrameBytes;
}

void ConnectionTable::end_call(ConnectionId id, Clock::time_point now, bool served, CallKind kind) {
  const std::lock_guard lock(mutex_);
  const auto descriptor = descriptors_.find(id);
  if (descriptor == descriptors_.end()) return;
  Connection& connection = connections_.at(descriptor->second);
  connection.guard->note_end();
  --connection.calls;
  connection.slicer_calls -= kind == CallKind::kSlicer ? 1 : 0;
  connection.idle_since = now;
  if (!served) return;
  connection.served = connection.whole = now;
  connection.received_bytes = received_bytes(descriptor->second);
  connection.arriving_since.reset();
}

ConnectionTable::Dropped ConnectionTable::sweep(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const bool looks_closely = now - looked_closely_at_ >= kBetweenIdleLooks;
  if (looks_closely) {
    looked_closely_at_ = now;
    forget_left(now);
  }
  Dropped dropped = std::exchange(left_, {});
  for (auto& [descriptor, connection] : connections_) {
    drop_if_due(descriptor, connection, now, looks_closely, dropped);
  }
  if (limits_.arriving_bytes > 0 && some_arrives(now)) drop_greedy(now, dropped);
  return dropped;
}

/// Whether much has come over one of every few connections, others each time: who attacks has many of them, and to look
/// at thousands that are idle takes its time. REQUIRES: the lock.
bool ConnectionTable::some_arrives(Clock::time_point now) {
  constexpr std::size_t kParts = 4, kFew = 256;
  ++looks_;
  return std::ranges::any_of(connections_, [this, now](const auto& each) {
    const Connection& connection = each.second;
    if (connections_.size() > kFew && connection.id % kParts != looks_ % kParts) return false;
    return counted_bytes(each.first, connection, now) > 0;
  });
}

std::size_t ConnectionTable::size() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

/// REQUIRES: the lock.
void ConnectionTable::forget_left(Clock::time_point now) {
  looked_at_ = now;
  for (auto each = connections_.begin(); each != connections_.end();) {
    struct stat file {};
    const bool there =
        fstat(each->first, &file) == 0 && file.st_dev == each->second.device && file.st_ino == each->second.inode;
    each = there ? std::next(each) : forget(each);
  }
}

/// REQUIRES: the lock.
ConnectionTable::Connections::iterator ConnectionTable::forget(Connections::iterator connection) {
  const ConnectionId id = connection->second.id;
  const std::optional<Peer> peer = connection->second.peer;
  const FrameGuard::Fault fault = connection->second.guard->fault();
  left_.headers += fault == FrameGuard::Fault::kHeaders ? 1 : 0;
  left_.calls += fault == FrameGuard::Fault::kCalls ? 1 : 0;
  descriptors_.erase(id);
  if (peer) {
    ids_.erase(*peer);
    const auto site = of_site_.find(peer->site());
    if (--site->second == 0) of_site_.erase(site);
  }
  return connections_.erase(connection);
}

/// Whoever serves it closes it then. Whether it was still there.
bool ConnectionTable::shut_down(int descriptor, Connection& connection) {
  const Descriptor socket = duplicate_of(descriptor, connection.device, connection.inode);
  if (!socket) return false;
  shutdown(socket.get(), SHUT_RDWR);
  connection.dropped = true;
  return true;
}

/// Shuts down the first so many that are still there. Returns their number.
template <typename Ranked, typename ConnectionOf>
std::size_t ConnectionTable::shut_down_first(const std::vector<Ranked>& ranked, std::size_t count,
                                             ConnectionOf connection_of) {
  std::size_t dropped = 0;
  for (auto each = ranked.begin(); each != ranked.end() && dropped < count; ++each) {
    const Connections::iterator connection = std::invoke(connection_of, *each);
    if (shut_down(connection->first, connection->second)) ++dropped;
  }
  return dropped;
}

/// What has come over the connection and belongs to nothing that is whole. 0 if it's little, or has time to be whole.
std::int64_t ConnectionTable::counted_bytes(int socket, const Connection& connection, Clock::time_point now) {
  if (!connection.peer || connection.dropped) return 0;
  const bool is_open = connection.calls > 0;
  if (is_open && now - connection.whole < time_to_be_whole(0)) return 0;
  const std::int64_t bytes = received_bytes(socket) - connection.received_bytes;
  if (bytes < kArrivingBytes || (is_open && now - connection.whole < time_to_be_whole(bytes))) return 0;
  return bytes;
}

/// REQUIRES: the lock.
void ConnectionTable::drop_greedy(Clock::time_point now, Dropped& dropped) {
  struct Arriving {
    std::int64_t bytes;
    Connections::iterator connection;
  };
  std::vector<Arriving> all;
  std::int64_t sum = 0;
  for (auto each = connections_.begin(); each != connections_.end(); ++each) {
    const std::int64_t bytes = counted_bytes(each->first, each->second, now);
    if (bytes > 0) all.push_back({bytes, each});
    sum += bytes;
  }
  std::ranges::sort(all, std::greater<>(), &Arriving::bytes);
  for (const Arriving& most : all) {
    if (sum <= static_cast<std::int64_t>(limits_.arriving_bytes)) return;
    sum -= most.bytes;
    if (shut_down(most.connection->first, most.connection->second)) ++dropped.greedy;
  }
}

/// What has come over the connection and asked for nothing; 0 if it's little.
std::int64_t ConnectionTable::unserved_bytes(int socket, const Connection& connection, Clock::time_point now) {
  constexpr std::int64_t kGreetingBytes = 1024, kSomeMessagesBytes = 8 << 20;
  if (!connection.peer || connection.dropped) return 0;
  const std::int64_t all = received_bytes(socket), unknown = all - connection.known_bytes;
  if (unknown >= kSomeMessagesBytes) return unknown;
  if (connection.slicer_calls > 0) return 0;
  const std::int64_t pings = (now - connection.served) / 1s;  // More than the answers to the server's take.
  const std::int64_t bytes = all - connection.received_bytes;
  return bytes >= kGreetingBytes + pings ? bytes : 0;
}

std::size_t ConnectionTable::drop_unserved(std::size_t count, Clock::time_point now) {
  struct Unserved {
    std::int64_t bytes;
    Connections::iterator connection;
  };
  const std::lock_guard lock(mutex_);
  std::vector<Unserved> all;
  for (auto each = connections_.begin(); each != connections_.end(); ++each) {
    const std::int64_t bytes = unserved_bytes(each->first, each->second, now);
    if (bytes > 0) all.push_back({bytes, each});
  }
  std::ranges::sort(all, std::greater<>(), &Unserved::bytes);
  return shut_down_first(all, count, &Unserved::connection);
}

std::size_t ConnectionTable::drop_of_most_crowded(std::size_t count, Clock::time_point now) {
  constexpr std::size_t kFew = 32;
  static constexpr std::chrono::milliseconds kJustNow = 2s;
  const auto is_idle = [now](const Connection& connection) {
    return connection.peer && !connection.dropped && connection.slicer_calls == 0 &&
           now - std::max(connection.idle_since, connection.whole) >= kJustNow;
  };
  const std::lock_guard lock(mutex_);
  std::map<std::array<std::uint8_t, 16>, std::vector<Connections::iterator>> of_sites;
  for (auto each = connections_.begin(); each != connections_.end(); ++each) {
    if (is_idle(each->second)) of_sites[each->second.peer->site()].push_back(each);
  }
  const auto crowd = std::ranges::max_element(of_sites, {}, [](const auto& site) { return site.second.size(); });
  if (crowd == of_sites.end() || crowd->second.size() <= kFew) return 0;
  std::ranges::sort(crowd->second, {},
                    [](const auto& each) { return std::pair(each->second.served, each->second.id); });
  const std::size_t most = std::min(count, (crowd->second.size() - kFew + 1) / 2);
  return shut_down_first(crowd->second, most);
}

/// Whether much has come for as long as that may take, and still is no call. Notes since when.
bool ConnectionTable::arrives_for_too_long(int socket, Connection& connection, Clock::time_point now) const {
  if (limits_.arriving.count() == 0) return false;
  if (received_bytes(socket) < connection.received_bytes + kArrivingBytes) {
    connection.arriving_since.reset();
    return false;
  }
  if (!connection.arriving_since) connection.arriving_since = now;
  return now - *connection.arriving_since >= limits_.arriving;
}

/// What arrives is only looked at closely: that costs system calls.
void ConnectionTable::drop_if_due(int descriptor, Connection& connection, Clock::time_point now, bool looks_closely,
                                  Dropped& dropped) const {
  if (!connection.peer || connection.dropped || connection.calls > 0) return;
  const bool idle = limits_.idle.count() > 0 && now - connection.idle_since >= limits_.idle;
  const bool arriving = looks_closely && arrives_for_too_long(descriptor, connection, now);
  if ((idle || arriving) && shut_down(descriptor, connection)) ++(arriving ? dropped.arriving : dropped.idle);
}

}  // namespace ccslice::server
