// A scan by plain PUT, for controls without bidirectional gRPC. Each step is one of UploadScan's messages:
//   PUT /scans/{scan}              the header (ScanHeader; JSON, or application/proto); answers UploadProgress: the block to go on from
//   PUT /scans/{scan}/blocks/{n}?points=N    the payload of block n as it is; answers UploadProgress once it is durable
//   PUT /scans/{scan}/end          the end (ScanEnd); answers StoredScan
// Whatever breaks off: the header again, and on from next_block. A header takes over what another request of the same caller had begun.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "services/gateway/exchange.h"
#include "services/gateway/upstream.h"
#include "services/gateway/url.h"

namespace sixpoint::gateway {

class ScanDoor {
 public:
  // Lives longer.
  explicit ScanDoor(Upstream* upstream) : upstream_(*upstream) {}

  // caller: who asks, by his session. Another's uploads are out of his reach.
  Awaitable<HttpResponse> Answer(Exchange* exchange, const Url& url, const CallWish& wish, const std::string& caller);

  // Ingest ends a stream that stands still for a minute; its place here is free before that.
  static constexpr std::chrono::seconds kStandsStill{45};
  // Together, and of one caller: a machine sends one scan at a time.
  static constexpr std::size_t kMostUploads = 24, kMostOfCaller = 4;

 private:
  struct Upload {
    std::shared_ptr<StreamedCall> stream;
    bool is_busy = true;  // a request is at work on it
    std::chrono::steady_clock::time_point touched;
  };
  using Key = std::pair<std::string, std::string>;  // caller, scan

  Awaitable<HttpResponse> PutHeader(Exchange* exchange, const Key& key, const CallWish& wish);
  Awaitable<HttpResponse> PutBlock(Exchange* exchange, const Url& url, const Key& key);
  Awaitable<HttpResponse> PutEnd(Exchange* exchange, const Key& key);

  // One request at a time works on an upload: ABORTED of another, FAILED_PRECONDITION where none is open.
  absl::StatusOr<std::shared_ptr<Upload>> Take(const Key& key);
  void PutBack(const std::shared_ptr<Upload>& upload);
  void Forget(const Key& key, const std::shared_ptr<Upload>& upload);
  // RESOURCE_EXHAUSTED where there are as many as may; what stood still is cancelled.
  absl::StatusOr<std::shared_ptr<Upload>> Make(const Key& key, const boost::asio::any_io_executor& executor);

  Upstream& upstream_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<Upload>> uploads_;
};

}  // namespace sixpoint::gateway
