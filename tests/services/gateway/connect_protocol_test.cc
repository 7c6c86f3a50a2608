#include "services/gateway/connect_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/gateway/sessions.h"
#include "services/gateway/url.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;
using ::testing::HasSubstr;

constexpr char kGetBlade[] = "/sixpoint.plant.v1.PlantService/GetBlade";

Exchange::Head Asked(http::verb verb, const std::string& target, const HttpHeaders& headers = {}) {
  Exchange::Head head;
  head.method(verb);
  head.target(target);
  for (const auto& [name, value] : headers) head.insert(name, value);
  return head;
}
Exchange::Head Post(const std::string& target, const std::string& type) {
  return Asked(http::verb::post, target, {{"Content-Type", type}});
}

TEST(ConnectProtocol, ReadsAUnaryCall) {
  ConnectCall call;
  Exchange::Head head = Post(kGetBlade, "application/json; charset=utf-8");
  head.insert("Connect-Timeout-Ms", "1500");
  ASSERT_FALSE(ReadCall(head, &call));
  EXPECT_EQ(call.method->full_name(), "sixpoint.plant.v1.PlantService.GetBlade");
  EXPECT_EQ(call.codec, Codec::kJson);
  EXPECT_FALSE(call.is_stream);
  EXPECT_EQ(call.timeout, std::chrono::milliseconds(1500));
}

TEST(ConnectProtocol, ReadsAGetInEitherForm) {
  ConnectCall call;
  ASSERT_FALSE(
      ReadCall(Asked(http::verb::get,
                     std::string(kGetBlade) + "?connect=v1&encoding=json&message=%7B%22name%22%3A%22blades%2FX%22%7D"),
               &call));
  EXPECT_TRUE(call.is_get);
  EXPECT_EQ(call.message, R"({"name":"blades/X"})");
  // {"name":"b"} without padding.
  ASSERT_FALSE(ReadCall(
      Asked(http::verb::get, std::string(kGetBlade) + "?encoding=json&base64=1&message=eyJuYW1lIjoiYiJ9"), &call));
  EXPECT_EQ(call.message, R"({"name":"b"})");
}

TEST(ConnectProtocol, RefusesWithTheStatusThatHttpHasForIt) {
  struct {
    Exchange::Head head;
    unsigned status;
    const char* words;
  } const cases[] = {
      {Post("/sixpoint.plant.v1.PlantService/Nothing", "application/json"), 404, "want /SERVICE/METHOD"},
      {Post("/", "application/json"), 404, "path"},
      {Post("//x", "application/json"), 404, "path"},
      {Post(kGetBlade, "text/plain"), 415, "text/plain"},
      {Post(kGetBlade, ""), 415, "none"},
      {Post(kGetBlade, "application/connect+json"), 415, "application/json or"},
      {Post("/sixpoint.plant.v1.EventService/WatchEvents", "application/json"), 415, "application/connect+json"},
      {Post("/sixpoint.ingest.v1.ScanService/UploadScan", "application/connect+proto"), 501, "PUT /scans"},
      {Post(std::string(kGetBlade) + "?x=1", "application/json"), 400, "query: x"},
      {Asked(http::verb::put, kGetBlade), 405, "PUT"},
      {Asked(http::verb::get, "/sixpoint.plant.v1.PlantService/CreateBlade?encoding=json"), 405, "want POST"},
      {Asked(http::verb::get, std::string(kGetBlade) + "?encoding=xml"), 415, "xml"},
      {Asked(http::verb::get, std::string(kGetBlade) + "?encoding=json&message=x&message=y"), 400, "target"},
      {Asked(http::verb::get, std::string(kGetBlade) + "?encoding=json&base64=1&message=*"), 400, "base64"},
      {Asked(http::verb::get, std::string(kGetBlade) + "?encoding=json&compression=gzip"), 501, "gzip"},
      {Asked(http::verb::get, std::string(kGetBlade) + "?encoding=json&message=%zz"), 400, "target"},
      {Asked(http::verb::post, kGetBlade, {{"Content-Type", "application/json"}, {"Content-Encoding", "gzip"}}), 501,
       "gzip"},
      {Asked(http::verb::post, kGetBlade, {{"Content-Type", "application/json"}, {"Connect-Timeout-Ms", "-1"}}), 400,
       "connect-timeout-ms"},
      {Asked(http::verb::post, kGetBlade,
             {{"Content-Type", "application/json"}, {"Connect-Timeout-Ms", "12345678901"}}),
       400, "10 digits"},
      {Asked(http::verb::post, kGetBlade, {{"Content-Type", "application/json"}, {"Connect-Protocol-Version", "2"}}),
       400, "connect-protocol-version"}};
  for (const auto& one : cases) {
    ConnectCall call;
    const auto refusal = ReadCall(one.head, &call);
    ASSERT_TRUE(refusal) << one.head.target();
    const HttpResponse response = ErrorResponse(*refusal);
    EXPECT_EQ(response.status, one.status) << one.head.target() << " " << response.body;
    EXPECT_THAT(response.body, HasSubstr(one.words)) << one.head.target();
  }
}

TEST(ConnectProtocol, AFailureKeepsItsDetails) {
  const grpc::Status status = runtime::ToGrpc(runtime::Failure(
      runtime::ErrorReason::BLADE_NOT_FOUND, "blades/X: want one that is", {{"resource", "blades/X"}}));
  const auto json = nlohmann::json::parse(ErrorJson(status));
  EXPECT_EQ(json["code"], "not_found");
  EXPECT_EQ(json["message"], "blades/X: want one that is");
  EXPECT_EQ(json["details"][0]["type"], "google.rpc.ErrorInfo");
  EXPECT_EQ(json["details"][0]["debug"]["reason"], "BLADE_NOT_FOUND");
  EXPECT_EQ(json["details"][0]["debug"]["metadata"]["resource"], "blades/X");
  EXPECT_EQ(json["details"][0]["value"].get<std::string>().find('='), std::string::npos);
}

TEST(ConnectProtocol, EachCodeHasTheStatusOfTheProtocol) {
  const std::pair<grpc::StatusCode, unsigned> wanted[] = {{grpc::StatusCode::CANCELLED, 499},
                                                          {grpc::StatusCode::UNKNOWN, 500},
                                                          {grpc::StatusCode::INVALID_ARGUMENT, 400},
                                                          {grpc::StatusCode::DEADLINE_EXCEEDED, 504},
                                                          {grpc::StatusCode::NOT_FOUND, 404},
                                                          {grpc::StatusCode::ALREADY_EXISTS, 409},
                                                          {grpc::StatusCode::PERMISSION_DENIED, 403},
                                                          {grpc::StatusCode::RESOURCE_EXHAUSTED, 429},
                                                          {grpc::StatusCode::FAILED_PRECONDITION, 400},
                                                          {grpc::StatusCode::ABORTED, 409},
                                                          {grpc::StatusCode::OUT_OF_RANGE, 400},
                                                          {grpc::StatusCode::UNIMPLEMENTED, 501},
                                                          {grpc::StatusCode::INTERNAL, 500},
                                                          {grpc::StatusCode::UNAVAILABLE, 503},
                                                          {grpc::StatusCode::DATA_LOSS, 500},
                                                          {grpc::StatusCode::UNAUTHENTICATED, 401}};
  for (const auto& [code, status] : wanted) EXPECT_EQ(HttpStatusOf(code), status) << code;
}

TEST(ConnectProtocol, MessagesGoBothWays) {
  const auto& type = *plant::v1::Blade::descriptor();
  const auto bytes = BytesOfMessage(type, Codec::kJson, R"({"name": "blades/Ü", "workOrder": "W-1"})");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  plant::v1::Blade blade;
  ASSERT_TRUE(blade.ParseFromString(*bytes));
  EXPECT_EQ(blade.work_order(), "W-1");
  const auto text = MessageOfBytes(type, Codec::kJson, *bytes);
  ASSERT_TRUE(text.ok());
  EXPECT_EQ(nlohmann::json::parse(*text)["name"], "blades/Ü");
}

TEST(ConnectProtocol, RefusesWhatIsNoSuchMessage) {
  const auto& type = *plant::v1::GetBladeRequest::descriptor();
  for (const char* const text :
       {"{", "[]", R"({"nmae": "x"})", R"({"name": 5, "name": {}})", "null null", R"({"name": ["x"]})"}) {
    const auto bytes = BytesOfMessage(type, Codec::kJson, text);
    EXPECT_TRUE(absl::IsInvalidArgument(bytes.status())) << text;
  }
  EXPECT_THAT(BytesOfMessage(type, Codec::kJson, R"({"nmae": "x"})").status().message(), HasSubstr("nmae"));
  EXPECT_TRUE(absl::IsInvalidArgument(BytesOfMessage(type, Codec::kProto, "\x0a\xff").status()));
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += R"({"name":)";
  EXPECT_FALSE(BytesOfMessage(type, Codec::kJson, deep).ok());
}

TEST(ConnectProtocol, AStreamHasOneRequest) {
  EXPECT_EQ(OnlyEnvelope(Enveloped("abc")).value(), "abc");
  EXPECT_EQ(OnlyEnvelope(Enveloped("")).value(), "");
  const std::string two = Enveloped("a") + Enveloped("b");
  std::string compressed = Enveloped("abc"), huge = Enveloped("abc");
  compressed[0] = 1;
  huge[1] = '\x7f';
  for (const std::string& body :
       {std::string(), std::string("abc"), two, compressed, huge, Enveloped("abc").substr(0, 7)})
    EXPECT_TRUE(absl::IsInvalidArgument(OnlyEnvelope(body).status())) << body.size();
  const std::string end = EndOfStream(grpc::Status(grpc::StatusCode::ABORTED, "x"), {{"sixpoint-version", "1"}});
  EXPECT_EQ(end[0], 2);
  EXPECT_EQ(nlohmann::json::parse(end.substr(kEnvelope_bytes))["error"]["code"], "aborted");
}

TEST(Url, DecodesOnce) {
  const auto url = UrlOf("/a%2Fb/c%20d?x=1+2&y=%2B&z");
  ASSERT_TRUE(url);
  EXPECT_EQ(url->segments, (std::vector<std::string>{"a/b", "c d"}));
  EXPECT_EQ(url->query.at("x"), "1 2");
  EXPECT_EQ(url->query.at("y"), "+");
  EXPECT_EQ(url->query.at("z"), "");
  for (const char* const target : {"", "x", "*", "http://x/", "/%", "/%0", "/%0a", "/?a=1&a=2", "/%00"})
    EXPECT_FALSE(UrlOf(target)) << target;
}

TEST(Sessions, WhatAnotherSiteSendsIsKnown) {
  const auto elsewhere = [](http::verb verb, const HttpHeaders& headers) {
    return Sessions::IsFromElsewhere(Asked(verb, "/x", headers));
  };
  EXPECT_FALSE(elsewhere(http::verb::post, {{"Host", "plant:1"}}));  // no browser
  EXPECT_FALSE(elsewhere(http::verb::post, {{"Host", "plant:1"}, {"Origin", "https://plant:1"}}));
  EXPECT_FALSE(elsewhere(http::verb::get, {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "navigate"}}));
  EXPECT_TRUE(elsewhere(http::verb::post, {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "navigate"}}));
  EXPECT_TRUE(elsewhere(http::verb::get, {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "cors"}}));
  EXPECT_TRUE(elsewhere(http::verb::get, {{"Sec-Fetch-Site", "same-site"}}));
  EXPECT_TRUE(elsewhere(http::verb::post, {{"Host", "plant:1"}, {"Origin", "https://plant:2"}}));
  EXPECT_TRUE(elsewhere(http::verb::post, {{"Host", "plant:1"}, {"Origin", "null"}}));
}

}  // namespace
}  // namespace sixpoint::gateway
