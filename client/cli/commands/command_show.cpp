// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/base/console.h"
#include "client/cli/base/json.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/job.h"
#include "client/cli/options/part_box.h"
#include "client/cli/options/placement.h"
#include "client/cli/pictures/voxel_block.h"

namespace ccslice::cli {
namespace {

struct ShowOptions {
  MeshOptions mesh;
  PlacementOptions placement;
  std::string channel;
  double height = 0.5;
  std::uint32_t width = 78;
  std::optional<double> material_tolerance = std::nullopt;
};

constexpr std::string_view kShades = ".:-=+*#%@";

/// One layer across the box at a fraction of its height, a voxel a character; characters are twice as high as wide.
v1::GridSpec picture_grid(const v1::Box3& box, const ShowOptions& options) {
  const double x = box.max_mm().x() - box.min_mm().x(), y = box.max_mm().y() - box.min_mm().y();
  const double z = std::lerp(box.min_mm().z(), box.max_mm().z(), options.height);
  constexpr double kMostRows = 60;
  const double pitch = std::max(x / options.width, y / (2 * kMostRows));
  v1::GridSpec grid;
  grid.mutable_pitch()->set_x_mm(pitch);
  grid.mutable_pitch()->set_y_mm(2 * pitch);
  grid.mutable_pitch()->set_z_mm(pitch);
  grid.mutable_origin_mm()->set_x(box.min_mm().x());
  grid.mutable_origin_mm()->set_y(box.min_mm().y());
  grid.mutable_origin_mm()->set_z(z - pitch / 2);
  grid.mutable_extent()->set_columns(static_cast<std::uint32_t>(std::max(1.0, std::round(x / pitch))));
  grid.mutable_extent()->set_rows(static_cast<std::uint32_t>(std::max(1.0, std::round(y / (2 * pitch)))));
  grid.mutable_extent()->set_layers(1);
  return grid;
}

v1::SliceRangeRequest picture_request(const std::string& id, const v1::Placement& placement, const v1::Box3& box,
                                      const ShowOptions& options) {
  v1::SliceRangeRequest request;
  request.set_layer_count(1);
  v1::SliceJob& job = *request.mutable_job() = client::job_of(id, placement);
  *job.mutable_grid() = picture_grid(box, options);
  if (options.material_tolerance) job.mutable_tolerances()->set_channel(*options.material_tolerance);
  ask_for_block(job, options.channel);
  return request;
}

/// The highest y on top.
std::string draw(const v1::GridExtent& extent, const client::Layer& layer) {
  const std::size_t columns = extent.columns(), stride = (columns + 7) / 8;
  const std::string& inside = layer.planes[0].samples;
  std::string picture;
  for (std::size_t row = extent.rows(); row-- > 0;) {
    std::string line(columns, ' ');
    for (std::size_t column = 0; column < columns; ++column) {
      if (!(static_cast<unsigned char>(inside[row * stride + column / 8]) >> (7 - column % 8) & 1)) continue;
      const auto value = layer.planes.size() > 1
                             ? static_cast<unsigned char>(layer.planes[1].samples[row * columns + column])
                             : static_cast<unsigned char>(0xc0);
      line[column] = kShades[value * kShades.size() / 256];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    picture += line + "\n";
  }
  return picture;
}

void run_show(Session& session, const ShowOptions& options) {
  const v1::Placement placement = parse_placement(options.placement);
  const std::string id = ensure_on_server(session, options.mesh, options.placement);
  const v1::SliceRangeRequest request = picture_request(id, placement, part_box(session, id, placement), options);
  session.client().slice(
      request,
      [&](const v1::SliceHeader& header, const client::Layer& layer) {
        const std::string picture = draw(header.grid().extent(), layer);
        if (session.options().json) {
          JsonWriter json;
          json.begin_object().member("z_mm", layer.z_mm).member("voxel_count", layer.end.voxel_count());
          return print_line(json.member("picture", picture).end_object().text());
        }
        print_line(picture + "z = " + show_number(layer.z_mm) + " mm, a character is " +
                   show_number(header.grid().pitch().x_mm()) + " mm wide" +
                   (options.channel.empty() ? "" : "; '.' to '@': " + options.channel + " from low to high"));
      },
      session.call());
}

}  // namespace

Command add_show(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ShowOptions>();
  CLI::App* app = parent.add_subcommand("show", "Draw one layer in the terminal");
  add_mesh_options(*app, options->mesh);
  app->add_option("--channel", options->channel, "Shade by this material channel");
  app->add_option("--height", options->height, "Where to cut: 0 at the bottom, 1 at the top")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  constexpr std::uint32_t kWidest = 1000;
  app->add_option("--width", options->width, "Width in characters")
      ->check(CLI::Range(1u, kWidest))
      ->capture_default_str();
  add_material_tolerance_option(*app, options->material_tolerance);
  add_placement_options(*app, options->placement);
  add_server_options(*app, common);
  app->footer("Example:\n  ccslice show part.vtk --grade stiffness=x --channel stiffness --rotate x=90 --height 0.3");
  return {app, [options](Session& session) { run_show(session, *options); }};
}

}  // namespace ccslice::cli
