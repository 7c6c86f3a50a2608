#include "services/gateway/upstream.h"

#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <atomic>
#include <functional>

#include "services/gateway/open_calls.h"
#include "services/gateway/told.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/trace.h"

namespace sixpoint::gateway {
namespace {

using google::protobuf::MethodDescriptor;
using grpc::ByteBuffer;

// A service takes 16 calls on a connection; more would wait in gRPC, behind pages that listen for hours.
constexpr int kCallsOfChannel = 14;
constexpr std::size_t kMostChannels = 64;

ByteBuffer BufferOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return ByteBuffer(&slice, 1);
}

std::string BytesOf(const ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

std::string PathOf(const MethodDescriptor& method) {
  return "/" + std::string(method.service()->full_name()) + "/" + method.name();
}

// "plant" of sixpoint.plant.v1.
std::string AreaOf(const MethodDescriptor& method) {
  const std::string& package = method.file()->package();
  const std::size_t begin = package.find('.') + 1;
  return package.rfind("sixpoint.", 0) == 0 ? package.substr(begin, package.find('.', begin) - begin) : "";
}

void Prepare(const CallWish& wish, grpc::ClientContext* context) {
  if (!wish.session.empty()) context->AddMetadata(runtime::kSession, wish.session);
  context->AddMetadata(runtime::kTraceparent, wish.traceparent);
  if (wish.timeout) runtime::EndBy(std::chrono::steady_clock::now() + *wish.timeout, context);
}

CallEnd EndOf(grpc::Status status, const grpc::ClientContext& context) {
  CallEnd end{std::move(status), {}};
  for (const char* const key : {runtime::kServerVersion, runtime::kServerTime_us}) {
    const auto found = context.GetServerTrailingMetadata().find(key);
    if (found != context.GetServerTrailingMetadata().end())
      end.trailing.emplace_back(key, std::string(found->second.data(), found->second.size()));
  }
  return end;
}

}  // namespace

// The connections to one service: as many as its calls want.
class Channels {
 public:
  Channels(std::string address, std::shared_ptr<grpc::ChannelCredentials> credentials)
      : address_(std::move(address)), credentials_(std::move(credentials)) {}

  struct Channel {
    explicit Channel(const std::shared_ptr<grpc::Channel>& channel) : stub(channel) {}
    grpc::GenericStub stub;
    std::atomic<int> calls{0};
  };
  // Held while a call lasts.
  class Place {
   public:
    explicit Place(std::shared_ptr<Channel> channel) : channel_(std::move(channel)) { ++channel_->calls; }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    ~Place() { --channel_->calls; }
    grpc::GenericStub& stub() { return channel_->stub; }

   private:
    const std::shared_ptr<Channel> channel_;
  };

  std::unique_ptr<Place> Take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& each : channels_)
      if (each->calls < kCallsOfChannel) return std::make_unique<Place>(each);
    if (channels_.size() < kMostChannels) {
      const int number = static_cast<int>(channels_.size());
      channels_.push_back(std::make_shared<Channel>(runtime::PassOnTo(address_, credentials_, number)));
      return std::make_unique<Place>(channels_.back());
    }
    return std::make_unique<Place>(*std::min_element(channels_.begin(), channels_.end(),
                                                     [](const auto& a, const auto& b) { return a->calls < b->calls; }));
  }

 private:
  const std::string address_;
  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<Channel>> channels_;
};

namespace {

class Duplex final : public StreamedCall,
                     public grpc::ClientBidiReactor<ByteBuffer, ByteBuffer>,
                     public std::enable_shared_from_this<Duplex> {
 public:
  Duplex(std::unique_ptr<Channels::Place> place, std::shared_ptr<OpenCalls> open)
      : place_(std::move(place)), open_(std::move(open)) {}

  void Start(const MethodDescriptor& method, const CallWish& wish) {
    Prepare(wish, &context_);
    self_ = shared_from_this();
    open_->Add(this, [self = self_] { self->Abandon(); });
    place_->stub().PrepareBidiStreamingCall(&context_, PathOf(method), grpc::StubOptions(), this);
    AddHold();  // until End: what is begun between gRPC's own calls keeps it open
    StartCall();
  }

  Awaitable<bool> Write(const std::string& message, bool is_last) override {
    written_ = BufferOf(message);
    co_return co_await Told<bool>::By([this, is_last](std::function<void(bool)> tell) {
      on_write_ = std::move(tell);
      if (is_last)
        StartWriteLast(&written_, grpc::WriteOptions());
      else
        StartWrite(&written_);
    });
  }
  Awaitable<std::optional<std::string>> Read() override {
    const bool came = co_await Told<bool>::By([this](std::function<void(bool)> tell) {
      on_read_ = std::move(tell);
      StartRead(&read_);
    });
    if (!came) co_return std::nullopt;
    co_return BytesOf(read_);
  }
  Awaitable<CallEnd> End() override {
    grpc::Status status = co_await Told<grpc::Status>::By([this](std::function<void(grpc::Status)> tell) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!done_) {
          on_done_ = std::move(tell);
          tell = nullptr;
        }
      }
      LetGo();
      if (tell) tell(*done_);
    });
    co_return EndOf(std::move(status), context_);
  }
  void Cancel() override { context_.TryCancel(); }

 private:
  void OnWriteDone(bool well) override { std::exchange(on_write_, nullptr)(well); }
  void OnReadDone(bool well) override { std::exchange(on_read_, nullptr)(well); }
  void OnDone(const grpc::Status& status) override {
    const std::shared_ptr<Duplex> until_the_end = std::move(self_);
    std::function<void(grpc::Status)> tell;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      done_ = status;
      tell = std::move(on_done_);
    }
    if (tell) tell(status);
    tell = nullptr;  // with what it keeps of who awaits it
    open_->Remove(this);
  }
  void LetGo() {
    if (!std::exchange(is_let_go_, true)) RemoveHold();
  }
  // Where nobody will await its end any more.
  void Abandon() {
    context_.TryCancel();
    LetGo();
  }

  const std::unique_ptr<Channels::Place> place_;
  const std::shared_ptr<OpenCalls> open_;
  grpc::ClientContext context_;
  ByteBuffer written_, read_;
  std::function<void(bool)> on_write_, on_read_;
  std::shared_ptr<Duplex> self_;  // gRPC's, until OnDone
  bool is_let_go_ = false;
  std::mutex mutex_;
  std::optional<grpc::Status> done_;
  std::function<void(grpc::Status)> on_done_;
};

// One call's; gRPC holds it to the call's end.
struct UnaryCall {
  explicit UnaryCall(std::unique_ptr<Channels::Place> taken) : place(std::move(taken)) {}
  const std::unique_ptr<Channels::Place> place;
  grpc::ClientContext context;
  ByteBuffer request, response;
  std::function<void(grpc::Status)> tell;
};

}  // namespace

Upstream::Upstream(std::map<std::string, std::string> addresses, std::shared_ptr<grpc::ChannelCredentials> credentials)
    : open_(std::make_shared<OpenCalls>()) {
  for (const auto& [area, address] : addresses) channels_[area] = std::make_unique<Channels>(address, credentials);
}
Upstream::~Upstream() = default;
void Upstream::Stop() { open_->CancelAll(); }

bool Upstream::Knows(const MethodDescriptor& method) const { return channels_.count(AreaOf(method)) > 0; }

Awaitable<Upstream::Answer> Upstream::Call(const MethodDescriptor& method, const std::string& request,
                                           const CallWish& wish, Exchange* exchange) {
  const auto call = std::make_shared<UnaryCall>(channels_.at(AreaOf(method))->Take());
  Prepare(wish, &call->context);
  call->request = BufferOf(request);
  if (exchange != nullptr) exchange->WhenGone([call] { call->context.TryCancel(); });
  const auto begin = [this, &call, &method](const std::function<void(grpc::Status)>& tell) {
    call->tell = tell;
    open_->Add(call.get(), [call] { call->context.TryCancel(); });
    call->place->stub().UnaryCall(&call->context, PathOf(method), grpc::StubOptions(), &call->request, &call->response,
                                  [call, open = open_](grpc::Status ended) {
                                    // What keeps the awaiting coroutine goes before the call counts as ended.
                                    std::exchange(call->tell, nullptr)(std::move(ended));
                                    open->Remove(call.get());
                                  });
  };
  grpc::Status status = co_await Told<grpc::Status>::By(begin);
  if (exchange != nullptr) exchange->WhenGone(nullptr);
  Answer answer;
  answer.end = EndOf(std::move(status), call->context);
  if (answer.end.status.ok()) answer.message = BytesOf(call->response);
  co_return answer;
}

Awaitable<std::shared_ptr<StreamedCall>> Upstream::Begin(const MethodDescriptor& method, const CallWish& wish) {
  const auto call = std::make_shared<Duplex>(channels_.at(AreaOf(method))->Take(), open_);
  call->Start(method, wish);
  co_return call;
}

}  // namespace sixpoint::gateway
