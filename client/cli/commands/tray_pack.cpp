// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/tray.h"
#include "client/cli/options/part_box.h"
#include "client/cli/tray/pack_tray.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"
#include "core/job/printer_profile.h"

namespace ccslice::cli {
namespace {

struct TrayPackOptions {
  JobOptions job;
  std::string output;
  std::vector<std::string> copies;  // "3", "ring=3".
  double clearance_mm = 2;
  bool force = false;
};

struct Tray {
  std::string name;
  Vec3 size_mm = Vec3::Zero();
  Vec3 pitch_mm = Vec3::Zero();
};

/// A part as it is to lie on the tray, before it is moved there.
struct Copy {
  std::size_t part = 0;
  Placement placement = Placement::Identity();
  Box3 box_mm;
};

Tray tray_of(const v1::SliceJob& job) {
  if (!job.has_printer()) {
    throw UsageError("say whose tray to fill: --printer NAME, or a job with a printer; `ccslice printers` lists them");
  }
  const v1::PrinterProfile& printer = job.printer();
  Tray tray{printer.name(), Vec3(printer.tray_mm().x(), printer.tray_mm().y(), printer.tray_mm().z())};
  if (const PrinterProfile* const known = find_printer_profile(printer.name())) {
    tray.size_mm = known->tray_mm;
    tray.pitch_mm = Vec3(known->pitch.x_mm, known->pitch.y_mm, known->pitch.z_mm);
  } else if (!printer.has_pitch()) {
    throw UsageError("--printer: '" + echoed(printer.name()) +
                     "' is no printer that is known; `ccslice printers` lists "
                     "them");
  }
  for (const v1::VoxelPitch& said : {printer.pitch(), job.grid().pitch()}) {
    if (said.x_mm() > 0 && said.y_mm() > 0) tray.pitch_mm = Vec3(said.x_mm(), said.y_mm(), said.z_mm());
  }
  if (tray.size_mm.x() > 0 && tray.size_mm.y() > 0) return tray;
  throw UsageError("--printer: the size of the tray of '" + echoed(tray.name) +
                   "' isn't known; take another printer, or describe it in the job's file, with tray_mm");
}

/// How often each part is wanted, by --copies.
std::vector<std::optional<std::uint32_t>> parse_copies(const TrayPackOptions& options,
                                                       const std::vector<std::string>& names) {
  std::vector<std::optional<std::uint32_t>> counts(names.size());
  for (const std::string& text : options.copies) {
    const std::size_t sign = text.rfind('=');
    const std::string number = sign == std::string::npos ? text : text.substr(sign + 1);
    std::uint32_t count = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (error != std::errc() || end != number.data() + number.size() || count == 0 || count > kMostPlacements) {
      throw UsageError("--copies takes a number from 1 to " + std::to_string(kMostPlacements) +
                       " for all parts, or NAME=N for one, not '" + echoed(text) + "'");
    }
    bool found = sign == std::string::npos;
    for (std::size_t p = 0; p < names.size(); ++p) {
      if (sign != std::string::npos && names[p] != text.substr(0, sign)) continue;
      counts[p] = count;
      found = true;
    }
    if (found) continue;
    throw UsageError("--copies: there is no part '" + echoed(text.substr(0, sign)) + "'; there are " +
                     echoed_list(names, names.size()));
  }
  return counts;
}

Box3 box_of(Session& session, const v1::Part& part, const Placement& placement) {
  const v1::Box3 box = part_box(session, part.mesh_id(), to_message(placement));
  return {Vec3(box.min_mm().x(), box.min_mm().y(), box.min_mm().z()),
          Vec3(box.max_mm().x(), box.max_mm().y(), box.max_mm().z())};
}

/// All copies of all parts: as the job places them, and further ones as it does from the first on.
std::vector<Copy> copies_of(Session& session, const v1::SliceJob& job, const std::vector<std::string>& names,
                            const std::vector<std::optional<std::uint32_t>>& counts) {
  std::vector<Copy> copies;
  for (std::size_t p = 0; p < names.size(); ++p) {
    const v1::Part& part = job.parts(static_cast<int>(p));
    const std::vector<Placement> placements = placements_of(part, names[p]);
    const std::size_t count = counts[p].value_or(placements.size());
    if (copies.size() + count > kMostPlacements) {
      throw UsageError("--copies: a job has up to " + std::to_string(kMostPlacements) +
                       " parts with all copies; ask for fewer");
    }
    std::vector<Box3> boxes;
    for (std::size_t i = 0; i < std::min(count, placements.size()); ++i) {
      boxes.push_back(box_of(session, part, placements[i]));
    }
    for (std::size_t i = 0; i < count; ++i)
      copies.push_back({p, placements[i % placements.size()], boxes[i % boxes.size()]});
  }
  return copies;
}

std::string size_text(double x, double y) { return show_number(x) + " x " + show_number(y) + " mm"; }

std::string tray_text(const Tray& tray) {
  return "the tray of " + echoed(tray.name) + ", " + size_text(tray.size_mm.x(), tray.size_mm.y());
}

/// Refuses parts that the tray is too small for even if they are alone.
void refuse_large_parts(const Tray& tray, const std::vector<Copy>& copies, const std::vector<std::string>& names) {
  std::vector<std::string> faults;
  std::optional<std::size_t> last;
  for (const Copy& copy : copies) {
    if (last == copy.part) continue;
    const Vec3 size = copy.box_mm.sizes();
    const auto lack = [&](double w, double d) { return std::max({w - tray.size_mm.x(), d - tray.size_mm.y(), 0.0}); };
    const double flat = std::min(lack(size.x(), size.y()), lack(size.y(), size.x()));
    const double high = tray.size_mm.z() > 0 ? std::max(size.z() - tray.size_mm.z(), 0.0) : 0;
    constexpr double kRoundingMm = 1e-9;
    if (flat <= kRoundingMm && high <= kRoundingMm) continue;
    last = copy.part;
    faults.push_back("'" + echoed(names[copy.part]) + "' is " + show_size(size.x(), size.y(), size.z()) + " mm, " +
                     show_number(std::max(flat, high)) + " mm too " + (flat >= high ? "long" : "high"));
  }
  if (faults.empty()) return;
  throw UsageError("no room on " + tray_text(tray) +
                   (tray.size_mm.z() > 0 ? " and " + show_number(tray.size_mm.z()) + " mm high" : "") + ": " +
                   echoed_list(faults, faults.size()) + "; turn parts with --rotate, or take another printer");
}

double whole_steps(double mm, double step_mm) {
  constexpr double kRounding = 1e-9;
  return step_mm > 0 ? std::floor(mm / step_mm + kRounding) * step_mm : mm;
}

/// Places whole voxels apart: they are moved there towards the corner, and one more voxel between parts keeps them
/// apart.
PackedTray packed_by_voxels(const std::vector<Footprint>& footprints, const Tray& tray, double clearance_mm) {
  const double voxel_mm = std::max(tray.pitch_mm.x(), tray.pitch_mm.y());
  PackedTray result = pack_tray(footprints, tray.size_mm.x(), clearance_mm + voxel_mm);
  result.depth_mm = 0;
  for (std::size_t i = 0; i < footprints.size(); ++i) {
    PackedPlace& place = result.places[i];
    place.x_mm = whole_steps(place.x_mm, tray.pitch_mm.x());
    place.y_mm = whole_steps(place.y_mm, tray.pitch_mm.y());
    const double depth_mm = place.turned ? footprints[i].width_mm : footprints[i].depth_mm;
    result.depth_mm = std::max(result.depth_mm, place.y_mm + depth_mm);
  }
  return result;
}

/// `in_whole_voxels`: whether copies lie whole voxels apart, as they do where the tray has room for that.
PackedTray packed(const TrayPackOptions& options, const Tray& tray, const std::vector<Copy>& copies,
                  const std::vector<std::string>& names, bool& in_whole_voxels) {
  refuse_large_parts(tray, copies, names);
  std::vector<Footprint> footprints;
  for (const Copy& copy : copies) footprints.push_back({copy.box_mm.sizes().x(), copy.box_mm.sizes().y()});
  constexpr double kRoundingMm = 1e-9;
  PackedTray result = packed_by_voxels(footprints, tray, options.clearance_mm);
  in_whole_voxels = result.depth_mm <= tray.size_mm.y() + kRoundingMm;
  if (in_whole_voxels) return result;
  result = pack_tray(footprints, tray.size_mm.x(), options.clearance_mm);
  if (result.depth_mm <= tray.size_mm.y() + kRoundingMm) return result;
  std::vector<std::size_t> outside(names.size());
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const Footprint& it = footprints[i];
    const double end = result.places[i].y_mm + (result.places[i].turned ? it.width_mm : it.depth_mm);
    if (end > tray.size_mm.y() + kRoundingMm) ++outside[copies[i].part];
  }
  std::vector<std::string> faults;
  for (std::size_t p = 0; p < names.size(); ++p) {
    if (outside[p] > 0) faults.push_back(std::to_string(outside[p]) + " of '" + echoed(names[p]) + "'");
  }
  throw UsageError("no room on " + tray_text(tray) + ", for " + echoed_list(faults, faults.size()) +
                   ": the parts take " + show_number(result.depth_mm) + " mm along y with " +
                   show_number(options.clearance_mm) + " mm between them, " +
                   show_number(result.depth_mm - tray.size_mm.y()) +
                   " mm more than there are; make fewer --copies, or --clearance less");
}

/// Turned as it was packed, and moved to its place, to stand on the tray.
Placement placed(const Copy& copy, const PackedPlace& place) {
  Placement turn = Placement::Identity();
  Vec3 low = copy.box_mm.min();
  if (place.turned) {
    turn.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    low = Vec3(-copy.box_mm.max().y(), copy.box_mm.min().x(), copy.box_mm.min().z());
  }
  Placement result = turn * copy.placement;
  result.translation() += Vec3(place.x_mm, place.y_mm, 0) - low;
  return result;
}

void report(const Session& session, const TrayPackOptions& options, const Tray& tray, const v1::SliceJob& job,
            const std::vector<std::string>& names, double depth_mm) {
  v1::PackedTrayDocument document;
  document.set_file(options.output);
  document.set_printer(tray.name);
  document.set_used_depth_mm(depth_mm);
  std::uint64_t placements = 0;
  for (int p = 0; p < job.parts_size(); ++p) {
    v1::TrayPart& part = *document.add_parts();
    part.set_name(names[static_cast<std::size_t>(p)]);
    part.set_placements(static_cast<std::uint64_t>(job.parts(p).placements_size()));
    placements += part.placements();
  }
  if (session.options().json) return print_line(json_of(document));
  print_line(options.output + ": " + show_count(names.size(), "part") + " in " + show_count(placements, "place") +
             " on " + tray_text(tray) + ", up to y = " + show_number(depth_mm) + " mm");
}

/// The job of the options. --printer may say the printer of a file's job, too.
v1::SliceJob job_to_pack(TrayPackOptions& options) {
  if (!options.job.parts.places.empty())
    throw UsageError("--at: tray pack finds the places itself; leave the option out");
  std::erase_if(options.job.said_in_files, [](const CLI::Option* it) { return it->get_name() == "--printer"; });
  v1::SliceJob job = job_of(options.job, {});
  if (!options.job.file.empty() && !options.job.grid.printer.empty()) {
    job.mutable_printer()->Clear();
    job.mutable_printer()->set_name(options.job.grid.printer);
  }
  return job;
}

void run_tray_pack(Session& session, TrayPackOptions options) {
  refuse_to_overwrite(options.output, options.force);
  if (options.clearance_mm < 0 || !std::isfinite(options.clearance_mm)) {
    throw UsageError("--clearance takes a number of mm from 0 on");
  }
  v1::SliceJob job = job_to_pack(options);
  const Tray tray = tray_of(job);
  const std::vector<std::string> names = names_of_parts(options.job, job);
  const std::vector<std::optional<std::uint32_t>> counts = parse_copies(options, names);
  const std::vector<std::string> mesh_names = mesh_names_for(options.job, job, options.output);
  put_on_server(session, options.job, job);
  const std::vector<Copy> copies = copies_of(session, job, names, counts);
  bool in_whole_voxels = false;
  const PackedTray result = packed(options, tray, copies, names, in_whole_voxels);
  job.set_snap(in_whole_voxels);
  for (v1::Part& part : *job.mutable_parts()) part.clear_placements();
  for (std::size_t i = 0; i < copies.size(); ++i) {
    *job.mutable_parts(static_cast<int>(copies[i].part))->add_placements() =
        to_message(placed(copies[i], result.places[i]));
  }
  write_tray_job(session, options.output, job, mesh_names);
  report(session, options, tray, job, names, result.depth_mm);
}

}  // namespace

Command add_tray_pack(CLI::App& tray, CommonOptions& common) {
  auto options = std::make_shared<TrayPackOptions>();
  CLI::App* app =
      tray.add_subcommand("pack", "Arrange parts and copies of them on a printer's tray, and write the job");
  add_placed_job_options(*app, options->job, common);
  add_layer_options(*app, options->job);
  app->add_option("-o,--output", options->output, "Job file to write, which `ccslice slice` takes")->required();
  app->add_option(
         "--copies", options->copies,
         "N of each part, or NAME=N of one, whose name is its file's without folder and ending (default: as many "
         "as the job has, or one). May be repeated: the last one that names a part counts")
      ->allow_extra_args(false);
  app->add_option("--clearance", options->clearance_mm, "Room between parts in mm")->capture_default_str();
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_server_options(*app, common);
  app->footer(
      "Parts keep their orientation but for turns by 90 degrees about z, and stand on z = 0. Rectangles round them are "
      "packed, from the tray's corner at x = 0, y = 0 on; --printer says which tray, also for a job's file.\n"
      "Examples:\n  ccslice tray pack ring.ccmesh lid.ccmesh --copies 4 --copies lid=2 --printer j750-hm -o tray.json\n"
      "  ccslice tray pack job.json --copies 10 --printer j750-hm --clearance 5 -o tray.json\n"
      "  ccslice slice tray.json -o layers");
  return {app, [options](Session& session) { run_tray_pack(session, *options); }};
}

}  // namespace ccslice::cli
