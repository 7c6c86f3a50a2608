// `bench/run pcl`: the places at which PCL could stand in the product, ours and PCL's side by side in one run. The last line
// is one JSON object; ends with 1 where ours stays and is not at least as good.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "bench/goals.h"
#include "bench/pcl/pcl_points.h"
#include "bench/pcl/runs.h"

namespace {

double Rounded(double value) { return std::round(1e4 * value) / 1e4; }

// Fails no more often, and is no farther off, than the best of PCL's; of thinning, give or take chance.
std::vector<sixpoint::bench::Goal> PclGoals() {
  struct Place {
    std::string part, key, words;
    std::optional<double> error_ratio;
  };
  constexpr auto kInFull = sixpoint::bench::Goal::Counts::kInFull;
  std::vector<sixpoint::bench::Goal> goals;
  for (const auto& [part, key, words, error_ratio] :
       {Place{"artefact", "artefact_pose", "the artefact's pose", 1.05},
        {"start", "start_whole", "coarse start, all sides", 1.05},
        {"start", "start_one_side", "coarse start, one side", 1.05},
        {"pins", "pins", "pins", 1.05},
        {"thinning", "thinning_clean", "thinning for a fit", 1.15},
        {"thinning", "thinning_soiled", "thinning for a fit, strays", std::nullopt}}) {
    goals.push_back(
        {part, key + "_failed_more_percent", words + ": fails more often than PCL's best, %", {}, 0, kInFull});
    if (error_ratio)
      goals.push_back({part, key + "_error_ratio", words + ": error over PCL's best", {}, error_ratio, kInFull});
  }
  return goals;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  RunOptions options;
  bool quick = false;
  std::vector<std::string> only;
  CLI::App app("PCL where it could stand in the product", "bench/run pcl");
  app.add_flag("--quick", quick, "a tenth of the seeds");
  const CLI::Option* seeds =
      app.add_option("--seeds", options.seeds, "draws of each case")->check(CLI::Range(2, 100000));
  const std::vector<std::pair<std::string, std::function<void(const RunOptions&, Figures*)>>> parts{
      {"artefact", RunArtefact},
      {"plants", RunPlantArtefacts},
      {"start", RunStart},
      {"pins", RunPins},
      {"thinning", RunThinning}};
  std::vector<std::string> names;
  for (const auto& part : parts) names.push_back(part.first);
  app.add_option("--only", only, "some parts")->delimiter(',')->check(CLI::IsMember(names));
  app.add_option("--shared", options.shared, "folder with data/plant-a and data/plant-b");
  app.add_option("--threads", options.threads, "threads")->check(CLI::Range(1, 64));
  CLI11_PARSE(app, argc, argv);
  if (quick && seeds->empty()) options.seeds /= 10;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  QuietPcl();
  Figures figures;
  GoalRun judged;
  judged.full = options.seeds >= RunOptions().seeds;
  for (const auto& [name, run] : parts)
    if (only.empty() || std::find(only.begin(), only.end(), name) != only.end()) {
      run(options, &figures);
      judged.parts.push_back(name);
    }
  nlohmann::json values = nlohmann::json::object();
  for (const auto& [name, value] : figures.values.items()) values[name] = Rounded(value.get<double>());
  const int missed = PrintGoals(PclGoals(), judged, values);
  values["missed"] = missed;
  std::printf("\n%s\n", nlohmann::json({{"bench", "pcl"}, {"figures", values}}).dump().c_str());
  return missed > 0 ? 1 : 0;
}
