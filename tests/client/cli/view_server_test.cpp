// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// `ccslice view` as a process, and whoever asks it over HTTP.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#undef _res  // A macro of <resolv.h>, and a parameter's name in Eigen.

#include "client/cli/base/exit_codes.h"
#include "client/client.h"
#include "core/base/types.h"
#include "tests/client/command_line.h"
#include "tests/server/service/kept_connections.h"

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

TEST_F(View, TellsItsAddressAsJson) {
  const std::unique_ptr<Process> process = start({"view", box_, "--no-open", "--json"}, server_->address());
  std::string line;
  for (int wait = 0; wait < 1000 && !line.ends_with('\n'); ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    line = process->out_so_far();
  }
  EXPECT_THAT(json_at(line, "address").string_value(), StartsWith("http://127.0.0.1:"));
  process->send_signal(SIGINT);
  EXPECT_EQ(process->wait().exit_code, cli::kExitOk);
}

TEST_F(View, NamesAPortThatIsNone) {
  const ProcessResult result = run({"view", box_, "--no-open", "--port", "80000"});
  EXPECT_EQ(result.exit_code, cli::kExitUsage);
  EXPECT_THAT(result.err, HasSubstr("80000 not in range 0 to 65535"));
}

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

TEST_F(View, IgnoresRangesAndRefusesBodiesWithoutALength) {
  std::string ranges = "bytes=0-";
  for (int i = 0; i < 500; ++i) ranges += ",0-";
  const auto page = http_->Get("/view.js", {{"Range", ranges}});
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  const std::string whole = http_->Get("/view.js")->body;
  EXPECT_EQ(page->body, whole);
  for (const char* range : {"bytes=9-1", "lines=1-2", "nonsense", "bytes=99999999999999999999-", "bytes=0-1,9-2"}) {
    const auto answer = http_->Get("/view.js", {{"Range", range}});
    ASSERT_TRUE(answer) << range;
    EXPECT_EQ(answer->status, 200) << range;
    EXPECT_EQ(answer->body, whole) << range;
    EXPECT_EQ(http_->Get("/api/meshes", {{"Range", range}})->status, 401);
    httplib::Headers headers = bearer();
    headers.emplace("Range", range);
    EXPECT_EQ(http_->Get("/api/meshes", headers)->status, 200);
    EXPECT_EQ(http_->Get("/view.js", {{"Range", range}, {"Host", "evil.example"}})->status, 421);
  }
  const auto chunked = http_->Post(
      "/api/preview", bearer(), [](std::size_t, httplib::DataSink& sink) { return sink.done(), true; },
      "application/json");
  ASSERT_TRUE(chunked);
  EXPECT_EQ(chunked->status, 411);
  EXPECT_EQ(http_->Post("/api/session", {{"Content-Encoding", "gzip"}}, "packed", "application/json")->status, 411);
  const std::string deep = R"({"a":)" + std::string(100'000, '[') + std::string(100'000, ']') + "}";
  EXPECT_EQ(http_->Post("/api/session", deep, "application/json")->status, 401);
}

TEST_F(View, ChangesTheTokenForACookie) {
  EXPECT_EQ(http_->Post("/api/session", R"({"token":"0"})", "application/json")->status, 401);
  for (const char* body : {"token", "", "[]", "{}", R"({"token":7})", R"({"token":{"token":""}})", R"({"token":""})"}) {
    EXPECT_EQ(http_->Post("/api/session", body, "application/json")->status, 401) << body;
  }
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

/// Calls body(i) for each i below `count`, each on a thread of its own.
template <class Body>
void on_threads(std::size_t count, const Body& body) {
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < count; ++i) threads.emplace_back([&body, i] { body(i); });
}

// A drag asks for one picture after the other. An answer whose end waits until its begin is acknowledged takes 40 ms
// at least, unless the connection is new.
TEST_F(View, AnswersAtOnceOnAConnectionThatIsInUse) {
  http_->set_keep_alive(true);
  std::vector<std::chrono::steady_clock::duration> times;
  for (int i = 0; i < 100; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(http_->Get("/view.js")->status, 200);
    times.push_back(std::chrono::steady_clock::now() - begin);
  }
  std::sort(times.begin(), times.end());
  EXPECT_LT(times[times.size() / 2], std::chrono::milliseconds(30));
}

TEST_F(View, AnswersAtOnceBesideSlowConnections) {
  std::vector<server::Descriptor> slow;
  for (int i = 0; i < 100; ++i) {
    slow.push_back(server::call_from("127.0.0.1", host_));
    EXPECT_EQ(write(slow.back().get(), "GET /vi", i % 2 == 0 ? 7 : 0), i % 2 == 0 ? 7 : 0);
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(http_->Get("/view.js")->status, 200);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
}

TEST_F(View, OfManyRequestsTheLatestIsAnswered) {
  std::vector<int> statuses(8);
  on_threads(statuses.size(), [&](std::size_t i) {
    httplib::Client own("http://" + host_);
    statuses[i] = own.Post("/api/preview", bearer(), cut(1 + 0.5 * static_cast<double>(i)), "application/json")->status;
  });
  EXPECT_THAT(statuses, testing::Each(testing::AnyOf(200, 409)));
  EXPECT_THAT(statuses, testing::Contains(200));
}

TEST_F(View, PagesDontTakePicturesFromEachOther) {
  std::vector<int> refused(4);
  on_threads(refused.size(), [&](std::size_t page) {
    httplib::Client own("http://" + host_);
    for (int i = 0; i < 12; ++i) {
      const auto answer =
          own.Post("/api/preview?page=" + std::to_string(page), bearer(), cut(0.5 + 0.5 * i), "application/json");
      refused[page] += answer->status == 200 ? 0 : 1;
    }
  });
  EXPECT_THAT(refused, testing::Each(0));
  for (int page = 0; page < 20; ++page) {
    EXPECT_EQ(post("/api/preview?page=more" + std::to_string(page), cut(4))->status, 200) << "any number of pages";
  }
}

TEST_F(View, GivesTheBoundaryAsTriangles) {
  const auto answer = post("/api/boundary?channel=gradient", R"({"chord_tolerance_mm":1})");
  ASSERT_EQ(answer->status, 200) << answer->body;
  const std::string header = answer->get_header_value("Ccslice-Surface");
  const auto count = [&](const char* name) {
    return static_cast<std::size_t>(std::stoul(json_at(header, name).string_value()));
  };
  const std::size_t vertices = count("vertex_count"), triangles = count("triangle_count");
  ASSERT_GT(triangles, 10u);
  ASSERT_EQ(answer->body.size(), 4 * (3 * vertices + vertices + 3 * triangles));
  const auto number = [&](std::size_t i) {
    float value = 0;
    std::memcpy(&value, answer->body.data() + 4 * i, 4);
    return value;
  };
  double volume = 0;
  for (std::size_t t = 0; t < triangles; ++t) {
    Vec3 corners[3];
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t vertex = 0;
      std::memcpy(&vertex, answer->body.data() + 4 * (4 * vertices + 3 * t + k), 4);
      ASSERT_LT(vertex, vertices);
      for (std::size_t i = 0; i < 3; ++i) corners[k][static_cast<Eigen::Index>(i)] = number(3 * vertex + i);
    }
    volume += corners[0].dot(corners[1].cross(corners[2])) / 6;
  }
  EXPECT_NEAR(volume, 24 * 16 * 8, 1e-3);
  for (std::size_t v = 0; v < vertices; ++v) EXPECT_NEAR(number(3 * vertices + v), number(3 * v) / 24, 1e-5) << v;
  const auto plain = post("/api/boundary", "{}");
  EXPECT_EQ(plain->body.size() % 4, 0u);
  EXPECT_EQ(json_at(plain->get_header_value("Ccslice-Surface"), "channels").list_value().values_size(), 0);
}

TEST_F(View, PlansGrids) {
  const auto answer = post("/api/plan", R"({"job":{"grid":{"pitch":{"x_mm":0.5,"y_mm":0.5,"z_mm":0.25}}}})");
  ASSERT_EQ(answer->status, 200) << answer->body;
  EXPECT_EQ(json_at(answer->body, "grid.extent.columns").number_value(), 48);
  EXPECT_EQ(json_at(answer->body, "grid.extent.layers").number_value(), 32);
}

TEST_F(View, KeepsAPrintingThatIsAskedForAgain) {
  const auto halftone = [&](const std::string& colour) {
    const std::string body = R"({"content":{"halftone":{}},"plane":{"layer":{"layer":3,"job":{)"
                             R"("grid":{"pitch":{"x_mm":0.5,"y_mm":0.5,"z_mm":0.5}},)"
                             R"("printing":{"materials":[{"name":"a","rgba":)" +
                             colour + R"(},{"name":"b","rgba":65535}],"map":{"blend":{"channel":"gradient",)" +
                             R"("stops":[{"value":0,"material":"a"},{"value":1,"material":"b"}]}}}}}}})";
    const auto answer = post("/api/preview", body);
    EXPECT_EQ(answer->status, 200) << answer->body;
    return answer->body;
  };
  const std::string red = halftone("4278190335");
  EXPECT_EQ(halftone("4278190335"), red);
  EXPECT_NE(halftone("16711935"), red);
  EXPECT_EQ(halftone("4278190335"), red);
}

TEST_F(View, ProbesPointsAndListsMeshes) {
  const auto answer = post("/api/probe", R"({"points_mm":[12,8,4,-1,0,0]})");
  ASSERT_EQ(answer->status, 200) << answer->body;
  const auto locations = json_at(answer->body, "locations").list_value();
  EXPECT_EQ(locations.values(0).string_value(), "POINT_LOCATION_INSIDE");
  EXPECT_EQ(locations.values(1).string_value(), "POINT_LOCATION_OUTSIDE");
  EXPECT_NEAR(json_at(answer->body, "channel_values").list_value().values(0).number_value(), 0.5, 1e-6);
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
  expect(post("/api/boundary", R"({"chord_tolerance_mm":-1})"), 400, "TOLERANCE_INVALID");
  expect(post("/api/boundary?channel=nothing", "{}"), 400, "CHANNEL_UNKNOWN");
  expect(post("/api/boundary", "[]"), 400, "REQUEST_MALFORMED");
  expect(post("/api/plan", R"({"job":{"grid":{"pitch":{"x_mm":0}}}})"), 400, "PITCH_INVALID");
  expect(post("/api/plan", R"({"job":{"parts":[{"mesh_id":"ring"}]}})"), 400, "MESH_ID_INVALID");
  expect(post("/api/preview", R"({"plane":{"layer":{"job":{"parts":[{},{}]}}}})"), 400, "PART_NAME_INVALID");
  for (const std::size_t megabytes : {5, 100}) {
    // The answer may come, and the connection be closed, before all has been sent.
    const auto refused = post("/api/preview", std::string(megabytes << 20, ' '));
    EXPECT_TRUE(!refused || refused->status == 413) << megabytes;
  }
  EXPECT_EQ(post("/api/preview", std::string(4'200'000, ' '))->status, 413);
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
