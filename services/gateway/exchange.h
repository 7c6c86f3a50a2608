// One HTTP request and its answer, as routes see it: whatever connection it came by.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sixpoint::gateway {

template <typename T>
using Awaitable = boost::asio::awaitable<T>;

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

struct HttpResponse {
  unsigned status = 200;
  HttpHeaders headers;
  std::string body;
};

// All of it happens in the connection's strand.
class Exchange {
 public:
  using Head = boost::beast::http::request_header<>;
  virtual ~Exchange() = default;

  virtual const Head& head() const = 0;
  // From where the client reached the plant: behind a proxy what that says, else the connection's other end.
  virtual const std::string& client_address() const = 0;
  // Whether the client's way here, up to the proxy where there is one, is encrypted.
  virtual bool is_encrypted() const = 0;

  // The request's whole body. RESOURCE_EXHAUSTED of one that is longer, or for which there is no room now; CANCELLED of one that does
  // not come.
  virtual Awaitable<absl::StatusOr<std::string>> Body(std::size_t most_bytes) = 0;
  // Called once when the client goes away before it is answered; empty: nothing is any more.
  virtual void WhenGone(std::function<void()> call) = 0;

  // The whole answer. False: it could not be sent; here and below.
  virtual Awaitable<bool> Answer(HttpResponse response) = 0;
  // Or one in pieces: its head (the response's body is not looked at), the pieces, the end. A client that reads none of it for a minute is
  // gone.
  virtual Awaitable<bool> Begin(HttpResponse response) = 0;
  virtual Awaitable<bool> Send(std::string_view piece) = 0;
  virtual Awaitable<bool> End() = 0;
};

// The header's value, empty where there is none.
std::string HeaderOf(const Exchange::Head& head, std::string_view name);
// Of an answer's bytes, by their SHA-256.
std::string EtagOf(std::string_view bytes);

}  // namespace sixpoint::gateway
