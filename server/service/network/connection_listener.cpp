// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/connection_listener.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// What the server itself may open while it serves: gRPC's polls and events, files of its libraries.
constexpr std::size_t kReservedDescriptors = 64;
/// That long the listener takes nothing in, too, where files or memory run short.
constexpr auto kBetweenSweeps = 50ms, kBetweenTurns = 50ms;
constexpr auto kBetweenReports = 10s;
constexpr auto kUntilCallsShow = 250ms;
/// Of one socket at a time, so that others have their turn.
constexpr int kAcceptedAtOnce = 64;

Descriptor open_spare() { return Descriptor(open("/dev/null", O_RDONLY | O_CLOEXEC)); }

/// The other end sends no more.
bool has_left(const Descriptor& connection) {
  pollfd wait{.fd = connection.get(), .events = POLLRDHUP, .revents = 0};
  return poll(&wait, 1, 0) == 1;
}

bool is_shortage(int error) { return error == EMFILE || error == ENFILE; }
bool is_shortage_of_memory(int error) { return error == ENOBUFS || error == ENOMEM; }

}  // namespace

std::size_t connection_descriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const rlimit raised{.rlim_cur = limit.rlim_max, .rlim_max = limit.rlim_max};
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  const auto all = static_cast<std::size_t>(limit.rlim_cur), taken = open_descriptors() + kReservedDescriptors;
  return std::max(all > taken ? all - taken : 0, all / 4);
}

ConnectionListener::ConnectionListener(const std::string& address, const ConnectionLimits& limits)
    : limits_(limits), sockets_(address), table_(limits), spare_(open_spare()), stop_event_(eventfd(0, EFD_CLOEXEC)) {
  if (!stop_event_) throw std::runtime_error(std::string("can't make an event: ") + std::strerror(errno));
}

ConnectionListener::~ConnectionListener() { stop(); }

void ConnectionListener::start(HandOver hand_over, IsCrowded is_crowded) {
  hand_over_ = std::move(hand_over);
  is_crowded_ = std::move(is_crowded);
  thread_ = std::thread([this] { run(); });
}

void ConnectionListener::stop() {
  eventfd_write(stop_event_.get(), 1);
  if (thread_.joinable()) thread_.join();
  sockets_.close();
}

void ConnectionListener::run() {
  for (;;) {
    const std::vector<int> ready = wait_for_connections();
    if (std::ranges::find(ready, stop_event_.get()) != ready.end()) return;
    resting_ = false;
    for (const int listener : ready) accept_waiting(listener);
    hand_over_waiting();
    sweep();
    report_refusals();
  }
}

std::vector<int> ConnectionListener::wait_for_connections() const {
  std::vector<pollfd> waits = {{.fd = stop_event_.get(), .events = POLLIN, .revents = 0}};
  for (const Descriptor& socket : sockets_.descriptors()) {
    if (!resting_) waits.push_back({.fd = socket.get(), .events = POLLIN, .revents = 0});
  }
  std::vector<int> ready;
  if (poll(waits.data(), waits.size(), std::chrono::milliseconds(kBetweenSweeps).count()) <= 0) return ready;
  for (const pollfd& wait : waits) {
    if (wait.revents != 0) ready.push_back(wait.fd);
  }
  return ready;
}

void ConnectionListener::accept_waiting(int listener) {
  for (int i = 0; i < kAcceptedAtOnce && !resting_; ++i) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    Descriptor connection(
        accept4(listener, reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (connection) {
      take(std::move(connection), address);
    } else if (is_shortage(errno)) {
      if (!refuse_with_spare(listener)) return;
    } else if (is_shortage_of_memory(errno)) {
      resting_ = true;
    } else if (errno == EAGAIN) {
      return;
    }  // Whatever else there is was that one connection's end.
  }
}

void ConnectionListener::take(Descriptor connection, const sockaddr_storage& address) {
  const std::optional<Peer> peer = peer_of(address);
  const auto guard = std::make_shared<FrameGuard>(peer ? limits_.streams : 0);  // Calls don't tell their Unix socket.
  switch (table_.add(connection.get(), peer, std::chrono::steady_clock::now(), guard)) {
    case ConnectionVerdict::kTooMany: ++refused_; return;
    case ConnectionVerdict::kTooManyOfAddress: ++refused_of_address_; return;
    case ConnectionVerdict::kTaken: break;
  }
  if (!peer) return hand_over({std::move(connection), guard});
  const int on = 1;
  (void)setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  std::deque<Waiting>& others = waiting_[peer->site()];
  if (others.empty()) turns_.push_back(peer->site());
  others.push_back({std::move(connection), guard});
}

void ConnectionListener::hand_over(Waiting waiting) {
  const GuardedSessions sessions(waiting.guard);
  hand_over_(waiting.connection.release());
}

void ConnectionListener::hand_over_waiting() {
  while (!turns_.empty() && std::chrono::steady_clock::now() >= crowded_until_) {
    Waiting next = next_waiting();
    if (has_left(next.connection)) continue;
    hand_over(std::move(next));
    if (!is_crowded_ || !is_crowded_(count_just_taken())) continue;
    crowded_until_ = std::chrono::steady_clock::now() + kBetweenTurns;
    ++slowed_;
  }
}

ConnectionListener::Waiting ConnectionListener::next_waiting() {
  const Site site = turns_.front();
  turns_.pop_front();
  const auto of_site = waiting_.find(site);
  Waiting next = std::move(of_site->second.front());
  of_site->second.pop_front();
  if (of_site->second.empty()) {
    waiting_.erase(of_site);
  } else {
    turns_.push_back(site);
  }
  return next;
}

/// One more, with those of the last quarter of a second at least: by then calls that they begin have taken memory.
std::size_t ConnectionListener::count_just_taken() {
  const auto now = std::chrono::steady_clock::now();
  if (now - counted_ >= kUntilCallsShow) {
    taken_before_ = now - counted_ < 2 * kUntilCallsShow ? taken_ : 0;
    taken_ = 0;
    counted_ = now;
  }
  return ++taken_ + taken_before_;
}

bool ConnectionListener::refuse_with_spare(int listener) {
  spare_.close();
  Descriptor connection(accept4(listener, nullptr, nullptr, SOCK_CLOEXEC));
  const bool refused = static_cast<bool>(connection);
  connection.close();
  spare_ = open_spare();
  resting_ = !spare_;
  refused_without_descriptor_ += refused ? 1 : 0;
  return refused;
}

void ConnectionListener::sweep() {
  const std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now();
  if (now - swept_ < kBetweenSweeps) return;
  swept_ = now;
  if (!spare_) spare_ = open_spare();
  const ConnectionTable::Dropped dropped = table_.sweep(now);
  if (dropped.idle > 0) spdlog::info("dropped {} connections without calls (--connection-idle)", dropped.idle);
  if (dropped.arriving > 0) {
    spdlog::warn("dropped {} connections whose requests didn't arrive in whole (--idle-timeout)", dropped.arriving);
  }
  dropped_greedy_ += dropped.greedy;
  dropped_of_headers_ += dropped.headers;
  dropped_of_calls_ += dropped.calls;
}

/// Once for many: whoever floods the server must not flood its log.
void ConnectionListener::report_refusals() {
  const std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now();
  if (now - reported_ < kBetweenReports) return;
  if (slowed_ + dropped_of_headers_ + dropped_of_calls_ + refused_ + refused_of_address_ + refused_without_descriptor_ +
          dropped_greedy_ ==
      0)
    return;
  reported_ = now;
  if (slowed_ > 0) {
    spdlog::warn(
        "took {} connections one by one, each address in turn: memory would run short if all of them began calls at "
        "once (--memory)",
        std::exchange(slowed_, 0));
  }
  if (dropped_greedy_ > 0) {
    spdlog::warn(
        "dropped {} connections over which too much came of requests that weren't whole "
        "(--connection-budget-bytes)",
        std::exchange(dropped_greedy_, 0));
  }
  if (dropped_of_headers_ > 0) {
    spdlog::warn("dropped {} connections whose headers aren't HTTP/2's, or come to more than {} bytes with {} for each",
                 std::exchange(dropped_of_headers_, 0), HeaderSizes::kMostBytes, HeaderSizes::kHeaderBytes);
  }
  if (dropped_of_calls_ > 0) {
    spdlog::warn("dropped {} connections that began calls faster than they end (--max-connection-streams)",
                 std::exchange(dropped_of_calls_, 0));
  }
  if (refused_ > 0) {
    spdlog::warn("refused {} connections: {} are open (--max-connections)", std::exchange(refused_, 0), table_.size());
  }
  if (refused_of_address_ > 0) {
    spdlog::warn("refused {} connections of addresses that have {} open (--max-connections-per-address)",
                 std::exchange(refused_of_address_, 0), limits_.per_address);
  }
  if (refused_without_descriptor_ > 0) {
    spdlog::warn("refused {} connections for want of file descriptors: raise the limit of open files (ulimit -n)",
                 std::exchange(refused_without_descriptor_, 0));
  }
}

}  // namespace ccslice::server
