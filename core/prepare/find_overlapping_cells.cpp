// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/lanes.h"
#include "core/limit/lane_box.h"
#include "core/prepare/box_blocks.h"
#include "core/prepare/cell_probe.h"
#include "core/prepare/face_crossing.h"
#include "core/prepare/id_ranges.h"
#include "core/prepare/overlap_measure.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_options.h"
#include "core/prepare/surface_pieces.h"

namespace ccslice {

namespace {

constexpr std::size_t kMaxReportedOverlaps = 32;
// Bounds on the time where everything overlaps.
constexpr std::size_t kMostPairsPerFace = 64;                    // Whose boxes meet, of a block on average.
constexpr std::size_t kPairsAtLeast = 1024, kPairsPerFace = 16;  // Looked at closely, likewise.
// Boxes compared, for each of: parts inside others, faces that cross, cells that are measured. Some 0.4 s, and 8 us a
// cell.
constexpr std::uint64_t kWorkAtLeast = 1 << 23, kWorkPerCell = 128;
constexpr std::size_t kWorkedOnTogether = 256;
constexpr std::uint32_t kLeastBlocks = 16, kMostBlocks = 64;  // Worked on together.

using BlockId = Id<struct BoxBlockKind>;
using LookerTurn = Id<struct LookerTurnKind>;

/// The corners of a control cell, eight at once; fewer repeat the first one.
using CornerLanes = std::uint32_t __attribute__((vector_size(4 * kFloatLanes)));

CornerLanes corner_lanes(std::span<const std::uint32_t> corners) {
  CornerLanes lanes = {};
  for (std::size_t k = 0; k < kFloatLanes; ++k) lanes[k] = corners[k < corners.size() ? k : 0];
  return lanes;
}

/// As LimitSolid::touch(), in a tenth of the time.
bool share_a_corner(CornerLanes a, CornerLanes b) {
  auto same = a == b[0];
  for (std::size_t k = 1; k < kFloatLanes; ++k) same |= a == b[k];
  return float_lanes_of(same) != 0;
}

struct FacePair {
  BoundaryFaceId a, b;
  friend auto operator<=>(const FacePair&, const FacePair&) = default;
};

/// The hull of a face reaches far beside it, the box of its cell far below it. What they have in common is close to a
/// face that lies along an axis, and for others the box of a patch isn't long to make.
Box3 box_around(const LimitSolid::Data& data, const BoundarySurface& surface, BoundaryFaceId face) {
  constexpr double kFlat = 0.2;
  const Box3 box = surface.hull_box(face).intersection(data.cell_boxes.box(surface.faces()[face].cell));
  const Vec3 extent = box.sizes();
  if (!surface.faces()[face].regular || extent.minCoeff() < kFlat * extent.maxCoeff()) return box;
  LaneBox close;
  const BezierPatch patch = surface.regular_patch(face);
  for (const PaddedPoint& p : patch.b) close.extend(load_unaligned(p.data()));
  return close.box();
}

BoxBlocks blocks_of_faces(const LimitSolid::Data& data, const BoundarySurface& surface,
                          const CancellationToken& cancel) {
  std::vector<Box3> boxes;
  boxes.reserve(surface.faces().size());
  for (const BoundaryFaceId face : surface.face_ids()) boxes.push_back(box_around(data, surface, face));
  return {boxes, cancel};
}

/// Pairs of faces of cells that don't touch, whose own boxes may cross. One thread.
class NearFaces {
 public:
  /// `corners`: by face, of its control cell.
  NearFaces(const LimitSolid::Data& data, const BoundarySurface& surface, std::span<const CornerLanes> corners)
      : data_(data), surface_(surface), pieces_(surface), corners_(corners), slots_(corners.size(), kNone) {}

  /// Appends those of a range of blocks. False if there are too many.
  [[nodiscard]] bool append(const BoxBlocks& blocks, IdRange<BlockId> range, std::vector<FacePair>& found) {
    bool complete = true;
    for (const std::uint32_t block : range) {
      std::size_t left = kMostPairsPerFace * BoxBlocks::kBlockBoxes;
      const std::size_t most = found.size() + kPairsPerFace * BoxBlocks::kBlockBoxes + kPairsAtLeast / blocks.size();
      complete &= blocks.visit_pairs(block, [&](std::uint32_t i, std::uint32_t j) {
        const BoundaryFaceId a{std::min(i, j)}, b{std::max(i, j)};
        if (share_a_corner(corners_[a], corners_[b])) return true;
        if (left-- == 0) return false;
        if (cannot_cross(a, b)) return true;
        const bool is_closer = refine(a) | refine(b);
        if (is_closer && cannot_cross(a, b)) return true;
        if (found.size() == most) return false;
        found.push_back({a, b});
        return true;
      });
    }
    for (const BoundaryFaceId face : boxed_) slots_[face] = kNone;
    boxed_.clear(), boxes_.clear();
    return complete;
  }

 private:
  struct FaceBox {
    SlantedBox box;
    bool is_close;  // As close as it gets.
  };

  bool cannot_cross(BoundaryFaceId a, BoundaryFaceId b) {
    const std::uint32_t slot_a = slot_of(a), slot_b = slot_of(b);
    return ccslice::cannot_cross(boxes_[slot_a].box, boxes_[slot_b].box, kLeastOverlapMm);
  }

  /// Irregular faces take ten times as long: most are off others by their hulls.
  std::uint32_t slot_of(BoundaryFaceId face) {
    if (slots_[face] == kNone) {
      slots_[face] = static_cast<std::uint32_t>(boxes_.size());
      const bool is_regular = surface_.faces()[face].regular;
      boxes_.push_back({is_regular ? pieces_.box_of(face) : SlantedBox{box_around(data_, surface_, face)}, is_regular});
      boxed_.push_back(face);
    }
    return slots_[face];
  }

  /// True if the face's box gets closer.
  bool refine(BoundaryFaceId face) {
    FaceBox& box = boxes_[slots_[face]];
    if (box.is_close) return false;
    box = {pieces_.box_of(face), true};
    return true;
  }

  const LimitSolid::Data& data_;
  const BoundarySurface& surface_;
  SurfacePieces pieces_;
  std::span<const CornerLanes> corners_;
  std::vector<std::uint32_t> slots_;  // By face, of boxes_; kNone.
  std::vector<BoundaryFaceId> boxed_;
  std::vector<FaceBox> boxes_;
};

/// What looks at cells closely. One thread.
struct Looker {
  explicit Looker(const LimitSolid& solid)
      : surface(solid), probe(solid), crossing(surface, probe), measure(solid, probe) {}

  /// In boxes compared.
  std::uint64_t work() const { return probe.work() + crossing.work() + measure.work(); }

  BoundarySurface surface;
  CellProbe probe;
  FaceCrossing crossing;
  OverlapMeasure measure;
};

void merge(const std::vector<OverlapPartner>& partners, CellOverlap& overlap) {
  for (const OverlapPartner& partner : partners) overlap.add(partner);
}

class OverlapFinder {
 public:
  OverlapFinder(const LimitSolid& solid, const PrepareOptions& options)
      : solid_(solid), data_(solid.data()), options_(options) {}

  /// Finds the cells, and what they have in common.
  void run() {
    add_parts_in_others();
    work_ = 0;
    add_crossing_faces(near_faces());
    work_ = 0;
    std::vector<LimitCellId> cells;
    for (const auto& [cell, partners] : reaches_) cells.push_back(cell);
    while (!cells.empty()) cells = measure(std::move(cells));
    for (const auto& [cell, partners] : reaches_) {
      if (!found_.contains(cell)) merge(partners, found_[cell]);
    }
  }

  Overlaps summarize() const;
  /// Boxes that hold what cells of the same part have in common.
  std::vector<Box3> boxes_of_own_parts() const;

 private:
  std::vector<FacePair> near_faces();
  void add_crossing_faces(const std::vector<FacePair>& pairs);
  void add_parts_in_others();
  void add(const FaceReach& reach);
  double volume_mm3(LimitCellId cell, const OverlapPartner& partner) const;
  /// Measures cells that weren't yet. Returns cells that may overlap others, too.
  std::vector<LimitCellId> measure(std::vector<LimitCellId> cells);

  /// Calls look(looker, n) for n from 0 to count - 1, on several threads, until the work is used up. Returns how many
  /// it called it for.
  template <typename Look>
  std::size_t look_at(std::size_t count, Look look) {
    const auto make_looker = [&] { return std::make_unique<Looker>(solid_); };
    const std::uint64_t most = kWorkAtLeast + kWorkPerCell * solid_.cell_count();
    std::size_t done = 0;
    while (done < count) {
      if (work_ > most) return complete_ = false, done;
      const auto together = static_cast<std::uint32_t>(std::min(count - done, kWorkedOnTogether));
      std::vector<std::uint64_t> work(together);
      for_each_range(IdRange<LookerTurn>(together), options_.threads, ids_per_range_of(together, 4), make_looker,
                     [&](std::unique_ptr<Looker>& looker, const auto& range) {
                       for (const LookerTurn turn : range.ids) {
                         options_.cancel.throw_if_cancelled();
                         const std::uint64_t before = looker->work();
                         look(*looker, done + turn);
                         work[turn] = looker->work() - before;
                       }
                     });
      work_ += std::accumulate(work.begin(), work.end(), std::uint64_t{0});
      done += together;
    }
    return done;
  }

  const LimitSolid& solid_;
  const LimitSolid::Data& data_;
  const PrepareOptions& options_;
  bool complete_ = true;
  std::uint64_t work_ = 0;
  std::map<LimitCellId, std::vector<OverlapPartner>> reaches_;  // Found before all else.
  std::map<LimitCellId, CellOverlap> found_;                    // Cells that were measured.
};

std::vector<FacePair> OverlapFinder::near_faces() {
  const BoundarySurface surface(solid_);
  const BoxBlocks blocks = blocks_of_faces(data_, surface, options_.cancel);
  std::vector<CornerLanes> corners;
  corners.reserve(surface.faces().size());
  for (const BoundaryFace& face : surface.faces()) {
    corners.push_back(corner_lanes(data_.corners(data_.cells[face.cell].control_cell)));
  }
  const std::uint32_t per_range = ids_per_range_of(blocks.size(), kLeastBlocks, kMostBlocks);
  std::vector<std::vector<FacePair>> found(range_count(blocks.size(), per_range));
  std::vector<std::uint8_t> complete(found.size());
  for_each_range(
      IdRange<BlockId>(blocks.size()), options_.threads, per_range,
      [&] { return std::make_unique<NearFaces>(data_, surface, corners); },
      [&](std::unique_ptr<NearFaces>& near, const auto& range) {
        options_.cancel.throw_if_cancelled();
        complete[range.number] = near->append(blocks, range.ids, found[range.number]);
      });
  std::vector<FacePair> pairs;
  for (std::vector<FacePair>& of_range : found) {
    pairs.insert(pairs.end(), of_range.begin(), of_range.end());
    of_range = {};
  }
  if (std::ranges::find(complete, 0) != complete.end()) complete_ = false;
  std::ranges::sort(pairs);
  return pairs;
}

/// Either cell may be where the other one's boundary isn't.
void OverlapFinder::add(const FaceReach& reach) {
  reaches_[reach.cell].push_back({reach.other, reach.position, reach.depth_mm});
  reaches_[reach.other].push_back({reach.cell, reach.position, 0});
}

void OverlapFinder::add_crossing_faces(const std::vector<FacePair>& pairs) {
  std::vector<std::optional<FaceReach>> reaches(pairs.size());
  look_at(pairs.size(),
          [&](Looker& looker, std::size_t n) { reaches[n] = looker.crossing.find(pairs[n].a, pairs[n].b); });
  for (const std::optional<FaceReach>& reach : reaches) {
    if (reach) add(*reach);
  }
}

/// Where a part lies in another one as a whole, or two are the same, no faces cross: the middle of a cell tells.
void OverlapFinder::add_parts_in_others() {
  std::vector<LimitCellId> firsts;  // Of the parts.
  for (const LimitCellId cell : IdRange<LimitCellId>(data_.parts.size())) {
    if (data_.parts[cell] == firsts.size()) firsts.push_back(cell);
  }
  std::vector<std::optional<FaceReach>> reaches(firsts.size());
  look_at(firsts.size(), [&](Looker& looker, std::size_t n) {
    const Vec3 middle = looker.probe.evaluator().geo({firsts[n], Vec3::Constant(0.5)});
    data_.cell_boxes.any_meeting(Box3(middle, middle), [&](std::uint32_t item) {
      const LimitCellId other{item};
      if (data_.parts[other] == n || !looker.probe.find(other, middle)) return false;
      reaches[n] = FaceReach{firsts[n], other, middle, 0};
      return true;
    });
  });
  for (const std::optional<FaceReach>& reach : reaches) {
    if (reach) add(*reach);
  }
}

std::vector<LimitCellId> OverlapFinder::measure(std::vector<LimitCellId> cells) {
  std::ranges::sort(cells);
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::erase_if(cells, [&](LimitCellId cell) { return found_.contains(cell); });
  std::vector<CellOverlap> overlaps(cells.size());
  const std::size_t done = look_at(cells.size(), [&](Looker& looker, std::size_t n) {
    overlaps[n] = looker.measure.examine(cells[n]);
    const auto reaches = reaches_.find(cells[n]);
    if (reaches == reaches_.end()) return;
    merge(reaches->second, overlaps[n]);
  });
  std::vector<LimitCellId> next;
  for (std::size_t n = 0; n < done; ++n) {
    for (const OverlapPartner& partner : overlaps[n].partners) next.push_back(partner.cell);
    next.insert(next.end(), overlaps[n].neighbours.begin(), overlaps[n].neighbours.end());
    overlaps[n].neighbours = {};
    found_.emplace(cells[n], std::move(overlaps[n]));
  }
  return next;
}

/// The smaller of two cells tells more of what they have in common.
double OverlapFinder::volume_mm3(LimitCellId cell, const OverlapPartner& partner) const {
  const auto other = found_.find(partner.cell);
  if (other == found_.end()) return partner.volume_mm3;
  const auto back = std::ranges::lower_bound(other->second.partners, cell, {}, &OverlapPartner::cell);
  if (back == other->second.partners.end() || back->cell != cell) return partner.volume_mm3;
  const bool is_smaller =
      std::pair(data_.volume_mm3(cell), cell) < std::pair(data_.volume_mm3(partner.cell), partner.cell);
  return is_smaller ? partner.volume_mm3 : 0;
}

Overlaps OverlapFinder::summarize() const {
  Overlaps overlaps;
  std::map<std::pair<ControlCellId, ControlCellId>, OverlapPlace> places;
  for (const auto& [cell, overlap] : found_) {
    overlaps.cells += !overlap.partners.empty();
    for (const OverlapPartner& partner : overlap.partners) {
      overlaps.volume_mm3 += volume_mm3(cell, partner);
      overlaps.depth_mm = std::max(overlaps.depth_mm, partner.depth_mm);
      const auto [low, high] = std::minmax({solid_.control_cell(cell), solid_.control_cell(partner.cell)});
      const OverlapPlace place{low, high, partner.position, partner.depth_mm};
      const auto [known, is_new] = places.emplace(std::pair(low, high), place);
      if (!is_new && place.depth_mm > known->second.depth_mm) known->second = place;
    }
  }
  overlaps.at_least = !complete_;
  for (const auto& [cells, place] : places) {
    if (overlaps.places.size() < kMaxReportedOverlaps) overlaps.places.push_back(place);
  }
  return overlaps;
}

std::vector<Box3> OverlapFinder::boxes_of_own_parts() const {
  std::vector<Box3> boxes;
  for (const auto& [cell, overlap] : found_) {
    Box3 around;
    for (const OverlapPartner& partner : overlap.partners) {
      if (!data_.parts.empty() && data_.parts[cell] != data_.parts[partner.cell]) continue;
      around.extend(data_.cell_boxes.box(cell).intersection(data_.cell_boxes.box(partner.cell)));
    }
    if (!around.isEmpty()) boxes.push_back(around);
  }
  return boxes;
}

}  // namespace

void find_overlapping_cells(const LimitSolid& solid, const PrepareOptions& options, LimitSolid::Data& data) {
  std::vector<Box3> boxes;
  {
    OverlapFinder finder(solid, options);
    finder.run();
    data.summary.overlaps = finder.summarize();
    boxes = finder.boxes_of_own_parts();
  }
  if (boxes.empty()) return;
  data.fold_boxes = {};  // There is no room for two of them where all cells fold.
  boxes.reserve(boxes.size() + data.fold_cells.size());
  for (const LimitCellId cell : data.fold_cells) boxes.push_back(data.cell_boxes.box(cell));
  data.fold_boxes = BoxTree(boxes, options.cancel);
}

}  // namespace ccslice
