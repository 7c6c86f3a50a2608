#include "services/runtime/https_listener.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <optional>
#include <utility>

#include "services/runtime/metrics.h"
#include "services/runtime/peer_address.h"

namespace sixpoint::runtime {
namespace {

using std::chrono::steady_clock;

constexpr int kBetweenLooks_ms = 250;
// So many are taken before those that are there get their turn.
constexpr int kAcceptedAtOnce = 8;
constexpr std::chrono::milliseconds kWithoutDescriptors{100};

const char* Phrase(int code) {
  switch (code) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
  }
  return "Internal Server Error";
}

std::string TextOf(const HttpAnswer& answer, bool with_body) {
  return "HTTP/1.1 " + std::to_string(answer.code) + " " + Phrase(answer.code) +
         "\r\nContent-Type: " + answer.content_type + "\r\nContent-Length: " + std::to_string(answer.body.size()) +
         "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n" +
         (answer.code == 405 ? "Allow: GET, HEAD\r\n" : "") + "\r\n" + (with_body ? answer.body : "");
}

struct RequestLine {
  std::string_view method, path;
};

// Of "GET /metrics?x HTTP/1.1"; none of anything else.
std::optional<RequestLine> RequestLineOf(std::string_view line) {
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return std::nullopt;
  const std::string_view target = line.substr(first + 1, last - first - 1), version = line.substr(last + 1);
  if ((version != "HTTP/1.1" && version != "HTTP/1.0") || target.empty() || target[0] != '/' ||
      target.find(' ') != std::string_view::npos)
    return std::nullopt;
  return RequestLine{line.substr(0, first), target.substr(0, target.find('?'))};
}

CounterBy& Answered() {
  static CounterBy answered("sixpoint_watchers_answered_total", "Requests at this port that were answered, by code.",
                            "code", {"200", "401", "403", "503"}, {"400", "404", "405", "431"});
  return answered;
}
Counter& Evicted() {
  static Counter evicted("sixpoint_watchers_evicted_total",
                         "Connections to this port that made room for others before they were answered.");
  return evicted;
}
Counter& Late() {
  static Counter late("sixpoint_watchers_late_total", "Connections to this port that took longer than they may.");
  return late;
}

}  // namespace

struct HttpsListener::Connection {
  Connection(ssl_ctx_st* tls, Descriptor accepted, const sockaddr_storage& from)
      : socket(tls, std::move(accepted)), peer(GrpcName(from)), peer_key(PeerKey(from)) {}

  TlsSocket socket;
  const std::string peer, peer_key;
  const steady_clock::time_point begin = steady_clock::now();
  enum class Step { kHandshake, kRequest, kAnswer } step = Step::kHandshake;
  std::string request, answer;
  std::string_view unsent;
  short wanted = POLLIN;
};

HttpsListener::HttpsListener(std::vector<Descriptor> listening, std::unique_ptr<TlsServer> tls, Answer answer,
                             const HttpLimits& limits)
    : listening_(std::move(listening)), tls_(std::move(tls)), answer_(std::move(answer)), limits_(limits) {
  Answered();
  Evicted();
  Late();
  thread_ = std::thread([this] { Run(); });
}

HttpsListener::~HttpsListener() {
  stopped_ = true;
  thread_.join();
}

void HttpsListener::Run() {
  while (!stopped_) {
    const bool accepts = steady_clock::now() >= accept_again_;
    std::vector<pollfd> looked;
    for (const Descriptor& socket : listening_)
      looked.push_back({socket.get(), static_cast<short>(accepts ? POLLIN : 0), 0});
    for (const Connection& connection : connections_) looked.push_back({connection.socket.fd(), connection.wanted, 0});
    const int ready = poll(looked.data(), looked.size(), kBetweenLooks_ms);
    if (ready < 0 && errno != EINTR) accept_again_ = steady_clock::now() + kWithoutDescriptors;
    std::size_t i = listening_.size();
    for (auto each = connections_.begin(); each != connections_.end(); ++i)
      each = looked[i].revents != 0 && !Serve(&*each) ? connections_.erase(each) : std::next(each);
    for (std::size_t socket = 0; socket < listening_.size(); ++socket)
      if ((looked[socket].revents & POLLIN) != 0) Accept(listening_[socket]);
    EndOld();
  }
}

void HttpsListener::Accept(const Descriptor& listening) {
  for (int i = 0; i < kAcceptedAtOnce; ++i) {
    sockaddr_storage peer{};
    socklen_t size = sizeof peer;
    Descriptor accepted(
        accept4(listening.get(), reinterpret_cast<sockaddr*>(&peer), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!accepted.is_open()) {
      // Without descriptors the next in line stays there, and poll would not sleep.
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)
        accept_again_ = steady_clock::now() + kWithoutDescriptors;
      return;
    }
    if (connections_.size() >= limits_.connections) MakeRoom();
    connections_.emplace_back(tls_->Current(), std::move(accepted), peer);
  }
}

void HttpsListener::MakeRoom() {
  std::map<std::string, std::size_t> counts;
  for (const Connection& connection : connections_) ++counts[connection.peer_key];
  std::size_t most = 0;
  for (const auto& [peer, count] : counts) most = std::max(most, count);
  const auto oldest = std::find_if(connections_.begin(), connections_.end(),
                                   [&](const Connection& each) { return counts[each.peer_key] == most; });
  Evicted().Add();
  connections_.erase(oldest);
}

void HttpsListener::EndOld() {
  const auto now = steady_clock::now();
  while (!connections_.empty() && now - connections_.front().begin > limits_.connection_life) {
    Late().Add();
    connections_.pop_front();
  }
}

bool HttpsListener::Serve(Connection* connection) {
  using Step = Connection::Step;
  using Went = TlsSocket::Went;
  for (;;) {
    Went went = Went::kOver;
    switch (connection->step) {
      case Step::kHandshake:
        went = connection->socket.ShakeHands();
        if (went == Went::kOn) connection->step = Step::kRequest;
        break;
      case Step::kRequest:
        went = connection->socket.Read(&connection->request);
        if (went == Went::kOn && TakeRequest(connection)) connection->step = Step::kAnswer;
        break;
      case Step::kAnswer:
        went = connection->socket.Write(&connection->unsent);
        if (went == Went::kOn && connection->unsent.empty()) {
          connection->socket.Close();
          return false;
        }
        break;
    }
    if (went == Went::kOver) return false;
    if (went == Went::kOn) continue;
    connection->wanted = went == Went::kWantsToRead ? POLLIN : POLLOUT;
    return true;
  }
}

bool HttpsListener::TakeRequest(Connection* connection) {
  const std::string& text = connection->request;
  const bool is_whole = text.find("\r\n\r\n") != std::string::npos;
  if (!is_whole && text.size() <= limits_.request_bytes) return false;
  HttpAnswer answer{431, "request: longer, want at most " + std::to_string(limits_.request_bytes) + " bytes\n"};
  bool with_body = true;
  if (is_whole && text.size() <= limits_.request_bytes) {
    const auto line = RequestLineOf(std::string_view(text).substr(0, text.find("\r\n")));
    with_body = !line || line->method != "HEAD";
    if (!line)
      answer = {400, "request: not HTTP, want GET of a path\n"};
    else if (line->method != "GET" && line->method != "HEAD")
      answer = {405, "request: another method, want GET or HEAD\n"};
    else
      answer = answer_({std::string(line->path), connection->socket.PeerCertificatePem(), connection->peer});
  }
  Answered().Add(std::to_string(answer.code));
  connection->answer = TextOf(answer, with_body);
  connection->unsent = connection->answer;
  return true;
}

}  // namespace sixpoint::runtime
