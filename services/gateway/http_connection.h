// One connection: requests, one after the other. Private to the listener.
#pragma once

#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/chunk_encode.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "services/gateway/http_listener.h"
#include "services/runtime/errors.h"

namespace sixpoint::gateway {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using boost::system::error_code;

// What all connections share.
struct HttpShared {
  HttpOptions options;
  HttpListener::Handle handle;
  std::atomic<bool> is_stopping{false};
  std::atomic<std::size_t> bodies_bytes{0};
};

// Where it came from, as far as that is believed.
struct ClientPlace {
  std::string address;
  bool is_encrypted = false;
};
ClientPlace PlaceOf(const HttpOptions& options, const tcp::endpoint& peer, bool is_tls, const Exchange::Head& head);
// What a request that is no HTTP, or too long, is answered.
std::string BadRequestText(const std::string& message);

template <typename Stream>
class HttpConnection final : public Exchange, public std::enable_shared_from_this<HttpConnection<Stream>> {
 public:
  HttpConnection(std::shared_ptr<HttpShared> shared, Stream stream, tcp::endpoint peer)
      : shared_(std::move(shared)),
        stream_(std::move(stream)),
        peer_(std::move(peer)),
        timer_(stream_.get_executor()),
        watch_done_(stream_.get_executor(), std::chrono::steady_clock::time_point::max()) {}

  Awaitable<void> Run() {
    // One co_await a statement, here and below: GCC 12 goes wrong where one stands behind && or in a loop's condition.
    bool goes_on = co_await Greet();
    while (goes_on) {
      goes_on = co_await ReadHead();
      if (!goes_on) break;
      co_await shared_->handle(*this);
      goes_on = EndRequest();
    }
    co_await Leave();
  }

  // From its strand.
  void CloseIfIdle() {
    if (is_idle_) Close();
  }
  auto executor() { return stream_.get_executor(); }

  const Head& head() const override { return parser_->get(); }
  const std::string& client_address() const override { return place_.address; }
  bool is_encrypted() const override { return place_.is_encrypted; }

  Awaitable<absl::StatusOr<std::string>> Body(std::size_t most_bytes) override {
    const auto stated = parser_->content_length();
    if (stated && *stated > most_bytes) co_return TooLong(std::to_string(*stated), most_bytes);
    const std::size_t room = stated ? static_cast<std::size_t>(*stated) : most_bytes;
    if (!Reserve(room)) co_return absl::ResourceExhaustedError("bodies: as many as there is memory for, want a pause");
    if (head()[http::field::expect] == "100-continue") {
      const bool is_told = co_await Write(kContinue);
      if (!is_told) co_return Broken();
    }
    const auto& options = shared_->options;
    Expire(options.body_patience + Seconds(static_cast<double>(room) / options.slowest_bytes_per_s));
    parser_->body_limit(most_bytes);
    error_code error;
    if (!parser_->is_done())
      co_await http::async_read(stream_, buffer_, *parser_, asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    if (error == http::error::body_limit) co_return TooLong("more", most_bytes);
    if (error) co_return Broken();
    co_return std::move(parser_->get().body());
  }

  void WhenGone(std::function<void()> call) override {
    gone_call_ = std::move(call);
    if (!gone_call_) return;
    if (is_gone_) return Gone();
    if (!is_watching_ && parser_->is_done() && buffer_.size() == 0) Watch();
  }

  Awaitable<bool> Answer(HttpResponse response) override {
    http::response<http::string_body> message = HeadOf<http::string_body>(response);
    const bool is_head = head().method() == http::verb::head;
    message.body() = std::move(response.body);
    if (response.status != 304) message.prepare_payload();
    if (is_head) message.body().clear();  // its length stays
    Expire(shared_->options.write_patience +
           Seconds(static_cast<double>(message.body().size()) / shared_->options.slowest_bytes_per_s));
    error_code error;
    co_await http::async_write(stream_, message, asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    co_return Sent(!error);
  }

  Awaitable<bool> Begin(HttpResponse response) override {
    auto message = std::make_shared<http::response<http::empty_body>>(HeadOf<http::empty_body>(response));
    is_chunked_ = head().version() >= 11;
    if (is_chunked_) message->chunked(true);
    if (!is_chunked_) message->keep_alive(stays_open_ = false);
    http::response_serializer<http::empty_body> serializer(*message);
    Expire(shared_->options.write_patience);
    error_code error;
    co_await http::async_write_header(stream_, serializer, asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    co_return Sent(!error);
  }

  Awaitable<bool> Send(std::string_view piece) override {
    if (piece.empty() || head().method() == http::verb::head) co_return !is_gone_;
    if (!is_chunked_) {
      const bool is_sent = co_await Write(piece);
      co_return is_sent;
    }
    const auto chunk = http::make_chunk(asio::const_buffer(piece.data(), piece.size()));
    Expire(shared_->options.write_patience);
    error_code error;
    co_await asio::async_write(stream_, chunk, asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    co_return Sent(!error);
  }

  Awaitable<bool> End() override {
    if (!is_chunked_ || head().method() == http::verb::head) co_return !is_gone_;
    const auto last = http::make_chunk_last();
    Expire(shared_->options.write_patience);
    error_code error;
    co_await asio::async_write(stream_, last, asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    co_return Sent(!error);
  }

 private:
  static constexpr bool kIsTls = !std::is_same_v<Stream, tcp::socket>;
  static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

  static std::chrono::milliseconds Seconds(double seconds) {
    return std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds));
  }
  static absl::Status TooLong(const std::string& length, std::size_t most_bytes) {
    return absl::ResourceExhaustedError("body: " + length + " bytes, want at most " + std::to_string(most_bytes));
  }
  static absl::Status Broken() { return absl::CancelledError("body: it did not come whole"); }

  tcp::socket& socket() {
    if constexpr (kIsTls)
      return stream_.next_layer();
    else
      return stream_;
  }

  // What is awaited ends then, with the connection.
  void Expire(std::chrono::milliseconds patience) {
    timer_.expires_after(patience);
    timer_.async_wait([weak = this->weak_from_this()](error_code error) {
      if (const auto self = weak.lock(); self && !error) self->Close();
    });
  }
  void Close() {
    error_code ignored;
    socket().close(ignored);
  }

  Awaitable<bool> Greet() {
    error_code error;
    if constexpr (kIsTls) {
      Expire(shared_->options.head_patience);
      co_await stream_.async_handshake(asio::ssl::stream_base::server,
                                       asio::redirect_error(asio::use_awaitable, error));
    }
    co_return !error;
  }

  Awaitable<void> Leave() {
    error_code ignored;
    if constexpr (kIsTls) {
      if (socket().is_open()) {
        Expire(std::chrono::seconds(2));
        co_await stream_.async_shutdown(asio::redirect_error(asio::use_awaitable, ignored));
      }
    }
    socket().shutdown(tcp::socket::shutdown_both, ignored);
    timer_.cancel();
    Close();
  }

  // The first bytes of a request: whoever watched for the client's going may read them.
  Awaitable<bool> ReadHead() {
    is_idle_ = true;
    if (shared_->is_stopping) co_return false;
    Expire(shared_->options.idle_patience);
    error_code error;
    while (is_watching_) co_await watch_done_.async_wait(asio::redirect_error(asio::use_awaitable, error));
    if (is_gone_) co_return false;
    error = {};
    if (buffer_.size() == 0) {
      const std::size_t count = co_await stream_.async_read_some(buffer_.prepare(kPiece_bytes),
                                                                 asio::redirect_error(asio::use_awaitable, error));
      if (error) co_return false;
      buffer_.commit(count);
    }
    is_idle_ = false;
    Expire(shared_->options.head_patience);
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(shared_->options.head_bytes));
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // until its handler says more
    co_await http::async_read_header(stream_, buffer_, *parser_, asio::redirect_error(asio::use_awaitable, error));
    stays_open_ = parser_->keep_alive() && !shared_->is_stopping;
    timer_.cancel();
    if (!error) {
      place_ = PlaceOf(shared_->options, peer_, kIsTls, head());
      co_return true;
    }
    if (error.category() == http::make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message)
      co_await AnswerBadly(error);
    co_return false;
  }

  Awaitable<void> AnswerBadly(error_code why) {
    const bool is_long = why == http::error::header_limit;
    http::response<http::string_body> message(
        is_long ? http::status::request_header_fields_too_large : http::status::bad_request, 11);
    message.set(http::field::content_type, "application/json");
    message.keep_alive(false);
    message.body() = BadRequestText(why.message());
    message.prepare_payload();
    error_code ignored;
    co_await http::async_write(stream_, message, asio::redirect_error(asio::use_awaitable, ignored));
  }

  template <typename BodyOfIt>
  http::response<BodyOfIt> HeadOf(const HttpResponse& response) {
    // What was not read of the request would be taken for the next one.
    stays_open_ = stays_open_ && parser_->is_done() && !shared_->is_stopping;
    http::response<BodyOfIt> message(static_cast<http::status>(response.status), head().version());
    for (const auto& [name, value] : response.headers) message.insert(name, value);
    message.keep_alive(stays_open_);
    return message;
  }

  Awaitable<bool> Write(std::string_view bytes) {
    Expire(shared_->options.write_patience);
    error_code error;
    co_await asio::async_write(stream_, asio::buffer(bytes.data(), bytes.size()),
                               asio::redirect_error(asio::use_awaitable, error));
    timer_.cancel();
    co_return Sent(!error);
  }
  bool Sent(bool well) {
    if (!well) {
      stays_open_ = false;
      Gone();
    }
    return well;
  }

  // Reads what should not come yet, to see the connection's end.
  void Watch() {
    is_watching_ = true;
    stream_.async_read_some(buffer_.prepare(kPiece_bytes),
                            [self = this->shared_from_this()](error_code error, std::size_t count) {
                              self->buffer_.commit(count);
                              self->is_watching_ = false;
                              self->watch_done_.cancel();
                              if (error) self->Gone();
                            });
  }
  void Gone() {
    is_gone_ = true;
    if (const std::function<void()> call = std::exchange(gone_call_, nullptr)) call();
  }

  bool Reserve(std::size_t bytes) {
    if (shared_->bodies_bytes.fetch_add(bytes) + bytes > shared_->options.bodies_bytes) {
      shared_->bodies_bytes -= bytes;
      return false;
    }
    reserved_bytes_ += bytes;
    return true;
  }
  // Whether another may follow.
  bool EndRequest() {
    gone_call_ = nullptr;
    shared_->bodies_bytes -= std::exchange(reserved_bytes_, 0);
    return stays_open_ && parser_->is_done() && !is_gone_;
  }

  static constexpr std::size_t kPiece_bytes = 4096;

  const std::shared_ptr<HttpShared> shared_;
  Stream stream_;
  const tcp::endpoint peer_;
  ClientPlace place_;
  boost::beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  asio::steady_timer timer_, watch_done_;
  std::function<void()> gone_call_;
  std::size_t reserved_bytes_ = 0;
  bool is_idle_ = true, is_gone_ = false, is_watching_ = false, stays_open_ = true, is_chunked_ = false;
};

}  // namespace sixpoint::gateway
