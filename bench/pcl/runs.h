// The places at which PCL could stand in the product. Each part prints its tables and hands back its figures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "bench/pcl/tally.h"

namespace sixpoint::bench {

struct RunOptions {
  int seeds = 100;  // of each case
  int threads = 2;
  std::string shared;  // folder with data/plant-a and plant-b; may be absent
};

struct Figures {
  nlohmann::json values = nlohmann::json::object();
  void Add(const std::string& key, const Comparison& comparison) {
    values[key + "_failed_more_percent"] = comparison.failed_more_percent;
    values[key + "_error_ratio"] = comparison.error_ratio;
    values[key + "_time_ratio"] = comparison.time_ratio;
  }
};

void RunArtefact(const RunOptions& options, Figures* figures);
void RunPlantArtefacts(const RunOptions& options, Figures* figures);
void RunStart(const RunOptions& options, Figures* figures);
void RunPins(const RunOptions& options, Figures* figures);
void RunThinning(const RunOptions& options, Figures* figures);

}  // namespace sixpoint::bench
