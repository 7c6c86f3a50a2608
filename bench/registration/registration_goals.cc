#include "bench/registration/registration_goals.h"

#include "metrology/nearest/near_lanes.h"

namespace sixpoint::bench {

std::vector<Goal> RegistrationGoals() {
  constexpr auto kAlways = Goal::Counts::kAlways, kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  // Speed is a ratio to a peer in the same run, which any machine keeps; seconds are printed beside it.
  const bool wide = metrology::LaneWidths().back() == metrology::LaneWidth::kSixteen;
  std::vector<Goal> goals{
      {"cases", "c_error_over_bound", "C: error over bound", kNone, 1.2, kInFull},
      {"cases", "a_error_over_bound", "A: error over bound", kNone, 1.2, kInFull},
      {"cases", "d_worst_um", "D: worst error of 10 bumps, um", kNone, 1, kInFull},
      {"noise", "noise_c_variance_over_bound", "C, noise draws: squared error over bound", kNone, 1.15, kInFull},
      {"noise", "noise_a_variance_over_bound", "A, noise draws: squared error over bound", kNone, 1.15, kInFull},
      // Along the covariance's axes: by parameters, of which one direction leads all six in A, chance moves 200 draws by 1.5 %.
      {"noise", "noise_c_axes_coverage_percent", "C: 95 % intervals along the covariance's axes cover, %", 93, 97.5,
       kInFull},
      {"noise", "noise_a_axes_coverage_percent", "A: 95 % intervals along the covariance's axes cover, %", 93, 97.5,
       kInFull},
      {"distances", "distances_over_embree", "distances, an eighth beyond 50 um: over Embree's", wide ? 10 : 5, kNone,
       kInFull},
      {"distances", "distances_worst_um", "distances: worst error, um", kNone, 0.1, kAlways},
      {"distances", "distances_wrong_signs", "distances: wrong signs of 2000", kNone, 0, kAlways},
      {"peers", "times_faster_than_pcl", "C: times faster than PCL point to plane", 40, kNone, kInFull},
      {"memory", "memory_mb", "memory of a fit of 10 million points, MB", kNone, 200, kInFull},
      {"threads", "same_bits", "the same bits on 1 and 2 threads", 1, kNone, kAlways},
      {"disagreement", "disagreement_false_percent", "SIX_POINT and LOCAL against BEST_FIT: false flags, %", kNone, 1,
       kInFull},
      {"trap", "trap_wrong_and_silent", "the tip alone holds the span: wrong and silent", kNone, 0, kAlways},
      {"trap", "trap_right_percent", "the tip alone holds the span: right, %", 99, kNone, kInFull},
      {"coarse", "coarse_wrong_and_silent", "coarse start: wrong and silent", kNone, 0, kAlways},
      {"coarse", "coarse_whole_found_percent", "coarse start, whole blade: found, %", 99, kNone, kInFull},
      {"overlap", "overlap_false_percent", "overlaps, right calibrations: flagged, %", kNone, 1, kInFull},
      {"overlap", "overlap_seen_um", "overlaps: error of the rotation centre seen in 95 % of draws, um", kNone, 15,
       kInFull},
      {"allowance", "allowance_wrong", "ALLOWANCE: wrong answers at margins of 5 um and more", kNone, 0, kAlways},
      {"allowance", "allowance_worst_depth_um", "ALLOWANCE: worst error of the depth lacking, um", kNone, 3, kInFull},
  };
  if (wide)
    goals.push_back({"distances", "distances_over_embree_by_lanes_8", "distances, as without AVX-512: over Embree's", 5,
                     kNone, kInFull});
  return goals;
}

}  // namespace sixpoint::bench
