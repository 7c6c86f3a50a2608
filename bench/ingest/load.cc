#include "bench/ingest/load.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "bench/ingest/scan_source.h"
#include "bench/ingest/upload_stream.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;
using ingest::v1::UploadScanResponse;

constexpr double kLoadStreamDeadline_s = 600;

Clock::duration Seconds(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}
double SecondsOf(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

double CpuSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double Quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

// What one machine saw.
struct Seen {
  std::vector<double> ack_s;
  std::int64_t point_count = 0, sent_bytes = 0, stored_bytes = 0, scan_count = 0;
  double proven_error_um = 0;
  std::vector<std::string> errors;
};

class Machine {
 public:
  Machine(const LoadOptions& options, int number, const std::vector<BlockTemplate>& blocks, Clock::time_point start)
      : options_(options), number_(number), blocks_(blocks), start_(start), channel_(OwnConnection(options.ingest)) {
    const double block_s = BlockPeriod_s();
    // Machines do not measure in step.
    first_due_ = start + Seconds(block_s * (1.0 + static_cast<double>(number) / options.machine_count));
    block_count_ = block_s > 0 ? static_cast<int>(options.seconds / block_s) : 1'000'000;
  }

  void Run() {
    while (sent_count_ < block_count_ && !TimeIsOver()) {
      if (!SendScan()) return;
    }
  }
  const Seen& seen() const { return seen_; }

 private:
  double BlockPeriod_s() const {
    return options_.profiles_per_s > 0 ? options_.profiles_per_block / options_.profiles_per_s : 0;
  }
  // At line rate the number of blocks is the end, unless ingest is hopelessly behind.
  bool TimeIsOver() const {
    const double limit_s = options_.profiles_per_s > 0 ? 2 * options_.seconds + 10 : options_.seconds;
    return Clock::now() > start_ + Seconds(limit_s);
  }
  Clock::time_point DueOf(int block) const { return first_due_ + Seconds(BlockPeriod_s() * block); }

  bool SendScan() {
    const std::string scan_id = "load-" + std::to_string(getpid()) + "-" + std::to_string(options_.seed) + "-" +
                                std::to_string(number_) + "-" + std::to_string(seen_.scan_count);
    const int first = sent_count_;
    const int count = std::min(options_.blocks_per_scan, block_count_ - first);
    UploadStream stream(channel_, kLoadStreamDeadline_s);
    UploadScanResponse response;
    if (!stream.Write(FrameOf(HeaderFor(scan_id, number_, ingest::v1::ENCODING_RAW_PROFILES))) ||
        !stream.Read(&response)) {
      return Fail(stream.Finish());
    }
    std::vector<Clock::time_point> due(static_cast<std::size_t>(count));
    std::mutex mutex;
    UploadScanResponse last;
    std::thread reader([&] {
      int acknowledged = 0;
      for (UploadScanResponse answer; stream.Read(&answer);) {
        const Clock::time_point now = Clock::now();
        if (answer.has_stored()) {
          last = answer;
          return;
        }
        const std::lock_guard lock(mutex);
        for (; acknowledged < answer.acknowledged().next_block(); ++acknowledged) {
          seen_.ack_s.push_back(SecondsOf(now - due[static_cast<std::size_t>(acknowledged)]));
        }
      }
    });
    std::vector<std::string> digests;
    std::int64_t point_count = 0;
    bool open = true;
    for (int i = 0; i < count && open && (i == 0 || !TimeIsOver()); ++i) {
      const BlockTemplate& shape = blocks_[static_cast<std::size_t>(i)];
      BlockTemplate::Block block = shape.Make(i, Variant());
      Clock::time_point due_at = Clock::now();
      if (options_.profiles_per_s > 0) {
        due_at = DueOf(sent_count_);
        std::this_thread::sleep_until(due_at);
      }
      {
        const std::lock_guard lock(mutex);
        due[static_cast<std::size_t>(i)] = due_at;
      }
      open = stream.Write(block.frame);
      digests.push_back(std::move(block.digest));
      point_count += shape.point_count();
      seen_.sent_bytes += static_cast<std::int64_t>(shape.payload_bytes());
      ++sent_count_;
    }
    if (open) open = stream.Write(FrameOf(EndOf(digests, point_count)));
    reader.join();
    const grpc::Status status = stream.Finish();
    if (!last.has_stored()) return Fail(status);
    const ingest::v1::Scan& scan = last.stored().scan();
    ++seen_.scan_count;
    seen_.point_count += scan.header().point_count();
    seen_.stored_bytes += scan.stored_bytes();
    seen_.proven_error_um = std::max(seen_.proven_error_um, scan.proven_error_um());
    return true;
  }

  // Another for every block of every machine, also of the run before.
  std::uint32_t Variant() const {
    return static_cast<std::uint32_t>(options_.seed) * 7919U + static_cast<std::uint32_t>(number_) * 2503U +
           static_cast<std::uint32_t>(sent_count_);
  }

  bool Fail(const grpc::Status& status) {
    seen_.errors.push_back(std::to_string(status.error_code()) + " " + status.error_message());
    return false;
  }

  const LoadOptions options_;
  const int number_;
  const std::vector<BlockTemplate>& blocks_;
  const Clock::time_point start_;
  const std::shared_ptr<grpc::Channel> channel_;
  Clock::time_point first_due_;
  int block_count_ = 0;
  int sent_count_ = 0;
  Seen seen_;
};

// One scan's blocks, which every machine sends again and again in other variants.
std::vector<BlockTemplate> MakeTemplates(const LoadOptions& options) {
  const auto profiles = static_cast<std::size_t>(options.profiles_per_block);
  const RawScan scan =
      BladeLikeScan(options.blocks_per_scan * options.profiles_per_block, options.column_count, options.seed);
  std::vector<BlockTemplate> blocks;
  for (std::size_t i = 0; i < static_cast<std::size_t>(options.blocks_per_scan); ++i) {
    blocks.emplace_back(RawPayload(scan, i * profiles, profiles),
                        static_cast<int>(PointCount(scan, i * profiles, profiles)));
  }
  return blocks;
}

}  // namespace

nlohmann::json StreamScans(const LoadOptions& options) {
  const std::vector<BlockTemplate> blocks = MakeTemplates(options);
  const double cpu_before_s = CpuSeconds();
  const Clock::time_point start = Clock::now() + Seconds(0.2);
  std::vector<std::unique_ptr<Machine>> machines;
  for (int i = 0; i < options.machine_count; ++i) {
    machines.push_back(std::make_unique<Machine>(options, i, blocks, start));
  }
  std::vector<std::thread> threads;
  for (const auto& machine : machines) {
    threads.emplace_back([&machine, start] {
      std::this_thread::sleep_until(start);
      machine->Run();
    });
  }
  for (std::thread& thread : threads) thread.join();
  const double wall_s = SecondsOf(Clock::now() - start);

  Seen all;
  for (const auto& machine : machines) {
    const Seen& seen = machine->seen();
    all.ack_s.insert(all.ack_s.end(), seen.ack_s.begin(), seen.ack_s.end());
    all.point_count += seen.point_count;
    all.sent_bytes += seen.sent_bytes;
    all.stored_bytes += seen.stored_bytes;
    all.scan_count += seen.scan_count;
    all.proven_error_um = std::max(all.proven_error_um, seen.proven_error_um);
    all.errors.insert(all.errors.end(), seen.errors.begin(), seen.errors.end());
  }
  std::sort(all.ack_s.begin(), all.ack_s.end());
  const double wanted = options.profiles_per_s * options.column_count * options.machine_count;
  return {{"machines", options.machine_count},
          {"wall_s", wall_s},
          {"wanted_points_per_s", wanted},
          {"points", all.point_count},
          {"points_per_s", static_cast<double>(all.point_count) / wall_s},
          {"sent_bytes", all.sent_bytes},
          {"stored_bytes", all.stored_bytes},
          {"scans", all.scan_count},
          {"blocks", all.ack_s.size()},
          {"ack_p50_s", Quantile(all.ack_s, 0.5)},
          {"ack_p99_s", Quantile(all.ack_s, 0.99)},
          {"ack_max_s", all.ack_s.empty() ? 0 : all.ack_s.back()},
          {"proven_error_um", all.proven_error_um},
          {"generator_cpu_s", CpuSeconds() - cpu_before_s},
          {"errors", all.errors}};
}

nlohmann::json WriteUploadBodies(const std::string& folder, int count, const std::string& scan_id) {
  constexpr int kProfiles = 4, kColumns = 100, kMachines = 4;
  const BlockTemplate shape(RawPayload(BladeLikeScan(kProfiles, kColumns, 1), 0, kProfiles), kProfiles * kColumns);
  for (int i = 0; i < count; ++i) {
    const BlockTemplate::Block block = shape.Make(0, static_cast<std::uint32_t>(i));
    std::ofstream file(folder + "/" + std::to_string(i), std::ios::binary);
    for (const grpc::ByteBuffer& message :
         {FrameOf(HeaderFor(scan_id, i % kMachines, ingest::v1::ENCODING_RAW_PROFILES)), block.frame,
          FrameOf(EndOf({block.digest}, shape.point_count()))}) {
      grpc::Slice bytes;
      if (!message.DumpToSingleSlice(&bytes).ok()) return {{"error", "a message cannot be written"}};
      file.put('\0');  // not compressed
      for (int shift = 24; shift >= 0; shift -= 8) file.put(static_cast<char>(bytes.size() >> shift & 0xff));
      file.write(reinterpret_cast<const char*>(bytes.begin()), static_cast<std::streamsize>(bytes.size()));
    }
    if (!file.flush()) return {{"error", folder + " cannot be written to"}};
  }
  return {{"written", count}};
}

nlohmann::json StreamSmallScans(const Endpoint& ingest, int scan_count, std::uint64_t seed) {
  constexpr int kThreads = 4, kProfiles = 4, kColumns = 100;
  const RawScan scan = BladeLikeScan(kProfiles, kColumns, seed);
  const BlockTemplate shape(RawPayload(scan, 0, kProfiles), kProfiles * kColumns);
  std::atomic<int> next{0}, stored{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      const auto channel = OwnConnection(ingest);
      for (int i = next++; i < scan_count; i = next++) {
        const BlockTemplate::Block block = shape.Make(0, static_cast<std::uint32_t>(i));
        UploadStream stream(channel, 60);
        UploadScanResponse response;
        stream.Write(FrameOf(HeaderFor("small-" + std::to_string(seed) + "-" + std::to_string(i), t,
                                       ingest::v1::ENCODING_RAW_PROFILES)));
        stream.Write(block.frame);
        stream.Write(FrameOf(EndOf({block.digest}, shape.point_count())));
        while (stream.Read(&response)) {
        }
        if (stream.Finish().ok() && response.has_stored()) ++stored;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return {{"asked", scan_count}, {"stored", stored.load()}};
}

}  // namespace sixpoint::bench
