// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/build_levels.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include "core/mesh/cell_kind.h"
#include "core/prepare/id_ranges.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {
namespace {

// While they are prepared cells of whole levels were measured to take up to 1.4 kB, operators, channels and boundary
// faces apart, and cells that share no faces up to 0.5 kB more for each. Those that are made in cut-outs are many to
// each cell that is left behind: they take up to 0.23 kB while cells are built, and 0.3 kB once they have maps and
// boxes. Their cut-out takes up to 0.7 kB a cell, and 0.4 kB more where its neighbours are strewn over the part, as far
// as there are others.
constexpr std::uint64_t kLimitCellBytes = 2048, kBoundaryFaceBytes = 512;
constexpr std::uint64_t kBuiltChildBytes = 256, kBoundChildBytes = 336;
constexpr std::uint64_t kCutOutCellBytes = 768, kStrewnCellBytes = 384;
constexpr std::uint64_t kWalkedCellBytes = 2560;
// Fans of 64 cells were measured to take up to 40 B for each pair of their cells, or of tetrahedra 80, of wedges with a
// hexahedron among them 170, beyond what their cells are told to, and 4.5 MB while the first operator of one is made.
// Fans of 16 take nothing more.
constexpr std::uint64_t kWideFan = 16, kFanPairBytes = 80, kSplitFanPairBytes = 200, kFanOperatorBytes = 96 << 10;
constexpr std::uint64_t kCellPoints = 64, kFacePoints = 16;  // Of those that have points of their own.
constexpr std::uint64_t kOperatorGrowth = 4;                 // Asked for a quarter more each time.
constexpr std::uint64_t kLeastBytes = 80 << 10;              // What the smallest mesh takes.

constexpr std::size_t kRefinedTogether = 2048;  // Cells: some 12 MB, a quarter of which are others' children.
constexpr std::uint32_t kLeastPointsTogether = 1 << 8, kMostPointsTogether = 1 << 11;  // 0.6 MB of rules at most.

/// Places along a curve through a box that keeps neighbours together: bits of the three coordinates in turns.
class NeighbourOrder {
 public:
  explicit NeighbourOrder(const Box3& box)
      : low_(box.min()), per_mm_(kSteps / std::max(box.diagonal().maxCoeff(), 1e-300)) {}

  std::uint64_t operator()(const Vec3& place) const {
    std::uint64_t order = 0;
    const Vec3 steps = ((place - low_) * per_mm_).cwiseMax(0.0).cwiseMin(kSteps - 1);
    for (int axis = 0; axis < 3; ++axis) {
      const auto step = static_cast<std::uint64_t>(steps[axis]);
      for (int bit = 0; bit < kBits; ++bit) order |= (step >> bit & 1u) << (3 * bit + axis);
    }
    return order;
  }

 private:
  static constexpr int kBits = 21;  // So many that a part that is far off doesn't put all others in one place.
  static constexpr double kSteps = 1 << kBits;

  Vec3 low_;
  double per_mm_;
};

}  // namespace

Levels::Levels(const ControlMesh& mesh, const SplitMesh& split, CellComplex complex, const PrepareOptions& options,
               BuildingMemory& memory, LimitSolid::Data& data)
    : mesh_(mesh), split_(split), cancel_(options.cancel), threads_(options.threads), data_(data) {
  memory.reserve_control_cells();
  memory.reserve_fans(complex);
  add_control_level(std::move(complex));
  std::vector<CellId> cells = whole_.front().level.complex.cells().to_vector();
  std::size_t limit_cells = 0;  // So far.
  for (std::vector<CellId> left = classify(cells); !left.empty(); left = classify(cells)) {
    limit_cells += cells.size() - left.size();
    const std::size_t children = child_count(left);
    const bool is_last = mesh_.as_meshed || are_hexahedra(left);
    memory.reserve_cells(limit_cells + (is_last ? 0 : children), is_last ? children : 0);
    if (is_last) {
      number_last_level(left);
      break;
    }
    cells = add_refined_level(left);
  }
}

/// How many children these cells of the last level have.
std::size_t Levels::child_count(const std::vector<CellId>& cells) const {
  std::size_t count = 0;
  for (const CellId c : cells) count += child_count(c);
  return count;
}

std::uint32_t Levels::child_count(CellId cell) const {
  return static_cast<std::uint32_t>(corner_count(whole_.back().level.complex.kind(cell)));
}

bool Levels::are_hexahedra(const std::vector<CellId>& cells) const {
  const CellComplex& complex = whole_.back().level.complex;
  return std::ranges::all_of(cells, [&](CellId c) { return complex.kind(c) == CellKind::kHex; });
}

void Levels::add_whole_level(CellComplex complex, ChildOrigins origins, const LevelNames& names) {
  const std::size_t cells = complex.cell_count();
  WholeLevel& added = whole_.emplace_back(WholeLevel{std::move(origins), names, {std::move(complex), nullptr}, {}, {}});
  added.classes.resize(cells);
  if (names.parent != nullptr) added.names.origins = &added.origins;
  added.level.names = &added.names;
}

void Levels::add_control_level(CellComplex complex) {
  const std::size_t channels = mesh_.channel_count();
  data_.dimension = 3 + channels;
  data_.points.reserve(mesh_.vertex_count() * data_.dimension);
  for (const VertexId v : complex.vertices()) {
    const Vec3& p = mesh_.positions[v];
    data_.points.insert(data_.points.end(), {p.x(), p.y(), p.z()});
    for (std::size_t c = 0; c < channels; ++c) data_.points.push_back(mesh_.channel_values[v * channels + c]);
  }
  add_whole_level(std::move(complex), {}, {});
  if (!split_.origins.empty()) name_copies(whole_.back().level);
}

/// Copies of a vertex, or of an edge, are one place on the surface.
void Levels::name_copies(Level& level) const {
  const auto original = [&](VertexId v) { return split_.origins[v]; };
  level.originals = split_.origins;
  for (const EdgeId e : level.complex.edges()) level.edge_roots.push_back({e, 0, kSurfaceOne});
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
  level.regions_beyond.assign(level.complex.face_count(), kNoCellRegion);
  for (const auto& [cell, side, beyond] : split_.interfaces) {
    level.regions_beyond[face_of(level.complex.cell_half_faces(cell)[side])] = beyond;
  }
}

std::vector<CellId> Levels::classify(const std::vector<CellId>& cells) {
  WholeLevel& last = whole_.back();
  Classifier classifier(last.level.complex);
  PeriodicPoll poll(cancel_);
  std::vector<CellId> left;
  for (const CellId c : cells) {
    poll();
    last.classes[c] = classifier.classify(c);
    if (!last.classes[c]) left.push_back(c);
  }
  return left;
}

LevelNames Levels::next_names(const ChildOrigins& origins) const {
  const WholeLevel& last = whole_.back();
  const CellComplex& complex = last.level.complex;
  const bool of_control_mesh = whole_.size() == 1;
  const std::uint32_t edges = of_control_mesh ? complex.edge_count() : 4 * whole_.front().level.complex.face_count();
  return {static_cast<std::uint32_t>(data_.points.size() / data_.dimension), &last.level, &origins,
          last.names.first_vertex + complex.vertex_count(), last.names.first_edge + edges};
}

void Levels::add_points(const ChildOrigins& children) {
  const WholeLevel& parent = whole_.back();
  const std::size_t dimension = data_.dimension;
  const std::size_t base = data_.points.size();
  data_.points.resize(base + children.count() * dimension);
  const IdRange<VertexId> all(children.count());
  const std::uint32_t together = ids_per_range_of(children.count(), kLeastPointsTogether, kMostPointsTogether);
  const auto make_rules = [&] { return ChildRules(parent.level.complex, children); };
  for_each_range(all, threads_, together, make_rules, [&](ChildRules& rules, const auto& range) {
    const VertexId first = *range.ids.begin();
    const Stencils rows = rules.rows(first, range.ids.size(), cancel_);
    rows.apply(0, rows.rows(), data_.points.data() + parent.names.point_base * dimension, dimension,
               data_.points.data() + base + first * dimension);
  });
}

std::vector<CellId> Levels::add_refined_level(const std::vector<CellId>& cells) {
  WholeLevel& parent = whole_.back();
  ChildVertices vertices(parent.level.complex, cells);
  CutOut all = CutOutMaker(parent.level.complex, vertices).make(cells, cancel_);
  parent.first_child.assign(parent.level.complex.cell_count(), CellId{kNone});
  std::vector<CellId> children;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    parent.first_child[cells[i]] = all.first_child[i];
    const auto count = static_cast<std::uint32_t>(corner_count(parent.level.complex.kind(cells[i])));
    for (std::uint32_t k = 0; k < count; ++k) children.emplace_back(all.first_child[i] + k);
  }
  const LevelNames names = next_names(vertices);
  add_points(vertices);
  add_whole_level(std::move(all.complex), std::move(vertices), names);
  return children;
}

void Levels::number_last_level(const std::vector<CellId>& cells) {
  const CellComplex& parent = whole_.back().level.complex;
  last_vertices_.emplace(parent, cells);
  last_names_ = next_names(*last_vertices_);
  add_points(*last_vertices_);
  cut_outs_.emplace(parent, *last_vertices_);
  group_neighbours(cells);
}

/// A cut-out has all children round its own: the fewer, the nearer its cells are to each other. Their numbers needn't
/// say that.
void Levels::group_neighbours(std::vector<CellId> cells) {
  const Level& parent = whole_.back().level;
  const auto middle = [&](CellId cell) {
    Vec3 sum = Vec3::Zero();
    const auto vertices = parent.complex.cell_vertices(cell);
    for (const VertexId v : vertices) sum += data_.position(parent.point(v));
    return Vec3(sum / static_cast<double>(vertices.size()));
  };
  Box3 box;
  for (const CellId c : cells) box.extend(middle(c));
  const NeighbourOrder order_of(box);
  std::vector<std::pair<std::uint64_t, CellId>> ordered;
  ordered.reserve(cells.size());
  for (const CellId c : cells) ordered.emplace_back(order_of(middle(c)), c);
  std::ranges::sort(ordered);
  for (std::size_t begin = 0; begin < ordered.size(); begin += kRefinedTogether) {
    Group& group = groups_.emplace_back();
    const std::size_t end = std::min(begin + kRefinedTogether, ordered.size());
    for (std::size_t i = begin; i < end; ++i) group.push_back(ordered[i].second);
    std::ranges::sort(group);
  }
}

Levels::RefinedGroup Levels::refine(const Group& group) {
  CutOut cut_out = cut_outs_->make(group, cancel_);
  return {{std::move(cut_out.complex), &last_names_, std::move(cut_out.numbers)}, std::move(cut_out.first_child)};
}

void BuildingMemory::reserve_control_cells() {
  std::size_t once = 0, twice = 0;
  for (const CellKind kind : mesh_.cell_kinds) {
    const std::size_t kChildren = mesh_.as_meshed ? 1 : 8;  // Of a hexahedron.
    if (kind == CellKind::kHex) {
      ++once;
    } else {
      twice += kChildren * static_cast<std::size_t>(corner_count(kind));
    }
  }
  reserve_cells(once, twice);
}

void BuildingMemory::reserve_own_points(std::size_t cells, std::size_t faces) {
  own_points_bytes_ = (kCellPoints * cells + kFacePoints * faces) *
                      (sizeof(double) * (3 + mesh_.channel_count()) + sizeof(std::uint32_t));
  reserve();
}

void BuildingMemory::reserve_fans(const CellComplex& control_cells) {
  if (mesh_.as_meshed) return;  // Their rings are their own corners.
  std::uint64_t widest = kWideFan;
  for (const EdgeId e : control_cells.edges()) {
    const std::span<const CellId> fan = control_cells.edge_cells(e);
    if (fan.size() <= kWideFan) continue;
    const bool all_hexahedra =
        std::ranges::all_of(fan, [&](CellId c) { return control_cells.kind(c) == CellKind::kHex; });
    fan_bytes_ += (all_hexahedra ? kFanPairBytes : kSplitFanPairBytes) * fan.size() * (fan.size() - kWideFan);
    widest = std::max<std::uint64_t>(widest, fan.size());
  }
  fan_bytes_ += kFanOperatorBytes * (widest - kWideFan);
  if (fan_bytes_ > 0) reserve();
}

void BuildingMemory::reserve_cells(std::size_t cells, std::size_t children) {
  cells_ = cells;
  children_ = children;
  reserve();
}

void BuildingMemory::reserve_faces(std::size_t faces) {
  faces_ = faces;
  reserve();
}

void BuildingMemory::reserve_operators(std::size_t bytes, std::size_t kept) {
  if (bytes <= operator_bytes_ && kept <= kept_operator_bytes_) return;
  operator_bytes_ = bytes + bytes / kOperatorGrowth;
  kept_operator_bytes_ = kept + kept / kOperatorGrowth;
  reserve();
}

/// Refined cells count with their share of the levels above. Keys of operators and two cut-outs, of which one is
/// refined ahead, are held while cells are built, maps and boxes of cells afterwards: the most is held in one time or
/// in the other.
void BuildingMemory::reserve() {
  const std::uint64_t points = mesh_.vertex_count() + limit_cells();
  const std::uint64_t values = mesh_.channel_count() * 2 * points;  // While copied.
  const std::uint64_t cut_outs = std::min(children_, 2 * 8 * kRefinedTogether);
  const std::uint64_t strewn = std::min(children_ - cut_outs, cut_outs);
  const std::uint64_t always = kLeastBytes + kLimitCellBytes * cells_ + kBoundaryFaceBytes * faces_ + fan_bytes_ +
                               own_points_bytes_ + sizeof(double) * values;
  const std::uint64_t built = kBuiltChildBytes * children_ + kCutOutCellBytes * cut_outs + kStrewnCellBytes * strewn +
                              operator_bytes_ + kWalkedCellBytes * std::min(limit_cells(), kWalkedTogether);
  const std::uint64_t bound = kBoundChildBytes * children_ + kept_operator_bytes_;
  told_bytes_ = std::max(told_bytes_, always + std::max(built, bound));
  if (options_.reserve) options_.reserve(told_bytes_);
}

}  // namespace ccslice
