// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Printer profiles: messages <-> values of the core, and what a plan warns of. Pure.

#pragma once

#include "ccslice/v1/slice.pb.h"
#include "core/job/printer_profile.h"
#include "core/job/slice_job.h"

namespace ccslice::server {

/// The profile of that name, or the client's own. Throws ServiceError{kPrinterUnknown, kPrinterInvalid}.
PrinterProfile to_printer(const v1::PrinterProfile& message);

v1::PrinterProfile to_message(const PrinterProfile& value);

/// The grid with the printer's pitch, unless it has one of its own.
v1::GridSpec with_printer_pitch(const v1::GridSpec& grid, const PrinterProfile& printer);

/// Too many materials, too few layers, a part larger than the tray, another pitch than the printer's.
void warn_of_printer(const SliceJob& job, const PrinterProfile& printer, v1::PlanSlicesResponse& plan);

}  // namespace ccslice::server
