// What the gateway asks of a service that never answers, and a stop meanwhile.
#include "services/gateway/upstream.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "sixpoint/plant/v1/account.pb.h"

namespace sixpoint::gateway {
namespace {

namespace asio = boost::asio;

// Takes connections, as the kernel does for whoever listens, and says nothing.
class SilentService {
 public:
  SilentService() : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(socket_, 16), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~SilentService() { close(socket_); }
  const std::string& address() const { return address_; }

 private:
  const int socket_;
  std::string address_;
};

const google::protobuf::MethodDescriptor& Method() {
  return *plant::v1::SignInRequest::descriptor()
              ->file()
              ->FindServiceByName("AccountService")
              ->FindMethodByName("SignIn");
}

const CallWish kWish{"", "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01", std::nullopt};

Awaitable<void> Ask(Upstream* upstream, std::shared_ptr<int> frame) {
  const std::string request;
  const Upstream::Answer answer = co_await upstream->Call(Method(), request, kWish, nullptr);
  *frame = answer.end.status.error_code();
}

Awaitable<void> Listen(Upstream* upstream, std::shared_ptr<int> frame, bool reads) {
  const std::shared_ptr<StreamedCall> call = co_await upstream->Begin(Method(), kWish);
  if (reads) {
    const std::optional<std::string> read = co_await call->Read();
    *frame = read ? 1 : 2;
  }
  // Held by what runs it alone, between gRPC's own calls.
  const auto executor = co_await asio::this_coro::executor;
  asio::steady_timer never(executor, std::chrono::hours(1));
  co_await never.async_wait(asio::use_awaitable);
  *frame = 3;
}

// gRPC would go on with a coroutine in a strand that is gone.
TEST(Upstream, WhatIsOpenAtAStopIsOverBeforeWhatRanItGoes) {
  const SilentService service;
  Upstream upstream({{"plant", service.address()}}, grpc::InsecureChannelCredentials());
  const auto frame = std::make_shared<int>(-1);
  {
    asio::io_context io;
    for (int i = 0; i < 5; ++i) {
      asio::co_spawn(asio::make_strand(io), Ask(&upstream, frame), asio::detached);
      asio::co_spawn(asio::make_strand(io), Listen(&upstream, frame, i % 2 == 0), asio::detached);
    }
    io.run_for(std::chrono::milliseconds(200));
    EXPECT_EQ(*frame, -1);
    EXPECT_EQ(frame.use_count(), 11);  // all wait
    upstream.Stop();
  }
  // None of them is anybody's any more, and none went on.
  EXPECT_EQ(frame.use_count(), 1);
  EXPECT_EQ(*frame, -1);
  upstream.Stop();
}

}  // namespace
}  // namespace sixpoint::gateway
