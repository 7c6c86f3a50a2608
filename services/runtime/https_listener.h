// The little of HTTP that whoever watches a service needs: GET of a path, over TLS, one request a connection. One thread for all, which
// never waits for one of them: a slow one costs its place alone, and where places are missing the oldest of the peers that have
// the most goes. Private to runtime (ADR 29).
#pragma once

#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "services/runtime/listening_sockets.h"
#include "services/runtime/tls_socket.h"

namespace sixpoint::runtime {

struct HttpRequest {
  std::string path;             // without what stands after ?
  std::string certificate_pem;  // as shown; empty: none
  std::string peer;             // as gRPC names it
};

struct HttpAnswer {
  int code = 200;
  std::string body;
  std::string content_type = "text/plain; charset=utf-8";
};

struct HttpLimits {
  std::size_t connections = 128;
  std::size_t request_bytes = 8192;
  std::chrono::milliseconds connection_life{10'000};  // from its first packet to its last
};

class HttpsListener {
 public:
  // Called in the listener's thread, which it should not hold up.
  using Answer = std::function<HttpAnswer(const HttpRequest&)>;

  HttpsListener(std::vector<Descriptor> listening, std::unique_ptr<TlsServer> tls, Answer answer,
                const HttpLimits& limits = {});
  ~HttpsListener();
  HttpsListener(const HttpsListener&) = delete;
  HttpsListener& operator=(const HttpsListener&) = delete;

 private:
  struct Connection;
  using Connections = std::list<Connection>;

  void Run();
  void Accept(const Descriptor& listening);
  void MakeRoom();
  void EndOld();
  // False: it is over.
  bool Serve(Connection* connection);
  bool TakeRequest(Connection* connection);

  const std::vector<Descriptor> listening_;
  const std::unique_ptr<TlsServer> tls_;
  const Answer answer_;
  const HttpLimits limits_;
  Connections connections_;
  std::chrono::steady_clock::time_point accept_again_{};
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

}  // namespace sixpoint::runtime
