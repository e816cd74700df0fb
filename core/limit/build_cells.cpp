// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/limit/build_levels.h"
#include "core/limit/prepare.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/channels.h"
#include "core/subdivision/canonical_rings.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine_rules.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

namespace {

/// The star of a vertex: its operator, and where its points stand in LimitSolid::Data::rings.
struct Star {
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;
};

/// What walks the levels' cells and faces, on one thread.
struct Walkers {
  explicit Walkers(const std::deque<Level>& levels) {
    for (const Level& level : levels) {
      rings.emplace_back(level.complex);
      surfaces.emplace_back(level.complex);
    }
  }
  std::deque<RingWalker> rings;
  std::deque<SurfaceWalker> surfaces;
  KnownStarts known_starts;
};

/// A limit-ready cell whose turn has come, and what it was walked to.
struct PendingCell {
  std::uint32_t level;
  CellId cell;
  ControlCellId control_cell;
  std::variant<RegularRing, FramedLineRing, FramedVertexRing> ring{};
  std::vector<SurfaceRing> surfaces{};  // Of the sides that become faces.
};

/// Cells are walked on several threads, so many together, and numbered and given their operators one by one.
constexpr std::size_t kWalkedTogether = 512, kWalkedInTurn = 16;

class Builder {
 public:
  Builder(const ControlMesh& mesh, const PrepareOptions& options, LimitSolid::Data& data)
      : mesh_(mesh), options_(options), cancel_(options.cancel), memory_(mesh, options), data_(data) {}

  void run(const SplitMesh& split, CellComplex complex) {
    options_.begin(PreparationStep::kRefining);
    levels_ = build_levels(mesh_, split, std::move(complex), options_, memory_, data_);
    options_.begin(PreparationStep::kBuilding, memory_.limit_cells());
    reserve_results();
    stars_.resize(levels_.size());
    own_walkers_.emplace(levels_);
    if (options_.threads > 1) {
      others_walkers_.emplace([this] { return Walkers(levels_); });
      arena_.emplace(options_.threads);
    }
    for (const CellId c : levels_.front().complex.cells()) number(0, c, ControlCellId{c});
    add_pending();
    append_interfaces();
    data_.operators.forget_keys();
    summarize();
  }

 private:
  void reserve_results();
  void number(std::size_t level, CellId cell, ControlCellId control_cell);
  template <typename Work>
  void for_each_walked(std::size_t count, Work work);
  void add_pending();
  void walk_stars();
  void walk(Walkers& walkers, PendingCell& pending) const;
  bool becomes_face(const PendingCell& pending, FaceId face) const;
  std::vector<VertexId> star_points(std::size_t level, VertexId vertex) const;
  void add_cell(const PendingCell& pending);
  void add_boundary_faces(const PendingCell& pending);
  void append_interfaces();
  const Star& star_of(std::size_t level, VertexId vertex);
  void add_vertex_ring(const PendingCell& pending, VertexId vertex, LimitCell& record);
  std::uint32_t add_ring(const Level& level, std::span<const VertexId> points);
  void summarize();

  const ControlMesh& mesh_;
  const PrepareOptions& options_;
  const CancellationToken& cancel_;
  BuildingMemory memory_;
  LimitSolid::Data& data_;
  std::deque<Level> levels_;
  std::vector<std::vector<Star>> stars_;  // By level and vertex; made when the first vertex cell there asks.
  std::optional<Walkers> own_walkers_;
  std::optional<tbb::enumerable_thread_specific<Walkers>> others_walkers_;  // Nothing on one thread.
  std::optional<tbb::task_arena> arena_;
  std::vector<PendingCell> pending_;
  std::map<std::pair<std::uint32_t, VertexId>, VertexStar> walked_stars_;  // By level and vertex; not yet in its Star.
  std::vector<BoundaryFace> interfaces_;
  std::vector<SurfaceFaceRing> interface_rings_;
};

/// Rings are what takes most beside the levels: growing they would be there twice.
void Builder::reserve_results() {
  constexpr std::size_t kCellPoints = 64, kFacePoints = 16;  // Of nearly all rings, or fewer.
  std::size_t faces = 0;
  for (const Level& level : levels_) {
    for (const CellId c : level.complex.cells()) {
      if (!level.classes[c]) continue;
      for (const HalfFaceId half_face : level.complex.cell_half_faces(c)) {
        faces += level.complex.face_on_boundary(face_of(half_face));
      }
    }
  }
  memory_.reserve_faces(faces);
  const std::size_t cells = memory_.limit_cells();
  data_.cells.reserve(cells);
  data_.rings.reserve(std::min<std::size_t>(kCellPoints * cells + kFacePoints * faces, kNone));
  data_.faces.reserve(faces);
  data_.face_rings.reserve(faces);
  data_.face_hulls.reserve(faces);
}

void Builder::number(std::size_t level, CellId cell, ControlCellId control_cell) {
  const Level& at = levels_[level];
  if (at.classes[cell]) {
    pending_.push_back({static_cast<std::uint32_t>(level), cell, control_cell});
    if (!arena_ || pending_.size() == kWalkedTogether) add_pending();
    return;
  }
  const int children = corner_count(at.complex.kind(cell));
  for (int i = 0; i < children; ++i) {
    number(level + 1, CellId{at.first_child[cell] + static_cast<std::uint32_t>(i)}, control_cell);
  }
}

std::uint32_t Builder::add_ring(const Level& level, std::span<const VertexId> points) {
  if (data_.rings.size() + points.size() >= kNone) {
    throw Error(
        ErrorCode::kMeshTooComplex,
        "cell_vertices: the one-rings of the limit-ready cells need more than 2^32 entries; split the part or use a "
        "coarser control mesh",
        "cell_vertices");
  }
  const auto begin = static_cast<std::uint32_t>(data_.rings.size());
  for (const VertexId p : points) data_.rings.push_back(p == kNone ? kNone : p + level.point_base);
  return begin;
}

template <typename Work>
void Builder::for_each_walked(std::size_t count, Work work) {
  if (!arena_ || count <= kWalkedInTurn) {
    for (std::size_t i = 0; i < count; ++i) work(*own_walkers_, i);
    return;
  }
  arena_->execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kWalkedInTurn), [&](const auto& range) {
      Walkers& walkers = others_walkers_->local();
      for (std::size_t i = range.begin(); i != range.end(); ++i) work(walkers, i);
    });
  });
}

void Builder::add_pending() {
  walk_stars();
  for_each_walked(pending_.size(), [&](Walkers& walkers, std::size_t i) { walk(walkers, pending_[i]); });
  for (const PendingCell& pending : pending_) add_cell(pending);
  options_.count(pending_.size());
  pending_.clear();
}

/// Walks the stars of those vertices of pending cells that have none yet.
void Builder::walk_stars() {
  std::vector<decltype(walked_stars_)::value_type*> missing;
  for (const PendingCell& pending : pending_) {
    const Level& at = levels_[pending.level];
    const Classification& found = *at.classes[pending.cell];
    if (found.cell_class != CellClass::kVertex) continue;
    stars_[pending.level].resize(at.complex.vertex_count());
    const VertexId vertex = at.complex.cell_vertices(pending.cell)[found.anchor];
    if (stars_[pending.level][vertex].op != kNone) continue;
    const auto [place, is_new] = walked_stars_.try_emplace({pending.level, vertex});
    if (is_new) missing.push_back(&*place);
  }
  for_each_walked(missing.size(), [&](Walkers& walkers, std::size_t i) {
    cancel_.throw_if_cancelled();
    const auto [level, vertex] = missing[i]->first;
    missing[i]->second = canonical_star(walkers.rings[level], vertex);
  });
}

void Builder::walk(Walkers& walkers, PendingCell& pending) const {
  cancel_.throw_if_cancelled();
  const Level& at = levels_[pending.level];
  const Classification& found = *at.classes[pending.cell];
  RingWalker& walker = walkers.rings[pending.level];
  if (found.cell_class == CellClass::kRegular) {
    pending.ring = walker.regular(pending.cell);
  } else if (found.cell_class == CellClass::kLine) {
    pending.ring = canonical_line_ring(walker, walkers.known_starts, pending.cell, found.anchor);
  } else {
    const VertexId vertex = at.complex.cell_vertices(pending.cell)[found.anchor];
    const std::vector<VertexId> star = star_points(pending.level, vertex);
    pending.ring = canonical_vertex_ring(walker, walkers.known_starts, pending.cell, vertex, star);
  }
  for (const HalfFaceId half_face : at.complex.cell_half_faces(pending.cell)) {
    const FaceId face = face_of(half_face);
    if (becomes_face(pending, face)) pending.surfaces.push_back(walkers.surfaces[pending.level].walk(face));
  }
}

/// Faces of the boundary, and those of interfaces from the side of the lower region.
bool Builder::becomes_face(const PendingCell& pending, FaceId face) const {
  const Level& at = levels_[pending.level];
  if (!at.complex.face_on_boundary(face)) return false;
  return at.beyond.empty() || at.beyond[face] >= region_of(mesh_, CellId{pending.control_cell});
}

std::vector<VertexId> Builder::star_points(std::size_t level, VertexId vertex) const {
  const Star& star = stars_[level][vertex];
  if (star.op == kNone) return walked_stars_.at({static_cast<std::uint32_t>(level), vertex}).points;
  std::vector<VertexId> points;
  for (std::uint32_t n = 0; n < data_.operators.stars()[star.op].points; ++n) {
    points.emplace_back(data_.rings[star.ring_begin + n] - levels_[level].point_base);
  }
  return points;
}

/// REQUIRES: walked.
const Star& Builder::star_of(std::size_t level, VertexId vertex) {
  Star& star = stars_[level][vertex];
  if (star.op == kNone) {
    const auto walked = walked_stars_.extract({static_cast<std::uint32_t>(level), vertex});
    star = {data_.operators.star(walked.mapped()), add_ring(levels_[level], walked.mapped().points)};
  }
  return star;
}

void Builder::add_vertex_ring(const PendingCell& pending, VertexId vertex, LimitCell& record) {
  const Star& star = star_of(pending.level, vertex);
  record.star_begin = star.ring_begin;
  const auto& [ring, frame] = std::get<FramedVertexRing>(pending.ring);
  record.frame = frame;
  record.op = data_.operators.vertex(star.op, ring, own_walkers_->rings[pending.level], pending.cell, frame);
  record.ring_count = static_cast<std::uint32_t>(ring.own().size());
  record.ring_begin = add_ring(levels_[pending.level], ring.own());
}

void Builder::add_cell(const PendingCell& pending) {
  cancel_.throw_if_cancelled();
  const Level& at = levels_[pending.level];
  const Classification& found = *at.classes[pending.cell];
  LimitCell record;
  record.cell_class = found.cell_class;
  record.control_cell = pending.control_cell;
  if (const auto* regular = std::get_if<RegularRing>(&pending.ring)) {
    record.phantoms = regular->phantoms;
    record.ring_count = 64;
    record.ring_begin = add_ring(at, regular->points);
  } else if (const auto* line = std::get_if<FramedLineRing>(&pending.ring)) {
    record.frame = line->frame;
    record.phantoms = line->ring.phantoms;
    record.op = data_.operators.line(line->ring);
    record.ring_count = static_cast<std::uint32_t>(line->ring.points.size());
    record.ring_begin = add_ring(at, line->ring.points);
  } else {
    add_vertex_ring(pending, at.complex.cell_vertices(pending.cell)[found.anchor], record);
  }
  memory_.reserve_operators(data_.operators.memory_bytes());
  data_.cells.push_back(record);
  add_boundary_faces(pending);
}

void Builder::add_boundary_faces(const PendingCell& pending) {
  const Level& at = levels_[pending.level];
  const auto half_faces = at.complex.cell_half_faces(pending.cell);
  auto walked = pending.surfaces.begin();
  for (std::uint8_t side = 0; side < 6; ++side) {
    const FaceId face = face_of(half_faces[side]);
    if (!becomes_face(pending, face)) continue;
    const SurfaceRing& ring = *walked++;
    const auto cycle = at.complex.face_vertices(face);
    BoundaryFace record;
    record.cell = LimitCellId{static_cast<std::uint32_t>(data_.cells.size() - 1)};
    record.cell_side = side;
    record.regular = ring.regular;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t here = (ring.start + i) % 4, next = (ring.start + i + 1) % 4;
      record.corners[i] = at.vertex_keys[cycle[here]];
      record.cell_corner[i] = cell_tables::kHexFaces[side].corners[here];
      const EdgeId edge = at.complex.find_edge(cycle[here], cycle[next]);
      record.sides[i] = at.edge_roots[edge];
      if (at.complex.edge_vertices(edge)[0] != cycle[here]) std::swap(record.sides[i].t_begin, record.sides[i].t_end);
    }
    record.region = region_of(mesh_, CellId{pending.control_cell});
    record.beyond = at.beyond.empty() ? kNoCellRegion : at.beyond[face];
    const bool is_interface = record.beyond != kNoCellRegion;
    LimitCell& cell = data_.cells.back();
    (is_interface ? cell.interface_sides : cell.boundary_sides) |= static_cast<std::uint8_t>(1u << side);
    (is_interface ? interfaces_ : data_.faces).push_back(record);
    (is_interface ? interface_rings_ : data_.face_rings)
        .push_back({ring.phantoms, ring.regular ? kNone : data_.operators.surface(ring), add_ring(at, ring.points),
                    static_cast<std::uint32_t>(ring.points.size())});
  }
}

/// Puts interfaces after all faces of the boundary, and finds the hulls of both.
void Builder::append_interfaces() {
  data_.boundary_face_count = static_cast<std::uint32_t>(data_.faces.size());
  data_.faces.insert(data_.faces.end(), interfaces_.begin(), interfaces_.end());
  data_.face_rings.insert(data_.face_rings.end(), interface_rings_.begin(), interface_rings_.end());
  for (const SurfaceFaceRing& ring : data_.face_rings) {
    Box3& hull = data_.face_hulls.emplace_back();
    for (const std::uint32_t p : data_.ring(ring)) {
      if (p != kNone) hull.extend(data_.position(p));
    }
  }
}

void Builder::summarize() {
  SolidSummary& summary = data_.summary;
  const CellComplex& control = levels_.front().complex;
  summary.control_cells = mesh_.cell_count();
  summary.limit_cells = data_.cells.size();
  for (const LimitCell& cell : data_.cells) {
    summary.regular_cells += cell.cell_class == CellClass::kRegular;
    summary.line_cells += cell.cell_class == CellClass::kLine;
    summary.vertex_cells += cell.cell_class == CellClass::kVertex;
  }
  const Classifier classifier(control);
  for (const EdgeId e : control.edges()) {
    if (!classifier.irregular(e)) continue;
    ++(control.edge_on_boundary(e) ? summary.irregular_boundary_edges : summary.extraordinary_edges);
  }
  for (const VertexId v : control.vertices()) {
    if (control.vertex_on_boundary(v) || on_straight_extraordinary_edge(control, v)) continue;
    const auto edges = control.vertex_edges(v);
    summary.extraordinary_vertices +=
        std::any_of(edges.begin(), edges.end(), [&](EdgeId e) { return classifier.irregular(e); });
  }
  summary.boundary_faces = data_.boundary_face_count;
  for (std::size_t c = 0; c < mesh_.channel_count(); ++c) {
    const auto [low, high] = channel_range(mesh_, c);
    summary.channels.push_back({mesh_.channel_names[c], low, high});
  }
}

}  // namespace

void build_cells(const ControlMesh& mesh, CellComplex complex, const PrepareOptions& options, LimitSolid::Data& data) {
  data.cell_regions = mesh.cell_regions;
  data.has_several_regions = has_several_regions(mesh);
  data.control_corners = mesh.cell_vertices;
  data.first_corners.reserve(mesh.cell_count() + 1);
  data.first_corners.push_back(0);
  for (const CellKind kind : mesh.cell_kinds) {
    data.first_corners.push_back(data.first_corners.back() + static_cast<std::uint32_t>(corner_count(kind)));
  }
  if (!data.has_several_regions) {
    const SplitMesh whole{{}, {}, {}};
    Builder(mesh, options, data).run(whole, std::move(complex));
  } else {
    const SplitMesh split = split_cell_regions(mesh, complex, options.cancel);
    Builder(split.mesh, options, data).run(split, make_cell_complex(split.mesh, options.cancel));
  }
  data.summary.control_vertices = mesh.vertex_count();
  data.summary.sharp_edges = mesh.sharp_edges.size();
}

}  // namespace ccslice
