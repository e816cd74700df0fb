// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/guarded_reads.h"

#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <string>

#include "server/service/base/descriptor.h"
#include "tests/server/service/http2_bytes.h"

namespace ccslice::server {
namespace {

const std::string kTooLarge = kGreeting + frame(kHeaders, 0, 1, literal("name", std::string(20'000, 'v')));

/// Two ends of a connection.
class Ends {
 public:
  Ends() {
    std::array<int, 2> both{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, both.data()), 0);
    here_ = Descriptor(both[0]);
    there_ = Descriptor(both[1]);
  }
  int here() const { return here_.get(); }
  void send(const std::string& bytes) {
    EXPECT_EQ(write(there_.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

 private:
  Descriptor here_, there_;
};

/// What comes, into two buffers, or -1.
ssize_t read_some(int descriptor, std::size_t size = 100'000) {
  std::string first(10, '\0'), second(size, '\0');
  std::array<iovec, 2> parts = {iovec{first.data(), first.size()}, iovec{second.data(), second.size()}};
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  errno = 0;
  return recvmsg(descriptor, &message, 0);
}

TEST(GuardedReads, EndWithAnErrorWhereTheGuardSaysSo) {
  Ends ends;
  const auto guard = std::make_shared<FrameGuard>(0);
  const GuardedReads reads(ends.here(), guard);
  ends.send(kGreeting);
  EXPECT_EQ(read_some(ends.here()), static_cast<ssize_t>(kGreeting.size()));
  EXPECT_EQ(guard->fault(), FrameGuard::Fault::kNone);
  ends.send(kTooLarge.substr(kGreeting.size()));
  EXPECT_EQ(read_some(ends.here()), -1);
  EXPECT_EQ(errno, ECONNRESET);
  EXPECT_EQ(guard->fault(), FrameGuard::Fault::kHeaders);
}

TEST(GuardedReads, SeeNothingOfOthersNorOnceTheyAreGone) {
  Ends ends, others;
  const auto size = static_cast<ssize_t>(kTooLarge.size());
  {
    const GuardedReads reads(ends.here(), std::make_shared<FrameGuard>(0));
    others.send(kTooLarge);
    EXPECT_EQ(read_some(others.here()), size);
  }
  ends.send(kTooLarge);
  EXPECT_EQ(read_some(ends.here()), size);
  EXPECT_EQ(read_some(ends.here()), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST(GuardedReads, LeaveAloneWhateverHasTheNumberOfASocketThatIsGone) {
  Ends ends, others;
  const GuardedReads reads(ends.here(), std::make_shared<FrameGuard>(0));
  ASSERT_EQ(dup2(others.here(), ends.here()), ends.here());
  others.send(kTooLarge);
  EXPECT_EQ(read_some(ends.here()), static_cast<ssize_t>(kTooLarge.size()));
}

TEST(GuardedReads, AreThoseOfTheLastGuardOfANumber) {
  Ends ends;
  const auto second = std::make_shared<FrameGuard>(0);
  auto first_reads = std::make_unique<GuardedReads>(ends.here(), std::make_shared<FrameGuard>(0));
  const GuardedReads reads(ends.here(), second);
  first_reads.reset();
  ends.send(kTooLarge);
  EXPECT_EQ(read_some(ends.here()), -1);
  EXPECT_EQ(second->fault(), FrameGuard::Fault::kHeaders);
}

using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
using Session = std::unique_ptr<SSL, decltype(&SSL_free)>;

/// Both ends of a session without certificates.
class Sessions {
 public:
  explicit Sessions(const std::shared_ptr<FrameGuard>& guard) {
    for (const Context* const each : {&server_context_, &client_context_}) {
      SSL_CTX_set_max_proto_version(each->get(), TLS1_2_VERSION);
      SSL_CTX_set_security_level(each->get(), 0);
      EXPECT_EQ(SSL_CTX_set_cipher_list(each->get(), "aNULL"), 1);
    }
    {
      const GuardedSessions sessions(guard);
      server_.reset(SSL_new(server_context_.get()));
    }
    client_.reset(SSL_new(client_context_.get()));
    BIO *here = nullptr, *there = nullptr;
    BIO_new_bio_pair(&here, 1 << 17, &there, 1 << 17);
    SSL_set_bio(server_.get(), here, here);
    SSL_set_bio(client_.get(), there, there);
    SSL_set_accept_state(server_.get());
    SSL_set_connect_state(client_.get());
    for (int i = 0; i < 10; ++i) {
      SSL_do_handshake(client_.get());
      SSL_do_handshake(server_.get());
    }
    EXPECT_EQ(SSL_is_init_finished(server_.get()), 1);
  }

  void send(const std::string& bytes) {
    EXPECT_EQ(SSL_write(client_.get(), bytes.data(), static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  }
  /// How many bytes come, or minus SSL_get_error().
  int receive() {
    std::string bytes(1 << 16, '\0');
    int all = 0;
    for (;;) {
      const int some = SSL_read(server_.get(), bytes.data(), static_cast<int>(bytes.size()));
      if (some > 0) {
        all += some;
      } else {
        const int error = SSL_get_error(server_.get(), some);
        return error == SSL_ERROR_WANT_READ ? all : -error;
      }
    }
  }

 private:
  Context server_context_{SSL_CTX_new(TLS_server_method()), SSL_CTX_free};
  Context client_context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free};
  Session server_{nullptr, SSL_free}, client_{nullptr, SSL_free};
};

TEST(GuardedSessions, EndWithAnErrorWhereTheGuardSaysSo) {
  const auto guard = std::make_shared<FrameGuard>(0);
  Sessions sessions(guard);
  EXPECT_EQ(sessions.receive(), 0);
  sessions.send(kGreeting);
  EXPECT_EQ(sessions.receive(), static_cast<int>(kGreeting.size()));
  sessions.send(kTooLarge.substr(kGreeting.size()));
  EXPECT_EQ(sessions.receive(), -SSL_ERROR_SSL);
  EXPECT_EQ(guard->fault(), FrameGuard::Fault::kHeaders);
}

TEST(GuardedSessions, AreThoseThatAreMadeWhileItLives) {
  const auto guard = std::make_shared<FrameGuard>(0);
  { const GuardedSessions sessions(guard); }
  Sessions others(nullptr);
  others.send(kTooLarge);
  EXPECT_EQ(others.receive(), static_cast<int>(kTooLarge.size()));
  EXPECT_EQ(guard.use_count(), 1);
}

}  // namespace
}  // namespace ccslice::server
