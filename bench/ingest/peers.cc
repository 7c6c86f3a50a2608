#include "bench/ingest/peers.h"

#include <grpcpp/grpcpp.h>
#include <libpq-fe.h>

#include <atomic>
#include <chrono>
#include <iostream>
#include <memory>
#include <thread>
#include <vector>

#include "bench/ingest/scan_source.h"
#include "bench/ingest/upload_stream.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Disconnect {
  void operator()(PGconn* connection) const { PQfinish(connection); }
};
using Connection = std::unique_ptr<PGconn, Disconnect>;

bool Run(PGconn* connection, const char* sql) {
  PGresult* result = PQexec(connection, sql);
  const bool ok = PQresultStatus(result) == PGRES_COMMAND_OK;
  PQclear(result);
  return ok;
}

class Sink final : public ingest::v1::ScanService::Service {
 public:
  grpc::Status UploadScan(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<ingest::v1::UploadScanResponse, ingest::v1::UploadScanRequest>* stream) override {
    ingest::v1::UploadScanRequest request;
    ingest::v1::UploadScanResponse response;
    ingest::v1::ScanHeader header;
    std::int64_t point_count = 0;
    while (stream->Read(&request)) {
      response.Clear();
      if (request.has_header()) {
        header = request.header();
        response.mutable_accepted();
      } else if (request.has_block()) {
        point_count += request.block().point_count();
        response.mutable_acknowledged()->set_next_block(request.block().index() + 1);
      } else {
        *response.mutable_stored()->mutable_scan()->mutable_header() = header;
        response.mutable_stored()->mutable_scan()->mutable_header()->set_point_count(point_count);
      }
      if (!stream->Write(response) || response.has_stored()) break;
    }
    return grpc::Status::OK;
  }
};

}  // namespace

nlohmann::json InsertBlocks(const std::string& conninfo, int connection_count, double seconds, int profiles_per_block,
                            bool compressible) {
  const RawScan scan = BladeLikeScan(profiles_per_block, kColumnCount, 3);
  const auto profiles = static_cast<std::size_t>(profiles_per_block);
  const BlockTemplate shape(RawPayload(scan, 0, profiles), static_cast<int>(PointCount(scan, 0, profiles)));
  const Connection setup(PQconnectdb(conninfo.c_str()));
  if (!Run(setup.get(), "DROP TABLE IF EXISTS raw_blocks") ||
      !Run(setup.get(),
           "CREATE TABLE raw_blocks (scan_id text, block_index integer, bytes bytea, "
           "PRIMARY KEY (scan_id, block_index))") ||
      !Run(setup.get(), compressible ? "ALTER TABLE raw_blocks ALTER COLUMN bytes SET STORAGE EXTENDED"
                                     : "ALTER TABLE raw_blocks ALTER COLUMN bytes SET STORAGE EXTERNAL")) {
    return {{"error", PQerrorMessage(setup.get())}};
  }
  std::atomic<std::int64_t> blocks{0}, failed{0};
  const auto begin = Clock::now();
  const auto end = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  std::vector<std::thread> threads;
  for (int t = 0; t < connection_count; ++t) {
    threads.emplace_back([&, t] {
      const Connection connection(PQconnectdb(conninfo.c_str()));
      const std::string scan_id = "s" + std::to_string(t);
      for (int i = 0; Clock::now() < end; ++i) {
        const std::string payload = shape.PayloadOf(static_cast<std::uint32_t>(2503 * t + i));
        const std::string index = std::to_string(i);
        const char* values[] = {scan_id.c_str(), index.c_str(), payload.data()};
        const int lengths[] = {0, 0, static_cast<int>(payload.size())};
        const int formats[] = {0, 0, 1};
        PGresult* result = PQexecParams(connection.get(), "INSERT INTO raw_blocks VALUES ($1, $2, $3)", 3, nullptr,
                                        values, lengths, formats, 0);
        PQresultStatus(result) == PGRES_COMMAND_OK ? ++blocks : ++failed;
        PQclear(result);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const double wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  Run(setup.get(), "DROP TABLE raw_blocks");
  return {{"blocks_per_s", static_cast<double>(blocks) / wall_s},
          {"bytes_per_s", static_cast<double>(blocks) * static_cast<double>(shape.payload_bytes()) / wall_s},
          {"points_per_s", static_cast<double>(blocks) * shape.point_count() / wall_s},
          {"failed", failed.load()}};
}

int ServeSink(const std::string& address, const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  Sink sink;
  grpc::ServerBuilder builder;
  builder.SetMaxReceiveMessageSize(8 << 20);
  builder.AddListeningPort(address, credentials);
  builder.RegisterService(&sink);
  const auto server = builder.BuildAndStart();
  if (server == nullptr) return 1;
  std::cout << "{\"listening\": \"" << address << "\"}" << std::endl;
  while (std::cin.get() != EOF) {
  }
  server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  return 0;
}

}  // namespace sixpoint::bench
