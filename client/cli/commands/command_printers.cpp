// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/options/resins.h"
#include "core/job/printer_profile.h"

namespace ccslice::cli {
namespace {

constexpr double kInchMm = 25.4, kMicrometres = 1000;  // The latter: a millimetre has.

std::string describe_profile(const PrinterProfile& profile) {
  std::string text =
      profile.name + ": " + profile.title + "\n  pitch      " + show_number(kMicrometres * profile.pitch.x_mm) + " x " +
      show_number(kMicrometres * profile.pitch.y_mm) + " x " + show_number(kMicrometres * profile.pitch.z_mm) +
      " um, " + show_number(kInchMm / profile.pitch.x_mm) + " x " + show_number(kInchMm / profile.pitch.y_mm) + " dpi";
  if (!profile.tray_mm.isZero()) {
    text += "\n  tray       " + show_size(profile.tray_mm.x(), profile.tray_mm.y(), profile.tray_mm.z()) + " mm";
  }
  if (profile.max_materials > 0) {
    text += "\n  materials  up to " + std::to_string(profile.max_materials) + " at a time";
  }
  if (profile.min_layers > 0) text += "\n  layers     at least " + std::to_string(profile.min_layers);
  return text;
}

v1::Printer document_of_profile(const PrinterProfile& profile) {
  v1::Printer printer;
  printer.set_name(profile.name);
  printer.set_title(profile.title);
  *printer.mutable_pitch_mm() = to_proto(Vec3(profile.pitch.x_mm, profile.pitch.y_mm, profile.pitch.z_mm));
  *printer.mutable_tray_mm() = to_proto(profile.tray_mm);
  printer.set_max_materials(profile.max_materials);
  printer.set_min_layers(profile.min_layers);
  return printer;
}

void run_printers(const Session& session) {
  std::vector<v1::Printer> printers;
  for (const PrinterProfile& profile : printer_profiles()) {
    if (!session.options().json) print_line(describe_profile(profile));
    printers.push_back(document_of_profile(profile));
  }
  if (session.options().json) return print_line(json_list_of(printers));
  print_line("PolyJet resins that need no colour: " + resin_names());
}

}  // namespace

Command add_printers(CLI::App& parent, CommonOptions& common) {
  CLI::App* app = parent.add_subcommand("printers", "List the printers that --printer knows, and resins");
  add_output_options(*app, common);
  app->footer(
      "Figures are as publicly known, not certified by the makers.\n"
      "Example:\n  ccslice slice part.ccmesh --format grabcad --printer j750-hm --material VeroCY-V -o part");
  return {app, [](Session& session) { run_printers(session); }};
}

}  // namespace ccslice::cli
