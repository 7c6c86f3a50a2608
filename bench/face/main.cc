// sixpoint-bench-face: the gateway beside the services behind it. The same call by gRPC and over HTTP, one after the other in the same run,
// and a scan's blobs by GET beside its download by gRPC. Prints one JSON object.
#include <curl/curl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "identity/certificate_token.h"
#include "identity/credentials.h"
#include "services/runtime/call.h"
#include "services/runtime/credentials.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void Fail(const std::string& why) {
  std::fprintf(stderr, "sixpoint-bench-face: %s\n", why.c_str());
  std::exit(2);
}

// One connection that is kept open, as a browser's.
class HttpConnection {
 public:
  HttpConnection(std::string url, const std::string& token) : url_(std::move(url)), curl_(curl_easy_init()) {
    headers_ = curl_slist_append(headers_, ("Authorization: Bearer " + token).c_str());
    headers_ = curl_slist_append(headers_, "Content-Type: application/proto");
    headers_ = curl_slist_append(headers_, "Expect:");
    curl_easy_setopt(curl_, CURLOPT_HTTPHEADER, headers_);
    curl_easy_setopt(curl_, CURLOPT_PROXY, "");
    curl_easy_setopt(curl_, CURLOPT_TCP_NODELAY, 1L);
    curl_easy_setopt(curl_, CURLOPT_WRITEFUNCTION, &Append);
    curl_easy_setopt(curl_, CURLOPT_WRITEDATA, &body_);
  }
  HttpConnection(const HttpConnection&) = delete;
  ~HttpConnection() {
    curl_easy_cleanup(curl_);
    curl_slist_free_all(headers_);
  }
  // body empty: GET.
  const std::string& Ask(const std::string& path, const std::string& body) {
    body_.clear();
    const std::string url = url_ + path;
    curl_easy_setopt(curl_, CURLOPT_URL, url.c_str());
    curl_easy_setopt(curl_, CURLOPT_HTTPGET, 1L);
    if (!body.empty()) {
      curl_easy_setopt(curl_, CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
      curl_easy_setopt(curl_, CURLOPT_COPYPOSTFIELDS, body.data());
    }
    const CURLcode done = curl_easy_perform(curl_);
    long status = 0;
    curl_easy_getinfo(curl_, CURLINFO_RESPONSE_CODE, &status);
    if (done != CURLE_OK || status != 200) Fail(path + ": " + std::to_string(status) + " " + body_.substr(0, 300));
    return body_;
  }

 private:
  static std::size_t Append(const char* data, std::size_t size, std::size_t count, void* text) {
    static_cast<std::string*>(text)->append(data, size * count);
    return size * count;
  }
  const std::string url_;
  CURL* const curl_;
  curl_slist* headers_ = nullptr;
  std::string body_;
};

double Timed_s(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

struct Options {
  std::string plant, ingest, gateway, identity, blade, scan;
  int pairs = 1000, rounds = 9;
};

class Face {
 public:
  explicit Face(const Options& options) : options_(options) {
    const auto credentials = runtime::ChannelCredentialsOf(options.identity);
    if (!credentials.ok()) Fail(std::string(credentials.status().message()));
    plant_ = plant::v1::PlantService::NewStub(runtime::ConnectTo(options.plant, *credentials));
    ingest_ = ingest::v1::ScanService::NewStub(runtime::ConnectTo(options.ingest, *credentials));
    const auto now = std::chrono::system_clock::now();
    token_ = identity::SignCertificateToken(options.identity + "/" + identity::kIdentityFile, now,
                                            now + std::chrono::minutes(15))
                 .value();
  }

  // What a call costs over the gateway beside what it costs without, one of each in turn.
  nlohmann::json Calls() {
    HttpConnection http(options_.gateway, token_);
    plant::v1::GetBladeRequest request;
    request.set_name(options_.blade);
    const std::string bytes = request.SerializeAsString();
    std::vector<double> direct, over, added;
    for (int i = 0; i < options_.pairs + 20; ++i) {
      std::string one, other;
      const double direct_s = Timed_s([&] {
        plant::v1::Blade blade;
        grpc::ClientContext context;
        if (!plant_->GetBlade(&context, request, &blade).ok()) Fail("GetBlade");
        one = blade.SerializeAsString();
      });
      const double over_s = Timed_s([&] { other = http.Ask("/sixpoint.plant.v1.PlantService/GetBlade", bytes); });
      if (one != other) Fail("GetBlade: another answer over the gateway");
      if (i < 20) continue;  // connections are opened, sessions looked at
      direct.push_back(direct_s);
      over.push_back(over_s);
      added.push_back(over_s - direct_s);
    }
    return {
        {"grpc_ms", 1e3 * Median(direct)}, {"http_ms", 1e3 * Median(over)}, {"gateway_added_ms", 1e3 * Median(added)}};
  }

  // A scan's bytes by the gateway's blobs, on as many connections as a browser opens, beside a download by gRPC.
  nlohmann::json Blobs() {
    std::vector<std::string> paths;
    ingest::v1::ListScanBlocksRequest list;
    list.set_name(options_.scan);
    list.set_page_size(1000);
    do {
      ingest::v1::ListScanBlocksResponse page;
      grpc::ClientContext context;
      if (!ingest_->ListScanBlocks(&context, list, &page).ok()) Fail("ListScanBlocks");
      for (const auto& block : page.blocks()) paths.push_back("/blobs/" + block.sha256() + "?of=" + options_.scan);
      list.set_page_token(page.next_page_token());
    } while (!list.page_token().empty());
    std::vector<double> ratios;
    double direct_mb_s = 0, blob_mb_s = 0;
    for (int i = 0; i < options_.rounds; ++i) {
      std::size_t direct_bytes = 0, blob_bytes = 0;
      const double direct_s = Timed_s([&] { direct_bytes = Download(); });
      const double blob_s = Timed_s([&] { blob_bytes = Fetch(paths); });
      if (direct_bytes != blob_bytes) Fail("other bytes by blobs");
      direct_mb_s = 1e-6 * static_cast<double>(direct_bytes) / direct_s;
      blob_mb_s = 1e-6 * static_cast<double>(blob_bytes) / blob_s;
      ratios.push_back(blob_mb_s / direct_mb_s);
    }
    return {{"blobs", paths.size()},
            {"direct_mb_s", direct_mb_s},
            {"blob_mb_s", blob_mb_s},
            {"blob_over_direct", Median(ratios)}};
  }

 private:
  static constexpr std::size_t kConnections = 6;

  std::size_t Download() {
    ingest::v1::DownloadScanRequest request;
    request.set_name(options_.scan);
    grpc::ClientContext context;
    const auto reader = ingest_->DownloadScan(&context, request);
    ingest::v1::DownloadScanResponse response;
    std::size_t bytes = 0;
    while (reader->Read(&response)) bytes += response.block().payload().size();
    if (!reader->Finish().ok()) Fail("DownloadScan");
    return bytes;
  }
  std::size_t Fetch(const std::vector<std::string>& paths) {
    std::vector<std::future<std::size_t>> parts;
    for (std::size_t first = 0; first < kConnections; ++first)
      parts.push_back(std::async(std::launch::async, [&, first] {
        HttpConnection http(options_.gateway, token_);
        std::size_t bytes = 0;
        for (std::size_t i = first; i < paths.size(); i += kConnections) bytes += http.Ask(paths[i], "").size();
        return bytes;
      }));
    std::size_t bytes = 0;
    for (auto& part : parts) bytes += part.get();
    return bytes;
  }

  const Options options_;
  std::unique_ptr<plant::v1::PlantService::Stub> plant_;
  std::unique_ptr<ingest::v1::ScanService::Stub> ingest_;
  std::string token_;
};

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  sixpoint::bench::Options options;
  CLI::App app("The gateway beside the services behind it.", "sixpoint-bench-face");
  app.add_option("--plant", options.plant)->required();
  app.add_option("--ingest", options.ingest)->required();
  app.add_option("--gateway", options.gateway, "http://127.0.0.1:7480")->required();
  app.add_option("--identity", options.identity)->required();
  app.add_option("--blade", options.blade)->required();
  app.add_option("--scan", options.scan)->required();
  app.add_option("--pairs", options.pairs)->capture_default_str();
  app.add_option("--rounds", options.rounds, "of all blobs")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  curl_global_init(CURL_GLOBAL_DEFAULT);
  sixpoint::bench::Face face(options);
  nlohmann::json told = face.Calls();
  told.update(face.Blobs());
  std::printf("%s\n", told.dump().c_str());
  return 0;
}
