#include "services/gateway/directory_sign_in.h"

#include <atomic>
#include <nlohmann/json.hpp>

#include "services/gateway/connect_protocol.h"
#include "services/gateway/cookies.h"
#include "services/gateway/told.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "sixpoint/plant/v1/account.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;

// Lax: it is to come along when the provider's site sends the browser back.
constexpr Cookie kTicketCookie{"sixpoint-sign-in", SameSite::kLax,
                               std::chrono::duration_cast<std::chrono::seconds>(SignInTickets::kLast)};
constexpr std::size_t kLongestCode_bytes = 4096;

// Why nobody is signed in, as the page is told (web/src/view/sign_in.tsx): one word, of these alone.
namespace why {
constexpr char kAgain[] = "again";        // of no sign-in that this browser began here in the last 10 minutes, or used
constexpr char kDeclined[] = "declined";  // the provider signed nobody in
constexpr char kProvider[] = "provider";  // it is away, or its answer cannot be read
constexpr char kStranger[] = "stranger";  // the plant takes nobody in by that
constexpr char kWait[] = "wait";          // too many failed, or are under way
constexpr char kSettings[] = "settings";  // the provider does not let the gateway in, or the plant knows no provider
constexpr char kPlant[] = "plant";        // a service is away
}  // namespace why

HttpResponse Sent(unsigned status, const std::string& location) {
  return {status, {{"Location", location}, {"Cache-Control", "no-store"}}, ""};
}

// Back to where the person was, with a word for the page. Nothing that came from outside is in it.
HttpResponse NotSignedIn(const Exchange& exchange, const std::optional<SignInTicket>& ticket, const char* word,
                         const std::string& what) {
  runtime::Log(runtime::LogLevel::kWarning, "nobody is signed in by the identity provider: " + what,
               {{"why", std::string(word)}, {"peer", exchange.client_address()}});
  const std::string path = ticket ? ticket->return_path : "/";
  return Sent(303, path + (path.find('?') == std::string::npos ? "?" : "&") + "sign_in=" + word);
}

const char* WordOf(CodeEnd end) {
  switch (end) {
    case CodeEnd::kCodeRefused:
    case CodeEnd::kTicketUsed:
      return why::kAgain;
    case CodeEnd::kClientRefused:
      return why::kSettings;
    case CodeEnd::kBusy:
      return why::kWait;
    case CodeEnd::kGiven:
    case CodeEnd::kAway:
      break;
  }
  return why::kProvider;
}

struct Reason {
  const char* word;
  std::string what;
};
// Of the provider's error (RFC 6749, 4.1.2.1; OpenID Connect Core 1.0, 3.1.2.6), which is repeated where it is one of these.
Reason OfError(const std::string& error) {
  for (const char* const ours :
       {"invalid_request", "unauthorized_client", "unsupported_response_type", "invalid_scope"})
    if (error == ours) return {why::kSettings, "the provider says " + error};
  for (const char* const away : {"server_error", "temporarily_unavailable"})
    if (error == away) return {why::kProvider, "the provider says " + error};
  for (const char* const known : {"access_denied", "login_required", "consent_required", "interaction_required"})
    if (error == known) return {why::kDeclined, "the provider says " + error};
  return {why::kDeclined, "the provider says another error"};
}

// Of the plant's refusal.
const char* WordOf(const absl::Status& status) {
  if (runtime::HasReason(status, errors::v1::SIGN_IN_REFUSED)) return why::kStranger;
  if (runtime::HasReason(status, errors::v1::SIGN_IN_SLOWED)) return why::kWait;
  if (runtime::HasReason(status, errors::v1::SIGN_INS_FULL)) return why::kWait;
  if (runtime::HasReason(status, errors::v1::IDENTITY_PROVIDER_AWAY)) return why::kProvider;
  if (runtime::HasReason(status, errors::v1::IDENTITY_PROVIDER_MISSING)) return why::kSettings;
  return why::kPlant;
}

const google::protobuf::MethodDescriptor& SignInMethod() {
  static const auto* const kMethod = plant::v1::SignInWithIdTokenRequest::descriptor()
                                         ->file()
                                         ->FindServiceByName("AccountService")
                                         ->FindMethodByName("SignInWithIdToken");
  return *kMethod;
}

}  // namespace

DirectorySignIn::DirectorySignIn(Upstream* upstream, std::optional<DirectoryClient> client)
    : upstream_(*upstream), client_(std::move(client)), workers_(client_ ? std::make_unique<CodeWorkers>() : nullptr) {}

void DirectorySignIn::Stop() {
  if (workers_ != nullptr) workers_->Stop();
}

bool DirectorySignIn::Has(const Url& url) {
  return url.path == "/session/provider" || url.path == "/session/start" || url.path == "/session/callback";
}

Awaitable<HttpResponse> DirectorySignIn::Answer(Exchange* exchange, const Url& url, const std::string& traceparent) {
  if (exchange->head().method() != http::verb::get) {
    const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "method: want GET");
    const ConnectRefusal refusal{status, 405, "GET"};
    co_return ErrorResponse(refusal);
  }
  if (url.path == "/session/provider") {
    nlohmann::ordered_json told = nlohmann::ordered_json::object();
    if (client_) told["name"] = client_->display_name;
    const std::string text = told.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    co_return HttpResponse{200, {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}}, text};
  }
  if (!client_)
    co_return ErrorResponse(runtime::ToGrpc(runtime::Failure(
        errors::v1::IDENTITY_PROVIDER_MISSING,
        "the gateway knows no identity provider, want --oidc FILE with an authorization_url and a token_url")));
  if (url.path == "/session/start") co_return Start(*exchange, url);
  const CallWish wish{"", traceparent, std::chrono::seconds(30)};
  co_return co_await ComeBack(exchange, url, wish);
}

HttpResponse DirectorySignIn::Start(const Exchange& exchange, const Url& url) const {
  for (const auto& [name, value] : url.query)
    if (name != "return") return ErrorResponse(runtime::ToGrpc(runtime::Refuse("query", name, "return, or nothing")));
  const std::string path = url.query.count("return") > 0 ? ValueOf(url, "return") : "/";
  if (!IsOwnPath(path))
    return ErrorResponse(runtime::ToGrpc(
        runtime::Refuse("return", path, "a path of this site, such as /blades/SN-1, of at most 1024 letters")));
  const SignInTicket ticket = SignInTickets::New(path, std::chrono::system_clock::now());
  HttpResponse response = Sent(302, AuthorizationUrl(*client_, tickets_.SecretsOf(ticket)));
  response.headers.emplace_back("Set-Cookie", SetText(kTicketCookie, exchange, tickets_.TextOf(ticket)));
  return response;
}

Awaitable<CodeAnswer> DirectorySignIn::IdTokenOf(Exchange* exchange, const SignInTicket& ticket,
                                                 const std::string& code) {
  // The place first: what is remembered grows no faster than the provider answers.
  std::shared_ptr<CodeWorkers::Place> place = workers_->Take(exchange->client_address());
  if (place == nullptr)
    co_return CodeAnswer{CodeEnd::kBusy, "", "as many codes are exchanged as may be at once, of all or of one address"};
  const UsedTickets::Use use = used_.Take(ticket, PeerOf(exchange->client_address()), std::chrono::system_clock::now());
  if (use == UsedTickets::Use::kAgain) co_return CodeAnswer{CodeEnd::kTicketUsed, "", "the ticket came back before"};
  if (use == UsedTickets::Use::kFull)
    co_return CodeAnswer{CodeEnd::kBusy, "", "as many came back in 10 minutes as may, of all or of one address"};
  const std::string verifier = tickets_.SecretsOf(ticket).verifier;
  const auto is_gone = std::make_shared<std::atomic<bool>>(false);
  exchange->WhenGone([is_gone] { *is_gone = true; });
  const auto begin = [this, &code, &verifier, &is_gone, &place](const std::function<void(CodeAnswer)>& tell) {
    workers_->Begin(std::move(place), [this, code, verifier, is_gone, tell] {
      tell(ExchangeCode(*client_, code, verifier, [this, &is_gone] { return *is_gone || workers_->is_stopping(); }));
    });
  };
  CodeAnswer answer = co_await Told<CodeAnswer>::By(begin);
  exchange->WhenGone(nullptr);
  if (answer.end != CodeEnd::kGiven) answer.why = "token_url: " + answer.why;
  co_return answer;
}

Awaitable<HttpResponse> DirectorySignIn::ComeBack(Exchange* exchange, const Url& url, const CallWish& wish) {
  const std::optional<SignInTicket> ticket =
      tickets_.Read(ValueOf(kTicketCookie, *exchange), std::chrono::system_clock::now());
  if (!ticket)
    co_return NotSignedIn(*exchange, ticket, why::kAgain, "no ticket of this gateway's last 10 minutes came along");
  const SignInSecrets secrets = tickets_.SecretsOf(*ticket);
  // Whoever sends somebody's browser here with a code of his own: the sign-in that it began itself goes on.
  if (!AreSame(ValueOf(url, "state"), secrets.state))
    co_return NotSignedIn(*exchange, ticket, why::kAgain, "the state is of another sign-in");
  // From here on the ticket is used, whatever comes of it.
  const std::string forget = SetText(kTicketCookie, *exchange, "");
  const std::string code = ValueOf(url, "code");
  const char* word = nullptr;
  std::string what;
  if (url.query.count("error") > 0) {
    const Reason reason = OfError(ValueOf(url, "error"));
    word = reason.word;
    what = reason.what;
  } else if (url.query.count("iss") > 0 && ValueOf(url, "iss") != client_->issuer) {  // RFC 9207
    word = why::kAgain;
    what = "another issuer (iss) answered";
  } else if (code.empty() || code.size() > kLongestCode_bytes) {
    word = why::kProvider;
    what = "it sent no code of 1 to 4096 bytes";
  }
  plant::v1::Session session;
  if (word == nullptr) {
    const CodeAnswer answer = co_await IdTokenOf(exchange, *ticket, code);
    if (answer.end == CodeEnd::kGiven) {
      plant::v1::SignInWithIdTokenRequest request;
      request.set_id_token(answer.id_token);
      request.set_nonce(secrets.nonce);
      request.set_client_address(exchange->client_address());
      auto [status, begun] = co_await upstream_.Call<plant::v1::Session>(SignInMethod(), request, wish, exchange);
      session = std::move(begun);
      const absl::Status refused = runtime::FromGrpc(status);
      if (!status.ok()) word = WordOf(refused);
      what = std::string(refused.message());
    } else {
      word = WordOf(answer.end);
      what = answer.why;
    }
  }
  HttpResponse response = word == nullptr ? Sent(303, ticket->return_path) : NotSignedIn(*exchange, ticket, word, what);
  response.headers.emplace_back("Set-Cookie", forget);
  if (word == nullptr) response.headers.emplace_back("Set-Cookie", SetText(kSessionCookie, *exchange, session.token()));
  co_return response;
}

}  // namespace sixpoint::gateway
