#include "metrology/reconstruction/blank_stock.h"

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/surface_foot.h"

namespace sixpoint::metrology {

std::vector<std::optional<double>> StockOver(const Surface& design, const FreeFormDeformation* deformation,
                                             const std::vector<BlankPatch>& blank, double farthest_mm, int threads) {
  std::vector<std::optional<double>> stock_mm(blank.size());
  ForEachChunk(blank.size(), 256, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto foot = FootOf(design, deformation, blank[i].point_mm, blank[i].normal, farthest_mm);
      if (foot) stock_mm[i] = foot->distance_mm;
    }
  });
  return stock_mm;
}

}  // namespace sixpoint::metrology
