// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The subdivision rules of brute_force.h, one function a kind of item.

#pragma once

#include <vector>

#include "tests/support/brute_force.h"

namespace ccslice::oracle {

/// Points of the refined mesh: vertex points, then edge points, face points, cell points. NaN for incomplete items.
std::vector<double> refined_points(const BruteMesh& mesh, const BruteTopology& topology);

}  // namespace ccslice::oracle
