// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/volumes/read_volume_file.h"

#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "client/cli/volumes/image_stack.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/volume_files/header_lines.h"
#include "core/volume_files/read_meta_image.h"
#include "core/volume_files/read_nifti.h"
#include "core/volume_files/read_npy.h"
#include "core/volume_files/read_nrrd.h"
#include "core/volume_files/unzip.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Compares names by their numbers: slice_9 comes before slice_10.
bool comes_before(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  const auto number = [](std::string_view text, std::size_t& at) {
    const std::size_t zeros = std::min(text.find_first_not_of('0', at), text.size());
    const std::size_t end = std::min(text.find_first_not_of("0123456789", at), text.size());
    at = end;
    return text.substr(std::min(zeros, end), end - std::min(zeros, end));
  };
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string_view m = number(a, i), n = number(b, j);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i;
      ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

bool is_picture(const fs::path& path) { return lower_case(path.extension().string()) == ".png"; }

/// The pictures in a folder whose names match the pattern, and how many other files there are.
VolumeFile read_pictures(const fs::path& folder, const std::string& pattern) {
  std::vector<std::string> paths;
  std::error_code error;
  std::size_t others = 0;
  for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    if (!is_picture(path)) {
      ++others;
    } else if (::fnmatch(pattern.c_str(), path.filename().c_str(), FNM_PERIOD) == 0) {
      paths.push_back(path.string());
    }
  }
  if (error) throw Error(ErrorCode::kFileUnreadable, "can't be read: " + error.message());
  if (paths.empty()) {
    throw Error(
        ErrorCode::kFileUnsupported,
        "no .png pictures there; turn DICOM series into one file with dcm2niix, and other pictures into PNG, first");
  }
  std::ranges::sort(paths, comes_before);
  VolumeFile file = read_image_stack(paths);
  if (others > 0 && pattern == "*") {
    file.notes.push_back(std::to_string(others) + " files of the folder aren't pictures, and are left out");
  }
  return file;
}

VolumeFile read_bytes(const std::string& path, const VolumeFileOptions& options) {
  const std::string bytes = read_file_bytes(path, kMostVolumeBytes);
  const std::string_view begin = std::string_view(bytes).substr(0, 512);
  if (options.axes_are_xyz && !begin.starts_with("\x93NUMPY")) {
    throw Error(ErrorCode::kFileUnsupported, "the order x, y, z is for .npy files; others say theirs: leave xyz out");
  }
  if (begin.starts_with("NRRD")) return read_nrrd(bytes, path);
  if (begin.starts_with("\x93NUMPY")) return read_npy(bytes, options.axes_are_xyz);
  if (is_nifti(bytes) || (is_gzip(bytes) && is_nifti(unzip(bytes, 348, "the file")))) return read_nifti(bytes);
  if (begin.find("NDims") != std::string_view::npos || begin.find("ObjectType") != std::string_view::npos) {
    return read_meta_image(bytes, path);
  }
  if (begin.starts_with("\x89PNG")) return read_image_stack({path});
  std::string remedy = "save it as .nrrd, .mha, .nii.gz or .npy";
  if (begin.size() >= 132 && begin.substr(128, 4) == "DICM")
    remedy = "a DICOM file: turn its series into one .nii.gz with dcm2niix";
  if (begin.starts_with("II*\0"sv) || begin.starts_with("MM\0*"sv)) {
    remedy =
        "a TIFF file: `convert stack.tif slice_%04d.png` (apt install imagemagick) makes a folder of PNG pictures of "
        "it";
  }
  if (begin.starts_with(" BDV"sv)) remedy = "an OpenVDB file, which isn't read: save a dense array of it as .npy";
  throw Error(ErrorCode::kFileUnsupported, "not a volume that can be read; " + remedy);
}

}  // namespace

VolumeFile read_volume_file(const std::string& path, const VolumeFileOptions& options) {
  std::error_code unknown;
  try {
    if (fs::is_directory(path, unknown)) return read_pictures(path, "*");
    const fs::path file(path);
    const bool is_pattern = file.filename().string().find('*') != std::string::npos && !fs::exists(path, unknown);
    return is_pattern ? read_pictures(file.parent_path(), file.filename()) : read_bytes(path, options);
  } catch (const Error& error) {
    if (std::string_view(error.what()).starts_with(echoed(path))) throw;
    throw Error(error.code(), echoed(path) + ": " + error.what(), error.field(), error.ids());
  }
}

}  // namespace ccslice::cli
