// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_file.h"

#include <google/protobuf/util/json_util.h>

#include <cstdint>
#include <filesystem>
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

}  // namespace

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

std::string mesh_path(const std::string& job_file, const std::string& mesh_id) {
  return (std::filesystem::path(job_file).parent_path() / mesh_id).string();
}

}  // namespace ccslice::cli
