// PCL's point-to-plane registration and the product's, turn by turn on the same scans.
#include <cstdio>

#include "bench/registration/pcl_peer.h"
#include "bench/registration/runs.h"

namespace sixpoint::bench {

void RunPeers(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\npeers: %zu points\n%-4s %-44s %9s %13s %12s %11s\n", options.points, "case", "", "s", "of processors",
              "error um", "iterations");
  const struct {
    const char* name;
    const char* prefix;
    CaseKind kind;
    bool bumped;
  } cases[] = {{"C", "c", CaseKind::kWellHeld, false},
               {"A", "a", CaseKind::kOneSide, false},
               {"D", "d", CaseKind::kWellHeld, true}};
  for (const auto& one : cases) {
    std::optional<Bump> bump;
    if (one.bumped) bump = Bump();
    metrology::ScanPortion portion =
        PortionOf(MakeScan(prepared.blade, one.kind, options.points, kNoiseMm, bump, 1).scan_mm);
    const TimedFit ours = FitPortion(prepared, portion, options.threads);
    if (!ours.converged) {
      ++figures->failures;
      std::printf("  did not converge: %s\n", ours.remark.c_str());
    }
    const std::string name = std::string("pcl_") + one.prefix;
    std::printf("%-4s %-44s %9.3f %13.3f %12.4f %11d\n", one.name, "Sixpoint, point to surface", ours.seconds,
                ours.processor_s, VertexDisplacementUm(prepared.blade, ours.stopped_at, ScanFromPart()),
                ours.fit.evidence.iteration_count);
    for (const std::size_t stride : {std::size_t{1}, std::size_t{10}}) {
      const bool all = stride == 1;
      if (all && one.kind != CaseKind::kWellHeld && !options.full_peers) continue;
      if (all && one.bumped && !options.full_peers) continue;
      const PeerFit peer = PclPointToPlane(prepared.blade, PointsOf(portion), stride);
      const double error_um = VertexDisplacementUm(prepared.blade, peer.scan_from_part, ScanFromPart());
      std::printf("%-4s %-44s %9.3f %13.3f %12.4f %11d\n", one.name,
                  all ? "PCL, point to plane" : "PCL, point to plane, every 10th point", peer.seconds, peer.processor_s,
                  error_um, peer.iteration_count);
      const std::string key = all ? name : name + "_tenth";
      figures->values[key + "_seconds"] = peer.seconds;
      figures->values[key + "_um"] = error_um;
      if (all && !one.bumped && one.kind == CaseKind::kWellHeld)
        figures->values["times_faster_than_pcl"] = peer.seconds / ours.seconds;
    }
  }
}

}  // namespace sixpoint::bench
