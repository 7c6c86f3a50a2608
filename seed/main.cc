// sixpoint-seed: fills a plant's database with a made-up history. `sixpoint seed` starts it for the plant of this computer, and reads
// what it says on stdout: what was planted, or why nothing was.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "seed/seed_plant.h"

namespace {

using std::chrono::steady_clock;

// 1,000,000 results, at three a blade.
constexpr int kFullBlades = 333'400;

// A line now and then on stderr.
class Told {
 public:
  explicit Told(int total) : total_(total) {}
  void Show(int done) {
    const double seconds = Seconds();
    if (steady_clock::now() < next_ && done < total_) return;
    next_ = steady_clock::now() + std::chrono::seconds(isatty(STDERR_FILENO) != 0 ? 1 : 10);
    std::fprintf(stderr, "seeding: %d of %d blades, %.0f a second, %.0f s left\n", done, total_, done / seconds,
                 (total_ - done) * seconds / done);
  }
  double Seconds() const { return std::chrono::duration<double>(steady_clock::now() - began_).count(); }

 private:
  const int total_;
  const steady_clock::time_point began_ = steady_clock::now();
  steady_clock::time_point next_ = began_;
};

}  // namespace

int main(int argc, char** argv) {
  std::string conninfo;
  bool full = false;
  sixpoint::seed::Request request;
  CLI::App app("Fills a plant with a made-up history: for benches and pages, never for a plant that machines parts.",
               "sixpoint-seed");
  app.add_option("--database", conninfo, "Connection string of the record's owner, as libpq takes it")->required();
  app.add_option("--seed", request.options.seed, "Another plant each")->check(CLI::Range(0u, 999'999'999u));
  app.add_option("--blades", request.options.blade_count)->check(CLI::Range(1, 10'000'000));
  app.add_flag("--full", full, "1,000,000 results");
  app.add_option("--machines", request.options.machine_count)->check(CLI::Range(5, 200));
  app.add_option("--months", request.options.month_count, "Length of the history")->check(CLI::Range(4, 36));
  app.add_flag("--into-used-plant", request.into_used_plant, "Though it holds what was not seeded");
  CLI11_PARSE(app, argc, argv);
  if (full) request.options.blade_count = kFullBlades;
  Told told(request.options.blade_count);
  auto planted = sixpoint::seed::SeedPlant(conninfo, request, [&](int count) { told.Show(count); });
  if (!planted.ok()) {
    const nlohmann::json failed = {{"code", static_cast<int>(planted.status().code())},
                                   {"message", planted.status().message()}};
    std::printf("%s\n", nlohmann::json{{"failed", failed}}.dump().c_str());
    return 1;
  }
  (*planted)["took_s"] = told.Seconds();
  std::printf("%s\n", planted->dump().c_str());
  return 0;
}
