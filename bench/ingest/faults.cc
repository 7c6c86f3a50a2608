#include "bench/ingest/faults.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "bench/ingest/scan_source.h"
#include "bench/ingest/upload_stream.h"
#include "metrology/cloud/draco_codec.h"
#include "services/runtime/call.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::bench {
namespace {

using ingest::v1::UploadScanResponse;

constexpr int kProfilesPerBlock = 4, kScanColumns = 320;
constexpr int kBlocksPerScan = 30;
constexpr int kWindow = 4;          // blocks sent and not yet acknowledged
constexpr int kAbandonEvery = 10;   // one scan in so many is left half-way
constexpr int kDownloadEvery = 10;  // one scan in so many is read back, point by point
constexpr double kBrokenStreamDeadline_s = 20;
constexpr std::chrono::milliseconds kPause{50};

double Now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
storage::Deadline AuditDeadline() { return std::chrono::steady_clock::now() + std::chrono::seconds(60); }

// What a client knows of one scan.
struct Scan {
  std::string id;
  std::vector<std::string> digests;  // as sent
  std::vector<std::uint32_t> variants;
  int acknowledged = 0;
  bool abandoned = false;
  bool stored = false;
};

struct Totals {
  std::mutex mutex;
  std::vector<std::pair<double, double>> acks;  // sent, acknowledged
  std::map<std::string, int> breaks;            // status of each stream that broke
  std::int64_t acknowledged_lost = 0;           // by what `accepted` said
  std::vector<std::string> wrong;               // what no fault excuses
};

class Client {
 public:
  Client(const FaultOptions& options, int number, Totals* totals)
      : options_(options), number_(number), totals_(totals), channel_(OwnConnection(options.ingest)) {
    const RawScan scan = BladeLikeScan(kBlocksPerScan * kProfilesPerBlock, kScanColumns, options.seed);
    for (std::size_t i = 0; i < kBlocksPerScan; ++i) {
      const int points = static_cast<int>(PointCount(scan, i * kProfilesPerBlock, kProfilesPerBlock));
      blocks_.emplace_back(RawPayload(scan, i * kProfilesPerBlock, kProfilesPerBlock), points);
    }
  }

  void Run(const std::atomic<bool>& stop) {
    std::mt19937_64 random(options_.seed * 1000 + static_cast<std::uint64_t>(number_));
    while (!stop) {
      Scan& scan = scans_.emplace_back();
      scan.id = "fault-" + std::to_string(options_.seed) + "-" + std::to_string(number_) + "-" +
                std::to_string(scans_.size());
      scan.abandoned = scans_.size() % kAbandonEvery == 0;
      for (int i = 0; i < kBlocksPerScan; ++i) {
        const std::uint32_t variant = next_variant_ + static_cast<std::uint32_t>(number_) * 19'001U;
        ++next_variant_;
        scan.variants.push_back(variant);
        scan.digests.push_back(blocks_[static_cast<std::size_t>(i)].Make(i, variant).digest);
      }
      const int until = scan.abandoned ? 1 + static_cast<int>(random() % (kBlocksPerScan - 1)) : kBlocksPerScan;
      while (!Attempt(&scan, until)) {
        std::this_thread::sleep_for(kPause);
        // gRPC goes on with a connection while somebody waits for it, and else looks at it every five seconds.
        channel_->WaitForConnected(std::chrono::system_clock::now() + kPause);
      }
    }
  }
  const std::vector<Scan>& scans() const { return scans_; }
  const std::vector<BlockTemplate>& blocks() const { return blocks_; }

 private:
  // One stream, from where the scan stands; true once nothing is left to do.
  bool Attempt(Scan* scan, int until) {
    UploadStream stream(channel_, kBrokenStreamDeadline_s);
    UploadScanResponse response;
    if (!stream.Write(FrameOf(HeaderFor(scan->id, number_, ingest::v1::ENCODING_RAW_PROFILES))) ||
        !stream.Read(&response)) {
      return Broke(&stream);
    }
    const ingest::v1::UploadProgress& accepted = response.accepted();
    if (accepted.next_block() < scan->acknowledged) {
      const std::lock_guard lock(totals_->mutex);
      totals_->acknowledged_lost += scan->acknowledged - accepted.next_block();
      totals_->wrong.push_back(scan->id + ": acknowledged " + std::to_string(scan->acknowledged) + ", accepted says " +
                               std::to_string(accepted.next_block()));
    }
    scan->acknowledged = std::max(scan->acknowledged, accepted.next_block());
    std::vector<double> sent_s(kBlocksPerScan, 0);
    int sent = accepted.next_block();
    while (scan->acknowledged < until) {
      while (sent < until && sent - scan->acknowledged < kWindow) {
        sent_s[static_cast<std::size_t>(sent)] = Now_s();
        const auto i = static_cast<std::size_t>(sent);
        if (!stream.Write(blocks_[i].Make(sent, scan->variants[i]).frame)) return Broke(&stream);
        ++sent;
      }
      if (!stream.Read(&response)) return Broke(&stream);
      const double now_s = Now_s();
      const std::lock_guard lock(totals_->mutex);
      for (; scan->acknowledged < response.acknowledged().next_block(); ++scan->acknowledged) {
        totals_->acks.emplace_back(sent_s[static_cast<std::size_t>(scan->acknowledged)], now_s);
      }
    }
    if (scan->abandoned) return true;
    std::int64_t point_count = 0;
    for (const BlockTemplate& block : blocks_) point_count += block.point_count();
    const ingest::v1::ScanEnd end = EndOf(scan->digests, point_count);
    if (!stream.Write(FrameOf(end)) || !stream.Read(&response) || !response.has_stored()) return Broke(&stream);
    scan->stored = true;
    if (response.stored().scan().sent_sha256() != end.sha256()) {
      const std::lock_guard lock(totals_->mutex);
      totals_->wrong.push_back(scan->id + ": stored with another digest than was sent");
    }
    return true;
  }

  bool Broke(UploadStream* stream) {
    const grpc::Status status = stream->Finish();
    const std::lock_guard lock(totals_->mutex);
    ++totals_->breaks[std::to_string(status.error_code()) + " " + status.error_message().substr(0, 60)];
    const bool excused = status.error_code() == grpc::UNAVAILABLE || status.error_code() == grpc::ABORTED ||
                         status.error_code() == grpc::RESOURCE_EXHAUSTED || status.error_code() == grpc::CANCELLED ||
                         status.error_code() == grpc::DEADLINE_EXCEEDED;
    if (!excused && totals_->wrong.size() < 20) {
      totals_->wrong.push_back("a stream ended with " + std::to_string(status.error_code()) + ": " +
                               status.error_message());
    }
    return false;
  }

  const FaultOptions options_;
  const int number_;
  Totals* const totals_;
  const std::shared_ptr<grpc::Channel> channel_;
  std::vector<BlockTemplate> blocks_;
  std::vector<Scan> scans_;
  std::uint32_t next_variant_ = 0;
};

// Everything that the clients know, against the database.
class Audit {
 public:
  Audit(const std::string& conninfo, Totals* totals)
      : database_(storage::Database::Open(conninfo, 1)), totals_(totals) {}

  void Check(const Scan& scan) {
    ++scan_count_;
    const std::string table = scan.stored ? "scan_blocks JOIN scans USING (scan_key)" : "scan_upload_blocks";
    const storage::Rows rows =
        Ask("SELECT block_index, t.sent_sha256, sha256(b.bytes) = b.sha256 FROM (SELECT block_index, " +
                std::string(scan.stored ? "scan_blocks." : "") + "sent_sha256, blob_sha256 FROM " + table +
                " WHERE scan_id = $1) t JOIN blobs b ON b.sha256 = t.blob_sha256 ORDER BY block_index",
            scan.id);
    const int wanted = scan.stored ? kBlocksPerScan : scan.acknowledged;
    int sound = 0;
    for (int row = 0; row < rows.count(); ++row) {
      const auto index = static_cast<std::size_t>(rows.Int(row, 0));
      if (index < scan.digests.size() && rows.Digest(row, 1) == HexOf(scan.digests[index]) && rows.Bool(row, 2))
        ++sound;
    }
    checked_blocks_ += wanted;
    if (sound >= wanted) return;
    missing_blocks_ += wanted - sound;
    totals_->wrong.push_back(scan.id + ": " + std::to_string(sound) + " sound blocks, acknowledged " +
                             std::to_string(wanted));
  }

  std::int64_t Count(const std::string& sql) { return Ask(sql, "").Int(0, 0); }

  std::int64_t scan_count() const { return scan_count_; }
  std::int64_t checked_blocks() const { return checked_blocks_; }
  std::int64_t missing_blocks() const { return missing_blocks_; }

 private:
  storage::Rows Ask(const std::string& sql, const std::string& parameter) {
    storage::Params params;
    if (!parameter.empty()) params.Text(parameter);
    auto transaction = database_->Begin(AuditDeadline());
    auto rows = transaction.ok() ? transaction->Execute(sql, params) : transaction.status();
    if (rows.ok()) return *rows;
    std::cerr << sql << ": " << rows.status() << std::endl;
    std::exit(1);  // an audit that cannot ask proves nothing
  }
  const std::unique_ptr<storage::Database> database_;
  Totals* const totals_;
  std::int64_t scan_count_ = 0, checked_blocks_ = 0, missing_blocks_ = 0;
};

// The points as they come out, against those that went in.
bool ComesBack(ingest::v1::ScanService::Stub* stub, const Scan& scan, const std::vector<BlockTemplate>& blocks) {
  const auto context = runtime::ContextFor(60);
  ingest::v1::DownloadScanRequest request;
  request.set_name("scans/" + scan.id);
  request.set_format(ingest::v1::POINT_FORMAT_XYZ_F64);
  const auto reader = stub->DownloadScan(context.get(), request);
  std::size_t index = 0;
  for (ingest::v1::DownloadScanResponse response; reader->Read(&response);) {
    if (!response.has_block()) continue;
    if (index >= blocks.size()) return false;
    const std::string sent = blocks[index].PayloadOf(scan.variants[index]);
    const std::string& got = response.block().payload();
    std::size_t at = 0;
    const char* in = sent.data();
    for (int profile = 0; profile < kProfilesPerBlock; ++profile) {
      double x_mm = 0;
      std::memcpy(&x_mm, in, sizeof x_mm);
      in += sizeof x_mm + kColumnCount / 8;
      for (int column = 0; column < kScanColumns; ++column, in += 8, at += 24) {
        std::int32_t yz[2];
        double xyz[3];
        if (at + sizeof xyz > got.size()) return false;
        std::memcpy(yz, in, sizeof yz);
        std::memcpy(xyz, got.data() + at, sizeof xyz);
        const double bound_mm = 0.25e-3 + 1e-9;
        if (std::abs(xyz[0] - x_mm) > bound_mm || std::abs(xyz[1] - 1e-3 * kRawStepUm * yz[0]) > bound_mm ||
            std::abs(xyz[2] - 1e-3 * kRawStepUm * yz[1]) > 1e-9) {
          return false;
        }
      }
    }
    if (at != got.size()) return false;
    ++index;
  }
  return reader->Finish().ok() && index == blocks.size();
}

}  // namespace

nlohmann::json UploadThroughFaults(const FaultOptions& options) {
  Totals totals;
  std::atomic<bool> stop{false};
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < options.client_count; ++i) clients.push_back(std::make_unique<Client>(options, i, &totals));
  std::vector<std::thread> threads;
  for (const auto& client : clients) threads.emplace_back([&client, &stop] { client->Run(stop); });
  while (std::cin.get() != EOF) {
  }
  stop = true;
  for (std::thread& thread : threads) thread.join();

  Audit audit(options.conninfo, &totals);
  const auto stub =
      ingest::v1::ScanService::NewStub(runtime::ConnectTo(options.ingest.address, options.ingest.credentials));
  std::int64_t stored = 0, abandoned = 0, downloaded = 0, visible_early = 0;
  for (const auto& client : clients) {
    for (const Scan& scan : client->scans()) {
      audit.Check(scan);
      scan.stored ? ++stored : ++abandoned;
      ingest::v1::Scan found;
      ingest::v1::GetScanRequest request;
      request.set_name("scans/" + scan.id);
      const auto context = runtime::ContextFor(30);
      const grpc::Status status = stub->GetScan(context.get(), request, &found);
      if (!scan.stored && status.error_code() != grpc::NOT_FOUND) ++visible_early;
      if (scan.stored && !status.ok()) totals.wrong.push_back(scan.id + ": " + status.error_message());
      if (!scan.stored || stored % kDownloadEvery != 0) continue;
      ++downloaded;
      if (!ComesBack(stub.get(), scan, client->blocks())) totals.wrong.push_back(scan.id + ": other points come back");
    }
  }
  const std::string ours = "scan_id LIKE 'fault-" + std::to_string(options.seed) + "-%'";
  const std::int64_t in_table = audit.Count("SELECT count(*) FROM scans WHERE " + ours);
  // No two scans of ours have the same content, so the same content twice is one scan stored twice.
  const std::int64_t twice =
      audit.Count("SELECT count(*) FROM (SELECT sent_sha256 FROM scans GROUP BY sent_sha256 HAVING count(*) > 1) t");
  // A scan without all of its blocks, or still an upload too; blocks of nothing; uploads whose count lies.
  const std::int64_t half_visible =
      visible_early +
      audit.Count(
          "SELECT count(*) FROM scans s WHERE block_count <> (SELECT count(*) FROM scan_blocks b WHERE "
          "b.scan_key = s.scan_key) OR point_count <> (SELECT sum(point_count) FROM scan_blocks b WHERE "
          "b.scan_key = s.scan_key)") +
      audit.Count(
          "SELECT count(*) FROM scan_uploads u WHERE EXISTS (SELECT 1 FROM scans s WHERE s.scan_id = u.scan_id)") +
      audit.Count(
          "SELECT count(*) FROM scan_uploads u WHERE next_block <> (SELECT count(*) FROM scan_upload_blocks b "
          "WHERE b.scan_id = u.scan_id)") +
      audit.Count(
          "SELECT count(*) FROM scan_blocks b WHERE NOT EXISTS (SELECT 1 FROM scans s WHERE s.scan_key = "
          "b.scan_key)") +
      audit.Count(
          "SELECT count(*) FROM scan_upload_blocks b WHERE NOT EXISTS (SELECT 1 FROM scan_uploads u WHERE "
          "u.scan_id = b.scan_id)") +
      audit.Count(
          "SELECT count(*) FROM scans s WHERE NOT EXISTS (SELECT 1 FROM record_entries e JOIN record_names USING "
          "(record_id) WHERE e.kind = 'scan' AND name = 'scans/' || s.scan_id)");
  nlohmann::json acks = nlohmann::json::array();
  for (const auto& [sent_s, acknowledged_s] : totals.acks) acks.push_back({sent_s, acknowledged_s});
  std::ofstream(options.acks_file) << acks.dump();
  return {{"acknowledged_blocks", totals.acks.size()},
          {"checked_blocks", audit.checked_blocks()},
          {"stored_scans", stored},
          {"abandoned_scans", abandoned},
          {"downloaded_scans", downloaded},
          {"acknowledged_lost", std::max(audit.missing_blocks(), totals.acknowledged_lost)},
          {"duplicated", twice + std::max<std::int64_t>(0, in_table - stored)},
          {"half_visible", half_visible},
          {"unreferenced_blobs",
           audit.Count(
               "SELECT count(*) FROM blobs b WHERE NOT EXISTS (SELECT 1 FROM scan_blocks s WHERE s.blob_sha256 "
               "= b.sha256) AND NOT EXISTS (SELECT 1 FROM scan_upload_blocks u WHERE u.blob_sha256 = b.sha256) "
               "AND NOT EXISTS (SELECT 1 FROM tessellations t WHERE b.sha256 IN (t.cad_sha256, t.surface_sha256))")},
          {"streams_broken", totals.breaks},
          {"wrong", totals.wrong}};
}

}  // namespace sixpoint::bench
