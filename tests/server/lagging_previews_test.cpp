// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Previews whose clients don't read or say nothing, and those that have to wait for memory.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/preview_fixture.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Pictures far larger than what the transport holds, of a client that reads their first part and no more.
class LaggingPreview : public Preview {
 protected:
  LaggingPreview() : stub_(server_.new_narrow_stub()), stream_(stub_->Preview(&context_)) {}

  v1::PreviewRequest large(std::uint64_t number, bool coarse = true) const {
    v1::PreviewRequest asked = request(number);
    asked.set_width(1500);
    asked.set_height(1500);
    asked.mutable_plane()->mutable_free()->set_across_mm_per_pixel(0.01);
    asked.set_coarse(coarse);
    return asked;
  }
  ServiceState& state() { return server_.server().state(); }
  /// Sweeps until all has been given back.
  bool sheds() {
    return eventually(
        [this] {
          state().idle_watch.sweep();
          return state().scratch.used_bytes() == 0 && state().admission.running() == 0;
        },
        10s);
  }
  /// All but what says when it was painted.
  static void expect_equal(const Shown& got, const Shown& want) {
    EXPECT_EQ(got.stage, want.stage);
    EXPECT_TRUE(got.bytes == want.bytes);
    EXPECT_EQ(got.header.pixels_inside(), want.header.pixels_inside());
  }

  grpc::ClientContext context_;
  std::unique_ptr<v1::SlicerService::Stub> stub_;
  std::unique_ptr<Stream> stream_;
};

TEST_F(LaggingPreview, KeepsTheMessageBeingSentAndGoesOnWithTheSamePicture) {
  const std::vector<Shown> whole = shown({large(1)});
  stream_->Write(large(1));
  ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 5s));
  ASSERT_TRUE(sheds());
  EXPECT_TRUE(server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok()) << "others are served";
  stream_->WritesDone();
  const std::vector<Shown> got = read_all(*stream_);
  EXPECT_TRUE(stream_->Finish().ok());
  ASSERT_EQ(got.size(), whole.size());
  for (std::size_t k = 0; k < got.size(); ++k) expect_equal(got[k], whole[k]);
  EXPECT_GE(state().metrics.shed.load(), 1u);
}

TEST_F(LaggingPreview, EndsAPictureOfWhichTheClientHasSomeBeforeANewerOne) {
  const std::vector<Shown> whole = shown({large(1, /*coarse=*/false)});
  stream_->Write(large(1, /*coarse=*/false));
  ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 5s));
  ASSERT_TRUE(sheds());
  stream_->Write(request(2));
  stream_->WritesDone();
  const std::vector<Shown> got = read_all(*stream_);
  EXPECT_TRUE(stream_->Finish().ok());
  ASSERT_EQ(got.size(), 2u);
  expect_equal(got[0], whole[0]);
  EXPECT_EQ(got[1].number, 2u);
}

TEST_F(LaggingPreview, EndsWhenItIsStopped) {
  stream_->Write(large(1));
  ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 5s));
  ASSERT_TRUE(sheds());
  context_.TryCancel();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
}

/// What waits to go on, for memory that another one has.
class WaitingPreview : public LaggingPreview {
 protected:
  void SetUp() override {
    stream_->Write(large(1));
    ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 5s));
    ASSERT_TRUE(sheds());
    ASSERT_TRUE(all_.resize(state().scratch.capacity_bytes()));
    reading_ = std::thread([this] {
      v1::PreviewResponse message;
      while (stream_->Read(&message)) {
      }
    });
    EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
  }
  ~WaitingPreview() override {
    context_.TryCancel();
    reading_.join();
  }

  MemoryBudget::Share all_{state().scratch};
  std::thread reading_;
};

TEST_F(WaitingPreview, EndsWhenItIsStopped) {
  context_.TryCancel();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 5s));
}

TEST_F(WaitingPreview, IsCutOffByAShutdown) {
  state().admission.drain();
  EXPECT_EQ(state().admission.waiting(), 1u) << "a call that runs may go on";
  state().calls.cut_off_all();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 5s));
}

TEST_F(Preview, WaitsForMemoryThatOthersHave) {
  ServiceState& state = server_.server().state();
  MemoryBudget::Share all(state.scratch);
  ASSERT_TRUE(all.resize(state.scratch.capacity_bytes()));
  grpc::ClientContext context, stopped;
  const auto stream = server_.stub().Preview(&context), other = server_.stub().Preview(&stopped);
  stream->Write(request(1));
  other->Write(request(1));
  ASSERT_TRUE(eventually([&state] { return state.admission.waiting() == 2; }, 5s));
  EXPECT_EQ(state.admission.running(), 0u);
  stopped.TryCancel();
  EXPECT_TRUE(eventually([&state] { return state.admission.waiting() == 1; }, 5s));
  stream->Write(request(2));
  std::this_thread::sleep_for(100ms);
  all.give_back();
  stream->WritesDone();
  const std::vector<Shown> got = read_all(*stream);
  EXPECT_TRUE(stream->Finish().ok());
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.front().number, 2u) << "the latest wins";
}

/// A server with memory for small pictures.
class CrampedPreview : public Preview {
 protected:
  static ServerOptions options() {
    ServerOptions options = test_options();
    options.scratch_budget_bytes = 32 << 20;
    return options;
  }
  CrampedPreview() : Preview(options()) {}
};

TEST_F(CrampedPreview, TakesMemoryForTheRegionOfALayerAndNotForAllOfIt) {
  v1::PreviewRequest asked = layer_request(1, 0.002, 0);
  v1::SliceJob& job = *asked.mutable_plane()->mutable_layer()->mutable_job();
  job.mutable_grid()->mutable_pitch()->set_z_mm(0.1);
  v1::VoxelBox& voxels = *job.mutable_region()->mutable_voxels();
  voxels.set_first_column(100);
  voxels.mutable_extent()->set_columns(64);
  voxels.mutable_extent()->set_rows(64);
  voxels.mutable_extent()->set_layers(1);
  EXPECT_EQ(shown({asked}).back().header.width(), 64u);
}

TEST_F(CrampedPreview, GivesUpWhatItKeepsIdleWhenOthersWaitForMemory) {
  ServiceState& state = server_.server().state();
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  stream->Write(request(1));
  v1::PreviewResponse message;
  ASSERT_TRUE(stream->Read(&message) && message.last());
  ASSERT_TRUE(eventually([&state] { return state.admission.running() == 0; }, 5s));
  const std::uint64_t kept = state.scratch.used_bytes();
  ASSERT_GT(kept, 0u);
  MemoryBudget::Share rest(state.scratch);
  ASSERT_TRUE(rest.resize(state.scratch.capacity_bytes() - kept));
  bool is_served = false;
  std::thread other([&] { is_served = server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok(); });
  EXPECT_TRUE(eventually([&state] { return state.admission.wants_memory(); }, 5s));
  EXPECT_TRUE(eventually(
      [&] {
        server_.server().relieve();
        return state.scratch.used_bytes() < state.scratch.capacity_bytes();
      },
      5s));
  rest.give_back();
  other.join();
  EXPECT_TRUE(is_served);
}

TEST_F(CrampedPreview, RefusesWhatWillNeverFit) {
  v1::PreviewRequest asked = request(1);
  asked.set_width(2000);
  asked.set_height(2000);
  const Failure refused = failure(asked);
  EXPECT_EQ(refused.reason, "JOB_EXCEEDS_MEMORY");
  EXPECT_FALSE(refused.retry);
  EXPECT_THAT(refused.message, HasSubstr("a picture of 2000 x 2000 pixels takes about"));
  EXPECT_THAT(refused.message, HasSubstr("ask for a smaller one, or raise --scratch-budget-bytes"));
}

/// A server that looks often for silent clients.
/// Idle calls keep what their requests set, here a table of calibration that nobody looks at.
TEST_F(Preview, KeepsWhatLargeRequestsSetWithinABudget) {
  ServiceState& state = server_.server().state();
  v1::PreviewRequest large = request(1);
  for (const char* name : {"soft", "hard"}) large.mutable_printing()->add_materials()->set_name(name);
  large.mutable_printing()->mutable_materials(1)->set_rgba(0xff0000ff);
  v1::CalibrationMap& table = *large.mutable_printing()->mutable_map()->mutable_calibration();
  table.set_channel("x");
  table.set_material("soft");
  table.set_base("hard");
  for (int i = 0; i < 100'000; ++i) table.add_points();
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<Stream>> streams;
  std::uint64_t idle = 0;
  Failure refused;
  while (refused.reason.empty() && idle < 20) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(server_.stub().Preview(contexts.back().get()));
    v1::PreviewResponse message;
    bool is_answered = streams.back()->Write(large);
    do {
      is_answered = is_answered && streams.back()->Read(&message);
    } while (is_answered && !message.last());
    is_answered ? static_cast<void>(++idle) : static_cast<void>(refused = failure_of(streams.back()->Finish()));
  }
  EXPECT_EQ(refused.reason, "SERVER_BUSY");
  EXPECT_GT(idle, 0u);
  EXPECT_GT(state.requests.used_bytes(), idle * 4'000'000);
  EXPECT_LE(state.requests.used_bytes(), state.requests.capacity_bytes());
  EXPECT_EQ(shown({request(1)}).size(), 1u) << "usual ones are served";
  for (const auto& context : contexts) context->TryCancel();
  EXPECT_TRUE(eventually([&] { return state.requests.used_bytes() == 0; }, 5s));
}

class PreviewPatience : public Preview {
 protected:
  static ServerOptions impatient() {
    ServerOptions options = test_options();
    options.preview_idle_timeout = 300ms;
    options.idle_timeout = 300ms;
    return options;
  }
  explicit PreviewPatience() : Preview(impatient()) {
    sweeping_ = std::thread([this] {
      while (!over_) {
        server_.server().sweep();
        std::this_thread::sleep_for(20ms);
      }
    });
  }
  ~PreviewPatience() override {
    over_ = true;
    sweeping_.join();
  }

 private:
  std::atomic<bool> over_{false};
  std::thread sweeping_;
};

TEST_F(PreviewPatience, EndsCallsThatAskForNothing) {
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  EXPECT_FALSE(stream->Read(&message));
  const Failure failed = failure_of(stream->Finish());
  EXPECT_EQ(failed.code, grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(failed.reason, "STREAM_IDLE");
}

TEST_F(PreviewPatience, EndsCallsThatDontRead) {
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  for (std::uint64_t number = 1; number <= 20; ++number) {
    v1::PreviewRequest large = request(number);
    large.set_width(2048);
    large.set_height(2048);
    large.mutable_plane()->mutable_free()->set_across_mm_per_pixel(0.006);
    if (!stream->Write(large)) break;
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_TRUE(eventually([&] { return server_.server().state().admission.running() == 0; }, 5s));
  v1::PreviewResponse message;
  while (stream->Read(&message)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_EQ(shown({request(1)}).size(), 1u) << "others are served";
}

}  // namespace
}  // namespace ccslice::server
