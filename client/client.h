// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A client of ccslice.v1.SlicerService that survives what happens to long jobs.
//
//   ccslice::client::Client client({.address = "localhost:50051"});
//   auto mesh = std::make_shared<const MeshBytes>(control_mesh);
//   client.ensure_uploaded(mesh);
//   v1::SliceRangeRequest request = ...;  // request.job.parts[0].mesh_id = mesh->id()
//   client.slice(request, [](const v1::SliceHeader& header, Layer layer) { ... });
//
// - A server that has dropped the mesh (restart, full cache, another replica) gets it again: meshes passed to
//   ensure_uploaded() are remembered for that, until forget().
// - A stream that breaks is resumed at the first layer not yet delivered, after a pause. Every layer is delivered
//   exactly once, in order. The first header pins engine version and grid: layers of different engines or grids are
//   never mixed.
// - With several servers (ClientOptions::addresses, or a name with several addresses, which is looked up again every 30
//   seconds and after failures) the calls of a mesh go to one of
//   them, which all clients agree on, so that each server holds some of the meshes. Where it fails, or is busy, the
//   call goes on with the next one at once; pauses come only when all have failed.
// - Pauses double from RetryPolicy::first_pause up to longest_pause, unless the server asks for another one. Where
//   nobody answers, the next attempt follows as soon as somebody does. Patience begins with the first failure after the
//   last new layer; after RetryPolicy::patience the last error is thrown. What can't pass is thrown at once.
//
// Thread-safe. All calls block; another thread stops them through Cancellation.

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ccslice/v1/service.grpc.pb.h"
#include "client/address.h"
#include "client/cancellation.h"
#include "client/client_error.h"
#include "client/credentials.h"
#include "client/job.h"
#include "client/layer.h"
#include "client/mesh_bytes.h"
#include "client/surface.h"

namespace ccslice::client {

struct RetryPolicy {
  int max_attempts = 0;                         // In a row without progress, the first included. 0: any number.
  std::chrono::milliseconds patience{120'000};  // After a failure: how long to go on without progress.
  std::chrono::milliseconds first_pause{200};
  std::chrono::milliseconds longest_pause{10'000};
};

struct ClientOptions {
  std::string address = "localhost:50051";
  RetryPolicy retry = {};
  std::vector<std::string> addresses = {};     // Of several servers, instead of `address`.
  std::optional<TlsFiles> tls = std::nullopt;  // TLS with all of them but unix:, as with https:// before an address.
  std::string token_file =
      {};  // Its first line goes with every call as a bearer token. It is read again if it changes.
  /// Finds the servers behind a name, from a thread of its own, maybe a moment longer than the client lives.
  Resolver resolver = look_up;
};

/// Options of one call; they cover its retries and pauses too.
struct CallOptions {
  std::optional<std::chrono::system_clock::time_point> deadline = std::nullopt;  // DEFAULT: none.
  Cancellation* cancellation = nullptr;
  std::optional<RetryPolicy> retry = std::nullopt;  // DEFAULT: the client's.
  unsigned split = 1;  // slice(): how many of the servers slice at once, each a block of layers after the other.
};

/// Layers are bound to what is pinned here; empty fields are filled in from the first header. Keep it to continue a job
/// later.
struct SlicePin {
  std::string engine_version;
  std::optional<v1::Grid> grid;
};

/// Called with every layer, in order, complete and checked. May throw: the call is cancelled and the exception goes on.
using LayerCallback = std::function<void(const v1::SliceHeader& header, Layer layer)>;

/// Bytes sent, bytes in all.
using UploadProgress = std::function<void(std::uint64_t, std::uint64_t)>;

/// How far the server is with the mesh. Only while it prepares it, about twice a second, and never less far than
/// before, but an upload that is repeated may begin anew; not at all where the server is too old, or a proxy leads
/// elsewhere. Called from another thread, which ends before the call. May throw: the call is cancelled and the
/// exception goes on.
using PreparationReport = std::function<void(const v1::GetPreparationResponse&)>;

/// Gives x, y, z of the next points, `most_points` of them at most, mm; nothing after the last one.
using PointSource = std::function<std::vector<double>(std::size_t most_points)>;
using PointAnswers = std::function<void(std::span<const double> points_mm, const v1::ProbePointsResponse& answer)>;

/// What a whole slice() came to, over all its streams.
struct SliceOutcome {
  v1::SliceHeader header;  // That of the first stream.
  std::uint64_t layers = 0;
  std::uint64_t empty_layers = 0;
  std::uint64_t voxel_count = 0;
  std::uint64_t voxels_interpolated = 0;
  std::uint64_t voxels_unresolved = 0;
  std::uint64_t voxels_repainted = 0;  // 0, unless the server broke the channel tolerance and mended it.
  double max_residual_mm = 0;
  std::uint64_t encoded_bytes = 0;
  std::vector<std::uint64_t> material_voxels;  // For each material; empty if none are chosen.
  std::uint64_t voxels_off_map = 0;            // These three as in LayerStatistics.
  std::uint64_t voxels_scaled_up = 0;
  double least_fraction_sum = 0;
  std::uint64_t voxels_covered = 0;       // Of parts, that another part has: once for each part that lacks them.
  std::uint64_t voxels_cut = 0;           // Of parts, that the job cuts out.
  std::vector<v1::PartVoxels> parts;      // Of a job of several parts or copies: what each part has.
  std::vector<v1::PartOverlap> overlaps;  // Pairs that share voxels, as they are met.
  /// Adds the layers and voxels of another part of the same job.
  void add_counts(const SliceOutcome& part);

  int resumes = 0;    // Streams that broke and were taken up again.
  int reuploads = 0;  // Times that a server had to be given the mesh again.
};

struct UploadOutcome {
  v1::MeshSummary mesh;     // Empty if it was cached and another mesh chose the server.
  bool was_cached = false;  // Nothing was sent.
};

class Attempts;
class Endpoints;
class LayerQueue;
struct Endpoint;
struct PreviewPicture;

class Client {
 public:
  /// Throws ClientError for addresses and files that can't be used. Calls nobody yet.
  explicit Client(const ClientOptions& options);
  /// Uses a channel of your own: a proxy, an in-process server.
  Client(std::shared_ptr<grpc::ChannelInterface> channel, RetryPolicy retry);
  ~Client();

  // Every call throws ClientError.

  v1::GetServerInfoResponse server_info(const CallOptions& call = {});
  /// Uploads the mesh unless the server holds it, and remembers it for later calls that find it missing.
  /// `chosen_by`: the mesh whose server gets it, as that of a job does the job's volumes; by default itself.
  UploadOutcome ensure_uploaded(std::shared_ptr<const MeshBytes> mesh, const UploadProgress& progress = {},
                                const CallOptions& call = {}, const PreparationReport& preparation = {},
                                const std::string& chosen_by = {});
  /// Forgets the mesh and frees its bytes; the server keeps it. False if the client didn't remember it.
  bool forget(const std::string& mesh_id);
  /// A mesh that only the servers' store holds is prepared for that.
  v1::MeshSummary mesh_summary(const std::string& mesh_id, const CallOptions& call = {},
                               const PreparationReport& preparation = {});
  /// Of the first server that answers.
  std::vector<v1::MeshSummary> list_meshes(const CallOptions& call = {});
  /// On every server that answers. False if none held it.
  bool delete_mesh(const std::string& mesh_id, const CallOptions& call = {});
  v1::PlanSlicesResponse plan(const v1::PlanSlicesRequest& request, const CallOptions& call = {});
  /// `pin` may be null. With CallOptions::split layers that come too early are kept, in up to 256 MiB.
  SliceOutcome slice(const v1::SliceRangeRequest& request, const LayerCallback& on_layer, const CallOptions& call = {},
                     SlicePin* pin = nullptr);
  /// Probes points, in batches. `setting`: the mesh, where it is, and which fields; its points don't count. `take`
  /// gets their answers in order, each once, while another thread calls `next`. A stream that breaks goes on with those
  /// that have no answer yet, which are some batches at most, so memory is bounded. What `next` throws is thrown when
  /// all that it gave before is answered; what `take` throws, at once.
  void probe(const v1::ProbePointsRequest& setting, const PointSource& next, const PointAnswers& take,
             const CallOptions& call = {});
  /// The same of points in memory: answers per batch, in order.
  std::vector<v1::ProbePointsResponse> probe(const std::string& mesh_id, const v1::Placement& placement,
                                             const std::vector<double>& points_mm, const CallOptions& call = {});

  /// One picture of a cut, in full. Include client/preview.h.
  PreviewPicture preview(const v1::PreviewRequest& request, const CallOptions& call = {});

  /// The whole limit surface; from the start again where a stream breaks.
  Surface tessellate(const v1::TessellateBoundaryRequest& request, const CallOptions& call = {});

  /// The first server in the order of the mesh that answers, for calls that stay with one. The first of all if none
  /// answers.
  std::shared_ptr<const Endpoint> endpoint_of(const std::string& mesh_id, const CallOptions& call);

 private:
  template <typename Body>
  auto with_retries(const CallOptions& call, const std::vector<std::string>& mesh_ids, Body&& body);
  template <typename Body>
  auto with_retries(const CallOptions& call, Attempts& attempts, int& reuploads, Body&& body);
  /// `chosen_by`: the mesh that proxies choose a server by; of a job its first part's.
  v1::UploadMeshResponse upload_once(const Endpoint& endpoint, const MeshBytes& mesh, const std::string& chosen_by,
                                     const UploadProgress& progress, const CallOptions& call,
                                     const PreparationReport& preparation = {});
  /// Uploads those that the server lacks and we remember.
  void upload_missing(const Endpoint& endpoint, const std::vector<std::string>& mesh_ids, const CallOptions& call);
  SliceOutcome slice_from(std::size_t turn, const v1::SliceRangeRequest& request, const LayerCallback& on_layer,
                          const CallOptions& call, SlicePin& pin);
  SliceOutcome slice_split(unsigned streams, const v1::SliceRangeRequest& request, const LayerCallback& on_layer,
                           const CallOptions& call, SlicePin& pin);
  void slice_blocks(std::size_t turn, v1::SliceRangeRequest request, const CallOptions& call, SlicePin pin,
                    LayerQueue& queue, SliceOutcome& outcome);
  void slice_once(const v1::SliceRangeRequest& request, const LayerCallback& on_layer, const CallOptions& call,
                  SlicePin& pin, Attempts& attempts, SliceOutcome& outcome);
  static v1::MeshSummary get_mesh(const Endpoint& endpoint, const std::string& mesh_id, const CallOptions& call,
                                  const PreparationReport& preparation = {});
  std::shared_ptr<const MeshBytes> remembered(const std::string& mesh_id) const;

  const RetryPolicy retry_;
  const std::unique_ptr<Endpoints> endpoints_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const MeshBytes>> meshes_;
};

}  // namespace ccslice::client
