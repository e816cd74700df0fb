// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program, run against a server in this process.

#pragma once

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/base/output_file.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/mesh_bytes.h"
#include "core/models/models.h"
#include "server/rpc/server/server.h"
#include "server/service/base/logging.h"
#include "tests/client/local_server.h"
#include "tests/client/process.h"

namespace ccslice::client {

namespace fs = std::filesystem;

/// The value at a path of members such as "mesh.control_cells", or "parts.0.name" of items of a list; a null value if
/// the text is no JSON object.
inline google::protobuf::Value json_at(const std::string& text, const std::string& path) {
  google::protobuf::Value value;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(text, &value).ok()) << text;
  for (std::size_t at = 0; at <= path.size();) {
    const std::size_t end = std::min(path.find('.', at), path.size());
    const std::string name = path.substr(at, end - at);
    google::protobuf::Value inner;
    if (const auto& fields = value.struct_value().fields(); fields.contains(name)) {
      inner = fields.at(name);
    } else if (const auto& items = value.list_value().values();
               !items.empty() && name.find_first_not_of("0123456789") == std::string::npos &&
               std::stoi(name) < items.size()) {
      inner = items[std::stoi(name)];
    } else {
      ADD_FAILURE() << "no " << path << " in " << text;
      return {};
    }
    value = inner;
    at = end + 1;
  }
  return value;
}

class CommandLine : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    server::set_up_logging(server::LogLevel::kWarning, server::LogFormat::kText);
    server_ = std::make_unique<server::Server>(local_server_options());
  }
  static void TearDownTestSuite() { server_.reset(); }

  CommandLine() { cli::write_file(box_, MeshBytes(cli::to_proto(make_box())).bytes()); }

  std::unique_ptr<Process> start(std::vector<std::string> arguments, const std::string& address) {
    arguments.insert(arguments.begin(), CCSLICE_BINARY);
    if (!address.empty()) arguments.push_back("--server=" + address);
    return std::make_unique<Process>(arguments, folder_.path());
  }
  ProcessResult run(const std::vector<std::string>& arguments) { return start(arguments, server_->address())->wait(); }
  ProcessResult run_alone(const std::vector<std::string>& arguments) { return start(arguments, "")->wait(); }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::size_t files_in(const std::string& name) const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_.path() / name), fs::directory_iterator()));
  }

  static inline std::unique_ptr<server::Server> server_;
  TemporaryFolder folder_;
  const std::string box_ = path("box.ccmesh");
};

}  // namespace ccslice::client
