// `sixpoint events` and `sixpoint webhook` against a plant that ends its calls.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/event.grpc.pb.h"
#include "sixpoint/plant/v1/webhook.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using plant::v1::Event;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void AddEvent(std::int64_t sequence, google::protobuf::RepeatedPtrField<Event>* events) {
  plant::v1::RecordEntry& entry = *events->Add()->mutable_entry();
  entry.set_record_sequence(sequence);
  entry.set_kind("inspection");
  entry.set_name("inspections/i" + std::to_string(sequence));
  entry.set_blade("blades/sn1");
  entry.set_verdict("CONFORM");
}

// Tells 1 to 5, two at a time; a watch breaks off after each answer, and tells the last event of the answer before once more.
class TornPlant final : public plant::v1::EventService::Service {
 public:
  grpc::Status WatchEvents(grpc::ServerContext*, const plant::v1::WatchEventsRequest* request,
                           grpc::ServerWriter<plant::v1::WatchEventsResponse>* writer) override {
    watched.push_back(*request);
    const std::int64_t after = request->from_now() ? 0 : request->after_sequence();
    if (after >= 5) return runtime::ToGrpc(absl::PermissionDeniedError("enough"));
    plant::v1::WatchEventsResponse response;
    for (std::int64_t i = std::max<std::int64_t>(after, 1); i <= std::min<std::int64_t>(after + 2, 5); ++i)
      AddEvent(i, response.mutable_events());
    response.set_looked_at_sequence(std::min<std::int64_t>(after + 2, 5));
    response.set_source("urn:uuid:plant");
    writer->Write(response);
    const bool is_cut_off = watched.size() == 1;
    return runtime::ToGrpc(is_cut_off ? absl::CancelledError("reads nothing") : absl::UnavailableError("stops"));
  }
  grpc::Status ListEvents(grpc::ServerContext*, const plant::v1::ListEventsRequest* request,
                          plant::v1::ListEventsResponse* response) override {
    listed.push_back(*request);
    const std::int64_t last = std::min<std::int64_t>(request->after_sequence() + 2, 5);
    for (std::int64_t i = request->after_sequence() + 1; i <= last; ++i) AddEvent(i, response->mutable_events());
    response->set_looked_at_sequence(last);
    response->set_is_newest(last == 5);
    response->set_source("urn:uuid:plant");
    return grpc::Status::OK;
  }
  std::vector<plant::v1::WatchEventsRequest> watched;
  std::vector<plant::v1::ListEventsRequest> listed;
};

class Webhooks final : public plant::v1::WebhookService::Service {
 public:
  grpc::Status CreateWebhook(grpc::ServerContext*, const plant::v1::CreateWebhookRequest* request,
                             plant::v1::CreateWebhookResponse* response) override {
    created.push_back(*request);
    response->mutable_webhook()->set_name("webhooks/" + request->webhook_id());
    response->set_secret("whsec_abc");
    return grpc::Status::OK;
  }
  grpc::Status TestWebhook(grpc::ServerContext*, const plant::v1::TestWebhookRequest* request,
                           plant::v1::TestWebhookResponse* response) override {
    response->set_is_taken(request->name() == "webhooks/sound");
    response->set_http_status(response->is_taken() ? 204 : 503);
    if (!response->is_taken()) response->set_failure("HTTP 503, want 200 to 299");
    return grpc::Status::OK;
  }
  std::vector<plant::v1::CreateWebhookRequest> created;
};

class EventsCommandTest : public ::testing::Test {
 protected:
  Ended Run(const std::string& words) {
    return RunCommand(words, [this](Session* session) {
      session->server = server_.address();
      session->credentials = grpc::InsecureChannelCredentials();
    });
  }
  static std::vector<nlohmann::json> Lines(const std::string& text) {
    std::vector<nlohmann::json> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line) && line[0] == '{';)
      if (line.size() > 1) lines.push_back(nlohmann::json::parse(line, nullptr, false));
    return lines;
  }
  TornPlant plant_;
  Webhooks webhooks_;
  testing::InProcessServer server_{{&plant_, &webhooks_}};
};

TEST_F(EventsCommandTest, ListsAllPagesWithItsFilters) {
  const Ended listed =
      Run("events --after 1 --kinds scan,inspection --machine m1 --blade sn1 --part vane --verdicts CONFORM");
  EXPECT_EQ(listed.exit_code, kDone) << listed.err;
  for (const char* name : {"inspections/i2", "inspections/i3", "inspections/i4", "inspections/i5", "CONFORM"})
    EXPECT_THAT(listed.out, HasSubstr(name));
  ASSERT_EQ(plant_.listed.size(), 2u);
  const plant::v1::EventFilter& filter = plant_.listed[0].filter();
  EXPECT_THAT(filter.kinds(), ElementsAre("scan", "inspection"));
  EXPECT_EQ(filter.machine(), "machines/m1");
  EXPECT_EQ(filter.blade(), "blades/sn1");
  EXPECT_EQ(filter.part(), "parts/vane");
  EXPECT_THAT(filter.verdicts(), ElementsAre("CONFORM"));
  EXPECT_EQ(plant_.listed[1].after_sequence(), 3);
  EXPECT_EQ(Run("events --after -1").exit_code, kFailed);
}

TEST_F(EventsCommandTest, FollowsThroughEveryBreakAndPrintsEachEventOnce) {
  const Ended followed = Run("events --follow --json");
  EXPECT_EQ(followed.exit_code, kFailed);
  std::vector<std::int64_t> sequences;
  for (const nlohmann::json& line : Lines(followed.out)) sequences.push_back(line["entry"]["record_sequence"]);
  EXPECT_THAT(sequences, ElementsAre(1, 2, 3, 4, 5));
  ASSERT_GE(plant_.watched.size(), 4u);
  EXPECT_TRUE(plant_.watched[0].from_now());
  EXPECT_FALSE(plant_.watched[1].from_now());
  EXPECT_EQ(plant_.watched[1].after_sequence(), 2);
  EXPECT_THAT(followed.out, HasSubstr("enough"));
}

TEST_F(EventsCommandTest, WritesCloudEvents) {
  const std::vector<nlohmann::json> events = Lines(Run("events --cloudevents").out);
  ASSERT_EQ(events.size(), 5u);
  EXPECT_EQ(events[4]["id"], "5");
  EXPECT_EQ(events[4]["source"], "urn:uuid:plant");
  EXPECT_EQ(events[4]["type"], "sixpoint.inspection.recorded");
}

TEST_F(EventsCommandTest, MakesAWebhookAndShowsItsSecret) {
  const Ended made = Run("webhook add mes https://mes.example/x --kinds inspection --after 7");
  EXPECT_EQ(made.exit_code, kDone) << made.err;
  EXPECT_THAT(made.out, HasSubstr("whsec_abc"));
  ASSERT_EQ(webhooks_.created.size(), 1u);
  EXPECT_EQ(webhooks_.created[0].url(), "https://mes.example/x");
  EXPECT_EQ(webhooks_.created[0].after_sequence(), 7);
  EXPECT_FALSE(webhooks_.created[0].from_now());
  Run("webhook add mes https://mes.example/x");
  EXPECT_TRUE(webhooks_.created[1].from_now());
  EXPECT_EQ(Run("webhook test sound").exit_code, kDone);
  const Ended failed = Run("webhook test other");
  EXPECT_EQ(failed.exit_code, kFailed);
  EXPECT_THAT(failed.out, HasSubstr("not taken: HTTP 503"));
}

}  // namespace
}  // namespace sixpoint::cli
