// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/printer.h"

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/choice_text.h"
#include "core/base/echo.h"
#include "core/base/number_text.h"
#include "server/rpc/convert/plan_warning.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

constexpr double kSamePitch = 1e-3;  // Relative: names round 25.4 mm / 600.
constexpr int kDigits = 4;

/// Of a printer that is known.
void refuse_details(const v1::PrinterProfile& message) {
  if (!message.has_pitch() && !message.has_tray_mm() && message.max_materials() == 0 && message.min_layers() == 0 &&
      message.smallest_feature_mm() == 0)
    return;
  throw ServiceError(
      ServiceErrorCode::kPrinterInvalid,
      "printer: \"" + echoed(message.name()) + "\" is known; give its name alone, or another name to your own",
      "printer");
}

PrinterProfile described_printer(const v1::PrinterProfile& message) {
  PrinterProfile printer{message.name().empty() ? "the printer" : echoed(message.name()),
                         message.title(),
                         {},
                         Vec3::Zero(),
                         message.max_materials(),
                         message.min_layers(),
                         message.smallest_feature_mm()};
  if (!(printer.smallest_feature_mm >= 0) || !std::isfinite(printer.smallest_feature_mm)) {
    throw ServiceError(ServiceErrorCode::kPrinterInvalid,
                       "printer.smallest_feature_mm: negative or not finite; leave it out for two voxels",
                       "printer.smallest_feature_mm");
  }
  printer.pitch = {message.pitch().x_mm(), message.pitch().y_mm(), message.pitch().z_mm()};
  printer.tray_mm = Vec3(message.tray_mm().x(), message.tray_mm().y(), message.tray_mm().z());
  if ((printer.tray_mm.array() >= 0).all() && printer.tray_mm.allFinite()) return printer;
  throw ServiceError(ServiceErrorCode::kPrinterInvalid,
                     "printer.tray_mm: negative or not finite; leave it out for no bound", "printer.tray_mm");
}

std::string show(const VoxelPitch& pitch) {
  return number_text(pitch.x_mm, kDigits) + " x " + number_text(pitch.y_mm, kDigits) + " x " +
         number_text(pitch.z_mm, kDigits) + " mm";
}

bool same(double a, double b) { return std::abs(a - b) <= kSamePitch * b; }

void warn_of_pitch(const VoxelPitch& pitch, const PrinterProfile& printer, v1::PlanSlicesResponse& plan) {
  const VoxelPitch& own = printer.pitch;
  if (same(pitch.x_mm, own.x_mm) && same(pitch.y_mm, own.y_mm) && same(pitch.z_mm, own.z_mm)) return;
  const std::string fault = "the pitch is " + show(pitch) + ", that of " + printer.name + " " + show(own);
  if (same(pitch.x_mm, own.y_mm) && same(pitch.y_mm, own.x_mm)) {
    add_warning(plan, v1::PLAN_WARNING_KIND_AXES_MIXED_UP, fault + ": x and y are mixed up; swap them");
  } else {
    add_warning(plan, v1::PLAN_WARNING_KIND_PRINTER_PITCH,
                fault + ": the part will come out distorted; leave out grid.pitch");
  }
}

}  // namespace

PrinterProfile to_printer(const v1::PrinterProfile& message) {
  if (const PrinterProfile* known = find_printer_profile(message.name())) {
    refuse_details(message);
    return *known;
  }
  if (message.has_pitch()) return described_printer(message);
  if (message.name().empty()) {
    throw ServiceError(ServiceErrorCode::kPrinterInvalid,
                       "printer.pitch: missing; name a printer that the server knows, or say how large the voxels are",
                       "printer.pitch");
  }
  throw ServiceError(ServiceErrorCode::kPrinterUnknown,
                     "printer.name: there is no profile \"" + echoed(message.name()) + "\"; ask for " +
                         choice_text(printer_profiles()) + ", or give the pitch of your own",
                     "printer.name");
}

v1::PrinterProfile to_message(const PrinterProfile& value) {
  v1::PrinterProfile message;
  message.set_name(value.name);
  message.set_title(value.title);
  *message.mutable_pitch() = to_message(value.pitch);
  *message.mutable_tray_mm() = to_message(value.tray_mm);
  message.set_max_materials(value.max_materials);
  message.set_min_layers(value.min_layers);
  message.set_smallest_feature_mm(value.smallest_feature_mm);
  return message;
}

void warn_of_printer(const SliceJob& job, const PrinterProfile& printer, v1::PlanSlicesResponse& plan) {
  const int materials = job.printing ? std::popcount(printed_materials(*job.printing)) : 0;
  if (printer.max_materials > 0 && materials > static_cast<int>(printer.max_materials)) {
    add_warning(plan, v1::PLAN_WARNING_KIND_TOO_MANY_MATERIALS,
                std::to_string(materials) + " materials are more than the " + std::to_string(printer.max_materials) +
                    " that " + printer.name + " takes; leave some out");
  }
  const std::uint32_t layers = region_of(job).extent.layers;
  if (layers < printer.min_layers) {
    add_warning(plan, v1::PLAN_WARNING_KIND_TOO_FEW_LAYERS,
                std::to_string(layers) + " layers are fewer than the " + std::to_string(printer.min_layers) + " that " +
                    printer.name + " takes; scale the part, or give the grid or its region more layers");
  }
  const Vec3 size = job.grid.part_box.sizes(), &tray = printer.tray_mm;
  if (((size.array() > tray.array()) && (tray.array() > 0)).any()) {
    add_warning(plan, v1::PLAN_WARNING_KIND_LARGER_THAN_TRAY,
                "the part takes " + number_text(size.x(), kDigits) + " x " + number_text(size.y(), kDigits) + " x " +
                    number_text(size.z(), kDigits) + " mm, the tray of " + printer.name + " is " +
                    number_text(tray.x(), kDigits) + " x " + number_text(tray.y(), kDigits) + " x " +
                    number_text(tray.z(), kDigits) + " mm; turn, scale or split the part");
  }
  warn_of_pitch(job.grid.pitch, printer, plan);
}

}  // namespace ccslice::server
