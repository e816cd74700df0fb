// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/mid_node_places.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

constexpr std::size_t kFree = std::numeric_limits<std::size_t>::max();

template <typename Places>
Vec3 mean_of(std::span<const Vec3> points, const Places& places) {
  Vec3 sum = Vec3::Zero();
  for (const auto place : places) sum += points[place];
  return sum / static_cast<double>(places.size());
}

/// The method by rows: each row in turn gets a column along a path of least reduced costs, on which others move on.
class RowsToColumns {
 public:
  explicit RowsToColumns(const Eigen::MatrixXd& costs)
      : costs_(costs), of_row_(rows(), 0), of_column_(columns(), 0), row_of_(columns(), kFree) {}

  std::vector<std::size_t> result() {
    for (std::size_t row = 0; row < rows(); ++row) add(row);
    std::vector<std::size_t> column_of(rows());
    for (std::size_t column = 0; column < columns(); ++column) {
      if (row_of_[column] != kFree) column_of[row_of_[column]] = column;
    }
    return column_of;
  }

 private:
  std::size_t rows() const { return static_cast<std::size_t>(costs_.rows()); }
  std::size_t columns() const { return static_cast<std::size_t>(costs_.cols()); }
  double cost(std::size_t row, std::size_t column) const {
    return costs_(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) - of_row_[row] -
           of_column_[column];
  }

  void add(std::size_t new_row) {
    std::vector<double> least(columns(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> before(columns(), kFree);  // The column from which the path comes.
    std::vector<bool> done(columns(), false);
    std::size_t row = new_row, at = kFree;
    while (row != kFree) {
      std::size_t next = kFree;
      for (std::size_t column = 0; column < columns(); ++column) {
        if (done[column]) continue;
        if (cost(row, column) < least[column]) {
          least[column] = cost(row, column);
          before[column] = at;
        }
        if (next == kFree || least[column] < least[next]) next = column;
      }
      const double step = least[next];
      of_row_[new_row] += step;
      for (std::size_t column = 0; column < columns(); ++column) {
        if (done[column]) {
          of_row_[row_of_[column]] += step;
          of_column_[column] -= step;
        } else {
          least[column] -= step;
        }
      }
      done[next] = true;
      at = next;
      row = row_of_[next];
    }
    for (; at != kFree; at = before[at]) row_of_[at] = before[at] == kFree ? new_row : row_of_[before[at]];
  }

  const Eigen::MatrixXd& costs_;
  std::vector<double> of_row_, of_column_;  // What is taken off the costs.
  std::vector<std::size_t> row_of_;         // By column.
};

}  // namespace

std::vector<Vec3> middles(CellKind kind, std::span<const Vec3> corners) {
  std::vector<Vec3> found;
  for (const auto& edge : mid_edges(kind)) found.push_back(mean_of(corners, edge));
  for (const auto& face : mid_faces(kind)) found.push_back(mean_of(corners, face));
  if (kind == CellKind::kHex) found.push_back(mean_of(corners, kVtkToBits));
  return found;
}

void bend_middles(CellKind kind, std::span<const Vec3> corners, std::span<const Vec3> of_edges,
                  std::vector<Vec3>& middles) {
  const auto edges = mid_edges(kind);
  std::size_t place = edges.size();
  const auto bend = [&](const auto& of_corners) {
    Vec3 sum = Vec3::Zero();
    double count = 0;
    for (std::size_t edge = 0; edge < edges.size(); ++edge) {
      const auto has = [&](std::uint8_t corner) { return std::ranges::find(of_corners, corner) != of_corners.end(); };
      if (!has(edges[edge][0]) || !has(edges[edge][1])) continue;
      sum += of_edges[edge] - (corners[edges[edge][0]] + corners[edges[edge][1]]) / 2;
      count += 1;
    }
    // Each pair of opposite edges, of a face, or four edges along an axis, of a hexahedron, moves the middle by its
    // mean.
    middles[place++] += sum * (of_corners.size() == 4 ? 2 : 3) / count;
  };
  for (const auto& face : mid_faces(kind)) bend(face);
  if (kind == CellKind::kHex) bend(kVtkToBits);
}

std::vector<std::size_t> cheapest_columns(const Eigen::MatrixXd& costs) { return RowsToColumns(costs).result(); }

}  // namespace ccslice
