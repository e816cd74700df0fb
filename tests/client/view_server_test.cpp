// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// `ccslice view` as a process, and whoever asks it over HTTP.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#undef _res  // A macro of <resolv.h>, and a parameter's name in Eigen.

#include "client/cli/exit_codes.h"
#include "client/client.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class View : public CommandLine {
 protected:
  View() : process_(start({"view", box_, "--no-open"}, server_->address())) {
    const std::string prefix = "http://";
    std::string line;
    for (int wait = 0; wait < 1000 && !line.ends_with('\n'); ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      line = process_->out_so_far();
    }
    if (line.ends_with('\n')) line.pop_back();
    EXPECT_THAT(line, testing::MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/#token=[0-9a-f]{32}")) << line;
    const std::size_t slash = line.find('/', prefix.size());
    host_ = line.substr(prefix.size(), slash - prefix.size());
    token_ = line.substr(line.find('=') + 1);
    http_ = std::make_unique<httplib::Client>(prefix + host_);
  }

  httplib::Headers bearer() const { return {{"Authorization", "Bearer " + token_}}; }
  httplib::Result post(const std::string& path, const std::string& body) {
    return http_->Post(path, bearer(), body, "application/json");
  }

  /// A level cut through the box of 24 x 16 x 8 mm.
  static std::string cut(double z) {
    return R"({"width":64,"height":48,"plane":{"free":{"middle_mm":{"x":12,"y":8,"z":)" + std::to_string(z) +
           R"(},"across":{"x":1},"up":{"y":1},"across_mm_per_pixel":0.5}},)" +
           R"("content":{"channel":{"channel":"gradient"}}})";
  }

  std::unique_ptr<Process> process_;
  std::string host_, token_;
  std::unique_ptr<httplib::Client> http_;
};

TEST_F(View, GivesItsPageToAnybodyAndItsCallsToTheToken) {
  const auto page = http_->Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->body, HasSubstr("view.js"));
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_FALSE(page->has_header("Access-Control-Allow-Origin"));
  EXPECT_EQ(http_->Get("/view.js")->status, 200);
  EXPECT_EQ(http_->Get("/../etc/passwd")->status, 404);
  EXPECT_EQ(http_->Get("/%2e%2e/etc/passwd")->status, 404);
  const auto refused = http_->Get("/api/meshes");
  EXPECT_EQ(refused->status, 401);
  EXPECT_THAT(refused->body, HasSubstr("TOKEN_MISSING"));
  EXPECT_EQ(http_->Get("/api/meshes", bearer())->status, 200);
  EXPECT_EQ(http_->Get("/api/meshes", {{"Host", "evil.example"}, {"Authorization", "Bearer " + token_}})->status, 421);
  EXPECT_EQ(
      http_->Get("/api/meshes", {{"Origin", "http://evil.example"}, {"Authorization", "Bearer " + token_}})->status,
      403);
}

TEST_F(View, ChangesTheTokenForACookie) {
  EXPECT_EQ(http_->Post("/api/session", R"({"token":"0"})", "application/json")->status, 401);
  EXPECT_EQ(http_->Post("/api/session", "token", "application/json")->status, 401);
  const auto session = http_->Post("/api/session", R"({"token": ")" + token_ + R"("})", "application/json");
  ASSERT_EQ(session->status, 204);
  const std::string cookie = session->get_header_value("Set-Cookie");
  EXPECT_THAT(cookie, testing::AllOf(HasSubstr("HttpOnly"), HasSubstr("SameSite=Strict")));
  EXPECT_EQ(http_->Get("/api/meshes", {{"Cookie", cookie.substr(0, cookie.find(';'))}})->status, 200);
}

TEST_F(View, ShowsCutsThatAreThePreviewsOfTheCommandLine) {
  const auto picture = post("/api/preview", cut(4));
  ASSERT_EQ(picture->status, 200) << picture->body;
  EXPECT_EQ(picture->get_header_value("Content-Type"), "image/png");
  EXPECT_THAT(picture->body, StartsWith("\x89PNG"));
  const std::string header = picture->get_header_value("Ccslice-Preview");
  EXPECT_EQ(json_at(header, "width").number_value(), 64);
  EXPECT_EQ(json_at(header, "pixels_inside").string_value(), std::to_string(48 * 32)) << header;
  EXPECT_GT(json_at(header, "range.max").number_value(), json_at(header, "range.min").number_value());
  const auto coarse = post("/api/preview?stage=coarse", cut(4));
  EXPECT_EQ(json_at(coarse->get_header_value("Ccslice-Preview"), "width").number_value(), 8);
}

TEST_F(View, OfManyRequestsTheLatestIsAnswered) {
  std::vector<std::thread> threads;
  std::vector<int> statuses(8);
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    threads.emplace_back([&, i] {
      httplib::Client own("http://" + host_);
      statuses[i] =
          own.Post("/api/preview", bearer(), cut(1 + 0.5 * static_cast<double>(i)), "application/json")->status;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(statuses, testing::Each(testing::AnyOf(200, 409)));
  EXPECT_THAT(statuses, testing::Contains(200));
}

TEST_F(View, ProbesPointsAndListsMeshes) {
  const auto answer = post("/api/probe", R"({"points_mm":[12,8,4,-1,0,0]})");
  ASSERT_EQ(answer->status, 200) << answer->body;
  const auto locations = json_at(answer->body, "locations").list_value();
  EXPECT_EQ(locations.values(0).string_value(), "POINT_LOCATION_INSIDE");
  EXPECT_EQ(locations.values(1).string_value(), "POINT_LOCATION_OUTSIDE");
  EXPECT_NEAR(json_at(answer->body, "materials").list_value().values(0).number_value(), 0.5, 1e-6);
  const auto meshes = http_->Get("/api/meshes", bearer());
  EXPECT_EQ(json_at(meshes->body, "name").string_value(), "box.ccmesh");
  EXPECT_THAT(meshes->body, HasSubstr(json_at(meshes->body, "first").string_value()));
}

TEST_F(View, NamesWhatIsWrong) {
  const auto expect = [&](const httplib::Result& result, int status, const std::string& reason) {
    ASSERT_TRUE(result);
    EXPECT_EQ(result->status, status) << result->body;
    EXPECT_EQ(json_at(result->body, "error.reason").string_value(), reason) << result->body;
    EXPECT_NE(json_at(result->body, "error.message").string_value(), "");
  };
  expect(post("/api/preview", "{"), 400, "REQUEST_MALFORMED");
  expect(post("/api/preview", R"({"width":"wide"})"), 400, "REQUEST_MALFORMED");
  expect(post("/api/preview", R"({"colour":1})"), 400, "REQUEST_MALFORMED");
  expect(post("/api/preview", "{}"), 400, "REQUEST_MALFORMED");
  expect(post("/api/probe", R"({"points_mm":[1,2]})"), 400, "REQUEST_MALFORMED");
  expect(post("/api/preview", R"({"mesh_id":"ring"})"), 400, "MESH_ID_INVALID");
  EXPECT_EQ(post("/api/preview", std::string(5 << 20, ' '))->status, 413);
  EXPECT_EQ(post("/api/preview", cut(4))->status, 200) << "an error ends nothing";
}

TEST_F(View, GoesOnAfterTheMeshWasDeleted) {
  ASSERT_EQ(post("/api/preview", cut(4))->status, 200);
  const std::string id = json_at(http_->Get("/api/meshes", bearer())->body, "first").string_value();
  Client client({.address = server_->address()});
  ASSERT_TRUE(client.delete_mesh(id));
  ASSERT_EQ(post("/api/preview", R"({"mesh_id":"ring"})")->status, 400) << "ends the call that still held it";
  EXPECT_EQ(post("/api/preview", cut(4))->status, 200) << "uploaded again";
}

TEST_F(View, EndsWithCtrlC) {
  process_->send_signal(SIGINT);
  EXPECT_EQ(process_->wait().exit_code, cli::kExitOk);
  EXPECT_FALSE(http_->Get("/"));
}

TEST_F(View, APortThatIsTakenIsOneSentence) {
  const ProcessResult result = run({"view", box_, "--no-open", "--port", host_.substr(host_.find(':') + 1)});
  EXPECT_EQ(result.exit_code, cli::kExitOutput);
  EXPECT_THAT(result.err, HasSubstr("is taken: leave --port out"));
}

}  // namespace
}  // namespace ccslice::client
