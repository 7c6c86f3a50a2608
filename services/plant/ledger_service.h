// sixpoint.plant.v1.LedgerService: heads, proofs and the check of the ledger. Reads page by page: what is sealed never changes, so that a
// slow client holds nothing of the store.
#pragma once

#include <memory>
#include <utility>

#include "services/plant/ledger_sealer.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/plant/v1/ledger.grpc.pb.h"
#include "storage/ledger_store.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

class LedgerService final : public v1::LedgerService::Service {
 public:
  // sealer: may be none.
  LedgerService(std::shared_ptr<const storage::LedgerReader> ledger, std::shared_ptr<const storage::BladeReader> blades,
                std::shared_ptr<const storage::ClearanceReader> clearances, std::unique_ptr<LedgerSealer> sealer)
      : ledger_(std::move(ledger)),
        blades_(std::move(blades)),
        clearances_(std::move(clearances)),
        sealer_(std::move(sealer)) {}

  grpc::Status GetLedgerHead(grpc::ServerContext* context, const v1::GetLedgerHeadRequest* request,
                             v1::LedgerHead* response) override;
  grpc::Status GetBladeProof(grpc::ServerContext* context, const v1::GetBladeProofRequest* request,
                             grpc::ServerWriter<v1::ProvenEntry>* writer) override;
  grpc::Status VerifyLedger(grpc::ServerContext* context, const v1::VerifyLedgerRequest* request,
                            grpc::ServerWriter<v1::LedgerSlice>* writer) override;

 private:
  const std::shared_ptr<const storage::LedgerReader> ledger_;
  const std::shared_ptr<const storage::BladeReader> blades_;
  const std::shared_ptr<const storage::ClearanceReader> clearances_;
  const std::unique_ptr<LedgerSealer> sealer_;
  // One reads all of the record; more at once would take the database from who records.
  runtime::ComputePool checks_{{1, 0}, "checks of the ledger", errors::v1::LEDGER_CHECKS_FULL};
};

}  // namespace sixpoint::plant
