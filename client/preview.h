// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of cuts. For a drag, one thread asks and another one takes the pictures:
//
//   PreviewStream stream(client, mesh_id, {.cancellation = &cancellation});
//   stream.ask(request);             // As often as the plane moves; never waits for pictures.
//   while (auto picture = stream.next()) show(*picture);
//
// A stream that breaks ends with an error: make another one. Client::preview() makes one picture, and tries again.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/preview.pb.h"
#include "client/client.h"

namespace ccslice::client {

struct PreviewPicture {
  std::uint64_t number = 0;  // That of the request.
  v1::PreviewStage stage = v1::PREVIEW_STAGE_UNSPECIFIED;
  v1::PreviewHeader header;
  std::string bytes;  // A PNG file, or header.width * header.height * 4 bytes, rows from the top.
  std::vector<v1::PreviewOutline> outlines;  // If asked for.
};

/// Puts the messages of a Preview stream together to pictures. Pure: no calls. Whatever a server sends, a picture ends
/// and takes no more memory than there can be of it.
class PreviewAssembler {
 public:
  /// Four for each pixel of the largest picture.
  static constexpr std::uint64_t kMostOutlinePoints = 1 << 24;

  explicit PreviewAssembler(std::uint64_t most_outline_points = kMostOutlinePoints)
      : most_outline_points_(most_outline_points) {}

  /// Takes the next message; a picture if it ends one. Throws ClientError{DATA_LOSS, ANSWER_CORRUPT} for anything out
  /// of order or out of shape.
  std::optional<PreviewPicture> add(v1::PreviewResponse&& message);

 private:
  void begin(v1::PreviewResponse& message);
  void add_outlines(v1::PreviewResponse& message);

  const std::uint64_t most_outline_points_;
  std::optional<PreviewPicture> open_;
  std::uint64_t outline_points_ = 0;  // Of the open picture.
  bool brought_nothing_ = false;      // The part before.
};

/// The mesh that a request is about: that of the first part of its layer's job, or its own.
std::string mesh_id_of(const v1::PreviewRequest& request);

/// ask() and done() from one thread at a time, next() from another one.
class PreviewStream {
 public:
  /// All requests are about the meshes of the first one, of which `mesh_id` is the first. `client` and what `call`
  /// refers to outlive this.
  PreviewStream(Client& client, const std::string& mesh_id, const CallOptions& call = {});
  /// With this server, whether it answers or not.
  PreviewStream(std::shared_ptr<const Endpoint> endpoint, const std::string& mesh_id, const CallOptions& call);
  ~PreviewStream();
  PreviewStream(const PreviewStream&) = delete;
  PreviewStream& operator=(const PreviewStream&) = delete;

  /// Asks for a picture, and returns the number that the request was given. Where the call is over already, next() says
  /// why.
  std::uint64_t ask(v1::PreviewRequest request);
  /// No requests follow. The last one is still answered.
  void done();
  /// Waits for the next picture. Nothing after the last one. Throws ClientError.
  std::optional<PreviewPicture> next();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice::client
