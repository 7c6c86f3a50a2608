// `bench/run calibration`: every calibration against its Cramer-Rao bound. The last line is one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>

#include "bench/calibration/runs.h"
#include "bench/goals.h"

namespace {

double Rounded(double value) { return std::round(1e4 * value) / 1e4; }

std::vector<sixpoint::bench::Goal> CalibrationGoals() {
  using sixpoint::bench::Goal;
  constexpr auto kAlways = Goal::Counts::kAlways, kInFull = Goal::Counts::kInFull,
                 kWhereQuiet = Goal::Counts::kWhereQuiet;
  constexpr auto kNone = std::nullopt;
  return {
      {"sensor", "variance_over_bound", "squared error over bound, all kinds that ran pooled", kNone, 1.15, kInFull},
      {"sensor", "coverage_95_low_percent", "95 % intervals cover, the kind least covered, %", 93, kNone, kInFull},
      {"sensor", "coverage_95_high_percent", "95 % intervals cover, the kind most covered, %", kNone, 97.5, kInFull},
      {"sensor", "sensor_worst_bias_sigma", "sensor: worst bias, standard deviations", kNone, 0.2, kInFull},
      {"sensor", "sensor_time_over_pcl", "sensor: time over PCL's plane and circles", kNone, 10, kWhereQuiet},
      {"sensor", "same_bits", "the same bits alone and beside others, on 1 and more threads", 1, kNone, kAlways},
      {"search", "soiled_found_percent", "soiled, turned scans: calibrated, %", 99, kNone, kInFull},
      {"search", "soiled_right_percent", "soiled, turned scans: right within 5 sigma, %", 99, kNone, kInFull},
      {"axes", "axes_variance_over_bound", "axes: squared error over bound", kNone, 1.15, kInFull},
      {"axes", "axes_worst_bias_sigma", "axes: worst bias, standard deviations", kNone, 0.2, kInFull},
      {"probe", "probe_variance_over_bound", "probe: squared error over bound", kNone, 1.15, kInFull},
      {"probe", "probe_rough_variance_over_bound", "probe, rough touch: squared error over bound", kNone, 1.15,
       kInFull},
      {"probe", "probe_worst_bias_sigma", "probe: worst bias, standard deviations", kNone, 0.2, kInFull},
      {"characterisation", "characterisation_variance_over_bound", "axis characterisation: squared error over bound",
       kNone, 1.15, kInFull},
      {"characterisation", "characterisation_coverage_percent", "axis characterisation: 95 % intervals cover, %", 93,
       97.5, kInFull},
      {"plant-a", "plant_a_worst_sigma", "plant-a: worst error over its stated uncertainty", kNone, 3, kAlways},
      {"plant-a", "plant_a_angles_reported_over_bound", "plant-a: stated angles over bound", kNone, 1.15, kAlways},
      {"plant-a", "plant_a_t_sm_reported_over_bound", "plant-a: stated T_sm over bound", kNone, 1.15, kAlways},
      {"plant-a", "plant_a_t_sm_reported_over_bound_if_stated",
       "plant-a: stated T_sm over bound, touch uncertainty stated", kNone, 1.15, kAlways},
  };
}

}  // namespace

int main(int argc, char** argv) {
  using sixpoint::bench::RunOptions;
  RunOptions options;
  bool quick = false, no_times = false;
  std::vector<std::string> only;
  CLI::App app("Calibrations against their Cramer-Rao bounds", "bench/run calibration");
  app.add_flag("--quick", quick, "30 seeds, scans of an eighth of the points");
  app.add_flag("--no-times", no_times, "times are printed, not judged: the machine does other things too");
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
  sixpoint::bench::GoalRun judged;
  judged.quiet = !no_times;
  judged.full = options.dense && options.seeds >= RunOptions().seeds && options.fast_seeds >= RunOptions().seeds;
  for (const auto& [name, run] : parts)
    if (only.empty() || std::find(only.begin(), only.end(), name) != only.end()) {
      run(options, &figures);
      std::fflush(stdout);
      judged.parts.push_back(name);
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
  const int missed = sixpoint::bench::PrintGoals(CalibrationGoals(), judged, values);
  values["missed"] = missed;
  std::printf("\n%s\n", nlohmann::json({{"bench", "calibration"}, {"figures", values}}).dump().c_str());
  return missed > 0 ? 1 : 0;
}
