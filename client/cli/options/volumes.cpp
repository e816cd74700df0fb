// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/volumes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/text_values.h"
#include "client/cli/options/job_file.h"
#include "client/cli/volumes/read_volume_file.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr const char* kOption = "--volume";
constexpr const char* kForm =
    "--volume takes NAME=FILE with options behind colons, such as density=scan.nrrd:outside=-1000, not '";

/// The options behind the file.
struct Reading {
  bool fills_box = false, is_ras = false, axes_are_xyz = false;
  std::vector<double> spacing, origin;
};

v1::VolumeSampleType to_message(VolumeSampleType type) {
  switch (type) {
    case VolumeSampleType::kUint8: return v1::VOLUME_SAMPLE_TYPE_UINT8;
    case VolumeSampleType::kInt16: return v1::VOLUME_SAMPLE_TYPE_INT16;
    case VolumeSampleType::kUint16: return v1::VOLUME_SAMPLE_TYPE_UINT16;
    case VolumeSampleType::kFloat32: break;
  }
  return v1::VOLUME_SAMPLE_TYPE_FLOAT32;
}

std::shared_ptr<const client::MeshBytes> packed(const VolumeFile& file) {
  v1::Volume volume;
  volume.set_samples_i(file.shape.samples[0]);
  volume.set_samples_j(file.shape.samples[1]);
  volume.set_samples_k(file.shape.samples[2]);
  volume.set_sample_type(to_message(file.shape.type));
  volume.set_channels(file.shape.channels);
  return std::make_shared<const client::MeshBytes>(client::MeshBytes::of_volume(
      std::move(volume), {reinterpret_cast<const char*>(file.samples.data()), file.samples.size()}));
}

std::uint32_t parse_channel(std::string_view text) {
  const double channel = parse_number(kOption, text);
  if (channel < 0 || channel != std::floor(channel) || channel > 255) {
    throw UsageError("--volume: channel=" + std::string(text) + " isn't one of 0 to 255");
  }
  return static_cast<std::uint32_t>(channel);
}

/// Takes one of the words behind the file. False if it is none of them.
bool take_word(std::string_view word, v1::VolumeSamples& samples, Reading& reading) {
  const auto value = [&](std::string_view key) -> std::optional<std::string_view> {
    if (!word.starts_with(key)) return std::nullopt;
    return word.substr(key.size());
  };
  if (word == "nearest") {
    samples.set_interpolation(v1::VOLUME_INTERPOLATION_NEAREST);
  } else if (word == "fill") {
    reading.fills_box = true;
  } else if (word == "ras") {
    reading.is_ras = true;
  } else if (word == "xyz") {
    reading.axes_are_xyz = true;
  } else if (const auto outside = value("outside=")) {
    samples.set_outside_value(parse_number(kOption, *outside));
  } else if (const auto channel = value("channel=")) {
    samples.set_channel(parse_channel(*channel));
  } else if (const auto spacing = value("spacing=")) {
    reading.spacing = parse_numbers(kOption, *spacing, 1, 3);
    if (reading.spacing.size() == 2) throw UsageError("--volume: spacing= takes one number, or three");
    reading.spacing.resize(3, reading.spacing.front());
  } else if (const auto origin = value("origin=")) {
    reading.origin = parse_numbers(kOption, *origin, 3, 3);
  } else {
    return false;
  }
  return true;
}

void set_place(const Placement& place, v1::VolumeSamples& samples) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) samples.add_index_to_mm(place.matrix()(row, column));
  }
}

/// The place of the samples: as the options say, or else as the file does.
std::optional<Placement> place_of(const VolumeFile& file, const Reading& reading) {
  const bool says_place = !reading.spacing.empty() || !reading.origin.empty();
  if (reading.fills_box && (says_place || reading.is_ras)) {
    throw UsageError("--volume: fill takes the part's place: leave spacing=, origin= and ras out");
  }
  if (reading.fills_box) return std::nullopt;
  if (says_place) {
    if (reading.is_ras) throw UsageError("--volume: ras is for a place that the file says: leave it out");
    if (reading.spacing.empty() && !file.mm_of_index) {
      throw UsageError("--volume: origin= goes with spacing=, which the file doesn't say");
    }
    Placement place = reading.spacing.empty() ? *file.mm_of_index : Placement::Identity();
    for (std::size_t axis = 0; axis < reading.spacing.size(); ++axis) {
      place.linear()(static_cast<int>(axis), static_cast<int>(axis)) = reading.spacing[axis];
    }
    if (!reading.origin.empty()) place.translation() = Vec3(reading.origin[0], reading.origin[1], reading.origin[2]);
    return place;
  }
  if (!reading.is_ras) return file.mm_of_index;
  if (!file.is_lps)
    throw UsageError("--volume: ras is for files that say a patient's left and right, and this doesn't");
  return Eigen::Scaling(-1.0, -1.0, 1.0) * *file.mm_of_index;
}

/// Lets the file say what the field doesn't.
void load(const std::string& path, const Reading& reading, v1::VolumeSamples& samples, LoadedVolumes& loaded) {
  const LoadedVolumes::File& file = loaded.read(path, reading.axes_are_xyz);
  samples.set_volume_id(file.bytes->id());
  if (samples.slope() == 0 && samples.intercept() == 0) {
    if (file.said.slope != 1) samples.set_slope(file.said.slope);
    if (file.said.intercept != 0) samples.set_intercept(file.said.intercept);
  }
  if (!samples.index_to_mm().empty()) return;
  const std::optional<Placement> place = place_of(file.said, reading);
  if (place) set_place(*place, samples);
  const bool says_place = !reading.spacing.empty() || !reading.origin.empty();
  if (!place && !reading.fills_box) {
    loaded.note(echoed(path) +
                " doesn't say where its samples lie: they fill the box round the part. spacing= and origin= place "
                "them, fill says that this is meant");
  }
  if (place && !says_place && file.said.is_lps && !reading.is_ras) {
    loaded.note(echoed(path) +
                " lies as a patient does: x to the left, y to the back, z to the head (LPS), as 3D Slicer saves "
                "meshes; ras takes x to the right and y to the front");
  }
  if (!reading.spacing.empty() && file.said.mm_of_index) {
    loaded.note(echoed(path) + " says where its samples lie, and spacing= takes the place of that");
  }
}

/// A file whose name ends in what looks like an option may not be what is meant.
void require_options(const std::string& path) {
  std::error_code unknown;
  const std::size_t colon = path.rfind(':');
  if (colon == std::string::npos || std::filesystem::exists(path, unknown)) return;
  if (!std::filesystem::exists(path.substr(0, colon), unknown)) return;
  throw UsageError("--volume: '" + echoed(path.substr(colon + 1)) +
                   "' isn't an option; they are outside=VALUE, nearest, channel=N, spacing=MM or X,Y,Z, origin=X,Y,Z, "
                   "fill, ras and xyz");
}

}  // namespace

v1::Field parse_volume(std::string_view text, LoadedVolumes& loaded) {
  constexpr std::string_view kWorld = "world:";
  v1::Field field;
  std::string_view rest = text;
  if (rest.starts_with(kWorld)) {
    field.set_frame(v1::FIELD_FRAME_WORLD);
    rest.remove_prefix(kWorld.size());
  }
  const std::size_t equals = rest.find('=');
  if (equals == std::string_view::npos || equals == 0) throw UsageError(kForm + std::string(text) + "'");
  field.set_name(std::string(rest.substr(0, equals)));
  rest.remove_prefix(equals + 1);
  Reading reading;
  v1::VolumeSamples& samples = *field.mutable_volume();
  for (std::size_t colon = rest.rfind(':'); colon != std::string_view::npos; colon = rest.rfind(':')) {
    if (!take_word(rest.substr(colon + 1), samples, reading)) break;
    rest = rest.substr(0, colon);
  }
  if (rest.empty()) throw UsageError(kForm + std::string(text) + "'");
  require_options(std::string(rest));
  load(std::string(rest), reading, samples, loaded);
  return field;
}

const LoadedVolumes::File& LoadedVolumes::read(const std::string& path, bool axes_are_xyz) {
  for (const auto& file : files_) {
    if (file->path == path && file->axes_are_xyz == axes_are_xyz) return *file;
  }
  VolumeFile file = read_volume_file(path, {.axes_are_xyz = axes_are_xyz});
  for (const std::string& each : file.notes) note(echoed(path) + ": " + each);
  std::shared_ptr<const client::MeshBytes> bytes = packed(file);
  file.samples = {};
  files_.push_back(std::make_unique<File>(File{path, axes_are_xyz, std::move(file), std::move(bytes)}));
  return *files_.back();
}

void LoadedVolumes::note(const std::string& note) {
  if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(note);
}

void load_volumes_of_job(const std::string& job_file, const std::vector<std::string>& options, v1::SliceJob& job,
                         LoadedVolumes& loaded) {
  if (job_file.empty()) return;
  for (v1::Field& field : *job.mutable_fields()) {
    if (!field.has_volume() || client::is_mesh_id(field.volume().volume_id())) continue;
    if (field.volume().volume_id().empty()) {
      throw UsageError("--job: field '" + echoed(field.name()) + "' has no volume_id; give it an id or a path");
    }
    load(mesh_path(job_file, field.volume().volume_id()), {}, *field.mutable_volume(), loaded);
  }
  for (const std::string& text : options) {
    const v1::Field stand_in = parse_volume(text, loaded);
    const auto named = std::ranges::find(job.fields(), stand_in.name(), &v1::Field::name);
    if (named == job.fields().end() || !named->has_volume()) {
      throw UsageError("--volume: the job in " + echoed(job_file) + " has no volume '" + echoed(stand_in.name()) + "'");
    }
    if (named->volume().volume_id() == stand_in.volume().volume_id()) continue;
    throw UsageError("--volume: '" + echoed(stand_in.name()) + "' of the job in " + echoed(job_file) + " is " +
                     echoed(named->volume().volume_id()) + ", and the file is " + stand_in.volume().volume_id() +
                     "; give the file that the job was written with");
  }
}

void put_volumes_on_server(Session& session, const std::string& mesh_id, const LoadedVolumes& loaded) {
  if (!session.quiet()) {
    for (const std::string& note : loaded.notes()) print_note("note: " + note);
  }
  for (const auto& file : loaded.files()) {
    std::optional<Progress> sending;
    const auto report = [&](std::uint64_t sent, std::uint64_t total) {
      if (!sending) sending.emplace("uploading", "bytes", total, session.quiet());
      sending->update(sent);
    };
    session.client().ensure_uploaded(file->bytes, report, session.call(), {}, mesh_id);
  }
}

}  // namespace ccslice::cli
