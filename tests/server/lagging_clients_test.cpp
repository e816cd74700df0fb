// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Clients that stop reading: what their calls give back meanwhile, and that they go on with the same bytes.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/range_reader.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// Clients that read the first message and no more, of a server with memory for a few of them.
class LaggingClients : public ::testing::Test {
 protected:
  explicit LaggingClients(const ServerOptions& server_options = options()) : server_(server_options) {}

  static ServerOptions options() {
    ServerOptions options = test_options();
    options.stream_window_bytes = 4 << 20;
    options.stream_budget_bytes = 8 << 20;
    return options;
  }

  void SetUp() override { id_ = server_.upload_good(make_block(2, 10)); }

  /// Far more than the transport holds.
  v1::SliceRangeRequest request(std::uint32_t layers) {
    v1::SliceRangeRequest request = slice_request(id_, 0.01, 50, layers);
    request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    return request;
  }
  std::unique_ptr<RangeReader> call(const v1::SliceRangeRequest& request) {
    auto reader = std::make_unique<RangeReader>();
    reader->stub = server_.new_stub();
    reader->stream = reader->stub->SliceRange(&reader->context, request);
    return reader;
  }
  /// Sweeps until the condition holds.
  template <class Condition>
  bool comes_true(const Condition& condition, std::chrono::milliseconds limit = 10s) {
    return eventually(
        [&] {
          state().idle_watch.sweep();
          return condition();
        },
        limit);
  }
  ServiceState& state() { return server_.server().state(); }

  TestServer server_;
  std::string id_;
};

TEST_F(LaggingClients, KeepTheMessageBeingSentAndNothingElse) {
  const auto reader = call(request(400));
  ASSERT_TRUE(reader->read());
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 2s));
  EXPECT_TRUE(comes_true([this] { return state().scratch.used_bytes() == 0 && state().admission.running() == 0; }));
  EXPECT_EQ(state().streams.used_bytes(), 0u);
  EXPECT_EQ(state().calls.open(), 1u);
  EXPECT_TRUE(server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok()) << "others are served";
}

TEST_F(LaggingClients, ShedWhenOthersWaitForMemory) {
  const auto reader = call(request(400));
  ASSERT_TRUE(reader->read());
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 2s));
  // Until it has come to a stop: what it gives back before might serve the other one.
  for (int k = 0; k < 3; ++k) {
    std::this_thread::sleep_for(100ms);
    state().executor.wait_idle();
  }
  MemoryBudget::Share rest(state().scratch);
  EXPECT_TRUE(rest.resize(state().scratch.capacity_bytes() - state().scratch.used_bytes()));
  std::this_thread::sleep_for(2 * LagTimes{}.in_need);
  server_.server().relieve();
  EXPECT_EQ(state().admission.running(), 1u) << "nobody waits for memory";
  bool is_served = false;
  std::thread other([&] { is_served = server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok(); });
  EXPECT_TRUE(eventually(
      [this] {
        server_.server().relieve();
        return state().admission.running() == 0 && state().admission.waiting() == 0;
      },
      20s));
  other.join();
  EXPECT_TRUE(is_served);
}

TEST_F(LaggingClients, GetTheSameBytesWhenTheyReadOn) {
  const auto all = call(request(400));
  all->read_all();
  ASSERT_TRUE(all->status.ok()) << all->status.error_message();
  std::vector<std::unique_ptr<RangeReader>> readers;
  for (int i = 0; i < 6; ++i) readers.push_back(call(request(400)));
  std::vector<std::thread> threads;
  for (const auto& reader : readers) threads.emplace_back([&] { EXPECT_TRUE(reader->read()); });
  EXPECT_TRUE(comes_true(
      [&] { return state().calls.open() == 6 && state().admission.running() == 0 && state().admission.waiting() == 0; },
      20s))
      << "each had its turn, though there is memory for two";
  for (std::thread& thread : threads) thread.join();
  threads.clear();
  for (const auto& reader : readers) threads.emplace_back([&] { reader->read_all(); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& reader : readers) {
    EXPECT_TRUE(reader->status.ok()) << reader->status.error_message();
    EXPECT_TRUE(reader->bytes == all->bytes);
  }
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() == 0; }, 2s));
  EXPECT_EQ(state().streams.used_bytes(), 0u);
}

TEST_F(LaggingClients, EndWhereverTheyAreStopped) {
  for (const bool waits : {false, true}) {
    const auto reader = call(request(400));
    ASSERT_TRUE(reader->read());
    EXPECT_TRUE(comes_true([this] { return state().admission.running() == 0; }));
    MemoryBudget::Share all(state().scratch);
    EXPECT_TRUE(all.resize(state().scratch.capacity_bytes()));
    std::thread reads_on;
    if (waits) {
      reads_on = std::thread([&] { reader->read_all(); });
      EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s)) << "for memory";
    }
    reader->context.TryCancel();
    if (!waits) reads_on = std::thread([&] { reader->read_all(); });
    reads_on.join();
    EXPECT_EQ(reader->status.error_code(), grpc::StatusCode::CANCELLED);
    EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 2s));
  }
  EXPECT_EQ(state().scratch.used_bytes(), 0u);
  EXPECT_EQ(state().streams.used_bytes(), 0u);
}

/// A server that takes more memory than it should do with, whatever it does.
class CrowdedLaggingClients : public LaggingClients {
 protected:
  static ServerOptions crowded() {
    ServerOptions crowded = options();
    crowded.memory_bytes = 16 << 20;
    return crowded;
  }
  CrowdedLaggingClients() : LaggingClients(crowded()) {}
};

TEST_F(CrowdedLaggingClients, AreEnded) {
  const auto reader = call(request(400));
  ASSERT_TRUE(reader->read());
  EXPECT_TRUE(eventually(
      [this] {
        server_.server().relieve();
        return state().calls.open() == 0;
      },
      10s));
  reader->read_all();
  EXPECT_EQ(reader->status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok()) << "others are served";
}

/// Of a server that has memory for 64 open calls, and lists its meshes with some hundred kilobytes.
class UnreadAnswers : public LaggingClients {
 protected:
  static ServerOptions small() {
    ServerOptions small = options();
    small.memory_bytes = 64 * kOpenCallBytes;
    small.idle_timeout = 2s;
    return small;
  }
  UnreadAnswers() : LaggingClients(small()) {
    for (int i = 0; i < 24; ++i) server_.upload_good(with_long_names(make_block(1, 1 + 0.1 * i)));
  }
  void SetUp() override {
    LaggingClients::SetUp();
    EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s)) << "the uploads";
  }
  static v1::ControlMesh with_long_names(v1::ControlMesh mesh) {
    mesh = with_channels(std::move(mesh), 64);
    for (std::string& name : *mesh.mutable_channel_names()) name += std::string(160, 'x');
    return mesh;
  }

  /// Whose summary takes almost 80 kilobytes.
  static v1::ControlMesh with_many_regions() {
    constexpr int kRegions = 255;
    v1::ControlMesh mesh = with_long_names(make_block(7, 10));
    for (int i = 0; i < kRegions; ++i) mesh.add_cell_region_names(std::to_string(i) + std::string(240, 'x'));
    for (int cell = 0; cell < mesh.cell_kinds_size(); ++cell) {
      mesh.add_cell_regions(static_cast<std::uint32_t>(cell % kRegions));
    }
    return mesh;
  }

  /// A call whose answer isn't read before finish().
  struct UnreadCall {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    std::unique_ptr<v1::SlicerService::Stub> stub;
    bool is_answered = false;  // In part.

    virtual ~UnreadCall() = default;
    /// Has `status` for its tag.
    virtual void read(grpc::Status& status) = 0;

    /// Nothing is sent or received but meanwhile.
    void poll() {
      void* tag = nullptr;
      bool ok = false;
      const auto end = std::chrono::system_clock::now() + 20ms;
      const bool got = queue.AsyncNext(&tag, &ok, end) == grpc::CompletionQueue::GOT_EVENT;
      is_answered = is_answered || (got && tag == this);
    }
    grpc::Status finish() {
      grpc::Status status;
      read(status);
      void* tag = nullptr;
      for (bool ok = false; tag != &status;) queue.Next(&tag, &ok);
      return status;
    }
  };
  struct ListCall final : UnreadCall {
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::ListMeshesResponse>> reader;
    v1::ListMeshesResponse response;

    void read(grpc::Status& status) override { reader->Finish(&response, &status, &status); }
  };
  std::unique_ptr<ListCall> list() {
    auto call = std::make_unique<ListCall>();
    call->stub = server_.new_narrow_stub();
    call->reader = call->stub->PrepareAsyncListMeshes(&call->context, {}, &call->queue);
    call->reader->StartCall();
    call->reader->ReadInitialMetadata(call.get());  // Else nothing is sent before Finish().
    return call;
  }
  /// Says which mesh comes, and no more.
  struct BegunUpload final : UnreadCall {
    std::unique_ptr<grpc::ClientAsyncWriter<v1::UploadMeshRequest>> writer;
    v1::UploadMeshRequest start;
    v1::UploadMeshResponse response;

    void read(grpc::Status& status) override { writer->Finish(&status, &status); }
  };
  std::unique_ptr<BegunUpload> upload(const std::string& id) {
    auto call = std::make_unique<BegunUpload>();
    call->stub = server_.new_narrow_stub();
    call->context.set_initial_metadata_corked(true);
    call->writer = call->stub->PrepareAsyncUploadMesh(&call->context, &call->response, &call->queue);
    call->writer->StartCall(nullptr);
    call->start.mutable_start()->set_mesh_id(id);
    call->start.mutable_start()->set_size_bytes(1);
    call->writer->Write(call->start, nullptr);
    call->writer->ReadInitialMetadata(call.get());
    return call;
  }
  /// `begin` begins a call. It is answered, and the server still keeps it.
  template <class Begin>
  auto unread(const Begin& begin) {
    const std::size_t open = state().calls.open();
    auto call = begin();
    EXPECT_TRUE(eventually(
        [&] {
          call->poll();
          return call->is_answered && state().calls.open() == open + 1;
        },
        5s));
    return call;
  }
  std::unique_ptr<ListCall> unread_list() {
    return unread([this] { return list(); });
  }
  std::unique_ptr<BegunUpload> unread_upload(const std::string& id) {
    return unread([&] { return upload(id); });
  }
  void expect_dropped(UnreadCall& call) {
    EXPECT_TRUE(comes_true([&] {
      call.poll();
      return state().calls.open() == 0;
    }));
    expect_stalled(call.finish());
  }
  static void expect_stalled(const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_NE(status.error_message().find("STREAM_STALLED"), std::string::npos) << status.error_message();
  }
};

TEST_F(UnreadAnswers, CountAsOpenCallsUntilTheyAreRead) {
  const auto first = unread_list(), second = unread_list();
  const grpc::Status refused = list()->finish();
  EXPECT_EQ(failure_of(refused).reason, "SERVER_BUSY") << refused.error_message();
  EXPECT_TRUE(failure_of(refused).retry);
  EXPECT_TRUE(server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok()) << "what is small is served";
  for (const auto& call : {first.get(), second.get()}) {
    EXPECT_TRUE(call->finish().ok());
    EXPECT_GT(call->response.ByteSizeLong(), 300'000u);
  }
  EXPECT_TRUE(list()->finish().ok());
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
}

TEST_F(UnreadAnswers, OfUploadsCountAsOpenCallsUntilTheyAreRead) {
  const std::string id = server_.upload_good(with_many_regions());
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
  std::vector<std::unique_ptr<BegunUpload>> uploads;
  for (int i = 0; i < 9; ++i) uploads.push_back(unread_upload(id));
  const grpc::Status refused = upload(id)->finish();
  EXPECT_EQ(failure_of(refused).reason, "SERVER_BUSY") << refused.error_message();
  EXPECT_TRUE(failure_of(refused).retry);
  EXPECT_TRUE(server_.slice(slice_request(id_, 0.5, 0, 10)).status.ok()) << "what is small is served";
  for (const auto& call : uploads) {
    EXPECT_TRUE(call->finish().ok());
    EXPECT_TRUE(call->response.already_cached());
    EXPECT_GT(call->response.ByteSizeLong(), 4u * (16 << 10)) << "each counts as five calls";
    EXPECT_LT(call->response.ByteSizeLong(), 5u * (16 << 10));
  }
  EXPECT_TRUE(upload(id)->finish().ok());
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
}

TEST_F(UnreadAnswers, AreDroppedInTheEnd) { expect_dropped(*unread_list()); }

TEST_F(UnreadAnswers, OfUploadsAreDroppedInTheEnd) {
  const std::string id = server_.upload_good(with_many_regions());
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
  expect_dropped(*unread_upload(id));
}

TEST_F(UnreadAnswers, OfUploadsAreDroppedWhereMemoryRunsShort) {
  const std::string id = server_.upload_good(with_many_regions());
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
  const auto call = unread_upload(id);
  EXPECT_TRUE(eventually(
      [&] {
        server_.server().relieve();
        call->poll();
        return state().calls.open() == 0;
      },
      5s));
  expect_stalled(call->finish());
}

TEST_F(UnreadAnswers, GoWithTheirConnections) {
  const auto call = unread_list();
  call->context.TryCancel();
  EXPECT_TRUE(comes_true([&] {
    call->poll();
    return state().calls.open() == 0;
  }));
  EXPECT_EQ(call->finish().error_code(), grpc::StatusCode::CANCELLED);
}

/// Calls of one client by the hundred that say nothing, of a server that has memory for 512.
TEST(SilentCalls, AreBoundedAndLeaveNothing) {
  ServerOptions options = test_options();
  options.memory_bytes = 512 * kOpenCallBytes;
  TestServer server(options);
  const std::string id = server.upload_good(make_block(2, 10));
  ServiceState& state = server.server().state();
  struct Silent {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>> stream;
  };
  std::vector<std::unique_ptr<v1::SlicerService::Stub>> stubs;
  std::vector<std::unique_ptr<Silent>> calls;
  for (int i = 0; i < 800; ++i) {
    if (i % 100 == 0) stubs.push_back(server.new_stub());
    calls.push_back(std::make_unique<Silent>());
    calls.back()->stream = stubs.back()->ProbePoints(&calls.back()->context);
  }
  EXPECT_TRUE(eventually([&] { return state.calls.open() == 512 / 4 * 3; }, 10s)) << "a quarter isn't one client's";
  v1::ProbePointsResponse response;
  EXPECT_FALSE(calls.back()->stream->Read(&response));
  EXPECT_EQ(failure_of(calls.back()->stream->Finish()).reason, "SERVER_BUSY");
  for (const auto& call : calls) call->context.TryCancel();
  EXPECT_TRUE(eventually([&] { return state.calls.open() == 0; }, 10s));
  EXPECT_TRUE(server.slice(slice_request(id, 0.5, 0, 10)).status.ok());
}

TEST_F(LaggingClients, GiveTheirRequestsMemoryBack) {
  const auto reader = call(request(400));
  ASSERT_TRUE(reader->read());
  EXPECT_EQ(state().requests.used_bytes(), 0u);
}

TEST_F(LaggingClients, AreCutOffByAShutdownWhileTheyWaitForMemory) {
  const auto reader = call(request(400));
  ASSERT_TRUE(reader->read());
  EXPECT_TRUE(comes_true([this] { return state().admission.running() == 0; }));
  MemoryBudget::Share all(state().scratch);
  EXPECT_TRUE(all.resize(state().scratch.capacity_bytes()));
  std::thread reads_on([&] { reader->read_all(); });
  EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
  state().admission.drain();
  EXPECT_EQ(state().admission.waiting(), 1u) << "a call that runs may go on";
  state().calls.cut_off_all();
  reads_on.join();
  EXPECT_EQ(failure_of(reader->status).reason, "SERVER_SHUTTING_DOWN");
}

/// Sends many batches and reads none of their answers before it is told to.
class UnreadPoints {
 public:
  static constexpr int kBatches = 30;

  UnreadPoints(std::unique_ptr<v1::SlicerService::Stub> stub, const std::string& mesh_id) : stub_(std::move(stub)) {
    stream_ = stub_->EvaluatePoints(&context);
    writer_ = std::thread([this, mesh_id] {
      for (int i = 0; i < kBatches; ++i) {
        if (!stream_->Write(request(mesh_id, i))) return;
      }
      stream_->WritesDone();
    });
  }
  ~UnreadPoints() { writer_.join(); }

  /// Whether they come in the order of their batches.
  grpc::Status read_all(bool& in_order) {
    v1::EvaluatePointsResponse response;
    int batch = 0;
    in_order = true;
    while (stream_->Read(&response)) {
      if (batch == 0) position_mm_ = response.positions_mm(0);
      const double offset_mm = response.positions_mm(0) - position_mm_;
      in_order = in_order && response.positions_mm_size() == 3 * 4096 && std::abs(offset_mm - batch) < 1e-9;
      ++batch;
    }
    in_order = in_order && batch == kBatches;
    return stream_->Finish();
  }

  grpc::ClientContext context;

 private:
  /// Each moved on by a millimetre.
  static v1::EvaluatePointsRequest request(const std::string& mesh_id, int batch) {
    v1::EvaluatePointsRequest request;
    if (batch == 0) request.set_mesh_id(mesh_id);
    for (const double number : {1.0, 0.0, 0.0, 1.0 * batch, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) {
      request.mutable_placement()->add_matrix(number);
    }
    for (int i = 0; i < 4096; ++i) {
      request.add_limit_cells(0);
      for (int axis = 0; axis < 3; ++axis) request.add_uvw(0.5);
    }
    return request;
  }

  std::unique_ptr<v1::SlicerService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::EvaluatePointsRequest, v1::EvaluatePointsResponse>> stream_;
  std::thread writer_;
  double position_mm_ = 0;
};

TEST_F(LaggingClients, OfPointsKeepTheAnswerBeingSentAndGoOnInOrder) {
  UnreadPoints reader(server_.new_narrow_stub(), id_);
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() > 0; }, 5s));
  EXPECT_TRUE(comes_true([this] { return state().admission.running() == 0 && state().scratch.used_bytes() == 0; }));
  EXPECT_EQ(state().calls.open(), 1u);
  EXPECT_EQ(state().metrics.shed.load(), 1u);
  bool in_order = false;
  const grpc::Status status = reader.read_all(in_order);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(in_order);
}

TEST_F(LaggingClients, OfPointsEndWhereTheyAreStopped) {
  UnreadPoints reader(server_.new_narrow_stub(), id_);
  EXPECT_TRUE(comes_true([this] { return state().metrics.shed.load() == 1; }));
  reader.context.TryCancel();
  bool in_order = false;
  EXPECT_EQ(reader.read_all(in_order).error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 2s));
}

/// Of a server with memory for the solvers of three calls.
class CrampedLaggingClients : public LaggingClients {
 protected:
  CrampedLaggingClients() : LaggingClients(cramped()) {}

 private:
  static ServerOptions cramped() {
    ServerOptions cramped = options();
    cramped.scratch_budget_bytes = 16 << 20;
    return cramped;
  }
};

TEST_F(CrampedLaggingClients, OfPointsTakeTurns) {
  std::vector<std::unique_ptr<UnreadPoints>> readers;
  for (int i = 0; i < 10; ++i) readers.push_back(std::make_unique<UnreadPoints>(server_.new_narrow_stub(), id_));
  EXPECT_TRUE(comes_true(
      [this] {
        return state().metrics.shed.load() == 10 && state().admission.running() == 0 &&
               state().admission.waiting() == 0 && state().scratch.used_bytes() == 0;
      },
      20s));
  std::vector<std::thread> threads;
  for (const auto& reader : readers) {
    threads.emplace_back([&reader] {
      bool in_order = false;
      const grpc::Status status = reader->read_all(in_order);
      EXPECT_TRUE(status.ok()) << status.error_message();
      EXPECT_TRUE(in_order);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() == 0; }, 2s));
}

/// Reads a stream of triangles and puts it together, however it was cut into messages.
class SurfaceReader {
 public:
  SurfaceReader(std::unique_ptr<v1::SlicerService::Stub> stub, const std::string& mesh_id) : stub_(std::move(stub)) {
    v1::TessellateBoundaryRequest request;
    request.set_mesh_id(mesh_id);
    request.set_chord_tolerance_mm(0.002);
    stream_ = stub_->TessellateBoundary(&context, request);
  }

  bool read() {
    v1::TessellateBoundaryResponse message;
    if (!stream_->Read(&message)) return false;
    largest_message = message.ByteSizeLong();
    if (message.has_header()) header = message.header();
    const v1::VertexChunk& more = message.vertex_chunk();
    positions_mm.insert(positions_mm.end(), more.positions_mm().begin(), more.positions_mm().end());
    materials.insert(materials.end(), more.channel_values().begin(), more.channel_values().end());
    const auto& vertices = message.triangle_chunk().vertices();
    triangles.insert(triangles.end(), vertices.begin(), vertices.end());
    return true;
  }
  void read_all() {
    while (read()) {
    }
    status = stream_->Finish();
  }

  grpc::ClientContext context;
  v1::TessellationHeader header;
  std::vector<double> positions_mm;
  std::vector<float> materials;
  std::vector<std::uint32_t> triangles;
  std::size_t largest_message = 0;  // Of late.
  grpc::Status status;

 private:
  std::unique_ptr<v1::SlicerService::Stub> stub_;
  std::unique_ptr<grpc::ClientReader<v1::TessellateBoundaryResponse>> stream_;
};

TEST_F(LaggingClients, OfTrianglesKeepAMessageAndNothingElse) {
  SurfaceReader reader(server_.new_narrow_stub(), id_);
  ASSERT_TRUE(reader.read());
  EXPECT_GT(reader.header.triangle_count(), 30'000u) << "over a megabyte";
  EXPECT_TRUE(comes_true([this] { return state().admission.running() == 0; }));
  EXPECT_EQ(state().scratch.used_bytes(), 0u);
  EXPECT_EQ(state().streams.used_bytes(), 0u);
  EXPECT_EQ(state().calls.open(), 1u);
  EXPECT_EQ(state().metrics.shed.load(), 1u);
}

TEST_F(LaggingClients, OfTrianglesGetTheSameOnesWhenTheyReadOn) {
  SurfaceReader whole(server_.new_stub(), id_);
  whole.read_all();
  ASSERT_TRUE(whole.status.ok()) << whole.status.error_message();
  ASSERT_EQ(whole.header.triangle_count(), whole.triangles.size() / 3);
  EXPECT_EQ(whole.header.vertex_count(), whole.positions_mm.size() / 3);
  SurfaceReader reader(server_.new_narrow_stub(), id_);
  ASSERT_TRUE(reader.read());
  for (const std::uint64_t times : {1, 2}) {  // Among the vertices, which come first.
    EXPECT_TRUE(comes_true([&] { return state().metrics.shed.load() == times; })) << times;
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(reader.read());
  }
  EXPECT_LE(reader.largest_message, (64u << 10) + 100) << "it may be slow";
  reader.read_all();
  EXPECT_TRUE(reader.status.ok()) << reader.status.error_message();
  EXPECT_TRUE(reader.positions_mm == whole.positions_mm);
  EXPECT_TRUE(reader.materials == whole.materials);
  EXPECT_TRUE(reader.triangles == whole.triangles);
  EXPECT_TRUE(eventually([this] { return state().streams.used_bytes() == 0; }, 2s));
  EXPECT_EQ(state().scratch.used_bytes(), 0u);
}

TEST_F(LaggingClients, OfTrianglesWaitForMemoryAndCanBeStoppedThen) {
  for (const bool is_stopped : {false, true}) {
    MemoryBudget::Share all(state().streams);
    EXPECT_TRUE(all.resize(state().streams.capacity_bytes()));
    SurfaceReader reader(server_.new_stub(), id_);
    std::thread reads([&] { reader.read_all(); });
    EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
    EXPECT_EQ(state().admission.running(), 0u) << "others have its place";
    EXPECT_EQ(state().scratch.used_bytes(), 0u);
    if (is_stopped) reader.context.TryCancel();
    if (!is_stopped) all.give_back();
    reads.join();
    EXPECT_EQ(reader.status.error_code(), is_stopped ? grpc::StatusCode::CANCELLED : grpc::StatusCode::OK);
    EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 2s));
  }
}

}  // namespace
}  // namespace ccslice::server
