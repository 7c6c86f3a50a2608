// What `bench/run ground` asks of the house's own storage; the last line is one JSON object.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/ground/runs.h"

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  std::string conninfo, folder;
  int blade_count = 2000, writer_count = 8;
  double seconds = 15;
  CLI::App app("The record under load", "sixpoint-bench-ground");
  app.add_option("--database", conninfo)->required();
  app.add_option("--folder", folder);
  app.require_subcommand(1);
  app.fallthrough();
  const auto print = [](const nlohmann::json& figures) { std::printf("%s\n", figures.dump().c_str()); };
  CLI::App* sizes = app.add_subcommand("sizes", "Rows and bytes of a blade");
  sizes->add_option("--blades", blade_count)->check(CLI::Range(10, 1'000'000));
  sizes->callback([&] { print(MeasureSizes(conninfo, blade_count)); });
  CLI::App* journal = app.add_subcommand("journal", "How long its lock is held, and what writers reach");
  journal->add_option("--writers", writer_count)->check(CLI::Range(1, 64));
  journal->add_option("--seconds", seconds)->check(CLI::Range(1.0, 600.0));
  journal->callback([&] { print(MeasureJournal(conninfo, folder, writer_count, seconds)); });
  CLI::App* frozen = app.add_subcommand("frozen", "A holder that freezes");
  frozen->callback([&] { print(MeasureFrozenHolder(conninfo)); });
  CLI11_PARSE(app, argc, argv);
  return 0;
}
