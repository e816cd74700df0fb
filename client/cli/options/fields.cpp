// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/fields.h"

#include <string_view>

#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"

namespace ccslice::cli {
namespace {

constexpr const char* kCutName = "cut-where";

/// Takes "world:" away, if the text begins with it, and notes the frame.
std::string_view formula_in_frame(std::string_view text, v1::Field& field) {
  constexpr std::string_view kWorld = "world:";
  if (!text.starts_with(kWorld)) return text;
  field.set_frame(v1::FIELD_FRAME_WORLD);
  return text.substr(kWorld.size());
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

v1::Field parse_field(std::string_view text) {
  v1::Field field;
  const std::string_view pair = formula_in_frame(text, field);
  const std::size_t equals = pair.find('=');
  if (equals == std::string_view::npos || trimmed(pair.substr(0, equals)).empty() || equals + 1 == pair.size()) {
    throw UsageError("--field takes NAME=FORMULA or world:NAME=FORMULA, such as 'shade=clamp(z/10, 0, 1)', not '" +
                     std::string(text) + "'");
  }
  field.set_name(std::string(trimmed(pair.substr(0, equals))));
  field.set_formula(std::string(pair.substr(equals + 1)));
  return field;
}

void add_volume_option(CLI::App& command, FieldOptions& options) {
  const OptionGroup group(command, "Fields");
  command
      .add_option("--volume", options.volumes,
                  "Values from samples on a grid, NAME=FILE: a .nrrd, .mha, .mhd, .nii, .nii.gz or .npy file, or a "
                  "folder or pattern ('scan/*.png') of .png pictures. --channel, --map and fields "
                  "then name it like a channel. Options follow behind colons: --volume 'hu=scan.nrrd:outside=-1000'. "
                  "outside=VALUE "
                  "where there are no samples (default: 0); nearest for labels; channel=N, from 0; spacing=MM or "
                  "spacing=X,Y,Z and origin=X,Y,Z for the centre of the first sample, in mm; fill to fill the box "
                  "round the part; ras, x to the right and y to the front; xyz for arrays whose first axis is x. "
                  "world:NAME=FILE lies in the grid's frame. May be repeated")
      ->allow_extra_args(false);
}

}  // namespace

void add_field_options(CLI::App& command, FieldOptions& options) {
  const OptionGroup group(command, "Fields");
  command
      .add_option("--field", options.fields,
                  "Values by a formula of the place, in mm, and of channels, NAME=FORMULA: --field "
                  "'wave=0.5 + 0.5*sin(pi*z)'. --channel, --map and later fields then name it like a channel. x, y and "
                  "z are the mesh's own; with world:NAME=FORMULA those of the grid. docs/fields.md has the language. "
                  "May be repeated")
      ->allow_extra_args(false);
  add_volume_option(command, options);
}

void add_cut_option(CLI::App& command, FieldOptions& options) {
  const OptionGroup group(command, "Fields");
  command.add_option("--cut-where", options.cut,
                     "Leave out the voxels where this formula holds, as outside the part: --cut-where "
                     "'gyroid(x/5, y/5, z/5) < 0' leaves a lattice. Contours stay those of the whole part");
}

google::protobuf::RepeatedPtrField<v1::Field> parse_fields(const FieldOptions& options) {
  google::protobuf::RepeatedPtrField<v1::Field> fields;
  for (const std::string& text : options.volumes) *fields.Add() = parse_volume(text, *options.loaded);
  for (const std::string& text : options.fields) *fields.Add() = parse_field(text);
  if (options.cut.empty()) return fields;
  v1::Field& cut = *fields.Add();
  cut.set_formula(std::string(formula_in_frame(options.cut, cut)));
  cut.set_name(kCutName);
  return fields;
}

std::string cut_of(const FieldOptions& options) { return options.cut.empty() ? "" : kCutName; }

}  // namespace ccslice::cli
