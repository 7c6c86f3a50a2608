// The parts of `bench/run ground` that need the house's own storage; each gives its figures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::bench {

// Rows and bytes that so many blades add to the database, a blade, by table.
nlohmann::json MeasureSizes(const std::string& conninfo, int blade_count);
// A mixed load (blades, scans of 40 blocks, parts' artefacts of 1000 features) by so many writers for so long: how long the journal's
// lock was held, as pg_locks shows it, and commits a second beside one commit after another; folder: on the database's disk, where
// flushes are timed.
nlohmann::json MeasureJournal(const std::string& conninfo, const std::string& folder, int writer_count, double seconds);
// A process that freezes in the journal's lock: how long another's commit takes.
nlohmann::json MeasureFrozenHolder(const std::string& conninfo);

}  // namespace sixpoint::bench
