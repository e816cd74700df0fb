// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/slicing.h"

#include <cmath>
#include <cstring>

namespace ccslice::oracle {

SliceJob float_job(const Subject& subject, const VoxelPitch& pitch) {
  SliceJob job;
  GridRequest request;
  request.pitch = pitch;
  job.grid = plan_grid(subject.solid(), job.placement, request);
  PlaneSpec plane;
  plane.encoding = Encoding::kRaw;
  job.planes.push_back(plane);
  plane.content = PlaneContent::kChannel;
  plane.sample_type = SampleType::kFloat32;
  for (const ChannelRange& channel : subject.solid().summary().channels) {
    plane.channel = channel.name;
    job.planes.push_back(plane);
  }
  job.contours = true;
  job.channel_tolerance = 0;
  return job;
}

SliceJob float_job(const Subject& subject, int columns) {
  const double pitch = subject.solid().summary().bounding_box.sizes().maxCoeff() / columns;
  return float_job(subject, {pitch, pitch, pitch});
}

bool LayerView::inside(std::uint32_t x, std::uint32_t y) const {
  const std::size_t row_bytes = (grid_.extent.columns + 7) / 8;
  return layer_.planes[0].bytes[y * row_bytes + x / 8] >> (7 - x % 8) & 1;
}

double LayerView::channel(std::uint32_t c, std::uint32_t x, std::uint32_t y) const {
  float value;
  const std::size_t at = std::size_t{y} * grid_.extent.columns + x;
  std::memcpy(&value, layer_.planes[1 + c].bytes.data() + at * sizeof value, sizeof value);
  return value;
}

Vec3 LayerView::centre(std::uint32_t x, std::uint32_t y) const {
  return {grid_.origin_mm.x() + (x + 0.5) * grid_.pitch.x_mm, grid_.origin_mm.y() + (y + 0.5) * grid_.pitch.y_mm,
          layer_.z_mm};
}

std::vector<Polygon> polygons_of(const Contours& contours) {
  std::vector<Polygon> polygons;
  for (const ContourLoop& loop : contours.loops) {
    Polygon& polygon = polygons.emplace_back();
    for (const ContourPoint& point : loop.points) polygon.push_back(point.xy);
  }
  return polygons;
}

CellBoxes brute_force_boxes(const Subject& subject) {
  CellBoxes boxes;
  for (const LimitCellId cell : subject.solid().cells()) {
    const OneRing ring = subject.one_ring(cell);
    Box3 all, own;
    for (std::uint32_t v = 0; v < ring.mesh().vertex_count(); ++v) all.extend(ring.mesh().position(v));
    for (const std::uint32_t v : ring.focus().v) own.extend(ring.mesh().position(v));
    boxes.rings.push_back(all);
    boxes.corners.push_back(own);
  }
  return boxes;
}

Algorithm1Comparison compare_with_algorithm1(const Subject& subject, LimitSolidForAlgorithm1& solid,
                                             const LayerView& view) {
  Algorithm1 algorithm(solid, {.threshold_mm = 1e-6});
  Algorithm1Comparison result;
  const std::uint32_t columns = view.grid().extent.columns;
  std::vector<std::optional<CellParam>> previous, line(columns);
  const auto& channels = subject.solid().summary().channels;
  std::vector<double> values(channels.size());
  for (std::uint32_t y = 0; y < view.grid().extent.rows; ++y) {
    std::vector<Vec3> points;
    std::vector<bool> inside;
    for (std::uint32_t x = 0; x < columns; ++x) {
      points.push_back(view.centre(x, y));
      inside.push_back(view.inside(x, y));
    }
    algorithm.invert_line(points, inside, previous, line);
    for (std::uint32_t x = 0; x < columns; ++x) {
      if (!inside[x]) continue;
      ++(line[x] ? result.compared : result.not_found);
      if (!line[x]) continue;
      solid.evaluator().mat(*line[x], values);
      for (std::uint32_t c = 0; c < channels.size(); ++c) {
        const double difference = std::abs(values[c] - view.channel(c, x, y)) / (channels[c].max - channels[c].min);
        result.worst = std::max(result.worst, difference);
      }
    }
    previous = line;
  }
  return result;
}

}  // namespace ccslice::oracle
