// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/variables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ccslice {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string fault(const std::vector<const char*>& variables) {
  std::vector<const char*> environment = variables;
  environment.push_back(nullptr);
  return describe_unknown_variable(environment.data());
}

TEST(Variables, OfAllOurProgramsAreKnown) {
  EXPECT_EQ(fault({}), "");
  EXPECT_EQ(fault({"PATH=/usr/bin", "CCSLICED=/opt/ccsliced", "CCSLICE=/opt/ccslice", "ccslice_memory=1"}), "");
  EXPECT_EQ(fault({"CCSLICE_MEMORY=1GiB", "CCSLICE_SERVER=a:1", "CCSLICE_TOKEN_FILE=", "CCSLICE_FARM_FOLDER=/jobs",
                   "CCSLICE_SHARED_MESHES_DIR=/meshes", "CCSLICE_BUILD=build"}),
            "");
}

TEST(Variables, MisspelledOnesNameTheNearest) {
  EXPECT_EQ(
      fault({"CCSLICE_MEMORY=1GiB", "CCSLICE_MEMROY=1GiB"}),
      "no program of ccslice reads the environment variable CCSLICE_MEMROY; did you mean CCSLICE_MEMORY? Correct or "
      "unset it");
  EXPECT_THAT(fault({"CCSLICE_MESHSTORE=x"}), HasSubstr("did you mean CCSLICE_MESH_STORE?"));
  EXPECT_THAT(fault({"CCSLICE_SERVRE=x"}), HasSubstr("did you mean CCSLICE_SERVER?"));
  EXPECT_THAT(fault({"CCSLICE_DRAIN_DELAYS"}), HasSubstr("did you mean CCSLICE_DRAIN_DELAY?")) << "without a value";
  EXPECT_THAT(fault({"CCSLICE_CAA=x"}), HasSubstr("did you mean CCSLICE_CA?")) << "short ones";
}

TEST(Variables, UnlikeOnesNameNoOther) {
  const std::string unlike = fault({"CCSLICE_VERBOSITY=9"});
  EXPECT_THAT(unlike, HasSubstr("CCSLICE_VERBOSITY; ccsliced --help lists the server's: correct or unset it"));
  EXPECT_THAT(fault({"CCSLICE_=1"}), Not(HasSubstr("did you mean")));
  const std::string endless = "CCSLICE_" + std::string(1 << 20, 'M');
  EXPECT_LT(fault({endless.c_str()}).size(), 1000u);
  EXPECT_THAT(fault({"CCSLICE_A\x1b[2J=1"}), Not(HasSubstr("\x1b")));
}

TEST(Variables, KubernetesTellsOfServicesOfThatName) {
  EXPECT_EQ(fault({"CCSLICE_SERVICE_HOST=10.0.0.1", "CCSLICE_SERVICE_PORT=50051", "CCSLICE_SERVICE_PORT_GRPC=50051",
                   "CCSLICE_PORT=tcp://10.0.0.1:50051", "CCSLICE_PORT_50051_TCP=tcp://10.0.0.1:50051",
                   "CCSLICE_PORT_50051_TCP_ADDR=10.0.0.1", "CCSLICE_QUEUE_SERVICE_HOST=10.0.0.2",
                   "CCSLICE_QUEUE_PORT=tcp://10.0.0.2:6379", "CCSLICE_PORT_QUEUE_PORT_6379_TCP_PROTO=tcp"}),
            "");
  EXPECT_THAT(fault({"CCSLICE_PORT=50051"}), HasSubstr("CCSLICE_PORT")) << "somebody means --listen";
  EXPECT_THAT(fault({"CCSLICE_METRICS_PORT_=1"}), HasSubstr("CCSLICE_METRICS_PORT_"));
}

}  // namespace
}  // namespace ccslice
