// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>
#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/mesh_bytes.h"
#include "core/base/echo.h"
#include "core/models/models.h"

namespace ccslice::cli {
namespace {

struct ModelsOptions {
  std::string name;
  std::string output;
  bool force = false;
};

void list_models(const Session& session) {
  std::vector<v1::Sample> samples;
  for (const SampleModel& model : sample_models()) {
    if (!session.options().json) print_line(std::string(model.name) + "  " + std::string(model.description));
    v1::Sample& sample = samples.emplace_back();
    sample.set_name(std::string(model.name));
    sample.set_description(std::string(model.description));
  }
  if (session.options().json) print_line(json_list_of(samples));
}

void write_model(const Session& session, const ModelsOptions& options) {
  const SampleModel* model = find_sample_model(options.name);
  if (!model) throw UsageError("there is no sample '" + echoed(options.name) + "'; `ccslice models` lists them");
  const std::string output = options.output.empty() ? options.name + ".ccmesh" : options.output;
  if (!output.ends_with(".ccmesh")) {
    throw UsageError("--output is a .ccmesh file, not '" + output + "'; convert makes .json and .vtu of it");
  }
  refuse_to_overwrite(output, options.force);
  const client::MeshBytes bytes(to_proto(model->make()));
  write_file(output, bytes.bytes());
  if (session.options().json) {
    v1::MeshFile file;
    file.set_file(output);
    file.set_mesh_id(bytes.id());
    file.set_size_bytes(bytes.bytes().size());
    print_line(json_of(file));
  } else {
    print_line(output + ": " + show_bytes(bytes.bytes().size()) + ", " + bytes.id());
  }
}

}  // namespace

Command add_models(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ModelsOptions>();
  CLI::App* app = parent.add_subcommand("models", "List the sample solids, or write one to a file");
  app->add_option("NAME", options->name, "The sample to write; none: list them all");
  app->add_option("-o,--output", options->output, "File to write, .ccmesh (default: NAME.ccmesh)");
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_output_options(*app, common);
  app->footer("Examples:\n  ccslice models\n  ccslice models ring -o ring.ccmesh");
  return {app, [options](Session& session) {
            options->name.empty() ? list_models(session) : write_model(session, *options);
          }};
}

}  // namespace ccslice::cli
