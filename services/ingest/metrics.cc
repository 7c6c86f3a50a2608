#include "services/ingest/metrics.h"

#include <vector>

#include "storage/blob_check.h"
#include "storage/observed.h"

namespace sixpoint::ingest {
namespace {

class Store : public runtime::Sampled {
 public:
  explicit Store(double most_postgresql_bytes) {
    runtime::Gauge("sixpoint_blob_most_bytes", "Bytes of clouds that may be kept, by who holds them.",
                   {{"store", "postgresql"}})
        .Set(most_postgresql_bytes);
  }
  absl::Status Read(storage::Transaction& transaction) override {
    const absl::StatusOr<std::vector<storage::StoreUse>> uses = storage::ReadStoreUse(transaction);
    if (!uses.ok()) return uses.status();
    const absl::StatusOr<std::int64_t> damages = storage::CountDamages(transaction);
    if (!damages.ok()) return damages.status();
    // Both from the start: a store that holds nothing holds 0 bytes.
    double in_postgresql = 0, in_s3 = 0;
    for (const storage::StoreUse& use : *uses)
      (use.store == "s3" ? in_s3 : in_postgresql) = static_cast<double>(use.kept_bytes);
    kept_bytes_.Set({{{"postgresql"}, in_postgresql}, {{"s3"}, in_s3}});
    damages_.Set({{{}, static_cast<double>(*damages)}});
    return absl::OkStatus();
  }
  void Forget() override {
    kept_bytes_.Forget();
    damages_.Forget();
  }

 private:
  runtime::Readings kept_bytes_{"sixpoint_blob_bytes", "Bytes that are kept, by who holds them.", {"store"}};
  runtime::Readings damages_{"sixpoint_blob_damages", "Blobs that were found damaged, ever.", {}};
};

}  // namespace

IngestMetrics& Metrics() {
  static auto* const metrics = new IngestMetrics();
  return *metrics;
}

std::unique_ptr<runtime::Sampled> StoreSampled(double most_postgresql_bytes) {
  return std::make_unique<Store>(most_postgresql_bytes);
}

}  // namespace sixpoint::ingest
