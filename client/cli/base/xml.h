// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// XML documents, for packages and meshes.

#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "client/cli/base/json.h"

namespace ccslice::cli {

/// The text with '?' for what no XML document can hold: control characters but tabs and line ends, U+FFFE and U+FFFF,
/// and bytes that aren't UTF-8 [XML 1.0, 2.2].
std::string xml_characters(std::string_view text);

/// Writes one XML document, in order. What no document can hold becomes '?', as in xml_characters().
class XmlWriter {
 public:
  XmlWriter() : text_("<?xml version=\"1.0\" encoding=\"UTF-8\"?>") {}

  XmlWriter& begin(std::string_view name);
  /// Adds an attribute to the element that was begun last. REQUIRES: the element is empty so far.
  XmlWriter& attribute(std::string_view name, std::string_view value);
  template <class Number>
  requires std::is_arithmetic_v<Number> XmlWriter& attribute(std::string_view name, Number value) {
    return attribute(name, number_text(value));
  }
  /// Characters inside of the element that was begun last.
  XmlWriter& text(std::string_view content);
  XmlWriter& end();
  /// A whole element that holds text only.
  XmlWriter& element(std::string_view name, std::string_view content);
  template <class Number>
  requires std::is_arithmetic_v<Number> XmlWriter& element(std::string_view name, Number value) {
    return element(name, number_text(value));
  }

  const std::string& text() const { return text_; }

 private:
  template <class Number>
  static std::string number_text(Number value) {
    if constexpr (std::is_integral_v<Number>) {
      return std::to_string(value);
    } else {
      return shortest(value);
    }
  }
  void close_tag();
  void append_escaped(std::string_view text);

  std::string text_;
  std::vector<std::string> open_;
  bool tag_open_ = false;
};

}  // namespace ccslice::cli
