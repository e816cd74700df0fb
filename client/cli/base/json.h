// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// JSON text, piece by piece.

#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace ccslice::cli {

/// Writes one JSON document, in order. Numbers keep all their digits; NaN and infinity, which JSON lacks, become null.
class JsonWriter {
 public:
  JsonWriter& begin_object();
  JsonWriter& end_object();
  JsonWriter& begin_array();
  JsonWriter& end_array();
  JsonWriter& key(std::string_view name);

  JsonWriter& value(std::string_view text);
  JsonWriter& value(const char* text) { return value(std::string_view(text)); }
  JsonWriter& value(double number);
  JsonWriter& value(bool truth);
  template <typename Integer>
  requires std::is_integral_v<Integer> JsonWriter& value(Integer number) {
    separate();
    text_ += std::to_string(number);
    return *this;
  }
  /// `json`: a whole document, taken as it is.
  JsonWriter& raw(std::string_view json);
  template <typename T>
  JsonWriter& member(std::string_view name, const T& content) {
    return key(name).value(content);
  }

  const std::string& text() const& { return text_; }
  std::string text() && { return std::move(text_); }

 private:
  void separate();

  std::string text_;
  bool fresh_ = true;  // No comma before what comes next.
};

/// The shortest decimal that reads back as the same number.
std::string shortest(double number);
std::string shortest(float number);

}  // namespace ccslice::cli
