// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/cell_adder.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/mesh/cell_regions.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {
namespace {

/// Cells that a thread walks in its turn.
constexpr std::size_t kWalkedInTurn = 16;

}  // namespace

CellAdder::CellAdder(const ControlMesh& mesh, const CurvedCells& curved, const PrepareOptions& options,
                     BuildingMemory& memory, std::size_t levels, RingStore rings, std::size_t faces,
                     LimitSolid::Data& data)
    : mesh_(mesh),
      curved_(curved),
      options_(options),
      cancel_(options.cancel),
      memory_(memory),
      data_(data),
      rings_(std::move(rings)),
      stars_(levels) {
  faces_.reserve(faces);
}

void CellAdder::enter(const Level& level, std::size_t number) {
  level_ = &level;
  level_number_ = number;
  rings_.enter(level);
  stars_points_.clear();
  own_walkers_.emplace(level.complex, own_starts_);
  if (options_.threads > 1)
    others_walkers_.emplace([this] { return Walkers(level_->complex, others_starts_.local()); });
}

void CellAdder::add(CellId cell, LimitCellId id, const Classification& found, bool begins_family) {
  pending_.push_back({cell, id, found, begins_family});
  if (pending_.size() == kWalkedTogether) add_pending();
}

/// `in_turn`: how many a thread takes at a time.
template <typename Work>
void CellAdder::for_each_walked(std::size_t count, std::size_t in_turn, Work work) {
  if (options_.threads <= 1 || count <= in_turn) {
    for (std::size_t i = 0; i < count; ++i) work(*own_walkers_, i);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, in_turn), [&](const auto& range) {
    Walkers& walkers = others_walkers_->local();
    for (std::size_t i = range.begin(); i != range.end(); ++i) work(walkers, i);
  });
}

void CellAdder::finish_level() {
  add_pending();
  rings_.end_family();
}

void CellAdder::add_pending() {
  walk_stars();
  for_each_walked(pending_.size(), kWalkedInTurn, [&](Walkers& walkers, std::size_t i) { walk(walkers, pending_[i]); });
  make_operators();
  for (const PendingCell& pending : pending_) put_cell(pending);
  options_.count(pending_.size());
  pending_.clear();
}

CellAdder::Star& CellAdder::star_at(VertexId vertex) {
  std::vector<Star>& stars = stars_[level_number_];
  const std::uint32_t number = level_->number(vertex);
  if (number >= stars.size()) stars.resize(number + std::size_t{1});
  return stars[number];
}

/// Walks the stars of those vertices of pending cells that have none yet.
void CellAdder::walk_stars() {
  std::vector<decltype(walked_stars_)::value_type*> missing;
  for (const PendingCell& pending : pending_) {
    if (pending.found.cell_class != CellClass::kVertex) continue;
    const VertexId vertex = irregular_vertex(pending);
    if (stars_points_.contains(vertex)) continue;
    if (const Star& known = star_at(vertex); known.op != kNone) {
      stars_points_.emplace(vertex, star_points(known));
      continue;
    }
    const auto [place, is_new] = walked_stars_.try_emplace(vertex);
    if (is_new) missing.push_back(&*place);
  }
  for_each_walked(missing.size(), kWalkedInTurn, [&](Walkers& walkers, std::size_t i) {
    cancel_.throw_if_cancelled();
    missing[i]->second = canonical_star(walkers.rings, missing[i]->first);
  });
  for (const auto* walked : missing) stars_points_.emplace(walked->first, walked->second.points);
}

void CellAdder::walk(Walkers& walkers, PendingCell& pending) const {
  cancel_.throw_if_cancelled();
  RingWalker& walker = walkers.rings;
  if (pending.found.cell_class == CellClass::kRegular) {
    pending.ring = walker.regular(pending.cell);
  } else if (pending.found.cell_class == CellClass::kLine) {
    const auto& [ring, frame] = pending.ring.emplace<FramedLineRing>(
        canonical_line_ring(walker, *walkers.known_starts, pending.cell, pending.found.anchor));
    pending.op = data_.operators.find(ring);
  } else {
    const VertexId vertex = irregular_vertex(pending);
    const auto& [ring, frame] = pending.ring.emplace<FramedVertexRing>(
        canonical_vertex_ring(walker, *walkers.known_starts, pending.cell, vertex, stars_points_.at(vertex)));
    pending.op = data_.operators.find(ring);
  }
  for (const HalfFaceId half_face : level_->complex.cell_half_faces(pending.cell)) {
    const FaceId face = face_of(half_face);
    if (!becomes_face(pending, face)) continue;
    WalkedSurface& surface = pending.surfaces.emplace_back(WalkedSurface{walkers.surfaces.walk(face)});
    if (!surface.ring.regular) surface.op = data_.operators.find(surface.ring);
  }
}

/// REQUIRES: all that is pending is walked.
void CellAdder::make_operators() {
  OperatorTable& operators = data_.operators;
  for (const auto& [vertex, star] : walked_stars_) operators.want(star);
  for (const PendingCell& pending : pending_) {
    if (const auto* line = std::get_if<FramedLineRing>(&pending.ring); line != nullptr && pending.op == kNone) {
      operators.want(line->ring);
    } else if (const auto* at = std::get_if<FramedVertexRing>(&pending.ring); at != nullptr && pending.op == kNone) {
      operators.want(at->ring, pending.cell, at->frame);
    }
    for (const auto& [ring, op] : pending.surfaces) {
      if (!ring.regular && op == kNone) operators.want(ring);
    }
  }
  const auto for_each = [&](std::size_t count, auto make) {
    for_each_walked(count, 1, [&](Walkers& walkers, std::size_t i) {
      cancel_.throw_if_cancelled();
      make(walkers.rings, i);
    });
  };
  while (operators.make_wanted(for_each)) reserve_operators();
}

void CellAdder::reserve_operators() {
  const std::size_t orders = rings_.memory_bytes();
  memory_.reserve_operators(data_.operators.memory_bytes() + orders, data_.operators.kept_bytes() + orders);
}

/// Faces of the boundary, and those of interfaces from the side of the lower region.
bool CellAdder::becomes_face(const PendingCell& pending, FaceId face) const {
  return level_->complex.face_on_boundary(face) &&
         level_->beyond(face) >= region_of(mesh_, CellId{control_cell(pending)});
}

/// REQUIRES: all of them are here.
std::vector<VertexId> CellAdder::star_points(const Star& star) const {
  std::vector<VertexId> points;
  for (std::uint32_t n = 0; n < data_.operators.stars()[star.op].points; ++n) {
    points.push_back(level_->vertex_of_point(data_.rings[star.ring_begin + n]));
  }
  return points;
}

/// REQUIRES: walked.
const CellAdder::Star& CellAdder::star_of(VertexId vertex) {
  Star& star = star_at(vertex);
  if (star.op == kNone) {
    const auto walked = walked_stars_.extract(vertex);
    star = {data_.operators.star(walked.mapped()), rings_.append(walked.mapped().points)};
  }
  return star;
}

void CellAdder::put_vertex_ring(const PendingCell& pending, LimitCell& record) {
  const Star& star = star_of(irregular_vertex(pending));
  record.star_begin = star.ring_begin;
  const auto& [ring, frame] = std::get<FramedVertexRing>(pending.ring);
  record.frame = frame;
  const std::uint32_t corner =
      pending.op != kNone ? pending.op : data_.operators.corner(ring, own_walkers_->rings, pending.cell, frame);
  record.op = data_.operators.vertex(star.op, corner, ring);
  rings_.put(pending.id, ring.own());
}

void CellAdder::put_cell(const PendingCell& pending) {
  cancel_.throw_if_cancelled();
  LimitCell& record = data_.cells[pending.id];
  record.cell_class = pending.found.cell_class;
  if (pending.begins_family) rings_.end_family();
  if (curved_.is_curved(record.control_cell)) {
    put_curved_cell(pending);
  } else if (const auto* regular = std::get_if<RegularRing>(&pending.ring)) {
    record.phantoms = regular->phantoms;
    rings_.put(pending.id, regular->points);
  } else if (const auto* line = std::get_if<FramedLineRing>(&pending.ring)) {
    record.frame = line->frame;
    record.phantoms = line->ring.phantoms;
    record.op = pending.op != kNone ? pending.op : data_.operators.line(line->ring);
    rings_.put(pending.id, line->ring.points);
  } else {
    put_vertex_ring(pending, record);
  }
  reserve_operators();
  put_boundary_faces(pending);
  put_boundary_edges(pending);
}

/// Which child of its control cell a cell is.
std::size_t CellAdder::child_number(LimitCellId cell) const {
  std::size_t number = 0;
  while (number < cell && data_.cells[cell - number - 1].control_cell == data_.cells[cell].control_cell) ++number;
  return number;
}

void CellAdder::put_curved_cell(const PendingCell& pending) {
  patch_ = curved_.patch(control_cell(pending), child_number(pending.id));
  rings_.put_own(pending.id, add_points(patch_));
}

/// Returns the number of the first one.
std::uint32_t CellAdder::add_points(std::span<const double> points) {
  const auto first = static_cast<std::uint32_t>(data_.points.size() / data_.dimension);
  data_.points.insert(data_.points.end(), points.begin(), points.end());
  return first;
}

SurfaceFaceRing CellAdder::put_face_ring(const WalkedSurface& surface, const BoundaryFace& face) {
  if (curved_.is_curved(data_.cells[face.cell].control_cell)) {
    const std::vector<double> points =
        curved_.side(patch_, {face.cell_corner[0], face.cell_corner[1], face.cell_corner[2]});
    return {0, kNone, rings_.append_own(add_points(points), 16), 16};
  }
  const auto& [ring, known_op] = surface;
  const std::uint32_t op = ring.regular || known_op != kNone ? known_op : data_.operators.surface(ring);
  return {ring.phantoms, op, rings_.append(ring.points), static_cast<std::uint32_t>(ring.points.size())};
}

void CellAdder::put_boundary_faces(const PendingCell& pending) {
  const CellComplex& complex = level_->complex;
  const auto half_faces = complex.cell_half_faces(pending.cell);
  auto walked = pending.surfaces.begin();
  LimitCell& cell = data_.cells[pending.id];
  for (std::uint8_t side = 0; side < 6; ++side) {
    const FaceId face = face_of(half_faces[side]);
    if (!complex.face_on_boundary(face)) continue;
    // The region of the higher number has no face there, and ends there all the same.
    (level_->beyond(face) != kNoCellRegion ? cell.interface_sides : cell.boundary_sides) |=
        static_cast<std::uint8_t>(1u << side);
    if (!becomes_face(pending, face)) continue;
    const WalkedSurface& surface = *walked++;
    const SurfaceRing& ring = surface.ring;
    const auto cycle = complex.face_vertices(face);
    BoundaryFace record;
    record.cell = pending.id;
    record.cell_side = side;
    record.regular = ring.regular;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t here = (ring.start + i) % 4, next = (ring.start + i + 1) % 4;
      record.corners[i] = level_->vertex_key(cycle[here]);
      record.cell_corner[i] = cell_tables::kHexFaces[side].corners[here];
      record.sides[i] = level_->side(cycle[here], cycle[next]);
    }
    record.region = region_of(mesh_, CellId{control_cell(pending)});
    record.beyond = level_->beyond(face);
    faces_.push_back({record, put_face_ring(surface, record)});
  }
}

/// Edges of interfaces alone aren't on the boundary.
void CellAdder::put_boundary_edges(const PendingCell& pending) {
  const CellComplex& complex = level_->complex;
  const auto edges = complex.cell_edges(pending.cell);
  const auto is_of_boundary = [&](FaceId face) {
    return complex.face_on_boundary(face) && level_->beyond(face) == kNoCellRegion;
  };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (!complex.edge_on_boundary(edges[e]) || std::ranges::none_of(complex.edge_faces(edges[e]), is_of_boundary)) {
      continue;
    }
    data_.cells[pending.id].boundary_edges |= static_cast<std::uint16_t>(1u << e);
  }
}

void CellAdder::put_faces() {
  std::ranges::sort(faces_, {}, &WalkedFace::place);
  data_.faces.reserve(faces_.size());
  data_.face_rings.reserve(faces_.size());
  data_.face_hulls.reserve(faces_.size());
  for (const auto& [face, ring] : faces_) {
    data_.boundary_face_count += face.beyond == kNoCellRegion;
    data_.faces.push_back(face);
    data_.face_rings.push_back(ring);
    Box3& hull = data_.face_hulls.emplace_back();
    for (const std::uint32_t p : data_.ring(ring)) {
      if (p != kNone) hull.extend(data_.position(p));
    }
  }
}

}  // namespace ccslice
