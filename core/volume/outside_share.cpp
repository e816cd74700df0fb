// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume/outside_share.h"

#include <cstddef>

#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_sampler.h"

namespace ccslice {

std::vector<double> shares_outside(std::span<const VolumeSource* const> sources, const LimitSolid& solid,
                                   const Placement& placement, const CancellationToken& cancel) {
  std::vector<double> shares(sources.size());
  if (sources.empty()) return shares;
  double all = 0;
  SolidSampler(solid).run([&](LimitEvaluator& evaluator, const CellParam& at, double volume) {
    cancel.throw_if_cancelled();
    const Vec3 mesh = evaluator.geo(at);
    all += volume;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      if (sources[s]->is_outside(placement * mesh, mesh)) shares[s] += volume;
    }
  });
  for (double& share : shares) share = all > 0 ? share / all : 0;
  return shares;
}

}  // namespace ccslice
