// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a file is that isn't read, and what makes a file of it that is.

#pragma once

#include <string>
#include <string_view>

namespace ccslice {

/// Whether a file whose first word is a keyword with a star, as of Abaqus, is one of LS-DYNA's.
bool is_ls_dyna(std::string_view bytes);

/// "this is ..., which is not read; ...", or nothing if the format isn't known.
std::string name_unread_format(std::string_view bytes);

/// The same of XML, by its outermost element.
std::string name_unread_xml(std::string_view element);

}  // namespace ccslice
