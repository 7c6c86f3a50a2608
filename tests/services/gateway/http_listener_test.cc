// The listener, by raw sockets as a stranger would use them.
#include "services/gateway/http_listener.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <thread>

namespace sixpoint::gateway {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using Clock = std::chrono::steady_clock;

// A connection that gives up after 10 s.
class Client {
 public:
  explicit Client(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience{10, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void Send(const std::string& text) { (void)!send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
  // Until that text came, or the end.
  std::string Read(const std::string& until) {
    std::string text;
    char piece[4096];
    while (text.find(until) == std::string::npos || until.empty()) {
      const auto count = recv(socket_, piece, sizeof piece, 0);
      if (count <= 0) break;
      text.append(piece, static_cast<std::size_t>(count));
    }
    return text;
  }
  std::string ReadToEnd() { return Read(""); }

 private:
  const int socket_;
};

class HttpListenerTest : public ::testing::Test {
 protected:
  void Serve(HttpOptions options = {}) {
    options.address = "127.0.0.1:0";
    auto opened = HttpListener::Open(options, [this](Exchange& exchange) { return Handle(&exchange); });
    ASSERT_TRUE(opened.ok()) << opened.status();
    listener_ = *std::move(opened);
    thread_ = std::thread([this] { listener_->Run(2); });
  }
  void TearDown() override {
    if (!listener_) return;
    listener_->Stop(std::chrono::seconds(5));
    thread_.join();
  }
  int port() const { return listener_->port(); }

  // GET answers hello; POST the body's length; /wait until the client is gone; /stream three pieces.
  Awaitable<void> Handle(Exchange* exchange) {
    const std::string target(exchange->head().target());
    HttpResponse response;
    if (target == "/wait") {
      boost::asio::steady_timer timer(co_await boost::asio::this_coro::executor, std::chrono::seconds(20));
      exchange->WhenGone([this, &timer] {
        ++gone_;
        timer.cancel();
      });
      try {
        co_await timer.async_wait(boost::asio::use_awaitable);
      } catch (const boost::system::system_error&) {
      }
      exchange->WhenGone(nullptr);
    }
    if (target == "/stream") {
      const HttpResponse begun;
      bool reads = co_await exchange->Begin(begun);
      for (int i = 0; i < 3 && reads; ++i) reads = co_await exchange->Send("piece");
      if (reads) co_await exchange->End();
      co_return;
    }
    const absl::StatusOr<std::string> body = co_await exchange->Body(1000);
    response.status = body.ok() ? 200 : 413;
    response.body = body.ok() ? "hello " + std::to_string(body->size()) : std::string(body.status().message());
    co_await exchange->Answer(std::move(response));
  }

  std::unique_ptr<HttpListener> listener_;
  std::thread thread_;
  std::atomic<int> gone_{0};
};

TEST_F(HttpListenerTest, AnswersOneRequestAfterAnother) {
  Serve();
  Client client(port());
  for (int i = 0; i < 3; ++i) {
    client.Send("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_THAT(client.Read("hello 0"), HasSubstr("200 OK"));
  }
  client.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nabcde");
  EXPECT_THAT(client.Read("hello 5"), HasSubstr("hello 5"));
  // Two at once: both, in their order.
  client.Send("GET / HTTP/1.1\r\nHost: x\r\n\r\nPOST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\na");
  EXPECT_THAT(client.Read("hello 1"), HasSubstr("hello 1"));
}

TEST_F(HttpListenerTest, AChunkedBodyAndOneThatIsAskedFor) {
  Serve();
  Client client(port());
  client.Send("POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n");
  EXPECT_THAT(client.Read("hello 3"), HasSubstr("hello 3"));
  client.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_THAT(client.Read("\r\n\r\n"), StartsWith("HTTP/1.1 100 Continue"));
  client.Send("ab");
  EXPECT_THAT(client.Read("hello 2"), HasSubstr("hello 2"));
}

TEST_F(HttpListenerTest, AStreamComesInPieces) {
  Serve();
  Client client(port());
  client.Send("GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(client.Read("0\r\n\r\n"), HasSubstr("5\r\npiece\r\n5\r\npiece\r\n5\r\npiece\r\n0\r\n\r\n"));
  Client old(port());  // without chunks the end is the connection's
  old.Send("GET /stream HTTP/1.0\r\n\r\n");
  EXPECT_THAT(old.ReadToEnd(), HasSubstr("\r\n\r\npiecepiecepiece"));
}

TEST_F(HttpListenerTest, WhatIsTooLongIsRefusedUnread) {
  Serve();
  Client stated(port());
  stated.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1001\r\n\r\n");
  EXPECT_THAT(stated.ReadToEnd(), HasSubstr("413"));
  Client chunked(port());
  chunked.Send("POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n500\r\n" + std::string(0x500, 'a'));
  EXPECT_THAT(chunked.ReadToEnd(), HasSubstr("413"));
  Client head(port());
  head.Send("GET / HTTP/1.1\r\nX: " + std::string(20'000, 'a') + "\r\n\r\n");
  EXPECT_THAT(head.ReadToEnd(), HasSubstr("431"));
}

TEST_F(HttpListenerTest, WhatIsNoHttpIsRefused) {
  Serve();
  for (const char* const text :
       {"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", "GET / HTTP/1.1\r\nno header\r\n\r\n",
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "GET / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        "POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
        "POST / HTTP/1.1\r\nContent-Length: 99999999999999999999999\r\n\r\n"}) {
    Client client(port());
    client.Send(text);
    EXPECT_THAT(client.ReadToEnd(), StartsWith("HTTP/1.1 400")) << text;
  }
}

TEST_F(HttpListenerTest, WhoIsSlowLosesHisPlace) {
  HttpOptions options;
  options.head_patience = options.body_patience = options.idle_patience = std::chrono::seconds(1);
  Serve(options);
  const auto began = Clock::now();
  Client silent(port()), head(port()), body(port());
  head.Send("GET / HTTP/1.1\r\nHo");
  body.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\na");
  silent.ReadToEnd();
  head.ReadToEnd();
  body.ReadToEnd();
  EXPECT_LT(Clock::now() - began, std::chrono::seconds(8));
  Client well(port());
  well.Send("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(well.Read("hello 0"), HasSubstr("hello 0"));
}

TEST_F(HttpListenerTest, ThatTheClientWentAwayIsSeen) {
  Serve();
  {
    Client client(port());
    client.Send("GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  for (const auto until = Clock::now() + std::chrono::seconds(5); gone_ == 0 && Clock::now() < until;)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(gone_, 1);
}

TEST_F(HttpListenerTest, OneAddressHasItsShareOfConnections) {
  HttpOptions options;
  options.connections_of_one_address = 2;
  Serve(options);
  Client one(port()), two(port());
  for (Client* each : {&one, &two}) {
    each->Send("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_THAT(each->Read("hello 0"), HasSubstr("hello 0"));
  }
  Client three(port());
  three.Send("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(three.ReadToEnd(), "");
}

TEST_F(HttpListenerTest, MemoryForBodiesIsBounded) {
  HttpOptions options;
  options.bodies_bytes = 1500;
  Serve(options);
  Client holds(port());
  holds.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  Client wants(port());
  wants.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n" + std::string(1000, 'a'));
  EXPECT_THAT(wants.ReadToEnd(), HasSubstr("as many as there is memory for"));
}

TEST_F(HttpListenerTest, AStopWaitsForWhatRuns) {
  Serve();
  Client idle(port()), busy(port());
  busy.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\na");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  std::thread stopping([this] { listener_->Stop(std::chrono::seconds(5)); });
  EXPECT_EQ(idle.ReadToEnd(), "");
  busy.Send("b");
  EXPECT_THAT(busy.ReadToEnd(), HasSubstr("hello 2"));
  stopping.join();
}

TEST(HttpListener, RefusesWhatItCannotServe) {
  const auto handle = [](Exchange&) -> Awaitable<void> { co_return; };
  for (const char* const address : {"", "x", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:-1"}) {
    HttpOptions options;
    options.address = address;
    EXPECT_TRUE(absl::IsInvalidArgument(HttpListener::Open(options, handle).status())) << address;
  }
  HttpOptions outside;
  outside.address = "0.0.0.0:0";
  EXPECT_THAT(std::string(HttpListener::Open(outside, handle).status().message()), HasSubstr("TLS"));
  outside.certificate_file = "/nonexistent";
  EXPECT_TRUE(absl::IsInvalidArgument(HttpListener::Open(outside, handle).status()));
}

}  // namespace
}  // namespace sixpoint::gateway
