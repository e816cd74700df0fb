// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/task_arena.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh_import/channels.h"
#include "core/prepare/beside_task.h"
#include "core/prepare/build_levels.h"
#include "core/prepare/cell_adder.h"
#include "core/prepare/curved_cells.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_options.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine_rules.h"

namespace ccslice {

namespace {

class Builder {
 public:
  Builder(const ControlMesh& mesh, const CurvedCells& curved, const PrepareOptions& options, LimitSolid::Data& data)
      : mesh_(mesh), curved_(curved), options_(options), memory_(mesh, options), data_(data) {}

  /// Returns what options.reserve was told.
  std::uint64_t run(const SplitMesh& split, CellComplex complex) {
    options_.begin(PreparationStep::kRefining);
    levels_.emplace(mesh_, split, std::move(complex), options_, memory_, data_);
    options_.begin(PreparationStep::kBuilding, memory_.limit_cells());
    const std::size_t faces = count_faces();
    memory_.reserve_faces(faces);
    number_cells();
    if (curved_.any()) reserve_own_points();
    adder_.emplace(mesh_, curved_, options_, memory_, levels_->whole().size() + 1,
                   RingStore(count_ring_points(faces), data_), faces, data_);
    if (options_.threads > 1) {
      tbb::task_arena(options_.threads).execute([&] { add_cells_while_refining(); });
    } else {
      add_cells();
    }
    adder_->put_faces();
    data_.operators.forget_keys();
    summarize();
    return memory_.told_bytes();
  }

 private:
  std::size_t count_faces() const;
  std::size_t count_ring_points(std::size_t faces) const;
  void reserve_own_points();
  void number_cells();
  void number(std::size_t level, CellId cell, ControlCellId control_cell);
  void add_cells();
  void add_cells_while_refining();
  void add_ready_cells(std::size_t whole_level);
  void add_children(const Levels::Group& group, const Levels::RefinedGroup& refined);
  void summarize();

  const ControlMesh& mesh_;
  const CurvedCells& curved_;
  const PrepareOptions& options_;
  BuildingMemory memory_;
  LimitSolid::Data& data_;
  std::optional<Levels> levels_;
  std::optional<CellAdder> adder_;
  std::vector<std::vector<LimitCellId>> limit_cells_;  // By whole level and cell: its own, or its first child's.
  std::uint32_t numbered_ = 0;
  std::size_t curved_cells_ = 0;
};

/// A face of the boundary counts once, one of an interface twice: each side has its own.
std::size_t Builder::count_faces() const {
  std::size_t faces = 0;
  const auto count = [&](const CellComplex& complex, CellId cell, bool is_refined) {
    for (const HalfFaceId h : complex.cell_half_faces(cell)) {
      const FaceId face = face_of(h);
      if (complex.face_on_boundary(face)) faces += is_refined ? complex.face_vertices(face).size() : 1;
    }
  };
  for (const WholeLevel& whole : levels_->whole()) {
    for (const CellId c : whole.level.complex.cells()) {
      if (whole.classes[c]) count(whole.level.complex, c, false);
    }
  }
  for (const Levels::Group& group : levels_->groups()) {
    for (const CellId c : group) count(levels_->whole().back().level.complex, c, true);
  }
  return faces;
}

/// Nearly all of them have so many, or fewer. The children of a regular cell have 5 x 5 x 5, those of a tetrahedron as
/// meshed 15, and a phantom.
std::size_t Builder::count_ring_points(std::size_t faces) const {
  constexpr std::size_t kFacePoints = 16;
  const std::size_t cell_points = mesh_.as_meshed ? 9 : 64, family_points = mesh_.as_meshed ? 22 : 160;
  std::size_t families = 0, children = 0;
  for (const Levels::Group& group : levels_->groups()) {
    families += group.size();
    for (const CellId c : group) children += levels_->child_count(c);
  }
  constexpr std::size_t kCurvedPoints = 64;
  return cell_points * (data_.cells.size() - children) + family_points * families + kFacePoints * faces +
         kCurvedPoints * curved_cells_;
}

/// An interface has a face of the lower region only.
void Builder::reserve_own_points() {
  const Level& level = levels_->whole().front().level;
  const CellComplex& control = level.complex;
  std::size_t faces = 0;
  for (const LimitCell& cell : data_.cells) curved_cells_ += curved_.is_curved(cell.control_cell);
  for (const CellId c : control.cells()) {
    if (!curved_.is_curved(ControlCellId{c})) continue;
    for (const HalfFaceId h : control.cell_half_faces(c)) {
      const FaceId face = face_of(h);
      if (!control.face_on_boundary(face) || level.beyond(face) < region_of(mesh_, c)) continue;
      faces += control.kind(c) == CellKind::kHex ? 1 : control.face_vertices(face).size();
    }
  }
  memory_.reserve_own_points(curved_cells_, faces);
  data_.points.reserve(data_.points.size() + (64 * curved_cells_ + 16 * faces) * data_.dimension);
}

void Builder::number_cells() {
  data_.cells.resize(memory_.limit_cells());
  for (const WholeLevel& whole : levels_->whole()) limit_cells_.emplace_back(whole.level.complex.cell_count());
  for (const CellId c : levels_->whole().front().level.complex.cells()) number(0, c, ControlCellId{c});
}

void Builder::number(std::size_t level, CellId cell, ControlCellId control_cell) {
  const WholeLevel& at = levels_->whole()[level];
  if (at.classes[cell] || level + 1 == levels_->whole().size()) {
    limit_cells_[level][cell] = LimitCellId{numbered_};
    for (std::uint32_t left = at.classes[cell] ? 1 : levels_->child_count(cell); left > 0; --left) {
      data_.cells[numbered_++].control_cell = control_cell;
    }
    return;
  }
  const int children = corner_count(at.level.complex.kind(cell));
  for (int i = 0; i < children; ++i) {
    number(level + 1, CellId{at.first_child[cell] + static_cast<std::uint32_t>(i)}, control_cell);
  }
}

void Builder::add_cells() {
  for (std::size_t n = 0; n < levels_->whole().size(); ++n) add_ready_cells(n);
  for (const Levels::Group& group : levels_->groups()) add_children(group, levels_->refine(group));
}

/// Refining has nothing to do with what the cells before are given, so it goes on beside it, one group ahead.
void Builder::add_cells_while_refining() {
  const std::vector<Levels::Group>& groups = levels_->groups();
  std::optional<Levels::RefinedGroup> refined;
  BesideTask refining;
  const auto refine = [&](std::size_t group) {
    if (group < groups.size()) refining.run([&, group] { refined.emplace(levels_->refine(groups[group])); });
  };
  refine(0);
  for (std::size_t n = 0; n < levels_->whole().size(); ++n) add_ready_cells(n);
  for (std::size_t group = 0; group < groups.size(); ++group) {
    refining.wait();
    const Levels::RefinedGroup now = *std::exchange(refined, std::nullopt);
    refine(group + 1);
    add_children(groups[group], now);
  }
}

void Builder::add_ready_cells(std::size_t whole_level) {
  const WholeLevel& whole = levels_->whole()[whole_level];
  if (std::ranges::none_of(whole.classes, [](const auto& found) { return found.has_value(); })) return;
  adder_->enter(whole.level, whole_level);
  for (const CellId c : whole.level.complex.cells()) {
    if (whole.classes[c]) adder_->add(c, limit_cells_[whole_level][c], *whole.classes[c], true);
  }
  adder_->finish_level();
}

void Builder::add_children(const Levels::Group& group, const Levels::RefinedGroup& refined) {
  adder_->enter(refined.level, levels_->whole().size());
  Classifier classifier(refined.level.complex);
  for (std::size_t i = 0; i < group.size(); ++i) {
    const LimitCellId first = limit_cells_.back()[group[i]];
    for (std::uint32_t k = 0; k < levels_->child_count(group[i]); ++k) {
      const CellId child{refined.first_child[i] + k};
      const auto found = classifier.classify(child);
      if (!found) throw Error(ErrorCode::kInternal, "refinement doesn't end");
      adder_->add(child, LimitCellId{first + k}, *found, k == 0);
    }
  }
  adder_->finish_level();
}

void Builder::summarize() {
  SolidSummary& summary = data_.summary;
  const CellComplex& control = levels_->whole().front().level.complex;
  summary.control_cells = mesh_.cell_count();
  summary.limit_cells = data_.cells.size();
  for (const LimitCell& cell : data_.cells) {
    summary.regular_cells += cell.cell_class == CellClass::kRegular;
    summary.line_cells += cell.cell_class == CellClass::kLine;
    summary.vertex_cells += cell.cell_class == CellClass::kVertex;
  }
  summary.boundary_faces = data_.boundary_face_count;
  std::vector<std::pair<double, double>> curved;
  if (curved_.any()) curved = curved_.channel_ranges(options_.cancel);
  for (std::size_t c = 0; c < mesh_.channel_count(); ++c) {
    const auto [low, high] = channel_range(mesh_, c);
    ChannelRange& range = summary.channels.emplace_back(ChannelRange{mesh_.channel_names[c], low, high});
    if (curved.empty()) continue;
    range.min = std::min(range.min, curved[c].first), range.max = std::max(range.max, curved[c].second);
  }
  if (mesh_.as_meshed) return;  // No edge or vertex of it is extraordinary.
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
}

}  // namespace

std::uint64_t build_cells(const ControlMesh& mesh, CellComplex complex, const PrepareOptions& options,
                          LimitSolid::Data& data) {
  data.cell_regions = mesh.cell_regions;
  data.has_several_regions = has_several_regions(mesh);
  data.control_corners = mesh.cell_vertices;
  data.first_corners.reserve(mesh.cell_count() + 1);
  data.first_corners.push_back(0);
  for (const CellKind kind : mesh.cell_kinds) {
    data.first_corners.push_back(data.first_corners.back() + static_cast<std::uint32_t>(corner_count(kind)));
  }
  data.summary.control_vertices = mesh.vertex_count();
  data.summary.sharp_edges = mesh.sharp_edges.size();
  if (!data.has_several_regions) {
    const SplitMesh whole{{}, {}, {}};
    return Builder(mesh, CurvedCells(mesh, {}, mesh.channel_values), options, data).run(whole, std::move(complex));
  }
  const SplitMesh split = split_cell_regions(mesh, complex, options.cancel);
  const CurvedCells curved(split.mesh, split.origins, mesh.channel_values);
  return Builder(split.mesh, curved, options, data).run(split, make_cell_complex(split.mesh, options.cancel));
}

}  // namespace ccslice
