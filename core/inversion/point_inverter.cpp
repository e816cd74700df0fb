// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/point_inverter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/inversion/cell_candidates.h"
#include "core/inversion/nearest_place.h"
#include "core/inversion/start_places.h"
#include "core/limit/cell_distance.h"
#include "core/limit/cell_index.h"
#include "core/limit/newton.h"
#include "core/limit/part_trees.h"

namespace ccslice {

namespace {

using FewStarts = StartPlaces<2>;
using ManyStarts = StartPlaces<4>;
constexpr std::size_t kCellsOfFewStarts = 128, kCellsOfManyStarts = 32;
constexpr double kFarFromCell = 2.5;        // A candidate's distance beyond which a hint isn't followed.
constexpr double kNearOutside = 100;        // Times the distance that counts as just outside.
constexpr double kJustOutside = 5000;       // Times the distance that counts as found: 0.005 mm,
constexpr double kJustOutsideOfCell = 0.1;  // but no more than that of a thin cell.
constexpr double kDoubtful = 0.6;           // From this distance on a candidate is ruled out first, if it can be.
constexpr double kFarthestOfCell = 1;  // As a share of the cell: how far from a candidate's middle its points may seem.
constexpr int kFootSteps = 4;          // To the foot of a perpendicular.
constexpr int kMaxNewtonRuns = 512;    // For one search: some milliseconds. Near folds a point may take two.
constexpr std::size_t kMostKept = 1 << 16;  // Candidates of a batch: some megabytes.
constexpr std::size_t kMostSettled = 12;    // Cells where the place nearest to a point off the solid is looked for.
constexpr std::size_t kThoroughStarts = 8;  // Starts tried per cell when the nearest one fails.
constexpr std::size_t kAllSearched = kMaxNewtonRuns / (1 + kThoroughStarts);  // Runs are enough for as many cells.

/// The sides of its cell that the parameter is on: bit 2 * axis + (at 1).
unsigned sides_at(const Vec3& uvw) {
  constexpr double kOnSide = 1e-3;
  unsigned sides = 0;
  for (int a = 0; a < 3; ++a) {
    if (uvw[a] < kOnSide) sides |= 1u << (2 * a);
    if (uvw[a] > 1 - kOnSide) sides |= 2u << (2 * a);
  }
  return sides;
}

/// The parameter is on the boundary of the solid, and not on another side of its cell.
bool is_on_boundary(const LimitSolid& solid, const CellParam& at) {
  const unsigned sides = sides_at(at.uvw);
  return sides != 0 && (sides & ~unsigned{solid.boundary_sides(at.cell)}) == 0;
}

/// A point of a batch.
struct Located {
  std::uint32_t point;
  LimitCellId cell;            // That it is solved with.
  std::uint32_t first, count;  // Its candidates, of State::kept.
  bool is_kept;                // Or they are to be collected.
};

}  // namespace

struct PointInverter::State {
  const LimitSolid& solid;
  const CellIndex& index;
  InversionOptions options;
  Acceptance acceptance;
  LimitEvaluator evaluator;
  FewStarts few_starts{kCellsOfFewStarts};
  ManyStarts many_starts{kCellsOfManyStarts};
  std::optional<CellDistance> distance;  // If options.proves_outside.
  std::optional<PartTrees> parts;        // Where a point may have several parameters.
  std::vector<Candidate> candidates;
  std::vector<Located> located;  // The batch at hand,
  std::vector<Candidate> kept;   // and its points' candidates.
  int runs_left = 0;

  State(const LimitSolid& s, const InversionOptions& o)
      : solid(s), index(s.index()), options(o), acceptance(s, o.accept_mm), evaluator(s, o.patch_cache_bytes) {
    if (options.proves_outside) distance.emplace(s);
    const bool is_ambiguous = index.fold_boxes.size() + index.overlap_boxes.size() > 0;
    if (is_ambiguous) parts.emplace(s, options.outside_mm + acceptance.least_mm());
    candidates.reserve(std::min<std::size_t>(s.cell_count(), kMaxNewtonRuns));
  }

  template <typename Wanted>
  void collect(const Vec3& point, double margin_mm, CandidateOrder order, const Wanted& wanted) noexcept {
    collect_candidates(index, point, margin_mm, order, wanted, candidates);
  }

  /// The nearest of a few interior starts.
  Vec3 nearest_start(LimitCellId cell, const Vec3& point) noexcept {
    double nearest_distance = std::numeric_limits<double>::infinity();
    Vec3 nearest = Vec3::Constant(0.5);
    const FewStarts::Places& places = few_starts.of(cell, evaluator);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double distance = (places[i] - point).squaredNorm();
      if (distance >= nearest_distance) continue;
      nearest_distance = distance;
      nearest = FewStarts::parameter(i);
    }
    return nearest;
  }

  /// One Newton run, if any is left. True if it found the point.
  bool run(LimitCellId cell, const Vec3& start, const Vec3& point, InversionResult& best,
           Patience patience = Patience::kLong) noexcept {
    if (runs_left == 0) return false;
    --runs_left;
    const NewtonResult found = newton_in_cell(evaluator, cell, start, point, acceptance, patience);
    best.newton_steps += found.steps;
    if (found.residual_mm >= best.residual_mm) return false;
    best.at = {cell, found.uvw};
    best.residual_mm = found.residual_mm;
    return found.accepted;
  }

  /// Runs Newton's method from several of the 64 interior starts of a cell, the nearest first.
  bool search_thoroughly(LimitCellId cell, const Vec3& point, InversionResult& best) noexcept {
    std::array<std::pair<double, std::size_t>, ManyStarts::kCount> starts;
    if (runs_left == 0) return false;
    const ManyStarts::Places& places = many_starts.of(cell, evaluator);
    for (std::size_t i = 0; i < places.size(); ++i) starts[i] = {(places[i] - point).squaredNorm(), i};
    std::partial_sort(starts.begin(), starts.begin() + kThoroughStarts, starts.end());
    for (std::size_t i = 0; i < kThoroughStarts; ++i) {
      if (run(cell, ManyStarts::parameter(starts[i].second), point, best)) return true;
    }
    return false;
  }

  /// Follows what was found along a side of its cell to the foot of the perpendicular from the point. False if that
  /// isn't on the side, or the point lies on the cell's side of it. REQUIRES: the cell doesn't fold.
  bool drop_perpendicular(const Vec3& point, int side, InversionResult& found) noexcept {
    const int axis = side / 2, along_s = (axis + 1) % 3, along_t = (axis + 2) % 3;
    Vec3& uvw = found.at.uvw;
    const double accept_mm = acceptance.in_cell(found.at.cell);
    uvw[axis] = side % 2;
    for (int step = 0; step < kFootSteps; ++step) {
      const LimitSample sample = evaluator.sample(found.at);
      const Vec3 residual = point - sample.position;
      Eigen::Matrix<double, 3, 2> tangents;
      tangents << sample.jacobian.col(along_s), sample.jacobian.col(along_t);
      const Eigen::Vector2d next = (tangents.transpose() * tangents).inverse() * (tangents.transpose() * residual);
      found.residual_mm = residual.norm();
      if ((tangents * next).norm() <= accept_mm) {
        const double along_axis = tangents.col(0).cross(tangents.col(1)).dot(residual);
        return side % 2 == 1 ? along_axis > 0 : along_axis < 0;
      }
      uvw[along_s] += next[0];
      uvw[along_t] += next[1];
      ++found.newton_steps;
      if (!((uvw.array() >= 0).all() && (uvw.array() <= 1).all())) return false;
    }
    return false;
  }

  /// How far from a cell the foot of the perpendicular is the answer.
  double just_outside_mm(LimitCellId cell) const noexcept {
    const double of_cell = kJustOutsideOfCell * index.cell_maps[cell].thickness_mm();
    return std::min({options.outside_mm, kJustOutside * options.accept_mm, of_cell});
  }

  /// From where a hint led to: if that is a face of the boundary just below the point, the foot of the perpendicular is
  /// the answer, or else what one of the cells holds that the point may lie in by their maps: a part may touch itself.
  /// False also if one of them is nearer than the foot, across a slit.
  bool end_just_outside(const Vec3& point, InversionResult& best) noexcept {
    const double most = just_outside_mm(best.at.cell);
    if (!(best.residual_mm <= most)) return false;
    const unsigned sides = sides_at(best.at.uvw);
    if (!std::has_single_bit(sides) || !(sides & solid.boundary_sides(best.at.cell))) return false;
    InversionResult foot = best;
    if (!drop_perpendicular(point, std::countr_zero(sides), foot) || !(foot.residual_mm <= most)) return false;
    foot.full = true;
    collect(point, options.outside_mm, CandidateOrder::kNearest,
            [&](LimitCellId cell) { return cell != foot.at.cell; });
    for (const Candidate& c : candidates) {
      if (c.distance > kFarthestOfCell) break;
      InversionResult other = foot;
      if (run(c.cell, c.start, point, other, Patience::kQuick)) return best = other, true;
      if (other.residual_mm < foot.residual_mm - acceptance.in_cell(c.cell)) return false;
      foot.newton_steps = other.newton_steps;
    }
    best = foot;
    return true;
  }

  /// The place of the cell that is nearest to a point which it doesn't hold, if that is nearer than the best one.
  void settle_in(LimitCellId cell, const Vec3& start, const Vec3& point, InversionResult& best) noexcept {
    const NewtonResult found = nearest_in_cell(evaluator, cell, start, point, acceptance);
    best.newton_steps += found.steps;
    if (found.residual_mm >= best.residual_mm) return;
    best.at = {cell, found.uvw};
    best.residual_mm = found.residual_mm;
  }

  /// For a point that no cell was found to hold: from where runs got stuck beside the boundary on to the nearest place,
  /// in the best cell and in the first candidates besides. Those that are ruled out count among the first, so that
  /// proofs change nothing.
  /// REQUIRES: candidates that weren't ruled out know where their runs ended.
  InversionResult settle(const Vec3& point, InversionResult best) noexcept {
    if (best.residual_mm <= acceptance.in_cell(best.at.cell)) return best;
    const double most_mm = kNearOutside * options.outside_mm;
    if (!(best.residual_mm <= most_mm)) return best;
    const LimitCellId cell = best.at.cell;
    settle_in(cell, Vec3(best.at.uvw), point, best);
    const std::size_t count = std::min(candidates.size(), kMostSettled);
    for (const Candidate& c : std::span(candidates).first(count)) {
      if (c.cell != cell && !c.ruled_out && c.distance <= most_mm) settle_in(c.cell, c.start, point, best);
    }
    return best;
  }

  InversionResult search(const Vec3& point, InversionResult best) noexcept {
    collect(point, options.outside_mm, CandidateOrder::kNearest, [](std::uint32_t) { return true; });
    return search_candidates(point, best);
  }

  bool is_ruled_out(const Candidate& c, const Vec3& point) noexcept {
    return distance && distance->exceeds(c.cell, point, options.outside_mm + acceptance.least_mm());
  }

  /// Searches the candidates, nearest first. One that is ruled out would yield nothing: leaving it out changes nothing
  /// but the time.
  InversionResult search_candidates(const Vec3& point, InversionResult best) noexcept {
    best.full = true;
    for (Candidate& c : candidates) {
      c.ruled_out = c.distance > kDoubtful && is_ruled_out(c, point);
      if (c.ruled_out) continue;
      InversionResult own;
      own.residual_mm = std::numeric_limits<double>::infinity();
      const bool found = run(c.cell, c.start, point, own, Patience::kQuick);
      c.distance = own.residual_mm;
      c.start = own.at.uvw;
      const int steps = best.newton_steps + own.newton_steps;
      if (own.residual_mm < best.residual_mm) best = own;
      best.newton_steps = steps;
      best.full = true;
      if (found) return best;
    }
    if (distance) {
      for (Candidate& c : candidates) c.ruled_out = c.ruled_out || is_ruled_out(c, point);
    }
    // A point just outside lies near the face that holds its nearest parameter: cells far from it needn't be looked at
    // again. That near to any other face the cell behind it holds the point, and is looked at again: beside a singular
    // line it may have been given up too quickly.
    const bool just_outside = best.residual_mm <= options.outside_mm && is_on_boundary(solid, best.at);
    for (const Candidate& c : candidates) {
      if (c.ruled_out || (just_outside && c.distance > kNearOutside * options.outside_mm)) continue;
      if (run(c.cell, nearest_start(c.cell, point), point, best)) return best;
    }
    if (best.residual_mm <= options.outside_mm) return settle(point, best);
    for (const Candidate& c : candidates) {
      if (!c.ruled_out && search_thoroughly(c.cell, point, best)) return best;
    }
    return settle(point, best);
  }

  bool folds(LimitCellId cell) const noexcept {
    return std::binary_search(index.fold_cells.begin(), index.fold_cells.end(), cell);
  }

  /// REQUIRES: the point is near folds.
  bool may_hold(LimitCellId cell, const Vec3& point, double margin_mm) const noexcept {
    const CellMap map = index.cell_maps[cell];
    const Vec3 margin = margin_mm * map.inverse_jacobian.cwiseAbs().rowwise().sum();
    return index.hulls_near_folds.may_hold(cell, map(point), margin);
  }

  /// Calls search() unless the cell is proved not to hold the point, and makes the proof closer if that finds nothing.
  /// A search that is left out takes as many runs from those that are left, so that it changes no answer.
  template <typename Search>
  bool search_unless_off(LimitCellId cell, const Vec3& point, int runs, Search search) noexcept {
    if (runs_left == 0) return false;
    if (!parts->may_hold(cell, point)) {
      runs_left = std::max(0, runs_left - runs);
      return false;
    }
    if (search()) return true;
    parts->refine(cell, point);
    return false;
  }

  /// A cell that doesn't fold has one parameter for a point: its map's guess leads there, or the nearest start does.
  bool search_near_folds(const Candidate& c, const Vec3& point, InversionResult& best) noexcept {
    const bool may_fold = folds(c.cell);
    const int runs = may_fold ? 1 + static_cast<int>(kThoroughStarts) : 2;
    return search_unless_off(c.cell, point, runs, [&] {
      if (!may_fold && run(c.cell, c.start, point, best, Patience::kQuick)) return true;
      if (run(c.cell, nearest_start(c.cell, point), point, best)) return true;
      return may_fold && search_thoroughly(c.cell, point, best);
    });
  }

  /// Near folds, among the cells from `from` to below `below` that may hold the point. Leaves those below `below` as
  /// candidates.
  bool find_lowest(const Vec3& point, std::uint32_t from, std::uint32_t below, InversionResult& best) noexcept {
    const double margin_mm = acceptance.most_mm();
    collect(point, margin_mm, CandidateOrder::kLowestCell,
            [&](LimitCellId cell) { return cell < below && may_hold(cell, point, margin_mm); });
    return std::ranges::any_of(candidates,
                               [&](const Candidate& c) { return c.cell >= from && search_near_folds(c, point, best); });
  }

  /// Near folds: candidates that don't fold, as thoroughly as those that do.
  bool search_unfolded(const Vec3& point, InversionResult& best) noexcept {
    return std::ranges::any_of(candidates, [&](const Candidate& c) {
      if (folds(c.cell)) return false;
      return search_unless_off(c.cell, point, kThoroughStarts, [&] { return search_thoroughly(c.cell, point, best); });
    });
  }

  /// Near folds, for a point that no cell holds: the nearest of those that come within `outside_mm`. Where cells are
  /// smaller than that, they may be too many to be searched: then the nearest come first, by their maps.
  InversionResult search_near(const Vec3& point, InversionResult best) noexcept {
    collect(point, options.outside_mm, CandidateOrder::kNearest,
            [&](LimitCellId cell) { return may_hold(cell, point, options.outside_mm); });
    if (candidates.size() <= kAllSearched) std::ranges::sort(candidates, {}, &Candidate::cell);
    runs_left = kMaxNewtonRuns;
    const auto search = [&](const Candidate& c) { return search_near_folds(c, point, best); };
    if (!std::ranges::any_of(candidates, search)) search_unfolded(point, best);
    return best;
  }

  /// Near folds. A cell that the hint leads to bounds the search. If that cell folds, it is searched without the hint,
  /// which is followed only if nothing is found.
  InversionResult search_lowest_cell(const Vec3& point, const std::optional<CellParam>& hint,
                                     InversionResult best) noexcept {
    const bool hint_folds = hint && folds(hint->cell);
    const auto follow = [&](InversionResult& bound) { return run(hint->cell, hint->uvw, point, bound); };
    InversionResult bound = best;
    if (hint_folds) --runs_left;  // For the hint, at the end.
    bool bounded = hint && !hint_folds && follow(bound);
    best.full = true;
    const std::uint32_t end = solid.cell_count(), first = bounded ? hint->cell : hint_folds ? hint->cell + 1 : end;
    if (find_lowest(point, 0, first, best)) return best;
    if (hint_folds) {
      ++runs_left;
      bounded = follow(bound);
    }
    if (bounded) return bound;
    if (first < end && find_lowest(point, first, end, best)) return best;
    if (search_unfolded(point, best)) return best;
    return options.outside_mm > acceptance.most_mm() ? search_near(point, best) : best;
  }

  /// Where separate parts overlap: the same point in a part before that of `found`, if any holds it.
  InversionResult prefer_lower_part(const Vec3& point, const InversionResult& found) noexcept {
    const std::uint32_t part = index.parts[found.at.cell];
    if (part == 0) return found;
    InversionResult lower = found;
    lower.residual_mm = std::numeric_limits<double>::infinity();
    collect(point, acceptance.most_mm(), CandidateOrder::kLowestPart,
            [&](LimitCellId cell) { return index.parts[cell] < part; });
    for (const Candidate& c : candidates) {
      const auto search = [&] {
        return run(c.cell, c.start, point, lower) || run(c.cell, nearest_start(c.cell, point), point, lower);
      };
      if (search_unless_off(c.cell, point, 2, search)) return lower;
    }
    return found;
  }

  std::optional<InversionResult> invert(const Vec3& point, const std::optional<CellParam>& hint) noexcept {
    InversionResult best;
    best.residual_mm = std::numeric_limits<double>::infinity();
    runs_left = kMaxNewtonRuns;
    if (index.fold_boxes.any_at(point, options.outside_mm)) {
      best = search_lowest_cell(point, hint, best);
    } else if (!hint || distance_from_cell(index.cell_maps[hint->cell](point)) > kFarFromCell ||
               !run(hint->cell, hint->uvw, point, best, Patience::kQuick)) {
      if (!end_just_outside(point, best)) best = search(point, best);
    }
    return accept(point, best);
  }

  std::optional<InversionResult> accept(const Vec3& point, const InversionResult& best) noexcept {
    if (!(best.residual_mm <= options.outside_mm)) return std::nullopt;
    return index.overlap_boxes.any_at(point, options.outside_mm) ? prefer_lower_part(point, best) : best;
  }

  /// Sorts the points of a batch by the cells that they probably are in. Those that are in none are left out.
  void locate(std::span<const Vec3> points, const CancellationToken& cancel) {
    located.clear();
    kept.clear();
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      cancel.throw_if_cancelled();
      collect(points[p], options.outside_mm, CandidateOrder::kNearest, [](std::uint32_t) { return true; });
      if (candidates.empty()) continue;
      const bool keeps = kept.size() + candidates.size() <= kMostKept;
      located.push_back({p, candidates.front().cell, static_cast<std::uint32_t>(kept.size()),
                         static_cast<std::uint32_t>(candidates.size()), keeps});
      if (keeps) kept.insert(kept.end(), candidates.begin(), candidates.end());
    }
    std::ranges::sort(located, {}, [](const Located& l) { return std::pair(l.cell, l.point); });
  }

  std::optional<InversionResult> invert_located(const Vec3& point, const Located& place) noexcept {
    if (!place.is_kept || index.fold_boxes.any_at(point, options.outside_mm)) return invert(point, {});
    InversionResult best;
    best.residual_mm = std::numeric_limits<double>::infinity();
    runs_left = kMaxNewtonRuns;
    candidates.assign(kept.begin() + place.first, kept.begin() + place.first + place.count);
    return accept(point, search_candidates(point, best));
  }
};

PointInverter::PointInverter(const LimitSolid& solid, const InversionOptions& options)
    : state_(std::make_unique<State>(solid, options)) {}
PointInverter::~PointInverter() = default;
PointInverter::PointInverter(PointInverter&&) noexcept = default;
PointInverter& PointInverter::operator=(PointInverter&&) noexcept = default;

LimitEvaluator& PointInverter::evaluator() noexcept { return state_->evaluator; }

std::optional<InversionResult> PointInverter::invert(const Vec3& point, const std::optional<CellParam>& hint) noexcept {
  return state_->invert(point, hint);
}

void PointInverter::invert(std::span<const Vec3> points, const OnFound& on_found, const CancellationToken& cancel) {
  state_->locate(points, cancel);
  for (const Located& place : state_->located) {
    cancel.throw_if_cancelled();
    if (const auto found = state_->invert_located(points[place.point], place)) on_found(place.point, *found);
  }
}

}  // namespace ccslice
