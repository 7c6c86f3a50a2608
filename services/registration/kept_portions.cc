#include "services/registration/kept_portions.h"

#include <algorithm>
#include <utility>

namespace sixpoint::registration {

std::size_t KeptPortion::bytes() const {
  constexpr std::size_t kCompactBytes = 12;
  return sizeof *this + portion.sensor.size() * kCompactBytes +
         (portion.dense_sensor_mm.size() + portion.dense_zero_mm.size()) * sizeof(Eigen::Vector3d);
}

std::list<KeptPortions::Entry>::iterator KeptPortions::Locate(const std::string& scan) const {
  return std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.scan == scan; });
}

std::shared_ptr<const KeptPortion> KeptPortions::Find(const std::string& scan) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = Locate(scan);
  if (found == entries_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->portion;
}

void KeptPortions::Keep(const std::string& scan, KeptPortion portion) {
  const std::size_t bytes = portion.bytes();
  if (bytes > limit_bytes_) return;
  std::list<Entry> made;
  made.push_back({scan, bytes, std::make_shared<const KeptPortion>(std::move(portion))});
  std::list<Entry> gone;  // destroyed once the lock is
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto known = Locate(scan); known != entries_.end()) gone.splice(gone.end(), entries_, known);
  entries_.splice(entries_.begin(), made);
  std::size_t all = 0;
  for (const Entry& entry : entries_) all += entry.bytes;
  while (all > limit_bytes_) {
    all -= entries_.back().bytes;
    gone.splice(gone.end(), entries_, std::prev(entries_.end()));
  }
}

}  // namespace sixpoint::registration
