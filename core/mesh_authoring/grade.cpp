// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/grade.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_authoring/boundary_distance.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::string_view kHowTo =
    "; write NAME=FIELD[:OPTION]..., for example stiffness=z, hardness=x:20..95, dye=radial:z, "
    "dye=radial:1..0:@0,0,12.5, skin=distance:90..30:2.5 or load=file:load.txt";

[[noreturn]] void refuse(std::string_view grade, const std::string& why) {
  throw Error(ErrorCode::kParameterInvalid, "grade '" + std::string(grade) + "': " + why + std::string(kHowTo),
              "grade");
}

std::optional<int> axis_of(std::string_view text) {
  if (text.size() != 1 || text[0] < 'x' || text[0] > 'z') return std::nullopt;
  return text[0] - 'x';
}

std::optional<double> number_of(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc() && end == text.data() + text.size() && !text.empty();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at != std::string_view::npos;) {
    const std::size_t end = text.find(separator, at);
    parts.push_back(text.substr(at, end - at));
    at = end == std::string_view::npos ? end : end + 1;
  }
  return parts;
}

bool is_radial(GradeField field) { return field >= GradeField::kRadialX && field <= GradeField::kRadialPoint; }

GradeField parse_field(std::string_view grade, std::string_view text) {
  if (const auto axis = axis_of(text)) return static_cast<GradeField>(*axis);
  if (text == "radial") return GradeField::kRadialPoint;
  if (text == "distance") return GradeField::kDistance;
  refuse(grade, "the field is x, y, z, radial, distance or file, not '" + std::string(text) + "'");
}

Vec3 parse_centre(std::string_view grade, std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ',');
  Vec3 centre = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<double> value = parts.size() == 3 ? number_of(parts[i]) : std::nullopt;
    if (!value) refuse(grade, "a centre is three numbers in mm, as in @0,0,12.5, not '@" + std::string(text) + "'");
    centre[static_cast<Eigen::Index>(i)] = *value;
  }
  return centre;
}

void parse_range(std::string_view grade, std::string_view text, Grade& out) {
  const std::size_t dots = text.find("..");
  const std::optional<double> first = number_of(text.substr(0, dots));
  const std::optional<double> last = number_of(text.substr(dots + 2));
  if (!first || !last) refuse(grade, "values are two numbers, as in 0..1, not '" + std::string(text) + "'");
  out.first = *first;
  out.last = *last;
}

void parse_option(std::string_view grade, std::string_view option, Grade& out) {
  if (option.find("..") != std::string_view::npos) return parse_range(grade, option, out);
  if (const auto depth = number_of(option); depth && out.field == GradeField::kDistance) {
    if (!(*depth > 0)) refuse(grade, "the depth is more than 0 mm, not '" + std::string(option) + "'");
    out.depth_mm = *depth;
    return;
  }
  const bool centre = !option.empty() && option.front() == '@';
  const std::optional<int> axis = axis_of(option);
  if (!centre && !axis) {
    refuse(grade, "'" + std::string(option) +
                      "' is neither values (0..1), nor an axis (x, y, z) or a centre (@X,Y,Z) of a radial grade, nor "
                      "the depth of a grade by distance");
  }
  if (!is_radial(out.field)) refuse(grade, "'" + std::string(option) + "' is for radial grades only");
  if (centre) {
    out.centre_mm = parse_centre(grade, option.substr(1));
  } else {
    out.field = static_cast<GradeField>(static_cast<int>(GradeField::kRadialX) + *axis);
  }
}

/// The coordinate or distance that the grade runs over.
double measure(GradeField field, const Vec3& position, const Vec3& centre) {
  if (!is_radial(field)) return position[static_cast<int>(field)];
  Vec3 offset = position - centre;
  if (field != GradeField::kRadialPoint) offset[static_cast<int>(field) - static_cast<int>(GradeField::kRadialX)] = 0;
  return offset.norm();
}

/// Of vertices, and then, unless they are distances, of mid-nodes.
std::vector<double> measure_all(const Grade& grade, const ControlMesh& mesh) {
  if (grade.field == GradeField::kDistance) return distances_to_boundary(mesh);
  Box3 box;
  for (const auto* positions : {&mesh.positions, &mesh.mid_nodes.positions}) {
    for (const Vec3& position : *positions) box.extend(position);
  }
  const Vec3 centre = grade.centre_mm.value_or(box.center());
  std::vector<double> measures;
  measures.reserve(mesh.vertex_count() + mesh.mid_nodes.positions.size());
  for (const auto* positions : {&mesh.positions, &mesh.mid_nodes.positions}) {
    for (const Vec3& position : *positions) measures.push_back(measure(grade.field, position, centre));
  }
  return measures;
}

std::vector<float> values_by_measure(const Grade& grade, const std::vector<double>& measures) {
  const auto [least, greatest] = std::minmax_element(measures.begin(), measures.end());
  const double start = grade.field == GradeField::kDistance ? 0 : *least;
  const double span = grade.depth_mm.value_or(*greatest - start);
  std::vector<float> values;
  values.reserve(measures.size());
  for (const double value : measures) {
    const double fraction = span > 0 ? std::min((value - start) / span, 1.0) : 0;
    values.push_back(static_cast<float>(std::lerp(grade.first, grade.last, fraction)));
  }
  return values;
}

std::vector<float> parse_values(std::string_view text, std::size_t count) {
  std::vector<float> values;
  TextScanner scanner(text);
  for (std::size_t vertex = 0; vertex < count; ++vertex) {
    values.push_back(
        scanner.real_float("the value of vertex " + std::to_string(vertex) + " of " + std::to_string(count)));
  }
  if (!scanner.at_end()) {
    scanner.fail("no more than " + std::to_string(count) + " values, one for each vertex", scanner.peek());
  }
  return values;
}

std::vector<float> values_from_file(const std::string& path, std::size_t count) {
  constexpr std::uint64_t kMaxBytesPerValue = 1024;  // Comments and all.
  const std::string text = read_file_bytes(path, kMaxBytesPerValue * (count + 1));
  try {
    return parse_values(text, count);
  } catch (const Error& error) {
    throw Error(error.code(), path + ": " + error.what());
  }
}

}  // namespace

Grade parse_grade(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) refuse(text, "there is no '='");
  if (equals == 0) refuse(text, "the channel has no name");
  constexpr std::string_view kFile = "file:";
  const std::string_view how = text.substr(equals + 1);
  Grade grade;
  grade.channel = std::string(text.substr(0, equals));
  if (how.starts_with(kFile)) {
    grade.field = GradeField::kFile;
    grade.path = std::string(how.substr(kFile.size()));
    if (grade.path.empty()) refuse(text, "the file has no name");
    return grade;
  }
  const std::vector<std::string_view> parts = split(how, ':');
  grade.field = parse_field(text, parts.front());
  for (std::size_t i = 1; i < parts.size(); ++i) parse_option(text, parts[i], grade);
  return grade;
}

double apply_grade(const Grade& grade, ControlMesh& mesh) {
  if (std::find(mesh.channel_names.begin(), mesh.channel_names.end(), grade.channel) != mesh.channel_names.end()) {
    throw Error(ErrorCode::kMeshBadChannel, "the mesh has a channel '" + grade.channel + "' already", "channel_names");
  }
  const bool from_file = grade.field == GradeField::kFile;
  const std::vector<double> measures = from_file ? std::vector<double>() : measure_all(grade, mesh);
  NamedChannel channel{grade.channel, from_file ? values_from_file(grade.path, mesh.vertex_count())
                                                : values_by_measure(grade, measures)};
  if (channel.values.size() > mesh.vertex_count()) {
    const auto mid_values = channel.values.begin() + static_cast<std::ptrdiff_t>(mesh.vertex_count());
    channel.mid_values.assign(mid_values, channel.values.end());
    channel.values.erase(mid_values, channel.values.end());
  }
  append_channels({&channel, 1}, mesh);
  return grade.field == GradeField::kDistance ? *std::max_element(measures.begin(), measures.end()) : 0;
}

}  // namespace ccslice
