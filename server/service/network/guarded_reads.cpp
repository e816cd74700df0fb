// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/guarded_reads.h"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <utility>

namespace ccslice::server {
namespace {

using GuardPtr = std::shared_ptr<FrameGuard>;

/// Of a socket: gRPC closes it without a word, and its number may be another file's then.
struct Guarded {
  GuardPtr guard;
  dev_t device = 0;
  ino_t inode = 0;

  bool is(int descriptor) const {
    struct stat file {};
    return fstat(descriptor, &file) == 0 && file.st_dev == device && file.st_ino == inode;
  }
};

/// By descriptors.
class Guards {
 public:
  void set(int descriptor, GuardPtr guard) {
    struct stat file {};
    fstat(descriptor, &file);
    const std::lock_guard lock(mutex_);
    guards_[descriptor] = {std::move(guard), file.st_dev, file.st_ino};
  }
  /// Unless there is another one by now.
  void remove(int descriptor, const GuardPtr& guard) {
    const std::lock_guard lock(mutex_);
    const auto found = guards_.find(descriptor);
    if (found != guards_.end() && found->second.guard == guard) guards_.erase(found);
  }
  Guarded find(int descriptor) {
    const std::shared_lock lock(mutex_);
    const auto found = guards_.find(descriptor);
    return found != guards_.end() ? found->second : Guarded{};
  }

 private:
  std::shared_mutex mutex_;
  std::unordered_map<int, Guarded> guards_;
};

/// Lives as long as the process: other threads read to its very end.
Guards& guards() {
  static Guards& all = *new Guards;
  return all;
}

thread_local GuardPtr guard_of_sessions;

void begin_session(void*, void*, CRYPTO_EX_DATA* data, int index, long, void*) {
  if (guard_of_sessions) CRYPTO_set_ex_data(data, index, new GuardPtr(guard_of_sessions));
}
void end_session(void*, void* guard, CRYPTO_EX_DATA*, int, long, void*) { delete static_cast<GuardPtr*>(guard); }

int session_index() {
  static const int index = SSL_get_ex_new_index(0, nullptr, begin_session, nullptr, end_session);
  return index;
}

FrameGuard* guard_of(const SSL* session) {
  const auto* const guard = static_cast<const GuardPtr*>(SSL_get_ex_data(session, session_index()));
  return guard != nullptr ? guard->get() : nullptr;
}

bool pass(FrameGuard& guard, const void* bytes, std::size_t size) {
  return guard.take({static_cast<const std::uint8_t*>(bytes), size}, FrameGuard::Clock::now());
}

bool pass(FrameGuard& guard, const msghdr& message, std::size_t size) {
  for (std::size_t i = 0; i < message.msg_iovlen && size > 0; ++i) {
    const iovec& part = message.msg_iov[i];
    const std::size_t some = std::min(part.iov_len, size);
    if (!pass(guard, part.iov_base, some)) return false;
    size -= some;
  }
  return true;
}

}  // namespace

GuardedReads::GuardedReads(int descriptor, GuardPtr guard) : descriptor_(descriptor), guard_(std::move(guard)) {
  guards().set(descriptor_, guard_);
}
GuardedReads::~GuardedReads() { guards().remove(descriptor_, guard_); }

GuardedSessions::GuardedSessions(GuardPtr guard) {
  (void)session_index();
  guard_of_sessions = std::move(guard);
}
GuardedSessions::~GuardedSessions() { guard_of_sessions.reset(); }

}  // namespace ccslice::server

extern "C" {

/// libc's own does nothing else.
[[gnu::visibility("default")]] ssize_t recvmsg(int descriptor, msghdr* message, int flags) {
  const ssize_t size = syscall(SYS_recvmsg, descriptor, message, flags);
  if (size <= 0 || (flags & (MSG_ERRQUEUE | MSG_PEEK)) != 0) return size;
  const auto guarded = ccslice::server::guards().find(descriptor);
  if (!guarded.guard || ccslice::server::pass(*guarded.guard, *message, static_cast<std::size_t>(size)) ||
      !guarded.is(descriptor)) {
    return size;
  }
  errno = ECONNRESET;
  return -1;
}

[[gnu::visibility("default")]] int SSL_read(SSL* session, void* buffer, int size) {
  std::size_t read = 0;
  if (size < 0 || SSL_read_ex(session, buffer, static_cast<std::size_t>(size), &read) != 1) return -1;
  auto* const guard = ccslice::server::guard_of(session);
  if (guard == nullptr || ccslice::server::pass(*guard, buffer, read)) return static_cast<int>(read);
  ERR_raise(ERR_LIB_USER, ERR_R_OPERATION_FAIL);
  return -1;
}

}  // extern "C"
