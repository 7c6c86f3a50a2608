// The same kind of programme by Ipopt, an interior point method of its own: the least slack by which all limits can be kept, and of those the
// displacement of least energy. Every sum is written anew from the splines.
#pragma once

#include <optional>
#include <vector>

#include "metrology/reconstruction/limited_lattice.h"

namespace sixpoint::bench {

struct PeerAnswer {
  double slack_mm = 0;
  double seconds = 0;
  int iterations = 0;
};

// Unset where Ipopt gave up within the time.
std::optional<PeerAnswer> SolveByIpopt(const metrology::FreeFormDeformation& still,
                                       const std::vector<metrology::DisplacementLimit>& limits, double stiffness,
                                       double decay_mm, double longest_s);

}  // namespace sixpoint::bench
