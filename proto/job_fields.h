// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// PlanSlicesRequest and SliceRangeRequest describe a job by fields of the same names. A plan that left one of them out
// would be of another job.

#pragma once

#include "ccslice/v1/slice.pb.h"

namespace ccslice {

/// Copies every field that both have. tests/server/job_fields_test.cpp looks for forgotten ones.
inline void copy_job_fields(const v1::PlanSlicesRequest& plan, v1::SliceRangeRequest& slices) {
  slices.set_mesh_id(plan.mesh_id());
  if (plan.has_placement()) *slices.mutable_placement() = plan.placement();
  if (plan.has_grid()) *slices.mutable_grid() = plan.grid();
  *slices.mutable_planes() = plan.planes();
  if (plan.has_contour_tolerance_mm()) slices.set_contour_tolerance_mm(plan.contour_tolerance_mm());
  if (plan.has_material_tolerance()) slices.set_material_tolerance(plan.material_tolerance());
  slices.set_prove_materials(plan.prove_materials());
  if (plan.has_printer()) *slices.mutable_printer() = plan.printer();
  if (plan.has_printing()) *slices.mutable_printing() = plan.printing();
  if (plan.has_region()) *slices.mutable_region() = plan.region();
  if (plan.has_layout()) *slices.mutable_layout() = plan.layout();
}

}  // namespace ccslice
