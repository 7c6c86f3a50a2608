// sixpoint-correction: the machining program moved onto the real blade.
#include "services/correction/correction_service.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"

namespace sixpoint::correction {
namespace {

// Corrections at once: each is some remote calls and milliseconds of computing.
constexpr runtime::PoolLimits kLimits{16, runtime::kAllLetIn};

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database) {
  auto peers =
      std::make_unique<Peers>(runtime::ConnectToPeer(options, "plant"), runtime::ConnectToPeer(options, "calibration"),
                              runtime::ConnectToPeer(options, "registration"));
  std::vector<runtime::ServedService> services;
  services.push_back(
      {v1::CorrectionService::service_full_name(),
       std::make_unique<CorrectionService>(storage::CorrectionsIn(database), storage::CorrectionEventsIn(database),
                                           std::move(peers), kLimits)});
  return services;
}

}  // namespace
}  // namespace sixpoint::correction

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "correction"),
                                  sixpoint::correction::MakeServices);
}
