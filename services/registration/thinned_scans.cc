#include "services/registration/thinned_scans.h"

#include <utility>
#include <vector>

namespace sixpoint::registration {
namespace {

using metrology::ScanPortion;
using metrology::Thinner;
using metrology::Thinning;

ScanPortion WithoutDense(ScanPortion portion) {
  portion.dense_sensor_mm.clear();
  portion.dense_zero_mm.clear();
  return portion;
}

// Of the shared one, where the registration wants the same points of it; nothing elsewhere.
bool IsOfShared(const ScanThinning& thinning) {
  return thinning.shared && thinning.own.target_count == thinning.shared->target_count &&
         (thinning.own.dense_places_mm.empty() || thinning.own.dense_places_mm == thinning.shared->dense_places_mm);
}
ScanPortion OfShared(const ScanThinning& thinning, const ScanPortion& shared) {
  return thinning.own.dense_places_mm.empty() ? WithoutDense(shared) : shared;
}

}  // namespace

ThinnedScans::ThinnedScans(std::shared_ptr<grpc::Channel> ingest, std::size_t kept_bytes, int thread_count)
    : client_(std::move(ingest)), kept_(kept_bytes), thread_count_(thread_count) {}

absl::StatusOr<ScanAtHand> ThinnedScans::Fetch(const std::string& name, bool may_be_kept,
                                               const MakeContext& make_context) const {
  if (may_be_kept) {
    if (std::shared_ptr<const KeptPortion> kept = kept_.Find(name)) {
      if (absl::Status there = client_.RequirePoints(name, make_context()); !there.ok()) return there;
      return ScanAtHand{kept->stored, std::move(kept)};
    }
  }
  auto blocks = client_.FetchBlocks(name, make_context());
  if (!blocks.ok()) return blocks.status();
  return ScanAtHand{*std::move(blocks), nullptr};
}

absl::StatusOr<ScanPortion> ThinnedScans::Thin(const std::string& name, ScanAtHand scan,
                                               const metrology::MachineCalibration& calibration,
                                               const ScanThinning& thinning, const MakeContext& make_context) const {
  clients::StoredBlocks& stored = scan.stored;
  const auto thinner_of = [&](const Thinning& wanted) {
    return Thinner(stored.scan, stored.record.header().point_count(), calibration, wanted);
  };
  Thinner own = thinner_of(thinning.own);
  std::optional<Thinner> shared;
  if (thinning.shared) shared.emplace(thinner_of(*thinning.shared));
  if (scan.kept) {
    const bool same = IsOfShared(thinning) && scan.kept->determinants == shared->Determinants() &&
                      scan.kept->dense_places_mm == thinning.shared->dense_places_mm;
    if (same) return OfShared(thinning, scan.kept->portion);
    auto blocks = client_.FetchBlocks(name, make_context());
    if (!blocks.ok()) return blocks.status();
    stored.blocks = std::move(blocks->blocks);
  }
  std::vector<Thinner*> thinners;
  if (shared) thinners.push_back(&*shared);
  if (!IsOfShared(thinning)) thinners.push_back(&own);
  absl::Status added = Thinner::AddPieces(
      stored.blocks.size(), [&](std::size_t block) { return stored.DecodeOne(block); }, thread_count_, thinners);
  if (!added.ok()) return added;
  if (!shared) return own.Take();
  stored.blocks.clear();
  KeptPortion kept{std::move(stored), shared->Determinants(), thinning.shared->dense_places_mm, shared->Take()};
  ScanPortion portion = IsOfShared(thinning) ? OfShared(thinning, kept.portion) : own.Take();
  kept_.Keep(name, std::move(kept));
  return portion;
}

}  // namespace sixpoint::registration
