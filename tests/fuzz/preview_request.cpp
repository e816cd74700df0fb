// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The requests of a Preview call, of arbitrary bytes: each through its parser, its converter and its painter, one after
// the other, since what one sets holds for the next. Pictures are of at most 64 x 64 pixels of a small mesh. They are
// made or refused, and a picture is as large as its header says, opaque inside, and clear beside its lines.
//
// The messages are those of tests/fuzz/byte_reader.h.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/prepare/prepare_solid.h"
#include "core/preview/layer_painter.h"
#include "core/preview/plane_painter.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/convert_preview.h"
#include "server/rpc/convert/convert_printing.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/service/base/service_error.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/quiet_protobuf.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace {

using namespace ccslice;

constexpr std::uint32_t kMostPixels = 64;

/// Five sectors round an edge, in two cell regions and with two channels.
std::shared_ptr<const LimitSolid> make_solid() {
  ControlMesh mesh = oracle::fan_mesh(5, 1, 1);
  oracle::add_random_channels(mesh, 2, 1);
  return prepare_solid(oracle::with_regions(mesh, 2, [](const Vec3& center) { return center.x() < 0 ? 0 : 1; }));
}

SliceLimits small_limits() {
  SliceLimits limits;
  limits.max_columns = limits.max_rows = kMostPixels;
  limits.max_layers = 16;
  return limits;
}

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

void check(const PreviewPicture& picture, const PreviewColours& show) {
  require(picture.rgba.size() == std::size_t{4} * picture.columns * picture.rows, "the picture has another size");
  std::uint64_t opaque = 0, partly = 0;
  for (std::size_t at = 3; at < picture.rgba.size(); at += 4) {
    opaque += picture.rgba[at] == 255 ? 1 : 0;
    partly += picture.rgba[at] != 255 && picture.rgba[at] != 0 ? 1 : 0;
  }
  require(opaque >= picture.pixels_inside, "pixels inside are clear");
  require(show.lines || (opaque == picture.pixels_inside && partly == 0), "pixels outside are drawn");
  for (const auto& counts : {picture.value_pixels, picture.material_pixels}) {
    const std::uint64_t sum = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    require(counts.empty() || sum == picture.pixels_inside, "counts of another picture");
  }
  std::vector<v1::PreviewResponse> parts = server::to_parts(server::to_header(picture, show), picture.rgba);
  server::add_outlines(picture.outlines, parts);
  require(parts.front().header().picture_bytes() == picture.rgba.size(), "the header has another size");
}

class FuzzedCall {
 public:
  explicit FuzzedCall(std::shared_ptr<const LimitSolid> solid) : solid_(std::move(solid)), planes_(solid_) {}

  void answer(v1::PreviewRequest& request) {
    if (request.plane().has_free()) {
      request.set_width(std::min(request.width(), kMostPixels));
      request.set_height(std::min(request.height(), kMostPixels));
    }
    if (request.has_placement()) {
      setting_.placement = server::to_placement(request.placement(), solid_->summary().bounding_box, limits_);
    }
    if (request.has_printing()) {
      setting_.printing = std::make_shared<const Printing>(server::to_printing(request.printing(), solid_->summary()));
    }
    std::vector<std::shared_ptr<const LimitSolid>> solids(1, solid_);
    if (request.plane().has_layer()) {
      v1::SliceJob& job = *request.mutable_plane()->mutable_layer()->mutable_job();
      require_meshes(job);
      solids.assign(static_cast<std::size_t>(job.parts_size()), solid_);
    }
    const server::PreviewWork work = server::to_preview(request, setting_, solids, limits_, {});
    if (const auto* layer = std::get_if<server::LayerPreview>(&work)) {
      return check(LayerPainter(layer->parts, layer->show, {}).paint(layer->layer, {}), layer->show);
    }
    const auto& job = std::get<PreviewJob>(work);
    for (const PreviewStage stage : {PreviewStage::kCoarse, PreviewStage::kFull}) {
      check(planes_.paint(job, stage, {}), job.show);
    }
  }

 private:
  /// As the server does before it looks for the meshes, which are this one whatever their ids. No more parts than are
  /// painted fast.
  static void require_meshes(v1::SliceJob& job) {
    constexpr int kMostParts = 3, kMostPlacements = 2;
    while (job.parts_size() > kMostParts) job.mutable_parts()->RemoveLast();
    for (v1::Part& part : *job.mutable_parts()) {
      part.set_mesh_id("sha256:" + std::string(64, '0'));
      while (part.placements_size() > kMostPlacements) part.mutable_placements()->RemoveLast();
    }
    (void)server::mesh_ids_of(job, server::kLayerJobPath);
  }

  const std::shared_ptr<const LimitSolid> solid_;
  const SliceLimits limits_ = small_limits();
  server::PreviewSetting setting_;
  PlanePainter planes_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::shared_ptr<const LimitSolid> solid = make_solid();
  fuzz::ByteReader bytes(data, size);
  FuzzedCall call(solid);
  try {
    do {
      v1::PreviewRequest request;
      if (!request.ParseFromString(bytes.message())) return 0;
      call.answer(request);
    } while (!bytes.at_end());
  } catch (const Error& error) {
    require(error.code() != ErrorCode::kInternal, error.what());
  } catch (const server::ServiceError&) {
  }
  return 0;
}
