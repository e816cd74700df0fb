// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/preview.h"
#include "tests/client/fake_slicer.h"
#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr RetryPolicy kQuick{.max_attempts = 4, .first_pause = milliseconds(5), .longest_pause = milliseconds(20)};

class ClientTest : public testing::Test {
 protected:
  /// Indices of the layers delivered.
  std::vector<std::uint32_t> slice_all(const v1::SliceRangeRequest& request) {
    std::vector<std::uint32_t> indices;
    outcome_ = client_.slice(request, [&](const v1::SliceHeader&, Layer layer) { indices.push_back(layer.index); });
    return indices;
  }

  v1::ProbePointsRequest setting() const {
    v1::ProbePointsRequest setting;
    setting.set_mesh_id(mesh_->id());
    return setting;
  }

  static std::vector<std::uint32_t> range(std::uint32_t first, std::uint32_t count) {
    std::vector<std::uint32_t> indices(count);
    std::iota(indices.begin(), indices.end(), first);
    return indices;
  }

  FakeSlicer server_;
  Client client_{ClientOptions{server_.address(), kQuick}};
  std::shared_ptr<const MeshBytes> mesh_ = some_mesh();
  SliceOutcome outcome_;
};

TEST_F(ClientTest, UploadsOnceInChunks) {
  const auto large = some_mesh(100'000);
  ASSERT_GT(large->bytes().size(), 2u << 20);
  std::vector<std::uint64_t> sent;
  const auto progress = [&](std::uint64_t bytes, std::uint64_t) { sent.push_back(bytes); };
  EXPECT_FALSE(client_.ensure_uploaded(large, progress).was_cached);
  EXPECT_GT(sent.size(), 4u);
  EXPECT_EQ(sent.back(), large->bytes().size());
  EXPECT_TRUE(client_.ensure_uploaded(large, progress).was_cached);
  EXPECT_EQ(server_.uploads, 1);
}

TEST_F(ClientTest, DeliversLayersDecodedAndInOrder) {
  client_.ensure_uploaded(mesh_);
  std::vector<Layer> layers;
  client_.slice(some_request(mesh_->id(), 3, 4), [&](const v1::SliceHeader& header, Layer layer) {
    EXPECT_EQ(header.engine_version(), "engine-1");
    layers.push_back(std::move(layer));
  });
  ASSERT_EQ(layers.size(), 4u);
  EXPECT_EQ(layers[2].index, 5u);
  EXPECT_EQ(layers[2].z_mm, 5.5);
  EXPECT_EQ(layers[2].planes[0].samples.size(), 12u);
  EXPECT_EQ(layers[2].planes[1].samples.size(), 120u);
  EXPECT_EQ(layers[2].planes[1].samples[1], static_cast<char>(7 + 5));
  EXPECT_TRUE(layers[2].planes[2].samples.empty());
  EXPECT_THAT(layers[2].planes[2].encoded, HasSubstr("PNG"));
}

TEST_F(ClientTest, ResumesABrokenStreamWhereItStopped) {
  client_.ensure_uploaded(mesh_);
  int breaks = 3;
  server_.before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    return layer > 0 && layer % 2 == 0 && breaks-- > 0 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone")
                                                       : grpc::Status::OK;
  };
  EXPECT_EQ(slice_all(some_request(mesh_->id())), range(0, 6));
  EXPECT_EQ(outcome_.layers, 6u);
  EXPECT_EQ(outcome_.empty_layers, 1u);
  EXPECT_EQ(outcome_.voxel_count, 15u);
  EXPECT_GE(outcome_.resumes, 1);
  EXPECT_EQ(server_.slice_requests[1].first_layer(), 2u);
  EXPECT_EQ(server_.slice_requests[1].layer_count(), 4u);
}

TEST_F(ClientTest, GoesOnWhereAShutdownCutTheStream) {
  client_.ensure_uploaded(mesh_);
  bool cut = false;
  server_.before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    return layer == 3 && !std::exchange(cut, true)
               ? failure(grpc::StatusCode::UNAVAILABLE, "SERVER_SHUTTING_DOWN", "shutting down")
               : grpc::Status::OK;
  };
  EXPECT_EQ(slice_all(some_request(mesh_->id())), range(0, 6));
  EXPECT_EQ(server_.slice_requests.at(1).first_layer(), 3u);
}

TEST_F(ClientTest, GivesUpAfterSoManyAttemptsWithoutProgress) {
  client_.ensure_uploaded(mesh_);
  server_.before_layer = [](std::uint32_t layer, grpc::ServerContext&) {
    return layer == 3 ? failure(grpc::StatusCode::UNAVAILABLE, "SERVER_BUSY", "busy") : grpc::Status::OK;
  };
  const ClientError error = error_of([&] { slice_all(some_request(mesh_->id())); });
  EXPECT_EQ(error.code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(error.reason(), "SERVER_BUSY");
  EXPECT_EQ(server_.slice_requests.size(), 4u);  // Layer 2 was progress: three more attempts followed it.
}

TEST_F(ClientTest, DoesNotRetryWhatCannotHelp) {
  client_.ensure_uploaded(mesh_);
  server_.before_layer = [](std::uint32_t, grpc::ServerContext&) {
    return failure(grpc::StatusCode::INVALID_ARGUMENT, "PITCH_INVALID", "job.grid.pitch.x_mm is 0");
  };
  const ClientError error = error_of([&] { slice_all(some_request(mesh_->id())); });
  EXPECT_EQ(error.reason(), "PITCH_INVALID");
  EXPECT_EQ(error.metadata().at("field"), "somewhere");
  EXPECT_STREQ(error.what(), "job.grid.pitch.x_mm is 0");
  EXPECT_EQ(server_.slice_requests.size(), 1u);
}

TEST_F(ClientTest, UploadsAgainWhenTheServerLostTheMesh) {
  client_.ensure_uploaded(mesh_);
  bool lost = false;
  server_.before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    if (layer != 2 || lost) return grpc::Status::OK;
    lost = true;
    server_.meshes.clear();
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "restarting");
  };
  EXPECT_EQ(slice_all(some_request(mesh_->id())), range(0, 6));
  EXPECT_EQ(outcome_.reuploads, 1);
  EXPECT_EQ(server_.uploads, 2);
}

TEST_F(ClientTest, DoesNotChargeAnUploadToTheAttempts) {
  // Two attempts: the stream breaks, and the restarted server has no meshes. The upload between must not be the second.
  Client client({server_.address(), {.max_attempts = 2, .first_pause = milliseconds(5)}});
  client.ensure_uploaded(mesh_);
  bool lost = false;
  server_.before_layer = [&](std::uint32_t, grpc::ServerContext&) {
    if (lost) return grpc::Status::OK;
    lost = true;
    server_.meshes.clear();
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "restarting");
  };
  EXPECT_EQ(client.slice(some_request(mesh_->id()), [](const v1::SliceHeader&, Layer) {}).reuploads, 1);
}

TEST_F(ClientTest, UploadsAgainForUnaryAndProbeCallsToo) {
  client_.ensure_uploaded(mesh_);
  server_.meshes.clear();
  EXPECT_EQ(client_.mesh_summary(mesh_->id()).mesh_id(), mesh_->id());
  server_.meshes.clear();
  EXPECT_EQ(client_.probe(mesh_->id(), {}, {1, 2, 3}).size(), 1u);
  EXPECT_EQ(server_.uploads, 3);
}

TEST_F(ClientTest, ForgetsAMeshAndFreesItsBytes) {
  auto mesh = some_mesh(5);
  const std::weak_ptr<const MeshBytes> bytes = mesh;
  const std::string id = mesh->id();
  client_.ensure_uploaded(std::move(mesh));
  EXPECT_FALSE(bytes.expired());
  EXPECT_TRUE(client_.forget(id));
  EXPECT_TRUE(bytes.expired());
  EXPECT_FALSE(client_.forget(id));
  EXPECT_EQ(client_.mesh_summary(id).mesh_id(), id) << "the server still has it";
  server_.meshes.clear();
  EXPECT_EQ(error_of([&] { client_.mesh_summary(id); }).missing_mesh_id(), id) << "nobody can upload it again";
}

TEST_F(ClientTest, RetriesAnUploadThatBreaks) {
  server_.upload_failures = {grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone")};
  EXPECT_FALSE(client_.ensure_uploaded(mesh_).was_cached);
  EXPECT_EQ(server_.uploads, 2);
}

TEST_F(ClientTest, DoesNotRetryAMeshThatIsRefused) {
  server_.upload_failures = {failure(grpc::StatusCode::INVALID_ARGUMENT, "MESH_NON_FINITE", "vertex 3 is NaN")};
  EXPECT_EQ(error_of([&] { client_.ensure_uploaded(mesh_); }).reason(), "MESH_NON_FINITE");
  EXPECT_EQ(server_.uploads, 1);
}

TEST_F(ClientTest, AMissingMeshThatNobodyRemembersIsAnError) {
  const ClientError error = error_of([&] { slice_all(some_request(mesh_->id())); });
  EXPECT_EQ(error.code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(error.missing_mesh_id(), mesh_->id());
}

TEST_F(ClientTest, RefusesToMixEngines) {
  client_.ensure_uploaded(mesh_);
  server_.before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    if (layer != 2 || server_.engine_version == "engine-2") return grpc::Status::OK;
    server_.engine_version = "engine-2";
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "rolling update");
  };
  const ClientError error = error_of([&] { slice_all(some_request(mesh_->id())); });
  EXPECT_EQ(error.reason(), local_reason::kEngineMixed);
  EXPECT_EQ(error.code(), grpc::StatusCode::ABORTED);
}

TEST_F(ClientTest, RefusesToMixGrids) {
  client_.ensure_uploaded(mesh_);
  SlicePin pin;
  client_.slice(
      some_request(mesh_->id(), 0, 2), [](const v1::SliceHeader&, const Layer&) {}, {}, &pin);
  server_.pitch_drift_mm = 1e-12;
  const ClientError error = error_of([&] {
    client_.slice(
        some_request(mesh_->id(), 2, 2), [](const v1::SliceHeader&, const Layer&) { FAIL(); }, {}, &pin);
  });
  EXPECT_EQ(error.reason(), local_reason::kGridMixed);
}

TEST_F(ClientTest, RefusesAnswersThatCannotBeRight) {
  client_.ensure_uploaded(mesh_);
  const std::vector<std::function<void(v1::SliceRangeResponse&)>> tampers = {
      [](auto& m) {
        if (m.has_plane_chunk() && m.plane_chunk().plane() == 1) (*m.mutable_plane_chunk()->mutable_data())[0] ^= 1;
      },
      [](auto& m) {
        if (m.has_plane_chunk() && m.plane_chunk().plane() == 0) (*m.mutable_plane_chunk()->mutable_data())[5] ^= 1;
      },
      [](auto& m) {
        if (m.has_plane_chunk() && m.plane_chunk().plane() == 2)
          m.mutable_plane_chunk()->set_data(std::string(16, 'x'));
      },
      [](auto& m) {
        if (m.has_plane_chunk()) m.mutable_plane_chunk()->set_offset(3);
      },
      [](auto& m) {
        if (m.has_plane_chunk()) m.mutable_plane_chunk()->set_plane(9);
      },
      [](auto& m) {
        if (m.has_plane_chunk()) m.mutable_plane_chunk()->set_data("");
      },
      [](auto& m) {
        if (m.has_layer_begin()) m.mutable_layer_begin()->set_layer(17);
      },
      [](auto& m) {
        if (m.has_layer_begin()) m.mutable_layer_begin()->set_contour_loops(1);
      },
      [](auto& m) {
        if (m.has_layer_end()) m.mutable_layer_end()->clear_planes();
      },
      [](auto& m) {
        if (m.has_layer_end()) m.mutable_layer_end()->mutable_planes(0)->set_raw_bytes(1ull << 60);
      },
      [](auto& m) {
        if (m.has_layer_end()) m.Clear();
      },
      [](auto& m) {
        if (m.has_summary()) m.mutable_summary()->set_layers(1);
      },
      [](auto& m) {
        if (m.has_header()) m.mutable_header()->set_first_layer(1);
      },
      [](auto& m) {
        if (m.has_header()) m.mutable_header()->mutable_grid()->mutable_extent()->set_columns(4'000'000'000u);
      },
  };
  for (std::size_t i = 0; i < tampers.size(); ++i) {
    server_.tamper = tampers[i];
    const ClientError error = error_of([&] { slice_all(some_request(mesh_->id())); });
    EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt) << i << ": " << error.what();
  }
}

TEST_F(ClientTest, AThrowingCallbackEndsTheCall) {
  client_.ensure_uploaded(mesh_);
  EXPECT_THROW(client_.slice(some_request(mesh_->id()),
                             [](const v1::SliceHeader&, const Layer&) { throw std::runtime_error("disk full"); }),
               std::runtime_error);
}

TEST_F(ClientTest, CancellationEndsARunningStreamQuickly) {
  client_.ensure_uploaded(mesh_);
  std::atomic<bool> hanging = false, ended = false;
  server_.before_layer = [&](std::uint32_t layer, grpc::ServerContext& context) {
    while (layer == 2 && !context.IsCancelled()) {
      hanging = true;
      std::this_thread::sleep_for(milliseconds(1));
    }
    if (layer != 2) return grpc::Status::OK;
    ended = true;
    return grpc::Status::CANCELLED;
  };
  Cancellation cancellation;
  std::thread other([&] {
    while (!hanging) std::this_thread::sleep_for(milliseconds(1));
    cancellation.cancel();
  });
  const auto request = some_request(mesh_->id());
  const ClientError error = error_of(
      [&] { client_.slice(request, [](const v1::SliceHeader&, const Layer&) {}, {.cancellation = &cancellation}); });
  other.join();
  while (!ended) std::this_thread::sleep_for(milliseconds(1));  // It looks at what is on this stack.
  EXPECT_EQ(error.reason(), local_reason::kCancelledHere);
  EXPECT_EQ(error_of([&] { client_.server_info({.cancellation = &cancellation}); }).reason(),
            local_reason::kCancelledHere);
}

TEST_F(ClientTest, CancellationEndsAPause) {
  server_.failing_info_calls = 100;
  Cancellation cancellation;
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(50));
    cancellation.cancel();
  });
  const RetryPolicy slow{.max_attempts = 3, .first_pause = milliseconds(60'000), .longest_pause = milliseconds(60'000)};
  const ClientError error = error_of([&] { client_.server_info({.cancellation = &cancellation, .retry = slow}); });
  other.join();
  EXPECT_EQ(error.reason(), local_reason::kCancelledHere);
}

TEST_F(ClientTest, TheDeadlineHoldsForAllAttemptsTogether) {
  server_.failing_info_calls = 1'000'000;
  const RetryPolicy endless{
      .max_attempts = 1'000'000, .first_pause = milliseconds(20), .longest_pause = milliseconds(20)};
  const auto begin = std::chrono::steady_clock::now();
  const CallOptions call{.deadline = std::chrono::system_clock::now() + milliseconds(200), .retry = endless};
  const ClientError error = error_of([&] { client_.server_info(call); });
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(2000));
  EXPECT_THAT(error.code(), testing::AnyOf(grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::DEADLINE_EXCEEDED));
}

TEST_F(ClientTest, PatienceIsAskedOfABusyServerToo) {
  server_.failing_info_calls = 1'000'000;
  const RetryPolicy policy{.patience = milliseconds(200), .first_pause = milliseconds(5)};
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(error_of([&] { client_.server_info({.retry = policy}); }).code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(2000));
  EXPECT_GT(server_.info_calls, 3);
}

TEST_F(ClientTest, PatienceIsAskedWhateverPauseAServerAsksFor) {
  client_.ensure_uploaded(mesh_);
  std::int64_t seconds = 0;
  server_.before_layer = [&](std::uint32_t, grpc::ServerContext&) { return busy_for(seconds, 0); };
  const auto ignore = [](const v1::SliceHeader&, const Layer&) {};
  for (const std::int64_t asked :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-10'000'000'000}, std::int64_t{3'600},
        std::int64_t{9'223'372'036}, std::int64_t{10'000'000'000}, std::numeric_limits<std::int64_t>::max()}) {
    seconds = asked;
    server_.slice_requests.clear();
    const RetryPolicy policy{.patience = milliseconds(300), .first_pause = milliseconds(20)};
    const CallOptions call{.deadline = std::chrono::system_clock::now() + milliseconds(2'000), .retry = policy};
    const ClientError error = error_of([&] { client_.slice(some_request(mesh_->id()), ignore, call); });
    EXPECT_EQ(error.reason(), "SERVER_BUSY") << asked;
    EXPECT_LT(server_.slice_requests.size(), 10u) << asked;
  }
}

TEST_F(ClientTest, PatienceEndsWhereThereAreNoPauses) {
  server_.failing_info_calls = 1'000'000;
  const RetryPolicy policy{
      .patience = milliseconds(100), .first_pause = milliseconds(0), .longest_pause = milliseconds(0)};
  const CallOptions call{.deadline = std::chrono::system_clock::now() + milliseconds(2'000), .retry = policy};
  EXPECT_EQ(error_of([&] { client_.server_info(call); }).reason(), "SERVER_BUSY");
  EXPECT_LT(std::chrono::system_clock::now(), *call.deadline - milliseconds(500));
}

TEST_F(ClientTest, PatienceBeginsWithTheFirstFailure) {
  client_.ensure_uploaded(mesh_);
  int layers = 0;
  server_.before_layer = [&](std::uint32_t, grpc::ServerContext&) {
    if (layers++ > 0) return grpc::Status::OK;
    std::this_thread::sleep_for(milliseconds(400));  // As a large mesh takes before its first layer.
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the connection broke");
  };
  const RetryPolicy policy{.patience = milliseconds(300), .first_pause = milliseconds(5)};
  const auto ignore = [](const v1::SliceHeader&, const Layer&) {};
  EXPECT_EQ(client_.slice(some_request(mesh_->id()), ignore, {.retry = policy}).layers, 6u);
  EXPECT_EQ(server_.slice_requests.size(), 2u);
}

TEST_F(ClientTest, RetriesABusyServer) {
  server_.failing_info_calls = 2;
  EXPECT_EQ(client_.server_info().engine_version(), "engine-1");
  EXPECT_EQ(server_.info_calls, 3);
}

TEST_F(ClientTest, ListsMeshesPageByPage) {
  int pages = 0;
  server_.tamper_answer = [&](google::protobuf::Message& answer) {
    auto& page = dynamic_cast<v1::ListMeshesResponse&>(answer);
    page.add_meshes()->set_mesh_id(std::to_string(pages));
    if (++pages < 3) page.set_next_page_token("more");
  };
  EXPECT_EQ(client_.list_meshes().size(), 3u);
}

TEST_F(ClientTest, ListsOfMeshesEnd) {
  int pages = 0;
  bool are_empty = false;
  server_.tamper_answer = [&](google::protobuf::Message& answer) {
    auto& page = dynamic_cast<v1::ListMeshesResponse&>(answer);
    if (!are_empty) page.add_meshes()->set_mesh_id(std::string(3 << 20, 'm'));
    if (++pages < 1'000) page.set_next_page_token("more");
  };
  EXPECT_EQ(error_of([&] { client_.list_meshes(); }).reason(), local_reason::kAnswerCorrupt);
  EXPECT_LT(pages, 100);
  pages = 0;
  are_empty = true;
  EXPECT_EQ(error_of([&] { client_.list_meshes(); }).reason(), local_reason::kAnswerCorrupt);
  EXPECT_EQ(pages, 1);
}

TEST_F(ClientTest, PicturesThatNobodyAskedForAreRefused) {
  EXPECT_EQ(client_.preview({}).bytes, "rgba");
  server_.pictures_of_a_preview = 2;
  EXPECT_EQ(client_.preview({}).bytes, "rgba") << "a coarse one came first";
  server_.pictures_of_a_preview = 1'000'000;
  EXPECT_EQ(error_of([&] { client_.preview({}); }).reason(), local_reason::kAnswerCorrupt);
  server_.pictures_of_a_preview = 1;
  server_.tamper_answer = [](google::protobuf::Message& answer) {
    dynamic_cast<v1::PreviewResponse&>(answer).set_number(2);
  };
  EXPECT_EQ(error_of([&] { client_.preview({}); }).reason(), local_reason::kAnswerCorrupt);
}

TEST_F(ClientTest, CompressedAnswersAreRefusedAndNeverInflated) {
  client_.ensure_uploaded(mesh_);
  const auto ignore = [](const v1::SliceHeader&, const Layer&) {};
  for (const grpc_compression_algorithm algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    server_.at_begin = [&](grpc::ServerContext& context) { context.set_compression_algorithm(algorithm); };
    // Inflated, the last one is more than a message may have.
    for (const std::size_t bytes : {1'000, 100'000, 100'000'000}) {
      server_.engine_version = std::string(bytes, 'e');
      EXPECT_EQ(error_of([&] { client_.server_info(); }).reason(), local_reason::kAnswerCorrupt) << bytes;
      EXPECT_EQ(error_of([&] { client_.slice(some_request(mesh_->id()), ignore); }).reason(),
                local_reason::kAnswerCorrupt)
          << bytes;
    }
  }
}

TEST_F(ClientTest, ServersAreToldNotToCompress) {
  server_.at_begin = [](grpc::ServerContext& context) { context.set_compression_level(GRPC_COMPRESS_LEVEL_HIGH); };
  server_.engine_version = std::string(10'000, 'e');
  EXPECT_EQ(client_.server_info().engine_version(), server_.engine_version);
}

TEST_F(ClientTest, AnswersThatAreNoMessagesAreRefused) {
  // A text that isn't UTF-8.
  server_.engine_version = "\xff";
  EXPECT_EQ(error_of([&] { client_.server_info(); }).reason(), local_reason::kAnswerCorrupt);
}

TEST_F(ClientTest, ProbesAnyNumberOfPoints) {
  client_.ensure_uploaded(mesh_);
  std::vector<double> points;
  for (int i = 0; i < 10'000; ++i) points.insert(points.end(), {static_cast<double>(i), 0, 0});
  std::size_t next = 0;
  for (const v1::ProbePointsResponse& answer : client_.probe(mesh_->id(), {}, points)) {
    for (const double value : answer.channel_values()) EXPECT_EQ(value, static_cast<double>(next++));
  }
  EXPECT_EQ(next, 10'000u);
}

/// Points with x = 0, 1, 2, ... and what comes of them.
struct CountedPoints {
  std::size_t count = 0, given = 0, most_waiting = 0;
  std::vector<double> answered;
  std::atomic<std::size_t> taken{0};

  PointSource next = [this](std::size_t most) {
    most_waiting = std::max(most_waiting, given - taken);
    std::vector<double> points;
    for (; given < count && points.size() < 3 * most; ++given) {
      points.insert(points.end(), {static_cast<double>(given), 0, 0});
    }
    return points;
  };
  PointAnswers take = [this](std::span<const double> points, const v1::ProbePointsResponse& answer) {
    ASSERT_EQ(points.size(), 3 * static_cast<std::size_t>(answer.channel_values_size()));
    for (int i = 0; i < answer.channel_values_size(); ++i) {
      EXPECT_EQ(points[3 * static_cast<std::size_t>(i)], answer.channel_values(i));
      answered.push_back(answer.channel_values(i));
    }
    taken += points.size() / 3;
  };
  void expect_all_answered() const {
    ASSERT_EQ(answered.size(), count);
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(answered[i], static_cast<double>(i));
  }
};

TEST_F(ClientTest, ProbesMorePointsThanItHolds) {
  client_.ensure_uploaded(mesh_);
  CountedPoints points;
  points.count = 200'000;
  client_.probe(setting(), points.next, points.take);
  points.expect_all_answered();
  EXPECT_LE(points.most_waiting, 8u * 4096) << "some batches are asked for ahead";
  EXPECT_GT(points.most_waiting, 4096u);
}

TEST_F(ClientTest, GoesOnProbingWhereAStreamBroke) {
  client_.ensure_uploaded(mesh_);
  int batches = 0;
  server_.before_probe = [&](const v1::ProbePointsRequest&) {
    const bool breaks = ++batches % 5 == 0;
    return breaks ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the connection broke") : grpc::Status::OK;
  };
  CountedPoints points;
  points.count = 60'000;
  client_.probe(setting(), points.next, points.take, {.retry = RetryPolicy{.first_pause = milliseconds(1)}});
  points.expect_all_answered();
  EXPECT_LT(std::accumulate(server_.probed_points.begin(), server_.probed_points.end(), 0), 2 * 60'000)
      << "not from the start each time";
}

TEST_F(ClientTest, AnswersWhatCameBeforeTheSourceFailed) {
  client_.ensure_uploaded(mesh_);
  CountedPoints points;
  points.count = 10'000;
  const PointSource fails = [&](std::size_t most) {
    if (points.given == points.count) throw std::runtime_error("line 10001: not a number");
    return points.next(most);
  };
  EXPECT_THROW(client_.probe(setting(), fails, points.take), std::runtime_error);
  points.expect_all_answered();
}

TEST_F(ClientTest, StopsProbingWhenNobodyTakesTheAnswers) {
  client_.ensure_uploaded(mesh_);
  CountedPoints points;
  points.count = 1'000'000;
  const PointAnswers fails = [](std::span<const double>, const v1::ProbePointsResponse&) {
    throw std::runtime_error("the disk is full");
  };
  EXPECT_THROW(client_.probe(setting(), points.next, fails), std::runtime_error);
  EXPECT_LE(points.given, 10u * 4096);
}

TEST_F(ClientTest, EndsProbingWithAFailureThatWontPass) {
  client_.ensure_uploaded(mesh_);
  server_.before_probe = [&](const v1::ProbePointsRequest& batch) {
    return batch.points_mm(0) > 0 ? grpc::Status(grpc::StatusCode::OUT_OF_RANGE, "") : grpc::Status::OK;
  };
  CountedPoints points;
  points.count = 5'000;
  EXPECT_EQ(error_of([&] { client_.probe(setting(), points.next, points.take); }).code(),
            grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(points.answered.size(), 4096u);
}

TEST(Unreachable, IsUnavailable) {
  Client client({"127.0.0.1:1", {.max_attempts = 2, .first_pause = milliseconds(1)}});
  EXPECT_EQ(error_of([&] { client.server_info(); }).code(), grpc::StatusCode::UNAVAILABLE);
}

TEST(Unreachable, IsWaitedForAsLongAsPatienceLasts) {
  const auto begin = std::chrono::steady_clock::now();
  Client client({"127.0.0.1:1", {.patience = milliseconds(300)}});
  EXPECT_EQ(error_of([&] { client.server_info(); }).code(), grpc::StatusCode::UNAVAILABLE);
  const auto waited = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(waited, milliseconds(250));
  EXPECT_LT(waited, milliseconds(5000));
}

TEST(Unreachable, WaitingForItCanBeCancelled) {
  Cancellation cancellation;
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(50));
    cancellation.cancel();
  });
  Client client({"127.0.0.1:1", {}});
  EXPECT_EQ(error_of([&] { client.server_info({.cancellation = &cancellation}); }).reason(),
            local_reason::kCancelledHere);
  other.join();
}

TEST(MeshBytes, AreTheSameEachTime) {
  EXPECT_EQ(some_mesh()->bytes(), some_mesh()->bytes());
  EXPECT_EQ(some_mesh()->id(), some_mesh()->id());
  EXPECT_NE(some_mesh(3)->id(), some_mesh(4)->id());
  EXPECT_EQ(MeshBytes::from_serialized(some_mesh()->bytes()).id(), some_mesh()->id());
}

TEST(MeshBytes, HaveTheDigestAsId) {
  EXPECT_EQ(mesh_id_of("abc"), "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_TRUE(is_mesh_id(mesh_id_of("abc")));
  EXPECT_FALSE(is_mesh_id("sha256:BA7816BF8F01CFEA414140DE5DAE2223B00361A396177A9CB410FF61F20015AD"));
  EXPECT_FALSE(is_mesh_id("part.vtk"));
}

TEST(MeshBytes, RefuseWhatIsNoMesh) {
  EXPECT_EQ(error_of([] { MeshBytes::from_serialized("solid cube"); }).reason(), local_reason::kNotControlMesh);
  EXPECT_EQ(error_of([] { MeshBytes::from_serialized(""); }).reason(), local_reason::kNotControlMesh);
}

}  // namespace
}  // namespace ccslice::client
