#include "services/gateway/scan_door.h"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/this_coro.hpp>
#include <charconv>
#include <utility>
#include <vector>

#include "services/gateway/connect_protocol.h"
#include "services/gateway/doors.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "sixpoint/bounds/v1/bounds.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::gateway {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using ingest::v1::UploadScanRequest;
using ingest::v1::UploadScanResponse;

constexpr std::size_t kMostText_bytes = 64 * 1024;

const google::protobuf::MethodDescriptor& UploadMethod() {
  static const auto* const kMethod = &MethodNamed("sixpoint.ingest.v1.ScanService.UploadScan");
  return *kMethod;
}

// As the contract says.
std::size_t MostPayload_bytes() {
  const auto* const payload = ingest::v1::ScanBlock::descriptor()->FindFieldByName("payload");
  return static_cast<std::size_t>(payload->options().GetExtension(bounds::v1::most_bytes));
}

HttpResponse Refusal(const absl::Status& status) { return ErrorResponse(runtime::ToGrpc(status)); }

// As it is answered over Connect: JSON, whatever the body was.
HttpResponse JsonOf(const google::protobuf::Message& message) {
  absl::StatusOr<std::string> json =
      MessageOfBytes(*message.GetDescriptor(), Codec::kJson, message.SerializeAsString());
  if (!json.ok()) return Refusal(json.status());
  return {200, {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}}, *std::move(json)};
}

template <typename Message>
absl::StatusOr<Message> MessageOf(const Exchange& exchange, std::string body) {
  const bool is_proto = HeaderOf(exchange.head(), "Content-Type").rfind("application/proto", 0) == 0;
  const absl::StatusOr<std::string> bytes =
      BytesOfMessage(*Message::descriptor(), is_proto ? Codec::kProto : Codec::kJson, std::move(body));
  if (!bytes.ok()) return bytes.status();
  Message message;
  if (!message.ParseFromString(*bytes)) return runtime::Refuse("body", "not readable", Message::descriptor()->name());
  return message;
}

absl::StatusOr<int> NumberOf(const std::string& field, const std::string& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size() && number >= 0) return number;
  return runtime::Refuse(field, text.substr(0, 40), "a whole number");
}

// An upload has one request at a time.
absl::Status IsBusy(const std::string& scan_id) {
  return runtime::Failure(errors::v1::UPLOAD_OVERTAKEN,
                          "scan: " + scan_id + " (another request is at work on it), want one after the other",
                          {{"resource", runtime::NameOf("scans", scan_id)}});
}

// Whoever cancels a stream waits for its end, and nobody for him.
void LetGo(const asio::any_io_executor& executor, std::shared_ptr<StreamedCall> stream) {
  asio::co_spawn(
      executor,
      [stream = std::move(stream)]() -> Awaitable<void> {
        stream->Cancel();
        co_await stream->End();
      },
      asio::detached);
}

// What the service says why the stream is over.
Awaitable<HttpResponse> EndOfUpload(const std::shared_ptr<StreamedCall>& stream) {
  CallEnd end = co_await stream->End();
  if (end.status.ok())
    end.status = grpc::Status(grpc::StatusCode::UNAVAILABLE, "the upload ended: send the header again");
  co_return ErrorResponse(end.status);
}

}  // namespace

Awaitable<HttpResponse> ScanDoor::Answer(Exchange* exchange, const Url& url, const CallWish& wish,
                                         const std::string& caller) {
  const std::vector<std::string>& path = url.segments;
  const Key key{caller, path.size() > 1 ? path[1] : ""};
  const bool is_block = path.size() == 4 && path[2] == "blocks", is_end = path.size() == 3 && path[2] == "end";
  HttpResponse response;
  if (exchange->head().method() != http::verb::put) {
    const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "method: want PUT; a scan is read by ScanService");
    const ConnectRefusal refusal{status, 405, "PUT"};
    response = ErrorResponse(refusal);
  } else if (path.size() == 2) {
    response = co_await PutHeader(exchange, key, wish);
  } else if (is_block) {
    response = co_await PutBlock(exchange, url, key);
  } else if (is_end) {
    response = co_await PutEnd(exchange, key);
  } else {
    response = Refusal(absl::NotFoundError("path: " + url.path.substr(0, 200) +
                                           ", want /scans/{scan}, /scans/{scan}/blocks/{n} or /scans/{scan}/end"));
  }
  co_return response;
}

Awaitable<HttpResponse> ScanDoor::PutHeader(Exchange* exchange, const Key& key, const CallWish& wish) {
  absl::StatusOr<std::string> body = co_await exchange->Body(kMostText_bytes);
  if (!body.ok()) co_return Refusal(body.status());
  UploadScanRequest request;
  absl::StatusOr<ingest::v1::ScanHeader> header = MessageOf<ingest::v1::ScanHeader>(*exchange, *std::move(body));
  if (!header.ok()) co_return Refusal(header.status());
  if (!header->scan_id().empty() && header->scan_id() != key.second)
    co_return Refusal(runtime::Refuse("scan_id", header->scan_id(), key.second + ", as the path has it"));
  header->set_scan_id(key.second);
  *request.mutable_header() = *std::move(header);
  const auto executor = co_await asio::this_coro::executor;
  const absl::StatusOr<std::shared_ptr<Upload>> made = Make(key, executor);
  if (!made.ok()) co_return Refusal(made.status());
  const std::shared_ptr<Upload> upload = *made;
  CallWish lasting = wish;
  lasting.timeout.reset();  // as long as the scan
  const std::shared_ptr<StreamedCall> stream = co_await upstream_.Begin(UploadMethod(), lasting);
  upload->stream = stream;
  const std::string bytes = request.SerializeAsString();
  co_await stream->Write(bytes, /*is_last=*/false);
  const std::optional<std::string> answer = co_await stream->Read();
  UploadScanResponse response;
  if (!answer || !response.ParseFromString(*answer) || !response.has_accepted()) {
    Forget(key, upload);
    co_return co_await EndOfUpload(stream);
  }
  PutBack(upload);
  co_return JsonOf(response.accepted());
}

Awaitable<HttpResponse> ScanDoor::PutBlock(Exchange* exchange, const Url& url, const Key& key) {
  UploadScanRequest request;
  const absl::StatusOr<int> index = NumberOf("block", url.segments[3]);
  const auto points = url.query.find("points");
  const absl::StatusOr<int> count = NumberOf("points", points == url.query.end() ? "" : points->second);
  for (const absl::Status& status : {index.status(), count.status()})
    if (!status.ok()) co_return Refusal(status);
  absl::StatusOr<std::string> body = co_await exchange->Body(MostPayload_bytes());
  if (!body.ok()) co_return Refusal(body.status());
  request.mutable_block()->set_index(*index);
  request.mutable_block()->set_point_count(*count);
  request.mutable_block()->set_payload(*std::move(body));
  const absl::StatusOr<std::shared_ptr<Upload>> taken = Take(key);
  if (!taken.ok()) co_return Refusal(taken.status());
  const std::shared_ptr<Upload> upload = *taken;
  const std::shared_ptr<StreamedCall> stream = upload->stream;
  const std::string bytes = request.SerializeAsString();
  co_await stream->Write(bytes, /*is_last=*/false);
  UploadScanResponse response;
  bool is_open = true;
  while (is_open && response.acknowledged().next_block() <= *index) {
    const std::optional<std::string> answer = co_await stream->Read();
    is_open = answer && response.ParseFromString(*answer) && response.has_acknowledged();
  }
  if (!is_open) {
    Forget(key, upload);
    co_return co_await EndOfUpload(stream);
  }
  PutBack(upload);
  co_return JsonOf(response.acknowledged());
}

Awaitable<HttpResponse> ScanDoor::PutEnd(Exchange* exchange, const Key& key) {
  absl::StatusOr<std::string> body = co_await exchange->Body(kMostText_bytes);
  if (!body.ok()) co_return Refusal(body.status());
  UploadScanRequest request;
  absl::StatusOr<ingest::v1::ScanEnd> end = MessageOf<ingest::v1::ScanEnd>(*exchange, *std::move(body));
  if (!end.ok()) co_return Refusal(end.status());
  *request.mutable_end() = *std::move(end);
  const absl::StatusOr<std::shared_ptr<Upload>> taken = Take(key);
  if (!taken.ok()) co_return Refusal(taken.status());
  const std::shared_ptr<Upload> upload = *taken;
  const std::shared_ptr<StreamedCall> stream = upload->stream;
  const std::string bytes = request.SerializeAsString();
  co_await stream->Write(bytes, /*is_last=*/true);
  const std::optional<std::string> answer = co_await stream->Read();
  Forget(key, upload);
  UploadScanResponse response;
  if (!answer || !response.ParseFromString(*answer) || !response.has_stored()) co_return co_await EndOfUpload(stream);
  co_await stream->End();
  co_return JsonOf(response.stored());
}

absl::StatusOr<std::shared_ptr<ScanDoor::Upload>> ScanDoor::Make(const Key& key,
                                                                 const asio::any_io_executor& executor) {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto each = uploads_.begin(); each != uploads_.end();) {
    const bool is_replaced = each->first == key, is_old = now > each->second->touched + kStandsStill;
    if (is_replaced && each->second->is_busy) return IsBusy(key.second);
    if (!each->second->is_busy && (is_replaced || is_old)) {
      LetGo(executor, each->second->stream);
      each = uploads_.erase(each);
    } else {
      ++each;
    }
  }
  const auto of_caller = static_cast<std::size_t>(
      std::count_if(uploads_.begin(), uploads_.end(), [&](const auto& each) { return each.first.first == key.first; }));
  if (of_caller >= kMostOfCaller)
    return runtime::Failure(
        errors::v1::UPLOADS_FULL,
        "uploads: " + std::to_string(of_caller) + " of " + key.first + " are open here, want fewer at once; try again",
        {{"limit", std::to_string(kMostOfCaller)}});
  if (uploads_.size() >= kMostUploads)
    return runtime::Failure(
        errors::v1::UPLOADS_FULL,
        "uploads: " + std::to_string(kMostUploads) + " are open here, want fewer at once; try again",
        {{"limit", std::to_string(kMostUploads)}});
  return uploads_[key] = std::make_shared<Upload>(Upload{nullptr, true, now});
}

absl::StatusOr<std::shared_ptr<ScanDoor::Upload>> ScanDoor::Take(const Key& key) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = uploads_.find(key);
  if (found == uploads_.end())
    return runtime::Failure(errors::v1::UPLOAD_NOT_OPEN,
                            "header: none of " + key.second + " is open here, want PUT /scans/" + key.second +
                                " first, and to go on from its next_block",
                            {{"resource", runtime::NameOf("scans", key.second)}});
  if (found->second->is_busy) return IsBusy(key.second);
  found->second->is_busy = true;
  return found->second;
}

void ScanDoor::PutBack(const std::shared_ptr<Upload>& upload) {
  const std::lock_guard<std::mutex> lock(mutex_);
  upload->is_busy = false;
  upload->touched = std::chrono::steady_clock::now();
}

void ScanDoor::Forget(const Key& key, const std::shared_ptr<Upload>& upload) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto found = uploads_.find(key); found != uploads_.end() && found->second == upload) uploads_.erase(found);
}

}  // namespace sixpoint::gateway
