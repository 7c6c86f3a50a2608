// What ingest counts, and tells of the store, to whoever watches (docs/observing.md).
#pragma once

#include <memory>

#include "services/runtime/metrics.h"
#include "services/runtime/sampler.h"

namespace sixpoint::ingest {

// What was acknowledged for the first time: what comes again counts once.
struct IngestMetrics {
  runtime::Counter scans{"sixpoint_ingest_scans_total", "Scans that were completed."};
  runtime::Counter blocks{"sixpoint_ingest_blocks_total", "Blocks that were taken in."};
  runtime::Counter points{"sixpoint_ingest_points_total", "Points of these blocks."};
  runtime::Counter sent_bytes{"sixpoint_ingest_sent_bytes_total", "Bytes of these blocks as they were sent."};
  runtime::Counter stored_bytes{"sixpoint_ingest_stored_bytes_total", "Bytes of these blocks as they are kept."};
  runtime::CounterBy rejected{
      "sixpoint_ingest_rejected_blocks_total",
      "Blocks that were refused for what is in them: draco, profiles: they cannot be decoded; "
      "statistics: their points are not what the scan says; error_bound: they cannot be kept so.",
      "reason",
      {"draco", "profiles", "statistics", "error_bound"}};
};
IngestMetrics& Metrics();

// most_postgresql_bytes: of clouds that PostgreSQL may hold.
std::unique_ptr<runtime::Sampled> StoreSampled(double most_postgresql_bytes);

}  // namespace sixpoint::ingest
