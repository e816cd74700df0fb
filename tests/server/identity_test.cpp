// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tokens, certificates and figures, as clients and operators meet them.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/rpc/calls/call_log.h"
#include "server/rpc/server/health_client.h"
#include "server/rpc/server/metrics_page.h"
#include "server/service/meshes/mesh_id.h"
#include "server/service/network/access.h"
#include "tests/server/service/test_certificates.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class IdentityTest : public ::testing::Test {
 protected:
  IdentityTest() { write_tokens(); }

  void write_tokens(const std::string& more = "") const {
    std::ofstream(folder_ / "tokens") << access_line("reader", "read", "look") << " calls=2\n"
                                      << access_line("farm", "write", "work") << "\n"
                                      << access_line("boss", "admin", "rule") << "\n"
                                      << more;
  }
  ServerOptions options() const {
    ServerOptions options = test_options();
    options.token_file = folder_ / "tokens";
    options.max_calls_per_client = 4;
    return options;
  }
  static void show(grpc::ClientContext& context, const std::string& token) {
    context.AddMetadata("authorization", "Bearer " + token);
  }
  static Failure info(v1::SlicerService::Stub& stub, const std::string& token) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 10s);
    if (!token.empty()) show(context, token);
    v1::GetServerInfoResponse response;
    return failure_of(stub.GetServerInfo(&context, {}, &response));
  }
  static Failure preparation(v1::SlicerService::Stub& stub, const std::string& token) {
    grpc::ClientContext context;
    if (!token.empty()) show(context, token);
    v1::GetPreparationRequest request;
    request.set_mesh_id(mesh_id_of("x"));
    v1::GetPreparationResponse response;
    return failure_of(stub.GetPreparation(&context, request, &response));
  }
  static Failure list(v1::SlicerService::Stub& stub, const std::string& token) {
    grpc::ClientContext context;
    show(context, token);
    v1::ListMeshesResponse response;
    return failure_of(stub.ListMeshes(&context, {}, &response));
  }
  static Failure upload(v1::SlicerService::Stub& stub, const std::string& token) {
    grpc::ClientContext context;
    show(context, token);
    v1::UploadMeshResponse response;
    const auto stream = stub.UploadMesh(&context, &response);
    stream->WritesDone();
    return failure_of(stream->Finish());
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(IdentityTest, RolesDecide) {
  TestServer server(options());
  const Failure missing = info(server.stub(), "");
  EXPECT_EQ(missing.reason, "TOKEN_MISSING");
  EXPECT_EQ(missing.code, grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(info(server.stub(), "wrong").reason, "TOKEN_UNKNOWN");
  EXPECT_EQ(info(server.stub(), "look").code, grpc::StatusCode::OK);
  EXPECT_EQ(upload(server.stub(), "look").reason, "ROLE_MISSING");
  EXPECT_EQ(upload(server.stub(), "look").code, grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(upload(server.stub(), "work").reason, "REQUEST_MALFORMED");  // An empty one, but he may.
  EXPECT_EQ(preparation(server.stub(), "look").code, grpc::StatusCode::OK);
  EXPECT_EQ(preparation(server.stub(), "").reason, "TOKEN_MISSING");
  EXPECT_EQ(list(server.stub(), "work").reason, "ROLE_MISSING");
  EXPECT_EQ(list(server.stub(), "rule").code, grpc::StatusCode::OK);
  EXPECT_EQ(server.slice_failure(slice_request(mesh_id_of("x"), 1, 0, 1)).reason, "TOKEN_MISSING");
}

TEST_F(IdentityTest, TokensAreRenewedWhileItServes) {
  TestServer server(options());
  EXPECT_EQ(info(server.stub(), "fresh").reason, "TOKEN_UNKNOWN");
  write_tokens(access_line("reader", "read", "fresh") + "\n");
  for (int looks = 0; looks < 2; ++looks) server.server().reload(false);
  EXPECT_EQ(info(server.stub(), "fresh").code, grpc::StatusCode::OK);
  EXPECT_EQ(info(server.stub(), "look").code, grpc::StatusCode::OK);
  write_tokens("half a li");
  for (int looks = 0; looks < 2; ++looks) server.server().reload(false);
  EXPECT_EQ(info(server.stub(), "fresh").code, grpc::StatusCode::OK);
}

TEST_F(IdentityTest, OpenCallsEndOnceTheirTokenIsTakenAway) {
  TestServer server(options());
  const auto open = [&](grpc::ClientContext& context, const std::string& token) {
    show(context, token);
    return server.stub().ProbePoints(&context);
  };
  grpc::ClientContext of_farm, of_boss;
  const auto farm = open(of_farm, "work"), boss = open(of_boss, "rule");
  auto& calls = server.server().state().calls;
  ASSERT_TRUE(eventually([&] { return calls.open() == 2; }, 5s));
  server.server().reload(/*always=*/true);
  EXPECT_EQ(calls.open(), 2u) << "both may go on";

  std::ofstream(folder_ / "tokens") << access_line("boss", "admin", "rule") << "\n";
  server.server().reload(/*always=*/true);
  v1::ProbePointsResponse response;
  EXPECT_FALSE(farm->Read(&response));
  EXPECT_EQ(failure_of(farm->Finish()).reason, "TOKEN_UNKNOWN");
  EXPECT_TRUE(eventually([&] { return calls.open() == 1; }, 5s));
  boss->WritesDone();
  EXPECT_FALSE(boss->Read(&response));
  EXPECT_TRUE(boss->Finish().ok());
}

TEST_F(IdentityTest, SlicingEndsOnceItsTokenIsTakenAwayThoughItsClientReadsNothing) {
  write_tokens("anonymous write\n");
  TestServer server(options());
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext context;
  show(context, "work");
  const auto reader = server.new_narrow_stub()->SliceRange(&context, slice_request(id, 0.01, 0, 200));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  auto& calls = server.server().state().calls;
  std::ofstream(folder_ / "tokens") << access_line("boss", "admin", "rule") << "\n";
  server.server().reload(/*always=*/true);
  EXPECT_TRUE(eventually([&] { return calls.open() == 0; }, 5s));
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(IdentityTest, AClientHasSoManyCalls) {
  TestServer server(options());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>>> streams;
  for (int i = 0; i < 2; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    show(*contexts.back(), "look");
    streams.push_back(server.stub().ProbePoints(contexts.back().get()));
  }
  ASSERT_TRUE(eventually([&] { return server.server().state().calls.open() == 2; }, 5s));
  grpc::ClientContext third;
  show(third, "look");
  const auto refused = server.stub().ProbePoints(&third);
  v1::ProbePointsResponse response;
  EXPECT_FALSE(refused->Read(&response));
  const Failure failure = failure_of(refused->Finish());
  EXPECT_EQ(failure.reason, "CLIENT_LIMIT");
  EXPECT_EQ(failure.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(failure.retry);
  EXPECT_EQ(upload(server.stub(), "work").reason, "REQUEST_MALFORMED");
  for (auto& stream : streams) {
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }
  grpc::ClientContext fourth;
  show(fourth, "look");
  const auto taken = server.stub().ProbePoints(&fourth);
  taken->WritesDone();
  EXPECT_TRUE(taken->Finish().ok());
}

TEST_F(IdentityTest, TheRequestsIdComesBack) {
  TestServer server;
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "order-66");
  v1::GetServerInfoResponse response;
  ASSERT_TRUE(server.stub().GetServerInfo(&context, {}, &response).ok());
  const auto id = context.GetServerTrailingMetadata().find("x-request-id");
  ASSERT_NE(id, context.GetServerTrailingMetadata().end());
  EXPECT_EQ(std::string(id->second.data(), id->second.size()), "order-66");
  grpc::ClientContext other;
  other.AddMetadata("x-request-id", "with a space");
  ASSERT_TRUE(server.stub().GetServerInfo(&other, {}, &response).ok());
  const auto made = other.GetServerTrailingMetadata().find("x-request-id");
  ASSERT_NE(made, other.GetServerTrailingMetadata().end());
  EXPECT_EQ(made->second.size(), 32u);
}

TEST(TraceId, IsThatOfATraceparent) {
  EXPECT_EQ(trace_id_of("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"), "4bf92f3577b34da6a3ce929d0e0e4736");
  for (const char* text : {"", "00", "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
                           "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
                           "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
                           "00_4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
                           "00-4bf92f3577b34da6a3ce929d0e0e473-600f067aa0ba902b7-01"}) {
    EXPECT_EQ(trace_id_of(text), "") << text;
  }
}

TEST_F(IdentityTest, CertificatesAreServedRenewedAndAskedFor) {
  const TestCertificates made;
  made.make("one", "localhost");
  made.make("two", "localhost");
  made.make("client", "cadbox");
  made.put("one.pem", "served.pem");
  made.put("one.key", "served.key");
  ServerOptions options = test_options();
  options.tls = {
      .certificate = made.path("served.pem"), .key = made.path("served.key"), .client_authority = made.path("ca.pem")};
  Server server(options);
  const auto stub_with = [&](const std::string& name) {
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = made.text("ca.pem");
    if (!name.empty()) {
      tls.pem_cert_chain = made.text(name + ".pem");
      tls.pem_private_key = made.text(name + ".key");
    }
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return v1::SlicerService::NewStub(
        grpc::CreateCustomChannel(server.address(), grpc::SslCredentials(tls), arguments));
  };
  EXPECT_EQ(info(*stub_with("client"), "").code, grpc::StatusCode::OK);
  EXPECT_EQ(info(*stub_with(""), "").code, grpc::StatusCode::UNAVAILABLE);
  const auto plain =
      v1::SlicerService::NewStub(grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
  EXPECT_EQ(info(*plain, "").code, grpc::StatusCode::UNAVAILABLE);
  made.put("two.pem", "served.pem");
  server.reload(false);  // The key hasn't come: the old pair is served on.
  std::this_thread::sleep_for(2500ms);
  EXPECT_EQ(info(*stub_with("client"), "").code, grpc::StatusCode::OK);
  made.put("two.key", "served.key");
  server.reload(false);
  std::this_thread::sleep_for(2500ms);
  EXPECT_EQ(info(*stub_with("client"), "").code, grpc::StatusCode::OK);
}

TEST_F(IdentityTest, HealthHasAPortOfItsOwn) {
  ServerOptions options = test_options();
  options.health_address = "127.0.0.1:0";
  options.metrics_address = "127.0.0.1:0";
  TestServer server(options);
  std::string explanation;
  EXPECT_TRUE(check_health(server.server().health_address(), explanation)) << explanation;
  server.server().say_not_serving();
  EXPECT_FALSE(check_health(server.server().health_address(), explanation)) << explanation;
  server.upload_good(make_block(1, 3));  // Calls are taken all the same.
  const auto stub = v1::SlicerService::NewStub(
      grpc::CreateChannel(server.server().health_address(), grpc::InsecureChannelCredentials()));
  EXPECT_EQ(info(*stub, "").code, grpc::StatusCode::UNIMPLEMENTED);
}

TEST(MetricsPage, TellsWhenCertificatesEnd) {
  TestServer server;
  const std::string page =
      metrics_page(server.server().state(), {.ends = {.certificate_s = 1'800'000'000, .client_authority_s = 0}});
  EXPECT_NE(page.find("ccslice_tls_certificate_expiry_timestamp_seconds{file=\"certificate\"} 1800000000\n"),
            std::string::npos)
      << page;
  EXPECT_EQ(page.find("client_authority"), std::string::npos);
}

TEST(MetricsPage, TellsWhatHappened) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  ASSERT_TRUE(server.slice(slice_request(id, 1, 0, 3)).status.ok());
  EXPECT_EQ(server.slice_failure(slice_request(id, 1, 0, 0)).reason, "LAYER_RANGE_EMPTY");
  const std::string page = metrics_page(server.server().state(), {.connections = 7});
  for (const char* line :
       {"ccslice_calls_total{method=\"SliceRange\",reason=\"OK\"} 1",
        "ccslice_calls_total{method=\"SliceRange\",reason=\"LAYER_RANGE_EMPTY\"} 1", "ccslice_layers_total 3",
        "ccslice_cache_meshes 1", "ccslice_connections 7", "ccslice_preparations_total{outcome=\"prepared\"} 1",
        "ccslice_calls_total{method=\"Preview\",reason=\"OK\"} 0", "ccslice_first_layer_seconds_count 1",
        "ccslice_queue_seconds_count{awaited=\"place\"} 3", "ccslice_queue_seconds_count{awaited=\"memory\"} 1",
        "ccslice_calls_running 0", "ccslice_calls_waiting_for_memory 0", "ccslice_preparations_waiting 0"}) {
    EXPECT_NE(page.find(std::string(line) + "\n"), std::string::npos) << line << "\n" << page;
  }
  for (const char* absent : {"ccslice_store_up", "ccslice_tls_certificate"}) {
    EXPECT_EQ(page.find(absent), std::string::npos) << absent;
  }
  EXPECT_EQ(page.find(id), std::string::npos);
  EXPECT_EQ(page.find("127.0.0.1"), std::string::npos);
}

}  // namespace
}  // namespace ccslice::server
