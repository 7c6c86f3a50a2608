// What a changed tool path leaves otherwise than the path that it was made from: the material that both take, each from its own surface,
// simulated and compared (docs/methods/reconstruction.md, path).
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/milling/removal.h"

namespace sixpoint::metrology {

// Dexels on a surface, and an open path beside it: centres and axes of a tool whose end is a ball about the centre.
struct CutBeside {
  std::vector<Dexel> dexels;
  std::vector<ToolPlace> places;
};

struct RemovalDifference {
  std::size_t compared_count = 0;  // dexels that either path comes upon
  double deepest_mm = 0;           // below what the first leaves of its surface, and below the second's; 0: nowhere
  double most_rest_mm = 0;  // above what the first leaves, where that touches its surface within touch_mm; 0: nowhere
};

// The second's dexels are the first's, moved. depth_mm: of both surfaces, to be looked at. INVALID_ARGUMENT: other numbers of dexels or places.
absl::StatusOr<RemovalDifference> CompareRemoval(const CutBeside& first, const CutBeside& second, const BallMill& mill,
                                                 double depth_mm, double touch_mm, int threads);

}  // namespace sixpoint::metrology
