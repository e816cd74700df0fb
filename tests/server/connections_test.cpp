// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Connections that do little or nothing, to a real server.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/rpc/server/health_client.h"
#include "server/service/network/listen_socket.h"
#include "tests/server/service/http2_bytes.h"
#include "tests/server/service/test_certificates.h"
#include "tests/server/test_meshes.h"
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

  void send(const std::string& bytes) { EXPECT_TRUE(sends(bytes)); }
  /// False once the server has closed it.
  bool sends(const std::string& bytes) {
    return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  int descriptor() const { return socket_.get(); }
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

/// The same, by TLS.
class TlsConnection {
 public:
  explicit TlsConnection(const std::string& address) : connection_(address) {
    SSL_set_fd(session_.get(), connection_.descriptor());
    const std::string protocols = "\x02h2";
    SSL_set_alpn_protos(session_.get(), reinterpret_cast<const unsigned char*>(protocols.data()), 3);
    EXPECT_EQ(SSL_connect(session_.get()), 1);
  }

  void send(const std::string& bytes) {
    EXPECT_EQ(SSL_write(session_.get(), bytes.data(), static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  }
  bool is_closed_within(std::chrono::milliseconds limit) { return connection_.is_closed_within(limit); }

 private:
  using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
  using Session = std::unique_ptr<SSL, decltype(&SSL_free)>;
  BareConnection connection_;
  Context context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free};
  Session session_{SSL_new(context_.get()), SSL_free};
};

/// How a call begins.
std::string headers_of(std::uint32_t stream, const std::string& path) {
  return frame(kHeaders, kEndHeaders, stream, request_list(path));
}
std::string headers(std::uint32_t stream, const std::string& method) {
  return headers_of(stream, "/ccslice.v1.SlicerService/" + method);
}

std::size_t threads_of_process() {
  const std::filesystem::directory_iterator all("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

/// A request that says it has 1 MB, and 32 KB of it.
std::string half_a_request(std::uint32_t stream = 1) {
  const std::string part = frame(kData, 0, stream, std::string(16'000, 'x'));
  return headers(stream, "GetMesh") + frame(kData, 0, stream, "\0\0\x10\0\0"s) + part + part;
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

TEST(Connections, TakeNoThreadForEachStreamOfReflection) {
  TestServer server;
  ASSERT_TRUE(ask(server.stub()).ok());
  const std::size_t before = threads_of_process();
  BareConnection bare(server.server().address());
  bare.send(kGreeting);
  for (std::uint32_t stream = 1; stream < 127; stream += 2) {
    bare.send(headers_of(stream, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"));
  }
  EXPECT_FALSE(eventually([&] { return threads_of_process() > before + 24; }, 2s)) << "of 63 streams";
  EXPECT_TRUE(ask(server.stub()).ok());
}

TEST(Connections, ToHealthTakeNoThreadForEachStreamOfReflectionEither) {
  ServerOptions options = test_options();
  options.health_address = "127.0.0.1:0";
  TestServer server(options);
  ASSERT_TRUE(ask(server.stub()).ok());
  const std::size_t before = threads_of_process();
  std::list<BareConnection> connections;
  for (int i = 0; i < 8; ++i) {
    BareConnection& bare = connections.emplace_back(server.server().health_address());
    bare.send(kGreeting);
    for (std::uint32_t stream = 1; stream < 31; stream += 2) {
      bare.send(headers_of(stream, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"));
    }
  }
  EXPECT_FALSE(eventually([&] { return threads_of_process() > before + 24; }, 2s)) << "of 120 streams";
  std::string explanation;
  EXPECT_TRUE(check_health(server.server().health_address(), explanation)) << explanation;
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

TEST(Connections, WithRequestsThatDontComeInWholeAreDroppedThoughOthersOfThemAreCancelled) {
  ServerOptions options = test_options();
  options.idle_timeout = 1s;
  TestServer server(options);
  const std::string service = "/ccslice.v1.SlicerService/";
  for (const std::string& path :
       {service + "GetMesh", service + "UploadMesh", service + "ProbePoints", service + "Preview",
        service + "NoSuchMethod", "/grpc.health.v1.Health/Check"s, "/grpc.health.v1.Health/Watch"s}) {
    BareConnection bare(server.server().address());
    bare.send(kGreeting + half_a_request() + headers_of(3, path) + reset(3));
    EXPECT_TRUE(bare.is_closed_within(5s)) << path;
  }
  EXPECT_TRUE(ask(server.stub()).ok());
}

TEST(Connections, WithRequestsThatDontComeInWholeAreFewAlsoWhereACallIsOpenOnEach) {
  ServerOptions options = test_options();
  options.connection_budget_bytes = 8 << 20;
  TestServer server(options);
  const std::string mesh_id = server.upload_good(make_box(2, 10));
  grpc::ClientContext context;
  const auto stub = server.new_stub();
  const auto points = stub->ProbePoints(&context);
  std::vector<std::unique_ptr<BareConnection>> all;
  for (int i = 0; i < 100; ++i) {  // 3.2 MB of the 2 MiB that may arrive.
    all.push_back(std::make_unique<BareConnection>(server.server().address()));
    all.back()->send(kGreeting + headers(1, "Preview"));
  }
  auto& calls = server.server().state().calls;
  ASSERT_TRUE(eventually([&] { return calls.open() == 101; }, 10s)) << calls.open();
  for (const auto& each : all) each->send(half_a_request(3));
  const auto dropped = [&] {
    return std::ranges::count_if(all, [](auto& each) { return each->is_closed_within(1ms); });
  };
  EXPECT_TRUE(eventually([&] { return dropped() >= 30; }, 10s)) << dropped();
  EXPECT_LE(dropped(), 60) << "until the others are within the bound";

  v1::ProbePointsRequest request;
  request.set_mesh_id(mesh_id);
  for (int i = 0; i < 3; ++i) request.add_points_mm(5);
  v1::ProbePointsResponse response;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(points->Write(request) && points->Read(&response)) << i;
  points->WritesDone();
  EXPECT_TRUE(points->Finish().ok());
  EXPECT_TRUE(ask(server.stub()).ok());
}

/// Sends a list of headers that goes on and on. How many bytes the server takes of it, up to 20 MB.
std::size_t taken_of_endless_list(const std::string& address, const std::string& first) {
  BareConnection bare(address);
  bare.send(kGreeting + frame(kHeaders, 0, 1, request_list("/ccslice.v1.SlicerService/GetServerInfo") + first));
  const std::string more = frame(kContinuation, 0, 1, std::string(4000, '\xbe'));
  std::size_t taken = 0;
  while (taken < (20 << 20) && bare.sends(more)) taken += more.size();
  return taken;
}

/// What the system keeps of a connection before it is closed.
constexpr std::size_t kInSockets = 10 << 20;

TEST(Connections, WithHeadersThatBecomeManyAreClosed) {
  ServerOptions options = test_options();
  options.health_address = "127.0.0.1:0";
  TestServer server(options);
  ASSERT_TRUE(ask(server.stub()).ok());
  const std::size_t before = resident_bytes();
  for (const std::string& address : {server.server().address(), server.server().health_address()}) {
    for (const std::string& kept : {literal(std::string(3900, 'x'), "", kKept),
                                    literal("x", std::string(3900, 'y'), kKept), literal("x", "", kKept)}) {
      EXPECT_LT(taken_of_endless_list(address, kept), kInSockets);
    }
  }
  if (!kKeepsFreedMemory) {
    EXPECT_LT(resident_bytes(), before + (32 << 20));
  }
  EXPECT_TRUE(ask(server.stub()).ok());
}

TEST(Connections, WithHeadersThatBecomeManyAreClosedBehindTlsToo) {
  const TestCertificates certificates;
  certificates.make("one", "localhost");
  ServerOptions options = test_options();
  options.tls = {
      .certificate = certificates.path("one.pem"), .key = certificates.path("one.key"), .client_authority = {}};
  TestServer server(options);
  TlsConnection honest(server.server().address()), bad(server.server().address());
  const std::string list = request_list("/ccslice.v1.SlicerService/GetServerInfo");
  const std::string kept = literal(std::string(3900, 'x'), "", kKept);
  honest.send(kGreeting + frame(kHeaders, kEndHeaders, 1, list + kept) + frame(kData, 1, 1, std::string(5, '\0')));
  bad.send(kGreeting + frame(kHeaders, kEndHeaders, 1, list + kept) +
           frame(kHeaders, kEndHeaders, 3, list + std::string(100, '\xbe')));
  EXPECT_TRUE(bad.is_closed_within(5s));
  EXPECT_FALSE(honest.is_closed_within(500ms));
}

TEST(Connections, ThatBeginCallsFasterThanTheyEndAreClosed) {
  ServerOptions options = test_options();
  options.max_connection_streams = 10;
  TestServer server(options);
  std::string calls = kGreeting;
  for (std::uint32_t stream = 1; stream < 200; stream += 2) calls += headers(stream, "GetServerInfo") + reset(stream);
  BareConnection bare(server.server().address());
  bare.send(calls);
  EXPECT_TRUE(bare.is_closed_within(5s));
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(ask(server.stub()).ok()) << i;
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
