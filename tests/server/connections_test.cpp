// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Connections that do little or nothing, to a real server.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "server/service/listen_socket.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using namespace std::string_literals;

grpc::Status ask(v1::SlicerService::Stub& stub) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 10s);
  v1::GetServerInfoResponse info;
  return stub.GetServerInfo(&context, v1::GetServerInfoRequest(), &info);
}

/// A connection without gRPC at its end.
class BareConnection {
 public:
  explicit BareConnection(const std::string& address) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
    EXPECT_EQ(connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }

  void send(const std::string& bytes) {
    EXPECT_EQ(write(socket_.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  /// Reads what comes until the server closes the connection. Whether it does so in time.
  bool is_closed_within(std::chrono::milliseconds limit) {
    const auto end = std::chrono::steady_clock::now() + limit;
    std::vector<char> dropped(1 << 16);
    pollfd wait{.fd = socket_.get(), .events = POLLIN, .revents = 0};
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
      if (left.count() <= 0 || poll(&wait, 1, static_cast<int>(left.count())) == 0) return false;
      if (read(socket_.get(), dropped.data(), dropped.size()) <= 0) return true;
    }
  }

 private:
  Descriptor socket_;
};

std::string frame(char kind, char flags, char stream, const std::string& payload) {
  return std::string{static_cast<char>(payload.size() >> 16),
                     static_cast<char>(payload.size() >> 8),
                     static_cast<char>(payload.size()),
                     kind,
                     flags,
                     '\0',
                     '\0',
                     '\0',
                     stream} +
         payload;
}

std::string literal(const std::string& name, const std::string& value) {
  return "\0"s + static_cast<char>(name.size()) + name + static_cast<char>(value.size()) + value;
}

const std::string kGreeting = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "");

/// A request that says it has 1 MB, and 32 KB of it.
std::string half_a_request() {
  const std::string headers = literal(":method", "POST") + literal(":scheme", "http") +
                              literal(":path", "/ccslice.v1.SlicerService/GetMesh") + literal(":authority", "server") +
                              literal("te", "trailers") + literal("content-type", "application/grpc");
  const std::string part(16'000, 'x');
  return frame(1, 4, 1, headers) + frame(0, 0, 1, "\0\0\x10\0\0"s) + frame(0, 0, 1, part) + frame(0, 0, 1, part);
}

TEST(Connections, AreRefusedBeyondTheirNumberAndTakenAgainWhenOthersHaveLeft) {
  ServerOptions options = test_options();
  options.max_connections = options.max_connections_per_address = 2;
  TestServer server(options);
  ASSERT_TRUE(ask(server.stub()).ok());
  {
    const auto second = server.new_stub();
    ASSERT_TRUE(ask(*second).ok());
    EXPECT_EQ(ask(*server.new_stub()).error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_TRUE(ask(server.stub()).ok());
  }
  EXPECT_TRUE(eventually([&] { return ask(*server.new_stub()).ok(); }, 5s));
}

TEST(Connections, WithoutCallsAreDroppedAndTheirClientsConnectAgain) {
  ServerOptions options = test_options();
  options.connection_idle = 300ms;
  TestServer server(options);
  BareConnection bare(server.server().address());
  bare.send(kGreeting);
  EXPECT_TRUE(bare.is_closed_within(5s));
  ASSERT_TRUE(ask(server.stub()).ok());
  EXPECT_TRUE(eventually([&] { return server.channel()->GetState(false) == GRPC_CHANNEL_IDLE; }, 5s));
  EXPECT_TRUE(ask(server.stub()).ok());
}

TEST(Connections, WithACallThatWaitsAreKept) {
  ServerOptions options = test_options();
  options.connection_idle = 300ms;
  TestServer server(options);
  grpc::ClientContext context;
  const auto call = server.stub().ProbePoints(&context);
  std::this_thread::sleep_for(2s);
  v1::ProbePointsRequest request;
  request.set_mesh_id("sha256:" + std::string(64, '0'));
  call->WriteLast(request, grpc::WriteOptions());
  EXPECT_EQ(failure_of(call->Finish()).reason, "MESH_MISSING");
}

TEST(Connections, WithRequestsThatDontComeInWholeAreDropped) {
  ServerOptions options = test_options();
  options.idle_timeout = 1s;
  TestServer server(options);
  BareConnection bare(server.server().address());
  bare.send(kGreeting + half_a_request());
  EXPECT_FALSE(bare.is_closed_within(500ms));
  EXPECT_TRUE(bare.is_closed_within(5s));
  EXPECT_TRUE(ask(server.stub()).ok());
}

TEST(Connections, OverAUnixSocketAreServed) {
  ServerOptions options = test_options();
  options.listen_address = "unix:/tmp/ccslice-connections-" + std::to_string(getpid());
  options.connection_idle = 300ms;
  TestServer server(options);
  EXPECT_TRUE(ask(server.stub()).ok());
  std::this_thread::sleep_for(1s);
  EXPECT_TRUE(ask(server.stub()).ok());
}

}  // namespace
}  // namespace ccslice::server
