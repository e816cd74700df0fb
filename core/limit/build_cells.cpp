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
#include "core/limit/prepare.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/channels.h"
#include "core/subdivision/canonical_rings.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"
#include "core/subdivision/refine_rules.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

namespace {

constexpr int kMaxRefinements = 4;  // Two always suffice; more means a broken invariant.

// While they are prepared limit cells were measured to take up to 2.2 kB, operators, channels and boundary faces apart,
// and cells that share no faces up to 0.5 kB more for each. Where two refinements are needed, the limit cells are many
// to each cell that is left behind, and take up to 1.2 kB.
constexpr std::uint64_t kLimitCellBytes = 2560, kTwiceRefinedCellBytes = 1408, kBoundaryFaceBytes = 512;
constexpr std::uint64_t kLeastBytes = 64 << 10;  // What the smallest mesh takes.

/// The star of a vertex: its operator, and where its points stand in LimitSolid::Data::rings.
struct Star {
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;
};

/// One refinement level: a complex, where its points start, and what its places are called on the surface.
struct Level {
  CellComplex complex;
  std::uint32_t point_base = 0;
  std::vector<SurfaceKey> vertex_keys;
  std::vector<FaceSide> edge_roots;                    // From the edge's first vertex to its second.
  std::vector<std::optional<Classification>> classes;  // By cell; nothing for refined cells and for mere context.
  std::vector<CellId> first_child;                     // By cell, in the next level; kNone if not refined.
  std::vector<Star> stars;                             // By vertex; made when the first vertex cell there asks.
  std::vector<std::uint8_t> beyond;  // By face of the complex: the region beyond an interface. Empty if there is none.
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
  Builder(const ControlMesh& mesh, const SplitMesh& split, const PrepareOptions& options, LimitSolid::Data& data)
      : mesh_(mesh), split_(split), options_(options), cancel_(options.cancel), data_(data) {}

  void run(CellComplex complex) {
    options_.begin(PreparationStep::kRefining);
    needed_cells_ = mesh_.cell_count();
    reserve();
    add_control_level(std::move(complex));
    const auto control_cells = levels_.front().complex.cells();
    std::vector<CellId> cells = control_cells.to_vector();
    std::size_t limit_cells = 0;  // So far.
    for (std::vector<CellId> bad = classify(cells); !bad.empty(); bad = classify(cells)) {
      if (levels_.size() > kMaxRefinements) throw Error(ErrorCode::kInternal, "refinement doesn't end");
      limit_cells += cells.size() - bad.size();
      const std::size_t children = child_count(bad);
      const bool twice = levels_.size() > 1;
      needed_cells_ = limit_cells + (twice ? 0 : children);
      needed_twice_refined_cells_ = twice ? children : 0;
      reserve();
      cells = add_refined_level(bad);
    }
    options_.begin(PreparationStep::kBuilding, limit_cells + cells.size());
    reserve_faces();
    own_walkers_.emplace(levels_);
    if (options_.threads > 1) {
      others_walkers_.emplace([this] { return Walkers(levels_); });
      arena_.emplace(options_.threads);
    }
    for (const CellId c : control_cells) number(0, c, ControlCellId{c});
    add_pending();
    append_interfaces();
    data_.operators.forget_keys();
    summarize();
  }

 private:
  void reserve() const;
  void reserve_operators();
  void reserve_faces();
  std::size_t child_count(const std::vector<CellId>& cells) const;
  void add_control_level(CellComplex complex);
  std::vector<CellId> classify(const std::vector<CellId>& cells);
  std::vector<CellId> add_refined_level(const std::vector<CellId>& bad);
  void name_refined_places(const Refinement& refined, Level& level);
  void hand_down_interfaces(const Refinement& refined, Level& level) const;
  void number(std::size_t level, CellId cell, ControlCellId control_cell);
  template <typename Work>
  void for_each_walked(std::size_t count, Work work);
  void add_pending();
  void walk_stars();
  void walk(Walkers& walkers, PendingCell& pending) const;
  bool becomes_face(const PendingCell& pending, FaceId face) const;
  std::vector<VertexId> star_points(std::size_t level, VertexId vertex) const;
  void add_cell(const PendingCell& pending);
  void name_copies(Level& level) const;
  void add_boundary_faces(const PendingCell& pending);
  void append_interfaces();
  const Star& star_of(std::size_t level, VertexId vertex);
  void add_vertex_ring(const PendingCell& pending, VertexId vertex, LimitCell& record);
  std::uint32_t add_ring(const Level& level, std::span<const VertexId> points);
  void summarize();

  const ControlMesh& mesh_;
  const SplitMesh& split_;
  const PrepareOptions& options_;
  const CancellationToken& cancel_;
  LimitSolid::Data& data_;
  std::deque<Level> levels_;
  std::optional<Walkers> own_walkers_;
  std::optional<tbb::enumerable_thread_specific<Walkers>> others_walkers_;  // Nothing on one thread.
  std::optional<tbb::task_arena> arena_;
  std::vector<PendingCell> pending_;
  std::map<std::pair<std::uint32_t, VertexId>, VertexStar> walked_stars_;  // By level and vertex; not yet in its Star.
  std::vector<BoundaryFace> interfaces_;
  std::vector<SurfaceFaceRing> interface_rings_;
  std::uint32_t next_vertex_root_ = 0;
  std::uint32_t next_edge_root_ = 0;
  // For what reserve() asks:
  std::size_t needed_cells_ = 0;                // Limit cells after one refinement at most.
  std::size_t needed_twice_refined_cells_ = 0;  // Limit cells after two or more.
  std::size_t needed_faces_ = 0;                // Boundary faces.
  std::size_t needed_operator_bytes_ = 0;       // Bytes of operators.
};

/// Refined cells with their share of the levels above.
void Builder::reserve() const {
  if (!options_.reserve) return;
  const std::uint64_t points = mesh_.vertex_count() + needed_cells_ + needed_twice_refined_cells_;
  const std::uint64_t values = mesh_.channel_count() * 2 * points;  // While copied.
  options_.reserve(kLeastBytes + kLimitCellBytes * needed_cells_ +
                   kTwiceRefinedCellBytes * needed_twice_refined_cells_ + kBoundaryFaceBytes * needed_faces_ +
                   sizeof(double) * values + needed_operator_bytes_);
}

/// How many different operators there are shows as they are made: asks for as much again each time.
void Builder::reserve_operators() {
  const std::size_t bytes = data_.operators.memory_bytes();
  if (bytes <= needed_operator_bytes_) return;
  needed_operator_bytes_ = 2 * bytes;
  reserve();
}

void Builder::reserve_faces() {
  for (const Level& level : levels_) {
    for (const CellId c : level.complex.cells()) {
      if (!level.classes[c]) continue;
      for (const HalfFaceId half_face : level.complex.cell_half_faces(c)) {
        needed_faces_ += level.complex.face_on_boundary(face_of(half_face));
      }
    }
  }
  reserve();
  data_.faces.reserve(needed_faces_);
  data_.face_rings.reserve(needed_faces_);
  data_.face_hulls.reserve(needed_faces_);
}

/// How many children these cells of the last level have.
std::size_t Builder::child_count(const std::vector<CellId>& cells) const {
  std::size_t count = 0;
  for (const CellId c : cells) {
    count += static_cast<std::size_t>(corner_count(levels_.back().complex.kind(c)));
  }
  return count;
}

void Builder::add_control_level(CellComplex complex) {
  Level level{std::move(complex), 0, {}, {}, {}, {}, {}, {}};
  const std::size_t channels = mesh_.channel_count();
  data_.dimension = 3 + channels;
  data_.points.reserve(mesh_.vertex_count() * data_.dimension);
  data_.cells.reserve(mesh_.cell_count());
  data_.rings.reserve(64 * mesh_.cell_count());
  level.vertex_keys.reserve(mesh_.vertex_count());
  level.edge_roots.reserve(level.complex.edge_count());
  for (const VertexId v : level.complex.vertices()) {
    const Vec3& p = mesh_.positions[v];
    data_.points.insert(data_.points.end(), {p.x(), p.y(), p.z()});
    for (std::size_t c = 0; c < channels; ++c) data_.points.push_back(mesh_.channel_values[v * channels + c]);
    level.vertex_keys.push_back({SurfaceKey::Kind::kVertex, v, 0, 0});
  }
  for (const EdgeId e : level.complex.edges()) level.edge_roots.push_back({e, 0, kSurfaceOne});
  next_vertex_root_ = level.complex.vertex_count();
  next_edge_root_ = level.complex.edge_count();
  if (!split_.origins.empty()) name_copies(level);
  levels_.push_back(std::move(level));
}

/// Copies of a vertex, or of an edge, are one place on the surface.
void Builder::name_copies(Level& level) const {
  const auto original = [&](VertexId v) { return split_.origins[v]; };
  for (const VertexId v : level.complex.vertices()) level.vertex_keys[v].id = original(v);
  std::map<std::array<std::uint32_t, 2>, EdgeId> first_copies;
  for (const EdgeId e : level.complex.edges()) {
    if (!level.complex.edge_on_boundary(e)) continue;
    const auto [a, b] = level.complex.edge_vertices(e);
    const bool turned = original(a) > original(b);
    FaceSide& root = level.edge_roots[e];
    root.edge = first_copies.try_emplace({std::min(original(a), original(b)), std::max(original(a), original(b))}, e)
                    .first->second;
    if (turned) std::swap(root.t_begin, root.t_end);
  }
  level.beyond.assign(level.complex.face_count(), kNoCellRegion);
  for (const auto& [cell, side, beyond] : split_.interfaces) {
    level.beyond[face_of(level.complex.cell_half_faces(cell)[side])] = beyond;
  }
}

std::vector<CellId> Builder::classify(const std::vector<CellId>& cells) {
  Level& level = levels_.back();
  level.classes.resize(level.complex.cell_count());
  level.first_child.assign(level.complex.cell_count(), CellId{kNone});
  Classifier classifier(level.complex);
  PeriodicPoll poll(cancel_);
  std::vector<CellId> bad;
  for (const CellId c : cells) {
    poll();
    level.classes[c] = classifier.classify(c);
    if (!level.classes[c]) bad.push_back(c);
  }
  return bad;
}

std::vector<CellId> Builder::add_refined_level(const std::vector<CellId>& bad) {
  Level& parent = levels_.back();
  Refinement refined = refine(parent.complex, bad, cancel_);
  std::vector<CellId> children;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    parent.first_child[bad[i]] = refined.first_child[i];
    const auto count = static_cast<std::uint32_t>(corner_count(parent.complex.kind(bad[i])));
    for (std::uint32_t k = 0; k < count; ++k) children.emplace_back(refined.first_child[i] + k);
  }
  const std::size_t base = data_.points.size();
  data_.points.resize(base + refined.stencils.rows() * data_.dimension);
  refined.stencils.apply(0, refined.stencils.rows(), data_.points.data() + parent.point_base * data_.dimension,
                         data_.dimension, data_.points.data() + base);
  Level level{std::move(refined.complex), static_cast<std::uint32_t>(base / data_.dimension), {}, {}, {}, {}, {}, {}};
  name_refined_places(refined, level);
  if (!parent.beyond.empty()) hand_down_interfaces(refined, level);
  levels_.push_back(std::move(level));
  return children;
}

void Builder::name_refined_places(const Refinement& refined, Level& level) {
  const Level& parent = levels_.back();
  const auto middle = [&](EdgeId edge) {
    const FaceSide& root = parent.edge_roots[edge];
    return static_cast<std::uint32_t>((std::uint64_t{root.t_begin} + root.t_end) / 2);
  };
  for (const VertexId v : level.complex.vertices()) {
    const std::uint32_t origin = refined.origin[v];
    if (v < refined.edge_points_begin) {
      level.vertex_keys.push_back(parent.vertex_keys[origin]);
    } else if (v < refined.face_points_begin) {
      level.vertex_keys.push_back({SurfaceKey::Kind::kEdge, parent.edge_roots[origin].edge, middle(EdgeId{origin}), 0});
    } else {
      level.vertex_keys.push_back({SurfaceKey::Kind::kVertex, next_vertex_root_ + v, 0, 0});
    }
  }
  for (const EdgeId e : level.complex.edges()) {
    const auto [a, b] = level.complex.edge_vertices(e);
    if (a < refined.edge_points_begin && b < refined.face_points_begin) {
      const EdgeId whole{refined.origin[b]};
      const FaceSide& root = parent.edge_roots[whole];
      const bool from_begin = parent.complex.edge_vertices(whole)[0] == refined.origin[a];
      level.edge_roots.push_back({root.edge, from_begin ? root.t_begin : root.t_end, middle(whole)});
    } else {
      level.edge_roots.push_back({next_edge_root_ + e, 0, kSurfaceOne});
    }
  }
  next_vertex_root_ += level.complex.vertex_count();
  next_edge_root_ += level.complex.edge_count();
}

/// A child of a face has the face's point.
void Builder::hand_down_interfaces(const Refinement& refined, Level& level) const {
  const Level& parent = levels_.back();
  level.beyond.assign(level.complex.face_count(), kNoCellRegion);
  for (const FaceId f : level.complex.faces()) {
    for (const VertexId v : level.complex.face_vertices(f)) {
      const bool is_face_point = v >= refined.face_points_begin && v < refined.cell_points_begin;
      if (is_face_point && level.complex.face_on_boundary(f)) level.beyond[f] = parent.beyond[refined.origin[v]];
    }
  }
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
    Level& at = levels_[pending.level];
    const Classification& found = *at.classes[pending.cell];
    if (found.cell_class != CellClass::kVertex) continue;
    at.stars.resize(at.complex.vertex_count());
    const VertexId vertex = at.complex.cell_vertices(pending.cell)[found.anchor];
    if (at.stars[vertex].op != kNone) continue;
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
    pending.ring = canonical_line_ring(walker, pending.cell, found.anchor);
  } else {
    const VertexId vertex = at.complex.cell_vertices(pending.cell)[found.anchor];
    pending.ring = canonical_vertex_ring(walker, pending.cell, vertex, star_points(pending.level, vertex));
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
  const Level& at = levels_[level];
  const Star& star = at.stars[vertex];
  if (star.op == kNone) return walked_stars_.at({static_cast<std::uint32_t>(level), vertex}).points;
  std::vector<VertexId> points;
  for (std::uint32_t n = 0; n < data_.operators.stars()[star.op].points; ++n) {
    points.emplace_back(data_.rings[star.ring_begin + n] - at.point_base);
  }
  return points;
}

/// REQUIRES: walked.
const Star& Builder::star_of(std::size_t level, VertexId vertex) {
  Level& at = levels_[level];
  Star& star = at.stars[vertex];
  if (star.op == kNone) {
    const auto walked = walked_stars_.extract({static_cast<std::uint32_t>(level), vertex});
    star = {data_.operators.star(walked.mapped()), add_ring(at, walked.mapped().points)};
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
  reserve_operators();
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
    if (!is_interface) data_.cells.back().boundary_sides |= static_cast<std::uint8_t>(1u << side);
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
  if (!data.has_several_regions) {
    const SplitMesh whole{{}, {}, {}};
    Builder(mesh, whole, options, data).run(std::move(complex));
  } else {
    const SplitMesh split = split_cell_regions(mesh, complex, options.cancel);
    Builder(split.mesh, split, options, data).run(make_cell_complex(split.mesh, options.cancel));
  }
  data.summary.control_vertices = mesh.vertex_count();
  data.summary.sharp_edges = mesh.sharp_edges.size();
}

}  // namespace ccslice
