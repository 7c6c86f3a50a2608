// LedgerService on a fake ledger and fake blades, without PostgreSQL.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "services/plant/ledger_service.h"
#include "services/runtime/server.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/fake_ledger.h"
#include "tests/support/fake_plant_stores.h"
#include "tests/support/in_process_server.h"
#include "tests/support/must.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::plant {

// Hands calls on to the service, and says how the last one stands and ended.
class WatchedLedger final : public v1::LedgerService::Service {
 public:
  explicit WatchedLedger(LedgerService* service) : service_(service) {}
  grpc::Status GetLedgerHead(grpc::ServerContext* context, const v1::GetLedgerHeadRequest* request,
                             v1::LedgerHead* response) override {
    return service_->GetLedgerHead(context, request, response);
  }
  grpc::Status GetBladeProof(grpc::ServerContext* context, const v1::GetBladeProofRequest* request,
                             grpc::ServerWriter<v1::ProvenEntry>* writer) override {
    return Ended(context, [&] { return service_->GetBladeProof(context, request, writer); });
  }
  grpc::Status VerifyLedger(grpc::ServerContext* context, const v1::VerifyLedgerRequest* request,
                            grpc::ServerWriter<v1::LedgerSlice>* writer) override {
    return Ended(context, [&] { return service_->VerifyLedger(context, request, writer); });
  }
  // Only while it runs.
  bool BecomesCancelled() const {
    return testing::Becomes(std::chrono::seconds(30), [this] { return context_.load()->IsCancelled(); });
  }
  bool EndsWith(grpc::StatusCode code) const {
    return testing::Becomes(std::chrono::seconds(30), [&] { return ended_ == code; });
  }

 private:
  template <typename Work>
  grpc::Status Ended(grpc::ServerContext* context, const Work& work) {
    context_ = context;
    const grpc::Status status = work();
    ended_ = status.error_code();
    return status;
  }

  LedgerService* const service_;
  std::atomic<grpc::ServerContext*> context_{nullptr};
  std::atomic<int> ended_{-1};
};

class LedgerHandlersTest : public ::testing::Test {
 protected:
  void AddBlade(const std::string& serial) {
    ASSERT_TRUE(stores_.blades->Record({}, {serial, "vane", {}}, {}, {}).ok());
  }
  void RecordMany(int count, const std::string& blade = "") {
    for (int i = 0; i < count; ++i) ledger_->Record("scans/m" + std::to_string(i), blade);
  }
  void Seal() { testing::Must(ledger_->Seal(1'000'000, {})); }
  // Seals, too; what was signed.
  ledger::Head Sign() {
    Seal();
    const storage::LedgerEnd end = testing::Must(ledger_->End({}));
    ledger::Head head;
    head.plant_id = testing::kSomeUuid;
    head.tree_size = end.size;
    head.root = testing::Must(ledger_->Root(end.size, {}));
    head.record_sequence = end.record_sequence;
    head.signed_at = "2026-11-25T01:02:03Z";
    head = testing::Must(key_.Sign(head));
    testing::Must(ledger_->KeepHead({head, key_.public_pem()}, {}));
    return head;
  }

  absl::StatusOr<v1::LedgerHead> GetHead() {
    return testing::Call(*stub_, &v1::LedgerService::Stub::GetLedgerHead, {});
  }
  testing::Streamed<v1::ProvenEntry> Prove(const std::string& name) {
    v1::GetBladeProofRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &v1::LedgerService::Stub::GetBladeProof, request);
  }
  testing::Streamed<v1::LedgerSlice> Verify(bool with_blobs = false) {
    v1::VerifyLedgerRequest request;
    request.set_with_blobs(with_blobs);
    return testing::CallStream(*stub_, &v1::LedgerService::Stub::VerifyLedger, request);
  }
  // Of a check that ends well.
  std::vector<v1::LedgerDamage> Damages(bool with_blobs = false) {
    const auto verified = Verify(with_blobs);
    EXPECT_TRUE(verified.status.ok()) << verified.status;
    std::vector<v1::LedgerDamage> damages;
    for (const v1::LedgerSlice& slice : verified.messages)
      damages.insert(damages.end(), slice.damages().begin(), slice.damages().end());
    return damages;
  }
  // "CHANGED record_entries scans/s1: 1 rows, sealed 1"
  static std::vector<std::string> SentencesOf(const std::vector<v1::LedgerDamage>& damages) {
    std::vector<std::string> sentences;
    for (const v1::LedgerDamage& damage : damages)
      sentences.push_back(v1::DamageKind_Name(damage.kind()).substr(std::string("DAMAGE_KIND_").size()) + " " +
                          damage.table() + " " + damage.name() + ": " + damage.detail());
    return sentences;
  }

  const ledger::SigningKey key_ = testing::Must(ledger::SigningKey::OfPem(testing::Must(ledger::SigningKey::NewPem())));
  std::shared_ptr<testing::FakeLedger> ledger_ = [] {
    auto ledger = std::make_shared<testing::FakeLedger>();
    ledger->schema_version = runtime::NewestMigration();
    return ledger;
  }();
  testing::FakePlantStores stores_;
  LedgerService service_{ledger_, stores_.blades, stores_.clearances, nullptr};
  WatchedLedger watched_{&service_};
  testing::InProcessServer server_{{&watched_}};
  std::unique_ptr<v1::LedgerService::Stub> stub_ = v1::LedgerService::NewStub(server_.Connect());
};

}  // namespace sixpoint::plant
