#include "services/gateway/sessions.h"

#include <chrono>
#include <nlohmann/json.hpp>

#include "identity/session.h"
#include "services/gateway/connect_protocol.h"
#include "services/gateway/cookies.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/account.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;
using nlohmann::ordered_json;
using plant::v1::RenewSessionRequest;
using plant::v1::SignInRequest;
using plant::v1::SignOutRequest;

constexpr std::size_t kMostBody_bytes = 4096;
// A page asks every few minutes; a token is renewed once that little of it is left.
constexpr std::chrono::minutes kRenewWithin{5};

const google::protobuf::MethodDescriptor& AccountMethod(const char* name) {
  static const auto* const kService = SignInRequest::descriptor()->file()->FindServiceByName("AccountService");
  return *kService->FindMethodByName(name);
}

HttpResponse JsonResponse(const ordered_json& json) {
  return {200, {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}}, json.dump()};
}

// with_cookie: the browser is to send this token from now on.
HttpResponse ToldSession(const Exchange& exchange, const plant::v1::Session& session, bool with_cookie) {
  plant::v1::Session told = session;
  told.clear_token();  // scripts have no use for it
  const auto json = MessageOfBytes(*told.GetDescriptor(), Codec::kJson, told.SerializeAsString());
  if (!json.ok()) return ErrorResponse(runtime::ToGrpc(json.status()));
  HttpResponse response = JsonResponse(ordered_json::parse(*json));
  if (with_cookie) response.headers.emplace_back("Set-Cookie", SetText(kSessionCookie, exchange, session.token()));
  return response;
}

absl::StatusOr<SignInRequest> ReadSignIn(const std::string& body) {
  const ordered_json json = ordered_json::parse(body, nullptr, /*allow_exceptions=*/false);
  SignInRequest request;
  if (!json.is_object()) return runtime::Refuse("body", "no JSON object", R"({"name": "users/NAME", "password": ...})");
  for (const auto& [name, value] : json.items()) {
    if (name != "name" && name != "password") return runtime::Refuse("body", name, "name and password");
    if (!value.is_string()) return runtime::Refuse(name, value.type_name(), "a text");
    (name == "name" ? *request.mutable_name() : *request.mutable_password()) = value.get<std::string>();
  }
  return request;
}

}  // namespace

std::string Sessions::TokenOf(const Exchange& exchange) {
  const std::string authorization = HeaderOf(exchange.head(), "Authorization");
  constexpr std::string_view kBearer = "Bearer ";
  if (authorization.compare(0, kBearer.size(), kBearer) == 0) return authorization.substr(kBearer.size());
  return ValueOf(kSessionCookie, exchange);
}

bool Sessions::IsFromElsewhere(const Exchange::Head& head) {
  const std::string site = HeaderOf(head, "Sec-Fetch-Site"), origin = HeaderOf(head, "Origin");
  const bool reads = head.method() == http::verb::get || head.method() == http::verb::head;
  // A link to a page may stand anywhere; it is read by who follows it alone.
  const bool is_page = reads && HeaderOf(head, "Sec-Fetch-Mode") == "navigate";
  if (is_page) return false;
  if (!site.empty() && site != "same-origin" && site != "none") return true;
  if (origin.empty()) return false;
  const std::string host = HeaderOf(head, "Host");
  return origin != "https://" + host && origin != "http://" + host;
}

Awaitable<HttpResponse> Sessions::Answer(Exchange* exchange, const std::string& traceparent) {
  CallWish wish{"", traceparent, std::chrono::seconds(30)};
  switch (exchange->head().method()) {
    case http::verb::post:
      co_return co_await SignIn(exchange, wish);
    case http::verb::get:
      co_return co_await Renew(exchange, wish);
    case http::verb::delete_:
      co_return co_await SignOut(exchange, wish);
    default:
      break;
  }
  const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "method: want POST, GET or DELETE");
  const ConnectRefusal refusal{status, 405, "POST, GET, DELETE"};
  co_return ErrorResponse(refusal);
}

Awaitable<HttpResponse> Sessions::SignIn(Exchange* exchange, const CallWish& wish) {
  const absl::StatusOr<std::string> body = co_await exchange->Body(kMostBody_bytes);
  if (!body.ok()) co_return ErrorResponse(runtime::ToGrpc(body.status()));
  absl::StatusOr<SignInRequest> request = ReadSignIn(*body);
  if (!request.ok()) co_return ErrorResponse(runtime::ToGrpc(request.status()));
  request->set_client_address(exchange->client_address());
  const auto [status, session] =
      co_await upstream_.Call<plant::v1::Session>(AccountMethod("SignIn"), *request, wish, exchange);
  if (!status.ok()) co_return ErrorResponse(status);
  co_return ToldSession(*exchange, session, /*with_cookie=*/true);
}

Awaitable<HttpResponse> Sessions::Renew(Exchange* exchange, const CallWish& wish) {
  const std::string token = TokenOf(*exchange);
  // Nobody is signed in: an answer, and no failure that a browser would show.
  if (token.empty()) co_return JsonResponse(ordered_json::object());
  const absl::StatusOr<identity::Session> read = identity::ReadSession(token);
  if (!read.ok())
    co_return ErrorResponse(runtime::ToGrpc(runtime::Failure(
        errors::v1::SESSION_NOT_VALID, "session: not one that can be read, want a sign-in by POST /session")));
  // What it says is believed by nobody before the plant has looked at it.
  RenewSessionRequest request;
  request.set_token(token);
  const auto [status, session] =
      co_await upstream_.Call<plant::v1::Session>(AccountMethod("RenewSession"), request, wish, exchange);
  if (!status.ok()) {
    HttpResponse refused = ErrorResponse(status);
    if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED)
      refused.headers.emplace_back("Set-Cookie", SetText(kSessionCookie, *exchange, ""));
    co_return refused;
  }
  const bool is_nearly_over = read->until <= std::chrono::system_clock::now() + kRenewWithin;
  co_return ToldSession(*exchange, session, is_nearly_over);
}

Awaitable<HttpResponse> Sessions::SignOut(Exchange* exchange, const CallWish& wish) {
  SignOutRequest request;
  request.set_token(TokenOf(*exchange));
  HttpResponse response = JsonResponse(ordered_json::object());
  if (!request.token().empty()) {
    const auto [status, ended] =
        co_await upstream_.Call<plant::v1::SignOutResponse>(AccountMethod("SignOut"), request, wish, exchange);
    // What is no session of the plant's is forgotten like one.
    if (!status.ok() && status.error_code() != grpc::StatusCode::UNAUTHENTICATED) co_return ErrorResponse(status);
  }
  response.headers.emplace_back("Set-Cookie", SetText(kSessionCookie, *exchange, ""));
  response.headers.emplace_back("Clear-Site-Data", "\"cache\"");  // points of parts that the next person may not see
  co_return response;
}

}  // namespace sixpoint::gateway
