// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/fields.h"
#include "client/cli/options/placement.h"
#include "client/cli/output/point_file.h"
#include "core/base/echo.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice::cli {
namespace {

struct ProbeOptions {
  MeshOptions mesh;
  PlacementOptions placement;
  FieldOptions fields;
  std::vector<std::string> at;
  std::string points_file;
};

/// The points of --at, then those of the file.
class Points {
 public:
  explicit Points(const ProbeOptions& options) {
    for (const std::string& text : options.at) {
      const std::vector<double> point = parse_numbers("--at", text, 3, 3);
      named_.insert(named_.end(), point.begin(), point.end());
    }
    if (!options.points_file.empty()) {
      file_.emplace(options.points_file);
      // So that a wrong file is refused before anything is uploaded.
      const std::vector<double> begin = file_->next(kFirstPoints);
      named_.insert(named_.end(), begin.begin(), begin.end());
    }
    if (named_.empty()) {
      throw UsageError("name points: --at X,Y,Z, or --points FILE with x, y, z of a point on each line");
    }
  }

  std::vector<double> next(std::size_t most_points) {
    if (named_.empty()) return file_ ? file_->next(most_points) : std::vector<double>();
    const auto end = named_.begin() + static_cast<std::ptrdiff_t>(std::min(named_.size(), 3 * most_points));
    std::vector<double> points(named_.begin(), end);
    named_.erase(named_.begin(), end);
    return points;
  }

 private:
  static constexpr std::size_t kFirstPoints = 1000;

  std::vector<double> named_;  // And those that begin the file.
  std::optional<PointFile> file_;
};

const char* name_of(v1::PointLocation location) {
  switch (location) {
    case v1::POINT_LOCATION_INSIDE: return "inside";
    case v1::POINT_LOCATION_NEAR: return "near";
    default: return "outside";
  }
}

/// One answer, wherever in its batch.
struct AnswerInBatch {
  const v1::ProbePointsResponse& batch;
  int index;
  std::size_t channels;

  bool outside() const { return batch.locations(index) == v1::POINT_LOCATION_OUTSIDE; }
  double uvw(int i) const { return batch.uvw(3 * index + i); }
  double value(std::size_t channel) const {
    return batch.channel_values(static_cast<int>(static_cast<std::size_t>(index) * channels + channel));
  }
};

v1::PointAnswer document_of_answer(const double* point, const AnswerInBatch& answer,
                                   const std::vector<std::string>& channels, const FileNumbers* numbers) {
  v1::PointAnswer document;
  *document.mutable_point_mm() = to_proto(Vec3(point[0], point[1], point[2]));
  document.set_location(name_of(answer.batch.locations(answer.index)));
  if (answer.outside()) return document;
  const std::uint32_t cell = answer.batch.control_cells(answer.index);
  document.set_limit_cell(answer.batch.limit_cells(answer.index));
  document.set_control_cell(cell);
  if (numbers != nullptr) document.set_file_cell(file_cell(*numbers, cell));
  for (int i = 0; i < 3; ++i) document.add_uvw(answer.uvw(i));
  document.set_residual_mm(answer.batch.residuals_mm(answer.index));
  for (std::size_t i = 0; i < channels.size(); ++i) {
    (*document.mutable_channel_values())[channels[i]] = answer.value(i);
  }
  return document;
}

std::string as_text(const double* point, const AnswerInBatch& answer, const std::vector<std::string>& channels,
                    const FileNumbers* numbers) {
  std::string text = "(" + show_number(point[0]) + ", " + show_number(point[1]) + ", " + show_number(point[2]) + ") " +
                     name_of(answer.batch.locations(answer.index));
  if (answer.outside()) return text;
  const std::uint32_t cell = answer.batch.control_cells(answer.index);
  text += numbers != nullptr ? ", " + numbers->cell_noun + " " + std::to_string(file_cell(*numbers, cell))
                             : ", cell " + std::to_string(cell);
  text +=
      " (" + show_number(answer.uvw(0)) + ", " + show_number(answer.uvw(1)) + ", " + show_number(answer.uvw(2)) + ")";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    text += ", " + echoed(channels[i]) + " " + show_number(answer.value(i));
  }
  return text;
}

/// Prints answers as they come. JSON is one array.
class AnswerPrinter {
 public:
  /// `channels`: names of the mesh's, then of the fields. `numbers`: of the file that the mesh came from, or null.
  AnswerPrinter(std::vector<std::string> channels, const FileNumbers* numbers, bool json)
      : channels_(std::move(channels)), numbers_(numbers), json_(json) {}

  void print(std::span<const double> points, const v1::ProbePointsResponse& batch) {
    for (int i = 0; i < batch.locations_size(); ++i) {
      const double* point = &points[3 * static_cast<std::size_t>(i)];
      const AnswerInBatch answer{batch, i, channels_.size()};
      if (!json_) {
        print_line(as_text(point, answer, channels_, numbers_));
        continue;
      }
      print_part((printed_++ == 0 ? "[" : ",") + json_of(document_of_answer(point, answer, channels_, numbers_)));
    }
  }

  void end() {
    if (json_) print_line(printed_ == 0 ? "[]" : "]");
  }

  /// So that what is said of a failure has a line of its own.
  void break_off() {
    if (json_ && printed_ > 0) print_line("");
  }

 private:
  const std::vector<std::string> channels_;
  const FileNumbers* const numbers_;
  const bool json_;
  std::uint64_t printed_ = 0;
};

void run_probe(Session& session, const ProbeOptions& options) {
  Points points(options);
  v1::ProbePointsRequest setting;
  *setting.mutable_placement() = parse_placement(options.placement);
  *setting.mutable_fields() = parse_fields(options.fields);
  setting.set_mesh_id(ensure_on_server(session, options.mesh, options.placement));
  put_volumes_on_server(session, setting.mesh_id(), *options.fields.loaded);
  const v1::MeshSummary mesh = session.client().mesh_summary(setting.mesh_id(), session.call());
  std::vector<std::string> channels;
  for (const v1::Channel& channel : mesh.channels()) channels.push_back(channel.name());
  for (const v1::Field& field : setting.fields()) channels.push_back(field.name());
  const std::optional<FileNumbers>& numbers = session.file_numbers();
  AnswerPrinter printer(std::move(channels), numbers ? &*numbers : nullptr, session.options().json);
  try {
    session.client().probe(
        setting, [&](std::size_t most_points) { return points.next(most_points); },
        [&](std::span<const double> asked, const v1::ProbePointsResponse& batch) { printer.print(asked, batch); },
        session.call());
  } catch (...) {
    printer.break_off();
    throw;
  }
  printer.end();
}

}  // namespace

Command add_probe(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ProbeOptions>();
  CLI::App* app = parent.add_subcommand("probe", "Say whether points are inside, in which cell, and of what material");
  add_mesh_options(*app, options->mesh);
  app->add_option("--at", options->at, "A point, X,Y,Z in mm; may be repeated")->allow_extra_args(false);
  app->add_option("--points", options->points_file,
                  "A file of points, x y z or x,y,z on each line, in any number: answers are printed as they come");
  add_placement_options(*app, options->placement);
  add_field_options(*app, options->fields);
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice probe ring.ccmesh --at 34,0,8 --at 0,0,0\n  ccslice probe part.vtk --grade "
      "stiffness=z --points points.csv --json");
  return {app, [options](Session& session) { run_probe(session, *options); }};
}

}  // namespace ccslice::cli
