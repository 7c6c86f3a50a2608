// Calls of any method of the plant's services, as bytes, without a thread that waits for them.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

// Of one call.
struct CallWish {
  std::string session;      // the token; empty: nobody is signed in, the gateway calls for itself
  std::string traceparent;  // of the span that the call is part of
  std::optional<std::chrono::milliseconds> timeout;  // none: the service's own
};

using HttpMetadata = std::vector<std::pair<std::string, std::string>>;

struct CallEnd {
  grpc::Status status;
  HttpMetadata trailing;  // what the service tells of itself; text alone
};

class Channels;
class OpenCalls;

// A call whose messages stream: one at a time, to be awaited in one strand. Its end is awaited before it goes.
class StreamedCall {
 public:
  virtual ~StreamedCall() = default;
  // False: no more will be read; End says why.
  virtual Awaitable<bool> Write(const std::string& message, bool is_last) = 0;
  virtual Awaitable<std::optional<std::string>> Read() = 0;
  virtual Awaitable<CallEnd> End() = 0;
  // From any thread.
  virtual void Cancel() = 0;
};

class Upstream {
 public:
  // addresses: by area; credentials: services/gateway's.
  Upstream(std::map<std::string, std::string> addresses, std::shared_ptr<grpc::ChannelCredentials> credentials);
  ~Upstream();

  // Whether some service here has it.
  bool Knows(const google::protobuf::MethodDescriptor& method) const;

  struct Answer {
    CallEnd end;
    std::string message;  // where end.status is OK
  };
  // Ends early, CANCELLED, where the exchange's client goes away.
  Awaitable<Answer> Call(const google::protobuf::MethodDescriptor& method, const std::string& request,
                         const CallWish& wish, Exchange* exchange);
  template <typename Response, typename Request>
  Awaitable<std::pair<grpc::Status, Response>> Call(const google::protobuf::MethodDescriptor& method,
                                                    const Request& request, const CallWish& wish, Exchange* exchange) {
    const std::string bytes = request.SerializeAsString();
    Answer answer = co_await Call(method, bytes, wish, exchange);
    Response response;
    if (answer.end.status.ok() && !response.ParseFromString(answer.message))
      answer.end.status = grpc::Status(grpc::StatusCode::INTERNAL, "an answer that cannot be read");
    co_return std::pair(std::move(answer.end.status), std::move(response));
  }
  Awaitable<std::shared_ptr<StreamedCall>> Begin(const google::protobuf::MethodDescriptor& method,
                                                 const CallWish& wish);
  // Once nobody is served any more, and before what awaits the calls goes: ends them, and nothing is told after that.
  void Stop();

 private:
  std::map<std::string, std::unique_ptr<Channels>> channels_;
  const std::shared_ptr<OpenCalls> open_;  // theirs too, to their end
};

}  // namespace sixpoint::gateway
