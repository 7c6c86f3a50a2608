#include "metrology/reconstruction/blank_stock.h"

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {

std::vector<std::optional<SurfaceFoot>> FeetOfBlank(const Surface& design, const FreeFormDeformation* deformation,
                                                    const std::vector<BlankPatch>& blank, double farthest_mm,
                                                    int threads) {
  std::vector<std::optional<SurfaceFoot>> feet(blank.size());
  ForEachChunk(blank.size(), 256, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      feet[i] = FootOf(design, deformation, blank[i].point_mm, blank[i].normal, farthest_mm);
  });
  return feet;
}

}  // namespace sixpoint::metrology
