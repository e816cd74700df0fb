// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/cell_candidates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr unsigned kCandidateSeed = 5;

class CellCandidates : public testing::Test {
 protected:
  /// As many as there is room for.
  std::vector<Candidate> collect(const Vec3& point, double margin_mm, CandidateOrder order, std::size_t room = 1000) {
    std::vector<Candidate> candidates;
    candidates.reserve(room);
    collect_candidates(
        solid_->index(), point, margin_mm, order, [](LimitCellId) { return true; }, candidates);
    return candidates;
  }
  Vec3 point_in(LimitCellId cell) {
    std::uniform_real_distribution<double> u(0, 1);
    return LimitEvaluator(*solid_).geo({cell, Vec3(u(random_), u(random_), u(random_))});
  }

  std::shared_ptr<const LimitSolid> solid_ = prepare_solid(oracle::tiny_mesh("hollow_cube"));
  std::mt19937 random_{kCandidateSeed};
};

TEST_F(CellCandidates, HaveTheCellThatHoldsThePoint) {
  for (const LimitCellId cell : solid_->cells()) {
    const std::vector<Candidate> found = collect(point_in(cell), 0, CandidateOrder::kNearest);
    const auto its_own = std::ranges::find(found, cell, &Candidate::cell);
    ASSERT_NE(its_own, found.end()) << cell;
    EXPECT_GE(its_own->start.minCoeff(), 0.1);
    EXPECT_LE(its_own->start.maxCoeff(), 0.9);
  }
}

TEST_F(CellCandidates, ComeInOrder) {
  const Vec3 point = point_in(LimitCellId{0});
  const double all_mm = solid_->summary().bounding_box.diagonal().norm();
  const std::vector<Candidate> nearest = collect(point, all_mm, CandidateOrder::kNearest),
                               lowest = collect(point, all_mm, CandidateOrder::kLowestCell);
  EXPECT_EQ(nearest.size(), solid_->cell_count());
  EXPECT_EQ(lowest.size(), solid_->cell_count());
  EXPECT_TRUE(std::ranges::is_sorted(nearest, {}, &Candidate::distance));
  EXPECT_TRUE(std::ranges::is_sorted(lowest, {}, &Candidate::cell));
}

TEST_F(CellCandidates, AreTheFirstIfThereIsRoomForFew) {
  const Vec3 point = point_in(LimitCellId{3});
  const double all_mm = solid_->summary().bounding_box.diagonal().norm();
  for (const CandidateOrder order : {CandidateOrder::kNearest, CandidateOrder::kLowestCell}) {
    const std::vector<Candidate> all = collect(point, all_mm, order), few = collect(point, all_mm, order, 7);
    ASSERT_EQ(few.size(), 7u);
    for (std::size_t i = 0; i < few.size(); ++i) EXPECT_EQ(few[i].cell, all[i].cell) << i;
  }
}

TEST_F(CellCandidates, OfTheLowestPartComeFirst) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  oracle::append_mesh(mesh, oracle::box_mesh(2, 2, 2), Vec3(5, 5, 5));
  solid_ = prepare_solid(mesh);
  const double all_mm = solid_->summary().bounding_box.diagonal().norm();
  const std::vector<Candidate> found = collect(Vec3(20, 20, 20), all_mm, CandidateOrder::kLowestPart);
  const auto part = [&](const Candidate& c) { return solid_->index().parts[c.cell]; };
  ASSERT_EQ(found.size(), solid_->cell_count());
  EXPECT_TRUE(std::ranges::is_sorted(found, {}, part));
  EXPECT_NE(part(found.front()), part(found.back()));
}

}  // namespace
}  // namespace ccslice
