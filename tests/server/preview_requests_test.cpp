// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_requests.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

ArrivedPreview request(std::uint64_t number, const std::string& mesh_id = "") {
  ArrivedPreview made;
  made.message.set_number(number);
  if (!mesh_id.empty()) made.mesh_ids = {mesh_id};
  return made;
}

TEST(PreviewRequests, OfThoseThatComeMeanwhileTheLatestWinsWithTheSettingsOfAll) {
  PreviewRequests requests;
  requests.accept(request(1, "a"));
  requests.take_next();
  EXPECT_EQ(requests.at_hand().message.number(), 1u);
  ArrivedPreview placed = request(2);
  placed.message.mutable_placement()->add_matrix(2);
  requests.accept(placed);
  ArrivedPreview printed = request(3, "b");
  printed.message.mutable_printing()->add_materials()->set_name("hard");
  requests.accept(printed);
  requests.accept(request(4));
  EXPECT_EQ(requests.dropped(), 2u);
  requests.take_next();
  EXPECT_FALSE(requests.waits());
  const v1::PreviewRequest& last = requests.at_hand().message;
  EXPECT_EQ(last.number(), 4u);
  EXPECT_EQ(requests.at_hand().mesh_ids, std::vector<std::string>{"b"});
  EXPECT_EQ(last.placement().matrix(0), 2);
  EXPECT_EQ(last.printing().materials(0).name(), "hard");
}

TEST(PreviewRequests, KeepTheirOwnSettings) {
  PreviewRequests requests;
  ArrivedPreview first = request(1, "a"), second = request(2, "b");
  first.message.mutable_placement()->add_matrix(1);
  second.message.mutable_placement()->add_matrix(2);
  requests.accept(first);
  requests.accept(second);
  requests.take_next();
  EXPECT_EQ(requests.at_hand().mesh_ids, (std::vector<std::string>{"a", "b"})) << "those of the one before first";
  EXPECT_EQ(requests.at_hand().message.placement().matrix(0), 2);
}

TEST(PreviewRequests, HandOnWhatTheOneAtHandSetIfItIsDropped) {
  PreviewRequests requests;
  requests.accept(request(1, "a"));
  requests.take_next();
  requests.accept(request(2));
  requests.drop_at_hand();
  requests.take_next();
  EXPECT_EQ(requests.at_hand().mesh_ids, std::vector<std::string>{"a"});
  EXPECT_EQ(requests.at_hand().message.number(), 2u);
  EXPECT_EQ(requests.dropped(), 1u);
}

TEST(PreviewRequests, GoUpInNumber) {
  PreviewRequests requests;
  EXPECT_THROW(requests.accept(request(0)), ServiceError);
  requests.accept(request(5, "a"));
  try {
    requests.accept(request(5, "b"));
    ADD_FAILURE() << "the same number twice";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), ServiceErrorCode::kRequestMalformed);
    EXPECT_NE(std::string(error.what()).find("5 comes after 5"), std::string::npos) << error.what();
  }
  requests.take_next();
  EXPECT_EQ(requests.at_hand().mesh_ids, std::vector<std::string>{"a"}) << "the one that waited is as it was";
}

TEST(PreviewRequests, CountWhatTheyTakeAndWhatTheSettingsTake) {
  PreviewRequests requests;
  ArrivedPreview large = request(1);
  large.message.mutable_printing()->add_materials()->set_name(std::string(10'000, 'x'));
  requests.accept(large);
  EXPECT_GE(requests.bytes(), 10'000u);
  requests.take_next();
  EXPECT_GE(requests.bytes(), 20'000u) << "itself, and the settings that it came with";
  requests.forget_at_hand();
  EXPECT_GE(requests.bytes(), 10'000u);
  EXPECT_LT(requests.bytes(), 20'000u);
  ArrivedPreview larger = request(2);
  larger.message.mutable_printing()->add_materials()->set_name(std::string(30'000, 'x'));
  requests.accept(larger);
  requests.accept(request(3));
  EXPECT_GE(requests.bytes(), 40'000u) << "settings that were handed on count where they are now";
}

}  // namespace
}  // namespace ccslice::server
