// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Printer profiles: messages <-> values of the core, and what a plan warns of. Pure.

#pragma once

#include "ccslice/v1/job.pb.h"
#include "ccslice/v1/plan.pb.h"
#include "core/job/printer_profile.h"
#include "core/job/slice_job.h"
#include "server/rpc/convert/convert.h"

namespace ccslice::server {

/// The profile of that name, or the one that the message describes. Throws ServiceError{kPrinterUnknown,
/// kPrinterInvalid}.
PrinterProfile to_printer(const v1::PrinterProfile& message);

v1::PrinterProfile to_message(const PrinterProfile& value);

/// What a job or a halftone asks for of its grid, with the printer's pitch unless it has one of its own. Throws as
/// to_printer() and to_grid_request().
template <typename Message>
GridRequest grid_request_of(const Message& message) {
  v1::GridSpec grid = message.grid();
  if (message.has_printer()) {
    const v1::VoxelPitch pitch = to_message(to_printer(message.printer())).pitch();
    if (!grid.has_pitch()) *grid.mutable_pitch() = pitch;
  }
  return to_grid_request(grid);
}

/// Its grid. `part_box`: of all that is placed. Throws as grid_request_of(), and what plan_grid() throws.
template <typename Message>
Grid to_grid(const Message& message, const Box3& part_box, const SliceLimits& limits) {
  return plan_grid(part_box, grid_request_of(message), limits);
}

/// Too many materials, too few layers, a part larger than the tray, another pitch than the printer's.
void warn_of_printer(const SliceJob& job, const PrinterProfile& printer, v1::PlanSlicesResponse& plan);

}  // namespace ccslice::server
