// Thinned scans of the last inspections' registrations. An inspection that compares positionings registers the same scans up to three
// times: each is downloaded, decoded and thinned for all of them once.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "metrology/registration/scan_portion.h"
#include "services/clients/scans.h"

namespace sixpoint::registration {

struct KeptPortion {
  clients::StoredBlocks stored;  // as it came, without its blocks
  std::vector<double> determinants;
  metrology::Points dense_places_mm;
  metrology::ScanPortion portion;

  std::size_t bytes() const;
};

// Within a limit of memory, beyond what is in use: the least recently used go first. Thread-safe.
class KeptPortions {
 public:
  explicit KeptPortions(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}
  // By scans/{id}; nothing where it is not kept.
  std::shared_ptr<const KeptPortion> Find(const std::string& scan) const;
  // Instead of what was kept of the scan.
  void Keep(const std::string& scan, KeptPortion portion);

 private:
  struct Entry {
    std::string scan;
    std::size_t bytes;
    std::shared_ptr<const KeptPortion> portion;
  };
  std::list<Entry>::iterator Locate(const std::string& scan) const;

  const std::size_t limit_bytes_;
  mutable std::mutex mutex_;
  mutable std::list<Entry> entries_;  // newest use first
};

}  // namespace sixpoint::registration
