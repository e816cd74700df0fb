// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_nrrd.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/volume_files/data_file.h"
#include "core/volume_files/header_lines.h"
#include "core/volume_files/raw_samples.h"
#include "core/volume_files/unzip.h"

namespace ccslice {
namespace {

using Kind = RawFormat::Kind;

[[noreturn]] void unsupported(const std::string& what) { throw Error(ErrorCode::kFileUnsupported, what); }

RawFormat nrrd_format(const std::string& type, const HeaderLines& lines) {
  static const std::map<std::string, RawFormat, std::less<>> kTypes = [] {
    std::map<std::string, RawFormat, std::less<>> types;
    const auto add = [&](RawFormat format, std::initializer_list<const char*> names) {
      for (const char* name : names) types.emplace(name, format);
    };
    add({Kind::kSigned, 1}, {"signed char", "int8", "int8_t"});
    add({Kind::kUnsigned, 1}, {"uchar", "unsigned char", "uint8", "uint8_t"});
    add({Kind::kSigned, 2}, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"});
    add({Kind::kUnsigned, 2}, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"});
    add({Kind::kSigned, 4}, {"int", "signed int", "int32", "int32_t"});
    add({Kind::kUnsigned, 4}, {"uint", "unsigned int", "uint32", "uint32_t"});
    add({Kind::kSigned, 8},
        {"longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"});
    add({Kind::kUnsigned, 8}, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"});
    add({Kind::kFloat, 4}, {"float"});
    add({Kind::kFloat, 8}, {"double"});
    return types;
  }();
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) lines.fail("type: " + in_quotes(printable(type)) + " isn't a type of numbers");
  return found->second;
}

/// "(1,2,3) none (4,5,6)": nothing where it says none.
std::vector<std::optional<std::vector<double>>> vectors_of(std::string_view text, const HeaderLines& lines) {
  std::vector<std::optional<std::vector<double>>> vectors;
  for (std::string_view rest = trimmed(text); !rest.empty(); rest = trimmed(rest)) {
    if (lower_case(rest.substr(0, 4)) == "none") {
      vectors.emplace_back();
      rest.remove_prefix(4);
      continue;
    }
    const std::size_t end = rest.find(')');
    if (!rest.starts_with('(') || end == std::string_view::npos) {
      lines.fail("expected a vector such as (0.5,0,0), found " + in_quotes(printable(rest)));
    }
    std::string numbers(rest.substr(1, end - 1));
    std::ranges::replace(numbers, ',', ' ');
    vectors.emplace_back(numbers_of(numbers, 0, lines));
    rest.remove_prefix(end + 1);
  }
  return vectors;
}

/// The signs of x, y and z that turn a space to LPS. Nothing if it isn't a patient's.
std::optional<Vec3> to_lps(const std::string& space) {
  constexpr std::string_view kTime = "-time";
  std::string name = space;
  if (name.ends_with(kTime)) name.resize(name.size() - kTime.size());
  if (name == "rast" || name == "last" || name == "lpst") name.pop_back();
  if (name == "ras" || name == "right-anterior-superior") return Vec3(-1, -1, 1);
  if (name == "las" || name == "left-anterior-superior") return Vec3(1, -1, 1);
  if (name == "lps" || name == "left-posterior-superior") return Vec3(1, 1, 1);
  return std::nullopt;
}

/// Passes over so many lines.
std::string_view behind_lines(std::string_view bytes, std::uint32_t lines) {
  for (; lines > 0; --lines) {
    const std::size_t end = bytes.find('\n');
    if (end == std::string_view::npos) throw Error(ErrorCode::kFileSyntax, "line skip: there are fewer lines");
    bytes.remove_prefix(end + 1);
  }
  return bytes;
}

class NrrdReader {
 public:
  NrrdReader(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path), lines_(bytes) {}

  VolumeFile read() {
    read_header();
    const std::size_t channel_axis = set_shape();
    set_place();
    set_samples(channel_axis == sizes_.size() - 1 && channel_axis != 0);
    return std::move(file_);
  }

 private:
  void read_header() {
    if (!lines_.next().starts_with("NRRD000")) throw Error(ErrorCode::kFileSyntax, "line 1: not a NRRD file");
    while (!lines_.at_end()) {
      const std::string_view line = lines_.next();
      if (line.empty()) break;
      if (line.starts_with('#')) continue;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos) lines_.fail("expected FIELD: VALUE, found " + in_quotes(printable(line)));
      if (line.substr(colon).starts_with(":=")) continue;  // A key of the writer's own.
      read_field(lower_case(trimmed(line.substr(0, colon))), trimmed(line.substr(colon + 1)));
    }
    for (const char* field : {"dimension", "type", "encoding", "sizes"}) {
      if (!seen_.contains(field))
        throw Error(ErrorCode::kFileSyntax, std::string("the header lacks the field ") + field);
    }
  }

  void read_field(const std::string& field, std::string_view value) {
    seen_.insert(field);
    if (field == "dimension") dimension_ = counts_of(value, 1, lines_).front();
    if (field == "type") format_ = nrrd_format(lower_case(value), lines_);
    if (field == "encoding") encoding_ = lower_case(value);
    if (field == "endian") format_big_endian_ = read_endian(lower_case(value));
    if (field == "sizes") sizes_ = counts_of(value, 0, lines_);
    if (field == "space") space_ = lower_case(value);
    if (field == "space directions") directions_ = vectors_of(value, lines_);
    if (field == "space origin") origin_ = vectors_of(value, lines_);
    if (field == "spacings") read_spacings(value);
    if (field == "kinds") {
      for (const std::string_view kind : words_of(value)) kinds_.push_back(lower_case(kind));
    }
    if (field == "space units") {
      std::string words(value);
      std::ranges::replace(words, '"', ' ');
      for (const std::string_view unit : words_of(words)) units_.push_back(lower_case(unit));
    }
    if (field == "line skip" || field == "lineskip") line_skip_ = counts_of(value, 1, lines_).front();
    if (field == "byte skip" || field == "byteskip") {
      byte_skip_ = trimmed(value) == "-1" ? -1 : static_cast<std::int64_t>(counts_of(value, 1, lines_).front());
    }
    if (field == "data file" || field == "datafile") read_data_name(value);
  }

  bool read_endian(const std::string& endian) const {
    if (endian != "big" && endian != "little") lines_.fail("endian: expected big or little");
    return endian == "big";
  }

  void read_spacings(std::string_view value) {
    spacings_.clear();
    for (const std::string_view word : words_of(value)) {
      spacings_.push_back(lower_case(word) == "nan" ? std::nullopt
                                                    : std::optional(numbers_of(word, 1, lines_).front()));
    }
  }

  void read_data_name(std::string_view value) {
    const bool is_list = value.starts_with("LIST");
    const bool is_pattern = value.find('%') != std::string_view::npos && words_of(value).size() > 3;
    if (is_list || is_pattern) {
      unsupported("the samples are in several files; save the volume as one .nrrd with 3D Slicer or ITK");
    }
    data_name_ = std::string(value);
  }

  bool is_spatial(std::size_t axis) const {
    if (!directions_.empty()) return directions_[axis].has_value();
    const bool has_kinds = kinds_.size() == sizes_.size();
    const std::string kind = has_kinds ? kinds_[axis] : "???";
    if (kind == "domain" || kind == "space") return true;
    if (kind != "???" && kind != "none") return false;
    if (sizes_.size() <= 3) return true;
    return !spacings_.empty() && spacings_[axis].has_value();
  }

  /// The number of the axis of channels; that of all axes if there is none.
  std::size_t set_shape() {
    if (dimension_ != sizes_.size()) throw Error(ErrorCode::kFileSyntax, "sizes: not as many as the dimension says");
    for (const auto& [field, count] :
         {std::pair{"space directions", directions_.size()}, std::pair{"spacings", spacings_.size()}}) {
      if (count != 0 && count != sizes_.size()) {
        throw Error(ErrorCode::kFileSyntax, std::string(field) + ": not as many as there are axes");
      }
    }
    std::vector<std::size_t> spatial, others;
    for (std::size_t axis = 0; axis < sizes_.size(); ++axis) (is_spatial(axis) ? spatial : others).push_back(axis);
    if (spatial.size() > 3 || others.size() > 1 || spatial.empty()) {
      unsupported(std::to_string(sizes_.size()) + " axes, of which " + std::to_string(spatial.size()) +
                  " are of space; a volume has up to 3, and one of channels that kinds or space directions tell");
    }
    for (std::size_t axis = 0; axis < spatial.size(); ++axis) file_.shape.samples[axis] = sizes_[spatial[axis]];
    spatial_ = std::move(spatial);
    if (others.empty()) return sizes_.size();
    file_.shape.channels = sizes_[others.front()];
    if (others.front() == 0 || others.front() == sizes_.size() - 1) return others.front();
    unsupported("channels are on an axis in the middle; put that axis first or last");
  }

  void set_place() {
    if (spatial_.size() != 3) return;
    Placement place = Placement::Identity();
    if (!directions_.empty()) {
      for (int axis = 0; axis < 3; ++axis) {
        place.linear().col(axis) =
            vector_of(*directions_[spatial_[static_cast<std::size_t>(axis)]], "space directions");
      }
    } else if (!spacings_.empty()) {
      for (int axis = 0; axis < 3; ++axis) {
        place.linear()(axis, axis) = spacings_[spatial_[static_cast<std::size_t>(axis)]].value_or(1);
      }
    } else {
      return;
    }
    if (!origin_.empty() && origin_.front()) place.translation() = vector_of(*origin_.front(), "space origin");
    place = Eigen::Scaling(unit_mm()) * place;
    if (const std::optional<Vec3> signs = to_lps(space_)) {
      file_.is_lps = true;
      place = Eigen::Scaling(*signs) * place;
    }
    file_.mm_of_index = place;
  }

  /// Lengths in mm of the file's unit, which is mm unless it says otherwise.
  double unit_mm() {
    static const std::map<std::string, double, std::less<>> kUnits = {
        {"mm", 1},    {"millimeter", 1},     {"millimeters", 1}, {"cm", 10},   {"m", 1000},        {"meters", 1000},
        {"um", 1e-3}, {"micrometers", 1e-3}, {"microns", 1e-3},  {"nm", 1e-6}, {"\xc2\xb5m", 1e-3}};
    if (units_.empty()) return 1;
    const auto known = kUnits.find(units_.front());
    const bool is_one = std::ranges::all_of(units_, [&](const std::string& unit) { return unit == units_.front(); });
    if (known != kUnits.end() && is_one) return known->second;
    file_.notes.push_back("the space units " + echoed(units_.front()) + " aren't known and are taken for mm");
    return 1;
  }

  Vec3 vector_of(const std::vector<double>& numbers, const std::string& field) const {
    if (numbers.size() < 3) throw Error(ErrorCode::kFileSyntax, field + ": a vector of fewer than 3 numbers");
    return {numbers[0], numbers[1], numbers[2]};
  }

  void set_samples(bool channels_last) {
    RawFormat format = format_;
    format.big_endian = format_big_endian_;
    const bool is_text = encoding_ == "ascii" || encoding_ == "text" || encoding_ == "txt";
    if (!is_text && encoding_ != "raw" && encoding_ != "gzip" && encoding_ != "gz") {
      unsupported("encoding " + echoed(encoding_) + " isn't read; save the volume with gzip, or raw");
    }
    if (!is_text && format.bytes > 1 && !seen_.contains("endian")) {
      throw Error(ErrorCode::kFileSyntax, "the header lacks the field endian");
    }
    const std::uint64_t wanted = raw_bytes(file_.shape, format);
    std::string detached;
    std::string_view data = bytes_.substr(lines_.offset());
    if (!data_name_.empty()) {
      detached = read_data_file(path_, data_name_, kMostVolumeBytes);
      data = detached;
    }
    data = behind_lines(data, line_skip_);
    const RawOrder order{.channels_last = channels_last};
    if (is_text) return take_text(data, order, file_);
    std::string unpacked;
    if (encoding_ != "raw") {
      const auto skipped = static_cast<std::uint64_t>(byte_skip_);  // -1: the samples are at the end.
      unpacked = unzip(data, byte_skip_ < 0 ? kMostVolumeBytes : wanted + skipped, "the samples");
      data = unpacked;
    }
    if (byte_skip_ < 0) {
      data = data.substr(data.size() - std::min<std::uint64_t>(wanted, data.size()));
    } else {
      data = data.substr(std::min<std::uint64_t>(static_cast<std::uint64_t>(byte_skip_), data.size()));
    }
    take_samples(whole_samples(data, wanted), format, order, file_);
  }

  std::string_view bytes_;
  const std::string& path_;
  HeaderLines lines_;
  VolumeFile file_;
  std::set<std::string> seen_;
  std::uint32_t dimension_ = 0, line_skip_ = 0;
  std::int64_t byte_skip_ = 0;
  RawFormat format_;
  bool format_big_endian_ = false;
  std::string encoding_, space_, data_name_;
  std::vector<std::uint32_t> sizes_;
  std::vector<std::optional<std::vector<double>>> directions_, origin_;
  std::vector<std::optional<double>> spacings_;
  std::vector<std::string> kinds_, units_;
  std::vector<std::size_t> spatial_;
};

}  // namespace

VolumeFile read_nrrd(std::string_view bytes, const std::string& path) { return NrrdReader(bytes, path).read(); }

}  // namespace ccslice
