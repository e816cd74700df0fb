// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_file.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice::cli {
namespace {

constexpr std::uint64_t kMostBytes = 256 << 20;  // Maps of 64 MiB, in decimals.

std::string text_of(const v1::SliceJob& job) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(job, &json, options);
  if (!status.ok()) throw Error(ErrorCode::kInternal, "a job can't be written: " + status.ToString());
  return json;
}

/// The name of the first member of a JSON object that begins so; empty if there is none.
std::string first_member(std::string_view json) {
  const auto skip_blanks = [&] { json.remove_prefix(std::min(json.find_first_not_of(" \t\r\n"), json.size())); };
  skip_blanks();
  if (!json.starts_with('{')) return {};
  json.remove_prefix(1);
  skip_blanks();
  if (!json.starts_with('"')) return {};
  json.remove_prefix(1);
  return std::string(json.substr(0, std::min(json.find('"'), json.size())));
}

}  // namespace

bool is_job_file(const std::string& path) {
  constexpr std::size_t kBeginning = 4096;
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;
  std::string beginning(kBeginning, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(beginning.data(), kBeginning);
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  const std::string member = first_member(without_utf8_mark(beginning));
  const google::protobuf::Descriptor& job = *v1::SliceJob::descriptor();
  return job.FindFieldByName(member) != nullptr || job.FindFieldByCamelcaseName(member) != nullptr;
}

v1::SliceJob read_job_file(const std::string& path) {
  const std::string bytes = read_file_bytes(path, kMostBytes);
  const std::string_view json = without_utf8_mark(bytes);
  if (is_nested_too_deep(json)) {
    throw UsageError("--job: " + echoed(path) +
                     " isn't a SliceJob in JSON: its brackets are nested deeper than those of any job");
  }
  v1::SliceJob job;
  const auto status =
      google::protobuf::util::JsonStringToMessage(google::protobuf::StringPiece(json.data(), json.size()), &job);
  if (!status.ok()) {
    throw UsageError("--job: " + echoed(path) +
                     " isn't a SliceJob in JSON: " + echoed(std::string(status.message()), kMaxMessageBytes));
  }
  if (job.parts().empty()) throw UsageError("--job: " + echoed(path) + " has no parts");
  return job;
}

void write_job_file(const std::string& path, const v1::SliceJob& job) {
  const std::string json = text_of(job);
  std::error_code unknown;
  if (std::filesystem::exists(path, unknown)) {
    if (read_file_bytes(path, kMostBytes) == json) return;
    throw Error(ErrorCode::kFileUnwritable,
                "--write-job: " + echoed(path) + " is there already, with something else in it; remove it first");
  }
  write_file(path, json);
}

void replace_job_file(const std::string& path, const v1::SliceJob& job) { write_file(path, text_of(job)); }

std::string mesh_name_beside(const std::string& job_file, const std::string& mesh) {
  std::error_code error;
  const auto folder = std::filesystem::absolute(job_file, error).parent_path();
  const auto file = std::filesystem::absolute(mesh, error);
  const auto relative = std::filesystem::proximate(file, folder, error);
  return error ? file.string() : relative.string();
}

std::string mesh_path(const std::string& job_file, const std::string& mesh_id) {
  return (std::filesystem::path(job_file).parent_path() / mesh_id).string();
}

}  // namespace ccslice::cli
