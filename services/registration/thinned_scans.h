// Scans as a fit takes them: downloaded, decoded block by block and thinned. Those of an inspection's registrations once for all of them.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "metrology/registration/scan_portion.h"
#include "services/clients/scans.h"
#include "services/registration/kept_portions.h"

namespace sixpoint::registration {

// Of one registration.
struct ScanThinning {
  metrology::Thinning own;
  // Of an inspection's: what its other registrations of the same scans want, all of the part with its datum points' places.
  std::optional<metrology::Thinning> shared = std::nullopt;
};

// A scan that came, or that was kept.
struct ScanAtHand {
  clients::StoredBlocks stored;  // without blocks where it was kept
  std::shared_ptr<const KeptPortion> kept;
};

// Thread-safe.
class ThinnedScans {
 public:
  // kept_bytes: of scans that are kept for an inspection's next registration.
  ThinnedScans(std::shared_ptr<grpc::Channel> ingest, std::size_t kept_bytes, int thread_count);

  using MakeContext = std::function<std::unique_ptr<grpc::ClientContext>()>;
  // may_be_kept: not downloaded again where it is, as long as ingest has its points. Errors as ScanClient's.
  absl::StatusOr<ScanAtHand> Fetch(const std::string& name, bool may_be_kept, const MakeContext& make_context) const;
  // To the bit what thinning the downloaded scan gives. scan.stored.scan: as its record says and stretched.
  absl::StatusOr<metrology::ScanPortion> Thin(const std::string& name, ScanAtHand scan,
                                              const metrology::MachineCalibration& calibration,
                                              const ScanThinning& thinning, const MakeContext& make_context) const;

 private:
  clients::ScanClient client_;
  mutable KeptPortions kept_;
  int thread_count_;
};

}  // namespace sixpoint::registration
