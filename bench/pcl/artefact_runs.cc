// The artefact's upper face, its holes and its pose in raw scans: our search and PCL's, step by step and as a whole.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

#include "bench/calibration/plant_files.h"
#include "bench/pcl/artefact_cases.h"
#include "bench/pcl/pcl_artefact.h"
#include "bench/pcl/runs.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::bench {
namespace {

using metrology::Plane;
using metrology::Points;

constexpr double kBandMm = 0.03;
constexpr double kFaceLimitMm = 0.05;  // of the plate's corner: below half of what counts as a hole's depth
constexpr double kHoleLimitMm = 0.7;   // what FindArtefact matches by
constexpr double kPoseLimitMm = 0.3;   // of a cone: the fits after it take readings this far off the wall
constexpr double kUm = 1e3;

template <typename Found>
Result Timed(const std::function<Found()>& find, const std::function<Result(const Found&)>& judge) {
  const double begin = ThreadSeconds();
  const Found found = find();
  const double seconds = ThreadSeconds() - begin;
  Result result = judge(found);
  result.seconds = seconds;
  return result;
}

// The face that comes nearest to the plate's, at the worst of four places.
Result JudgeFaces(const ArtefactCase& one, const std::vector<Plane>& faces) {
  Result result{!faces.empty(), 1e9, 0};
  for (const Plane& face : faces) {
    double worst = 0;
    for (const double x : {-10.0, 10.0})
      for (const double y : {-10.0, 10.0})
        worst = std::max(worst, std::abs(face.HeightOf(one.sensor_from_artefact * Eigen::Vector3d(x, y, 0))));
    result.error = std::min(result.error, kUm * worst);
  }
  return result;
}

// Root mean square over the cones; not found where one of them is not.
Result JudgeHoles(const ArtefactCase& one, const metrology::FaceFrame& frame,
                  const std::vector<metrology::Recess>& holes) {
  double squares = 0;
  for (const metrology::PlaneFeature& cone : one.artefact.cones) {
    const Eigen::Vector3d centre(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    const Eigen::Vector2d at = frame.See(one.sensor_from_artefact * centre).at;
    double best = 1e9;
    for (const metrology::Recess& hole : holes)
      if (!hole.slot) best = std::min(best, (hole.centre - at).norm());
    if (best > kHoleLimitMm) return {};
    squares += best * best;
  }
  return {true, kUm * std::sqrt(squares / static_cast<double>(one.artefact.cones.size())), 0};
}

// The worst cone.
Result JudgePose(const ArtefactCase& one, const absl::StatusOr<metrology::ArtefactSighting>& sighting) {
  if (!sighting.ok()) return {};
  Result result{true, 0, 0};
  for (const metrology::PlaneFeature& cone : one.artefact.cones) {
    const Eigen::Vector3d centre(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    result.error = std::max(result.error,
                            kUm * (sighting->sensor_from_artefact * centre - one.sensor_from_artefact * centre).norm());
  }
  return result;
}

struct ArtefactContender {
  std::string name;
  std::function<Result(const ArtefactCase&)> run;
};
struct Step {
  std::string key, title;
  double limit_um;
  std::vector<ArtefactContender> contenders;  // ours first
};

Step FaceStep() {
  using Faces = std::vector<Plane>;
  const auto contender = [](const std::string& name, const std::function<Faces(const Points&)>& find) {
    return ArtefactContender{name, [find](const ArtefactCase& one) {
                               const Points sample = metrology::EvenSample(one.scan.points_mm, kArtefactSampleCount);
                               return Timed<Faces>([&] { return find(sample); },
                                                   [&](const Faces& faces) { return JudgeFaces(one, faces); });
                             }};
  };
  Step step{"faces", "upper face", kUm * kFaceLimitMm, {}};
  step.contenders.push_back(contender(
      "ours", [](const Points& sample) { return metrology::FlatFaces(sample, kBandMm, kMostArtefactFaces); }));
  for (const auto& [name, consensus] : {std::pair{"PCL RANSAC", Consensus::kRansac},
                                        {"PCL MSAC", Consensus::kMsac},
                                        {"PCL MLESAC", Consensus::kMlesac},
                                        {"PCL LMedS", Consensus::kLmeds}})
    step.contenders.push_back(contender(name, [kind = consensus](const Points& sample) {
      return PclFlatFaces(sample, kBandMm, kMostArtefactFaces, kind);
    }));
  return step;
}

Step HoleStep() {
  using Holes = std::vector<metrology::Recess>;
  using Find = std::function<Holes(const std::vector<metrology::FacePoint>&, const metrology::Artefact&)>;
  const auto contender = [](const std::string& name, const Find& find) {
    return ArtefactContender{
        name, [find](const ArtefactCase& one) {
          const Eigen::Affine3d& pose = one.sensor_from_artefact;
          const Eigen::Vector3d normal = pose.linear().col(0).cross(pose.linear().col(1)).normalized();
          const metrology::FaceFrame frame(Plane{normal, pose.translation()});
          std::vector<metrology::FacePoint> seen;
          for (const Eigen::Vector3d& p : metrology::EvenSample(one.scan.points_mm, kArtefactSampleCount))
            seen.push_back(frame.See(p));
          return Timed<Holes>([&] { return find(seen, one.artefact); },
                              [&](const Holes& holes) { return JudgeHoles(one, frame, holes); });
        }};
  };
  return {"holes",
          "cones in the true face",
          kUm * kHoleLimitMm,
          {contender("ours", metrology::HolesBelow),
           contender("PCL Euclidean clusters",
                     [](const auto& seen, const auto& artefact) {
                       return PclHolesBelow(seen, artefact, HoleCentres::kOfClusters);
                     }),
           contender("PCL clusters, then circles", [](const auto& seen, const auto& artefact) {
             return PclHolesBelow(seen, artefact, HoleCentres::kOfCircles);
           })}};
}

Step PoseStep() {
  using Sighting = absl::StatusOr<metrology::ArtefactSighting>;
  using Find = std::function<Sighting(const metrology::LineScan&, const metrology::Artefact&)>;
  const auto contender = [](const std::string& name, const Find& find) {
    return ArtefactContender{name, [find](const ArtefactCase& one) {
                               return Timed<Sighting>([&] { return find(one.scan, one.artefact); },
                                                      [&](const Sighting& found) { return JudgePose(one, found); });
                             }};
  };
  return {"pose",
          "the artefact",
          kUm * kPoseLimitMm,
          {contender("ours", metrology::FindArtefact),
           contender("PCL planes, clusters",
                     [](const auto& scan, const auto& artefact) {
                       return PclFindArtefact(scan, artefact, HoleCentres::kOfClusters);
                     }),
           contender("PCL planes, clusters, circles", [](const auto& scan, const auto& artefact) {
             return PclFindArtefact(scan, artefact, HoleCentres::kOfCircles);
           })}};
}

Comparison Compare(const Step& step, const std::vector<std::vector<Result>>& results) {
  std::vector<Tally> tallies;
  for (std::size_t c = 0; c < step.contenders.size(); ++c)
    tallies.emplace_back(step.contenders[c].name, results[c], step.limit_um);
  return PrintTallies(step.title, "um", tallies);
}

// results[step][contender][case]
using Results = std::vector<std::vector<std::vector<Result>>>;
Results EmptyResults(const std::vector<Step>& steps, std::size_t cases) {
  Results results;
  for (const Step& step : steps) results.emplace_back(step.contenders.size(), std::vector<Result>(cases));
  return results;
}

}  // namespace

void RunArtefact(const RunOptions& options, Figures* figures) {
  const std::vector<Step> steps{FaceStep(), HoleStep(), PoseStep()};
  const std::size_t kinds = ArtefactCaseKinds().size(),
                    seeds = static_cast<std::size_t>(std::max(2, options.seeds / 4));
  std::vector<Results> of_kind(kinds, EmptyResults(steps, seeds));
  Results all = EmptyResults(steps, kinds * seeds);
  metrology::ForEach(seeds, options.threads, [&](std::size_t seed) {
    const std::vector<ArtefactCase> cases = ArtefactCases(static_cast<int>(seed));
    for (std::size_t kind = 0; kind < kinds; ++kind)
      for (std::size_t s = 0; s < steps.size(); ++s)
        for (std::size_t c = 0; c < steps[s].contenders.size(); ++c)
          all[s][c][kind * seeds + seed] = of_kind[kind][s][c][seed] = steps[s].contenders[c].run(cases[kind]);
  });
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    std::printf("\n-- artefact, %s: %zu scans\n", ArtefactCaseKinds()[kind].c_str(), seeds);
    for (std::size_t s = 0; s < steps.size(); ++s) Compare(steps[s], of_kind[kind][s]);
  }
  std::printf("\n-- artefact, all of these: %zu scans\n", kinds * seeds);
  for (std::size_t s = 0; s < steps.size(); ++s) figures->Add("artefact_" + steps[s].key, Compare(steps[s], all[s]));
}

void RunPlantArtefacts(const RunOptions& options, Figures* figures) {
  for (const std::string plant : {"plant-a", "plant-b"}) {
    const std::string folder = options.shared + "/data/" + plant;
    std::ifstream data_file(folder + "/dataset.json"), truth_file(folder + "/truth.json");
    if (!data_file || !truth_file) {
      std::printf("\n-- artefact, %s: SKIPPED, %s is absent\n", plant.c_str(), folder.c_str());
      continue;
    }
    const nlohmann::json data = nlohmann::json::parse(data_file);
    const simulator::MachineTruth truth = TruthOf(nlohmann::json::parse(truth_file));
    std::vector<ArtefactCase> cases;
    for (const nlohmann::json& entry : data.at("scans")) {
      if (entry.at("kind") != "artefact" && entry.at("kind") != "arm") continue;
      metrology::LineScan scan = LoadScan(folder, data, entry.at("id"));
      const Eigen::Affine3d sensor_from_artefact = SensorFromArtefact(truth, scan.v0_mm);
      cases.push_back({std::move(scan), RecordOf(GeometryOf(data.at("artefact"))), sensor_from_artefact});
    }
    const std::vector<Step> steps{FaceStep(), HoleStep(), PoseStep()};
    Results results = EmptyResults(steps, cases.size());
    metrology::ForEach(cases.size(), options.threads, [&](std::size_t i) {
      for (std::size_t s = 0; s < steps.size(); ++s)
        for (std::size_t c = 0; c < steps[s].contenders.size(); ++c)
          results[s][c][i] = steps[s].contenders[c].run(cases[i]);
    });
    std::printf("\n-- artefact, %s: %zu scans\n", plant.c_str(), cases.size());
    for (std::size_t s = 0; s < steps.size(); ++s)
      figures->Add("artefact_" + steps[s].key + (plant == "plant-a" ? "_plant_a" : "_plant_b"),
                   Compare(steps[s], results[s]));
  }
}

}  // namespace sixpoint::bench
