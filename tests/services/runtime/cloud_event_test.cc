// The CloudEvents form is a promise to programs of others: docs/events.md shows it, and the example there is what comes out.
#include "services/runtime/cloud_event.h"

#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace sixpoint::runtime {
namespace {

using google::protobuf::util::TimeUtil;

constexpr char kSource[] = "urn:uuid:5f0c2a52-3a0e-4c60-9a55-0c7ff5d0e7aa";

// Between ```json and ``` after the heading of that name.
nlohmann::json ExampleOf(const std::string& heading) {
  const char* const root = std::getenv("SIXPOINT_SOURCE_DIR");
  std::ifstream file(std::string(root == nullptr ? "." : root) + "/docs/events.md");
  std::stringstream text;
  text << file.rdbuf();
  const std::string all = text.str();
  const std::size_t begin = all.find("```json\n", all.find(heading)) + 8;
  return nlohmann::json::parse(all.substr(begin, all.find("```", begin) - begin), nullptr, false);
}

plant::v1::Event Inspected() {
  plant::v1::Event event;
  plant::v1::RecordEntry& entry = *event.mutable_entry();
  entry.set_record_sequence(4711);
  entry.set_kind("inspection");
  entry.set_name("inspections/0197b0a4-5a51-7c5e-9d41-6f1f7b0c9a10");
  entry.add_inputs("registrations/0197b0a4-58f0-7a86-8f7a-2c4a0d4f7a02");
  entry.add_inputs("scans/sn1_pins_1");
  entry.set_method("six-point normals");
  entry.set_software_version("0.1.0+0f3c2ab41d77");
  EXPECT_TRUE(TimeUtil::FromString("2026-11-25T01:02:03.456789Z", entry.mutable_recorded_at()));
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(R"({"conform_count": 11, "not_conform_count": 1})",
                                                          entry.mutable_summary())
                  .ok());
  entry.set_blade("blades/SN-1");
  entry.set_machine("machines/sarix-1");
  entry.set_requested_by("users/jane");
  entry.set_trace_id("4bf92f3577b34da6a3ce929d0e0e4736");
  entry.set_verdict("NOT_CONFORM");
  return event;
}

TEST(CloudEvent, IsWhatTheDocumentShows) { EXPECT_EQ(CloudEventOf(Inspected(), kSource), ExampleOf("## CloudEvents")); }

// What CloudEvents 1.0 demands of every event: four attributes, names of lower-case letters and digits, texts that are not empty.
TEST(CloudEvent, KeepsTheRulesOfCloudEvents) {
  plant::v1::Event least;
  least.mutable_entry()->set_record_sequence(1);
  least.mutable_entry()->set_kind("policy");
  least.mutable_entry()->set_name("policies/p1");
  for (const plant::v1::Event& event : {Inspected(), least}) {
    const nlohmann::json written = CloudEventOf(event, kSource);
    for (const char* required : {"id", "source", "specversion", "type"})
      ASSERT_TRUE(written.contains(required)) << required;
    for (const auto& [name, value] : written.items()) {
      EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789"), std::string::npos) << name;
      EXPECT_TRUE(name == "data" || (value.is_string() && !value.get<std::string>().empty())) << name;
    }
  }
}

TEST(CloudEvent, SequencesSortAsTextsAndEmptyFieldsAreLeftOut) {
  plant::v1::Event event = Inspected();
  const std::string before = CloudEventOf(event, kSource)["sequence"];
  event.mutable_entry()->set_record_sequence(10000);
  EXPECT_LT(before, CloudEventOf(event, kSource)["sequence"].get<std::string>());
  EXPECT_FALSE(CloudEventOf(event, kSource)["data"].contains("state"));
  EXPECT_FALSE(CloudEventOf(event, kSource)["data"].contains("valid_until"));
  EXPECT_TRUE(TimeUtil::FromString("2027-01-01T00:00:00Z", event.mutable_valid_until()));
  event.mutable_entry()->set_state("IN_FORCE");
  EXPECT_EQ(CloudEventOf(event, kSource)["data"]["valid_until"], "2027-01-01T00:00:00Z");
  EXPECT_EQ(CloudEventOf(event, kSource)["data"]["state"], "IN_FORCE");
}

}  // namespace
}  // namespace sixpoint::runtime
