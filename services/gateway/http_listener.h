// HTTP/1.1, with or without TLS: takes connections, reads requests within limits of size and time, and gives them to a handler. HTTP/2 is
// the proxy's that stands in front (deploy/nginx).
#pragma once

#include <absl/status/statusor.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

struct HttpOptions {
  std::string address;                     // 127.0.0.1:7480, [::1]:7480
  std::string certificate_file, key_file;  // PEM; empty: without TLS
  // What a proxy on this computer says of the client (X-Forwarded-For, X-Forwarded-Proto) counts.
  bool behind_proxy = false;
  std::size_t connections = 1024, connections_of_one_address = 256;
  std::size_t head_bytes = 16 * 1024;            // a session's token has up to 4 KiB, a query the rest
  std::size_t bodies_bytes = 256 * 1024 * 1024;  // of all requests that are read or answered now, together
  std::chrono::seconds head_patience{10}, idle_patience{75}, body_patience{10}, write_patience{60};
  double slowest_bytes_per_s = 0.5e6;  // of a body, beyond its patience
};

class HttpListener {
 public:
  using Handle = std::function<Awaitable<void>(Exchange&)>;

  // INVALID_ARGUMENT of an address or certificate that cannot be used, UNAVAILABLE of a port that is taken.
  static absl::StatusOr<std::unique_ptr<HttpListener>> Open(const HttpOptions& options, Handle handle);
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  // The port that it got where the address says 0.
  int port() const;
  // Takes connections, in that many threads, until Stop.
  void Run(int threads);
  // No new connection or request; those that run are waited for, at most that long. From any thread.
  void Stop(std::chrono::milliseconds patience);

 private:
  class State;
  explicit HttpListener(std::unique_ptr<State> state);
  const std::unique_ptr<State> state_;
};

}  // namespace sixpoint::gateway
