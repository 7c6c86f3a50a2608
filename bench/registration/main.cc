// `bench/run registration`: the best fit against its Cramer-Rao bound and beside its peers, and what its evidence is worth.
// The last line is one JSON object; ends with 1 where a goal is missed. Each part prints what it took, so that its draws can
// be chosen. The default is for every change; a rate of a percent or so needs more draws, one part at a time:
//   --only noise --draws 1000          coverage to 0.4 %
//   --only disagreement --share 5      300 true blades of each kind, so that 1 % is told from 3
//   --only coarse,trap,allowance,overlap --share 2.5      75 starts, 125 tips, 125 blanks, 200 right machines
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "bench/registration/registration_goals.h"
#include "bench/registration/runs.h"

namespace {

double Rounded(double value) { return std::round(1e4 * value) / 1e4; }

}  // namespace

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  RunOptions options;
  bool quick = false;
  std::vector<std::string> only;
  CLI::App app("Registration against its Cramer-Rao bound and peers", "bench/run registration");
  app.add_flag("--quick", quick, "3 seeds, 40 noise draws, a tenth of the points and of the other draws");
  const CLI::Option* seeds = app.add_option("--seeds", options.seeds, "runs of C and of A")->check(CLI::Range(1, 1000));
  const CLI::Option* draws = app.add_option("--draws", options.noise_draws,
                                            "noise draws of C and of A; the parts after `threads` have their own")
                                 ->check(CLI::Range(2, 100000));
  double share = 1;
  app.add_option("--share", share, "of the draws of the parts after `threads`")->check(CLI::Range(0.01, 100.0));
  const CLI::Option* points = app.add_option("--points", options.points, "points of a scan")
                                  ->check(CLI::Range(std::size_t{1000}, std::size_t{100'000'000}));
  using Part = std::function<void(const PreparedBlade&, const RunOptions&, Figures*)>;
  const std::vector<std::pair<std::string, Part>> parts{
      {"generator", RunGenerator}, {"cases", RunCases},   {"noise", RunNoise},     {"distances", RunDistances},
      {"peers", RunPeers},         {"memory", RunMemory}, {"threads", RunThreads}, {"disagreement", RunDisagreement},
      {"weakness", RunWeakness},   {"trap", RunTrap},     {"coarse", RunCoarse},   {"overlap", RunOverlap},
      {"allowance", RunAllowance}};
  std::vector<std::string> names;
  for (const auto& part : parts) names.push_back(part.first);
  app.add_option("--only", only, "some parts")->delimiter(',')->check(CLI::IsMember(names));
  app.add_flag("--full-peers", options.full_peers, "peers get every point of A and D too (minutes)");
  app.add_option("--shared", options.shared, "folder with tools/registration_cases.py");
  app.add_option("--threads", options.threads, "threads")->check(CLI::Range(1, 64));
  CLI11_PARSE(app, argc, argv);
  if (quick) {
    if (seeds->empty()) options.seeds = 3;
    if (draws->empty()) options.noise_draws = 40;
    if (points->empty()) options.points = 100'000;
    options.memory_points = 1'000'000;
    share *= 0.1;
  }
  for (int* count : {&options.disagreement_draws, &options.power_draws, &options.trap_draws, &options.coarse_draws,
                     &options.weakness_draws, &options.overlap_draws, &options.allowance_draws})
    *count = std::max(2, static_cast<int>(std::lround(share * *count)));
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // who watches a long run by a pipe sees it too
  double load[1] = {0};
  getloadavg(load, 1);
  const PreparedBlade prepared = PrepareBlade(options.threads);
  std::printf("surface: %zu triangles, prepared in %.3f s; load of the machine %.1f\n", prepared.blade.normals.size(),
              prepared.prepare_s, load[0]);
  Figures figures;
  figures.values["prepare_seconds"] = prepared.prepare_s;
  GoalRun judged;
  judged.full = share >= 1 && options.seeds >= RunOptions().seeds && options.noise_draws >= RunOptions().noise_draws &&
                options.points >= RunOptions().points && options.memory_points >= RunOptions().memory_points;
  for (const auto& [name, run] : parts)
    if (only.empty() || std::find(only.begin(), only.end(), name) != only.end()) {
      const double begin = Seconds(), processor_begin = ProcessorSeconds();
      run(prepared, options, &figures);
      std::printf("  %s took %.0f s, of processors %.0f s\n", name.c_str(), Seconds() - begin,
                  ProcessorSeconds() - processor_begin);
      judged.parts.push_back(name);
    }
  nlohmann::json values = nlohmann::json::object();
  for (const auto& [name, value] : figures.values.items()) values[name] = Rounded(value.get<double>());
  values["failures"] = figures.failures;
  const int missed = PrintGoals(RegistrationGoals(), judged, figures.values);
  values["missed"] = missed;
  std::printf("\n%s\n", nlohmann::json({{"bench", "registration"}, {"figures", values}}).dump().c_str());
  return figures.failures + missed > 0 ? 1 : 0;
}
