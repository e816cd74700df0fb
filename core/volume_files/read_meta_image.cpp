// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_meta_image.h"

#include <algorithm>
#include <cstdint>
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

RawFormat meta_format(std::string type, const HeaderLines& lines) {
  static const std::map<std::string, RawFormat, std::less<>> kTypes = {
      {"MET_CHAR", {Kind::kSigned, 1}},      {"MET_UCHAR", {Kind::kUnsigned, 1}},
      {"MET_SHORT", {Kind::kSigned, 2}},     {"MET_USHORT", {Kind::kUnsigned, 2}},
      {"MET_INT", {Kind::kSigned, 4}},       {"MET_UINT", {Kind::kUnsigned, 4}},
      {"MET_LONG", {Kind::kSigned, 4}},      {"MET_ULONG", {Kind::kUnsigned, 4}},
      {"MET_LONG_LONG", {Kind::kSigned, 8}}, {"MET_ULONG_LONG", {Kind::kUnsigned, 8}},
      {"MET_FLOAT", {Kind::kFloat, 4}},      {"MET_DOUBLE", {Kind::kFloat, 8}},
  };
  constexpr std::string_view kArray = "_ARRAY";
  if (type.ends_with(kArray)) type.resize(type.size() - kArray.size());
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) lines.fail("ElementType: " + in_quotes(printable(type)) + " isn't a type of numbers");
  return found->second;
}

class MetaImageReader {
 public:
  MetaImageReader(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path), lines_(bytes) {}

  VolumeFile read() {
    read_header();
    const auto axes = static_cast<std::size_t>(axes_);
    if (axes < 2 || axes > 3) {
      throw Error(ErrorCode::kFileUnsupported, "NDims: " + std::to_string(axes_) + "; a volume has 2 or 3");
    }
    if (sizes_.size() != axes) throw Error(ErrorCode::kFileSyntax, "DimSize: not as many as NDims says");
    std::ranges::copy(sizes_, file_.shape.samples.begin());
    file_.shape.channels = channels_;
    if (axes == 3) set_place();
    set_samples();
    return std::move(file_);
  }

 private:
  void read_header() {
    while (!lines_.at_end() && data_name_.empty()) {
      const std::string_view line = lines_.next();
      if (line.empty()) continue;
      const std::size_t equals = line.find('=');
      if (equals == std::string_view::npos) lines_.fail("expected KEY = VALUE, found " + in_quotes(printable(line)));
      read_value(std::string(trimmed(line.substr(0, equals))), trimmed(line.substr(equals + 1)));
    }
    for (const char* key : {"NDims", "DimSize", "ElementType", "ElementDataFile"}) {
      if (!seen_.contains(key)) throw Error(ErrorCode::kFileSyntax, std::string("the header lacks ") + key);
    }
  }

  void read_value(const std::string& key, std::string_view value) {
    seen_.insert(key);
    if (key == "ObjectType" && lower_case(value) != "image") {
      throw Error(ErrorCode::kFileUnsupported, "ObjectType: " + echoed(std::string(value)) + " isn't an image");
    }
    if (key == "NDims") axes_ = counts_of(value, 1, lines_).front();
    if (key == "DimSize") sizes_ = counts_of(value, 0, lines_);
    if (key == "ElementType") format_ = meta_format(std::string(value), lines_);
    if (key == "ElementNumberOfChannels") channels_ = counts_of(value, 1, lines_).front();
    if (key == "BinaryData") is_text_ = !is_true(value);
    if (key == "BinaryDataByteOrderMSB" || key == "ElementByteOrderMSB") is_big_endian_ = is_true(value);
    if (key == "CompressedData") is_packed_ = is_true(value);
    if (key == "HeaderSize") {
      header_bytes_ = value == "-1" ? std::nullopt : std::optional<std::uint64_t>(counts_of(value, 1, lines_).front());
    }
    if (key == "ElementSpacing") spacing_ = numbers_of(value, 0, lines_);
    if (key == "ElementSize" && spacing_.empty()) spacing_ = numbers_of(value, 0, lines_);
    if (key == "Offset" || key == "Position" || key == "Origin") offset_ = numbers_of(value, 0, lines_);
    if (key == "TransformMatrix" || key == "Rotation" || key == "Orientation") matrix_ = numbers_of(value, 0, lines_);
    if (key == "ElementDataFile") data_name_ = std::string(value);
  }

  bool is_true(std::string_view value) const {
    const std::string lower = lower_case(value);
    if (lower == "true" || lower == "1") return true;
    if (lower == "false" || lower == "0") return false;
    lines_.fail("expected True or False, found " + in_quotes(printable(value)));
  }

  void set_place() {
    if (spacing_.empty() && offset_.empty() && matrix_.empty()) return;
    const auto require = [](const std::vector<double>& numbers, std::size_t count, const std::string& key) {
      if (numbers.empty() || numbers.size() == count) return;
      throw Error(ErrorCode::kFileSyntax, key + ": expected " + std::to_string(count) + " numbers");
    };
    require(spacing_, 3, "ElementSpacing");
    require(offset_, 3, "Offset");
    require(matrix_, 9, "TransformMatrix");
    Placement place = Placement::Identity();
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      for (int x = 0; !matrix_.empty() && x < 3; ++x) {
        place.linear()(x, axis) = matrix_[3 * a + static_cast<std::size_t>(x)];
      }
      if (!spacing_.empty()) place.linear().col(axis) *= spacing_[a];
      if (!offset_.empty()) place.translation()[axis] = offset_[a];
    }
    file_.mm_of_index = place;
    file_.is_lps = true;
  }

  void set_samples() {
    const std::uint64_t wanted = raw_bytes(file_.shape, format_);
    format_.big_endian = is_big_endian_;
    std::string detached;
    std::string_view data = bytes_.substr(lines_.offset());
    if (data_name_ == "LIST" || data_name_.starts_with("LIST ") || data_name_.find('%') != std::string::npos) {
      throw Error(ErrorCode::kFileUnsupported,
                  "the samples are in several files; save the volume as one .mha with 3D Slicer or ITK");
    }
    if (data_name_ != "LOCAL") {
      detached = read_data_file(path_, data_name_, kMostVolumeBytes);
      data = detached;
      if (header_bytes_) data = data.substr(std::min<std::uint64_t>(*header_bytes_, data.size()));
    }
    if (is_text_) return take_text(data, {}, file_);
    std::string unpacked;
    if (is_packed_) {
      unpacked = unzip(data, wanted, "the samples");
      data = unpacked;
    }
    if (!header_bytes_) data = data.substr(data.size() - std::min<std::uint64_t>(wanted, data.size()));
    take_samples(whole_samples(data, wanted), format_, {}, file_);
  }

  std::string_view bytes_;
  const std::string& path_;
  HeaderLines lines_;
  VolumeFile file_;
  std::set<std::string> seen_;
  std::uint32_t axes_ = 0, channels_ = 1;
  std::vector<std::uint32_t> sizes_;
  RawFormat format_;
  bool is_text_ = false, is_big_endian_ = false, is_packed_ = false;
  std::optional<std::uint64_t> header_bytes_ = 0;  // Nothing: the samples are at the end.
  std::vector<double> spacing_, offset_, matrix_;
  std::string data_name_;
};

}  // namespace

VolumeFile read_meta_image(std::string_view bytes, const std::string& path) {
  return MetaImageReader(bytes, path).read();
}

}  // namespace ccslice
