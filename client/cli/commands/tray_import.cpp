// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/tray.h"
#include "client/cli/tray/find_parts.h"
#include "client/cli/tray/tray_package.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

/// Most that is unpacked of a package, whatever --max-file-bytes says: its XML takes five times that in memory.
constexpr std::uint64_t kMostPackageBytes = 2ull << 30;

struct TrayImportOptions {
  JobOptions job;
  std::string package, output, file_origin;
  std::optional<std::uint32_t> plate;
  double chord_tolerance_mm = kTrayChordMm;
  bool leave_out_others = false, force = false;
};

std::string describe(const std::vector<TrayPlate>& plates) {
  std::vector<std::string> names;
  for (const TrayPlate& plate : plates) {
    names.push_back(std::to_string(plate.number) + (plate.name.empty() ? "" : " '" + echoed(plate.name) + "'"));
  }
  return echoed_list(names, names.size());
}

/// The number of the plate that is meant; nothing if the file says nothing of plates. Throws UsageError.
std::optional<std::uint32_t> chosen_plate(const TrayImportOptions& options, const TrayPackage& package) {
  std::set<std::uint32_t> used;
  for (const TrayInstance& instance : package.instances) {
    if (instance.plate.value_or(0) > 0) used.insert(*instance.plate);
  }
  if (options.plate) {
    if (package.plates.empty()) {
      throw UsageError("--plate: " + options.package + " says nothing of plates; leave the option out");
    }
    const bool known = std::ranges::find(package.plates, *options.plate, &TrayPlate::number) != package.plates.end();
    if (known && used.contains(*options.plate)) return options.plate;
    throw UsageError("--plate: " + options.package + (known ? " has nothing on plate " : " has no plate ") +
                     std::to_string(*options.plate) + "; its plates are " + describe(package.plates));
  }
  if (used.size() > 1) {
    throw UsageError(options.package + " has parts on several plates: " + describe(package.plates) +
                     "; say with --plate which of them is to be printed");
  }
  return used.empty() ? std::nullopt : std::optional(*used.begin());
}

/// Returns why an instance isn't printed, whatever it is; empty if it is.
std::string reason_to_leave_out(const TrayInstance& instance, const std::optional<std::uint32_t>& plate) {
  if (plate && instance.plate != plate) {
    return instance.plate.value_or(0) == 0 ? "it lies beside the plates"
                                           : "it lies on plate " + std::to_string(*instance.plate);
  }
  if (!instance.printable) return "it isn't to be printed (printable=\"0\")";
  if (!instance.aid.empty()) return "it is no part but a " + echoed(instance.aid);
  return "";
}

struct Arrangement {
  std::vector<std::vector<Placement>> placements;  // By part.
  std::vector<std::string> foreign, changed;       // What is wrong with objects.
  std::string remedy;                              // Of the first one that was changed.
  std::vector<std::string> left_out, mirrored;
  double residual_mm = 0;
};

void refuse(const TrayImportOptions& options, const std::vector<std::string>& faults, const std::string& remedy) {
  constexpr std::size_t kMostNamed = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(faults.size(), kMostNamed); ++i) text += (i == 0 ? "" : "; ") + faults[i];
  if (faults.size() > kMostNamed) text += "; and " + std::to_string(faults.size() - kMostNamed) + " more";
  throw Error(ErrorCode::kFileUnsupported, options.package + ": " + text + remedy);
}

void refuse_faults(const TrayImportOptions& options, const Arrangement& arrangement) {
  if (!arrangement.changed.empty()) refuse(options, arrangement.changed, "; " + arrangement.remedy);
  if (!arrangement.foreign.empty() && !options.leave_out_others) {
    refuse(options, arrangement.foreign,
           " (" + count_text(arrangement.foreign.size(), "object") +
               "); --leave-out-others imports the plate without what isn't the job's");
  }
  std::size_t placements = 0;
  for (const auto& of_part : arrangement.placements) placements += of_part.size();
  if (placements == 0) {
    refuse(options, {"none of the job's parts is on the plate"}, "; export the job, arrange that file and save it");
  }
  if (placements > kMostPlacements) {
    refuse(options, {"it has " + std::to_string(placements) + " parts and copies"},
           ", and a job takes " + std::to_string(kMostPlacements) + "; spread them over several plates");
  }
}

Arrangement arrange(const TrayImportOptions& options, const TrayPackage& package,
                    const std::vector<ExportedPart>& parts) {
  const std::optional<std::uint32_t> plate = chosen_plate(options, package);
  Arrangement arrangement;
  arrangement.placements.resize(parts.size());
  for (const TrayInstance& instance : package.instances) {
    if (const std::string reason = reason_to_leave_out(instance, plate); !reason.empty()) {
      arrangement.left_out.push_back(instance.label + " is left out: " + reason);
      continue;
    }
    const PartSearch search = find_part(parts, instance);
    if (!search.found) {
      (search.is_foreign ? arrangement.foreign : arrangement.changed).push_back(search.fault);
      if (arrangement.remedy.empty()) arrangement.remedy = search.remedy;
      continue;
    }
    arrangement.placements[search.found->part].push_back(search.found->placement);
    arrangement.residual_mm = std::max(arrangement.residual_mm, search.found->residual_mm);
    if (search.found->mirrored) arrangement.mirrored.push_back(instance.label + " is mirrored");
  }
  refuse_faults(options, arrangement);
  if (options.leave_out_others) {
    for (const std::string& fault : arrangement.foreign) arrangement.left_out.push_back(fault + ", and left out");
  }
  return arrangement;
}

/// Puts the placements into the job, which loses parts that aren't on the plate. Says which.
std::vector<std::string> take_placements(const TrayImportOptions& options, const Arrangement& arrangement,
                                         const std::vector<std::string>& names, v1::SliceJob& job,
                                         std::vector<std::string>& mesh_names) {
  Vec3 origin = Vec3::Zero();
  if (!options.file_origin.empty()) {
    const std::vector<double> numbers = parse_numbers("--file-origin", options.file_origin, 3, 3);
    origin = Vec3(numbers[0], numbers[1], numbers[2]);
  }
  std::vector<std::string> notes, kept_names;
  v1::SliceJob kept = job;
  kept.clear_parts();
  for (int p = 0; p < job.parts_size(); ++p) {
    const auto at = static_cast<std::size_t>(p);
    if (arrangement.placements[at].empty()) {
      notes.push_back("the part '" + echoed(names[at]) + "' isn't on the plate, and so not in the job");
      continue;
    }
    v1::Part& part = *kept.add_parts();
    part = job.parts(p);
    part.clear_placements();
    for (Placement placement : arrangement.placements[at]) {
      placement.translation() -= origin;
      *part.add_placements() = to_message(placement);
    }
    kept_names.push_back(mesh_names[at]);
  }
  job = std::move(kept);
  mesh_names = std::move(kept_names);
  return notes;
}

/// The parts as they were exported, of meshes on the server.
std::vector<ExportedPart> exported_parts(Session& session, const TrayImportOptions& options, const v1::SliceJob& job,
                                         const std::vector<std::string>& names) {
  std::vector<ExportedPart> parts;
  for (int p = 0; p < job.parts_size(); ++p) {
    ExportedPart part{names[static_cast<std::size_t>(p)], {}, {}};
    const std::vector<Placement> placements = placements_of(job.parts(p), part.name);
    for (const auto& [x, y, z] :
         tray_surface(session, job.parts(p), placements, options.chord_tolerance_mm).points_mm) {
      part.points.emplace_back(x, y, z);
    }
    for (const Placement& placement : placements) {
      // Placements that differ by a motion are the same shape.
      const auto same_shape = [&](const Mat3& linear) {
        const Mat3 gram = placement.linear().transpose() * placement.linear();
        return (linear.transpose() * linear).isApprox(gram, 1e-12);
      };
      if (std::ranges::none_of(part.linears, same_shape)) part.linears.emplace_back(placement.linear());
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

void report(const Session& session, const TrayImportOptions& options, const v1::SliceJob& job,
            const std::vector<std::string>& names, const Arrangement& arrangement) {
  v1::ImportedTray document;
  document.set_file(options.output);
  document.set_max_residual_mm(arrangement.residual_mm);
  document.set_left_out(arrangement.left_out.size());
  std::uint64_t placements = 0;
  for (std::size_t p = 0; p < names.size(); ++p) {
    if (arrangement.placements[p].empty()) continue;
    v1::TrayPart& part = *document.add_parts();
    part.set_name(names[p]);
    part.set_placements(arrangement.placements[p].size());
    placements += arrangement.placements[p].size();
  }
  if (session.options().json) return print_line(json_of(document));
  const double nanometres = std::max(1.0, std::ceil(1e6 * arrangement.residual_mm));
  print_line(options.output + ": " + show_count(static_cast<std::uint64_t>(job.parts_size()), "part") + " in " +
             show_count(placements, "place") + ", within " + show_number(nanometres / 1000) +
             " um of the vertices in " + options.package);
}

void run_tray_import(Session& session, const TrayImportOptions& options) {
  refuse_to_overwrite(options.output, options.force);
  v1::SliceJob job = job_of(options.job, {});
  const TrayPackage package =
      read_tray_package(options.package, std::min(options.job.mesh.max_file_bytes, kMostPackageBytes));
  chosen_plate(options, package);
  const std::vector<std::string> names = names_of_parts(options.job, job);
  std::vector<std::string> mesh_names = mesh_names_for(options.job, job, options.output);
  put_on_server(session, options.job, job);
  const Arrangement arrangement = arrange(options, package, exported_parts(session, options, job, names));
  const std::vector<std::string> notes = take_placements(options, arrangement, names, job, mesh_names);
  if (!session.quiet()) {
    for (const auto& lines : {arrangement.left_out, arrangement.mirrored, notes}) {
      for (const std::string& line : lines) print_note("note: " + line);
    }
  }
  write_tray_job(session, options.output, job, mesh_names);
  report(session, options, job, names, arrangement);
}

}  // namespace

Command add_tray_import(CLI::App& tray, CommonOptions& common) {
  auto options = std::make_shared<TrayImportOptions>();
  CLI::App* app = tray.add_subcommand(
      "import", "Take the places of a job's parts from a 3MF file that another program has saved, and write the job");
  app->add_option("PLATE", options->package, "The 3MF project, saved after arranging what `tray export` wrote")
      ->required();
  add_placed_job_options(*app, options->job, common);
  add_layer_options(*app, options->job);
  app->add_option("-o,--output", options->output, "Job file to write, which `ccslice slice` takes")->required();
  app->add_option("--plate", options->plate,
                  "The plate to take, from 1 on; to be given where the file has parts on several plates");
  app->add_option("--file-origin", options->file_origin,
                  "X,Y,Z in mm: the place in the file that becomes the job's origin (default: the file's own origin)");
  app->add_flag("--leave-out-others", options->leave_out_others,
                "Leave out objects that are none of the job's parts, instead of refusing the file");
  app->add_option("--chord-tolerance", options->chord_tolerance_mm, "That of `tray export`, in mm")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_server_options(*app, common);
  app->footer(
      "Parts are found by their vertices, whatever the program did to names, numbers and origins: moved, turned, "
      "mirrored and copied ones. Scaled and edited ones are refused.\n"
      "Examples:\n  ccslice tray import plate.3mf --job tray.json -o plate.json\n"
      "  ccslice tray import plate.3mf ring.ccmesh lid.ccmesh --printer j750-hm --channel hardness --plate 2 -o "
      "plate.json\n"
      "  ccslice slice plate.json -o layers");
  return {app, [options](Session& session) { run_tray_import(session, *options); }};
}

}  // namespace ccslice::cli
