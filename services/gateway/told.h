// What another thread tells (gRPC's, a worker's), awaited without a thread that waits for it.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

// It is gone on with in the strand of who waits for it.
template <typename Value>
class Told {
 public:
  // begin(tell): begins what will call tell(value) once, from any thread.
  template <typename Begin>
  static Awaitable<Value> By(Begin begin) {
    namespace asio = boost::asio;
    const auto executor = co_await asio::this_coro::executor;
    // Named, and holding references alone: what a temporary of a co_await's operand owns, GCC 12 destroys twice.
    const auto initiate = [&executor, &begin](auto handler) {
      const auto kept = std::make_shared<decltype(handler)>(std::move(handler));
      const std::function<void(Value)> tell = [strand = executor, kept](Value value) {
        asio::post(strand, [kept, value = std::move(value)]() mutable { (*kept)(std::move(value)); });
      };
      begin(tell);
    };
    Value value =
        co_await asio::async_initiate<decltype(asio::use_awaitable), void(Value)>(initiate, asio::use_awaitable);
    co_return value;
  }
};

}  // namespace sixpoint::gateway
