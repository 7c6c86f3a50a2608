// sixpoint-ingest: the plant's front door for scans.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "sandbox/landlock.h"
#include "services/ingest/block_memory.h"
#include "services/ingest/metrics.h"
#include "services/ingest/scan_service.h"
#include "services/ingest/store_service.h"
#include "services/runtime/log.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"
#include "storage/bucket_owner.h"
#include "storage/s3_config.h"

namespace sixpoint::ingest {
namespace {

constexpr std::chrono::seconds kBucketPatience{30};

// Where clouds go, and how they are kept there.
struct StoreOptions {
  std::string blob_store = "postgresql";
  std::int64_t tidy_every_s = 3600;
  double check_mb_s = 5;
  double most_postgresql_gb = storage::kMostPostgresqlBytes / 1e9;
  bool check_bucket = false;
};

void AddStoreFlags(CLI::App* app, StoreOptions* options) {
  app->add_option(
         "--blob-store", options->blob_store,
         "Where new clouds go: postgresql, or s3:// and the path of the file that says where and by which keys")
      ->capture_default_str();
  app->add_option("--most-postgresql-gb", options->most_postgresql_gb,
                  "Clouds that PostgreSQL may hold; beyond it they are refused, and want an object store")
      ->check(CLI::Range(0.001, 32'000.0))
      ->capture_default_str();
  app->add_option("--tidy-every-s", options->tidy_every_s,
                  "Time between applications of retention and collections of garbage; 0: never by itself")
      ->check(CLI::Range(0, 30 * 86'400))
      ->capture_default_str();
  app->add_option("--check-mb-s", options->check_mb_s, "Rate of the continuous check of stored clouds; 0: no check")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app->add_flag("--check-bucket", options->check_bucket,
                "Serves nothing: asks whether the bucket is this plant's, and ends");
}

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database,
                                                 const StoreOptions& store_options,
                                                 const std::shared_ptr<storage::BlobStore>& blob_store) {
  ScanServiceOptions scan_options;
  scan_options.decode_worker = options.worker_folder + "/sixpoint-decode-worker";
  scan_options.worker_count = options.threads;
  if (sandbox::LandlockVersion() == 0) runtime::Log(runtime::LogLevel::kWarning, sandbox::kWithoutLandlock);
  std::vector<runtime::ServedService> services;
  services.push_back({v1::ScanService::service_full_name(),
                      std::make_unique<ScanService>(scan_options, storage::ScansIn(database, blob_store.get()),
                                                    runtime::ConnectToPeer(options, "plant"))});
  std::unique_ptr<StoreKeeper> keeper;
  if (store_options.tidy_every_s > 0 || store_options.check_mb_s > 0) {
    StoreKeeperOptions keeper_options;
    keeper_options.every = std::chrono::seconds(store_options.tidy_every_s);
    keeper_options.check_rate_mb_s = store_options.check_mb_s;
    keeper = std::make_unique<StoreKeeper>(keeper_options, options.database, blob_store);
  }
  services.push_back(
      {v1::CloudStoreService::service_full_name(),
       std::make_unique<CloudStoreService>(storage::RetentionIn(database, blob_store),
                                           storage::BlobKeepingIn(database, blob_store), std::move(keeper)),
       StoreSampled(1e9 * store_options.most_postgresql_gb)});
  return services;
}

// An empty bucket is this plant's from now on.
absl::Status CheckBucket(const runtime::ServerOptions& options, const storage::BlobStore& blob_store) {
  if (blob_store.objects() == nullptr) return absl::OkStatus();
  const auto database = storage::Database::Open(options.database, 1);
  return storage::RequireOwnBucket(*database, blob_store.objects(), std::chrono::steady_clock::now() + kBucketPatience);
}

}  // namespace
}  // namespace sixpoint::ingest

int main(int argc, char** argv) {
  using namespace sixpoint;
  ingest::KeepBlockMemory();
  ingest::StoreOptions store_options;
  const runtime::ServerOptions options = runtime::ParseServerOptions(
      argc, argv, "ingest", [&](CLI::App* app) { ingest::AddStoreFlags(app, &store_options); });
  absl::StatusOr<std::unique_ptr<storage::BlobStore>> opened = storage::OpenBlobStore(
      store_options.blob_store, static_cast<std::int64_t>(store_options.most_postgresql_gb * 1e9));
  if (!opened.ok()) {
    std::fprintf(stderr, "sixpoint-ingest: %s\n", std::string(opened.status().message()).c_str());
    return 2;
  }
  const std::shared_ptr<storage::BlobStore> blob_store = *std::move(opened);
  if (store_options.check_bucket) {
    const absl::Status own = ingest::CheckBucket(options, *blob_store);
    if (!own.ok()) std::fprintf(stderr, "sixpoint-ingest: %s\n", std::string(own.message()).c_str());
    return own.ok() ? 0 : 1;
  }
  return runtime::Serve(options, [&](const runtime::ServerOptions& given, storage::Database* database) {
    return ingest::MakeServices(given, database, store_options, blob_store);
  });
}
