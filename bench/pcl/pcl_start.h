// The part found from any turn as one would do it with PCL: fast point feature histograms, consensus over them, and iterative
// closest points, point to plane.
#pragma once

#include <memory>
#include <optional>

#include "bench/registration/machine_scans.h"

namespace sixpoint::bench {

enum class StartBy { kPrerejection, kSacIa };

class PclStart {
 public:
  // Samples the blade and finds its features, which a plant would keep with the surface.
  explicit PclStart(const Blade& blade);
  ~PclStart();

  // zero_from_part. PCL draws by rand(): seeded, alone, the same every time.
  std::optional<Eigen::Isometry3d> Find(const std::vector<metrology::ScanPortion>& portions, StartBy by) const;

 private:
  struct Model;
  std::unique_ptr<Model> model_;
};

}  // namespace sixpoint::bench
