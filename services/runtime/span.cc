#include "services/runtime/span.h"

#include <absl/status/status.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "services/runtime/server.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

// As opentelemetry.proto.trace.v1 numbers them.
constexpr int kServerKind = 2, kClientKind = 3, kStatusUnset = 0, kStatusError = 2;

// What a server cannot answer for is no error of its span; to who called, every failure is one.
bool IsError(Span::Kind kind, grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
      return false;
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::UNIMPLEMENTED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DATA_LOSS:
      return true;
    default:
      return kind == Span::Kind::kClient;
  }
}

// Written by hand: every call of the plant is a span, and with documents built for them spans took a tenth of a blob's processor time.
std::string Quoted(const std::string& text) {
  return nlohmann::ordered_json(text).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}
std::string Attribute(const std::string& key, const std::string& value) {
  return R"({"key":)" + Quoted(key) + R"(,"value":{"stringValue":)" + Quoted(value) + "}}";
}

std::string Nanoseconds(std::chrono::system_clock::time_point time) {
  return std::to_string(std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
}

// "/sixpoint.plant.v1.PlantService/GetBlade" in two.
std::pair<std::string, std::string> ServiceAndMethod(const std::string& rpc) {
  const std::size_t slash = rpc.rfind('/');
  if (rpc.empty() || slash == std::string::npos || slash == 0) return {"", rpc};
  return {rpc.substr(1, slash - 1), rpc.substr(slash + 1)};
}

}  // namespace

Span::Span(Kind kind, std::string rpc, const std::string& parent)
    : kind_(kind), rpc_(std::move(rpc)), parent_(SpanIdOf(parent)), traceparent_(ChildOf(parent)) {}

void Span::Write(LogLevel level, grpc::StatusCode code, const CallFacts* facts) const {
  const std::chrono::nanoseconds duration = std::chrono::steady_clock::now() - began_;
  const std::string code_text = absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
  const auto [service, method] = ServiceAndMethod(rpc_);
  std::string attributes = Attribute("rpc.system", "grpc") + "," + Attribute("rpc.service", service) + "," +
                           Attribute("rpc.method", method) + R"(,{"key":"rpc.grpc.status_code","value":{"intValue":")" +
                           std::to_string(static_cast<int>(code)) + "\"}}";
  LogFields fields;
  if (facts != nullptr) {
    for (const auto& [name, value] : facts->Known()) {
      fields.emplace_back(name, value);
      if (name == "caller" || name == "machine" || name == "blade" || name == "scan")
        attributes += "," + Attribute("sixpoint." + name, value);
    }
  } else {
    fields = {{"trace_id", TraceIdOf(traceparent_)}, {"span_id", SpanIdOf(traceparent_)}, {"rpc", rpc_}};
  }
  if (!parent_.empty()) fields.emplace_back("parent_span_id", parent_);
  fields.emplace_back("code", code_text);
  fields.emplace_back("dur_ms", std::chrono::duration<double, std::milli>(duration).count());
  if (IsSampled(traceparent_)) {
    const auto end = begin_ + std::chrono::duration_cast<std::chrono::system_clock::duration>(duration);
    std::string span =
        R"({"traceId":)" + Quoted(TraceIdOf(traceparent_)) + R"(,"spanId":)" + Quoted(SpanIdOf(traceparent_));
    if (!parent_.empty()) span += R"(,"parentSpanId":)" + Quoted(parent_);
    span += R"(,"name":)" + Quoted(service + "/" + method) + R"(,"kind":)" +
            std::to_string(kind_ == Kind::kServer ? kServerKind : kClientKind) + R"(,"startTimeUnixNano":")" +
            Nanoseconds(begin_) + R"(","endTimeUnixNano":")" + Nanoseconds(end) + R"(","attributes":[)" + attributes +
            R"(],"status":{"code":)" + std::to_string(IsError(kind_, code) ? kStatusError : kStatusUnset) + "}}";
    fields.emplace_back(
        "resourceSpans",
        JsonText{R"([{"resource":{"attributes":[)" + Attribute("service.name", "sixpoint-" + LoggedService()) + "," +
                 Attribute("service.version", SoftwareVersion()) +
                 R"(]},"scopeSpans":[{"scope":{"name":"sixpoint"},"spans":[)" + span + "]}]}]"});
  }
  const CallScope of_its_own(nullptr);  // its fields are given, whichever thread ends it
  Log(level, kind_ == Kind::kServer ? "call" : "called", fields);
}

}  // namespace sixpoint::runtime
