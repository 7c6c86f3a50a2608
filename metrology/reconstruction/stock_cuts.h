// Stock limits of the passes before that count on. At a thin edge the foot of a patch goes around it from pass to pass: by its own directions alone
// each pass would give back what the one before asked for. A limit along another direction asks no less than the stock: where all along which a
// patch was looked at are kept, passes come to an end. Used by ReconstructShape alone; of one
// lattice. Design's frame, mm (docs/methods/reconstruction.md, programme).
#pragma once

#include <vector>

#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/reconstruction/limited_lattice.h"

namespace sixpoint::metrology {

class StockCuts {
 public:
  // Else they are kept from the first way on that missed more than where it began.
  explicit StockCuts(bool from_start) : from_start_(from_start), is_on_(from_start) {}

  // Keeps those of the pass before whose direction is another in this one. Of more than a pass has limits itself none is kept: memory stays bounded.
  void TakeTurned(const std::vector<DisplacementLimit>& now);
  // Of a way that missed more than where it began: those that its end misses by more, as they stand there.
  void TakeMissed(const std::vector<DisplacementLimit>& there, const FreeFormDeformation& end, double more_than_mm);

  bool from_start() const { return from_start_; }
  bool empty() const { return cuts_.empty(); }
  // Where they cannot be kept together with this pass's own.
  void Clear();

  void AppendTo(std::vector<DisplacementLimit>* limits) const;
  // Pushes of what was appended behind `own_count` limits become pushes of their patches' own ones.
  std::vector<LimitPush> Owned(const std::vector<LimitPush>& pushes, std::size_t own_count) const;

 private:
  void Take(const DisplacementLimit& cut, std::size_t own);

  bool from_start_, is_on_;
  std::vector<DisplacementLimit> before_, cuts_;
  std::vector<std::size_t> own_of_;  // of each cut, its patch's limit
};

}  // namespace sixpoint::metrology
