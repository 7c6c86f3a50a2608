#include "services/gateway/gateway.h"

#include "services/gateway/doors.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/message_limits.h"
#include "services/runtime/span.h"
#include "services/runtime/trace.h"
#include "sixpoint/access/v1/access.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;

// JSON has names and blanks beside what it says, and bytes as base64.
constexpr std::size_t kJsonOverProto = 3;
constexpr std::chrono::seconds kDoorPatience{30};

// For the log, of answers that are no call's own.
grpc::StatusCode CodeOfHttp(unsigned status) {
  if (status < 400) return grpc::StatusCode::OK;
  if (status == 401) return grpc::StatusCode::UNAUTHENTICATED;
  if (status == 403) return grpc::StatusCode::PERMISSION_DENIED;
  if (status == 404) return grpc::StatusCode::NOT_FOUND;
  return status < 500 ? grpc::StatusCode::INVALID_ARGUMENT : grpc::StatusCode::UNAVAILABLE;
}

std::string TargetOf(const Exchange::Head& head) { return std::string(head.target().data(), head.target().size()); }

// Where the path leads, for the log: a method of the contract by its name, the rest by what it is; no query, no serial number.
std::string RouteName(const Exchange::Head& head) {
  const std::optional<Url> url = UrlOf(TargetOf(head));
  if (!url) return "/";
  if (MethodOf(url->path) != nullptr) return url->path;
  return "/" + url->segments.front().substr(0, 40);
}

// A method that asks for who calls is nobody's without a session: its service would take the call for the gateway's own.
bool IsForAnybody(const google::protobuf::MethodDescriptor& method) {
  return method.options().GetExtension(access::v1::rule).anybody();
}

ConnectRefusal NotSignedIn() {
  return {runtime::ToGrpc(
              runtime::Failure(errors::v1::SESSION_NOT_VALID, "session: none, want a sign-in by POST /session")),
          0, ""};
}

// What reads a scan's path is the page.
bool IsDoor(const Url& url, http::verb method) {
  const std::string& first = url.segments.front();
  const bool reads = method == http::verb::get || method == http::verb::head;
  return url.segments.size() > 1 && (first == "blobs" || first == "programs" || (first == "scans" && !reads));
}

HttpResponse FromElsewhere(const Exchange::Head& head) {
  const std::string origin = HeaderOf(head, "Origin");
  const absl::Status status =
      absl::PermissionDeniedError("origin: " + (origin.empty() ? "another site" : origin) +
                                  ", want the gateway's own: a page of another site may not ask");
  return ErrorResponse(runtime::ToGrpc(status));
}

}  // namespace

HttpResponse Guarded(HttpResponse response) {
  response.headers.emplace_back("X-Content-Type-Options", "nosniff");
  response.headers.emplace_back("Referrer-Policy", "no-referrer");
  response.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  response.headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
  // wasm: the decoder of clouds, from these files alone.
  response.headers.emplace_back(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; "
      "img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self' "
      "blob:; manifest-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'");
  return response;
}

Awaitable<void> Gateway::Handle(Exchange* exchange) {
  const runtime::Span span(runtime::Span::Kind::kServer, RouteName(exchange->head()),
                           HeaderOf(exchange->head(), runtime::kTraceparent));
  grpc::StatusCode code = grpc::StatusCode::OK;
  std::string why;
  try {
    co_await Route(exchange, span.traceparent(), &code);
  } catch (const std::exception& error) {
    why = error.what();
  }
  if (!why.empty()) {
    code = grpc::StatusCode::INTERNAL;
    HttpResponse response = Guarded(ErrorResponse(runtime::ToGrpc(absl::InternalError(why))));
    co_await exchange->Answer(std::move(response));
  }
  span.Write(code == grpc::StatusCode::INTERNAL ? runtime::LogLevel::kError : runtime::LogLevel::kInfo, code, nullptr);
}

Awaitable<void> Gateway::Route(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code) {
  const Exchange::Head& head = exchange->head();
  const std::optional<Url> url = UrlOf(TargetOf(head));
  HttpResponse response;
  if (!url) {
    *code = grpc::StatusCode::INVALID_ARGUMENT;
    response = ErrorResponse(runtime::ToGrpc(runtime::Refuse("target", TargetOf(head), "a path and a query")));
  } else if (Sessions::IsFromElsewhere(head)) {
    *code = grpc::StatusCode::PERMISSION_DENIED;
    response = FromElsewhere(head);
  } else if (url->path == "/session") {
    response = co_await sessions_.Answer(exchange, traceparent);
    if (response.status >= 400) *code = grpc::StatusCode::UNAUTHENTICATED;
  } else if (DirectorySignIn::Has(*url)) {
    response = co_await directory_.Answer(exchange, *url, traceparent);
    *code = CodeOfHttp(response.status);
  } else if (IsDoor(*url, head.method())) {
    response = co_await Door(exchange, *url, traceparent, code);
  } else if (url->path == "/health/live") {
    response = {200, {{"Content-Type", "text/plain; charset=utf-8"}, {"Cache-Control", "no-store"}}, "ok\n"};
  } else if (url->segments.front().rfind("sixpoint.", 0) == 0 || head.method() == http::verb::post) {
    co_await Connect(exchange, traceparent, code);
    co_return;
  } else {
    std::optional<HttpResponse> file;
    const bool reads = head.method() == http::verb::get || head.method() == http::verb::head;
    if (reads) file = files_.Answer(head, url->path);
    *code = file ? grpc::StatusCode::OK : grpc::StatusCode::NOT_FOUND;
    response =
        file ? *std::move(file)
             : ErrorResponse(runtime::ToGrpc(absl::NotFoundError("path: " + url->path + ", want one that there is")));
  }
  response = Guarded(std::move(response));
  co_await exchange->Answer(std::move(response));
}

Awaitable<HttpResponse> Gateway::Door(Exchange* exchange, const Url& url, const std::string& traceparent,
                                      grpc::StatusCode* code) {
  const std::string token = Sessions::TokenOf(*exchange);
  const identity::SessionJudgement judged = token.empty() ? identity::SessionJudgement() : trust_.Judge(token);
  const grpc::Status counts = token.empty() ? NotSignedIn().status : runtime::ToGrpc(runtime::StatusOf(judged));
  HttpResponse response;
  if (!counts.ok()) {
    response = ErrorResponse(counts);
  } else {
    const CallWish wish{token, traceparent, kDoorPatience};
    const std::string& door = url.segments.front();
    const std::string caller = judged.session.person.Text();
    if (door == "blobs")
      response = co_await BlobDoor(exchange, url, &upstream_, wish);
    else if (door == "programs")
      response = co_await ProgramDoor(exchange, url, &upstream_, wish);
    else
      response = co_await scans_.Answer(exchange, url, wish, caller);
  }
  *code = CodeOfHttp(response.status);
  co_return response;
}

Awaitable<void> Gateway::Connect(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code) {
  ConnectCall call;
  std::optional<ConnectRefusal> refusal = ReadCall(exchange->head(), &call);
  const std::string token = Sessions::TokenOf(*exchange);
  if (!refusal && !upstream_.Knows(*call.method)) {
    const absl::Status status = absl::UnimplementedError(call.method->full_name() + ": no service of the plant has it");
    refusal = ConnectRefusal{runtime::ToGrpc(status), 404, ""};
  }
  if (!refusal && token.empty() && !IsForAnybody(*call.method)) refusal = NotSignedIn();
  // The service judges it again. Here so that nothing is read or parsed of who has none.
  if (!refusal && !token.empty()) {
    const absl::Status counts = runtime::StatusOf(trust_.Judge(token));
    if (!counts.ok()) refusal = ConnectRefusal{runtime::ToGrpc(counts), 0, ""};
  }
  std::string message;
  if (!refusal && call.is_get) message = std::move(call.message);
  if (!refusal && !call.is_get) {
    const std::size_t most_bytes = runtime::GreatestRequest_bytes(*call.method);
    absl::StatusOr<std::string> body = co_await exchange->Body(
        call.codec == Codec::kJson ? kJsonOverProto * most_bytes : most_bytes + kEnvelope_bytes);
    if (body.ok() && call.is_stream) body = OnlyEnvelope(*body);
    if (body.ok())
      message = *std::move(body);
    else
      refusal = ConnectRefusal{runtime::ToGrpc(body.status()), 0, ""};
  }
  if (!refusal) {
    absl::StatusOr<std::string> bytes = BytesOfMessage(*call.method->input_type(), call.codec, std::move(message));
    if (bytes.ok())
      message = *std::move(bytes);
    else
      refusal = ConnectRefusal{runtime::ToGrpc(bytes.status()), 0, ""};
  }
  if (refusal) {
    *code = refusal->status.error_code();
    HttpResponse response = Guarded(ErrorResponse(*refusal));
    co_await exchange->Answer(std::move(response));
    co_return;
  }
  const CallWish wish{token, traceparent, call.timeout};
  if (call.is_stream)
    co_await Stream(exchange, call, std::move(message), wish, code);
  else
    co_await Unary(exchange, call, std::move(message), wish, code);
}

Awaitable<void> Gateway::Unary(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                               grpc::StatusCode* code) {
  Upstream::Answer answer = co_await upstream_.Call(*call.method, message, wish, exchange);
  grpc::Status status = answer.end.status;
  HttpResponse response;
  if (status.ok()) {
    absl::StatusOr<std::string> text =
        MessageOfBytes(*call.method->output_type(), call.codec, std::move(answer.message));
    if (text.ok())
      response.body = *std::move(text);
    else
      status = runtime::ToGrpc(text.status());
  }
  *code = status.error_code();
  if (!status.ok()) {
    response = ErrorResponse(status);
  } else {
    response.headers = {{"Content-Type", ContentTypeOf(call)}};
    // Asked again, it may be the same still; nobody between keeps what one person may see.
    response.headers.emplace_back("Cache-Control", call.is_get ? "private, no-cache" : "no-store");
    if (call.is_get) response.headers.emplace_back("ETag", EtagOf(response.body));
    if (call.is_get && HeaderOf(exchange->head(), "If-None-Match") == response.headers.back().second) {
      response.status = 304;
      response.body.clear();
    }
  }
  for (const auto& [name, value] : answer.end.trailing) response.headers.emplace_back("Trailer-" + name, value);
  response = Guarded(std::move(response));
  co_await exchange->Answer(std::move(response));
}

Awaitable<void> Gateway::Stream(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                                grpc::StatusCode* code) {
  const std::shared_ptr<StreamedCall> stream = co_await upstream_.Begin(*call.method, wish);
  exchange->WhenGone([stream] { stream->Cancel(); });
  HttpResponse begun;
  // The proxy in front is to hold nothing back.
  begun.headers = {{"Content-Type", ContentTypeOf(call)}, {"Cache-Control", "no-store"}, {"X-Accel-Buffering", "no"}};
  begun = Guarded(std::move(begun));
  co_await stream->Write(message, /*is_last=*/true);
  bool is_read = co_await exchange->Begin(std::move(begun));
  absl::Status broken;
  while (is_read && broken.ok()) {
    std::optional<std::string> next = co_await stream->Read();
    if (!next) break;
    const absl::StatusOr<std::string> told = MessageOfBytes(*call.method->output_type(), call.codec, *std::move(next));
    broken = told.status();
    if (!told.ok()) break;
    const std::string envelope = Enveloped(*told);
    is_read = co_await exchange->Send(envelope);
  }
  // An end that was not read is hurried; of one that was, this does nothing.
  if (!is_read || !broken.ok()) stream->Cancel();
  CallEnd end = co_await stream->End();
  exchange->WhenGone(nullptr);
  if (!broken.ok()) end.status = runtime::ToGrpc(broken);
  *code = end.status.error_code();
  if (!is_read) co_return;
  const std::string last = EndOfStream(end.status, end.trailing);
  is_read = co_await exchange->Send(last);
  if (is_read) co_await exchange->End();
}

}  // namespace sixpoint::gateway
