// Rates of both stores over blobs of a block's size, one at a time as an upload and a download do it.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>

#include "storage/blob_check.h"
#include "storage/blob_store.h"
#include "storage/s3_object_store.h"
#include "tests/support/object_store_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint {
namespace {

using testing::Soon;

constexpr int kBlobCount = 200;
constexpr int kBlobBytes = 256 << 10;  // a block of 131 072 points at two bytes each

template <typename Action>
double RateOf(const Action& action) {  // MB/s
  const auto begin = std::chrono::steady_clock::now();
  action();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return kBlobCount * (kBlobBytes / 1e6) / seconds;
}

template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "blob_rates: %s\n", value.status().ToString().c_str());
  std::exit(1);
}

void Measure(storage::BlobStore* store, nlohmann::json* figures) {
  testing::ThrowawayDatabase database;
  std::mt19937_64 generator(1);
  std::vector<std::string> blobs(kBlobCount, std::string(kBlobBytes, '\0')), digests;
  for (std::string& blob : blobs) {
    for (char& c : blob) c = static_cast<char>(generator());
  }
  const std::string name = store->name();
  const auto note = [&](const std::string& what, double rate) {
    std::printf("%-12s %-22s %8.1f MB/s\n", name.c_str(), what.c_str(), rate);
    (*figures)[name + "_" + what + "_mb_s"] = rate;
  };
  note("put", RateOf([&] {
         for (const std::string& blob : blobs) {
           const storage::StagedBlob staged = Must(store->Stage(*database.database(), blob, Soon(60)));
           storage::Transaction transaction = Must(database.database()->Begin(Soon(60)));
           if (!store->Put(transaction, staged).ok() || !transaction.Commit().ok()) std::exit(1);
           digests.push_back(staged.sha256);
         }
       }));
  note("get", RateOf([&] {
         for (const std::string& sha256 : digests) {
           Must(store->Get(*database.database(), sha256, Soon(60)));
         }
       }));
  if (store->objects() == nullptr) {
    // As reads were before, without the digest: bytes as hexadecimal text, and as they are.
    for (const bool binary : {false, true}) {
      note(binary ? "read_binary" : "read_hex", RateOf([&] {
             for (const std::string& sha256 : digests) {
               storage::Transaction transaction = Must(database.database()->Begin(Soon(60)));
               const char* sql = "SELECT bytes FROM blobs WHERE sha256 = $1";
               const storage::Params key = storage::Params().Digest(sha256);
               Must(binary ? transaction.ExecuteBinary(sql, key) : transaction.Execute(sql, key)).Bytes(0, 0);
             }
           }));
    }
  }
  note("check", RateOf([&] {
         if (!storage::CheckBlobs(database.database(), store->objects(), {}, {}, Soon(60)).ok()) std::exit(1);
       }));
}

}  // namespace
}  // namespace sixpoint

int main() {
  using namespace sixpoint;
  nlohmann::json figures;
  Measure(storage::MakePostgresqlBlobStore().get(), &figures);
  if (testing::WhyNoObjectStore().empty()) {
    Measure(storage::MakeObjectBlobStore(storage::MakeS3ObjectStore(testing::ObjectStoreConfig())).get(), &figures);
  } else {
    std::printf("s3: %s\n", testing::WhyNoObjectStore().c_str());
  }
  std::printf("%s\n", nlohmann::json({{"bench", "store"}, {"figures", figures}}).dump().c_str());
  return 0;
}
