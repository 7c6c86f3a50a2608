// sixpoint-correction: the machining program moved onto the real blade.
#include "services/correction/correction_service.h"
#include "services/correction/machining_pass_service.h"
#include "services/correction/reconstruction_service.h"
#include "services/correction/repair_service.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"

namespace sixpoint::correction {
namespace {

// Corrections at once: each is some remote calls and milliseconds of computing.
constexpr runtime::PoolLimits kLimits{16, runtime::kAllLetIn};
// A reconstruction has its own threads, a blank's points and a lattice's factor; more at once only slow each other down.
constexpr runtime::PoolLimits kReconstructionLimits{1, runtime::kAllLetIn};

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database) {
  // One for all: prepared surfaces are kept once.
  const auto peers = std::make_shared<const clients::BladePeers>(
      runtime::ConnectToPeer(options, "plant"), runtime::ConnectToPeer(options, "ingest"),
      runtime::ConnectToPeer(options, "calibration"), runtime::ConnectToPeer(options, "registration"));
  std::vector<runtime::ServedService> services;
  const ShapeStores shapes{storage::ReconstructionsIn(database), storage::MachiningPassesIn(database),
                           storage::RepairsIn(database)};
  const auto corrections = storage::CorrectionsIn(database);
  services.push_back({v1::CorrectionService::service_full_name(),
                      std::make_unique<CorrectionService>(corrections, storage::CorrectionEventsIn(database), shapes,
                                                          peers, kLimits, options.threads)});
  services.push_back(
      {v1::ReconstructionService::service_full_name(),
       std::make_unique<ReconstructionService>(shapes.reconstructions, peers, kReconstructionLimits, options.threads)});
  services.push_back(
      {v1::MachiningPassService::service_full_name(),
       std::make_unique<MachiningPassService>(shapes, corrections, peers, kReconstructionLimits, options.threads)});
  services.push_back({v1::RepairService::service_full_name(),
                      std::make_unique<RepairService>(shapes.repairs, peers, kReconstructionLimits, options.threads)});
  return services;
}

}  // namespace
}  // namespace sixpoint::correction

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "correction"),
                                  sixpoint::correction::MakeServices);
}
