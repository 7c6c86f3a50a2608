// `bench/run calibration`: every calibration against its Cramer-Rao bound. The last line is one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>

#include "bench/calibration/runs.h"

namespace {

double Rounded(double value) { return std::round(1e4 * value) / 1e4; }

}  // namespace

int main(int argc, char** argv) {
  using sixpoint::bench::RunOptions;
  RunOptions options;
  bool quick = false;
  std::vector<std::string> only;
  CLI::App app("Calibrations against their Cramer-Rao bounds", "bench/run calibration");
  app.add_flag("--quick", quick, "30 seeds, scans of an eighth of the points");
  const CLI::Option* seeds =
      app.add_option("--seeds", options.seeds, "runs of each kind (400; probe 1000); the search has half as many")
          ->check(CLI::Range(2, 100000));
  const std::vector<std::pair<std::string, std::function<void(const RunOptions&, sixpoint::bench::Figures*)>>> parts{
      {"sensor", sixpoint::bench::RunSensor},
      {"search", sixpoint::bench::RunExtraction},
      {"axes", sixpoint::bench::RunAxes},
      {"probe", sixpoint::bench::RunProbe},
      {"characterisation", sixpoint::bench::RunCharacterisation},
      {"plant-a", sixpoint::bench::RunPlantA}};
  std::vector<std::string> names;
  for (const auto& part : parts) names.push_back(part.first);
  app.add_option("--only", only, "some parts")->delimiter(',')->check(CLI::IsMember(names));
  app.add_option("--plant", options.plant, "folder of plant-a");
  app.add_option("--threads", options.threads, "threads")->check(CLI::Range(1, 64));
  CLI11_PARSE(app, argc, argv);
  if (quick) {
    options.dense = false;
    if (seeds->empty()) options.seeds = 30;
  }
  if (quick || !seeds->empty()) options.fast_seeds = options.seeds;
  sixpoint::bench::Figures figures;
  for (const auto& [name, run] : parts)
    if (only.empty() || std::find(only.begin(), only.end(), name) != only.end()) {
      run(options, &figures);
      std::fflush(stdout);
    }
  nlohmann::json values = nlohmann::json::object();
  double squares = 0, low = 100, high = 0;
  int count = 0;
  for (const sixpoint::bench::ErrorStatistics& kind : figures.kinds) {
    squares += kind.whitened_squares();
    count += kind.values();
    low = std::min(low, kind.coverage_percent());
    high = std::max(high, kind.coverage_percent());
  }
  if (count > 0) {
    // Pooled over the parameters of all kinds; coverage is a kind's, over its parameters.
    values["variance_over_bound"] = Rounded(squares / count);
    values["coverage_95_low_percent"] = Rounded(low);
    values["coverage_95_high_percent"] = Rounded(high);
  }
  if (figures.compared > 0) {
    std::printf("\nsame bits alone and beside others, on 1 and on %d threads: %d of %d calibrations\n", options.threads,
                figures.with_same_bits, figures.compared);
    values["same_bits"] = figures.with_same_bits == figures.compared ? 1 : 0;
  }
  for (const auto& [name, value] : figures.values.items()) values[name] = Rounded(value.get<double>());
  std::printf("\n%s\n", nlohmann::json({{"bench", "calibration"}, {"figures", values}}).dump().c_str());
  return 0;
}
