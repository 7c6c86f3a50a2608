// What a data set says of its plant's errors: its block `error_sources` (docs/cli.md tells its keys).
#pragma once

#include "cli/document.h"
#include "cli/plant_run/dataset.h"

namespace sixpoint::cli {

// Into machine, scans and part, and what the run does with it; nothing where the block is not there. Unlike elsewhere in a data set a key
// that is not known is refused: an error that nobody reads is in no uncertainty.
void ReadErrorSources(const Field& root, Dataset* dataset);

}  // namespace sixpoint::cli
