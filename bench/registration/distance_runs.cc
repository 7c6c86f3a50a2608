// Signed distances of a million points near the surface: how quick, and how exact beside all triangles looked at in turn.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "bench/all_triangles.h"
#include "bench/registration/embree_peer.h"
#include "bench/registration/runs.h"
#include "metrology/nearest/near_lanes.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

constexpr double kBandMm = 0.05, kLimitMm = 1;
constexpr std::size_t kChecked = 1000;  // of each kind of point

// One after the other, as they come.
void OneByOne(const metrology::Surface& surface, const metrology::Points& part_mm, int threads) {
  std::vector<double> distances(part_mm.size());
  metrology::InParts(part_mm.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i)
      distances[i] = surface.ClosestWithin(part_mm[i], kLimitMm).signed_distance_mm;
  });
}

std::vector<double> Distances(const metrology::Surface& surface, const metrology::Points& part_mm, int threads) {
  std::vector<double> distances;
  surface.SignedDistances(part_mm, kLimitMm, threads, &distances);
  return distances;
}

struct Exactness {
  double worst_um = 0;
  int wrong_signs = 0;
};
Exactness Compare(const std::vector<double>& found_mm, const std::vector<double>& true_mm) {
  Exactness exactness;
  for (std::size_t i = 0; i < true_mm.size(); ++i) {
    const double off_um = 1e3 * std::abs(std::abs(found_mm[i]) - std::abs(true_mm[i]));
    // A point with no surface found within the limit is wrong by all of it.
    exactness.worst_um = std::max(exactness.worst_um, std::isfinite(off_um) ? off_um : 1e3 * kLimitMm);
    if (found_mm[i] * true_mm[i] < 0) ++exactness.wrong_signs;
  }
  return exactness;
}

// On whole scans of the body, up to 50 um off the surface, and on a bump that stands 0.3 mm off.
// With a casting's bump and within a band; or as a scan of a blade true to CAD.
metrology::Points NearSurface(const Blade& blade, std::size_t count, bool cast) {
  CaseSampler sampler(blade, CaseKind::kWholeBody, kNoiseMm, std::nullopt, 7);
  const Bump bump;
  metrology::Points points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const CaseSampler::OnSurface on = sampler.NextOnSurface();
    const double part = 2 * sampler.NextUniform() - 1;
    const double off_mm = cast ? bump.At(on.part_mm, on.normal) + kBandMm * part : kNoiseMm * part;
    points.push_back(on.part_mm + off_mm * on.normal);
  }
  return points;
}

// All around the trailing edge, where the two sides are fractions of a millimetre apart.
metrology::Points NearTrailingEdge(const Blade& blade, std::size_t count) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(-1, 1), along(0, 1);
  const std::size_t last = blade.trailing_edge.size() - 1;
  metrology::Points points;
  while (points.size() < count) {
    const double x = unit(random), y = unit(random), z = unit(random);
    const double at = along(random) * static_cast<double>(last);
    const auto below = std::min(last - 1, static_cast<std::size_t>(at));
    const double part = at - static_cast<double>(below);
    points.push_back((1 - part) * blade.mesh.vertices_mm[blade.trailing_edge[below]] +
                     part * blade.mesh.vertices_mm[blade.trailing_edge[below + 1]] + 4 * kBandMm * Vector3d(x, y, z));
  }
  return points;
}

// Times of one way to measure, in turn with the others.
struct Timed {
  std::vector<double> seconds, processor_s;
  template <typename Work>
  void Run(const Work& work) {
    const double begin = Seconds(), processor_begin = ProcessorSeconds();
    work();
    seconds.push_back(Seconds() - begin);
    processor_s.push_back(ProcessorSeconds() - processor_begin);
  }
  double Rate(std::size_t count) const { return 1e-6 * static_cast<double>(count) / metrology::Median(seconds); }
};

struct Width {
  metrology::LaneWidth lanes;
  const char* words;
  const char* key;
};
constexpr Width kWidths[] = {{metrology::LaneWidth::kFour, "4 lanes", "4"},
                             {metrology::LaneWidth::kEight, "8 lanes (AVX2)", "8"},
                             {metrology::LaneWidth::kSixteen, "16 lanes (AVX-512)", "16"}};

// Each width that this processor has beside the peer, and the widest one by one.
void RunRates(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  const Blade& blade = prepared.blade;
  const metrology::Surface& surface = *prepared.surface;
  const metrology::Points cast = NearSurface(blade, options.points, true);
  const metrology::Points scanned = NearSurface(blade, options.points, false);
  const std::size_t widths = metrology::LaneWidths().size();
  std::vector<Timed> of_cast(widths), of_scanned(widths);
  Timed one_by_one;
  std::vector<double> embree_s;
  for (int repeat = 0; repeat < 5; ++repeat) {
    for (std::size_t w = 0; w < widths; ++w) {
      metrology::UseLaneWidth(kWidths[w].lanes);
      of_cast[w].Run([&] { Distances(surface, cast, options.threads); });
      of_scanned[w].Run([&] { Distances(surface, scanned, options.threads); });
    }
    one_by_one.Run([&] { OneByOne(surface, cast, options.threads); });
    EmbreeDistances(blade, cast, kLimitMm, options.threads, &embree_s.emplace_back());
  }
  const double millions = 1e-6 * static_cast<double>(cast.size()), embree = millions / metrology::Median(embree_s);
  std::printf("\ndistances: %zu points in random order, %d threads; million points/s\n%-28s %12s %12s %12s %12s\n",
              cast.size(), options.threads, "", "cast blade", "true blade", "a processor", "over Embree");
  for (std::size_t w = 0; w < widths; ++w) {
    const double rate = of_cast[w].Rate(cast.size());
    const double of_processor = millions / metrology::Median(of_cast[w].processor_s);
    std::printf("%-28s %12.2f %12.2f %12.2f %12.1f\n", kWidths[w].words, rate, of_scanned[w].Rate(scanned.size()),
                of_processor, rate / embree);
    figures->values[std::string("distances_over_embree_by_lanes_") + kWidths[w].key] = rate / embree;
    figures->values["distances_over_embree"] = rate / embree;  // the widest stays
    figures->values["distances_million_per_s"] = rate;
    figures->values["distances_of_a_true_blade_million_per_s"] = of_scanned[w].Rate(scanned.size());
    figures->values["distances_million_per_processor_s"] = of_processor;
  }
  std::printf("%-28s %12.2f\n%-28s %12.2f\n", "one by one", one_by_one.Rate(cast.size()), "Embree's point query",
              embree);
  std::printf("  surface and near cells %.0f MB\n", 1e-6 * static_cast<double>(surface.memory_bytes()));
  figures->values["distances_one_by_one_million_per_s"] = one_by_one.Rate(cast.size());
  figures->values["embree_million_per_s"] = embree;
  figures->values["surface_megabytes"] = 1e-6 * static_cast<double>(surface.memory_bytes());
}

// Beside all triangles looked at in turn.
void RunExactness(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  const Blade& blade = prepared.blade;
  double worst_um = 0;
  int wrong_signs = 0;
  for (const bool edge : {false, true}) {
    const metrology::Points checked = edge ? NearTrailingEdge(blade, kChecked) : NearSurface(blade, kChecked, true);
    std::vector<double> truth(checked.size());
    metrology::InParts(checked.size(), options.threads, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i) truth[i] = SignedDistanceByAllTriangles(blade.mesh, checked[i]);
    });
    const Exactness ours = Compare(Distances(*prepared.surface, checked, options.threads), truth);
    double unused_s = 0;
    const std::vector<float> by_embree = EmbreeDistances(blade, checked, kLimitMm, options.threads, &unused_s);
    const Exactness theirs = Compare({by_embree.begin(), by_embree.end()}, truth);
    std::printf("%-28s %4zu points, worst %.3g um, %d wrong signs; Embree worst %.3g um, %d wrong signs\n",
                edge ? "  around the trailing edge" : "  anywhere near the surface", checked.size(), ours.worst_um,
                ours.wrong_signs, theirs.worst_um, theirs.wrong_signs);
    worst_um = std::max(worst_um, ours.worst_um);
    wrong_signs += ours.wrong_signs;
  }
  figures->values["distances_worst_um"] = worst_um;
  figures->values["distances_wrong_signs"] = wrong_signs;
}

}  // namespace

void RunDistances(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  RunRates(prepared, options, figures);
  RunExactness(prepared, options, figures);
}

}  // namespace sixpoint::bench
