// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/vertex_system.h"

#include <Eigen/IterativeLinearSolvers>

#include "core/subdivision/limit_masks.h"

namespace ccslice {

namespace {

constexpr double kSolved = 1e-11;  // Residual, as a share of the right side's norm.
// What moves control points by much more than limits is a component that hardly shows in the limit.
constexpr double kMostAmplified = 100;
constexpr int kMostSteps = 100, kMostLeastSquaresSteps = 5000;

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;
using Entries = std::vector<Eigen::Triplet<double>>;

Matrix matrix_of(std::size_t rows, std::size_t columns, const Entries& entries) {
  Matrix matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Calls solve(column) for one after the other.
template <typename Solve>
Eigen::MatrixXd solve_columns(const Eigen::MatrixXd& right, const CancellationToken& cancel, Solve solve) {
  Eigen::MatrixXd result(right.rows(), right.cols());
  for (Eigen::Index c = 0; c < right.cols(); ++c) {
    cancel.throw_if_cancelled();
    result.col(c) = solve(Vector(right.col(c)));
  }
  return result;
}

Eigen::MatrixXd solve_masks(const Matrix& masks, const Eigen::MatrixXd& right, const CancellationToken& cancel) {
  if (masks.rows() == 0) return right;
  Eigen::BiCGSTAB<Matrix> solver;
  solver.setTolerance(kSolved);
  solver.setMaxIterations(kMostSteps);
  solver.compute(masks);
  return solve_columns(right, cancel, [&](const Vector& column) -> Vector {
    const Vector solved = solver.solve(column);
    if (solver.info() == Eigen::Success && solved.norm() <= kMostAmplified * column.norm()) return solved;
    // Started from zero, conjugate gradients never leave the span of the matrix's rows, so that they end at the
    // solution with the smallest moves. A preconditioner would measure moves by other weights.
    Eigen::LeastSquaresConjugateGradient<Matrix, Eigen::IdentityPreconditioner> least_squares;
    least_squares.setTolerance(kSolved);
    least_squares.setMaxIterations(kMostLeastSquaresSteps);
    least_squares.compute(masks);
    return least_squares.solve(column);
  });
}

/// Symmetric and diagonally dominant, strictly in rows with an edge to the boundary, which edges lead to from every
/// vertex inside: so it is positive definite, as conjugate gradients require.
Eigen::MatrixXd solve_graph(const Matrix& graph, const Eigen::MatrixXd& right, const CancellationToken& cancel) {
  if (graph.rows() == 0) return right;
  Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(kSolved);
  solver.compute(graph);
  return solve_columns(right, cancel, [&](const Vector& column) -> Vector { return solver.solve(column); });
}

Eigen::MatrixXd rows_of(const Eigen::MatrixXd& values, const std::vector<std::uint32_t>& vertices) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(vertices.size()), values.cols());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = values.row(vertices[static_cast<std::size_t>(i)]);
  return rows;
}

}  // namespace

VertexSystem::VertexSystem(const CellComplex& complex, const CancellationToken& cancel) : cancel_(cancel) {
  number(complex);
  build_masks(complex);
  build_graph(complex);
}

void VertexSystem::number(const CellComplex& complex) {
  surface_from_.assign(complex.vertex_count(), kNone);
  inside_from_.assign(complex.vertex_count(), kNone);
  for (const VertexId v : complex.vertices()) {
    const bool surface = complex.vertex_on_boundary(v);
    std::vector<std::uint32_t>& vertices = surface ? surface_ : inside_;
    (surface ? surface_from_ : inside_from_)[v] = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(v);
  }
}

void VertexSystem::build_masks(const CellComplex& complex) {
  const Stencils masks = limit_masks(complex, cancel_);
  Entries surface, inside, inside_surface;
  for (std::uint32_t v = 0; v < masks.rows(); ++v) {
    for (std::uint32_t e = masks.offsets[v]; e < masks.offsets[v + 1]; ++e) {
      const std::uint32_t w = masks.indices[e];
      if (on_boundary(v)) {
        surface.emplace_back(surface_from_[v], surface_from_[w], masks.weights[e]);
      } else if (on_boundary(w)) {
        inside_surface.emplace_back(inside_from_[v], surface_from_[w], masks.weights[e]);
      } else {
        inside.emplace_back(inside_from_[v], inside_from_[w], masks.weights[e]);
      }
    }
  }
  masks_surface_ = matrix_of(surface_.size(), surface_.size(), surface);
  masks_inside_ = matrix_of(inside_.size(), inside_.size(), inside);
  masks_inside_surface_ = matrix_of(inside_.size(), surface_.size(), inside_surface);
}

/// A row says that a vertex moves by the mean of the moves around it: over its edges, its own move less the other end's
/// adds up to 0.
void VertexSystem::build_graph(const CellComplex& complex) {
  Entries inside, inside_surface;
  for (const std::uint32_t v : inside_) {
    const std::uint32_t row = inside_from_[v];
    const auto edges = complex.vertex_edges(VertexId{v});
    inside.emplace_back(row, row, static_cast<double>(edges.size()));
    for (const EdgeId e : edges) {
      const VertexId w = complex.edge_other(e, VertexId{v});
      on_boundary(w) ? inside_surface.emplace_back(row, surface_from_[w], -1.0)
                     : inside.emplace_back(row, inside_from_[w], -1.0);
    }
  }
  graph_inside_ = matrix_of(inside_.size(), inside_.size(), inside);
  graph_inside_surface_ = matrix_of(inside_.size(), surface_.size(), inside_surface);
}

VertexSystem::Values VertexSystem::join(const Values& surface, const Values& inside) const {
  Values values(static_cast<Eigen::Index>(surface_.size() + inside_.size()), surface.cols());
  for (std::size_t i = 0; i < surface_.size(); ++i) values.row(surface_[i]) = surface.row(static_cast<Eigen::Index>(i));
  for (std::size_t i = 0; i < inside_.size(); ++i) values.row(inside_[i]) = inside.row(static_cast<Eigen::Index>(i));
  return values;
}

VertexSystem::Values VertexSystem::limits(const Values& points) const {
  const Values surface = rows_of(points, surface_), inside = rows_of(points, inside_);
  return join(masks_surface_ * surface, masks_inside_ * inside + masks_inside_surface_ * surface);
}

VertexSystem::Values VertexSystem::solve_surface(const Values& moves) const {
  return solve_masks(masks_surface_, rows_of(moves, surface_), cancel_);
}

/// Limits inside depend on control points inside and on the boundary, S_ii P_i + S_ib P_b = L_i. P_b is known first.
VertexSystem::Values VertexSystem::solve(const Values& moves) const {
  const Values surface = solve_surface(moves);
  return join(surface, solve_masks(masks_inside_, rows_of(moves, inside_) - masks_inside_surface_ * surface, cancel_));
}

VertexSystem::Values VertexSystem::solve_boundary(const Values& moves) const {
  const Values surface = solve_surface(moves);
  return join(surface, solve_graph(graph_inside_, -graph_inside_surface_ * surface, cancel_));
}

}  // namespace ccslice
