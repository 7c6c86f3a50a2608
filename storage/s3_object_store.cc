#include "storage/s3_object_store.h"

#include <curl/curl.h>

#include <algorithm>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "storage/blobs.h"
#include "storage/reasons.h"
#include "storage/s3_answers.h"

namespace sixpoint::storage {
namespace {

constexpr int kRequestAttempts = 5;
constexpr std::chrono::milliseconds kFirstPause{100};  // then doubled
// curl counts in whole milliseconds: a wait until the deadline may end just before it.
constexpr std::chrono::milliseconds kClockStep{20};
// A connection that carries less than this is as good as none.
constexpr long kLowSpeed_bytes_s = 1000;
constexpr long kLowSpeedPatience_s = 10;
// Errors are a few hundred bytes, a page of a list some hundred kibibytes.
constexpr std::size_t kLongestError_bytes = 64 << 10;
constexpr std::size_t kLongestList_bytes = 4 << 20;

struct FreeHeaders {
  void operator()(curl_slist* headers) const { curl_slist_free_all(headers); }
};
using Headers = std::unique_ptr<curl_slist, FreeHeaders>;

struct Request {
  std::string method;
  std::string path;  // after the endpoint, with its query
  std::string_view body;
  std::string body_sha256;
  std::size_t longest_answer_bytes = kLongestError_bytes;
};

struct Answer {
  CURLcode transport = CURLE_OK;
  long http_status = 0;
  std::string body;
  std::size_t longest_bytes = 0;
  std::int64_t length = -1;  // as announced
  bool too_long = false;
};

std::size_t Collect(const char* data, std::size_t size, std::size_t count, void* user) {
  auto* answer = static_cast<Answer*>(user);
  if (answer->body.size() + size * count > answer->longest_bytes) {
    answer->too_long = true;
    return 0;  // ends the transfer
  }
  answer->body.append(data, size * count);
  return size * count;
}

bool IsPassing(const Answer& answer) {
  switch (answer.transport) {
    case CURLE_OK:
      return answer.http_status >= 500 || answer.http_status == 429 || answer.http_status == 408;
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_GOT_NOTHING:
    case CURLE_PARTIAL_FILE:
    case CURLE_SSL_CONNECT_ERROR:
      return true;
    default:
      return false;
  }
}

// As a query wants it (RFC 3986), and as the signature wants it.
std::string Escaped(const std::string& text) {
  constexpr char kHex[] = "0123456789ABCDEF";
  std::string escaped;
  for (const char c : text) {
    const bool plain = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' ||
                       c == '.' || c == '_' || c == '~';
    if (plain) {
      escaped += c;
    } else {
      escaped += {'%', kHex[static_cast<unsigned char>(c) >> 4], kHex[static_cast<unsigned char>(c) & 0xf]};
    }
  }
  return escaped;
}

class S3ObjectStore final : public ObjectStore {
 public:
  explicit S3ObjectStore(S3Config config) : config_(std::move(config)) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    (void)started;
  }
  ~S3ObjectStore() override {
    for (CURL* handle : idle_) curl_easy_cleanup(handle);
  }

  absl::Status Put(const std::string& key, std::string_view bytes, const std::string& sha256,
                   Deadline deadline) override {
    Request request{"PUT", PathOf(key), bytes, sha256};
    const absl::StatusOr<Answer> answer = Call(request, deadline);
    if (!answer.ok()) return answer.status();
    const absl::StatusOr<std::int64_t> size = SizeOf(key, deadline);
    if (!size.ok() && !absl::IsNotFound(size.status())) return size.status();
    if (size.value_or(-1) != static_cast<std::int64_t>(bytes.size())) {
      return absl::UnavailableError("object store: " + key +
                                    " was taken but is not there in full length, want a retry");
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::string> Get(const std::string& key, std::int64_t greatest_bytes, Deadline deadline) override {
    Request request{"GET", PathOf(key), {}, kNoBodySha256};
    request.longest_answer_bytes = std::max(static_cast<std::size_t>(greatest_bytes), kLongestError_bytes);
    absl::StatusOr<Answer> answer = Call(request, deadline);
    if (!answer.ok()) return answer.status();
    if (answer->body.size() > static_cast<std::size_t>(greatest_bytes)) return TooLong(key, greatest_bytes);
    return std::move(answer->body);
  }

  absl::StatusOr<std::int64_t> SizeOf(const std::string& key, Deadline deadline) override {
    const absl::StatusOr<Answer> answer = Call({"HEAD", PathOf(key), {}, kNoBodySha256}, deadline);
    if (!answer.ok()) return answer.status();
    return answer->length;
  }

  absl::Status Delete(const std::string& key, Deadline deadline) override {
    const absl::Status deleted = Call({"DELETE", PathOf(key), {}, kNoBodySha256}, deadline).status();
    return absl::IsNotFound(deleted) ? absl::OkStatus() : deleted;
  }

  absl::StatusOr<ListPage> List(const std::string& prefix, const std::string& next, Deadline deadline) override {
    // In the order of names, as the signature wants it.
    std::string query = next.empty() ? "" : "continuation-token=" + Escaped(next) + "&";
    query += "list-type=2&max-keys=1000&prefix=" + Escaped(prefix);
    Request request{"GET", "/" + config_.bucket + "/?" + query, {}, kNoBodySha256};
    request.longest_answer_bytes = kLongestList_bytes;
    const absl::StatusOr<Answer> answer = Call(request, deadline);
    if (!answer.ok()) return answer.status();
    return ReadS3List(answer->body);
  }

 private:
  std::string PathOf(const std::string& key) const { return "/" + config_.bucket + "/" + key; }

  absl::Status TooLong(const std::string& key, std::int64_t greatest_bytes) const {
    return absl::DataLossError("object store: " + key + " is longer than the " + std::to_string(greatest_bytes) +
                               " bytes that were stored");
  }

  CURL* Borrow() {
    {
      std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        CURL* handle = idle_.back();
        idle_.pop_back();
        return handle;
      }
    }
    return curl_easy_init();
  }

  void GiveBack(CURL* handle) {
    curl_easy_reset(handle);  // keeps its connections
    std::lock_guard lock(mutex_);
    idle_.push_back(handle);
  }

  // Connect, total and low-speed limits all stand; the total is the nearer of the configuration's and the caller's.
  Answer Once(const Request& request, std::chrono::milliseconds patience) {
    Answer answer;
    answer.longest_bytes = request.longest_answer_bytes;
    CURL* const handle = Borrow();
    if (handle == nullptr) {
      answer.transport = CURLE_OUT_OF_MEMORY;
      return answer;
    }
    const std::string url = config_.endpoint + request.path;
    const std::string signature = "aws:amz:" + config_.region + ":s3";
    Headers headers(curl_slist_append(nullptr, ("x-amz-content-sha256: " + request.body_sha256).c_str()));
    curl_easy_setopt(handle, CURLOPT_URL, url.c_str());
    curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(handle, CURLOPT_PROXY, "");  // one in the environment is for the world outside
    curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(handle, CURLOPT_TCP_KEEPALIVE, 1L);
    curl_easy_setopt(handle, CURLOPT_AWS_SIGV4, signature.c_str());
    curl_easy_setopt(handle, CURLOPT_USERNAME, config_.access_key.c_str());
    curl_easy_setopt(handle, CURLOPT_PASSWORD, config_.secret_key.c_str());
    if (!config_.ca_file.empty()) curl_easy_setopt(handle, CURLOPT_CAINFO, config_.ca_file.c_str());
    curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT_MS,
                     static_cast<long>(std::min(patience, config_.connect_timeout).count()));
    curl_easy_setopt(handle, CURLOPT_TIMEOUT_MS, static_cast<long>(patience.count()));
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, kLowSpeed_bytes_s);
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME, kLowSpeedPatience_s);
    curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, &Collect);
    curl_easy_setopt(handle, CURLOPT_WRITEDATA, &answer);
    if (request.method == "HEAD") {
      curl_easy_setopt(handle, CURLOPT_NOBODY, 1L);
    } else if (request.method == "PUT") {
      headers.reset(curl_slist_append(headers.release(), "Content-Type: application/octet-stream"));
      curl_easy_setopt(handle, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
      curl_easy_setopt(handle, CURLOPT_POSTFIELDS, request.body.data());
      curl_easy_setopt(handle, CURLOPT_CUSTOMREQUEST, "PUT");
    } else if (request.method != "GET") {
      curl_easy_setopt(handle, CURLOPT_CUSTOMREQUEST, request.method.c_str());
    }
    curl_easy_setopt(handle, CURLOPT_HTTPHEADER, headers.get());
    answer.transport = curl_easy_perform(handle);
    curl_easy_getinfo(handle, CURLINFO_RESPONSE_CODE, &answer.http_status);
    curl_off_t length = -1;
    curl_easy_getinfo(handle, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
    answer.length = length;
    GiveBack(handle);
    return answer;
  }

  absl::StatusOr<Answer> Call(const Request& request, Deadline deadline) {
    std::chrono::milliseconds pause = kFirstPause;
    for (int attempt = 1;; ++attempt) {
      const auto left = std::chrono::floor<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return absl::DeadlineExceededError("object store: the deadline is over");
      Answer answer = Once(request, std::min(left, config_.request_timeout));
      const bool in_time = std::chrono::steady_clock::now() + pause < deadline;
      if (!IsPassing(answer) || attempt == kRequestAttempts || !in_time)
        return StatusOf(request, std::move(answer), deadline);
      std::this_thread::sleep_for(pause / 2 + Jitter(pause / 2));
      pause *= 2;
    }
  }

  // Those who failed together do not come back together.
  static std::chrono::milliseconds Jitter(std::chrono::milliseconds most) {
    thread_local std::minstd_rand generator(std::random_device{}());
    return std::chrono::milliseconds(generator() % (most.count() + 1));
  }

  absl::StatusOr<Answer> StatusOf(const Request& request, Answer answer, Deadline deadline) const {
    const std::string what = "object store " + config_.endpoint + ": " + request.method + " " +
                             request.path.substr(0, request.path.find('?')) + ": ";
    if (answer.too_long) return TooLong(request.path, static_cast<std::int64_t>(answer.longest_bytes));
    if (answer.transport != CURLE_OK) {
      const std::string why = what + curl_easy_strerror(answer.transport);
      if (std::chrono::steady_clock::now() + kClockStep >= deadline) return absl::DeadlineExceededError(why);
      return WithReason(absl::UnavailableError(why), kObjectStoreAway);
    }
    if (answer.http_status >= 200 && answer.http_status < 300) return answer;
    const std::string code = S3ErrorCodeOf(answer.body);
    const std::string said = what + std::to_string(answer.http_status) + (code.empty() ? "" : " " + code);
    if (code == "NoSuchBucket") {
      return WithReason(absl::FailedPreconditionError(said + ", want the bucket made before"), kBucketMissing);
    }
    if (answer.http_status == 404) return absl::NotFoundError(said);
    if (answer.http_status == 401 || answer.http_status == 403) {
      const bool full = code == "QuotaExceeded";
      if (full) return absl::ResourceExhaustedError(said);
      return WithReason(absl::FailedPreconditionError(said + ", want keys that it knows and that may read and write"),
                        kObjectStoreRefused);
    }
    if (answer.http_status == 507) return absl::ResourceExhaustedError(said);
    if (IsPassing(answer)) return WithReason(absl::UnavailableError(said), kObjectStoreAway);
    return absl::InternalError(said);
  }

  static inline const std::string kNoBodySha256 = Sha256Hex("");
  const S3Config config_;
  std::mutex mutex_;
  std::vector<CURL*> idle_;
};

}  // namespace

std::unique_ptr<ObjectStore> MakeS3ObjectStore(S3Config config) {
  return std::make_unique<S3ObjectStore>(std::move(config));
}

}  // namespace sixpoint::storage
