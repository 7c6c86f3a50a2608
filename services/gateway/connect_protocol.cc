#include "services/gateway/connect_protocol.h"

#include <absl/strings/escaping.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "services/gateway/url.h"
#include "services/runtime/errors.h"
#include "sixpoint/errors/v1/refusal.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;
using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::MethodOptions;

constexpr unsigned char kCompressed = 1, kEnd = 2;
constexpr std::size_t kLongestTimeout_digits = 10;  // by the protocol

std::unique_ptr<Message> NewMessage(const Descriptor& type) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

// As the protocol writes codes.
const char* CodeText(grpc::StatusCode code) {
  constexpr const char* kTexts[] = {
      "",          "canceled",       "unknown",           "invalid_argument",   "deadline_exceeded",
      "not_found", "already_exists", "permission_denied", "resource_exhausted", "failed_precondition",
      "aborted",   "out_of_range",   "unimplemented",     "internal",           "unavailable",
      "data_loss", "unauthenticated"};
  return code >= 1 && code <= 16 ? kTexts[code] : "unknown";
}

// value: as the protocol has it, base64 without padding. debug: the same for people.
nlohmann::ordered_json DetailJson(const google::protobuf::Any& detail) {
  const std::string type = detail.type_url().substr(detail.type_url().rfind('/') + 1);
  std::string value = absl::Base64Escape(detail.value());
  value.erase(value.find_last_not_of('=') + 1);
  nlohmann::ordered_json json = {{"type", type}, {"value", value}};
  const Descriptor* const known = DescriptorPool::generated_pool()->FindMessageTypeByName(type);
  if (known == nullptr) return json;
  const std::unique_ptr<Message> message = NewMessage(*known);
  std::string text;
  if (message->ParseFromString(detail.value()) && google::protobuf::util::MessageToJsonString(*message, &text).ok())
    json["debug"] = nlohmann::ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  return json;
}

nlohmann::ordered_json ErrorOf(const grpc::Status& status) {
  nlohmann::ordered_json json = {{"code", CodeText(status.error_code())}};
  if (!status.error_message().empty()) json["message"] = status.error_message();
  google::rpc::Status details;
  if (status.error_details().empty() || !details.ParseFromString(status.error_details())) return json;
  for (const auto& detail : details.details()) json["details"].push_back(DetailJson(detail));
  return json;
}

std::string Dumped(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

ConnectRefusal Refused(grpc::StatusCode code, unsigned http_status, const std::string& message) {
  return {runtime::ToGrpc(absl::Status(static_cast<absl::StatusCode>(code), message)), http_status, ""};
}
ConnectRefusal Refused(const std::string& field, const std::string& value, const std::string& wanted) {
  return {runtime::ToGrpc(runtime::Refuse(field, value, wanted)), 0, ""};
}

std::optional<ConnectRefusal> ReadTimeout(const std::string& text, ConnectCall* call) {
  if (text.empty()) return std::nullopt;
  if (text.size() > kLongestTimeout_digits || text.find_first_not_of("0123456789") != std::string::npos)
    return Refused("connect-timeout-ms", text, "a whole number of at most 10 digits");
  call->timeout = std::chrono::milliseconds(std::stoll(text));
  return std::nullopt;
}

// "application/json; charset=utf-8" without what stands after it.
std::string MediaTypeOf(const std::string& text) {
  std::string type = text.substr(0, text.find(';'));
  type.erase(type.find_last_not_of(' ') + 1);
  std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
  return type;
}

std::optional<ConnectRefusal> ReadPost(const Exchange::Head& head, ConnectCall* call) {
  const std::string type = MediaTypeOf(HeaderOf(head, "Content-Type"));
  const std::string prefix = call->is_stream ? "application/connect+" : "application/";
  if (type != prefix + "json" && type != prefix + "proto")
    return Refused(
        grpc::StatusCode::UNIMPLEMENTED, 415,
        "content-type: " + (type.empty() ? "none" : type) + ", want " + prefix + "json or " + prefix + "proto");
  call->codec = type == prefix + "json" ? Codec::kJson : Codec::kProto;
  const std::string encoding = HeaderOf(head, call->is_stream ? "Connect-Content-Encoding" : "Content-Encoding");
  if (!encoding.empty() && encoding != "identity")
    return Refused(grpc::StatusCode::UNIMPLEMENTED, 0, "content-encoding: " + encoding + ", want identity");
  const std::string version = HeaderOf(head, "Connect-Protocol-Version");
  if (!version.empty() && version != "1") return Refused("connect-protocol-version", version, "1");
  return ReadTimeout(HeaderOf(head, "Connect-Timeout-Ms"), call);
}

std::optional<ConnectRefusal> ReadGet(const Exchange::Head& head, const Url& url, ConnectCall* call) {
  if (call->is_stream || call->method->options().idempotency_level() != MethodOptions::NO_SIDE_EFFECTS) {
    ConnectRefusal refusal = Refused(grpc::StatusCode::UNIMPLEMENTED, 405,
                                     "method: GET, want POST: " + call->method->name() +
                                         (call->is_stream ? " streams its answers" : " changes something"));
    refusal.allow = "POST";
    return refusal;
  }
  const auto value = [&url](const char* name) {
    const auto found = url.query.find(name);
    return found == url.query.end() ? std::string() : found->second;
  };
  for (const auto& [name, text] : url.query)
    if (name != "connect" && name != "encoding" && name != "base64" && name != "compression" && name != "message")
      return Refused("query", name, "connect, encoding, base64, compression or message");
  if (const std::string version = value("connect"); !version.empty() && version != "v1")
    return Refused("connect", version, "v1");
  if (const std::string compression = value("compression"); !compression.empty() && compression != "identity")
    return Refused(grpc::StatusCode::UNIMPLEMENTED, 0, "compression: " + compression + ", want identity");
  const std::string encoding = value("encoding");
  if (encoding != "json" && encoding != "proto")
    return Refused(grpc::StatusCode::UNIMPLEMENTED, 415,
                   "encoding: " + (encoding.empty() ? "none" : encoding) + ", want json or proto");
  call->codec = encoding == "json" ? Codec::kJson : Codec::kProto;
  call->message = value("message");
  const std::string base64 = value("base64");
  if (!base64.empty() && base64 != "1" && base64 != "0") return Refused("base64", base64, "1");
  if (base64 == "1") {
    std::string decoded;
    // Padded or not, as clients like.
    call->message.erase(call->message.find_last_not_of('=') + 1);
    if (!absl::WebSafeBase64Unescape(call->message, &decoded))
      return Refused("message", "no base64", "base64 for URLs");
    call->message = std::move(decoded);
  }
  return ReadTimeout(HeaderOf(head, "Connect-Timeout-Ms"), call);
}

}  // namespace

const MethodDescriptor* MethodOf(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (path.empty() || path.front() != '/' || slash == 0) return nullptr;
  std::string name(path.substr(1));
  name[slash - 1] = '.';
  return DescriptorPool::generated_pool()->FindMethodByName(name);
}

std::optional<ConnectRefusal> ReadCall(const Exchange::Head& head, ConnectCall* call) {
  const std::optional<Url> url = UrlOf(std::string_view(head.target().data(), head.target().size()));
  if (!url) return Refused("target", std::string(head.target()), "a path and a query");
  call->method = MethodOf(url->path);
  if (call->method == nullptr)
    return Refused(grpc::StatusCode::UNIMPLEMENTED, 404,
                   "path: " + url->path + ", want /SERVICE/METHOD of the contract");
  if (call->method->client_streaming())
    return Refused(grpc::StatusCode::UNIMPLEMENTED, 0,
                   call->method->name() + ": streams its requests, want gRPC, or for a scan PUT /scans/ID/blocks/N");
  call->is_stream = call->method->server_streaming();
  call->is_get = head.method() == http::verb::get || head.method() == http::verb::head;
  if (call->is_get) return ReadGet(head, *url, call);
  if (head.method() == http::verb::post && url->query.empty()) return ReadPost(head, call);
  if (head.method() == http::verb::post) return Refused("query", url->query.begin()->first, "none with POST");
  ConnectRefusal refusal = Refused(grpc::StatusCode::UNIMPLEMENTED, 405,
                                   "method: " + std::string(head.method_string()) + ", want POST or GET");
  refusal.allow = "POST, GET";
  return refusal;
}

unsigned HttpStatusOf(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
      return 200;
    case grpc::StatusCode::CANCELLED:
      return 499;
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::OUT_OF_RANGE:
      return 400;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return 504;
    case grpc::StatusCode::NOT_FOUND:
      return 404;
    case grpc::StatusCode::ALREADY_EXISTS:
    case grpc::StatusCode::ABORTED:
      return 409;
    case grpc::StatusCode::PERMISSION_DENIED:
      return 403;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return 429;
    case grpc::StatusCode::UNIMPLEMENTED:
      return 501;
    case grpc::StatusCode::UNAVAILABLE:
      return 503;
    case grpc::StatusCode::UNAUTHENTICATED:
      return 401;
    default:
      return 500;
  }
}

std::string ErrorJson(const grpc::Status& status) { return Dumped(ErrorOf(status)); }

HttpResponse ErrorResponse(const ConnectRefusal& refusal) {
  HttpResponse response;
  response.status = refusal.http_status != 0 ? refusal.http_status : HttpStatusOf(refusal.status.error_code());
  response.headers = {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}};
  if (!refusal.allow.empty()) response.headers.emplace_back("Allow", refusal.allow);
  const auto pause = runtime::RetryDelayOf(runtime::FromGrpc(refusal.status));
  if (pause.count() > 0) response.headers.emplace_back("Retry-After", std::to_string((pause.count() + 999) / 1000));
  response.body = ErrorJson(refusal.status);
  return response;
}

std::string ContentTypeOf(const ConnectCall& call) {
  return std::string("application/") + (call.is_stream ? "connect+" : "") +
         (call.codec == Codec::kJson ? "json" : "proto");
}

absl::StatusOr<std::string> BytesOfMessage(const Descriptor& type, Codec codec, std::string text) {
  const std::unique_ptr<Message> message = NewMessage(type);
  if (codec == Codec::kProto) {
    // What cannot be read is refused here: a service would end the call without a word.
    if (message->ParseFromString(text)) return text;
    return runtime::Refuse("body", std::to_string(text.size()) + " bytes", "a " + type.full_name());
  }
  if (text.empty()) text = "{}";
  const auto parsed = google::protobuf::util::JsonStringToMessage(text, message.get());
  if (parsed.ok()) return message->SerializeAsString();
  return runtime::Refuse("body", std::string(parsed.message()), "the JSON of a " + type.full_name());
}

absl::StatusOr<std::string> MessageOfBytes(const Descriptor& type, Codec codec, std::string bytes) {
  if (codec == Codec::kProto) return bytes;
  const std::unique_ptr<Message> message = NewMessage(type);
  std::string text;
  if (message->ParseFromString(bytes) && google::protobuf::util::MessageToJsonString(*message, &text).ok()) return text;
  return absl::InternalError("an answer that is no " + type.full_name());
}

namespace {

std::string WithPrefix(unsigned char flags, std::string_view message) {
  std::string envelope(1, static_cast<char>(flags));
  for (int shift = 24; shift >= 0; shift -= 8) envelope += static_cast<char>((message.size() >> shift) & 0xff);
  return envelope.append(message);
}

}  // namespace

std::string Enveloped(std::string_view message) { return WithPrefix(0, message); }

std::string EndOfStream(const grpc::Status& status, const HttpHeaders& trailing) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  if (!status.ok()) json["error"] = ErrorOf(status);
  for (const auto& [name, value] : trailing) json["metadata"][name] = {value};
  return WithPrefix(kEnd, Dumped(json));
}

absl::StatusOr<std::string> OnlyEnvelope(std::string_view body) {
  const auto refuse = [](const std::string& what) {
    return runtime::Refuse("body", what, "one enveloped message: 0, its length in four bytes, itself");
  };
  if (body.size() < kEnvelope_bytes) return refuse(std::to_string(body.size()) + " bytes");
  std::size_t length = 0;
  for (std::size_t i = 1; i < kEnvelope_bytes; ++i) length = length << 8 | static_cast<unsigned char>(body[i]);
  const auto flags = static_cast<unsigned char>(body[0]);
  if ((flags & kCompressed) != 0) return refuse("a compressed message");
  if (flags != 0) return refuse("flags " + std::to_string(flags));
  if (length != body.size() - kEnvelope_bytes)
    return refuse("a length of " + std::to_string(length) + " before " + std::to_string(body.size() - kEnvelope_bytes));
  return std::string(body.substr(kEnvelope_bytes));
}

}  // namespace sixpoint::gateway
