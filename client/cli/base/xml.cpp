// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/xml.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/utf8.h"

namespace ccslice::cli {
namespace {

bool is_in_xml(std::string_view sequence) {
  constexpr std::uint32_t kNoCharacters = 0xfffe;
  const std::uint32_t code = utf8_code_point(sequence);
  return (code >= 0x20 && (code | 1) != (kNoCharacters | 1)) || code == '\t' || code == '\n' || code == '\r';
}

}  // namespace

std::string xml_characters(std::string_view text) {
  std::string written;
  written.reserve(text.size());
  while (!text.empty()) {
    const auto plain = std::find_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; });
    written.append(text.begin(), plain);
    text.remove_prefix(static_cast<std::size_t>(plain - text.begin()));
    if (text.empty()) break;
    const std::size_t length = utf8_sequence_length(text);
    const std::string_view sequence = text.substr(0, std::max<std::size_t>(length, 1));
    written += length > 0 && is_in_xml(sequence) ? sequence : "?";
    text.remove_prefix(sequence.size());
  }
  return written;
}

XmlWriter& XmlWriter::begin(std::string_view name) {
  close_tag();
  text_ += "\n<";
  text_ += name;
  open_.emplace_back(name);
  tag_open_ = true;
  return *this;
}

XmlWriter& XmlWriter::attribute(std::string_view name, std::string_view value) {
  text_ += ' ';
  text_ += name;
  text_ += "=\"";
  append_escaped(value);
  text_ += '"';
  return *this;
}

XmlWriter& XmlWriter::end() {
  if (tag_open_) {
    text_ += "/>";
    tag_open_ = false;
  } else {
    text_ += "</" + open_.back() + ">";
  }
  open_.pop_back();
  return *this;
}

XmlWriter& XmlWriter::text(std::string_view content) {
  close_tag();
  append_escaped(content);
  return *this;
}

XmlWriter& XmlWriter::element(std::string_view name, std::string_view content) {
  return begin(name).text(content).end();
}

void XmlWriter::close_tag() {
  if (tag_open_) text_ += '>';
  tag_open_ = false;
}

void XmlWriter::append_escaped(std::string_view text) {
  for (const char c : xml_characters(text)) {
    switch (c) {
      case '&': text_ += "&amp;"; break;
      case '<': text_ += "&lt;"; break;
      case '>': text_ += "&gt;"; break;
      case '"': text_ += "&quot;"; break;
      // As they are, readers would take these for blanks in an attribute.
      case '\t': text_ += "&#9;"; break;
      case '\n': text_ += "&#10;"; break;
      case '\r': text_ += "&#13;"; break;
      default: text_ += c;
    }
  }
}

}  // namespace ccslice::cli
