// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/xml.h"

namespace ccslice::cli {

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

/// Characters that XML doesn't have become '?'.
void XmlWriter::append_escaped(std::string_view text) {
  for (const char c : text) {
    switch (c) {
      case '&': text_ += "&amp;"; break;
      case '<': text_ += "&lt;"; break;
      case '>': text_ += "&gt;"; break;
      case '"': text_ += "&quot;"; break;
      default: text_ += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
  }
}

}  // namespace ccslice::cli
