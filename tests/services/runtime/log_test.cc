#include "services/runtime/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <vector>

#include "services/runtime/call_scope.h"
#include "services/runtime/span.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class LogTest : public ::testing::Test {
 protected:
  void SetUp() override { StartLog("inspection"); }
  // What `write` logs, a line an object; every line must be one.
  template <typename Write>
  std::vector<json> Written(const Write& write) {
    ::testing::internal::CaptureStderr();
    write();
    std::istringstream text(::testing::internal::GetCapturedStderr());
    std::vector<json> lines;
    for (std::string line; std::getline(text, line);) {
      EXPECT_LE(line.size(), kLongestLogLine);
      lines.push_back(json::parse(line, nullptr, false));
      EXPECT_TRUE(lines.back().is_object()) << line.substr(0, 200);
    }
    return lines;
  }
};

TEST_F(LogTest, IsOneObjectALineWhateverItIsGiven) {
  const std::string bytes("\x1b[2J\xff\n\0{\"level\":\"error\"}", 24);
  const std::vector<json> lines = Written([&] {
    Log(LogLevel::kWarning, bytes, {{"why", bytes}, {"count", 3L}, {"part", 0.5}});
    Log(LogLevel::kInfo, std::string(1 << 20, '"'), {{"why", std::string(1 << 20, '\\')}});
    LogFields many;
    for (int i = 0; i < 1000; ++i) many.emplace_back("field_" + std::to_string(i), std::string(500, 'x'));
    Log(LogLevel::kError, "many", many);
  });
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["service"], "inspection");
  EXPECT_EQ(lines[0]["level"], "warning");
  EXPECT_EQ(lines[0]["count"], 3);
  EXPECT_THAT(lines[0]["ts"].get<std::string>(), ::testing::MatchesRegex("20..-..-..T..:..:...*Z"));
  EXPECT_THAT(lines[0]["why"].get<std::string>(), Not(HasSubstr("\x1b")));
  EXPECT_LE(lines[1]["msg"].get<std::string>().size(), kLongestLogText);
  EXPECT_EQ(lines[2]["msg"], "many");
  EXPECT_GT(lines[2]["left_out_count"].get<int>(), 900);
}

TEST_F(LogTest, TellsTheCallThatTheThreadWorksFor) {
  const auto call = std::make_shared<CallFacts>(NewTraceparent(), "/sixpoint.ingest.v1.ScanService/UploadScan");
  call->SetCaller("machines/m1");
  for (const char* name : {"machines/m1", "machines/m2", "blades/SN-1", "parts/p", "scans/s"}) call->Concerns(name);
  const std::vector<json> lines = Written([&] {
    Log(LogLevel::kInfo, "before");
    const CallScope scope(call);
    Log(LogLevel::kInfo, "in it");
    std::thread([] { Log(LogLevel::kInfo, "a thread that it was not handed to"); }).join();
    std::thread([handed = CurrentCall()] {
      const CallScope there(handed);
      Log(LogLevel::kInfo, "one that it was");
    }).join();
    {
      const CallScope none(nullptr);
      Log(LogLevel::kInfo, "for nobody");
    }
    Log(LogLevel::kInfo, "in it again", {{"caller", std::string("said otherwise")}});
  });
  ASSERT_EQ(lines.size(), 6u);
  for (const int i : {0, 2, 4}) EXPECT_FALSE(lines[i].contains("trace_id")) << lines[i];
  for (const int i : {1, 3, 5}) {
    EXPECT_EQ(lines[i]["trace_id"], TraceIdOf(call->traceparent()));
    EXPECT_EQ(lines[i]["span_id"], SpanIdOf(call->traceparent()));
    EXPECT_EQ(lines[i]["rpc"], "/sixpoint.ingest.v1.ScanService/UploadScan");
    EXPECT_EQ(lines[i]["machine"], "machines/m1");  // the first
    EXPECT_EQ(lines[i]["blade"], "blades/SN-1");
    EXPECT_EQ(lines[i]["scan"], "scans/s");
  }
  EXPECT_EQ(lines[1]["caller"], "machines/m1");
  EXPECT_EQ(lines[5]["caller"], "said otherwise");
}

TEST_F(LogTest, HidesWhatNobodyIsToRead) {
  const std::string key = "-----BEGIN EC PRIVATE KEY-----\nMHcCAQEEIsecretsecret\n-----END EC PRIVATE KEY-----";
  EXPECT_EQ(WithoutSecrets("a " + key + " b"), "a [hidden] b");
  EXPECT_EQ(WithoutSecrets("-----BEGIN PRIVATE KEY-----\nsecret, cut short"), "[hidden]");
  EXPECT_EQ(WithoutSecrets("host=x password=secret dbname=y"), "host=x password=[hidden] dbname=y");
  EXPECT_EQ(WithoutSecrets("PASSWORD = 'it is \\' secret' z"), "PASSWORD = [hidden] z");
  EXPECT_EQ(WithoutSecrets("password='secret never closed"), "password=[hidden]");
  EXPECT_EQ(WithoutSecrets("secret_key: abc/def+"), "secret_key: [hidden]");
  EXPECT_EQ(WithoutSecrets("Authorization: Bearer secret\r\nHost: x"), "Authorization: [hidden]\r\nHost: x");
  EXPECT_EQ(WithoutSecrets(R"({"password":"secret","user":"jane"})"), R"({"password":[hidden],"user":"jane"})");
  EXPECT_EQ(WithoutSecrets("client_secret=secret&x=1"), "client_secret=[hidden]&x=1");
  EXPECT_EQ(WithoutSecrets("Cookie: a=secret; b=secret"), "Cookie: [hidden]");
  EXPECT_EQ(WithoutSecrets("postgresql://jane:sec:ret@host:5432/db"), "postgresql://jane:[hidden]@host:5432/db");
  const std::string certificate = "-----BEGIN CERTIFICATE-----\nMIIB\n-----END CERTIFICATE-----";
  for (const std::string& harmless :
       {certificate, std::string("the password is wrong"), std::string("https://host/path?a=b@c"), std::string("://"),
        std::string("-----BEGIN "), std::string("password=")})
    EXPECT_THAT(WithoutSecrets(harmless), Not(HasSubstr("secret"))) << harmless;
  EXPECT_EQ(WithoutSecrets(certificate), certificate);
  EXPECT_EQ(WithoutSecrets("the password is wrong"), "the password is wrong");
  const std::vector<json> lines = Written([&] {
    Log(LogLevel::kError, "x password=secret", {{"why", key}, {"url", std::string("s3://a:secret@b")}});
  });
  EXPECT_THAT(lines.at(0).dump(), Not(HasSubstr("secret")));
}

TEST_F(LogTest, ASpanIsALineThatACollectorReads) {
  const std::string caller = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  const std::vector<json> lines = Written([&] {
    const Span made(Span::Kind::kClient, "/sixpoint.plant.v1.PlantService/GetBlade", caller);
    const Span answered(Span::Kind::kServer, "/sixpoint.plant.v1.PlantService/GetBlade", made.traceparent());
    CallFacts facts(answered.traceparent(), "/sixpoint.plant.v1.PlantService/GetBlade");
    facts.Concerns("blades/SN-1");
    answered.Write(LogLevel::kInfo, grpc::StatusCode::NOT_FOUND, &facts);
    made.Write(LogLevel::kInfo, grpc::StatusCode::NOT_FOUND, nullptr);
    Span(Span::Kind::kServer, "/a/b", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-00")
        .Write(LogLevel::kInfo, grpc::StatusCode::OK, nullptr);
  });
  ASSERT_EQ(lines.size(), 3u);
  const json& server = lines[0]["resourceSpans"][0]["scopeSpans"][0]["spans"][0];
  const json& client = lines[1]["resourceSpans"][0]["scopeSpans"][0]["spans"][0];
  EXPECT_EQ(server["traceId"], "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(client["parentSpanId"], "00f067aa0ba902b7");
  EXPECT_EQ(server["parentSpanId"], client["spanId"]);
  EXPECT_NE(server["spanId"], client["spanId"]);
  EXPECT_EQ(server["kind"], 2);
  EXPECT_EQ(client["kind"], 3);
  EXPECT_EQ(server["status"]["code"], 0);  // the server did what it should
  EXPECT_EQ(client["status"]["code"], 2);
  EXPECT_EQ(server["name"], "sixpoint.plant.v1.PlantService/GetBlade");
  // 64-bit numbers are texts in protobuf's JSON.
  EXPECT_LE(std::stoll(server["startTimeUnixNano"].get<std::string>()),
            std::stoll(server["endTimeUnixNano"].get<std::string>()));
  EXPECT_THAT(server["attributes"].dump(),
              HasSubstr("{\"key\":\"rpc.grpc.status_code\",\"value\":{\"intValue\":\"5\"}}"));
  EXPECT_THAT(server["attributes"].dump(), HasSubstr("blades/SN-1"));
  EXPECT_THAT(lines[0]["resourceSpans"][0]["resource"].dump(), HasSubstr("sixpoint-inspection"));
  EXPECT_EQ(lines[0]["msg"], "call");
  EXPECT_EQ(lines[0]["span_id"], server["spanId"]);
  EXPECT_EQ(lines[0]["code"], "NOT_FOUND");
  EXPECT_EQ(lines[1]["msg"], "called");
  // Whoever began the trace does not keep its spans: the line is written, the span is not.
  EXPECT_FALSE(lines[2].contains("resourceSpans"));
  EXPECT_EQ(lines[2]["trace_id"], "4bf92f3577b34da6a3ce929d0e0e4736");
}

TEST(ChildTrace, IsOfTheSameTraceAndFlags) {
  const std::string parent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-00";
  const std::string child = ChildOf(parent);
  EXPECT_EQ(TraceIdOf(child), TraceIdOf(parent));
  EXPECT_NE(SpanIdOf(child), SpanIdOf(parent));
  EXPECT_FALSE(IsSampled(child));
  EXPECT_TRUE(IsSampled(NewTraceparent()));
  for (const std::string& wrong : {std::string(), std::string("00-x"), std::string(55, '0')}) {
    EXPECT_EQ(SpanIdOf(wrong), "");
    EXPECT_EQ(TraceIdOf(ChildOf(wrong)).size(), 32u);
    EXPECT_FALSE(IsSampled(wrong));
  }
}

TEST(OwnTrace, IsTheOneOfWhoStartedTheProgram) {
  setenv("TRACEPARENT", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01", 1);
  EXPECT_EQ(BeginOwnTrace(), "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(TraceIdOf(CurrentTraceparent()), "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(CurrentTraceparent(), CurrentTraceparent());  // all that it does is part of one span
  setenv("TRACEPARENT", "nonsense", 1);
  EXPECT_NE(BeginOwnTrace(), "4bf92f3577b34da6a3ce929d0e0e4736");
  unsetenv("TRACEPARENT");
}

}  // namespace
}  // namespace sixpoint::runtime
